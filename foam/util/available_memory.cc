// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/util/available_memory.h"

#include <algorithm>
#include <fstream>
#include <limits>
#include <optional>
#include <sstream>
#include <string>

#include <sys/resource.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

// The number behind `key` in a file of lines "key 123" or "key:  123 kB"; an empty key takes the
// file's first word. None where there is no such number ("max").
std::optional<int64_t> ReadNumber(const fs::path& file, const std::string& key) {
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) {
    std::istringstream words(line);
    std::string word;
    if (!key.empty() && (!(words >> word) || (word != key && word != key + ":"))) continue;
    int64_t value;
    std::string unit;
    if (!(words >> value)) return std::nullopt;
    words >> unit;
    return unit == "kB" ? value * 1024 : value;
  }
  return std::nullopt;
}

// What a control group and those above it allow. Where `group` is not below `root`, as in a
// container that sees its own group as the root, the root is what counts.
int64_t LeftInGroups(const fs::path& root,
                     const fs::path& group,
                     const char* limit_file,
                     const char* use_file,
                     const char* cache_key) {
  int64_t least = std::numeric_limits<int64_t>::max();
  fs::path relative = group.relative_path();
  while (true) {
    const fs::path folder = root / relative;
    const std::optional<int64_t> limit = ReadNumber(folder / limit_file, "");
    const std::optional<int64_t> use = ReadNumber(folder / use_file, "");
    if (limit && use) {
      const int64_t cache = ReadNumber(folder / "memory.stat", cache_key).value_or(0);
      least = std::min(least, std::max<int64_t>(0, *limit - std::max<int64_t>(0, *use - cache)));
    }
    if (relative.empty()) return least;
    relative = relative.parent_path();
  }
}

int64_t LeftInGroups(const fs::path& proc, const fs::path& cgroups) {
  int64_t least = std::numeric_limits<int64_t>::max();
  // Lines "4:memory:/a/b" (version 1) and "0::/a/b" (version 2).
  std::ifstream in(proc / "self" / "cgroup");
  for (std::string line; std::getline(in, line);) {
    const size_t first = line.find(':');
    const size_t second = first == std::string::npos ? first : line.find(':', first + 1);
    if (second == std::string::npos) continue;
    const std::string controllers = line.substr(first + 1, second - first - 1);
    const fs::path group = line.substr(second + 1);
    if (controllers.empty()) {
      least = std::min(
          least, LeftInGroups(cgroups, group, "memory.max", "memory.current", "inactive_file"));
    } else if (("," + controllers + ",").find(",memory,") != std::string::npos) {
      least = std::min(least,
                       LeftInGroups(cgroups / "memory",
                                    group,
                                    "memory.limit_in_bytes",
                                    "memory.usage_in_bytes",
                                    "total_inactive_file"));
    }
  }
  return least;
}

int64_t LeftOfLimit(int resource, int64_t used) {
  rlimit limit;
  if (::getrlimit(resource, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY ||
      limit.rlim_cur > static_cast<rlim_t>(std::numeric_limits<int64_t>::max())) {
    return std::numeric_limits<int64_t>::max();
  }
  return std::max<int64_t>(0, static_cast<int64_t>(limit.rlim_cur) - used);
}

}  // namespace

int64_t AvailableMemory(const fs::path& proc, const fs::path& cgroups) {
  const fs::path status = proc / "self" / "status";
  return std::min(
      {ReadNumber(proc / "meminfo", "MemAvailable").value_or(std::numeric_limits<int64_t>::max()),
       LeftInGroups(proc, cgroups),
       LeftOfLimit(RLIMIT_AS, ReadNumber(status, "VmSize").value_or(0)),
       LeftOfLimit(RLIMIT_DATA, ReadNumber(status, "VmData").value_or(0))});
}

}  // namespace semfoam
