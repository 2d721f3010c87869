// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// A symmetric graph over N nodes in the layout of Delaunay: the edges of node i are neighbors and
// conductance [offsets[i]] .. [offsets[i + 1]].
struct ConductanceGraph {
  std::vector<uint32_t> offsets;    // [N + 1]
  std::vector<uint32_t> neighbors;  // [2 E]
  // [2 E] >= 0, the same in both directions.
  std::vector<float> conductance;

  int64_t NumNodes() const { return static_cast<int64_t>(offsets.size()) - 1; }
};

// Returns for each node the x that minimises, in each dimension,
//
//   sum over edges of conductance (x_i - x_j)^2 + sum over nodes of hold_i S_i (x_i - target_i)^2,
//
// where S_i is the sum of the node's conductances. `hold` [N] >= 0 is 0 where a node has no target;
// kFirmHold keeps a node at its target. Nodes from which no way leads to one with a target are 0.
// Solved by conjugate gradients, until no longer improved or for a fixed number of iterations; the
// result does not depend on the number of threads. `Dim` is kIdentityDim or 4.
template <int Dim>
std::vector<Eigen::Matrix<float, Dim, 1>> ExtendHarmonically(
    const ConductanceGraph& graph,
    const std::vector<float>& hold,
    const std::vector<Eigen::Matrix<float, Dim, 1>>& target);

// A hold that lets a node give way by a millionth.
inline constexpr float kFirmHold = 1e6f;

}  // namespace semfoam
