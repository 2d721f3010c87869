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

// Converts the model's points to seeds, with the pixels at which the photos observe them.

// A view, the features of its image, and the scale from pixels of its camera to pixels of its
// photo.
struct SeenImage {
  int32_t view = 0;
  const Image* image = nullptr;
  Eigen::Vector2d scale = Eigen::Vector2d::Ones();
};
// SeenImage by the image's id.
using SeenImages = std::unordered_map<uint32_t, SeenImage>;

// Indexes the images of the photos that are not held out. Image i of `images` belongs to photos[i].
// The result points into `images`.
SeenImages FindSeenImages(const std::vector<Image>& images,
                          const std::vector<Camera>& cameras,
                          const std::vector<PhotoRecord>& photos);

// Appends the observations of a point, in the order of its track. Leaves out features that do not
// exist or are not finite.
void AppendObservations(const Point3D& point,
                        const SeenImages& images,
                        PixelObservations* observations);

// Makes seeds of the points within kFarRadius of the normalised frame, in ascending order of their
// ids, each position once, with the observations of all points at that position. Without `images`
// there are no observations. Leaves out points without a track, unless no point has one (models of
// other programs).
void MakeSeeds(std::vector<Point3D> points,
               const Similarity& world_from_normalized,
               const SeenImages& images,
               std::vector<SeedPoint>* seeds,
               std::vector<PixelObservations>* observations);

// Returns NormalizedFrame of the model's images and points.
Similarity NormalizedFrameOf(const Reconstruction& model);

}  // namespace semfoam
