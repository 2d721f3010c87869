// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/masks/mask_label_source.h"

#include "foam/util/median.h"
#include "foam/util/parallel.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace semfoam {
namespace {

constexpr size_t kMaxMeasured = 2000;
constexpr double kPixelsApart = 3;

std::vector<std::array<uint32_t, 3>> TrianglesOf(const PolygonMesh& mesh) {
  std::vector<std::array<uint32_t, 3>> triangles;
  for (size_t f = 0; f < mesh.NumFaces(); ++f) {
    const std::span<const uint32_t> face = mesh.Face(f);
    for (size_t k = 2; k < face.size(); ++k) triangles.push_back({face[0], face[k - 1], face[k]});
  }
  return triangles;
}

// Box of the points from the 1 % to the 99 % quantile of each coordinate, wider by its diagonal on
// every side.
Eigen::AlignedBox3d WideBox(const std::vector<Point3D>& points) {
  Eigen::AlignedBox3d box;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    for (const Point3D& point : points) {
      if (point.position.allFinite()) values.push_back(point.position[axis]);
    }
    if (values.empty()) return box;
    std::sort(values.begin(), values.end());
    const size_t outside = values.size() / 100;
    box.min()[axis] = values[outside];
    box.max()[axis] = values[values.size() - 1 - outside];
  }
  const Eigen::Vector3d margin = Eigen::Vector3d::Constant(box.diagonal().norm());
  return {box.min() - margin, box.max() + margin};
}

}  // namespace

MaskLabels::MaskLabels(const Reconstruction& model,
                       const CorrectedPhotos& photos,
                       std::vector<Label> labels,
                       const ExportTransform& transform)
    : model_(model),
      photos_(photos),
      labels_(std::move(labels)),
      transform_(transform),
      box_(WideBox(model.points)) {}

Eigen::Vector3d MaskLabels::ModelFromFile(const Eigen::Vector3d& x) const {
  return transform_.rotation.transpose() * (x - transform_.translation) / transform_.scale;
}

void MaskLabels::LookAt(const PolygonMesh& mesh) {
  std::vector<Eigen::Vector3d> vertices;
  vertices.reserve(mesh.vertices.size());
  for (const Eigen::Vector3d& x : mesh.vertices) vertices.push_back(ModelFromFile(x));
  views_ = std::make_unique<const SurfaceViews>(model_, photos_, vertices, TrianglesOf(mesh));
  std::vector<double> sizes;
  const size_t stride = vertices.size() / kMaxMeasured + 1;
  for (size_t v = 0; v < vertices.size(); v += stride) {
    if (!vertices[v].allFinite()) continue;
    const double size = views_->PixelSize(vertices[v]);
    if (size > 0) sizes.push_back(size);
  }
  if (sizes.empty()) return;
  resolution_ = kPixelsApart * Median(std::move(sizes)) * transform_.scale;
}

LabelSource::Answer MaskLabels::Ask(const Eigen::Vector3d& x,
                                    const Eigen::Vector3d& normal,
                                    uint32_t*) const {
  const Eigen::Vector3d place = ModelFromFile(x);
  if (!box_.isEmpty() && !box_.contains(place)) return {};
  const MaskVerdict verdict = views_->Vote(place, transform_.rotation.transpose() * normal);
  return {{LabelIdOf(labels_, verdict.class_index), verdict.confidence}, verdict.num_views > 0};
}

std::string MaskLabels::Why(const std::vector<Eigen::Vector3d>& places) const {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  int64_t count = 0;
  for (const Point3D& point : model_.points) {
    if (!point.position.allFinite()) continue;
    sum += point.position;
    ++count;
  }
  std::string text = "are seen by no photo or far from all that the photos show";
  if (count == 0) return text;
  const Eigen::Vector3d mean =
      transform_.scale * (transform_.rotation * (sum / static_cast<double>(count))) +
      transform_.translation;
  return text + MeansApart(places, "the model's points", mean);
}

}  // namespace semfoam
