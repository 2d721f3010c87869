// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/photometric/view_adaptation.h"

#include <utility>

namespace semfoam {
namespace {

// Rays of the training for each that an adaptation renders.
constexpr int64_t kRaysPerPixel = 100;
// With fewer, the adaptations would take a good part of the time.
constexpr int64_t kLeastRaysPerPixel = 10;

constexpr char kTooShort[] =
    "The training is too short for so many photos to hold these against the foam: light, things "
    "that pass by and poses are left as they are";

}  // namespace

ViewAdaptation::ViewAdaptation(TrainingScene* scene,
                               const EffectsOptions& options,
                               std::vector<PhotoLight> lights,
                               PoseRefiner poses,
                               int64_t num_rays)
    : scene_(scene),
      num_rays_(num_rays),
      light_(scene, std::move(lights), options.shading),
      transients_(scene, options.transients),
      poses_(std::move(poses)) {}

std::vector<std::string> ViewAdaptation::Adapt(const TrainingHooks::RenderPixels& render) {
  std::vector<std::string> lines;
  if (!light_.IsLooking() && !transients_.IsEnabled() && !poses_.IsLooking()) return lines;
  if (FewestComparedRays(*scene_) > num_rays_ / kLeastRaysPerPixel) {
    if (!said_too_short_) lines.emplace_back(kTooShort);
    said_too_short_ = true;
    return lines;
  }
  const std::vector<ComparedView> views = CompareViews(*scene_, num_rays_ / kRaysPerPixel, render);
  const bool was_decided = light_.IsDecided();
  light_.Refine(views);
  if (!was_decided && light_.IsDecided()) lines.push_back(light_.Report());
  const int num_before = transients_.NumPhotos();
  transients_.Find(views, light_.lights());
  if (transients_.NumPhotos() != num_before) lines.push_back(transients_.Report());
  // Last: the views are those of the poses before.
  const bool poses_were_decided = poses_.IsDecided();
  poses_.Refine(views);
  if (!poses_were_decided && poses_.IsDecided()) lines.push_back(poses_.Report());
  return lines;
}

void ViewAdaptation::Restore() {
  light_.Restore();
  transients_.Restore();
  poses_.Restore();
}

}  // namespace semfoam
