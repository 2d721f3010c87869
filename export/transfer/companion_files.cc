// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/transfer/companion_files.h"

#include "foam/util/error.h"
#include "foam/util/input_file.h"
#include "foam/util/output_file.h"

#include <algorithm>
#include <string>
#include <system_error>

namespace semfoam {

namespace fs = std::filesystem;

void AddCompanionFile(const fs::path& from_folder,
                      const fs::path& to_folder,
                      std::string_view name,
                      CompanionFiles* files) {
  const fs::path relative = fs::path(std::string(name)).lexically_normal();
  if (relative.empty() || relative.is_absolute() || *relative.begin() == "..") return;
  const fs::path from = from_folder / relative, to = to_folder / relative;
  std::error_code error;
  if (!fs::is_regular_file(from, error)) return;
  const auto is_same = [&](const auto& file) { return file.second == to; };
  if (std::any_of(files->begin(), files->end(), is_same)) return;
  if (fs::exists(to) &&
      (!fs::is_regular_file(to) || ReadFileBytes(to, "a file") != ReadFileBytes(from, "a file"))) {
    throw UserError(to.string(),
                    ": differs from ",
                    from.string(),
                    ", which belongs beside the labelled file; give another folder or move it.");
  }
  files->emplace_back(from, to);
}

void CopyFiles(const CompanionFiles& files) {
  for (const auto& [from, to] : files) WriteTextFile(to, ReadFileBytes(from, "a file"));
}

}  // namespace semfoam
