// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// Rays stop where this share of the light is left, in training and in rendering alike.
inline constexpr double kTransmittanceCutoff = 1e-3;

// A ray to be shown, in the normalised frame.
struct RayQuery {
  Eigen::Vector3f origin;
  Eigen::Vector3f direction;  // unit length
  uint32_t start_cell = 0;    // the cell nearest to the origin
};

// What the foam looks like along it.
struct RenderedRay {
  Eigen::Vector3f color;     // display values over a white background, not clipped above
  float opacity = 0;         // 1 - transmittance
  float distance = 0;        // where transmittance falls to 0.5; 0 = it never does
  int32_t class_index = -1;  // argmax of the classifier on the rendered identity; -1 where opacity
                             // < 0.5 or without semantics
  float confidence = 0;      // softmax of that class; 0 where class_index is -1
};

// Shows a foam, on the CPU or on a GPU. Thread-safe.
class RayCaster {
 public:
  virtual ~RayCaster() = default;

  // Rays stop at kTransmittanceCutoff. The same bytes on any number of threads. CHECKs that no ray
  // hits the step limit.
  virtual std::vector<RenderedRay> Render(std::span<const RayQuery> rays) const = 0;
};

}  // namespace semfoam
