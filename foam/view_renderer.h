// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/delaunay.h"
#include "foam/foam.h"

#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// All rays of one view, from one origin, in the normalised frame.
struct CameraRays {
  int width = 0;
  int height = 0;
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  std::vector<Eigen::Vector3f>
      directions;  // [height][width], unit length; zero where the camera has no ray for the pixel
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
// faces. Borrows the foam.
class ViewRenderer {
 public:
  explicit ViewRenderer(const Foam& foam);
  ~ViewRenderer();

  RenderedView Render(const CameraRays& rays) const;
  const Delaunay& delaunay() const;

  // Rays that ever hit the step limit, over all renders: 0 in any valid foam (see walk.h).
  int64_t StepLimitHits() const;

 private:
  struct State;
  State* state_;
};

}  // namespace semfoam
