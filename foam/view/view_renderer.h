// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/device/device.h"
#include "foam/geometry/delaunay.h"
#include "foam/model/foam.h"
#include "foam/render/ray_caster.h"
#include "foam/render/ray_record.h"
#include "foam/render/walk.h"
#include "foam/util/ids.h"

#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// The rays of all pixels of one view, in the normalised frame.
struct CameraRays {
  int width = 0;
  int height = 0;
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  // [height][width], of unit length; zero where the camera has no ray for the pixel.
  std::vector<Eigen::Vector3f> directions;
};

// A foam rendered along those rays. All arrays are [height][width].
struct RenderedView {
  int width = 0;
  int height = 0;
  // Display values over a white background, 0 to 1, but not clipped above.
  std::vector<Eigen::Vector3f> color;
  // 1 - transmittance
  std::vector<float> opacity;
  // Distance along the ray, in the normalised frame, at which the transmittance falls to 0.5; 0
  // where it does not.
  std::vector<float> distance;
  // Argmax of the classifier on the rendered identity; kUnlabelled where opacity < 0.5 or without
  // semantics.
  std::vector<ClassIndex> class_index;
  // Softmax of that class; 0 where there is none.
  std::vector<float> confidence;
};

// Renders a foam. Triangulates its sites, and keeps the topology and the planes of all faces. The
// foam must not change and must outlive the renderer. Thread-safe.
class ViewRenderer {
 public:
  explicit ViewRenderer(const Foam& foam, const Device& device = {});

  // Renders a view in parallel, on the device. Returns the same bytes on any number of threads.
  // Throws UserError where the device has too little memory.
  RenderedView Render(const CameraRays& rays) const;

  const Delaunay& delaunay() const { return delaunay_; }
  const WalkGeometry<float>& geometry() const { return geometry_; }
  CellShading<float> shading() const;

  // Returns the cell in which rays from `origin` start.
  uint32_t StartCell(const Eigen::Vector3d& origin) const;

 private:
  const RayCaster& Caster() const;

  const Foam& foam_;
  const Device device_;
  Delaunay delaunay_;
  WalkGeometry<float> geometry_;
  std::vector<float> density_;  // [num_cells]

  // Made by the first Render: some renderers never render, and a GPU needs a copy of all of the
  // above.
  mutable std::once_flag caster_is_made_;
  mutable std::unique_ptr<RayCaster> caster_;
};

}  // namespace semfoam
