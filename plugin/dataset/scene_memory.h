// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/dataset/scene_plan.h"

#include <cstdint>

namespace semfoam {

// Plans the memory that the photos and masks of a scene take, in bytes, at the most.
struct SceneMemory {
  // All photos, masks and ray tables, where they are held.
  uint64_t held = 0;
  // Of these, the tables.
  uint64_t tables = 0;
  // Loading one more photo and mask at a time, beside what is held.
  uint64_t loading = 0;
  // Opening a photo and its mask (TrainingScene::OpenView), where they are not held.
  uint64_t opening = 0;
  // Holding the masks against the tracks, before there is a foam.
  uint64_t correction = 0;
};
SceneMemory MemoryOf(const ScenePlan& plan);

}  // namespace semfoam
