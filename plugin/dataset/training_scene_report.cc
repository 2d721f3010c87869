// SPDX-License-Identifier: GPL-3.0-or-later
//
// The sentences of a TrainingScene for the user.
#include "plugin/dataset/scene_warnings.h"
#include "plugin/dataset/training_scene.h"
#include "plugin/util/plural.h"

#include <algorithm>
#include <cmath>
#include <sstream>

namespace semfoam {

std::string TrainingScene::MaskReport() const {
  const int paired = plan_.masks.NumPaired();
  if (paired == 0) return "no masks: colour and geometry only, without labels";
  const auto objects = std::count_if(
      labels_.begin(), labels_.end(), [](const Label& label) { return label.id != kNoObject; });
  std::ostringstream text;
  text << paired << " of " << views_.size() << (views_.size() == 1 ? " photo" : " photos")
       << (paired == 1 && views_.size() == 1 ? " has" : " have") << " a mask, "
       << Plural(objects, "label") << ", "
       << Plural(static_cast<int64_t>(plan_.masks.unused.size()), "mask") << " unused";
  return text.str();
}

std::string TrainingScene::NoIdsSentence() const {
  const std::vector<Label>& labels = mask_classes_.labels;
  const bool has_ids = std::any_of(labels.begin(), labels.end(), [](const Label& label) {
    return label.source_id != kZeroMaskId;
  });
  const int paired = plan_.masks.NumPaired();
  if (has_ids || paired == 0) return "";
  return plan_.mask_folder.string() + ": its " + Plural(paired, "mask") +
         (paired == 1 ? " has" : " have") +
         " no id but 0, which is no object; an id for each object would be right.";
}

std::vector<std::string> TrainingScene::Warnings() const {
  std::vector<PhotoSize> mask_sizes;
  mask_sizes.reserve(mask_contents_.size());
  for (const MaskContents& mask : mask_contents_) mask_sizes.push_back(mask.size);
  return NonEmpty({NoIdsSentence(),
                   MaskSizeWarning(plan_.masks, mask_sizes, plan_.file_sizes),
                   names_warning_,
                   features_warning_});
}

std::string TrainingScene::PhotoReport() const {
  const auto held_out = std::count_if(plan_.photos.begin(),
                                      plan_.photos.end(),
                                      [](const PhotoRecord& photo) { return photo.held_out; });
  std::ostringstream text;
  text << Plural(NumViews(), "photo");
  if (held_out > 0) text << ", " << held_out << " held out";
  if (plan_.num_unregistered > 0) text << ", " << plan_.num_unregistered << " more not registered";
  if (plan_.num_rescaled > 0) text << ", " << plan_.num_rescaled << " rescaled";
  if (plan_.num_reduced > 0) text << ", " << plan_.num_reduced << " reduced";
  double ignored = 0, pixels = 0;
  for (int view = 0; view < NumViews(); ++view) {
    ignored += static_cast<double>(views_[view].ignored.NumPixels());
    pixels += static_cast<double>(Width(view)) * Height(view);
  }
  if (ignored > 0) {
    const auto percent = std::max<int64_t>(1, std::llround(100 * ignored / pixels));
    text << ", " << percent << " % of the pixels ignored";
  }
  text << "; " << plan_.seeds.size() << " of " << plan_.num_points << " SfM points";
  return text.str();
}

}  // namespace semfoam
