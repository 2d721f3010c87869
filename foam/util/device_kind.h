// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace semfoam {

// Runs on devices of one kind have the same bytes.
enum class DeviceKind { kCpu, kGpu };

}  // namespace semfoam
