// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/util/random.h"
#include "plugin/colmap/colmap_model.h"
#include "plugin/colmap/seeds.h"
#include "plugin/photometric/camera_placement.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

namespace semfoam {

// Writes a model whose cameras are turned by 0.2 degrees and moved by 0.2 % of the extent, each in
// a direction of its own; those that test_every holds out stay. Without `tracks`, no image has
// features.
inline void WriteDisturbedModel(const std::filesystem::path& from,
                                const std::filesystem::path& to,
                                int test_every,
                                bool tracks = true) {
  Reconstruction model = ReadReconstruction(from);
  const Similarity frame = NormalizedFrameOf(model);
  std::vector<std::string> names;
  for (const Image& image : model.images) names.push_back(image.name);
  std::sort(names.begin(), names.end());
  for (Image& image : model.images) {
    if (!tracks) image.points.clear();
    const auto number = std::find(names.begin(), names.end(), image.name) - names.begin();
    if (number % test_every == 0) continue;
    CounterRandom random(1, 0x64697374, number);
    CameraMotion motion;
    for (int i = 0; i < 6; ++i) motion[i] = random.Normal();
    motion.head<3>() *= 0.2 / 180 * 3.14159265358979323846 / motion.head<3>().norm();
    motion.tail<3>() *= 0.002 / motion.tail<3>().norm();
    image.cam_from_world = PoseOf(Moved(PlacementOf(image.cam_from_world, frame), motion), frame);
  }
  if (!tracks) {
    for (Point3D& point : model.points) point.track.clear();
  }
  WriteReconstruction(to, model, ModelFormat::kBinary);
}

}  // namespace semfoam
