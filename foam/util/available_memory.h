// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>

namespace semfoam {

// Returns the number of bytes that this process can still allocate: the minimum of the machine's
// available memory (MemAvailable), of what its control groups and their parents allow (versions 1
// and 2; file cache that can be dropped counts as free), and of its limits of address space and
// data (ulimit -v, -d). A value that the system does not report is no limit; without any, returns
// the largest int64_t. Tests pass other folders than /proc and /sys/fs/cgroup.
int64_t AvailableMemory(const std::filesystem::path& proc = "/proc",
                        const std::filesystem::path& cgroups = "/sys/fs/cgroup");

}  // namespace semfoam
