// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/photometric/view_adaptation.h"

#include <utility>

namespace semfoam {

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
  const std::vector<ComparedView> views = CompareViews(*scene_, num_rays_, render);
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
