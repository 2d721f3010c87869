// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/enum_names.h"
#include "foam/model/model.h"
#include "plugin/colmap/colmap_model.h"

#include <cstddef>
#include <vector>

namespace semfoam {

// Returns how much the pictures of two views differ, which matters to a video tracker: the distance
// of the cameras over the distance of the scene (`depth`, world units), plus the angle between the
// views in radians.
double ViewDistance(const PhotoRecord& a, const PhotoRecord& b, double depth);

enum class FilmOrder {
  // kName if that path is at most half as long again as kPath's.
  kAuto,
  // The given order: by name, as for the frames of a film.
  kName,
  // A short path through all photos, from the first always to the nearest remaining one, then
  // shortened by reversing stretches of it (2-opt) until that has no effect or a hundred passes are
  // done.
  kPath,
};
inline constexpr EnumName<FilmOrder> kFilmOrderNames[] = {
    {FilmOrder::kAuto, "auto"}, {FilmOrder::kName, "name"}, {FilmOrder::kPath, "path"}};

// Returns an order of the photos, as indices, in which neighbours look alike.
std::vector<size_t> CaptureOrder(const std::vector<PhotoRecord>& photos,
                                 double depth,
                                 FilmOrder order);

// One frame of the film.
struct FilmFrame {
  // Index of the photo of this frame, or of the one before it.
  size_t photo = 0;
  // Index of the photo after it; equal to `photo` for a photo itself.
  size_t next = 0;
  // Share of the way from the one to the other, 0..1.
  double share = 0;
  Pose cam_from_world;
};

// Returns the photos in that order with interpolated frames: `between` of them between two photos
// at the median distance, more between photos farther apart, up to 8 times as many, and at least
// one. Interpolates rotations along the shortest arc and positions along a line. Adds none between
// two photos of different sizes.
std::vector<FilmFrame> MakeFilm(const std::vector<PhotoRecord>& photos,
                                const std::vector<size_t>& order,
                                double depth,
                                int between);

}  // namespace semfoam
