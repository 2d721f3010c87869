// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/dataset/scene_plan.h"

#include <cstdint>

namespace semfoam {

// Plans the memory that the photos and masks of a scene take, in bytes, at the most.
struct SceneMemory {
  // All photos that are drawn (ScenePlan::IsDrawn), their masks, contrasts and ray tables, if they
  // are held.
  uint64_t held = 0;
  // Of these, what is held in any case: the contrasts and the tables.
  uint64_t always = 0;
  // Memory for decoding one photo and mask at a time, in addition.
  uint64_t loading = 0;
  // Memory for opening a photo and its mask (TrainingScene::OpenView), if they are not held.
  uint64_t opening = 0;
  // Memory for correcting the masks by the tracks, before there is a foam.
  uint64_t correction = 0;
};
SceneMemory MemoryOf(const ScenePlan& plan);

}  // namespace semfoam
