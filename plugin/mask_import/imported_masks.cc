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
  std::vector<std::optional<PictureContents>> contents(files.size());
  ForEachFile(static_cast<int64_t>(files.size()), [&](int64_t i) {
    contents[i] = read(files[i]);
    if (contents[i]) contents[i]->draw = nullptr;  // and with it the pixels
  });
  ImportedMasks masks;
  masks.format = format;
  NameTable names(&masks.names);
  std::map<std::string, int64_t> left_out;
  for (size_t i = 0; i < files.size(); ++i) {
    if (!contents[i]) {
      ++left_out["file of another form"];
      continue;
    }
    ImportedPicture picture{
        files[i], contents[i]->name, contents[i]->size, {}, contents[i]->strokes, nullptr};
    for (const PictureContents::Region& region : contents[i]->regions) {
      picture.regions.push_back({names.IndexOf(region.name), region.track, region.score});
    }
    for (const auto& [what, count] : contents[i]->left_out) left_out[what] += count;
    picture.draw = [file = files[i], read, count = picture.regions.size()](const PhotoSize& size) {
      const std::optional<PictureContents> again = read(file);
      if (!again || again->regions.size() != count) {
        throw UserError(file.string(), ": has changed while it was read; a second run may help.");
      }
      return again->draw(size);
    };
    masks.pictures.push_back(std::move(picture));
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
