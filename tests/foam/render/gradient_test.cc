// SPDX-License-Identifier: GPL-3.0-or-later
//
// Every gradient of a training ray, against two oracles: ceres::Jet run through the same templated
// code along the recorded sequence of cells (1e-9 relative, in double), and central differences of
// the whole walk where the sequence does not change.
#include "foam/geometry/voronoi.h"
#include "foam/render/color_variation.h"
#include "foam/render/ray_loss.h"
#include "foam/render/ray_record.h"
#include "foam/render/total_variation.h"
#include "foam/render/update_loops.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "tests/foam/random_cells.h"
#include "tests/foam/render/ray_replay.h"
#include <ceres/jet.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

using Jet = ceres::Jet<double, 1>;
using Parameters = FoamParameters<double>;

constexpr int kNumClasses = 5;
constexpr int kShDegree = 3;
// Identity bends no geometry, or does so in part or in full.
constexpr RayLossWeights kCut{1, 0.7, 0.3, 0.9, 0, 0.2};
constexpr RayLossWeights kInPart{1, 0.7, 0.3, 0.9, 0.25, 0.2};
constexpr RayLossWeights kInFull{1, 0.7, 0.3, 0.9, 1, 0.2};

class Scene {
 public:
  Scene(int num_sites, uint64_t seed)
      : cells_(RandomSites(num_sites, seed)),
        parameters_(
            RandomParameters(cells_.geometry.positions, num_sites, kShDegree, kNumClasses, seed)) {}

  // Walks for real, with the present topology, through the given parameters.
  RayRecord<double> Trace(const RayCase& ray, const Parameters& p) const {
    WalkGeometry<double> geometry;
    Refresh(p.positions, cells_.delaunay, &geometry);
    return TraceCase(geometry, p, p.Densities(), ray, Start(ray));
  }

  uint32_t Start(const RayCase& ray) const { return cells_.BruteForceNearest(ray.origin); }

  // The hand-written gradient, by kind and parameter.
  std::vector<std::vector<double>> Gradient(const RayRecord<double>& record,
                                            const RayCase& ray,
                                            const RayLossWeights& weights) const {
    WalkGeometry<double> geometry;
    Refresh(parameters_.positions, cells_.delaunay, &geometry);
    return HandWrittenGradient(geometry, record, ray, parameters_, weights);
  }

  // Compares the hand-written gradient of one ray with Jet, parameter by parameter.
  void ExpectJetAgrees(const RayCase& ray) {
    for (const RayLossWeights& weights : {kCut, kInPart, kInFull}) {
      SCOPED_TRACE("identity to density: " + std::to_string(weights.identity_to_density));
      ExpectJetAgrees(ray, weights);
    }
  }

  void ExpectJetAgrees(const RayCase& ray, const RayLossWeights& weights) {
    const RayRecord<double> record = Trace(ray, parameters_);
    ASSERT_FALSE(record.hit_step_limit);
    const auto gradient = Gradient(record, ray, weights);
    // What rounding leaves of terms that cancel: a derivative by optical depth is a difference of
    // derivatives by weights, and the derivative by a crossing is that times the density of the
    // cell.
    double rounding = 1e-15;
    for (const auto& shaded : record.shaded) rounding = std::max(rounding, 1e-16 * shaded.sigma);
    rounding *= LargestByWeight(record, ray, weights);
    FoamParameters<Jet> jets = Cast<Jet>(parameters_);
    ExpectEqualTotals(record, ray, jets, weights);
    for (int kind = 0; kind < kNumParameterKinds; ++kind) {
      for (size_t k = 0; k < gradient[kind].size(); ++k) {
        // Guards do not move: they get no gradient.
        if (kind == 0 && k / 3 >= cells_.delaunay.num_sites) continue;
        Jet* const parameter = jets.Find(kind, k);
        parameter->v[0] = 1;
        const double oracle = ReplayLoss(record, ray, jets, weights).v[0];
        parameter->v[0] = 0;
        ASSERT_TRUE(std::isfinite(gradient[kind][k])) << kParameterKinds[kind] << " " << k;
        ASSERT_NEAR(gradient[kind][k], oracle, 1e-9 * std::abs(oracle) + rounding)
            << kParameterKinds[kind] << " " << k;
        compared_ += oracle != 0;
      }
    }
  }

  // Compares with central differences of the whole walk; parameters whose step changes the sequence
  // of cells are left out.
  void ExpectDifferencesAgree(const RayCase& ray, const RayLossWeights& weights) {
    const RayRecord<double> record = Trace(ray, parameters_);
    const auto gradient = Gradient(record, ray, weights);
    constexpr double kStep = 1e-6;
    for (int kind = 0; kind < kNumParameterKinds; ++kind) {
      double largest = 1e-3;
      for (const double g : gradient[kind]) largest = std::max(largest, std::abs(g));
      for (size_t k = 0; k < gradient[kind].size(); ++k) {
        if (kind == 0 && k / 3 >= cells_.delaunay.num_sites) continue;
        Parameters moved = parameters_;
        double* const parameter = moved.Find(kind, k);
        const double value = *parameter;
        double loss[2];
        bool same = true;
        for (int side = 0; side < 2 && same; ++side) {
          *parameter = value + (side == 0 ? -kStep : kStep);
          const RayRecord<double> other = Trace(ray, moved);
          same = SameBranch(record, other);
          // The dominant cell's class bends no geometry, nor does the rendered identity's where it
          // is cut, so these parts of the loss are replayed with the weights of the unmoved ray.
          loss[side] = same ? ReplayLoss(Reweighted(other, record), ray, moved, weights) : 0;
        }
        if (!same) {
          ++skipped_;
          continue;
        }
        const double difference = (loss[1] - loss[0]) / (2 * kStep);
        ASSERT_NEAR(gradient[kind][k], difference, 2e-6 * largest)
            << kParameterKinds[kind] << " " << k;
        differenced_ += std::abs(difference) > 1e-9;
      }
    }
  }

  WalkableCells cells_;
  Parameters parameters_;
  size_t compared_ = 0, differenced_ = 0, skipped_ = 0;

 private:
  // The order of magnitude of dL/dw: 1 for colour and opacity, and for the identity, which is not
  // bounded, the largest on the ray.
  double LargestByWeight(const RayRecord<double>& record,
                         const RayCase& ray,
                         const RayLossWeights& weights) const {
    if (weights.identity_to_density == 0) return 1;
    std::vector<double> logits(kNumClasses);
    const ClassifierView<double> classifier = parameters_.Classifier();
    RayLoss(record.composite, ray.target, classifier, logits.data());
    const RayGradient<double> gradient =
        RayLossGradient(record.composite, ray.target, classifier, weights, logits.data());
    double largest = 0;
    for (const auto& segment : record.segments) {
      if (segment.shaded < 0) continue;
      double by_weight = 0;
      for (int c = 0; c < kIdentityDim; ++c) {
        by_weight += gradient.identity[c] * parameters_.identity[segment.cell * kIdentityDim + c];
      }
      largest = std::max(largest, std::abs(by_weight));
    }
    return 1 + weights.identity_to_density * largest;
  }

  static RayRecord<double> Reweighted(RayRecord<double> record, const RayRecord<double>& weights) {
    for (size_t k = 0; k < record.shaded.size(); ++k) {
      record.shaded[k].weight = weights.shaded[k].weight;
    }
    return record;
  }

  static bool SameBranch(const RayRecord<double>& a, const RayRecord<double>& b) {
    if (a.segments.size() != b.segments.size() || a.shaded.size() != b.shaded.size()) return false;
    for (size_t n = 0; n < a.segments.size(); ++n) {
      if (a.segments[n].cell != b.segments[n].cell || a.segments[n].next != b.segments[n].next ||
          a.segments[n].clamped != b.segments[n].clamped ||
          a.segments[n].shaded != b.segments[n].shaded) {
        return false;
      }
    }
    for (size_t n = 0; n < a.shaded.size(); ++n) {
      if ((a.shaded[n].weight > kNegligibleWeight) != (b.shaded[n].weight > kNegligibleWeight)) {
        return false;
      }
      for (int c = 0; c < 3; ++c) {
        if ((a.shaded[n].color[c] > 0) != (b.shaded[n].color[c] > 0)) return false;
      }
    }
    for (int k = 0; k < 2; ++k) {
      if (a.composite.quantile_segment[k] != b.composite.quantile_segment[k]) return false;
    }
    return true;
  }

  // The replay must tell the same story as the walk, or it would be no oracle.
  void ExpectEqualTotals(const RayRecord<double>& record,
                         const RayCase& ray,
                         const FoamParameters<Jet>& jets,
                         const RayLossWeights& weights) const {
    std::vector<double> logits(kNumClasses);
    const double walked =
        RayLoss(record.composite, ray.target, parameters_.Classifier(), logits.data())
            .Total(weights);
    ASSERT_NEAR(
        ReplayLoss(record, ray, jets, weights).a, walked, 1e-12 * std::max(1.0, std::abs(walked)));
  }
};

RayCase RandomRay(uint64_t seed, int index) {
  CounterRandom random(seed, 0x53, index);
  RayCase ray;
  ray.origin = RandomPoint(&random, index % 3 == 0 ? 2.5 : 0.8);
  const Eigen::Vector3d aim = RandomPoint(&random, 0.7);
  ray.direction = (aim - ray.origin).normalized();
  for (float& c : ray.target.color) c = static_cast<float>(random.Uniform());
  // Of one in four rays, channels may be brighter.
  ray.target.at_least = random.Uniform() < 0.25 ? 5 : 0;
  ray.target.class_index =
      index % 4 == 3 ? Value(kUnlabelled) : static_cast<int>(random.Below(kNumClasses));
  const double u = random.Uniform(), v = random.Uniform();
  ray.quantile_tau[0] = -std::log(1 - std::min(u, v));
  ray.quantile_tau[1] = -std::log(1 - std::max(u, v));
  return ray;
}

TEST(Gradient, AgreesWithJetOnRandomRays) {
  for (const uint64_t seed : {1, 2, 3}) {
    Scene scene(60, seed);
    for (int i = 0; i < 12; ++i) {
      SCOPED_TRACE("scene " + std::to_string(seed) + " ray " + std::to_string(i));
      scene.ExpectJetAgrees(RandomRay(seed, i));
    }
    EXPECT_GT(scene.compared_, 2000u);
  }
}

TEST(Gradient, AgreesWithCentralDifferences) {
  Scene scene(30, 5);
  // Central differences cannot resolve optical depths of hundreds: matter, but no saturated matter
  // here.
  for (double& raw : scene.parameters_.raw_density) raw = std::min(raw, 0.3);
  for (int i = 0; i < 6; ++i) {
    SCOPED_TRACE(i);
    scene.ExpectDifferencesAgree(RandomRay(5, i), kCut);
    scene.ExpectDifferencesAgree(RandomRay(5, i), kInFull);
  }
  EXPECT_GT(scene.differenced_, 1000u);
  EXPECT_LT(scene.skipped_, scene.differenced_ / 10);
}

TEST(Gradient, OfARayThatLeavesTheFoamWithoutMeetingAnything) {
  Scene scene(40, 7);
  RayCase ray = RandomRay(7, 0);
  ray.origin = Eigen::Vector3d(1.5, 1.5, 1.5);
  ray.direction = Eigen::Vector3d(1, 1, 1).normalized();
  scene.ExpectJetAgrees(ray);
}

TEST(Gradient, OfTheLastCellBeforeTheGuards) {
  // Only the cell that the ray leaves last is matter: published kernels lose its gradient.
  Scene scene(40, 8);
  RayCase ray = RandomRay(8, 1);
  const RayRecord<double> walk = scene.Trace(ray, scene.parameters_);
  uint32_t last = 0;
  for (const auto& segment : walk.segments) {
    if (segment.cell < scene.cells_.delaunay.num_sites) last = segment.cell;
  }
  std::fill(scene.parameters_.raw_density.begin(), scene.parameters_.raw_density.end(), -3.0);
  scene.parameters_.raw_density[last] = -0.2;
  const auto gradient = scene.Gradient(scene.Trace(ray, scene.parameters_), ray, kCut);
  EXPECT_NE(gradient[1][last], 0);
  EXPECT_NE(gradient[0][3 * last], 0);
  scene.ExpectJetAgrees(ray);
}

TEST(Gradient, OfSaturatedCellsIsFiniteAndAgrees) {
  Scene scene(60, 9);
  for (double& raw : scene.parameters_.raw_density) raw = raw > 0 ? 1e4 : raw;
  for (int i = 0; i < 8; ++i) scene.ExpectJetAgrees(RandomRay(9, i));
}

TEST(Gradient, OfRaysAlongCellEdges) {
  // A ray through two Voronoi vertices of one Voronoi edge runs along that edge: ties at every
  // turn.
  Scene scene(60, 10);
  const auto vertices = VoronoiVertices(scene.cells_.positions, scene.cells_.delaunay);
  int tried = 0;
  for (uint32_t t = 0; t < vertices.size() && tried < 10; ++t) {
    const uint32_t other = scene.cells_.delaunay.tet_neighbors[t][0];
    if (other == kNoTet || vertices[t].norm() > 1 || vertices[other].norm() > 1) continue;
    RayCase ray = RandomRay(10, t);
    ray.direction = (vertices[other] - vertices[t]).normalized();
    ray.origin = vertices[t] - 0.5 * ray.direction;
    SCOPED_TRACE(t);
    scene.ExpectJetAgrees(ray);
    ++tried;
  }
  EXPECT_EQ(tried, 10);
}

TEST(Gradient, OnATopologyOlderThanThePositions) {
  // Sites that moved since the last triangulation clamp some exits; the gradient must follow the
  // branch taken.
  Scene scene(60, 11);
  CounterRandom random(11, 0x54, 0);
  for (size_t i = 0; i < scene.cells_.delaunay.num_sites; ++i) {
    scene.parameters_.positions[i] += 0.08 * RandomDirection(&random);
  }
  size_t clamped = 0;
  for (int i = 0; i < 20; ++i) {
    const RayCase ray = RandomRay(11, i);
    for (const auto& segment : scene.Trace(ray, scene.parameters_).segments)
      clamped += segment.clamped;
    scene.ExpectJetAgrees(ray);
  }
  EXPECT_GT(clamped, 0u);
}

TEST(Gradient, OfQuantilesInOneCell) {
  Scene scene(20, 12);
  for (double& raw : scene.parameters_.raw_density) raw = 1;
  RayCase ray = RandomRay(12, 1);
  ray.quantile_tau[0] = 0.001;
  ray.quantile_tau[1] = 0.01;
  const RayRecord<double> record = scene.Trace(ray, scene.parameters_);
  ASSERT_EQ(record.composite.quantile_segment[0], record.composite.quantile_segment[1]);
  ASSERT_GE(record.composite.quantile_segment[0], 0);
  scene.ExpectJetAgrees(ray);
}

TEST(Gradient, OfTotalVariation) {
  WalkableCells cells(RandomSites(80, 13));
  const auto areas =
      FaceAreas(cells.positions, cells.delaunay, VoronoiVertices(cells.positions, cells.delaunay));
  const std::vector<float> float_weights = TotalVariationWeights(cells.delaunay, areas);
  const std::vector<double> weights(float_weights.begin(), float_weights.end());
  CounterRandom random(13, 0x55, 0);
  std::vector<double> identity(80 * kIdentityDim);
  for (double& f : identity) f = random.Normal();
  // A kink: two whole cells alike.
  std::copy_n(identity.begin(), kIdentityDim, identity.begin() + kIdentityDim);
  std::vector<double> gradient;
  const double total = TotalVariation(cells.delaunay, weights, identity, 1.0, &gradient);

  const auto variation = [&](const auto& f) {
    using T = typename std::decay_t<decltype(f)>::value_type;
    T sum = T(0);
    for (uint32_t i = 0; i < cells.delaunay.num_sites; ++i) {
      for (uint32_t e = cells.delaunay.offsets[i]; e < cells.delaunay.offsets[i + 1]; ++e) {
        const uint32_t j = cells.delaunay.neighbors[e];
        if (j >= cells.delaunay.num_sites || j < i) continue;
        sum += EdgeVariation(T(weights[e]), &f[i * kIdentityDim], &f[j * kIdentityDim]);
      }
    }
    return sum;
  };
  EXPECT_NEAR(total, variation(identity), 1e-12 * total);
  std::vector<Jet> jets;
  for (const double f : identity) jets.push_back(Jet(f));
  for (size_t k = 0; k < jets.size(); ++k) {
    // At the kink the stated derivative is 0 while Jet takes one side of |x|; compare where
    // neighbours differ.
    if (k < 2 * kIdentityDim) continue;
    jets[k].v[0] = 1;
    const double oracle = variation(jets).v[0];
    jets[k].v[0] = 0;
    ASSERT_NEAR(gradient[k], oracle, 1e-9 * std::max(std::abs(oracle), 1e-6)) << k;
    const double value = identity[k];
    identity[k] = value + 1e-7;
    const double above = variation(identity);
    identity[k] = value - 1e-7;
    const double below = variation(identity);
    identity[k] = value;
    ASSERT_NEAR(gradient[k], (above - below) / 2e-7, 1e-6) << k;
  }
}

TEST(Gradient, OfTotalVariationVanishesForEqualFeatures) {
  WalkableCells cells(RandomSites(30, 14));
  const auto areas =
      FaceAreas(cells.positions, cells.delaunay, VoronoiVertices(cells.positions, cells.delaunay));
  const std::vector<float> weights = TotalVariationWeights(cells.delaunay, areas);
  const std::vector<float> identity(30 * kIdentityDim, 0.25f);
  std::vector<float> gradient;
  EXPECT_EQ(TotalVariation(cells.delaunay, weights, identity, 1.f, &gradient), 0);
  for (const float g : gradient) EXPECT_EQ(g, 0);
}

// Rows of random colours, some of empty cells, with differences on both sides of the knee.
template <typename T>
std::vector<T> RandomSurfaceColors(const std::vector<Eigen::Vector3f>& positions,
                                   uint32_t num_sites,
                                   const std::vector<double>& parameters) {
  std::vector<T> rows;
  for (uint32_t i = 0; i < num_sites; ++i) {
    const double* const p = &parameters[size_t{i} * kColorVariationDim];
    for (int k = 0; k < kColorGradientDim; ++k) rows.push_back(T(p[k]));
    for (int c = 0; c < 3; ++c) rows.push_back(T(0.5 + kShDc * p[kColorGradientDim + c]));
    for (int a = 0; a < 3; ++a) rows.push_back(T(double(positions[i][a])));
    rows.push_back(T(i % 5 == 0 ? 0 : 0.1 + 0.9 * (i % 7) / 7.0));
  }
  return rows;
}

// Calls body(i, weight, row of i, row of j) for the edges between real cells, from both sides.
template <typename T, typename Body>
void ForColorEdges(const Delaunay& delaunay,
                   const std::vector<double>& weights,
                   const std::vector<T>& rows,
                   Body&& body) {
  for (uint32_t i = 0; i < delaunay.num_sites; ++i) {
    for (uint32_t e = delaunay.offsets[i]; e < delaunay.offsets[i + 1]; ++e) {
      const uint32_t j = delaunay.neighbors[e];
      if (j >= delaunay.num_sites) continue;
      body(i, T(weights[e]), &rows[i * kSurfaceColorDim], &rows[j * kSurfaceColorDim]);
    }
  }
}

std::vector<float> ColorVariationInFloats(const Delaunay& delaunay,
                                          const std::vector<float>& weights,
                                          const std::vector<float>& rows) {
  const ColorGraph graph = {delaunay.offsets.data(),
                            delaunay.neighbors.data(),
                            weights.data(),
                            delaunay.num_sites,
                            rows.data(),
                            1.f};
  std::vector<float> gradient(size_t{delaunay.num_sites} * kColorVariationDim, 0.f);
  for (uint32_t i = 0; i < delaunay.num_sites; ++i) {
    AddColorVariation(graph, i, &gradient[size_t{i} * kColorVariationDim]);
  }
  return gradient;
}

TEST(Gradient, OfColorVariation) {
  constexpr uint32_t kSites = 80;
  WalkableCells cells(RandomSites(kSites, 15));
  const Delaunay& delaunay = cells.delaunay;
  const std::vector<float> float_weights = TotalVariationWeights(
      delaunay, FaceAreas(cells.positions, delaunay, VoronoiVertices(cells.positions, delaunay)));
  const std::vector<double> weights(float_weights.begin(), float_weights.end());
  CounterRandom random(15, 0x57, 0);
  std::vector<double> parameters(kSites * kColorVariationDim);
  for (double& p : parameters) p = 0.04 * random.Normal();

  std::vector<double> gradient(parameters.size(), 0.0);
  ForColorEdges(delaunay,
                weights,
                RandomSurfaceColors<double>(cells.positions, kSites, parameters),
                [&](uint32_t i, double weight, const double* a, const double* b) {
                  AddColorSlopes(weight, a, b, &gradient[i * kColorVariationDim]);
                });
  const auto variation = [&](const auto& rows) {
    using T = typename std::decay_t<decltype(rows)>::value_type;
    T sum = T(0);
    ForColorEdges(delaunay, weights, rows, [&](uint32_t, const T& weight, const T* a, const T* b) {
      sum += T(0.5) * ColorEdgeVariation(weight, a, b);
    });
    return sum;
  };
  auto jets = RandomSurfaceColors<Jet>(cells.positions, kSites, parameters);
  size_t moved = 0;
  for (size_t k = 0; k < parameters.size(); ++k) {
    const size_t p = k % kColorVariationDim;
    Jet& value = jets[k / kColorVariationDim * kSurfaceColorDim + p];
    value.v[0] = p < kColorGradientDim ? 1 : kShDc;
    const double oracle = variation(jets).v[0];
    value.v[0] = 0;
    ASSERT_NEAR(gradient[k], oracle, 1e-9 * std::max(std::abs(oracle), 1e-6)) << k;
    moved += gradient[k] != 0;
    std::vector<double> changed = parameters;
    changed[k] += 1e-7;
    const double above = variation(RandomSurfaceColors<double>(cells.positions, kSites, changed));
    changed[k] -= 2e-7;
    const double below = variation(RandomSurfaceColors<double>(cells.positions, kSites, changed));
    ASSERT_NEAR(gradient[k], (above - below) / 2e-7, 1e-6) << k;
  }
  // All cells but the empty ones.
  EXPECT_GT(moved, parameters.size() * 3 / 4);

  // Vector instructions in floats.
  const std::vector<float> in_floats = ColorVariationInFloats(
      delaunay, float_weights, RandomSurfaceColors<float>(cells.positions, kSites, parameters));
  for (size_t k = 0; k < gradient.size(); ++k) {
    ASSERT_NEAR(in_floats[k], gradient[k], 1e-5 * std::max(std::abs(gradient[k]), 1e-3)) << k;
  }
}

// A linear colour over all cells has no variation: each cell goes on where the other one ends.
TEST(Gradient, OfColorVariationVanishesForALinearColor) {
  constexpr uint32_t kSites = 60;
  WalkableCells cells(RandomSites(kSites, 16));
  const auto areas =
      FaceAreas(cells.positions, cells.delaunay, VoronoiVertices(cells.positions, cells.delaunay));
  const std::vector<float> weights = TotalVariationWeights(cells.delaunay, areas);
  std::vector<double> parameters(kSites * kColorVariationDim);
  for (uint32_t i = 0; i < kSites; ++i) {
    for (int c = 0; c < 3; ++c) {
      double value = 0.1 * c;
      for (int a = 0; a < 3; ++a) {
        const double slope = 0.05 * (a - c);
        parameters[i * kColorVariationDim + 3 * a + c] = slope;
        value += slope * double(cells.positions[i][a]);
      }
      parameters[i * kColorVariationDim + kColorGradientDim + c] = value / kShDc;
    }
  }
  const auto rows = RandomSurfaceColors<float>(cells.positions, kSites, parameters);
  for (const float g : ColorVariationInFloats(cells.delaunay, weights, rows)) {
    EXPECT_LT(std::abs(g), 1e-6);
  }
}

}  // namespace
}  // namespace semfoam
