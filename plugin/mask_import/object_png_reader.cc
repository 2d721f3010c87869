// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask_import/object_png_reader.h"

#include "foam/util/error.h"
#include "plugin/mask/mask_png.h"
#include "plugin/mask_import/one_object_png.h"
#include "plugin/util/files.h"

#include <algorithm>
#include <charconv>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

constexpr int64_t kLargestId = 65535;

// The number that the whole of a name is.
std::optional<int64_t> IdOf(const std::string& name) {
  int64_t id = 0;
  const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), id);
  if (error != std::errc() || end != name.data() + name.size() || id < 1 || id > kLargestId) {
    return std::nullopt;
  }
  return id;
}

// The folder of the object, below `root`, and the name of the picture without it.
struct ObjectFile {
  std::string object;
  std::string picture;
};

ObjectFile SplitUp(const fs::path& root, const fs::path& file) {
  const fs::path name = file.lexically_relative(root);
  return {name.parent_path().generic_string(),
          (name.parent_path().parent_path() / name.filename()).generic_string()};
}

// Reads the masks of one picture, and checks their sizes.
std::vector<PixelRuns> ReadAll(const std::vector<fs::path>& files, const PhotoSize& size) {
  std::vector<PixelRuns> runs;
  for (const fs::path& file : files) {
    OneObject object = ReadOneObject(file);
    if (object.size != size) {
      throw UserError(file.string(),
                      ": has ",
                      object.size.width,
                      " x ",
                      object.size.height,
                      " pixels, where the mask of another object in this photo has ",
                      size.width,
                      " x ",
                      size.height,
                      "; the same size would be right.");
    }
    runs.push_back(std::move(object.runs));
  }
  return runs;
}

}  // namespace

ImportedMasks ReadObjectPngs(const fs::path& folder, const std::vector<fs::path>& files) {
  std::map<std::string, std::vector<fs::path>> of_picture;
  std::set<std::string> objects;
  for (const fs::path& file : files) {
    const ObjectFile parts = SplitUp(folder, file);
    of_picture[parts.picture].push_back(file);
    objects.insert(parts.object);
  }
  const bool are_ids = std::all_of(objects.begin(), objects.end(), [&](const std::string& object) {
    return IdOf(fs::path(object).filename().string()).has_value();
  });
  // The same number in two videos is not the same object.
  std::set<std::string> videos;
  for (const std::string& object : objects) {
    videos.insert(fs::path(object).parent_path().generic_string());
  }
  std::map<std::string, int64_t> ids;
  for (const std::string& object : objects) {
    const auto next = static_cast<int64_t>(ids.size()) + 1;
    const std::string name = fs::path(object).filename().string();
    ids.emplace(object, are_ids && videos.size() == 1 ? *IdOf(name) : next);
  }
  ImportedMasks masks;
  masks.format = "PNGs of single objects";
  NameTable names(&masks.names);
  for (auto& [name, of_objects] : of_picture) {
    const PhotoSize size = ReadMaskHeader(of_objects[0]).size;
    ImportedPicture picture{of_objects[0], name, size, {}, {}, nullptr};
    for (const fs::path& file : of_objects) {
      const std::string object = SplitUp(folder, file).object;
      const std::string of_folder = fs::path(object).filename().string();
      picture.regions.push_back({are_ids ? -1 : names.IndexOf(of_folder), ids.at(object)});
    }
    picture.draw = [files = of_objects](const PhotoSize& its_size) {
      return ReadAll(files, its_size);
    };
    masks.pictures.push_back(std::move(picture));
  }
  return masks;
}

bool AreObjectPngs(const fs::path& folder, const std::vector<fs::path>& files) {
  std::set<std::string> seen;
  for (const fs::path& file : files) {
    const std::string object = SplitUp(folder, file).object;
    if (object.empty()) return false;
    if (!seen.insert(object).second) continue;
    std::set<uint32_t> values;
    ReadMaskRows(file, [&](const MaskHeader&, int, std::span<const uint32_t> row) {
      for (const uint32_t value : row) {
        if (value != 0 && values.size() < 2) values.insert(value);
      }
    });
    if (values.size() > 1) return false;
    if (!values.empty() && *values.begin() != 1 && *values.begin() != 255) return false;
  }
  return !files.empty();
}

}  // namespace semfoam
