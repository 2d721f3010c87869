// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/util/ids.h"
#include "plugin/colmap/colmap_model.h"
#include "plugin/mask/corrected_masks.h"

#include <array>
#include <cstdint>
#include <memory>
#include <span>

#include <Eigen/Core>

namespace semfoam {

// Labels places on a given surface by the masks of the photos that see them, without any training.

// What the masks say of a place.
struct MaskVerdict {
  // Index into MaskedPhotos::labels; kUnlabelled: no photo sees the place in a mask.
  ClassIndex class_index = kUnlabelled;
  // Share of the weight of all votes that the class has, 0..1.
  float confidence = 0;
  // Number of photos that see the place, in a mask or not.
  int num_views = 0;
};

// The photos of a model with their corrected masks, and how far away the surface is in each pixel
// of each.
class SurfaceViews {
 public:
  // Draws the surface into a depth image of each photo: `triangles` of `vertices`, in the model's
  // frame, or, without triangles, the vertices as the points of a cloud. Triangles are divided
  // until they are small in the image, so that every camera model will do. Triangles with a vertex
  // that is not finite are left out.
  //
  // Depth images and masks are of the size of the masks, or smaller, where all of them together
  // would have more than 2^27 pixels (6 bytes each); of a cloud, those of depth have one pixel for
  // 16 points at most. Runs in parallel over the photos; the result does not depend on the
  // threads. Throws UserError as CorrectedPhotos::Mask does.
  SurfaceViews(const Reconstruction& model,
               const CorrectedPhotos& photos,
               std::span<const Eigen::Vector3d> vertices,
               std::span<const std::array<uint32_t, 3>> triangles);
  ~SurfaceViews();
  SurfaceViews(const SurfaceViews&) = delete;
  SurfaceViews& operator=(const SurfaceViews&) = delete;

  // Returns the verdict on a place of the surface. A photo sees it where it projects into the photo
  // and is no farther away than the surface there, up to what a pixel and the slope of the surface
  // leave open. It then votes for the class of its mask there, with the weight BorderWeight, times
  // the cosine between `normal` (of either sign; zero: unknown) and the ray. Unlabelled pixels do
  // not vote.
  MaskVerdict Vote(const Eigen::Vector3d& x, const Eigen::Vector3d& normal) const;

  // Returns the size of a pixel of the masks at a place, in units of the model: in the nearest
  // photo that sees it; 0 where none does.
  double PixelSize(const Eigen::Vector3d& x) const;

 private:
  struct View;
  std::vector<View> views_;
};

}  // namespace semfoam
