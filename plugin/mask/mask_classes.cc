// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask/mask_classes.h"

#include "foam/util/error.h"
#include "plugin/mask/class_image.h"
#include "plugin/mask/mask_tables.h"

#include <algorithm>
#include <set>

#include <glog/logging.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

// From this share of their pixels on, id 0 is what the masks say, not what they leave out.
constexpr double kBackgroundShare = 0.2;

// The id that a pixel's value stands for.
MaskId IdOf(uint32_t value, bool is_grey_rgb) { return MaskId{is_grey_rgb ? value & 0xff : value}; }

bool IsGrey(uint32_t rgb) { return (rgb & 0xff) == (rgb >> 8 & 0xff) && (rgb & 0xff) == rgb >> 16; }

// Long ids and nothing between them: interpolated colours are no ids.
void CheckPredictedIds(const fs::path& mask_folder,
                       const std::vector<fs::path>& paths,
                       const std::vector<MaskContents>& masks) {
  const fs::path file = FindPredictions(mask_folder);
  if (file.empty()) return;
  const std::set<MaskId> predicted = ReadPredictedIds(file);
  for (size_t i = 0; i < masks.size(); ++i) {
    if (!masks[i].is_rgb) continue;
    const auto unknown = std::count_if(masks[i].ids.begin(), masks[i].ids.end(), [&](uint32_t id) {
      return id != 0 && !predicted.contains(MaskId{id});
    });
    if (unknown == 0) continue;
    throw UserError(paths[i].string(),
                    ": has ",
                    unknown,
                    unknown == 1 ? " colour that is no id" : " colours that are no ids",
                    " in pred.json; a mask as DEVA wrote it, not resampled or recompressed, would "
                    "be right.");
  }
}

// The share of all masks' pixels that are 0.
double ShareOfZero(const std::vector<MaskContents>& masks) {
  double zeros = 0, pixels = 0;
  for (const MaskContents& mask : masks) {
    zeros += static_cast<double>(mask.num_zero);
    pixels += static_cast<double>(mask.size.width) * mask.size.height;
  }
  return pixels > 0 ? zeros / pixels : 0;
}

}  // namespace

std::vector<ClassIndex> MaskClasses::Of(const MaskContents& mask) const {
  std::vector<ClassIndex> of_ids;
  for (const uint32_t value : mask.ids) {
    const auto found = class_of_id.find(IdOf(value, mask.is_rgb && colors_are_grey));
    of_ids.push_back(found == class_of_id.end() ? kUnlabelled : found->second);
  }
  return of_ids;
}

MaskClasses NumberMasks(const std::vector<MaskContents>& contents,
                        const MaskPairing& pairing,
                        const fs::path& mask_folder,
                        LabelZero label_zero) {
  CHECK_EQ(contents.size(), pairing.masks.size());
  MaskClasses result;
  const bool long_ids = std::any_of(contents.begin(), contents.end(), [](const MaskContents& mask) {
    return mask.is_rgb && !std::all_of(mask.ids.begin(), mask.ids.end(), IsGrey);
  });
  if (long_ids) CheckPredictedIds(mask_folder, pairing.masks, contents);
  result.colors_are_grey = !long_ids;
  std::set<MaskId> ids;
  for (const MaskContents& mask : contents) {
    for (const uint32_t value : mask.ids) ids.insert(IdOf(value, mask.is_rgb && !long_ids));
  }
  if (label_zero == LabelZero::kIgnore ||
      (label_zero == LabelZero::kAuto &&
       (ShareOfZero(contents) < kBackgroundShare || SaysZeroIsUnlabelled(mask_folder)))) {
    ids.erase(kZeroMaskId);
  }
  if (ids.size() > kMaxMaskClasses) {
    throw UserError(mask_folder.string(),
                    ": the masks have ",
                    ids.size(),
                    " ids, where at most ",
                    kMaxMaskClasses,
                    " are possible; are they resampled, or photos?");
  }
  const bool keep_ids = ids.empty() || Value(*ids.rbegin()) <= kMaxMaskClasses;
  int32_t next_id = 1;
  for (const MaskId id : ids) {
    result.class_of_id.emplace(id, static_cast<ClassIndex>(result.labels.size()));
    Label label;
    label.source_id = id;
    label.id = keep_ids || id == kZeroMaskId ? static_cast<LabelId>(id) : LabelId{next_id++};
    result.labels.push_back(label);
  }
  return result;
}

}  // namespace semfoam
