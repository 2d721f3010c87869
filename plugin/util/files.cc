// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/util/files.h"

#include "foam/util/error.h"
#include "foam/util/parallel.h"

#include <algorithm>
#include <cctype>
#include <exception>
#include <semaphore>
#include <set>
#include <string>
#include <system_error>

namespace semfoam {

void ForEachFile(int64_t count, const std::function<void(int64_t index)>& body) {
  std::vector<std::exception_ptr> errors(count);
  ParallelForBlocks(count, 1, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) {
      try {
        body(i);
      } catch (const UserError&) {
        errors[i] = std::current_exception();
      }
    }
  });
  for (const std::exception_ptr& error : errors) {
    if (error) std::rethrow_exception(error);
  }
}

void ForEachFile(int64_t count, int most_at_once, const std::function<void(int64_t index)>& body) {
  std::counting_semaphore<> free(most_at_once);
  ForEachFile(count, [&](int64_t index) {
    free.acquire();
    try {
      body(index);
    } catch (...) {
      free.release();
      throw;
    }
    free.release();
  });
}

std::vector<std::filesystem::path> ListFiles(const std::filesystem::path& folder) {
  namespace fs = std::filesystem;
  constexpr int kMaxDepth = 16;
  std::vector<fs::path> files;
  std::error_code error;
  fs::recursive_directory_iterator entry(folder,
                                         fs::directory_options::follow_directory_symlink |
                                             fs::directory_options::skip_permission_denied,
                                         error);
  for (; !error && entry != fs::recursive_directory_iterator(); entry.increment(error)) {
    std::error_code unreadable;
    const bool hidden = entry->path().filename().string().starts_with('.');
    if (hidden || entry.depth() >= kMaxDepth) entry.disable_recursion_pending();
    if (!hidden && entry->is_regular_file(unreadable)) files.push_back(entry->path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

std::vector<std::filesystem::path> ListPhotos(const std::filesystem::path& folder) {
  static const std::set<std::string> kExtensions = {
      ".jpg", ".jpeg", ".png", ".tif", ".tiff", ".bmp", ".webp", ".ppm"};
  std::vector<std::filesystem::path> photos = ListFiles(folder);
  std::erase_if(photos, [](const std::filesystem::path& path) {
    std::string extension = path.extension().string();
    std::transform(extension.begin(), extension.end(), extension.begin(), [](unsigned char c) {
      return static_cast<char>(std::tolower(c));
    });
    return !kExtensions.contains(extension);
  });
  return photos;
}

std::filesystem::path ParentFolder(const std::filesystem::path& path) {
  const std::filesystem::path normal = path.lexically_normal();
  return (normal.has_filename() ? normal : normal.parent_path()).parent_path();
}

}  // namespace semfoam
