// SPDX-License-Identifier: GPL-3.0-or-later
//
// Hard values: densities, depths, quantiles, logits and features at the ends of their ranges, faces
// without area, and sites that have moved far from where they were triangulated.
#include "foam/geometry/voronoi.h"
#include "foam/model/activation.h"
#include "foam/render/color_variation.h"
#include "foam/render/total_variation.h"
#include "foam/render/update_loops.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "tests/hard_cases/hard_case.h"

namespace semfoam {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// The raw density of any density, 0 included.
float Raw(double density) { return density > 0 ? static_cast<float>(RawDensity(density)) : -100.f; }

void SetDensities(const std::function<double(CounterRandom*)>& density, RayScene* scene) {
  CounterRandom random(41, 0xb1, 0);
  for (float& raw : scene->values.raw_density) raw = Raw(density(&random));
  scene->Update();
}

HardCase DensityCase(const std::string& name,
                     const std::string& expected,
                     const std::function<double(CounterRandom*)>& density,
                     const RayBounds& bounds = {}) {
  return {name, expected, [=](const CheckOptions& options) {
            RayScene scene(RandomSites(300, 41), 41);
            SetDensities(density, &scene);
            return CheckRays(scene, RaysFromEverywhere(40, 41), bounds, options);
          }};
}

// Nothing there: no opacity at all, and no gradient for anyone.
HardCase TransparentCase(const std::string& name, double density) {
  return {name,
          "the ray accumulates nothing, opacity is exactly 0, no cell gets a gradient",
          [=](const CheckOptions& options) {
            RayScene scene(RandomSites(300, 42), 42);
            SetDensities([=](CounterRandom*) { return density; }, &scene);
            const std::vector<RayCase> rays = RaysFromEverywhere(20, 42);
            HardCaseResult result = CheckRays(scene, rays, {}, options);
            for (const RayCase& ray : rays) {
              const RayRecord<float> record = TraceCase(scene.cells.float_geometry,
                                                        scene.values,
                                                        scene.density,
                                                        ray,
                                                        scene.cells.BruteForceNearest(ray.origin));
              RayGradient<float> gradient;
              gradient.opacity = 1;
              int emitted = 0;
              BackpropagateRay(scene.cells.float_geometry,
                               record,
                               gradient,
                               [&](const CellContribution<float>&) { ++emitted; });
              result.Expect(record.composite.Opacity() == 0, "a transparent ray has opacity.");
              result.Expect(emitted == 0, "a transparent cell got a gradient.");
            }
            return result;
          }};
}

// Segments one unit in the last place long, composited in float and in double.
HardCaseResult OneUlpSegments(const CheckOptions&) {
  HardCaseResult result;
  Deviations& deviations = result.deviations["scalar float"];
  for (const float t : {1e-3f, 0.7f, 3.f, 200.f}) {
    for (const double sigma : {2e-6, 1.0, 1e4, 1e8, 1e30}) {
      RayComposite<float> ray;
      RayComposite<double> exact;
      float t_in = t;
      for (int n = 0; n < 20; ++n) {
        const float t_out = std::nextafter(t_in, 1e30f);
        const ShadedSegment<float> segment = AddSegment(t_in, t_out, float(sigma), n, &ray);
        const ShadedSegment<double> oracle =
            AddSegment(double(t_in), double(t_out), double(float(sigma)), n, &exact);
        result.Expect(std::isfinite(segment.weight) && std::isfinite(segment.optical_depth),
                      "a piece of one ulp at ",
                      t,
                      " with density ",
                      sigma,
                      " is not finite.");
        deviations.gradient =
            std::max(deviations.gradient,
                     std::abs(segment.weight - oracle.weight) /
                         (oracle.weight * (1 + oracle.tau_in) + std::numeric_limits<float>::min()));
        t_in = t_out;
      }
    }
  }
  result.Expect(deviations.gradient < 1e-5,
                "the weights of pieces of one ulp deviate by ",
                deviations.gradient,
                ".");
  return result;
}

HardCaseResult TransmittanceUnderflow(const CheckOptions& options) {
  RayScene scene(RandomSites(300, 43), 43);
  SetDensities([](CounterRandom*) { return 1e4; }, &scene);
  const std::vector<RayCase> rays = RaysFromEverywhere(40, 43);
  HardCaseResult result = CheckRays(scene, rays, {}, options);
  int underflows = 0;
  for (const RayCase& ray : rays) {
    const RayRecord<float> record = TraceCase(scene.cells.float_geometry,
                                              scene.values,
                                              scene.density,
                                              ray,
                                              scene.cells.BruteForceNearest(ray.origin));
    underflows += record.composite.Transmittance() == 0;
  }
  result.Expect(underflows > 10, "no transmittance has underflowed.");
  return result;
}

// Quantiles of transmittance 1 and 0, that is of optical depth 0 and infinity.
HardCaseResult ExtremeQuantiles(const CheckOptions& options) {
  const RayScene scene(RandomSites(300, 44), 44);
  std::vector<RayCase> rays;
  for (RayCase ray : RaysFromEverywhere(16, 44)) {
    for (const auto& [first, second] :
         {std::pair(0.0, 0.0), {0.0, kInfinity}, {kInfinity, kInfinity}, {0.0, 1e-30}}) {
      ray.quantile_tau[0] = first;
      ray.quantile_tau[1] = second;
      rays.push_back(ray);
    }
  }
  HardCaseResult result = CheckRays(scene, rays, {}, options);
  for (const RayCase& ray : rays) {
    const RayRecord<float> record = TraceCase(scene.cells.float_geometry,
                                              scene.values,
                                              scene.density,
                                              ray,
                                              scene.cells.BruteForceNearest(ray.origin));
    for (int k = 0; k < kNumQuantiles; ++k) {
      const int segment = record.composite.quantile_segment[k];
      if (ray.quantile_tau[k] == kInfinity) {
        result.Expect(segment < 0, "a ray reaches transmittance 0.");
      } else if (!record.shaded.empty() && ray.quantile_tau[k] == 0) {
        result.Expect(segment == 0 && record.composite.quantile_depth[k] == record.shaded[0].t_in,
                      "transmittance 1 does not end where the first matter begins.");
      }
    }
  }
  return result;
}

// The identity term of one ray and its gradient by the logits, in both precisions.
void ExpectIdentityLoss(const RayScene& scene,
                        const RayCase& ray,
                        double bound,
                        HardCaseResult* result) {
  const uint32_t start = scene.cells.BruteForceNearest(ray.origin);
  const int num_classes = scene.values.num_classes;
  std::vector<float> logits(num_classes);
  std::vector<double> exact_logits(num_classes);
  const RayRecord<float> record =
      TraceCase(scene.cells.float_geometry, scene.values, scene.density, ray, start);
  const RayComposite<float>& composite = record.composite;
  RayComposite<double> exact;
  for (int c = 0; c < 3; ++c) exact.color[c] = composite.color[c];
  for (int c = 0; c < kIdentityDim; ++c) exact.identity[c] = composite.identity[c];
  exact.tau = composite.tau;
  const double loss =
      RayLoss(composite, ray.target, scene.values.Classifier(), logits.data()).identity;
  const double oracle =
      RayLoss(exact, ray.target, scene.values_in_double.Classifier(), exact_logits.data()).identity;
  result->Expect(std::abs(loss - oracle) <= bound * (1 + std::abs(oracle)),
                 "the identity loss is ",
                 loss,
                 ", in double ",
                 oracle,
                 ".");
  RayLossGradient(
      composite, ray.target, scene.values.Classifier(), kHardCaseWeights, logits.data());
  RayLossGradient(exact,
                  ray.target,
                  scene.values_in_double.Classifier(),
                  kHardCaseWeights,
                  exact_logits.data());
  double sum = 0;
  for (int k = 0; k < num_classes; ++k) {
    sum += logits[k];
    result->Expect(std::abs(logits[k] - exact_logits[k]) <= bound,
                   "the gradient of logit ",
                   k,
                   " is ",
                   logits[k],
                   ", in double ",
                   exact_logits[k],
                   ".");
  }
  result->Expect(std::abs(sum) <= bound, "the gradients of the logits sum to ", sum, ".");
}

HardCase ClassesCase(const std::string& name,
                     const std::string& expected,
                     int num_classes,
                     double largest_logit) {
  return {name, expected, [=](const CheckOptions& options) {
            RayScene scene(RandomSites(200, 45), 45, 0, num_classes);
            for (int k = 0; largest_logit > 0 && k < num_classes; ++k) {
              scene.values.bias[k] =
                  static_cast<float>(k % 2 == 0 ? largest_logit : -largest_logit);
            }
            scene.Update();
            std::vector<RayCase> rays = RaysFromEverywhere(16, 45);
            for (size_t i = 0; i < rays.size(); ++i) {
              rays[i].target.class_index = static_cast<int32_t>(i % num_classes);
            }
            HardCaseResult result = CheckRays(scene, rays, {}, options);
            // Floats of that size have bits of that size, and their differences are exponents.
            const double bound = 1e-5 + 3e-7 * largest_logit;
            for (const RayCase& ray : rays) ExpectIdentityLoss(scene, ray, bound, &result);
            return result;
          }};
}

// Total variation where features are the same on both sides of some or of all faces.
HardCaseResult EqualIdentities(const CheckOptions&) {
  HardCaseResult result;
  const WalkableCells cells(RandomSites(300, 46));
  const Delaunay& delaunay = cells.delaunay;
  const std::vector<float> weights = TotalVariationWeights(
      delaunay, FaceAreas(cells.positions, delaunay, VoronoiVertices(cells.positions, delaunay)));
  const std::vector<double> weights_in_double(weights.begin(), weights.end());
  std::vector<float> gradient;
  std::vector<double> gradient_in_double;

  const std::vector<float> equal(300 * kIdentityDim, 0.3f);
  result.Expect(TotalVariation(delaunay, weights, equal, 1.f, &gradient) == 0,
                "equal features have a variation.");
  result.Expect(std::all_of(gradient.begin(), gradient.end(), [](float g) { return g == 0; }),
                "equal features have a gradient.");

  // Two halves that differ by one ulp: the sign of the difference counts, however small it is.
  std::vector<float> halves = equal;
  for (size_t k = 0; k < halves.size() / 2; ++k) halves[k] = std::nextafter(halves[k], 1.f);
  const std::vector<double> halves_in_double(halves.begin(), halves.end());
  const double variation = TotalVariation(delaunay, weights, halves, 1.f, &gradient);
  const double oracle =
      TotalVariation(delaunay, weights_in_double, halves_in_double, 1.0, &gradient_in_double);
  result.Expect(variation > 0 && std::abs(variation - oracle) <= 1e-5 * oracle,
                "the variation is ",
                variation,
                ", in double ",
                oracle,
                ".");
  double largest = 0, deviation = 0;
  for (size_t k = 0; k < gradient.size(); ++k) {
    largest = std::max(largest, std::abs(gradient_in_double[k]));
    deviation = std::max(deviation, std::abs(gradient[k] - gradient_in_double[k]));
  }
  result.Expect(largest > 0 && deviation <= 1e-5 * largest,
                "the gradient of the variation deviates by ",
                deviation,
                ".");
  return result;
}

// Variation of the colours where cells are of one colour, empty or of colours beyond all bounds.
HardCaseResult HardColors(const CheckOptions&) {
  HardCaseResult result;
  const WalkableCells cells(RandomSites(300, 47));
  const Delaunay& delaunay = cells.delaunay;
  const std::vector<float> weights = TotalVariationWeights(
      delaunay, FaceAreas(cells.positions, delaunay, VoronoiVertices(cells.positions, delaunay)));
  std::vector<float> gradient;
  const auto vanishes = [&](float density, float even, float odd, float slope) {
    std::vector<float> rows(size_t{delaunay.num_sites} * kSurfaceColorDim);
    const std::vector<float> color_gradient(kColorGradientDim, slope);
    for (uint32_t i = 0; i < delaunay.num_sites; ++i) {
      const float value = i % 2 == 0 ? even : odd;
      const float sh[3] = {value, value, -value};
      WriteSurfaceColor(cells.positions[i],
                        CellOpacity(density, 0.05f),
                        sh,
                        color_gradient.data(),
                        &rows[size_t{i} * kSurfaceColorDim]);
    }
    const ColorGraph graph = {delaunay.offsets.data(),
                              delaunay.neighbors.data(),
                              weights.data(),
                              delaunay.num_sites,
                              rows.data(),
                              1.f};
    gradient.assign(size_t{delaunay.num_sites} * kColorVariationDim, 0.f);
    for (uint32_t i = 0; i < delaunay.num_sites; ++i) {
      AddColorVariation(graph, i, &gradient[size_t{i} * kColorVariationDim]);
    }
    return std::all_of(gradient.begin(), gradient.end(), [](float g) { return g == 0; });
  };
  result.Expect(vanishes(50, 0.7f, 0.7f, 0), "cells of one colour have a variation.");
  result.Expect(vanishes(0.1f, 0, 1, 1), "empty cells have a variation.");
  result.Expect(vanishes(0, 0, 1, 1), "cells without matter have a variation.");
  // Densities that no exponential holds, and colours a million times as bright as white: the slope
  // is that of the knee.
  result.Expect(!vanishes(1e30f, 1e6f, -1e6f, 1e6f), "huge colours have no variation.");
  float largest = 0;
  for (const float g : gradient) largest = std::max(largest, std::abs(g));
  result.Expect(largest > 0 && largest < 1, "their largest derivative is ", largest, ".");
  return result;
}

// The loss of colours in float, from differences far below their last place to the square of 1e17.
HardCaseResult ColorDifferences(const CheckOptions&) {
  HardCaseResult result;
  for (double difference = 1e-15; difference < 2e17; difference *= 10) {
    const auto square = static_cast<float>(difference * difference);
    const double x = double{square} / (kColorLossKnee * kColorLossKnee);
    // The exponential and the logarithm that do not cancel, where the loss has roots.
    const double loss = 2. / 3 * kColorLossKnee * kColorLossKnee * std::expm1(0.75 * std::log1p(x));
    const double slope = std::exp(-0.25 * std::log1p(x));
    result.Expect(std::abs(ColorLoss(square) - loss) <= 1e-6 * loss,
                  "the loss of a difference of ",
                  difference,
                  " is ",
                  ColorLoss(square),
                  ", not ",
                  loss);
    result.Expect(std::abs(ColorLossSlope(square) - slope) <= 1e-6 * slope,
                  "the slope at a difference of ",
                  difference,
                  " is ",
                  ColorLossSlope(square),
                  ", not ",
                  slope);
  }
  result.Expect(ColorLoss(0.f) == 0 && ColorLossSlope(0.f) == 1, "equal colours have a loss.");
  return result;
}

// The loss of depths in float, from those that are right to those a million times too far or near.
HardCaseResult DepthDifferences(const CheckOptions&) {
  HardCaseResult result;
  const auto check = [&](float depth, float distance) {
    const double difference = double{depth} / distance - 1;
    const double beyond = std::max(std::abs(difference) - kDistanceTolerance, 0.);
    const double root = std::hypot(beyond, kDistanceLossKnee);
    double loss = root - kDistanceLossKnee, slope = -beyond / root;
    if (difference > 0) {
      const double share = 1 / (1 + std::pow(beyond / kDistanceLossReach, 2));
      loss = (1 - share) * std::pow(kDistanceLossReach, 2) / (2 * kDistanceLossKnee);
      slope = share * share * beyond / kDistanceLossKnee;
    }
    const float found = DistanceLoss(depth, distance);
    // The ratio of two floats is off by its last place.
    result.Expect(std::abs(found - loss) <= 1e-6 * (beyond + kDistanceLossKnee),
                  "the loss of the depth ",
                  depth,
                  " at the distance ",
                  distance,
                  " is ",
                  found,
                  ", not ",
                  loss);
    const float found_slope = distance * DistanceLossSlope(depth, distance);
    result.Expect(std::abs(found_slope - slope) <= 1e-5,
                  "the slope at the depth ",
                  depth,
                  " of the distance ",
                  distance,
                  " is ",
                  found_slope,
                  ", not ",
                  slope,
                  ", times the distance");
  };
  for (const float distance : {1e-6f, 0.7f, 1e6f}) {
    for (double ratio = 1e-6; ratio < 2e6; ratio *= 1.37) {
      check(static_cast<float>(ratio * distance), distance);
    }
    for (const double ratio : {1e8, 1e12, 1e20, 1e30}) {  // squares of these are infinite
      const auto depth = static_cast<float>(ratio * distance);
      const double most = kSquaredDistanceReach / (2 * kDistanceLossKnee);
      result.Expect(std::abs(DistanceLoss(depth, distance) - most) <= 1e-6 * most,
                    "the loss of a depth that is farther by ",
                    ratio,
                    " is ",
                    DistanceLoss(depth, distance),
                    ", not ",
                    most);
      check(depth, distance);
    }
    for (const double share : {-0.9, 0., 0.9}) {
      const double inside = 1 + share * kDistanceTolerance;
      const auto depth = static_cast<float>(inside * distance);
      result.Expect(DistanceLoss(depth, distance) == 0 && DistanceLossSlope(depth, distance) == 0,
                    "a depth within the tolerance has a loss.");
    }
  }
  return result;
}

// What hangs on the areas of the faces.
struct FaceMeasures {
  explicit FaceMeasures(const WalkableCells& cells)
      : areas(FaceAreas(
            cells.positions, cells.delaunay, VoronoiVertices(cells.positions, cells.delaunay))),
        volumes(CellVolumes(cells.positions, cells.delaunay, areas)),
        radii(CellRadii(cells.positions, cells.delaunay)),
        weights(TotalVariationWeights(cells.delaunay, areas)) {}

  void ExpectFinite(HardCaseResult* result) const {
    const auto finite = [](const auto& values) {
      return std::all_of(
          values.begin(), values.end(), [](auto v) { return std::isfinite(v) && v >= 0; });
    };
    result->Expect(finite(areas), "a face area is negative or not finite.");
    result->Expect(finite(volumes), "a volume is negative or not finite.");
    result->Expect(finite(radii), "a radius is negative or not finite.");
    result->Expect(finite(weights), "a weight of the variation is negative or not finite.");
  }

  std::vector<double> areas, volumes;
  std::vector<float> radii, weights;
};

// Cells a few ulp wide, whose faces have next to no area, a cell that has no face at all, and the
// cells of a grid, most of whose faces are edges or corners.
HardCaseResult DegenerateFaces(const CheckOptions&) {
  HardCaseResult result;
  std::vector<Eigen::Vector3f> grid;
  for (int i = 0; i < 125; ++i) grid.emplace_back(i % 5 / 4.f, i / 5 % 5 / 4.f, i / 25 / 4.f);
  const WalkableCells grid_cells(grid);
  const FaceMeasures of_grid(grid_cells);
  of_grid.ExpectFinite(&result);
  const double middle_volume = of_grid.volumes[2 * 25 + 2 * 5 + 2];
  result.Expect(std::abs(middle_volume - 1 / 64.0) < 1e-12,
                "a cell of the grid has volume ",
                middle_volume,
                ".");

  std::vector<Eigen::Vector3f> sites = RandomSites(100, 47);
  const Eigen::Vector3f middle(0.3f, -0.6f, 0.7f);
  for (int c = 0; c < 3; ++c) {
    for (const float towards : {-2.f, 2.f}) {
      Eigen::Vector3f p = middle;
      p[c] = std::nextafter(p[c], towards);
      sites.push_back(p);
    }
  }
  sites.push_back(middle);
  sites.push_back(middle);
  const uint32_t narrow = 106, empty = 107;
  const WalkableCells cells(sites);
  const FaceMeasures measures(cells);
  measures.ExpectFinite(&result);
  result.Expect(measures.volumes[narrow] > 0 && measures.volumes[narrow] < 1e-20,
                "the cell one ulp wide has volume ",
                measures.volumes[narrow],
                ".");
  result.Expect(cells.delaunay.Neighbors(empty).empty() && measures.volumes[empty] == 0 &&
                    measures.radii[empty] == 0,
                "the duplicate has a cell.");
  return result;
}

HardCaseResult StaleTopology(const CheckOptions& options) {
  HardCaseResult result;
  RayScene scene(RandomSites(500, 48), 48);
  const std::vector<RayCase> rays = RaysFromEverywhere(60, 48);
  std::vector<Eigen::Vector3f> sites(scene.cells.positions.begin(),
                                     scene.cells.positions.begin() + 500);
  for (const float distance : {1e-3f, 0.1f, 1.f}) {
    CounterRandom random(48, 0xb2, static_cast<uint64_t>(1e3 * distance));
    for (Eigen::Vector3f& p : sites) p += distance * RandomDirection(&random).cast<float>();
    scene.MoveSites(sites);
    RayBounds bounds;
    bounds.stale = true;
    bounds.color_float = kInfinity;  // which cells a ray meets is not determined
    const HardCaseResult stale = CheckRays(scene, rays, bounds, options);
    result.Expect(distance < 0.1f || stale.clamped_steps > 0, "nothing was stale.");
    result.Add(stale);
    // A new triangulation heals it.
    result.Add(CheckRays(RayScene(sites, 48), rays, {}, options));
  }
  return result;
}

}  // namespace

std::vector<HardCase> ValuesCases() {
  return {
      TransparentCase("density_0", 0),
      TransparentCase("density_1e-30", 1e-30),
      DensityCase("density_1e8",
                  "opaque within an ulp; nothing overflows",
                  [](CounterRandom*) { return 1e8; }),
      DensityCase("density_1e8_beside_0",
                  "opaque within an ulp; nothing overflows",
                  [](CounterRandom* random) { return random->Below(4) == 0 ? 1e8 : 0; }),
      DensityCase(
          "optical_depth_from_1e-12_to_1e6",
          "weights and gradients as in double, however small or large",
          [](CounterRandom* random) { return std::pow(10.0, -11 + 18 * random->Uniform()); }),
      {"pieces_one_ulp_long", "weights as in double, relative to themselves", OneUlpSegments},
      {"transmittance_underflow",
       "transmittance is 0, weights sum to 1, gradients are finite",
       TransmittanceUnderflow},
      {"quantiles_at_0_and_1",
       "transmittance 1 ends where matter begins; transmittance 0 is never reached",
       ExtremeQuantiles},
      ClassesCase("logits_of_1e4",
                  "loss and gradient are finite, and as in double to the bits of logits so large",
                  5,
                  1e4),
      ClassesCase("one_class", "the identity loss and its gradient are 0", 1, 0),
      ClassesCase("5000_classes", "loss and gradient are finite and as in double", 5000, 0),
      {"equal_identities_on_both_sides",
       "the variation and its gradient are exactly 0 at the kink, signs count beside it",
       EqualIdentities},
      {"hard_colors_of_neighbors",
       "variation of the colours of cells of one colour, empty cells and colours beyond all bounds",
       HardColors},
      {"color_differences_from_0_to_1e17",
       "loss and slope as in double, relative to themselves; those of equal colours are 0 and 1",
       ColorDifferences},
      {"depths_a_million_times_too_far_or_near",
       "loss and slope as in double; those of a depth within the tolerance are 0",
       DepthDifferences},
      {"a_cell_whose_every_face_is_degenerate",
       "areas, volumes, radii and weights are finite; a duplicate has none",
       DegenerateFaces},
      {"stale_topology_after_large_moves",
       "walks end, gradients follow the branch taken, and a new triangulation heals it",
       StaleTopology},
  };
}

}  // namespace semfoam
