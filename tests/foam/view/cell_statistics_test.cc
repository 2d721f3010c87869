// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/view/cell_statistics.h"

#include "foam/geometry/guard_sites.h"
#include "foam/geometry/voronoi.h"
#include "foam/model/activation.h"
#include "foam/render/ray_record.h"
#include "foam/util/parallel.h"
#include "foam/util/random.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/foam/random_cells.h"
#include "tests/foam/synthetic_views.h"
#include <gtest/gtest.h>

namespace semfoam {
namespace {

// Random cells, every third of them matter from haze to opaque, the others air.
Foam RandomFoam() {
  Foam foam;
  foam.positions = RandomSites(400, 5);
  for (int i = 0; i < 400; ++i) {
    CounterRandom random(5, 1, i);
    const double density = i % 3 == 0 ? std::pow(10, 3 * random.Uniform()) : 1e-4;
    foam.raw_density.push_back(static_cast<float>(RawDensity(density)));
    for (int c = 0; c < 3; ++c) foam.sh.push_back(static_cast<float>(2 * random.Uniform() - 1));
  }
  return foam;
}

TEST(CellStatistics, AreTheSumsOfTheirDefinition) {
  constexpr int kStride = 2;
  const Foam foam = RandomFoam();
  const SyntheticViews views(6, 32, 24);
  const ViewRenderer renderer(foam);
  const CellMeasurements measured = MeasureCells(foam, renderer, views, kStride);
  const CellStatistics& got = measured.statistics;

  std::vector<double> contribution(400, 0.0), transmittance(400, 0.0), passed(400, 0.0),
      stopped(400, 0.0), weights(400, 0.0);
  double rays = 0, left_over = 0;
  RayRecord<float> record;
  for (int view = 0; view < views.NumViews(); ++view) {
    if (views.IsHeldOut(view)) continue;
    for (int y = 0; y < views.Height(view); y += kStride) {
      for (int x = 0; x < views.Width(view); x += kStride) {
        TrainingRay ray;
        ASSERT_TRUE(views.Ray(view, x, y, &ray));
        record.origin = views.Origin(view).cast<float>();
        record.direction = ray.direction;
        record.composite = {};
        TraceRay(renderer.geometry(),
                 renderer.shading(),
                 renderer.StartCell(views.Origin(view)),
                 static_cast<float>(-std::log(kTransmittanceCutoff)),
                 &record);
        double before = 1;
        for (const RecordedSegment<float>& segment : record.segments) {
          double behind = before;
          if (segment.shaded >= 0) {
            const ShadedSegment<float>& shaded = record.shaded[segment.shaded];
            behind = std::exp(-double(shaded.tau_in) - shaded.optical_depth);
          }
          if (segment.cell < 400) {
            const double weight = before - behind;
            if (weight > kNegligibleWeight) {
              contribution[segment.cell] = std::max(contribution[segment.cell], weight);
              weights[segment.cell] += weight;
            }
            if (behind > 0.5 || behind < std::min(before, 0.5) || weight > kNegligibleWeight) {
              transmittance[segment.cell] = std::max(transmittance[segment.cell], before);
            }
            // Of the light above one half, what is left; below it, what is taken.
            if (behind > 0.5) passed[segment.cell] += 2 * (behind - 0.5);
            if (behind < 0.5) stopped[segment.cell] += 2 * (std::min(before, 0.5) - behind);
          }
          before = behind;
        }
        ++rays;
        left_over += 2 * std::min(before, 0.5);
      }
    }
  }
  double all_stopped = 0;
  for (int i = 0; i < 400; ++i) {
    EXPECT_NEAR(got.contribution[i], contribution[i], 1e-5);
    EXPECT_NEAR(measured.transmittance[i], transmittance[i], 2e-4);
    EXPECT_NEAR(measured.weight[i], weights[i], 1e-3 * (1 + weights[i]));
    EXPECT_NEAR(got.passed[i], passed[i], 1e-4 * (1 + passed[i]));
    EXPECT_NEAR(got.stopped[i], stopped[i], 1e-4 * (1 + stopped[i]));
    all_stopped += got.stopped[i];
  }
  // Every ray ends somewhere, or goes on.
  EXPECT_NEAR(all_stopped + left_over, rays, 1e-3 * rays);
  EXPECT_GT(all_stopped, 0.1 * rays);
}

TEST(CellStatistics, CountTheRaysThatCouldMeetACell) {
  // In the middle of all pictures, and opaque: what is before a cell does not matter.
  Foam foam;
  for (const Eigen::Vector3f& x : RandomSites(500, 9)) foam.positions.push_back(0.3f * x);
  foam.raw_density.assign(500, static_cast<float>(RawDensity(1e3)));
  foam.sh.assign(1500, 0.f);
  const SyntheticViews views(8, 128, 96);
  const ViewRenderer renderer(foam);
  const CellMeasurements measured = MeasureCells(foam, renderer, views, /*stride=*/1);
  const std::vector<float> radii = CellRadii(WithGuardSites(foam.positions), renderer.delaunay());
  double all = 0, all_potential = 0;
  for (int i = 0; i < 500; ++i) {
    int towards = 0;
    for (int view = 0; view < views.NumViews(); ++view) {
      if (views.IsHeldOut(view)) continue;
      const Eigen::Vector3f to_site = foam.positions[i] - views.Origin(view).cast<float>();
      for (int y = 0; y < views.Height(view); ++y) {
        for (int x = 0; x < views.Width(view); ++x) {
          const Eigen::Vector3f direction = views.Direction(view, x, y);
          const float along = to_site.dot(direction);
          if (along > 0 && (to_site - along * direction).norm() < radii[i]) ++towards;
        }
      }
    }
    // The map of the rays' directions has coarse texels.
    EXPECT_NEAR(measured.potential_rays[i], towards, 5 + 0.4 * towards) << i;
    all += towards;
    all_potential += measured.potential_rays[i];
  }
  EXPECT_GT(all, 10'000);
  EXPECT_NEAR(all_potential, all, 0.05 * all);
}

TEST(CellStatistics, AreTheSameOnAnyNumberOfThreads) {
  const Foam foam = RandomFoam();
  const SyntheticViews views(6, 32, 24);
  const ViewRenderer renderer(foam);
  const auto measure = [&](int threads) {
    const ThreadLimit limit(threads);
    return MeasureCells(foam, renderer, views, 1);
  };
  const CellMeasurements one = measure(1);
  for (const int threads : {2, 5}) {
    const CellMeasurements more = measure(threads);
    EXPECT_EQ(more.transmittance, one.transmittance);
    EXPECT_EQ(more.weight, one.weight);
    EXPECT_EQ(more.potential_rays, one.potential_rays);
    EXPECT_EQ(more.statistics.contribution, one.statistics.contribution);
    EXPECT_EQ(more.statistics.mean_color, one.statistics.mean_color);
    EXPECT_EQ(more.statistics.passed, one.statistics.passed);
    EXPECT_EQ(more.statistics.stopped, one.statistics.stopped);
  }
}

}  // namespace
}  // namespace semfoam
