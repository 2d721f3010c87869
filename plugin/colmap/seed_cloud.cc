// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/colmap/seed_cloud.h"

#include "foam/geometry/guard_sites.h"
#include "foam/optim/point_thinning.h"
#include "foam/util/error.h"
#include "foam/util/ply_reader.h"

#include <algorithm>
#include <array>
#include <string>
#include <string_view>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

constexpr int kNoColumn = -1;

bool IsVertex(const PlyElement& element) {
  return element.name == "vertex" || element.name == "vertices";
}

// Returns the columns of red, green and blue with this prefix; kNoColumn for each that is missing.
std::array<int, 3> ColorColumns(const PlyElement& element, const std::string& prefix) {
  std::array<int, 3> columns = {kNoColumn, kNoColumn, kNoColumn};
  const std::string names[] = {prefix + "red", prefix + "green", prefix + "blue"};
  for (size_t i = 0; i < element.properties.size(); ++i) {
    for (int c = 0; c < 3; ++c) {
      const PlyProperty& property = element.properties[i];
      if (!property.is_list && property.name == names[c]) columns[c] = static_cast<int>(i);
    }
  }
  return columns;
}

// Returns the value that shows as 1.
double LargestColor(PlyType type) {
  switch (type) {
    case PlyType::kFloat:
    case PlyType::kDouble:
      return 1;
    case PlyType::kInt16:
    case PlyType::kUint16:
      return 65535;
    default:
      return 255;
  }
}

// Where the numbers of a point are in its record.
struct Layout {
  struct Column {
    // 0..2: a coordinate, 3..5: a colour; kNoColumn: of no use.
    int number = kNoColumn;
    double scale = 1;
  };
  std::vector<Column> columns;
  bool has_colors = false;
};

Layout LayoutOf(const PlyReader& reader, const PlyElement& element) {
  Layout layout;
  layout.columns.resize(element.properties.size());
  layout.columns[reader.RequireProperty(element, {"x"})].number = 0;
  layout.columns[reader.RequireProperty(element, {"y"})].number = 1;
  layout.columns[reader.RequireProperty(element, {"z"})].number = 2;
  for (const char* prefix : {"", "diffuse_"}) {
    const std::array<int, 3> colors = ColorColumns(element, prefix);
    if (std::count(colors.begin(), colors.end(), kNoColumn) > 0) continue;
    for (int c = 0; c < 3; ++c) {
      layout.columns[colors[c]] = {3 + c, 1 / LargestColor(element.properties[colors[c]].type)};
    }
    layout.has_colors = true;
    break;
  }
  return layout;
}

// Converts points to the normalised frame, and merges those that are near.
class Collector {
 public:
  Collector(const Similarity& world_from_normalized, size_t most, SeedCloud* cloud)
      : world_from_normalized_(world_from_normalized), merger_(most), cloud_(cloud) {}

  void Add(const std::array<double, 6>& point) {
    ++cloud_->num_points;
    const Eigen::Vector3d world(point[0], point[1], point[2]);
    if (!world.allFinite()) {
      ++cloud_->num_not_finite;
      return;
    }
    const Eigen::Vector3d position = world_from_normalized_.Invert(world);
    if (!(position.norm() <= kFarRadius)) {
      ++cloud_->num_far;
      return;
    }
    merger_.Add(position, Eigen::Vector3d(point[3], point[4], point[5]).cast<float>());
  }

  void Finish() { cloud_->points = merger_.Take(); }

 private:
  const Similarity& world_from_normalized_;
  PointMerger merger_;
  SeedCloud* cloud_;
};

void ReadPoints(const PlyElement& element, PlyReader* reader, SeedCloud* cloud, Collector* points) {
  const Layout layout = LayoutOf(*reader, element);
  cloud->has_colors = layout.has_colors;
  reader->RequireRoomFor(element);
  std::array<double, 6> point = {0, 0, 0, 0.5, 0.5, 0.5};
  uint64_t current = 0;
  reader->ReadRecords(element, [&](uint64_t record, size_t column, double value) {
    if (record != current) {
      points->Add(point);
      current = record;
    }
    const Layout::Column& place = layout.columns[column];
    if (place.number != kNoColumn) point[place.number] = value * place.scale;
  });
  points->Add(point);
}

void RequirePoints(const fs::path& path, const SeedCloud& cloud) {
  if (cloud.num_points == 0) {
    throw UserError(path.string(),
                    ": has no points; an element vertex with x, y and z, and one record at least, "
                    "would be right.");
  }
  if (cloud.num_not_finite == cloud.num_points) {
    throw UserError(path.string(),
                    ": none of its ",
                    cloud.num_points,
                    " points has finite coordinates; is it damaged?");
  }
  if (cloud.points.empty()) {
    throw UserError(path.string(),
                    ": all of its ",
                    cloud.num_points - cloud.num_not_finite,
                    " points lie far from what the photos show; a cloud in the frame of the COLMAP "
                    "model would be right.");
  }
}

}  // namespace

SeedCloud ReadSeedCloud(const fs::path& path,
                        const Similarity& world_from_normalized,
                        size_t most) {
  PlyReader reader(path, "a PLY of points with x, y and z");
  SeedCloud cloud;
  Collector points(world_from_normalized, most, &cloud);
  bool has_vertices = false;
  for (const PlyElement& element : reader.header().elements) {
    if (!has_vertices && element.count > 0 && IsVertex(element)) {
      has_vertices = true;
      ReadPoints(element, &reader, &cloud, &points);
    } else {
      reader.ReadRecords(element, [](uint64_t, size_t, double) {});
    }
  }
  points.Finish();
  RequirePoints(path, cloud);
  return cloud;
}

}  // namespace semfoam
