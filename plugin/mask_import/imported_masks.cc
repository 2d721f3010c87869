// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask_import/imported_masks.h"

#include "foam/util/error.h"
#include "plugin/util/files.h"
#include "plugin/util/plural.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include <glog/logging.h>

namespace semfoam {

namespace fs = std::filesystem;

NameTable::NameTable(std::vector<std::string>* names) : names_(names) {
  for (size_t i = 0; i < names->size(); ++i) {
    indices_.emplace((*names)[i], static_cast<int32_t>(i));
  }
}

int32_t NameTable::IndexOf(const std::string& name) {
  if (name.empty()) return -1;
  const auto [found, is_new] = indices_.emplace(name, static_cast<int32_t>(names_->size()));
  if (is_new) names_->push_back(name);
  return found->second;
}

ImportedMasks ReadPictures(
    const std::string& format,
    const std::vector<fs::path>& files,
    const std::function<std::optional<PictureContents>(const fs::path& file)>& read) {
  return ReadPictureLists(format, files, [read](const fs::path& file) {
    std::vector<PictureContents> pictures;
    if (std::optional<PictureContents> one = read(file)) pictures.push_back(std::move(*one));
    return pictures;
  });
}

ImportedMasks ReadPictureLists(
    const std::string& format,
    const std::vector<fs::path>& files,
    const std::function<std::vector<PictureContents>(const fs::path& file)>& read) {
  std::vector<std::vector<PictureContents>> contents(files.size());
  ForEachFile(static_cast<int64_t>(files.size()), [&](int64_t i) {
    contents[i] = read(files[i]);
    for (PictureContents& picture : contents[i]) picture.draw = nullptr;  // and with it the pixels
  });
  ImportedMasks masks;
  masks.format = format;
  NameTable names(&masks.names);
  std::map<std::string, int64_t> left_out;
  for (size_t i = 0; i < files.size(); ++i) {
    if (contents[i].empty()) ++left_out["file of another form"];
    for (size_t k = 0; k < contents[i].size(); ++k) {
      const PictureContents& content = contents[i][k];
      ImportedPicture picture{files[i], content.name, content.size, {}, content.strokes, nullptr};
      for (const PictureContents::Region& region : content.regions) {
        picture.regions.push_back({names.IndexOf(region.name), region.track, region.score});
      }
      for (const auto& [what, count] : content.left_out) left_out[what] += count;
      picture.draw = [file = files[i], k, read, count = picture.regions.size()](
                         const PhotoSize& size) {
        const std::vector<PictureContents> again = read(file);
        if (again.size() <= k || again[k].regions.size() != count) {
          throw UserError(file.string(), ": has changed while it was read; a second run may help.");
        }
        return again[k].draw(size);
      };
      masks.pictures.push_back(std::move(picture));
    }
  }
  for (const auto& [what, count] : left_out) {
    masks.left_out.push_back(Plural(count, what.c_str()));
  }
  return masks;
}

LabelImage PaintRegions(const PhotoSize& size,
                        const std::vector<PixelRuns>& runs,
                        const std::vector<int32_t>& ids) {
  CHECK_EQ(runs.size(), ids.size());
  std::vector<int64_t> areas;
  areas.reserve(runs.size());
  for (const PixelRuns& region : runs) areas.push_back(AreaOf(region));
  std::vector<size_t> order(runs.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::stable_sort(
      order.begin(), order.end(), [&](size_t a, size_t b) { return areas[a] > areas[b]; });
  LabelImage image{size.width, size.height, {}};
  image.data.resize(static_cast<size_t>(size.width) * size.height, 0);
  const auto num_pixels = static_cast<int64_t>(image.data.size());
  for (const size_t i : order) {
    for (const PixelRun& run : runs[i]) {
      CHECK(0 <= run.begin && run.begin <= run.end && run.end <= num_pixels);
      std::fill(image.data.begin() + run.begin, image.data.begin() + run.end, ids[i]);
    }
  }
  return image;
}

}  // namespace semfoam
