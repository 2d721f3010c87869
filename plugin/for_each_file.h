// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <functional>

namespace semfoam {

// Calls body(0) .. body(count - 1) in parallel. Where some throw UserError, rethrows the one with
// the lowest index, whatever the threads did, once all have ended.
void ForEachFile(int64_t count, const std::function<void(int64_t index)>& body);

}  // namespace semfoam
