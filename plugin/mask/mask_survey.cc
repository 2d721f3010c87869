// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask/mask_survey.h"

#include "foam/util/error.h"
#include "foam/util/parallel.h"
#include "plugin/mask/mask_png.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace semfoam {

std::vector<MaskFile> SurveyMasks(const std::vector<std::filesystem::path>& masks) {
  std::vector<MaskFile> files(masks.size());
  ParallelForBlocks(static_cast<int64_t>(masks.size()), 1, [&](int64_t i, int64_t) {
    if (masks[i].empty()) return;
    try {
      // Every row is decoded, and none is kept: to find what is damaged.
      const MaskHeader header = ReadMaskRows(masks[i], [](const auto&, int, auto) {});
      files[i].size = header.size;
      files[i].format = header.is_rgb ? "24-bit colour"
                                      : std::to_string(header.bits) + "-bit " +
                                            (header.is_palette ? "palette" : "grey");
    } catch (const UserError& error) {
      files[i].error = error.what();
      const std::string prefix = masks[i].string() + ": ";
      if (files[i].error.starts_with(prefix)) files[i].error.erase(0, prefix.size());
    }
  });
  return files;
}

CoverageSurvey SurveyCoverage(const MaskedPhotos& photos) {
  const size_t num_views = photos.photos.size();
  const std::vector<Label>& labels = photos.given.labels;
  CoverageSurvey survey;
  survey.unlabelled.assign(num_views, std::numeric_limits<double>::quiet_NaN());
  std::vector<std::vector<double>> shares_of(labels.size());
  std::vector<std::vector<int32_t>> views_of(labels.size());
  for (size_t view = 0; view < num_views; ++view) {
    if (!photos.HasMask(static_cast<int>(view))) continue;
    const int64_t pixels = int64_t{photos.photos[view].width} * photos.photos[view].height;
    int64_t unlabelled = pixels;
    for (const auto& [c, count] : photos.pixels[view]) {
      if (labels[Value(c)].source_id == kZeroMaskId) continue;
      unlabelled -= count;
      views_of[Value(c)].push_back(static_cast<int32_t>(view));
      shares_of[Value(c)].push_back(static_cast<double>(count) / static_cast<double>(pixels));
    }
    survey.unlabelled[view] = static_cast<double>(unlabelled) / static_cast<double>(pixels);
  }
  for (size_t c = 0; c < labels.size(); ++c) {
    // An id may vanish where its mask is read at a smaller size.
    if (labels[c].source_id == kZeroMaskId || views_of[c].empty()) continue;
    std::sort(shares_of[c].begin(), shares_of[c].end());
    IdSurvey& id = survey.ids.emplace_back();
    id.given_class = static_cast<ClassIndex>(c);
    id.views = std::move(views_of[c]);
    id.least = shares_of[c].front();
    id.median = shares_of[c][shares_of[c].size() / 2];
    id.most = shares_of[c].back();
  }
  return survey;
}

}  // namespace semfoam
