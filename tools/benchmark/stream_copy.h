// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace semfoam {

// Measures the memory bandwidth, the upper bound of all memory-bound code: the bytes per second,
// read plus written, at which `num_threads` threads copy an array of 256 MiB, far larger than the
// caches, to another one; the best of several runs (like STREAM, McCalpin 1995).
double StreamCopyBytesPerSecond(int num_threads);

}  // namespace semfoam
