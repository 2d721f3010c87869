// SPDX-License-Identifier: GPL-3.0-or-later
//
// The vector code on every instruction set of this machine against the reference: the same steps
// bit for bit, weights, colours and gradients to rounding.
#include "foam/render/ray_tracer.h"

#include <cmath>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include "tests/foam/random_cells.h"
#include <gtest/gtest.h>

namespace semfoam {
namespace {

constexpr int kShDegree = 2;
constexpr float kInfinity = std::numeric_limits<float>::infinity();

// What the cells of a scene look like, in float and in double.
struct Appearance {
  explicit Appearance(const WalkableCells& cells, double gradient_scale = 0.2) {
    CounterRandom random(5, 0x71, 0);
    const uint32_t n = cells.delaunay.num_sites;
    for (uint32_t i = 0; i < cells.delaunay.num_cells; ++i) {
      // Empty, all but empty, haze, matter, and more than any exponential can tell from infinity.
      const float densities[] = {0, 1e-7f, 1e-4f, 0.5f, 8, 60, 1e6f};
      density.push_back(i < n ? densities[random.Below(7)] : 0);
    }
    for (uint32_t k = 0; k < n * 27; ++k) sh.push_back(0.7f * random.Normal());
    for (uint32_t k = 0; k < n * kIdentityDim; ++k) identity.push_back(random.Normal());
    for (uint32_t k = 0; k < n * kColorGradientDim; ++k) {
      color_gradient.push_back(static_cast<float>(gradient_scale * random.Normal()));
    }
    density_double.assign(density.begin(), density.end());
    sh_double.assign(sh.begin(), sh.end());
    identity_double.assign(identity.begin(), identity.end());
    color_gradient_double.assign(color_gradient.begin(), color_gradient.end());
  }

  CellShading<float> Float() const {
    return {kShDegree, density.data(), sh.data(), identity.data(), color_gradient.data()};
  }
  CellShading<double> Double() const {
    return {kShDegree,
            density_double.data(),
            sh_double.data(),
            identity_double.data(),
            color_gradient_double.data()};
  }

  std::vector<float> density, sh, identity, color_gradient;
  std::vector<double> density_double, sh_double, identity_double, color_gradient_double;
};

std::vector<RayTrace> RandomRays(const WalkableCells& cells, int count, uint64_t seed) {
  std::vector<RayTrace> rays(count);
  for (int i = 0; i < count; ++i) {
    CounterRandom random(seed, 0x72, i);
    const Eigen::Vector3d origin = RandomPoint(&random, i % 5 == 0 ? 130 : 1.2);
    rays[i].origin = origin.cast<float>();
    rays[i].direction =
        (i % 5 == 0 ? (RandomPoint(&random, 1) - origin).normalized() : RandomDirection(&random))
            .cast<float>();
    if (i % 7 == 0) rays[i].direction = Eigen::Vector3f::Unit(i % 3);
    rays[i].start_cell = cells.BruteForceNearest(rays[i].origin.cast<double>());
    if (i % 3 != 0) {
      rays[i].quantile_tau[0] = static_cast<float>(random.Uniform());
      rays[i].quantile_tau[1] = rays[i].quantile_tau[0] + static_cast<float>(random.Uniform());
    }
  }
  return rays;
}

template <typename Real>
RayRecord<Real> Reference(const WalkGeometry<Real>& geometry,
                          const CellShading<Real>& shading,
                          float cutoff_tau,
                          const RayTrace& ray) {
  RayRecord<Real> record;
  record.origin = ray.origin.cast<Real>();
  record.direction = ray.direction.cast<Real>();
  for (int q = 0; q < kNumQuantiles; ++q) record.composite.quantile_tau[q] = ray.quantile_tau[q];
  TraceRay<Real>(geometry, shading, ray.start_cell, cutoff_tau, &record);
  return record;
}

void ExpectSameSteps(const RayTrace& ray, const RayRecord<float>& reference) {
  ASSERT_EQ(ray.hit_step_limit, reference.hit_step_limit);
  ASSERT_EQ(ray.num_segments, static_cast<int>(reference.segments.size()));
  size_t clamped = 0;
  for (int k = 0; k < ray.num_segments; ++k) {
    SCOPED_TRACE(k);
    const RecordedSegment<float>& segment = reference.segments[k];
    ASSERT_EQ(ray.segments[k].cell, segment.cell);
    ASSERT_EQ(ray.segments[k + 1].cell, segment.next);
    ASSERT_EQ(ray.segments[k].t_out, segment.t_out);
    const bool is_clamped = clamped < ray.clamped.size() && ray.clamped[clamped] == uint32_t(k);
    clamped += is_clamped;
    ASSERT_EQ(is_clamped, segment.clamped);
    ASSERT_EQ(ray.sites[k].density > 0, segment.shaded >= 0);
    if (segment.shaded < 0) continue;
    const ShadedSegment<float>& shaded = reference.shaded[segment.shaded];
    ASSERT_EQ(ray.segments[k].tau_in, shaded.tau_in);
    ASSERT_NEAR(ray.weight[k], shaded.weight, 1e-6);
    // Where the weight is within rounding of negligible either colour is right.
    if (std::abs(shaded.weight - kNegligibleWeight) < 1e-6f) continue;
    for (int c = 0; c < 3; ++c) ASSERT_NEAR(ray.color[c][k], shaded.color[c], 1e-5);
  }
  ASSERT_EQ(clamped, ray.clamped.size());
}

template <typename Real>
void ExpectSameComposite(const RayComposite<float>& composite,
                         const RayComposite<Real>& reference,
                         double tolerance) {
  ASSERT_NEAR(std::exp(-composite.tau), std::exp(-reference.tau), tolerance);
  for (int c = 0; c < 3; ++c) ASSERT_NEAR(composite.color[c], reference.color[c], tolerance);
  for (int c = 0; c < kIdentityDim; ++c) {
    ASSERT_NEAR(composite.identity[c], reference.identity[c], 3 * tolerance);
  }
}

// What a ray says to each cell, summed up by cell.
struct CellSums {
  double weight = 0, density = 0, centroid = 0;
  uint32_t color_mask = 0;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
};

template <typename Real>
void AddTo(const CellContribution<Real>& c, std::map<uint32_t, CellSums>* cells) {
  CellSums& sums = (*cells)[c.cell];
  sums.weight += c.weight;
  sums.density += c.density;
  sums.centroid += c.centroid;
  sums.color_mask |= c.color_mask;
  sums.position += c.position.template cast<double>();
}

// A gradient that hits every term, and the reference's answer to it. `identity`: of the cells, or
// null.
void ExpectSameGradient(const WalkableCells& cells,
                        const WalkGeometry<float>& geometry,
                        const RayTrace& ray,
                        const RayRecord<float>& reference,
                        const float* identity) {
  RayGradient<float> gradient;
  gradient.color[0] = 0.3f;
  gradient.color[1] = -0.2f;
  gradient.color[2] = 0.5f;
  gradient.opacity = -0.4f;
  gradient.quantile_depth[0] = 0.05f;
  gradient.quantile_depth[1] = -0.05f;
  for (int c = 0; c < kIdentityDim; ++c) gradient.identity[c] = 0.01f * (c - 5);
  std::map<uint32_t, CellSums> expected, got;
  const auto emit = [&](const CellContribution<float>& c) { AddTo(c, &expected); };
  BackpropagateRay(geometry, reference, gradient, emit, identity);
  std::vector<GradientRecord> records;
  BackpropagateRay(ray, gradient, cells.delaunay.num_sites, 7, &records, identity);
  for (const GradientRecord& record : records) {
    ASSERT_EQ(record.ray, 7u);
    AddTo(record.contribution, &got);
  }
  // Relative to the largest of the ray: sums of terms that cancel carry the rounding of the
  // largest, and of the incoming gradient where all of them are small.
  double density_scale = 1e-4, position_scale = 1e-3;
  for (const auto& [cell, sums] : expected) {
    density_scale = std::max(density_scale, std::abs(sums.density));
    position_scale = std::max(position_scale, sums.position.norm());
  }
  for (const auto& [cell, sums] : expected) {
    SCOPED_TRACE("cell " + std::to_string(cell));
    const CellSums& other = got[cell];
    ASSERT_NEAR(other.weight, sums.weight, 1e-6);
    if (sums.weight > 1e-6) {
      ASSERT_EQ(other.color_mask, sums.color_mask);
      ASSERT_NEAR(other.centroid, sums.centroid, 1e-6 * (1 + sums.centroid));
    }
    ASSERT_NEAR(other.density, sums.density, 2e-5 * density_scale);
    ASSERT_LE((other.position - sums.position).norm(), 5e-4 * position_scale);
  }
  for (const auto& [cell, sums] : got) {
    if (expected.count(cell) != 0) continue;
    ASSERT_LE(sums.position.norm(), 1e-6 * position_scale) << "cell " << cell;
  }
}

class RayTracer : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { UseSimdTarget(GetParam()); }
  void TearDown() override { UseSimdTarget(""); }

  void ExpectTracesAreRight(const WalkableCells& cells,
                            const WalkGeometry<float>& geometry,
                            int num_rays,
                            uint64_t seed,
                            double gradient_scale = 0.2) {
    const Appearance appearance(cells, gradient_scale);
    for (const float cutoff_tau : {kInfinity, 7.f}) {
      std::vector<RayTrace> rays = RandomRays(cells, num_rays, seed);
      TraceRays(geometry, appearance.Float(), cutoff_tau, rays);
      for (int i = 0; i < num_rays; ++i) {
        SCOPED_TRACE("seed " + std::to_string(seed) + " ray " + std::to_string(i));
        const RayRecord<float> reference =
            Reference(geometry, appearance.Float(), cutoff_tau, rays[i]);
        ASSERT_NO_FATAL_FAILURE(ExpectSameSteps(rays[i], reference));
        ASSERT_NO_FATAL_FAILURE(ExpectSameComposite(rays[i].composite, reference.composite, 3e-4));
        for (int q = 0; q < kNumQuantiles; ++q) {
          const int segment = rays[i].composite.quantile_segment[q];
          const int shaded = reference.composite.quantile_segment[q];
          ASSERT_EQ(segment >= 0, shaded >= 0);
          if (segment < 0) continue;
          ASSERT_EQ(reference.segments[segment].shaded, shaded);
          ASSERT_EQ(rays[i].composite.quantile_depth[q], reference.composite.quantile_depth[q]);
        }
        for (const float* identity : {(const float*)nullptr, appearance.identity.data()}) {
          ASSERT_NO_FATAL_FAILURE(
              ExpectSameGradient(cells, geometry, rays[i], reference, identity));
        }
      }
    }
  }
};

TEST_P(RayTracer, AgreesWithTheReferenceOnRandomSites) {
  const WalkableCells cells(RandomSites(3000, 31));
  ExpectTracesAreRight(cells, cells.float_geometry, 203, 31);
}

TEST_P(RayTracer, AgreesWithTheReferenceOnAGrid) {
  std::vector<Eigen::Vector3f> sites;
  for (int i = 0; i < 1000; ++i) {
    sites.push_back(Eigen::Vector3f(i % 10, i / 10 % 10, i / 100) / 5.f - Eigen::Vector3f::Ones());
  }
  const WalkableCells cells(sites);
  ExpectTracesAreRight(cells, cells.float_geometry, 103, 32);
}

TEST_P(RayTracer, AgreesWithTheReferenceOnTwinsAndFewSites) {
  for (const int count : {0, 1, 5, 200}) {
    std::vector<Eigen::Vector3f> sites = RandomSites(count, 33);
    for (int i = 0; i < count; ++i) {
      const Eigen::Vector3f p = sites[i];
      sites.push_back(i % 2 == 0 ? p : Eigen::Vector3f(std::nextafter(p.x(), 2.f), p.y(), p.z()));
    }
    const WalkableCells cells(sites);
    // Faces between twins multiply the rounding of dL/dt by the inverse of their distance. Where
    // colours have gradients, hard_cases/sites_test knows that scale.
    ExpectTracesAreRight(cells, cells.float_geometry, 43, 33, /*gradient_scale=*/0);
  }
}

TEST_P(RayTracer, AgreesWithTheReferenceOnATopologyOlderThanThePositions) {
  WalkableCells cells(RandomSites(1000, 34));
  std::vector<Eigen::Vector3f> moved = cells.positions;
  CounterRandom random(34, 0x73, 0);
  for (size_t i = 0; i < 1000; ++i) moved[i] += 0.1f * RandomDirection(&random).cast<float>();
  Refresh(moved, &cells.float_geometry);
  size_t clamped = 0;
  std::vector<RayTrace> rays = RandomRays(cells, 100, 34);
  TraceRays(cells.float_geometry, Appearance(cells).Float(), kInfinity, rays);
  for (const RayTrace& ray : rays) clamped += ray.clamped.size();
  EXPECT_GT(clamped, 0u) << "nothing was stale, so nothing was tested";
  ExpectTracesAreRight(cells, cells.float_geometry, 100, 34);
}

TEST_P(RayTracer, PlanesAreThoseOfTheSites) {
  // With a pair of near-duplicates far from the rest, so that cells are left to double here as
  // well.
  std::vector<Eigen::Vector3f> sites = RandomSites(500, 40);
  sites.push_back({9, 9, 9});
  sites.push_back({std::nextafter(9.f, 10.f), 9, 9});
  WalkableCells cells(sites);
  WalkGeometry<float>& geometry = cells.float_geometry;
  Refresh(cells.positions, &geometry);
  int left_to_double = 0;
  for (uint32_t i = 0; i < cells.positions.size(); ++i) {
    const uint32_t first = geometry.first_block[i];
    const bool in_double = geometry.blocks[first].half_squared[0] == 0;
    left_to_double += in_double;
    for (uint32_t b = first; b < geometry.first_block[i + 1]; ++b) {
      const PlaneBlock<float>& block = geometry.blocks[b];
      for (uint32_t k = 0; k < kPlaneLanes; ++k) {
        const uint32_t j = block.neighbor[k];
        const bool is_face = j != kNoCell && !in_double;
        const Eigen::Vector3f n = is_face ? Eigen::Vector3f(cells.positions[j] - cells.positions[i])
                                          : Eigen::Vector3f::Zero();
        ASSERT_EQ(n, Eigen::Vector3f(block.normal_x[k], block.normal_y[k], block.normal_z[k]));
        const float half = 0.5f * (n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
        ASSERT_EQ(block.half_squared[k], is_face ? half : in_double ? 0.f : 1.f);
      }
    }
  }
  EXPECT_GE(left_to_double, 2);
  EXPECT_LT(left_to_double, 100);
}

TEST_P(RayTracer, CompositesAgreeWithDouble) {
  const WalkableCells cells(RandomSites(2000, 35));
  const Appearance appearance(cells);
  std::vector<RayTrace> rays = RandomRays(cells, 200, 35);
  TraceRays(cells.float_geometry, appearance.Float(), kInfinity, rays);
  int same = 0;
  for (const RayTrace& ray : rays) {
    if (ray.origin.norm() > 10) continue;  // a float ray from far away is another ray
    const RayRecord<double> reference =
        Reference(cells.geometry, appearance.Double(), kInfinity, ray);
    // Matter of density 1e6 in a sliver of a cell is a matter of the last bit.
    if (std::abs(std::exp(-ray.composite.tau) - std::exp(-reference.composite.tau)) > 1e-2)
      continue;
    ++same;
    ExpectSameComposite(ray.composite, reference.composite, 1e-2);
  }
  EXPECT_GT(same, 140);
}

TEST_P(RayTracer, LongRaysGrowTheirRecord) {
  // A line of sites with walls between, and a ray all along.
  std::vector<Eigen::Vector3f> sites;
  for (int i = 0; i < 3000; ++i) sites.emplace_back(0.01f * i, 0.f, 0.f);
  const WalkableCells cells(sites);
  std::vector<RayTrace> rays(3);
  for (RayTrace& ray : rays) {
    ray.origin = {-1, 1e-3f, 0};
    ray.start_cell = cells.BruteForceNearest(ray.origin.cast<double>());
  }
  TraceRays(cells.float_geometry, Appearance(cells).Float(), kInfinity, rays);
  for (const RayTrace& ray : rays) {
    EXPECT_EQ(ray.num_segments, 3000);
    EXPECT_FALSE(ray.hit_step_limit);
  }
}

TEST_P(RayTracer, WalksTheSameWithAnyNumberOfRaysInFlight) {
  const WalkableCells cells(RandomSites(2000, 36));
  std::vector<WalkQuery> queries;
  for (const RayTrace& ray : RandomRays(cells, 101, 36)) {
    queries.push_back({ray.origin, ray.direction, ray.start_cell});
  }
  for (const int rays_in_flight : {1, 2, 4, 8}) {
    std::vector<WalkResult> results(queries.size());
    WalkRays(cells.float_geometry, queries, rays_in_flight, results);
    for (size_t i = 0; i < queries.size(); ++i) {
      uint32_t steps = 0;
      float t_exit = 0;
      Walk<float>(cells.float_geometry,
                  queries[i].origin,
                  queries[i].direction,
                  queries[i].start_cell,
                  [&](uint32_t, float, float t_out, uint32_t, bool) {
                    ++steps;
                    t_exit = t_out;
                    return true;
                  });
      EXPECT_EQ(results[i].steps, steps);
      EXPECT_EQ(results[i].t_exit, t_exit);
    }
  }
}

TEST_P(RayTracer, ClassLossAgreesWithTheReference) {
  for (const int num_classes : {1, 2, 16, 47, 5000}) {
    SCOPED_TRACE(num_classes);
    CounterRandom random(37, 0x74, num_classes);
    std::vector<float> weight(num_classes * kIdentityDim), bias(num_classes);
    for (float& w : weight) w = random.Normal();
    for (float& b : bias) b = random.Normal();
    // One logit of 1e4, one of -1e4.
    bias[0] += 1e4f;
    bias[num_classes - 1] -= 1e4f;
    const ClassifierView<float> classifier{num_classes, weight.data(), bias.data()};
    ClassLoss loss(classifier);
    RayComposite<float> composite;
    for (float& f : composite.identity) f = random.Normal();
    for (const int class_index : {0, num_classes / 2, num_classes - 1}) {
      RayTarget target{{0, 0, 0}, class_index};
      RayLossWeights weights{0, 0, 0, 0.7};
      std::vector<float> logits(num_classes);
      const float expected = RayLoss(composite, target, classifier, logits.data()).identity;
      const RayGradient<float> expected_gradient =
          RayLossGradient(composite, target, classifier, weights, logits.data());
      float identity_gradient[kIdentityDim] = {};
      std::vector<float> weight_gradient(weight.size(), 1.f), bias_gradient(num_classes, 1.f);
      const float got = loss.Add(composite.identity,
                                 class_index,
                                 0.7f,
                                 0.25f,
                                 identity_gradient,
                                 weight_gradient.data(),
                                 bias_gradient.data());
      EXPECT_NEAR(got, expected, 1e-5 * (1 + expected));
      for (int c = 0; c < kIdentityDim; ++c) {
        EXPECT_NEAR(identity_gradient[c], expected_gradient.identity[c], 1e-5);
      }
      for (int k = 0; k < num_classes; ++k) {
        ASSERT_NEAR(bias_gradient[k] - 1, 0.25f * logits[k], 1e-5);
        for (int c = 0; c < kIdentityDim; ++c) {
          ASSERT_NEAR(weight_gradient[k * kIdentityDim + c] - 1,
                      0.25f * logits[k] * composite.identity[c],
                      1e-5);
        }
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(InstructionSets,
                         RayTracer,
                         testing::ValuesIn(SimdTargets()),
                         [](const auto& info) {
                           std::string name = info.param;
                           std::erase(name, '-');
                           return name;
                         });

}  // namespace
}  // namespace semfoam
