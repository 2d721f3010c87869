// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/model/foam.h"
#include "foam/render/ray_batch.h"
#include "foam/render/ray_tracer.h"
#include "foam/view/view_renderer.h"

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// A foam laid out for walking, and rays through it. Normalised frame.
struct BenchmarkScene {
  explicit BenchmarkScene(Foam foam_to_render) : foam(std::move(foam_to_render)), renderer(foam) {}
  BenchmarkScene(const BenchmarkScene&) = delete;

  const Foam foam;
  const ViewRenderer renderer;
  // Rays of walks and forward renders, in picture order.
  std::vector<WalkQuery> rays;
  // Rays of training: batches of kBatchRays rays in tiles of 2 x 2 pixels, drawn from all pixels as
  // the trainer draws them. The targets are one grey and cycling classes, because the targets do
  // not affect the cost.
  std::vector<std::vector<BatchRay>> batches;
};

// The appearance parameters of a scene's foam.
enum class Appearance {
  // All parameters of the foam.
  kFull,
  // One colour per cell for all directions (SH of degree 0), no identity, no classes.
  kPlain,
};

// The trainer's default.
inline constexpr int kBatchRays = 4096;
inline constexpr int kNumBatches = 16;

// Sites of a scene made of one thin shell: 70 % on a sphere of radius 0.4 around the origin (with a
// standard deviation of 0.002 across it), 30 % uniform in the box [-2, 2]^3. In Hilbert order; the
// sites are the same for the same std::mt19937 and libstdc++.
struct ShellSites {
  std::vector<Eigen::Vector3f> positions;
  std::vector<uint8_t> is_shell;
};
ShellSites MakeShellSites(int64_t num_sites);

// Returns the scene of those sites, with SH of degree 2, identity and 16 classes, seen by one
// camera of 640 x 480 pixels outside the sphere. Densities are those of a trained foam: the shell's
// cells have an optical depth of 1 over the spacing of the shell's sites, the others lie at the
// optimiser's lower bound. Kept until another scene is requested, so that a run never holds two.
// Thread-safe.
std::shared_ptr<const BenchmarkScene> ShellScene(int64_t num_sites,
                                                 Appearance appearance = Appearance::kFull);

// Returns the scene of a trained foam, seen from its training photos; `rays` are those of the
// batches. Kept in the same way. Throws UserError when the file is no foam, or when its photos have
// no rays.
std::shared_ptr<const BenchmarkScene> TrainedScene(const std::filesystem::path& foam_file,
                                                   Appearance appearance = Appearance::kFull);

}  // namespace semfoam
