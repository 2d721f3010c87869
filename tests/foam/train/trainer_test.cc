// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/train/trainer.h"

#include "foam/geometry/guard_sites.h"
#include "foam/model/cell_labels.h"
#include "foam/optim/training_topology.h"
#include "foam/render/cell_shading.h"
#include "foam/render/color_variation.h"
#include "foam/util/error.h"
#include "foam/util/parallel.h"
#include "foam/view/view_renderer.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <string>

#include "tests/foam/foam_digest.h"
#include "tests/foam/repainted_views.h"
#include "tests/foam/synthetic_views.h"
#include <gtest/gtest.h>

namespace semfoam {
namespace {

TrainingOptions SmallRun() {
  TrainingOptions options;
  options.num_rays = 400'000;
  options.rays_per_iteration = 1024;
  options.initial_sites = 1000;
  options.final_sites = 3000;
  options.sh_degree = 1;
  options.densify_events = 6;
  return options;
}

TEST(Trainer, AdaptsItsViewsToTheFoamInTraining) {
  // Every second photo is darker, until that is taken out.
  bool is_corrected = false;
  const RepaintedViews views([&](int view, int, int, Eigen::Vector3f* color) {
    if (view % 2 == 1 && !is_corrected) *color *= 0.6f;
  });
  const std::vector<SeedPoint> seeds = views.room().Seeds(800);
  const TrainingSummary dark = TrainFoam(views, seeds, 0, SmallRun(), nullptr);
  int calls = 0;
  TrainingHooks hooks;
  hooks.adapt_views = [&](const TrainingHooks::RenderPixels& render) {
    ++calls;
    is_corrected = true;
    const std::vector<ViewPixel> pixels = {{2, 10, 10}, {2, 50, 40}, {5, 32, 24}};
    const std::vector<RenderedRay> rendered = render(pixels);
    ASSERT_EQ(rendered.size(), pixels.size());
    for (size_t i = 0; i < pixels.size(); ++i) {
      TrainingRay ray;
      views.Ray(pixels[i].view, pixels[i].x, pixels[i].y, &ray);
      EXPECT_GT(rendered[i].opacity, 0.5);
      EXPECT_LT((rendered[i].color - ray.color).cwiseAbs().maxCoeff(), 0.4) << i;
    }
  };
  const TrainingSummary adapted = TrainFoam(views, seeds, 0, SmallRun(), std::move(hooks));
  EXPECT_EQ(calls, std::ssize(kViewAdaptations));
  EXPECT_GT(adapted.last.held_out_psnr, dark.last.held_out_psnr + 1);
}

TEST(Trainer, IsShownAfterEachIterationWithoutAChange) {
  const SyntheticViews views(16, 64, 48);
  const std::vector<SeedPoint> seeds = views.Seeds(800);
  const TrainingSummary unseen = TrainFoam(views, seeds, 3, SmallRun(), nullptr);
  int64_t calls = 0;
  double error = 0;
  TrainingHooks hooks;
  hooks.preview = [&](int64_t iteration, bool is_last, const TrainingHooks::RenderPixels& render) {
    EXPECT_EQ(iteration, ++calls);
    EXPECT_EQ(is_last, iteration == unseen.last.num_iterations);
    if (iteration % 13 != 0 && !is_last) return;
    const RenderedRay rendered = render({{0, 32, 24}}).front();
    TrainingRay ray;
    views.Ray(0, 32, 24, &ray);
    error = (rendered.color - ray.color).cwiseAbs().maxCoeff();
  };
  const TrainingSummary seen = TrainFoam(views, seeds, 3, SmallRun(), std::move(hooks));
  EXPECT_EQ(calls, unseen.last.num_iterations);
  // The last one, of a held-out view.
  EXPECT_LT(error, 0.2);
  EXPECT_EQ(DigestOf(seen), DigestOf(unseen));
}

TEST(Trainer, SitesThatMoveFarAreTriangulatedEarly) {
  const SyntheticViews views(16, 64, 48);
  TrainingOptions options = SmallRun();
  options.num_rays = 200'000;
  options.densify_events = 0;
  options.position_rate = 1e-5;
  const TrainingSummary resting = TrainFoam(views, views.Seeds(800), 0, options, nullptr);
  // At the start and when positions freeze, and nothing in between: 195 iterations are no age.
  EXPECT_EQ(resting.triangulations, 2);
  options.position_rate = 0.1;
  const TrainingSummary moving = TrainFoam(views, views.Seeds(800), 0, options, nullptr);
  EXPECT_GT(moving.triangulations, 3);
  EXPECT_EQ(moving.step_limit_hits, 0);
}

TEST(Trainer, LearnsColourAndClassesOfASyntheticRoom) {
  const SyntheticViews views(16, 64, 48);
  const TrainingSummary summary = TrainFoam(views, views.Seeds(800), 3, SmallRun(), nullptr);
  EXPECT_EQ(summary.step_limit_hits, 0);
  EXPECT_EQ(summary.nonfinite_gradients, 0);
  EXPECT_GT(summary.foam.NumSites(), 2500u);
  EXPECT_LE(summary.foam.NumSites(), 3100u);

  const ViewRenderer renderer(summary.foam);
  double squared_error = 0;
  int pixels = 0, right = 0, balls = 0;
  for (int view = 0; view < views.NumViews(); view += 4) {
    const RenderedView render = renderer.Render(views.Rays(view));
    for (int y = 0; y < 48; ++y) {
      for (int x = 0; x < 64; ++x) {
        TrainingRay truth;
        views.Ray(view, x, y, &truth);
        const size_t i = size_t(y) * 64 + x;
        squared_error += (render.color[i].cwiseMin(1.f) - truth.color).squaredNorm() / 3;
        right += render.class_index[i] == truth.class_index;
        balls += truth.class_index < ClassIndex{2} && render.class_index[i] == truth.class_index;
        ++pixels;
      }
    }
  }
  const double psnr = -10 * std::log10(squared_error / pixels);
  EXPECT_GT(psnr, 20) << "held-out views";
  EXPECT_GT(right, 0.93 * pixels);
  EXPECT_GT(balls, 0.05 * pixels) << "all is background";
  EXPECT_GT(summary.last.held_out_miou, 0.7);
  EXPECT_LE(summary.last.held_out_miou, 1);

  // Cells know what they are: solid cells around the balls carry the balls' classes, with both
  // balls present.
  const CellLabels labels = LabelCells(summary.foam, renderer.delaunay());
  int count[3] = {0, 0, 0}, inside = 0;
  for (size_t i = 0; i < summary.foam.NumSites(); ++i) {
    if (!labels.solid[i] || summary.statistics.contribution[i] < 0.1f) continue;
    ++count[Value(labels.class_index[i])];
    inside += labels.class_index[i] == ClassIndex{0} && summary.foam.positions[i].x() > 0;
  }
  EXPECT_GT(count[0], 10);
  EXPECT_GT(count[1], 10);
  EXPECT_GT(count[2], 10);
  EXPECT_GT(inside, 0.8 * count[0]);
}

TEST(Trainer, GivesTheSameBytesOnAnyNumberOfThreads) {
  const SyntheticViews views(8, 32, 24, /*gloss=*/0, /*knows_distances=*/true);
  TrainingOptions options = SmallRun();
  options.num_rays = 60'000;
  uint64_t digest[3];
  const int threads[3] = {1, 2, 5};
  for (int k = 0; k < 3; ++k) {
    const ThreadLimit limit(threads[k]);
    digest[k] = DigestOf(TrainFoam(views, views.Seeds(500), 3, options, nullptr));
  }
  EXPECT_EQ(digest[0], digest[1]);
  EXPECT_EQ(digest[0], digest[2]);
  options.random_seed = 1;
  EXPECT_NE(DigestOf(TrainFoam(views, views.Seeds(500), 3, options, nullptr)), digest[0])
      << "the digest tells nothing";
}

TEST(Trainer, FitsItsLatePartToSecondsAndSaysHowToRepeatIt) {
  const SyntheticViews views(8, 32, 24);
  TrainingOptions options = SmallRun();
  options.num_rays = 60'000;
  // Less than any run takes: the late part becomes as short as it may, a tenth of its share.
  options.seconds = 1e-6;
  const TrainingSummary hurried = TrainFoam(views, views.Seeds(500), 3, options, nullptr);
  const int64_t iterations = (options.num_rays + 1023) / 1024;
  const auto early = static_cast<int64_t>(std::ceil(options.densify_until * iterations));
  EXPECT_EQ(hurried.late_rays, (iterations - early) / 10 * 1024);
  EXPECT_EQ(hurried.last.iteration, early + (iterations - early) / 10);

  // More than any run takes: the late part becomes as long as it may.
  options.seconds = 1e6;
  const TrainingSummary patient = TrainFoam(views, views.Seeds(500), 3, options, nullptr);
  EXPECT_EQ(patient.late_rays, (iterations - early) * 10 * 1024);

  options.seconds = 0;
  options.late_rays = hurried.late_rays;
  const TrainingSummary repeated = TrainFoam(views, views.Seeds(500), 3, options, nullptr);
  EXPECT_EQ(DigestOf(repeated), DigestOf(hurried));

  // More than its share: the run becomes longer, and still ends at the end of its schedules.
  options.late_rays = 40'960;
  const TrainingSummary longer = TrainFoam(views, views.Seeds(500), 3, options, nullptr);
  EXPECT_EQ(longer.last.iteration, early + 40);
  options.late_rays = 0;
  EXPECT_EQ(TrainFoam(views, views.Seeds(500), 3, options, nullptr).last.iteration, iterations);
}

TEST(Trainer, LabelsShapeMatterOnlyWhereAskedTo) {
  const SyntheticViews views(8, 32, 24);
  TrainingOptions options = SmallRun();
  options.num_rays = 60'000;
  const auto train = [&](double identity_weight, double identity_to_density) {
    options.identity_weight = identity_weight;
    options.identity_to_density = identity_to_density;
    return TrainFoam(views, views.Seeds(800), 3, options, nullptr).foam;
  };
  const Foam unlabelled = train(0, 0), cut = train(1, 0), shaped = train(1, 0.01);
  EXPECT_NE(cut.identity, unlabelled.identity);
  EXPECT_EQ(cut.raw_density, unlabelled.raw_density);
  EXPECT_EQ(DigestOf(cut.positions, 0), DigestOf(unlabelled.positions, 0));
  EXPECT_NE(shaped.raw_density, cut.raw_density);
}

TEST(Trainer, RaysThatStopEarlierTrainAnotherFoam) {
  const SyntheticViews views(8, 32, 24);
  TrainingOptions options = SmallRun();
  options.num_rays = 60'000;
  const TrainingSummary usual = TrainFoam(views, views.Seeds(500), 3, options, nullptr);
  options.transmittance_cutoff = 0.3;
  const TrainingSummary early = TrainFoam(views, views.Seeds(500), 3, options, nullptr);
  EXPECT_LT(early.segments, usual.segments);
  options.transmittance_cutoff = 1;
  EXPECT_NE(options.Check().find("transmittance_cutoff"), std::string::npos);
}

TEST(Trainer, TrainsColourOnlyWithoutClassesAndWithoutPoints) {
  const SyntheticViews views(8, 32, 24);
  TrainingOptions options = SmallRun();
  options.num_rays = 60'000;
  const TrainingSummary summary = TrainFoam(views, {}, 0, options, nullptr);
  EXPECT_FALSE(summary.foam.HasSemantics());
  EXPECT_TRUE(summary.foam.identity.empty());
  EXPECT_TRUE(std::isnan(summary.last.identity_loss));
  EXPECT_TRUE(std::isnan(summary.last.held_out_miou));
  EXPECT_GT(summary.last.held_out_psnr, 10);
}

TEST(Trainer, RaisesTheShDegreeOnlyWhereColourChangesWithDirection) {
  TrainingOptions options = SmallRun();
  // While cells are few and not yet in place, some change with direction makes up for that.
  options.num_rays = 1'600'000;
  options.sh_degree = 3;
  const auto degree = [&](float gloss) {
    const SyntheticViews views(16, 64, 48, gloss);
    const Foam foam = TrainFoam(views, views.Seeds(500), 0, options, nullptr).foam;
    EXPECT_EQ(foam.sh.size(), foam.NumSites() * 3 * NumShCoefficients(foam.sh_degree));
    return foam.sh_degree;
  };
  EXPECT_EQ(degree(0), 0);
  EXPECT_GE(degree(0.5), 1);
}

// Mean difference of the colours of neighbouring opaque cells where they touch.
double ColorRoughness(const Foam& foam) {
  TrainingTopology topology;
  topology.Triangulate(foam.positions, FreeSpace(), /*with_areas=*/true);
  std::vector<float> rows;
  CollectSurfaceColors(foam, CellDensities(foam), topology.step_lengths(), &rows);
  const Delaunay& delaunay = topology.delaunay();
  double sum = 0, weights = 0;
  for (uint32_t i = 0; i < delaunay.num_sites; ++i) {
    for (uint32_t e = delaunay.offsets[i]; e < delaunay.offsets[i + 1]; ++e) {
      const uint32_t j = delaunay.neighbors[e];
      if (j >= delaunay.num_sites) continue;
      const float *const a = &rows[i * kSurfaceColorDim], *const b = &rows[j * kSurfaceColorDim];
      sum += ColorEdgeVariation(topology.tv_weights()[e], a, b);
      weights += topology.tv_weights()[e] * a[kOpacityAt] * b[kOpacityAt];
    }
  }
  return sum / weights;
}

TEST(Trainer, MatterIsWhereDistancesAreKnown) {
  // Photos of one grey, which tell nothing of what is where.
  const RepaintedViews views(
      [](int, int, int, Eigen::Vector3f* color) { color->setConstant(0.5f); },
      {16, 64, 48, /*gloss=*/0, /*knows_distances=*/true});
  TrainingOptions options = SmallRun();
  // Returns the share of the held-out rays whose depth is right to a twentieth.
  const auto share_right = [&](double weight) {
    options.distance_weight = weight;
    const Foam foam = TrainFoam(views, {}, 0, options, nullptr).foam;
    const ViewRenderer renderer(foam);
    int right = 0, all = 0;
    for (int view = 0; view < views.NumViews(); view += 4) {
      const RenderedView render = renderer.Render(views.room().Rays(view));
      for (size_t i = 0; i < render.distance.size(); ++i, ++all) {
        const double truth = views.room().Distance(view, i % 64, i / 64);
        right += std::abs(render.distance[i] / truth - 1) < 0.05;
      }
    }
    return double(right) / all;
  };
  EXPECT_LT(share_right(0), 0.1);
  EXPECT_GT(share_right(0.1), 0.5);
}

TEST(Trainer, NeighboringCellsAgreeInColorWhereTheirVariationCounts) {
  const SyntheticViews views(8, 32, 24);
  TrainingOptions options = SmallRun();
  options.num_rays = 100'000;
  const auto train = [&](int num_classes, double weight) {
    options.color_tv_weight = weight;
    return TrainFoam(views, views.Seeds(500), num_classes, options, nullptr).foam;
  };
  for (const int num_classes : {0, 3}) {
    const double without = ColorRoughness(train(num_classes, 0));
    EXPECT_GT(without, 0);
    EXPECT_LT(ColorRoughness(train(num_classes, 1)), 0.8 * without);
  }
}

TEST(Trainer, KeepsEveryParameterFiniteAtAbsurdLearningRates) {
  const SyntheticViews views(8, 32, 24);
  TrainingOptions options = SmallRun();
  options.num_rays = 30'000;
  options.position_rate = 1000;
  options.density_rate = 1000;
  options.color_rate = 100;
  const TrainingSummary summary = TrainFoam(views, views.Seeds(300), 3, options, nullptr);
  for (const Eigen::Vector3f& p : summary.foam.positions) {
    ASSERT_TRUE(p.allFinite());
    ASSERT_LE(p.norm(), 1.001f * kFarRadius);
  }
  for (const float raw : summary.foam.raw_density) ASSERT_TRUE(std::isfinite(raw));
}

TEST(Trainer, SaysWhichOptionIsOutOfRange) {
  TrainingOptions options;
  EXPECT_EQ(options.Check(), "");
  options.sh_degree = 4;
  EXPECT_NE(options.Check().find("sh_degree"), std::string::npos);
  options = {};
  options.tv_weight = NAN;
  EXPECT_NE(options.Check().find("tv_weight"), std::string::npos);
  options = {};
  options.num_rays = 0;
  const SyntheticViews views(8, 32, 24);
  EXPECT_THROW(TrainFoam(views, {}, 0, options, nullptr), UserError);
}

TEST(Trainer, RefusesViewsThatAreAllHeldOut) {
  const SyntheticViews views(1, 32, 24);
  EXPECT_THROW(TrainFoam(views, {}, 0, SmallRun(), nullptr), UserError);
}

}  // namespace
}  // namespace semfoam
