// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/volume/volume_forecast.h"

#include "export/volume/volume_extent.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <sstream>

namespace semfoam {
namespace {

constexpr size_t kFewestPoints = 100;
constexpr double kOutside = 0.1;  // share of the points beyond the box, at each end of an axis

}  // namespace

std::string VoxelsThatCannotFit(const std::vector<Eigen::Vector3d>& points,
                                double files_scale,
                                const VolumeExportOptions& options) {
  const std::optional<Eigen::AlignedBox3d> crop = ParseCrop(options.crop);
  std::vector<Eigen::Vector3d> inside;
  for (const Eigen::Vector3d& point : points) {
    if (!crop || crop->contains(point)) inside.push_back(point);
  }
  if (inside.size() < kFewestPoints) return "";
  Eigen::Vector3d whole, middle;  // sizes along the axes
  std::vector<double> values(inside.size());
  const auto rank = static_cast<size_t>(kOutside * static_cast<double>(values.size()));
  for (int axis = 0; axis < 3; ++axis) {
    for (size_t k = 0; k < inside.size(); ++k) values[k] = inside[k][axis];
    std::sort(values.begin(), values.end());
    whole[axis] = values.back() - values.front();
    middle[axis] = values[values.size() - 1 - rank] - values[rank];
  }
  const double longest = middle.maxCoeff() * files_scale;
  const double narrowest = middle.minCoeff() * files_scale;
  const bool is_given = options.voxel_size > 0;
  const double voxel =
      is_given ? options.voxel_size : whole.maxCoeff() * files_scale / options.max_resolution;
  if (!(voxel > 0)) return "";
  const double along = longest / voxel;
  const double sheet = options.objects.only ? 0 : along * (narrowest / voxel);
  const auto most = static_cast<double>(options.max_voxels);
  if (along <= kMaxVoxelIndex && sheet <= most) return "";
  const double fitting =
      voxel * std::max(along / kMaxVoxelIndex, std::sqrt(std::max(0.0, sheet / most)));
  std::ostringstream text;
  if (is_given) {
    text << "voxel_size " << options.voxel_size << " is too small: ";
  } else {
    text << "max_resolution " << options.max_resolution << " is too large: ";
  }
  text << "the model's points are " << longest << " wide in the files' unit, " << along
       << " voxels, and a volume of them would hold ";
  if (along > kMaxVoxelIndex) {
    text << "more voxels along an edge than the " << kMaxVoxelIndex << " that a grid can index";
  } else {
    text << "at least " << sheet << " voxels, more than the " << options.max_voxels
         << " of max_voxels";
  }
  text << "; a voxel_size well above " << fitting << " would be right.";
  return text.str();
}

}  // namespace semfoam
