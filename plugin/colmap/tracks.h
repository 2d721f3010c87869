// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/model/model.h"
#include "plugin/colmap/colmap_model.h"

#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// Where a photo shows a point.
struct PixelObservation {
  int32_t view = 0;
  Eigen::Vector2d pixel;  // of the photo at its own size; the photo's corner is (0, 0)
};
using PixelObservations = std::vector<PixelObservation>;

// A point and the photos that show it.
struct Track {
  Eigen::Vector3d position;        // world frame
  PixelObservations observations;  // ascending by view, at most one each
};

// Points drawn by chance until their observations suffice to compare the photos' light: 12000, or
// 60 for each photo where that is more. Only points that three photos or more show: of two that
// differ nobody can tell which is wrong. Ascending by id, and the same whatever their order in the
// file. Image i of the model belongs to photos[i]; pixels are scaled where a photo has another size
// than its camera.
std::vector<Track> SampleTracks(const Reconstruction& model,
                                const std::vector<PhotoRecord>& photos,
                                uint64_t random_seed);

// A number for each photo, from 0 on, that is the same for photos through one lens: those of one
// COLMAP camera; or, where cameras have less than four photos on average (each photo its own, as
// COLMAP does unless told otherwise), those of one camera model and size.
std::vector<int> LensOfPhotos(const Reconstruction& model, const std::vector<PhotoRecord>& photos);

}  // namespace semfoam
