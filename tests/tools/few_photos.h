// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/colmap/colmap_model.h"

#include <algorithm>
#include <filesystem>
#include <string>
#include <unordered_set>

#include "tests/tools/program.h"

namespace semfoam {

// Makes the workspace `target` of every fourth photo of the tabletop scene, with their masks and
// the points that two of them see: for tests that run the program again and again, and do not ask
// how good the foam is. Nearly all that a short run does is done for each photo.
inline void MakeTabletopOfFewPhotos(const std::filesystem::path& target) {
  namespace fs = std::filesystem;
  Reconstruction model = ReadReconstruction(kTabletop / "sparse/0");
  std::ranges::sort(model.images, {}, &Image::name);
  for (size_t i = 1; i * 4 < model.images.size(); ++i) model.images[i] = model.images[i * 4];
  model.images.resize((model.images.size() + 3) / 4);

  std::unordered_set<uint32_t> images;
  for (const Image& image : model.images) images.insert(image.id);
  std::unordered_set<uint64_t> points;
  std::erase_if(model.points, [&](Point3D& point) {
    std::erase_if(point.track, [&](const auto& e) { return !images.contains(e.image_id); });
    if (point.track.size() >= 2) points.insert(point.id);
    return point.track.size() < 2;
  });
  for (Image& image : model.images) {
    for (Point2D& point : image.points) {
      if (!points.contains(point.point3d_id)) point.point3d_id = kNoPoint3D;
    }
  }
  WriteReconstruction(target / "sparse/0", model, ModelFormat::kBinary);

  for (const char* folder : {"images", "object_mask"}) fs::create_directories(target / folder);
  for (const Image& image : model.images) {
    const std::string mask = fs::path(image.name).stem().string() + ".png";
    fs::copy(kTabletop / "images" / image.name, target / "images");
    fs::copy(kTabletop / "object_mask" / mask, target / "object_mask");
  }
  fs::copy(kTabletop / "labels.json", target);
}

}  // namespace semfoam
