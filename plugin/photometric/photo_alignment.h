// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/photometric/camera_placement.h"

#include <array>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// Aligns a photo to the render of a foam: finds the motion of its camera after which it shows the
// colours of the rendered surfaces where these are seen from there.

// Samples of a photo around a pixel, kPatchRadius of them to each side.
inline constexpr int kPatchRadius = 5;
inline constexpr int kPatchEdge = 2 * kPatchRadius + 1;

struct PhotoPatch {
  // [channel][row][column] Display values.
  std::array<std::array<std::array<float, kPatchEdge>, kPatchEdge>, 3> values;
};

// A photo's colour beside the middle of a patch, and its slope.
struct PatchSample {
  Eigen::Vector3d color;
  // By the offset.
  Eigen::Matrix<double, 3, 2> slope;
};

// Returns the mean of the patch under a Gaussian of standard deviation `sigma` about `offset`, both
// in samples.
PatchSample SamplePatch(const PhotoPatch& patch, const Eigen::Vector2d& offset, double sigma);

// A pixel of the photo and what the foam shows there.
struct AlignedPixel {
  // The surface, normalised frame.
  Eigen::Vector3d point;
  // Around the pixel, with offsets in samples of the patch.
  PixelFrame frame;
  PhotoPatch photo;
  // Display values.
  Eigen::Vector3d render;
  // Colour on the chessboard, 0 or 1.
  int half = 0;
};

struct PhotoAlignment {
  CameraPlacement placement;
  // Of the render, in display values: a little light that differs moves no camera.
  Eigen::Vector3d gain = Eigen::Vector3d::Ones();
};

// Returns the alignment of least robust error over the pixels, or those of one `half` (0, 1; -1:
// all), by Gauss-Newton from coarse to fine, with a weak prior at `start`, from where the pixels
// were rendered. With `moves` false only the gain is fitted.
PhotoAlignment AlignPhoto(const std::vector<AlignedPixel>& pixels,
                          const CameraPlacement& start,
                          int half,
                          bool moves);

// Returns the sum of the robust squared errors (Geman and McClure's) of the pixels of one half
// under an alignment.
double AlignmentError(const std::vector<AlignedPixel>& pixels,
                      const PhotoAlignment& alignment,
                      int half);

}  // namespace semfoam
