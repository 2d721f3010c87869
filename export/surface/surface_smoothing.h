// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// Corners of triangles as indices of positions, counter-clockwise seen from outside.
using Triangles = std::vector<std::array<uint32_t, 3>>;

// Adds to each value [vertices] those of its neighbours, `steps` times; of closed surfaces, each
// neighbour once.
template <typename T>
void AddNeighbors(const Triangles& triangles, int steps, std::vector<T>* values) {
  for (int step = 0; step < steps; ++step) {
    const std::vector<T> before = *values;
    for (const auto& [a, b, c] : triangles) {
      (*values)[a] += before[b];
      (*values)[b] += before[c];
      (*values)[c] += before[a];
    }
  }
}

// Returns the volume that closed surfaces enclose, in the cubed unit of `positions`; negative for
// inverted surfaces, 0 without positions.
double EnclosedVolume(const std::vector<Eigen::Vector3d>& positions, const Triangles& triangles);

// Smooths a closed 2-manifold without blunting its edges: one step of the umbrella operator removes
// the strongest noise, then the normals of the triangles are filtered bilaterally (weighted by
// area, distance and similarity of the normals) and the vertices are fitted to them (Zheng, Fu, Au
// and Tai, "Bilateral Normal Filtering for Mesh Denoising", TVCG 2011, the local iterative scheme;
// vertices as in Sun, Rosin, Martin and Langbein, "Fast and Effective Feature-Preserving Mesh
// Denoising", TVCG 2007). At the end the surface is moved along its normals until it encloses
// `volume` (in the cubed unit of the positions), as far as `max_move` allows.
//
// Vertex v moves by at most `max_move[v]`. Only positions change, so the surface stays a closed
// manifold; it may intersect itself afterwards. The result is the same on any number of threads.
// CHECKs that the sizes agree.
void SmoothKeepingEdges(const Triangles& triangles,
                        const std::vector<double>& max_move,
                        double volume,
                        std::vector<Eigen::Vector3d>* positions);

// Where a vertex may move to.
enum class VertexMove : uint8_t { kNone, kOutwards, kBothWays };

// Removes the dents and bumps of single cells from closed 2-manifolds, and leaves what several
// vertices agree on. Fits a thin plate to the surface: the least sum of the squared distances from
// the start, plus the squared umbrella operator of the umbrella operator, whose zero Kobbelt,
// Campagna, Vorsatz and Seidel solve for ("Interactive Multi-Resolution Modeling on Arbitrary
// Meshes", SIGGRAPH 1998). A vertex that is d away from the plate along its normal counts
// (1 + (d / length)^2)^-2 there (Geman and McClure, in reweighted least squares), where the length
// is kOutlierRadii of its `radii`; and by what it does not count, or its neighbours do not in the
// mean, it moves to the plate. So what is curved or has an edge, but is smooth as far as cells can
// tell, stays nearly where it is.
//
// `radii` [positions] are those of the cells behind the vertices, in the positions' unit, >= 0.
// `moves` [positions]: kOutwards fills dents and leaves what stands out. Only positions change; the
// surface may intersect itself afterwards. The result is the same on any number of threads. CHECKs
// that the sizes agree.
void FairOutliers(const Triangles& triangles,
                  const std::vector<double>& radii,
                  const std::vector<VertexMove>& moves,
                  std::vector<Eigen::Vector3d>* positions);

inline constexpr double kOutlierRadii = 0.8;

// Cuts spikes off a closed 2-manifold: vertices that are farther from the mean of their neighbours
// than a circle as long as the line of the sides around them is wide (its radius), so that their
// faces make a cone steeper than 45 degrees, move towards that mean by three quarters of the way,
// and again, at most five times. The corners of a cube are blunter than that. Vertices that are
// `is_fixed` [positions] stay. CHECKs that the sizes agree.
void CutSpikes(const Triangles& triangles,
               const std::vector<uint8_t>& is_fixed,
               std::vector<Eigen::Vector3d>* positions);

}  // namespace semfoam
