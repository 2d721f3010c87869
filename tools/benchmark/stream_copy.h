// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace semfoam {

// The bound of all that lives in memory: bytes per second, read and written ones counted, at which
// `num_threads` threads copy an array of 256 MiB, far larger than the caches, to another one; the
// best of several times (as STREAM, McCalpin 1995, counts).
double StreamCopyBytesPerSecond(int num_threads);

}  // namespace semfoam
