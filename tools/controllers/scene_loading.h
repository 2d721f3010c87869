// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/train/trainer.h"
#include "plugin/dataset/scene_plan.h"
#include "plugin/dataset/training_scene.h"

#include <cstdint>
#include <string>

namespace semfoam {

// How much memory a scene's photos and masks may take, and do.
struct ImageMemory {
  int64_t cache_bytes = 0;  // what --image_cache_gb gives, or chooses
  int64_t bytes = 0;        // of these and beside them, what photos and masks take of a run
  int most_at_once = 1;     // photos and masks that are decoded at a time
  bool holds_all = true;    // all photos and masks stay in memory
};

// `image_cache_gb` as the option has it: 1e9 bytes each, or -1: three quarters of what the memory
// that is available leaves beside the foam. `training` decides how many pixels a run draws; one
// with a budget of seconds may draw any number. Throws UserError, naming the file, where one photo
// or mask alone takes more memory to decode than is available.
ImageMemory PlanImageMemory(double image_cache_gb,
                            const ScenePlan& plan,
                            const TrainingOptions& training,
                            bool draws_any_number,
                            int64_t available);

// Loads what was planned, with a line on stderr that says how far it is.
TrainingScene LoadScene(ScenePlan plan, const ImageMemory& memory);

// "checking photos 12/2000, 1:12 left".
std::string FormatCount(const std::string& what, int done, int total, double seconds);

}  // namespace semfoam
