// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/model/model.h"
#include "plugin/colmap/colmap_model.h"

#include <cstddef>
#include <string>
#include <vector>

namespace semfoam {

// How far apart two views are, as a video tracker feels it: the distance of the cameras over their
// distance from what they look at (`depth`, world units), plus the angle between them in radians.
double ViewDistance(const PhotoRecord& a, const PhotoRecord& b, double depth);

// An order of the photos, as indices, in which neighbours look alike: "name", as they are (sorted
// by name, as films are); "path", a short way past all of them: from the first photo always on to
// the nearest one left, then shortened by turning pieces around (2-opt) until that helps no more or
// a hundred passes are done; "auto": by name where that is at most half as long again.
std::vector<size_t> CaptureOrder(const std::vector<PhotoRecord>& photos,
                                 double depth,
                                 const std::string& order);

// One picture of the film.
struct FilmFrame {
  size_t photo = 0;  // the photo that it is, or the one before it
  size_t next = 0;   // the one after it; the same: it is the photo
  double share = 0;  // of the way from one to the other, 0..1
  Pose cam_from_world;
};

// The photos in that order, with `between` pictures between two that are the median distance
// apart, more where they are farther, up to 8 times as many, and at least one. Turned along the
// shortest way, moved along the straight one. None between two photos of different sizes.
std::vector<FilmFrame> MakeFilm(const std::vector<PhotoRecord>& photos,
                                const std::vector<size_t>& order,
                                double depth,
                                int between);

}  // namespace semfoam
