// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// A colour that a photo shows of a vertex.
struct VertexObservation {
  int photo = -1;  // -1: none
  // Weight among the observations of the vertex, >= 0.
  float weight = 0;
  // Display values.
  std::array<uint8_t, 3> color = {};
};

// Finds for each photo and channel the gain, in linear light, by which its colours agree best with
// those that other photos show of the same vertices: weighted least squares over the logarithms of
// the light, each vertex having one unknown light, with Huber's weights against what differs for
// other reasons. A prior of 3 % keeps the gains near 1, and their weighted mean is 1.
// `observations` holds the same number for each vertex. Returns [photos].
std::vector<Eigen::Vector3d> PhotoGains(std::span<const VertexObservation> observations,
                                        int observations_per_vertex,
                                        int num_photos);

// Extends a quantity that is known at some vertices over the surface: layer by layer outwards each
// other vertex gets the mean of its neighbours, which then is smoothed, and fades by half over 140
// layers. What is not connected to a known vertex gets 0. `values` and `is_known`: [vertices].
void ExtendOverSurface(std::span<const std::array<uint32_t, 3>> triangles,
                       std::span<const uint8_t> is_known,
                       std::vector<Eigen::Vector3f>* values);

}  // namespace semfoam
