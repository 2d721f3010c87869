// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/data/training_views.h"
#include "foam/geometry/similarity.h"
#include "foam/model/model.h"
#include "plugin/colmap/colmap_model.h"
#include "plugin/colmap/tracks.h"

#include <cstdint>
#include <unordered_map>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// The model's points, and where its photos see them.

// A view, the features of its image, and the pixels of its photo for one of its camera.
struct SeenImage {
  int32_t view = 0;
  const Image* image = nullptr;
  Eigen::Vector2d scale = Eigen::Vector2d::Ones();
};
// By the image's id.
using SeenImages = std::unordered_map<uint32_t, SeenImage>;

// Image i of `images` belongs to photos[i]; held-out photos are left out. Points into `images`.
SeenImages FindSeenImages(const std::vector<Image>& images,
                          const std::vector<Camera>& cameras,
                          const std::vector<PhotoRecord>& photos);

// Appends where the images saw a point, in the order of its track. Features that are not there or
// not finite are left out.
void AppendObservations(const Point3D& point,
                        const SeenImages& images,
                        PixelObservations* observations);

// The points within kFarRadius of the normalised frame, in ascending order of their ids, each
// position once, with the observations of all points that are there. Without `images` there are no
// observations. Points without a track are left out, unless no point has one (models of other
// programs).
void MakeSeeds(std::vector<Point3D> points,
               const Similarity& world_from_normalized,
               const SeenImages& images,
               std::vector<SeedPoint>* seeds,
               std::vector<PixelObservations>* observations);

// NormalizedFrame of the model's images and points.
Similarity NormalizedFrameOf(const Reconstruction& model);

}  // namespace semfoam
