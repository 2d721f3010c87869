// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/train/trainer.h"
#include "plugin/dataset/training_scene.h"
#include "plugin/photometric/effects.h"
#include "plugin/photometric/light_refinement.h"
#include "plugin/photometric/pose_refinement.h"
#include "plugin/photometric/transient_things.h"

#include <cstdint>
#include <string>
#include <vector>

namespace semfoam {

// Adapts a scene in the course of its training to what the photos show otherwise than the foam: the
// light of each photo, what passes by, and the camera poses.
class ViewAdaptation {
 public:
  // `lights` are the scene's so far [views], or empty; `poses` has looked at its tracks. An
  // adaptation renders about one ray for a hundred of the `num_rays` of the training. Where the
  // least that it must render is more than a tenth of these, since the training is short and the
  // photos are many, there is none, and the first Adapt says so. `scene` must outlive this object.
  ViewAdaptation(TrainingScene* scene,
                 const EffectsOptions& options,
                 std::vector<PhotoLight> lights,
                 PoseRefiner poses,
                 int64_t num_rays);

  // To be called as TrainingHooks::adapt_views. Renders nothing where nothing is looked for.
  // Returns lines for the log about what is new.
  std::vector<std::string> Adapt(const TrainingHooks::RenderPixels& render);

  const LightRefiner& light() const { return light_; }
  const TransientFinder& transients() const { return transients_; }
  const PoseRefiner& poses() const { return poses_; }

  // Describes the state for checkpoints. After reading, Restore must be called.
  template <typename Archive>
  void Serialize(Archive* archive) {
    light_.Serialize(archive);
    transients_.Serialize(archive);
    poses_.Serialize(archive);
  }
  // Sets the scene's lights, pixels and poses to those that were read.
  void Restore();

 private:
  TrainingScene* const scene_;
  const int64_t num_rays_;
  bool said_too_short_ = false;
  LightRefiner light_;
  TransientFinder transients_;
  PoseRefiner poses_;
};

}  // namespace semfoam
