// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/device/device.h"
#include "foam/geometry/delaunay.h"
#include "foam/model/foam.h"
#include "foam/render/ray_caster.h"
#include "foam/render/ray_record.h"
#include "foam/render/walk.h"

#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// All rays of one view, from one origin, in the normalised frame.
struct CameraRays {
  int width = 0;
  int height = 0;
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  std::vector<Eigen::Vector3f>
      directions;  // [height][width], unit length; zero = the camera has no ray for the pixel
};

// What the foam looks like along those rays. All arrays are [height][width].
struct RenderedView {
  int width = 0;
  int height = 0;
  std::vector<Eigen::Vector3f>
      color;                    // display values over a white background, 0..1 (not clipped above)
  std::vector<float> opacity;   // 1 - transmittance
  std::vector<float> distance;  // along the ray, normalised frame, where transmittance falls to
                                // 0.5; 0 = it never does
  std::vector<int32_t> class_index;  // argmax of the classifier on the rendered identity; -1 where
                                     // opacity < 0.5 or without semantics
  std::vector<float> confidence;     // softmax of that class; 0 where class_index is -1
};

// A foam made ready to be rendered: the topology of its present positions and the planes of all
// faces. The foam must stay as it is and outlive the renderer. Thread-safe.
class ViewRenderer {
 public:
  explicit ViewRenderer(const Foam& foam, const Device& device = {});

  // Renders on the device, in parallel. The same bytes on any number of threads. Throws UserError
  // where the device has too little memory.
  RenderedView Render(const CameraRays& rays) const;

  const Delaunay& delaunay() const { return delaunay_; }
  const WalkGeometry<float>& geometry() const { return geometry_; }
  CellShading<float> shading() const;

  // The cell in which rays from `origin` start.
  uint32_t StartCell(const Eigen::Vector3d& origin) const;

 private:
  const RayCaster& Caster() const;

  const Foam& foam_;
  const Device device_;
  Delaunay delaunay_;
  WalkGeometry<float> geometry_;
  std::vector<float> density_;  // [num_cells]

  // Made by the first Render: there are renderers that none is asked of, and a GPU wants
  // a copy of all of the above.
  mutable std::once_flag caster_is_made_;
  mutable std::unique_ptr<RayCaster> caster_;
};

}  // namespace semfoam
