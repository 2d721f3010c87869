// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace semfoam {

// The kind of a device. Runs on devices of the same kind produce the same bytes.
enum class DeviceKind { kCpu, kGpu };

}  // namespace semfoam
