// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/cli/input_protection.h"

#include "foam/util/error.h"
#include "tools/images/image_files.h"

#include <optional>
#include <set>
#include <utility>

#include <sys/stat.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

// Device and inode: what a file is, whatever it is called. Thousands of photos are compared so.
using FileIdentity = std::pair<dev_t, ino_t>;

std::optional<FileIdentity> IdentityOf(const fs::path& path) {
  struct stat status = {};
  if (::stat(path.c_str(), &status) != 0) return std::nullopt;
  return FileIdentity(status.st_dev, status.st_ino);
}

}  // namespace

void CheckNoInputOverwrite(const std::vector<fs::path>& inputs,
                           const std::vector<fs::path>& outputs,
                           const std::string& field) {
  std::set<FileIdentity> read;
  for (const fs::path& input : inputs) {
    if (const std::optional<FileIdentity> identity = IdentityOf(input)) read.insert(*identity);
  }
  for (const fs::path& output : outputs) {
    const std::optional<FileIdentity> identity = IdentityOf(output);
    if (!identity || read.count(*identity) == 0) continue;
    throw UserError(
        output.string(), ": is read, so it will not be written; give another ", Field{field}, ".");
  }
}

void RequireOwnImages(const std::vector<fs::path>& images, const std::string& field) {
  for (const fs::path& image : images) {
    if (!fs::is_regular_file(fs::symlink_status(image)) || IsOwnImage(image)) continue;
    throw UserError(image.string(),
                    ": was not written by this program and would be lost; give another ",
                    Field{field},
                    ".");
  }
}

}  // namespace semfoam
