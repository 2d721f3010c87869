// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// The position of an image's camera, measured otherwise.
struct ImagePosition {
  // Image::name.
  std::string image;
  Eigen::Vector3d position;
};

// Reads camera positions as `colmap model_aligner --ref_images_path` takes them: a line "name x y
// z" for each image; separators may be blanks, tabs or commas, a name may hold blanks; empty lines
// and those that begin with # are skipped. If `is_gps`, the numbers are latitude and longitude in
// degrees and altitude in metres (WGS 84), and the positions are metres east, north and up of the
// first image (EastNorthUp). Throws UserError, naming file and line, where a line is otherwise or
// an image occurs twice, and where there is no position.
std::vector<ImagePosition> ReadReferencePositions(const std::filesystem::path& path, bool is_gps);

// Returns metres east, north and up of `origin`, for a place; both are latitude and longitude in
// degrees and altitude in metres over the ellipsoid of WGS 84.
Eigen::Vector3d EastNorthUp(const Eigen::Vector3d& place, const Eigen::Vector3d& origin);

}  // namespace semfoam
