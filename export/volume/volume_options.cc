// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/volume/volume_options.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <set>

namespace semfoam {
namespace {

constexpr int kMaxSupersample = 8;

}  // namespace

std::optional<Eigen::AlignedBox3d> ParseCrop(const std::string& text) {
  std::array<double, 6> numbers;
  const char* at = text.data();
  const char* const end = at + text.size();
  for (size_t k = 0; k < numbers.size(); ++k) {
    while (at != end && *at == ' ') ++at;
    const auto parsed = std::from_chars(at, end, numbers[k]);
    if (parsed.ec != std::errc() || !std::isfinite(numbers[k])) return std::nullopt;
    at = parsed.ptr;
    const bool is_last = k + 1 == numbers.size();
    if (is_last ? at != end : at == end || *at++ != ',') return std::nullopt;
  }
  const Eigen::AlignedBox3d box(Eigen::Vector3d(numbers[0], numbers[1], numbers[2]),
                                Eigen::Vector3d(numbers[3], numbers[4], numbers[5]));
  if ((box.min().array() >= box.max().array()).any()) return std::nullopt;
  return box;
}

std::string VolumeExportOptions::Check() const {
  if (!(voxel_size >= 0) || !std::isfinite(voxel_size)) {
    return "voxel_size must be a length in world units, or 0 to follow max_resolution.";
  }
  if (max_resolution < 1 || max_resolution > 65536) return "max_resolution must be 1..65536.";
  if (!crop.empty() && !ParseCrop(crop)) {
    return "crop must be six numbers x0,y0,z0,x1,y1,z1 with x0 < x1, y0 < y1 and z0 < z1; it is '" +
           crop + "'.";
  }
  if (supersample < 1 || supersample > kMaxSupersample) {
    return "supersample must be 1.." + std::to_string(kMaxSupersample) + ".";
  }
  std::set<std::string> names;
  for (const std::string* name : {&grid_names.density,
                                  &grid_names.color,
                                  &grid_names.label,
                                  &grid_names.confidence,
                                  &grid_names.surface}) {
    const bool is_plain = std::all_of(name->begin(), name->end(), [](char c) {
      return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
    });
    if (name->empty() || !is_plain) {
      return "a grid's name must be letters, digits and '_'; '" + *name + "' is not.";
    }
    if (!names.insert(*name).second) {
      return "grids must have different names; two are called '" + *name + "'.";
    }
  }
  if (!(min_optical_depth >= 0)) return "min_optical_depth must not be negative.";
  if (max_voxels < 1) return "max_voxels must be positive.";
  return "";
}

}  // namespace semfoam
