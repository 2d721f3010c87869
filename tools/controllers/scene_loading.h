// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/train/trainer.h"
#include "plugin/dataset/scene_plan.h"
#include "plugin/dataset/training_scene.h"

#include <cstdint>
#include <string>

namespace semfoam {

// The memory of a scene's photos and masks.
struct ImageMemory {
  // Memory for kept photos, masks and pixels: --image_cache_gb, given or chosen.
  int64_t cache_bytes = 0;
  // Peak memory of photos and masks in a run, kept and while decoding.
  int64_t bytes = 0;
  // Maximum number of photos and masks decoded at a time.
  int most_at_once = 1;
  // Whether all photos and masks stay in memory.
  bool holds_all = true;
};

// The memory of a plane sweep in bytes (plugin/stereo/surface_seeds.h).
struct SweepMemory {
  // Before the training.
  int64_t peak = 0;
  // Of its depths, which the training reads.
  int64_t kept = 0;
};

// Plans the memory of the photos and masks of a run. `image_cache_gb` is the option's value, in
// units of 1e9 bytes, or -1 for three quarters of the available memory that the foam leaves.
// `sweep` is the memory of the run's plane sweep, which is added to ImageMemory::bytes. `training`
// determines how many pixels a run draws; with `draws_any_number`, for a run with a time budget,
// the number is unknown. Throws UserError, naming the file, where one photo or mask alone takes
// more memory to decode than is available.
ImageMemory PlanImageMemory(double image_cache_gb,
                            const ScenePlan& plan,
                            const TrainingOptions& training,
                            const SweepMemory& sweep,
                            bool draws_any_number,
                            int64_t available);

// Loads a planned scene, with a progress line on stderr. `known` and `keeps_findings` are those of
// LoadOptions.
TrainingScene LoadScene(ScenePlan plan,
                        const ImageMemory& memory,
                        const SceneFindings* known = nullptr,
                        bool keeps_findings = false);

}  // namespace semfoam
