// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/dataset/scene_memory.h"

#include "foam/data/block_contrast.h"
#include "plugin/dataset/ray_tables.h"
#include "plugin/mask/mask_evidence.h"

#include <algorithm>
#include <cstddef>

namespace semfoam {
namespace {

// Memory in bytes of one photo and its mask.
struct ViewBytes {
  // Decoding the photo at its peak, reducing included.
  uint64_t photo = 0;
  // Decoding the mask at its peak, the indices included.
  uint64_t mask = 0;
  // The photo while it is held.
  uint64_t held = 0;
  // The classes of the mask while they are held: one image of the photo's size, with two bytes a
  // pixel, as until all ids are known, and afterwards at the most.
  uint64_t classes = 0;
};

ViewBytes BytesOf(const ScenePlan& plan, size_t view) {
  const PhotoRecord& photo = plan.photos[view];
  const uint64_t pixels = static_cast<uint64_t>(photo.width) * static_cast<uint64_t>(photo.height);
  const bool is_reduced = PhotoSize{photo.width, photo.height} != plan.file_sizes[view];
  ViewBytes bytes;
  bytes.held = 3 * pixels;
  bytes.photo = plan.photo_decoding[view] + (is_reduced ? bytes.held : 0);
  if (plan.masks.masks[view].empty()) return bytes;
  bytes.classes = 2 * pixels;
  bytes.mask = plan.mask_decoding[view] + bytes.classes;
  return bytes;
}

uint64_t LoadingBytes(const ViewBytes& view) {
  const uint64_t held = view.held + view.classes;
  // The photo is decoded first, then the mask; when all are, one more image of classes is made.
  return std::max({std::max(view.photo, held) - held,
                   std::max(view.mask, view.classes) - view.classes,
                   view.classes});
}

uint64_t OpeningBytes(const ViewBytes& view) {
  // The mask's indices, classes and corrected classes; then the photo.
  return std::max({view.mask, 2 * view.classes, view.classes + view.photo});
}

uint64_t CorrectionBytes(const ScenePlan& plan) {
  // Each point is triangulated (memory_plan.cc has the memory of that) and stores its neighbours;
  // each pixel observation is stored as an Observation, with an index in the list of its region.
  constexpr uint64_t kBytesOfPoint = 1000;
  constexpr uint64_t kBytesOfObservation =
      sizeof(PixelObservation) + sizeof(Observation) + sizeof(uint32_t);
  uint64_t bytes = 0;
  for (const PixelObservations& track : plan.seed_tracks) {
    if (!track.empty()) bytes += kBytesOfPoint + kBytesOfObservation * track.size();
  }
  return bytes;
}

}  // namespace

SceneMemory MemoryOf(const ScenePlan& plan) {
  SceneMemory memory;
  memory.always = RayTableBytes(plan.photos, plan.table_views);
  for (const PhotoRecord& photo : plan.photos) {
    memory.always += BlockContrast::Bytes(photo.width, photo.height);
  }
  memory.held = memory.always;
  for (size_t i = 0; i < plan.photos.size(); ++i) {
    if (!plan.IsDrawn(i)) continue;
    const ViewBytes view = BytesOf(plan, i);
    memory.held += view.held + view.classes;
    memory.loading = std::max(memory.loading, LoadingBytes(view));
    memory.opening = std::max(memory.opening, OpeningBytes(view));
  }
  memory.correction = CorrectionBytes(plan);
  return memory;
}

}  // namespace semfoam
