// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/model/model.h"
#include "plugin/colmap/colmap_model.h"

#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// The pixel at which a photo observes a point.
struct PixelObservation {
  int32_t view = 0;
  // Pixel of the photo at its own size; the photo's corner is (0, 0).
  Eigen::Vector2d pixel;
};
using PixelObservations = std::vector<PixelObservation>;

// A point and the photos that observe it.
struct Track {
  // World frame.
  Eigen::Vector3d position;
  // Ascending by view, at most one each.
  PixelObservations observations;
};

// Draws random points until they have enough observations to compare the photos' light: 12000, or
// 60 for each photo if that is more. Draws only points that at least three photos observe, because
// of two that differ it is unknown which one is wrong. Returns them in ascending order of their
// ids; the sample does not depend on their order in the file. Image i of the model belongs to
// photos[i]; pixels are scaled where a photo has another size than its camera.
std::vector<Track> SampleTracks(const Reconstruction& model,
                                const std::vector<PhotoRecord>& photos,
                                uint64_t random_seed);

// Returns the index of each photo's lens, counted from 0. Photos share a lens if they share a
// COLMAP camera; or, where cameras have less than four photos on average (COLMAP's default is a
// camera per photo), if they share camera model and size.
std::vector<int> LensOfPhotos(const Reconstruction& model, const std::vector<PhotoRecord>& photos);

}  // namespace semfoam
