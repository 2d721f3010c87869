// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>

namespace semfoam {

// Bytes that this process can still take: the least of what the machine has left (MemAvailable),
// what the control groups that it is in, and theirs above, allow (versions 1 and 2; file cache that
// can be dropped counts as free), and what its limits of address space and data allow (ulimit -v,
// -d). What the system does not tell is no limit; the largest int64_t if it tells nothing. The
// arguments are for tests.
int64_t AvailableMemory(const std::filesystem::path& proc = "/proc",
                        const std::filesystem::path& cgroups = "/sys/fs/cgroup");

}  // namespace semfoam
