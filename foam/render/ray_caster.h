// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// Transmittance at which rays stop, in training and in rendering.
inline constexpr double kTransmittanceCutoff = 1e-3;

// A ray to be rendered, in the normalised frame.
struct RayQuery {
  Eigen::Vector3f origin;
  // Unit length.
  Eigen::Vector3f direction;
  // The cell nearest to the origin.
  uint32_t start_cell = 0;
};

// A foam rendered along one ray.
struct RenderedRay {
  // Display values over a white background, not clipped above.
  Eigen::Vector3f color;
  // 1 - transmittance
  float opacity = 0;
  // Distance at which the transmittance falls to 0.5; 0 where it does not.
  float distance = 0;
  // Argmax of the classifier on the rendered identity; -1 where opacity < 0.5 or without semantics.
  int32_t class_index = -1;
  // Softmax of that class; 0 where class_index is -1.
  float confidence = 0;
};

// Renders rays through a foam, on the CPU or on a GPU. Thread-safe.
class RayCaster {
 public:
  virtual ~RayCaster() = default;

  // Renders all rays, up to kTransmittanceCutoff. Returns the same bytes on any number of threads.
  // CHECKs that no ray hits the step limit.
  virtual std::vector<RenderedRay> Render(std::span<const RayQuery> rays) const = 0;
};

}  // namespace semfoam
