// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/device/device.h"
#include "foam/render/compositing.h"
#include "foam/render/ray_loss.h"
#include "foam/render/ray_record.h"

#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <sstream>
#include <string>
#include <vector>

#include "tests/foam/random_cells.h"
#include "tests/foam/render/ray_replay.h"

namespace semfoam {

// How far one variant of the ray tracer strays, at most, over a set of rays.
struct Deviations {
  // At points inside each segment of a ray: how much farther away the cell's own site is than the
  // nearest of all sites, over the reach of the ray there: max(1, |origin|, |point|, |point -
  // site|). Lengths are of the normalised frame, where 1 is about the cameras' distance.
  double walk = 0;
  // |sum of the weights - (1 - transmittance)|.
  double weights = 0;
  // Of what a ray says to its cells (weight, dL/ddensity, dL/dposition) from the oracle, over the
  // magnitude of the terms that it is the sum of (GradientScales). The oracle of float and SIMD is
  // the scalar backward pass in double over the very same segments, that of double is
  // ceres::Jet (in the tests only).
  double gradient = 0;
  // Of colour and opacity from those of the scalar walk in double.
  double color = 0;

  void Include(const Deviations& other);
};

// What a hard case has found.
struct HardCaseResult {
  std::vector<std::string> failures;             // sentences; empty = passed
  std::map<std::string, Deviations> deviations;  // by variant
  int64_t rays = 0;                              // traced, over all variants
  int64_t steps = 0;
  int64_t zero_length_steps = 0;
  int64_t clamped_steps = 0;  // exits before the entry; a part of zero_length_steps
  int64_t step_limit_hits = 0;

  // Notes a failure, with the sentence made of `parts`, unless `ok`.
  template <typename... Parts>
  void Expect(bool ok, const Parts&... parts) {
    if (ok) return;
    std::ostringstream sentence;
    (sentence << ... << parts);
    failures.push_back(sentence.str());
  }

  void Add(const HardCaseResult& other);
};

// Triangulated sites with values for every parameter, ready for all variants.
struct RayScene {
  // Random values (RandomParameters), SH degree 2 and five classes unless told otherwise.
  RayScene(const std::vector<Eigen::Vector3f>& sites,
           uint64_t seed,
           int sh_degree = 2,
           int num_classes = 5);

  // Moves the sites, guards left out, and keeps the topology.
  void MoveSites(const std::vector<Eigen::Vector3f>& sites);
  // Takes over changes of `values`.
  void Update();

  // The distance of the nearest site by looking at all of them.
  double NearestDistance(const Eigen::Vector3d& x) const;

  void BoundColorGradients();

  uint32_t NumSites() const { return cells.delaunay.num_sites; }

  WalkableCells cells;
  FoamParameters<float> values;
  FoamParameters<double> values_in_double;
  std::vector<float> density;  // [num_cells], activated in float
  std::vector<double> density_in_double;
  Eigen::ArrayXd x, y, z;  // [num_cells] positions
};

// The outcomes that CheckRays asserts. The defaults hold wherever a case states nothing else.
struct RayBounds {
  double walk_float = 2e-6, walk_double = 1e-14;
  double weights_float = 2e-6, weights_double = 1e-14;
  double gradient_float = 2e-5, gradient_double = 1e-9;
  double color_float = 1e-3;
  // The topology is older than the positions: then no cell need be the nearest, and only the rest
  // is asserted.
  bool stale = false;
  // No real cell is unbounded: the walk ends in a guard's cell.
  bool ends_in_guard = true;
};

// Weights of the loss whose gradients are checked.
inline constexpr RayLossWeights kHardCaseWeights{1, 0.7, 0.3, 0.9, 0, 0.2};

// The largest deviation (as Deviations::gradient) of the hand-written gradient in double from an
// independent one.
using GradientOracle =
    std::function<double(const RayScene& scene, const RayCase& ray, uint32_t start)>;

struct CheckOptions {
  // Sees the first few rays of a set; may be empty.
  GradientOracle oracle;
  // A GPU renders the rays besides; the CPU renders them in any case.
  Device device;
};

// Traces every ray with all variants (the scalar reference in double and in float, the vector code
// on every instruction set of the machine) and asserts, ray by ray:
// nothing is NaN or infinite; the step limit is not hit; segments follow on each other and t never
// runs backwards; a step of zero length leads to a site farther along the ray, and no cell comes
// twice; the walk agrees with looking at all sites; the weights sum to 1 - transmittance; the
// gradient equals the oracle's; the colour equals that of double. Rays are rounded to float first,
// for all variants alike.
HardCaseResult CheckRays(const RayScene& scene,
                         std::vector<RayCase> rays,
                         const RayBounds& bounds,
                         const CheckOptions& options = {});

// The magnitude of the terms of one cell's gradient: what rounding is relative to.
struct GradientScale {
  double weight = 0;
  double density = 0;
  double position = 0;
  bool ambiguous = false;  // a face of the ray is grazing in one arithmetic and not in the other
};
std::map<uint32_t, GradientScale> GradientScales(const WalkGeometry<double>& geometry,
                                                 const FoamParameters<double>& values,
                                                 const RayRecord<double>& record,
                                                 const RayGradient<double>& gradient);

// Rays from all around and from within: every fourth from outside the guards, aimed at the unit
// box; the others start in the box, in any direction.
std::vector<RayCase> RaysFromEverywhere(int count, uint64_t seed);

// Rounds to float. A call, because GCC 12 at -O3 takes a Vector3d that is rounded to float and back
// in place for unchanged.
[[gnu::noinline]] Eigen::Vector3f ToFloat(const Eigen::Vector3d& x);

// Fills in the target and quantiles of a ray whose geometry is given; unlabelled every fourth time.
RayCase MakeRay(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, uint64_t seed);

}  // namespace semfoam
