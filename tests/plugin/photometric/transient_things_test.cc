// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/photometric/transient_things.h"

#include "foam/train/checkpoint_state.h"
#include "foam/util/parallel.h"
#include "foam/util/random.h"

#include <cmath>
#include <filesystem>
#include <functional>
#include <vector>

#include "tests/plugin/photo/changed_photos.h"
#include "tests/plugin/photometric/tabletop_photos.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

// A place around which the cameras stand.
Eigen::Vector3f Middle() {
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  for (const SeedPoint& seed : Tabletop().Seeds()) sum += seed.position;
  return sum / Tabletop().Seeds().size();
}

// A foam that shows the tabletop as its unchanged photos do, on one surface for all photos: the
// plane through the middle of the scene that faces the cameras.
std::vector<RenderedRay> RenderOriginal(const std::vector<ViewPixel>& pixels) {
  static const Eigen::Vector3f middle = Middle();
  static const Eigen::Vector3f normal = [] {
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    for (int view = 0; view < Tabletop().NumViews(); ++view) {
      sum += (Tabletop().Origin(view).cast<float>() - middle).normalized();
    }
    return Eigen::Vector3f(sum.normalized());
  }();
  std::vector<RenderedRay> rendered(pixels.size());
  for (size_t i = 0; i < pixels.size(); ++i) {
    const ViewPixel& pixel = pixels[i];
    TrainingRay ray;
    if (!Tabletop().Ray(pixel.view, pixel.x, pixel.y, &ray)) continue;
    const Eigen::Vector3f origin = Tabletop().Origin(pixel.view).cast<float>();
    const float distance = (middle - origin).dot(normal) / ray.direction.dot(normal);
    rendered[i].color = ray.color;
    rendered[i].opacity = 1;
    rendered[i].distance = distance > 0 && distance < 10 ? distance : 10;
  }
  return rendered;
}

using Renderer = std::vector<RenderedRay>(const std::vector<ViewPixel>&);

std::vector<ComparedView> Compare(const TrainingScene& scene,
                                  const std::function<Renderer>& render) {
  return CompareViews(scene, 200'000, render);
}

// What the render lacks: noise, the same for every seed.
std::vector<RenderedRay> RenderWithNoise(const std::vector<ViewPixel>& pixels) {
  std::vector<RenderedRay> rendered = RenderOriginal(pixels);
  CounterRandom random(5, 0x12, pixels[0].view);
  for (RenderedRay& ray : rendered) ray.color *= float(1 + 0.1 * random.Normal());
  return rendered;
}

// The tabletop with something that passes by in three training photos and in one held out (16).
class PassedByTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TempFolder;
    WriteChangedWorkspace(
        TabletopPath(), *folder_ / "w", {.passed_by = {5, 16, 30, 43}, .seed = 1});
    scene_ = new TrainingScene(PlanScene(PhotosOf(*folder_ / "w")));
  }
  static void TearDownTestSuite() {
    delete scene_;
    delete folder_;
  }

  static TempFolder* folder_;
  static TrainingScene* scene_;
};

TempFolder* PassedByTest::folder_ = nullptr;
TrainingScene* PassedByTest::scene_ = nullptr;

TEST_F(PassedByTest, IsLeftOutOfTheTraining) {
  TransientFinder finder(scene_, true);
  finder.Find(Compare(*scene_, RenderWithNoise), {});
  EXPECT_EQ(finder.NumPhotos(), 3);
  EXPECT_THAT(finder.Report(), HasSubstr("in 3 photos"));
  EXPECT_THAT(finder.Report(), HasSubstr(scene_->Photos()[5].name));
  for (int view = 0; view < scene_->NumViews(); ++view) {
    const bool is_passed_by = view == 5 || view == 30 || view == 43;
    EXPECT_EQ(finder.blocks()[view].edge > 0, is_passed_by) << view;
    int64_t covered = 0, right = 0, left_out = 0;
    for (int y = 0; y < 240; ++y) {
      for (int x = 0; x < 320; ++x) {
        TrainingRay ray;
        Eigen::Vector3f direction;
        const bool has_ray = scene_->Ray(view, x, y, &ray);
        const bool is_of_passer = IsOfPasserBy(x, y, 320, 240);
        covered += is_of_passer;
        left_out += !has_ray;
        right += !has_ray && is_of_passer;
        // Renders still show it, so that it is judged anew.
        EXPECT_TRUE(scene_->RayDirection(view, x, y, &direction));
      }
    }
    if (is_passed_by) {
      EXPECT_GT(right, 0.97 * covered) << view;
      EXPECT_LT(left_out, 2 * covered) << view;
    } else {
      EXPECT_EQ(left_out, 0) << view;
    }
  }
  // A foam that has learned it all the same: there is nothing left that differs.
  const TrainingScene& scene = *scene_;
  finder.Find(Compare(scene,
                      [&](const std::vector<ViewPixel>& pixels) {
                        std::vector<RenderedRay> rendered = RenderOriginal(pixels);
                        for (size_t i = 0; i < pixels.size(); ++i) {
                          const PixelValue value =
                              scene.OpenView(pixels[i].view)->At(pixels[i].x, pixels[i].y);
                          for (int c = 0; c < 3; ++c)
                            rendered[i].color[c] = value.color[c] / 255.0f;
                        }
                        return rendered;
                      }),
              {});
  EXPECT_EQ(finder.NumPhotos(), 0);
  TrainingRay ray;
  EXPECT_TRUE(scene.Ray(5, 130, 140, &ray));
}

TEST_F(PassedByTest, IsNotLookedForByOption) {
  TransientFinder finder(scene_, false);
  finder.Find(Compare(*scene_, RenderOriginal), {});
  EXPECT_EQ(finder.NumPhotos(), 0);
  EXPECT_FALSE(finder.MakeEffect().on);
  EXPECT_TRUE(finder.MakeEffect().by_option);
}

TEST_F(PassedByTest, IsNotConfusedByTheLightOfPhotos) {
  // Renders in an exposure of which the photos are twice as bright.
  PhotoLight twice;
  twice.gain.setConstant(2);
  const auto dark = [](const std::vector<ViewPixel>& pixels) {
    std::vector<RenderedRay> rendered = RenderOriginal(pixels);
    for (RenderedRay& ray : rendered) {
      for (float& value : ray.color) value = DisplayFromLinear(0.5f * LinearFromDisplay(value));
    }
    return rendered;
  };
  TransientFinder finder(scene_, true);
  finder.Find(Compare(*scene_, dark), std::vector<PhotoLight>(scene_->NumViews(), twice));
  EXPECT_EQ(finder.NumPhotos(), 3);
}

TEST_F(PassedByTest, IsTheSameOnAnyThreadsAndFromACheckpoint) {
  const auto bytes_of = [](const TransientFinder& finder) {
    std::vector<int> bytes;
    for (const PixelBlocks& blocks : finder.blocks()) {
      bytes.push_back(blocks.edge);
      bytes.insert(bytes.end(), blocks.is_in.begin(), blocks.is_in.end());
    }
    return bytes;
  };
  TransientFinder finder(scene_, true);
  std::vector<int> first;
  for (const int threads : {1, 2, 5}) {
    const ThreadLimit limit(threads);
    finder.Find(Compare(*scene_, RenderWithNoise), {});
    if (first.empty()) first = bytes_of(finder);
    EXPECT_EQ(bytes_of(finder), first) << threads;
  }
  CheckpointContents contents;
  StateWriter writer("adaptation", &contents);
  finder.Serialize(&writer);
  const fs::path path = *folder_ / "transient.checkpoint";
  WriteCheckpoint(path, contents);
  const Checkpoint checkpoint(path);
  scene_->SetExcluded({});
  TransientFinder resumed(scene_, true);
  StateReader reader("adaptation", checkpoint);
  resumed.Serialize(&reader);
  resumed.Restore();
  EXPECT_EQ(bytes_of(resumed), first);
  TrainingRay ray;
  EXPECT_FALSE(scene_->Ray(30, 130, 140, &ray));
  EXPECT_TRUE(scene_->Ray(31, 130, 140, &ray));
}

// Changes what is rendered of the unchanged photos, pixel by pixel, and returns in how many photos
// something is found.
int NumFound(const std::function<void(const ViewPixel&, RenderedRay*)>& change) {
  TrainingScene scene(PlanScene(PhotosOf(TabletopPath())));
  TransientFinder finder(&scene, true);
  finder.Find(Compare(scene,
                      [&](const std::vector<ViewPixel>& pixels) {
                        std::vector<RenderedRay> rendered = RenderWithNoise(pixels);
                        for (size_t i = 0; i < pixels.size(); ++i) change(pixels[i], &rendered[i]);
                        return rendered;
                      }),
              {});
  return finder.NumPhotos();
}

bool IsNear(const ViewPixel& pixel, int x, int y, int radius) {
  return std::hypot(pixel.x - x, pixel.y - y) < radius;
}

TEST(TransientFinder, FindsNothingInUnchangedPhotos) {
  EXPECT_EQ(NumFound([](const ViewPixel&, RenderedRay*) {}), 0);
}

TEST(TransientFinder, FindsWhatOnePhotoShows) {
  const auto differ = [](const ViewPixel& pixel, RenderedRay* ray) {
    if (pixel.view == 9 && IsNear(pixel, 160, 120, 30)) ray->color = 1 - ray->color.array();
  };
  EXPECT_EQ(NumFound(differ), 1);
}

TEST(TransientFinder, KeepsMirroredLamps) {
  // The photo is brighter than the render, in one that would be found if it were darker.
  const auto brighter = [](float factor) {
    return [factor](const ViewPixel& pixel, RenderedRay* ray) {
      if (pixel.view == 9 && IsNear(pixel, 160, 120, 20)) ray->color *= factor;
    };
  };
  EXPECT_EQ(NumFound(brighter(0.5f)), 0);
  EXPECT_EQ(NumFound(brighter(1.5f)), 1);
}

TEST(TransientFinder, KeepsWhatTheFoamHasNotLearnedYet) {
  // All photos differ from their renders there.
  const auto differ = [](const ViewPixel& pixel, RenderedRay* ray) {
    TrainingRay through;
    if (!Tabletop().Ray(pixel.view, pixel.x, pixel.y, &through)) return;
    const Eigen::Vector3f place =
        Tabletop().Origin(pixel.view).cast<float>() + ray->distance * through.direction;
    if ((place - Middle()).norm() < 0.2f) ray->color = 1 - ray->color.array();
  };
  EXPECT_EQ(NumFound(differ), 0);
}

TEST(TransientFinder, KeepsWhatNoOtherPhotoLooksAt) {
  const auto differ = [](const ViewPixel& pixel, RenderedRay* ray) {
    if (pixel.view != 9 || !IsNear(pixel, 160, 120, 30)) return;
    ray->color = 1 - ray->color.array();
    ray->distance = 0.01f;  // a place right before that camera
  };
  EXPECT_EQ(NumFound(differ), 0);
}

TEST(TransientFinder, DoesNotJudgeAPhotoThatTheFoamShowsPoorly) {
  const auto differ = [](const ViewPixel& pixel, RenderedRay* ray) {
    if (pixel.view != 9) return;
    if (IsNear(pixel, 160, 120, 30)) ray->color = 1 - ray->color.array();
    if (pixel.x / 12 % 2 == 0) ray->color.array() -= 0.3f;  // stripes all over it
  };
  EXPECT_EQ(NumFound(differ), 0);
}

}  // namespace
}  // namespace semfoam
