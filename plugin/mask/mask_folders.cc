// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask/mask_folders.h"

#include "plugin/util/files.h"

#include <algorithm>
#include <iterator>
#include <system_error>
#include <utility>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

constexpr const char* kMaskFolders[] = {"object_mask", "Annotations"};
constexpr size_t kMostExtensions = 3;  // that are named

std::string Lowercase(std::string text) {
  for (char& c : text) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return text;
}

// "16 .jpg files and 1 .json file"; empty for a folder without files.
std::string FilesIn(const fs::path& folder) {
  std::map<std::string, int> counts;
  for (const fs::path& file : ListFiles(folder)) ++counts[Lowercase(file.extension().string())];
  std::vector<std::pair<std::string, int>> extensions(counts.begin(), counts.end());
  std::stable_sort(extensions.begin(), extensions.end(), [](const auto& a, const auto& b) {
    return a.second > b.second;
  });
  const size_t named = std::min(extensions.size(), kMostExtensions);
  std::string text;
  for (size_t i = 0; i < named; ++i) {
    const auto& [extension, count] = extensions[i];
    if (i > 0) text += i + 1 == named && named == extensions.size() ? " and " : ", ";
    text += std::to_string(count) + " " + (extension.empty() ? "other" : extension) + " file" +
            (count == 1 ? "" : "s");
  }
  return named < extensions.size() ? text + " and others" : text;
}

}  // namespace

fs::path FindMaskFolder(const fs::path& workspace) {
  for (const char* name : kMaskFolders) {
    if (fs::is_directory(workspace / name)) return workspace / name;
  }
  return {};
}

std::map<std::string, fs::path> ListMasks(const fs::path& folder) {
  std::map<std::string, fs::path> masks;
  for (const fs::path& path : ListFiles(folder)) {
    if (Lowercase(path.extension().string()) != ".png") continue;
    fs::path name = path.lexically_relative(folder);
    name.replace_extension(".png");
    masks.emplace(name.generic_string(), path);
  }
  return masks;
}

std::vector<fs::path> UnusedMaskFolders(const fs::path& workspace) {
  std::vector<fs::path> folders;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(workspace, error)) {
    std::error_code unreadable;
    if (!entry.is_directory(unreadable)) continue;
    const std::string name = entry.path().filename().string();
    const std::string lowercase = Lowercase(name);
    if (name.starts_with('.') || name == FindMaskFolder(workspace).filename() ||
        (lowercase.find("mask") == std::string::npos &&
         lowercase.find("annotation") == std::string::npos)) {
      continue;
    }
    if (!ListMasks(entry.path()).empty()) folders.push_back(entry.path());
  }
  std::sort(folders.begin(), folders.end());
  return folders;
}

std::string NoMaskIn(const fs::path& folder) {
  const std::string files = FilesIn(folder);
  return folder.string() + ": " + (files.empty() ? "is empty" : "holds no mask but " + files) +
         ", where a PNG for each photo would be right";
}

std::string NoMasksWarning(const fs::path& mask_folder, const std::vector<fs::path>& workspaces) {
  for (const fs::path& workspace : workspaces) {
    const std::vector<fs::path> unused = UnusedMaskFolders(workspace);
    if (unused.empty()) continue;
    const std::string holds = unused[0].string() + " holds " +
                              std::to_string(ListMasks(unused[0]).size()) + " .png files";
    if (!mask_folder.empty()) {
      return NoMaskIn(mask_folder) + ", so there are no labels; " + holds +
             ", and mask_path would take it.";
    }
    return holds +
           " and is not looked at, so there are no labels; object_mask/ or Annotations/ "
           "would be looked at, and mask_path would take it.";
  }
  return mask_folder.empty() ? "" : NoMaskIn(mask_folder) + ", so there are no labels.";
}

}  // namespace semfoam
