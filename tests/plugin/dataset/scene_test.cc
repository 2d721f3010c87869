// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/geometry/guard_sites.h"
#include "plugin/dataset/scene_checksums.h"
#include "plugin/dataset/scene_memory.h"
#include "plugin/dataset/scene_plan.h"
#include "plugin/dataset/training_scene.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "tests/mistake.h"
#include "tests/plugin/dataset/small_workspace.h"
#include "tests/plugin/test_util.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

const fs::path kTabletop = fs::path(SEMFOAM_TEST_DATA) / "tabletop";

SceneOptions TabletopOptions() {
  SceneOptions options;
  options.image_path = kTabletop / "images";
  options.input_path = kTabletop / "sparse/0";
  return options;
}

std::string SceneErrorOf(const SceneOptions& options) {
  return UserErrorOf([&] { TrainingScene scene(PlanScene(options)); });
}

TEST(Scene, TabletopSaysWhatItMatched) {
  SceneOptions options = TabletopOptions();
  options.test_every = 8;
  ScenePlan plan = PlanScene(options);
  EXPECT_THAT(plan.warnings, testing::IsEmpty());
  EXPECT_EQ(plan.num_unregistered, 0);
  EXPECT_EQ(plan.num_rescaled, 0);
  // 3 bytes a pixel for photos, 2 for masks, one for 8x8 pixels' contrast; one undistorted camera
  // has no table.
  EXPECT_EQ(MemoryOf(plan).held, 64u * (320 * 240 * 5 + 40 * 30));
  EXPECT_EQ(MemoryOf(plan).always, 64u * 40 * 30);
  // A decoded photo and the classes of its mask; one more image of classes.
  EXPECT_EQ(MemoryOf(plan).opening, 320u * 240 * (3 + 2));
  EXPECT_EQ(MemoryOf(plan).loading, 320u * 240 * 2);
  const TrainingScene scene(std::move(plan));
  EXPECT_EQ(scene.NumViews(), 64);
  EXPECT_THAT(scene.MaskReport(),
              testing::MatchesRegex("64 of 64 photos have a mask, [0-9]+ "
                                    "labels, 0 masks unused"));
  EXPECT_THAT(scene.PhotoReport(), testing::StartsWith("64 photos, 8 held out; "));
  // 13 things; the tracker's other ids are fragments and errors.
  EXPECT_EQ(scene.Consistency().used, MaskConsistency::kTracks);
  EXPECT_GT(scene.Consistency().agreement_after, scene.Consistency().agreement_before + 0.05);
  EXPECT_GT(scene.Consistency().labels_before, 40);
  EXPECT_GE(scene.NumClasses(), 13);
  EXPECT_LE(scene.NumClasses(), 18);
  EXPECT_GT(scene.SecondsDecoding(), 0);
  int held_out = 0;
  for (int view = 0; view < scene.NumViews(); ++view) {
    EXPECT_EQ(scene.IsHeldOut(view), view % 8 == 0);
    EXPECT_EQ(scene.Photos()[view].held_out, view % 8 == 0);
    held_out += scene.IsHeldOut(view);
    if (view == 0) continue;
    EXPECT_LT(scene.Photos()[view - 1].name, scene.Photos()[view].name);
  }
  EXPECT_EQ(held_out, 8);
  const auto mug = std::find_if(scene.Labels().begin(),
                                scene.Labels().end(),
                                [](const Label& label) { return label.name == "mug"; });
  ASSERT_NE(mug, scene.Labels().end());
  EXPECT_EQ(mug->id, LabelId{6});
  EXPECT_EQ(mug->source_id, MaskId{6});
}

// Photos, poses, camera and frame together: the ray of the pixel at which COLMAP saw a point must
// pass by that point, in the normalised frame, by less than a pixel.
TEST(Scene, RaysPassThroughThePointsThatColmapSawThere) {
  const TrainingScene scene(PlanScene(TabletopOptions()));
  const Reconstruction model = ReadReconstruction(kTabletop / "sparse/0");
  double sum = 0;
  int count = 0;
  for (int view = 0; view < scene.NumViews(); ++view) {
    const PhotoRecord& record = scene.Photos()[view];
    const auto image = std::find_if(model.images.begin(), model.images.end(), [&](const Image& i) {
      return i.name == record.name;
    });
    std::map<uint64_t, const Point3D*> points;
    for (const Point3D& point : model.points) points[point.id] = &point;
    for (const Point2D& seen : image->points) {
      if (seen.point3d_id == kNoPoint3D) continue;
      TrainingRay ray;
      const int x = static_cast<int>(seen.x);
      const int y = static_cast<int>(seen.y);
      if (x < 0 || y < 0 || x >= scene.Width(view) || y >= scene.Height(view)) continue;
      ASSERT_TRUE(scene.Ray(view, x, y, &ray));
      ASSERT_NEAR(ray.direction.norm(), 1, 1e-6);
      const Eigen::Vector3d to_point =
          scene.WorldFromNormalized().Invert(points.at(seen.point3d_id)->position) -
          scene.Origin(view);
      // A pixel is 1 / f of an angle; what the whole-pixel ray misses of (x, y) is known.
      const double miss = to_point.normalized().cross(ray.direction.cast<double>()).norm();
      const double focal = record.camera_params[0];
      const double rounding = std::hypot(seen.x - (x + 0.5), seen.y - (y + 0.5));
      sum += std::max(0.0, miss * focal - rounding);
      ++count;
    }
  }
  EXPECT_GT(count, 10'000);
  EXPECT_LT(sum / count, 1);
}

TEST(Scene, ColourClassAndRayBelongToTheSamePixel) {
  const SmallWorkspace workspace;
  const TrainingScene scene(PlanScene(workspace.Options()));
  ASSERT_EQ(scene.NumViews(), 3);
  EXPECT_EQ(scene.Photos()[0].name, "a.png");
  EXPECT_EQ(scene.Photos()[2].name, "sub/c.png");
  ASSERT_EQ(scene.NumClasses(), 6);
  for (int view = 0; view < 3; ++view) {
    const LabelImage ids = scene.LabelIds(view);
    EXPECT_TRUE(scene.HasMask(view));
    for (int y = 0; y < 6; ++y) {
      for (int x = 0; x < 8; ++x) {
        TrainingRay ray;
        ASSERT_TRUE(scene.Ray(view, x, y, &ray));
        EXPECT_FLOAT_EQ(ray.color.x(), 10 * x / 255.0f);
        EXPECT_FLOAT_EQ(ray.color.y(), 20 * y / 255.0f);
        EXPECT_FLOAT_EQ(ray.color.z(), "abc"[view] / 255.0f);
        EXPECT_EQ(ray.class_index, x == 0 ? kUnlabelled : ClassIndex{y});
        EXPECT_EQ(ids.data[y * 8 + x], x == 0 ? 0 : 10 + y);
        EXPECT_EQ(scene.Photo(view).data[3 * (y * 8 + x)], 10 * x);
        // A point on the ray is seen in the middle of the pixel.
        const Image& image = workspace.model.images[view == 0 ? 1 : view == 1 ? 2 : 0];
        const Camera& camera = workspace.model.cameras[image.camera_id == 2 ? 0 : 1];
        const Eigen::Vector3d world = scene.WorldFromNormalized().Apply(
            scene.Origin(view) + 0.7 * ray.direction.cast<double>());
        const auto pixel = Project(
            camera, image.cam_from_world.UnitRotation() * world + image.cam_from_world.translation);
        ASSERT_TRUE(pixel);
        EXPECT_NEAR(pixel->x(), x + 0.5, 1e-4);
        EXPECT_NEAR(pixel->y(), y + 0.5, 1e-4);
      }
    }
  }
}

TEST(Scene, RenderingCastsTheVeryRaysOfTraining) {
  const SmallWorkspace workspace;
  const TrainingScene scene(PlanScene(workspace.Options()));
  for (int view = 0; view < scene.NumViews(); ++view) {
    const CameraRays rays =
        MakeCameraRays(scene.Photos()[view], scene.WorldFromNormalized(), "scene.foam");
    EXPECT_EQ(rays.width, 8);
    EXPECT_EQ(rays.height, 6);
    EXPECT_EQ(rays.origin, scene.Origin(view));
    for (int y = 0; y < 6; ++y) {
      for (int x = 0; x < 8; ++x) {
        TrainingRay ray;
        ASSERT_TRUE(scene.Ray(view, x, y, &ray));
        EXPECT_EQ(rays.directions[y * 8 + x], ray.direction);  // to the bit
      }
    }
  }
}

TEST(Scene, PixelsWithoutARayAreSaidToBe) {
  SmallWorkspace workspace;
  workspace.model.cameras[0].params = {10, 11, 4, 3, -3, 0, 0, 0};
  workspace.WriteModelFiles();
  const TrainingScene scene(PlanScene(workspace.Options()));
  TrainingRay ray;
  EXPECT_TRUE(scene.Ray(1, 4, 3, &ray));
  EXPECT_FALSE(scene.Ray(1, 0, 0, &ray));
  const CameraRays rays =
      MakeCameraRays(scene.Photos()[1], scene.WorldFromNormalized(), "scene.foam");
  EXPECT_EQ(rays.directions[0], Eigen::Vector3f::Zero());
  EXPECT_NEAR(rays.directions[3 * 8 + 4].norm(), 1, 1e-6);
}

TEST(Scene, IgnoredPixelsHaveNoRay) {
  const SmallWorkspace workspace;
  SceneOptions options = workspace.Options();
  const std::string without = AllChecksumsOf(PlanScene(options)).masks;
  options.ignore_path = workspace.temp / "ignored";
  // Of a.png and sub/c.png: the left half is black.
  std::vector<uint8_t> samples;
  for (int i = 0; i < 8 * 6; ++i) samples.push_back(i % 8 < 4 ? 0 : 255);
  WritePng(options.ignore_path / "a_mask.png", 8, 6, 8, PNG_COLOR_TYPE_GRAY, samples);
  WritePng(options.ignore_path / "sub/c.png.png", 8, 6, 8, PNG_COLOR_TYPE_GRAY, samples);
  const std::string with = AllChecksumsOf(PlanScene(options)).masks;
  EXPECT_NE(with, without);
  for (const bool inverted : {false, true}) {
    options.ignore_inverted = inverted;
    const TrainingScene held(PlanScene(options));
    LoadOptions none;
    none.cache_bytes = 0;
    const TrainingScene streamed(PlanScene(options), none);
    EXPECT_THAT(held.PhotoReport(), HasSubstr(", 33 % of the pixels ignored"));
    for (int view = 0; view < 3; ++view) {
      for (int x = 0; x < 8; ++x) {
        const bool ignored = view != 1 && (x < 4) != inverted;
        EXPECT_EQ(held.IsIgnored(view, x, 2), ignored);
        TrainingRay ray;
        Eigen::Vector3f direction;
        EXPECT_EQ(held.Ray(view, x, 2, &ray), !ignored) << view << " " << x;
        EXPECT_EQ(streamed.RayDirection(view, x, 2, &direction), !ignored) << view << " " << x;
        EXPECT_EQ(streamed.RayOf(view, x, 2, streamed.OpenView(view)->At(x, 2), &ray), !ignored);
      }
      const BlockContrast kept(held.Photo(view),
                               [&](int x, int y) { return !held.IsIgnored(view, x, y); });
      EXPECT_EQ(held.Contrast(view)->At(0, 0), kept.At(0, 0));
    }
  }
  options.ignore_path = workspace.temp / "none";
  EXPECT_THAT(SceneErrorOf(options), NamesMistake("none", {}, "no such folder"));
  WriteFile(workspace.temp / "other/x.png", "");
  options.ignore_path = workspace.temp / "other";
  EXPECT_THAT(SceneErrorOf(options), NamesMistake("other", {"x.png"}, "none of the 1 masks"));
}

TEST(Scene, TablesAndNewtonGiveTheSameBits) {
  Camera camera;
  camera.model_id = 10;
  camera.width = 61;
  camera.height = 43;
  camera.params = {30, 31, 30, 21, 0.03, -0.006, 4e-4, -6e-4, 1e-3, -1e-4, 8e-4, -5e-4};
  const PixelRays table(camera, /*tabulate=*/true);
  const PixelRays newton(camera, /*tabulate=*/false);
  EXPECT_EQ(PixelRays::TableBytes(camera), 61u * 43 * 12);
  for (int y = 0; y < 43; ++y) {
    for (int x = 0; x < 61; ++x) {
      Eigen::Vector3f a, b;
      EXPECT_EQ(table.Direction(x, y, &a), newton.Direction(x, y, &b));
      EXPECT_EQ(a, b);
    }
  }
}

TEST(Scene, TheMemoryPlanCountsPhotosMasksAndTables) {
  const SmallWorkspace workspace;
  const ScenePlan plan = PlanScene(workspace.Options());
  // Two views share the distorted camera, and one table.
  EXPECT_THAT(plan.table_views, testing::ElementsAre(1));
  EXPECT_EQ(MemoryOf(plan).held, 8u * 6 * (3 * 3 + 3 * 2 + 12) + 3);
}

TEST(Scene, PhotosOfAnotherSizeRescaleTheirCamera) {
  SmallWorkspace workspace;
  const TrainingScene whole(PlanScene(workspace.Options()));
  workspace.WritePhoto("a.png", 4, 3);
  workspace.WritePhoto("b.png", 16, 12);
  ScenePlan plan = PlanScene(workspace.Options());
  EXPECT_EQ(plan.num_rescaled, 2);
  const TrainingScene scene(std::move(plan));
  EXPECT_EQ(scene.Width(0), 4);
  EXPECT_EQ(scene.Height(0), 3);
  EXPECT_EQ(scene.Photos()[0].width, 4);
  EXPECT_THAT(scene.Photos()[0].camera_params, testing::ElementsAre(5, 5.5, 2, 1.5));
  EXPECT_EQ(scene.LabelIds(0).width, 4);
  // The corner that four small pixels share is the middle of the large one.
  TrainingRay large;
  ASSERT_TRUE(whole.Ray(1, 2, 2, &large));
  Eigen::Vector3f mean = Eigen::Vector3f::Zero();
  for (int k = 0; k < 4; ++k) {
    TrainingRay small;
    ASSERT_TRUE(scene.Ray(1, 4 + k % 2, 4 + k / 2, &small));
    mean += small.direction / 4;
  }
  EXPECT_LT((mean.normalized() - large.direction).norm(), 1e-4);
  workspace.WritePhoto("b.png", 6, 8);
  EXPECT_THAT(SceneErrorOf(workspace.Options()),
              HasSubstr("b.png: is 6 x 8 pixels, while its camera (2) has 8 x 6"));
}

// The photos' files count, not what is left of them for training.
TEST(Scene, MasksOfPhotosBeforeUndistortionAreToldOf) {
  SmallWorkspace w;
  for (Camera& camera : w.model.cameras) {
    camera.width = 41;
    camera.height = 30;
  }
  w.WriteModelFiles();
  for (const Image& image : w.model.images) {
    w.WritePhoto(image.name, 41, 30);
    w.WriteMask(image.name, image.name == "a.png" ? 41 : 40, 30);
  }
  EXPECT_THAT(
      TrainingScene(PlanScene(w.Options())).Warnings(),
      testing::ElementsAre(NamesMistake(
          "",
          {"2 of 3 masks", (w.temp / "object_mask/b.png").string(), "40 x 30 pixels", "41 x 30"},
          "not yet undistorted")));
  for (const Image& image : w.model.images) w.WriteMask(image.name, 41, 30);
  SceneOptions reduced = w.Options();
  reduced.max_image_size = 40;
  EXPECT_THAT(TrainingScene(PlanScene(reduced)).Warnings(), testing::IsEmpty());
}

TEST(Scene, LargePhotosAreReducedWithTheirCamera) {
  const SmallWorkspace workspace;
  SceneOptions options = workspace.Options();
  options.max_image_size = 4;
  const TrainingScene scene(PlanScene(options));
  EXPECT_THAT(scene.PhotoReport(), HasSubstr("3 reduced"));
  ASSERT_EQ(scene.Width(0), 4);
  ASSERT_EQ(scene.Height(0), 3);
  EXPECT_EQ(scene.Photo(0).width, 4);
  EXPECT_NEAR(scene.Photos()[0].camera_params[0], 5, 1e-12);
  EXPECT_NEAR(scene.Photos()[0].camera_params[2], 2, 1e-12);
  // Red is 10 times the column: the first pixel lies between columns 0 and 1.
  TrainingRay ray;
  ASSERT_TRUE(scene.Ray(0, 0, 0, &ray));
  EXPECT_GT(ray.color.x(), 0);
  EXPECT_LT(ray.color.x(), 10 / 255.0f);
  // Masks follow by the nearest pixel, and a bound that is no bound changes nothing.
  EXPECT_EQ(scene.LabelIds(0).width, 4);
  options.max_image_size = 8;
  EXPECT_EQ(TrainingScene(PlanScene(options)).Width(0), 8);
}

TEST(Scene, SeedsAreFitSortedAndSingle) {
  SmallWorkspace workspace;
  auto& points = workspace.model.points;
  Point3D duplicate = points[0];
  duplicate.id = 100;
  Point3D trackless = points[0];
  trackless.id = 101;
  trackless.position.x() += 0.01;
  trackless.track.clear();
  Point3D nan = points[0];
  nan.id = 102;
  nan.position.y() = NAN;
  Point3D far = points[0];
  far.id = 103;
  far.position.z() = 1e4;
  points.insert(points.end(), {duplicate, trackless, nan, far});
  workspace.WriteModelFiles();
  const ScenePlan plan = PlanScene(workspace.Options());
  EXPECT_EQ(plan.num_points, 7);
  ASSERT_EQ(plan.seeds.size(), 3u);
  EXPECT_FLOAT_EQ(plan.seeds[0].color.x(), 3 / 255.0f);
  EXPECT_FLOAT_EQ(plan.seeds[1].color.x(), 5 / 255.0f);
  EXPECT_FLOAT_EQ(plan.seeds[2].color.x(), 8 / 255.0f);
  for (const SeedPoint& seed : plan.seeds) EXPECT_LE(seed.position.norm(), kFarRadius);
  const Eigen::Vector3d back =
      plan.world_from_normalized.Apply(plan.seeds[0].position.cast<double>());
  EXPECT_LT((back - Eigen::Vector3d(0.3, 0.3, -0.2)).norm(), 1e-6);
  // Models of other programs have no tracks at all.
  for (Point3D& point : points) point.track.clear();
  workspace.WriteModelFiles();
  EXPECT_EQ(PlanScene(workspace.Options()).seeds.size(), 4u);
  points.clear();
  workspace.WriteModelFiles();
  EXPECT_EQ(PlanScene(workspace.Options()).seeds.size(), 0u);
}

// A dense cloud comes behind the SfM points, in the same frame, and is an input of its own.
TEST(Scene, SeedsOfADenseCloud) {
  SmallWorkspace workspace;
  const std::string header =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty "
      "float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n";
  SceneOptions options = workspace.Options();
  const SceneChecksums without = AllChecksumsOf(PlanScene(options));
  options.seed_path = workspace.temp / "fused.ply";
  WriteFile(options.seed_path, header + "0.5 0.25 -0.25 51 0 0\n1e6 0 0 0 0 0\nnan 0 0 0 0 0\n");
  ScenePlan plan = PlanScene(options);
  EXPECT_EQ(plan.seeds.size(), 3u);
  EXPECT_EQ(plan.seed_cloud.num_points, 3);
  EXPECT_EQ(plan.seed_cloud.num_far, 1);
  EXPECT_EQ(plan.seed_cloud.num_not_finite, 1);
  const SceneChecksums checksums = AllChecksumsOf(plan);
  EXPECT_EQ(checksums.model, without.model);
  EXPECT_NE(checksums.seed_cloud, without.seed_cloud);

  const TrainingScene scene(std::move(plan));
  ASSERT_EQ(scene.Seeds().size(), 4u);
  EXPECT_FALSE(scene.Seeds()[2].is_dense);
  EXPECT_TRUE(scene.Seeds()[3].is_dense);
  EXPECT_FLOAT_EQ(scene.Seeds()[3].color.x(), 0.2f);
  const Eigen::Vector3d back =
      scene.WorldFromNormalized().Apply(scene.Seeds()[3].position.cast<double>());
  EXPECT_LT((back - Eigen::Vector3d(0.5, 0.25, -0.25)).norm(), 1e-6);

  WriteFile(options.seed_path, header + "0.5 0.25 -0.26 51 0 0\n1e6 0 0 0 0 0\nnan 0 0 0 0 0\n");
  EXPECT_NE(AllChecksumsOf(PlanScene(options)).seed_cloud, checksums.seed_cloud);
}

// Tracks in photos that are smaller than COLMAP saw them, and in none that is held out.
TEST(Scene, TracksAreInPixelsOfTheTrainingPhotos) {
  SmallWorkspace workspace;
  for (Image& image : workspace.model.images) {
    image.points = {{4, 3, 5}, {5, 2, 3}};
  }
  workspace.model.points[0].track = {{4, 0}, {6, 0}, {9, 0}, {9, 7}};  // the last is not there
  workspace.WriteModelFiles();
  workspace.WritePhoto("b.png", 16, 12);
  SceneOptions options = workspace.Options();
  options.test_every = 3;
  const ScenePlan plan = PlanScene(options);
  ASSERT_EQ(plan.seed_tracks.size(), plan.seeds.size());
  const PixelObservations& track = plan.seed_tracks[1];  // of point 5
  ASSERT_EQ(track.size(), 2u);                           // photo 0 is held out
  EXPECT_EQ(track[0].view, 1);
  EXPECT_EQ(track[0].pixel, Eigen::Vector2d(8, 6));
  EXPECT_EQ(track[1].view, 2);
  EXPECT_EQ(track[1].pixel.x(), 4);
  options.mask_consistency = MaskConsistency::kOff;
  EXPECT_TRUE(PlanScene(options).seed_tracks.empty());
}

TEST(Scene, MaskFoldersThatYieldNothingAreToldOf) {
  const SmallWorkspace w;
  const std::string root = w.temp.path().string();
  EXPECT_THAT(PlanScene(w.Options()).warnings, testing::IsEmpty());
  SceneOptions given = w.Options();
  given.mask_path = w.temp / "object_mask";

  fs::rename(w.temp / "object_mask", w.temp / "Masks");
  EXPECT_THAT(PlanScene(w.Options()).warnings,
              testing::ElementsAre(NamesMistake(
                  "", {root + "/Masks", "3 .png files", "mask_path"}, "so there are no labels")));
  fs::create_directories(w.temp / "object_mask");
  EXPECT_THAT(PlanScene(w.Options()).warnings,
              testing::ElementsAre(NamesMistake(
                  root + "/object_mask",
                  {"so there are no labels", root + "/Masks", "3 .png files", "mask_path"},
                  "is empty")));
  EXPECT_THAT(SceneErrorOf(given), NamesMistake(root + "/object_mask", {}, "is empty"));
  fs::rename(w.temp / "Masks", w.temp / "elsewhere");
  for (const char* file : {"a.jpg", "b.JPG", "sub/c.jpg", "pred.json", "README", "x.txt"}) {
    WriteFile(w.temp / "object_mask" / file, "");
  }
  Mistake holds = {
      root + "/object_mask", {"3 .jpg files", "1 other file", "1 .json file"}, "holds no mask"};
  EXPECT_THAT(SceneErrorOf(given), TellsOf(holds));
  holds.named.push_back("so there are no labels");
  EXPECT_THAT(PlanScene(w.Options()).warnings, testing::ElementsAre(TellsOf(holds)));
  SceneOptions with_names = w.Options();
  with_names.labels_path = w.temp / "labels.json";
  WriteFile(with_names.labels_path, R"({"labels": {"12": "ball"}})");
  EXPECT_THAT(SceneErrorOf(with_names), HasSubstr("names labels, while there are no masks: "));
  given.use_masks = false;
  EXPECT_EQ(SceneErrorOf(given), "");
  EXPECT_THAT(PlanScene(given).warnings, testing::IsEmpty());
  // Where nothing looks like masks there is nothing to say: colour alone is wanted.
  fs::remove_all(w.temp / "object_mask");
  EXPECT_THAT(PlanScene(w.Options()).warnings, testing::IsEmpty());
  // A workspace's masks come before those beside the photos.
  fs::create_directories(w.temp / "work");
  fs::rename(w.temp / "elsewhere", w.temp / "work/object_mask");
  SceneOptions in_workspace = w.Options();
  in_workspace.workspace_path = w.temp / "work";
  EXPECT_EQ(PlanScene(in_workspace).masks.NumPaired(), 3);
}

TEST(Scene, MasksWithoutIdsAreToldOf) {
  const SmallWorkspace w;
  for (const Image& image : w.model.images) {
    WritePng(w.temp / "object_mask" / image.name,
             8,
             6,
             8,
             PNG_COLOR_TYPE_GRAY,
             std::vector<uint8_t>(48));
  }
  const auto no_ids =
      NamesMistake((w.temp / "object_mask").string(), {"3 masks", "0"}, "have no id");
  for (const LabelZero zero : {LabelZero::kAuto, LabelZero::kIgnore}) {
    SceneOptions options = w.Options();
    options.label_zero = zero;
    EXPECT_THAT(TrainingScene(PlanScene(options)).Warnings(), testing::ElementsAre(no_ids));
    options.mask_path = w.temp / "object_mask";
    EXPECT_THAT(SceneErrorOf(options), no_ids);
  }
}

TEST(Scene, NamesOfNoMaskAreToldOf) {
  const SmallWorkspace w;
  WriteFile(w.temp / "labels.json", R"({"labels": {"12": "ball", "112": "mug"}})");
  EXPECT_THAT(
      TrainingScene(PlanScene(w.Options())).Warnings(),
      testing::ElementsAre(NamesMistake(
          (w.temp / "labels.json").string(), {"1 of its 2 names", "112 (mug)"}, "no mask has")));
}

TEST(Scene, MasksAndNamesAreFoundWhereTheyAreWont) {
  const SmallWorkspace workspace;
  const fs::path root = workspace.temp.path();
  WriteFile(root / "labels.json", R"({"labels": {"12": "ball"}})");
  const TrainingScene scene(PlanScene(workspace.Options()));
  EXPECT_EQ(scene.MaskReport(), "3 of 3 photos have a mask, 6 labels, 0 masks unused");
  EXPECT_EQ(scene.Labels()[2].name, "ball");

  fs::rename(root / "object_mask", root / "Annotations");
  workspace.WritePhoto("unregistered.png", 8, 6);
  fs::copy(root / "Annotations/a.png", root / "Annotations/unregistered.png");
  fs::remove(root / "Annotations/b.png");
  const TrainingScene other(PlanScene(workspace.Options()));
  EXPECT_EQ(other.MaskReport(), "2 of 3 photos have a mask, 6 labels, 1 mask unused");
  EXPECT_THAT(other.PhotoReport(), HasSubstr("1 more not registered"));
  EXPECT_FALSE(other.HasMask(1));
  EXPECT_THAT(other.LabelIds(1).data, testing::Each(0));
  TrainingRay ray;
  ASSERT_TRUE(other.Ray(1, 3, 3, &ray));
  EXPECT_EQ(ray.class_index, kUnlabelled);

  fs::remove_all(root / "Annotations");
  const TrainingScene colour_only(PlanScene(workspace.Options()));
  EXPECT_EQ(colour_only.NumClasses(), 0);
  EXPECT_THAT(colour_only.MaskReport(), testing::StartsWith("no masks"));

  SceneOptions options = workspace.Options();
  options.mask_path = root / "nowhere";
  EXPECT_THAT(SceneErrorOf(options), HasSubstr("nowhere: there is no such folder"));
  options = workspace.Options();
  options.labels_path = root / "no.json";
  EXPECT_THAT(SceneErrorOf(options), HasSubstr("no.json: there is no such file"));
  WriteFile(root / "no.json", R"({"labels": {"7": "mug"}})");
  EXPECT_THAT(SceneErrorOf(options),
              NamesMistake((root / "no.json").string(),
                           {"names labels", "object_mask/", "Annotations/", "mask_path"},
                           "there are no masks"));
  options.use_masks = false;
  options.labels_path.clear();
  EXPECT_EQ(SceneErrorOf(options), "");
}

TEST(Scene, MasksAndDistortionCanBeLeftOut) {
  SmallWorkspace workspace;
  SceneOptions options = workspace.Options();
  options.use_masks = false;
  options.mask_path = workspace.temp / "object_mask";
  const TrainingScene scene(PlanScene(options));
  EXPECT_EQ(scene.NumClasses(), 0);
  EXPECT_FALSE(scene.HasMask(0));

  ScenePlan plan = PlanScene(workspace.Options());
  EXPECT_GT(plan.distortion, kLeastDistortion);
  EXPECT_EQ(plan.photos[1].camera_model, "OPENCV");
  EXPECT_EQ(plan.table_views.size(), 1u);
  options.distortion = EffectSwitch::kOff;
  plan = PlanScene(options);
  EXPECT_EQ(plan.photos[1].camera_model, "PINHOLE");
  EXPECT_TRUE(plan.table_views.empty());
  // One that moves nothing by a tenth of a pixel is none, unless the user says so.
  workspace.model.cameras[0].params = {10, 11, 4, 3, -1e-4, 0, 0, 0};
  workspace.WriteModelFiles();
  EXPECT_EQ(PlanScene(workspace.Options()).photos[1].camera_model, "PINHOLE");
  options.distortion = EffectSwitch::kOn;
  EXPECT_EQ(PlanScene(options).photos[1].camera_model, "OPENCV");
}

TEST(Scene, ZeroIsAClassOnRequest) {
  const SmallWorkspace workspace;
  SceneOptions options = workspace.Options();
  options.label_zero = LabelZero::kClass;
  const TrainingScene scene(PlanScene(options));
  EXPECT_EQ(scene.NumClasses(), 7);
  EXPECT_EQ(scene.Labels()[0].id, LabelId{0});
  EXPECT_EQ(scene.MaskReport(), "3 of 3 photos have a mask, 6 labels, 0 masks unused");
  TrainingRay ray;
  ASSERT_TRUE(scene.Ray(0, 0, 2, &ray));
  EXPECT_EQ(ray.class_index, ClassIndex{0});
}

TEST(Scene, HoldingOutLeavesSomethingToTrainOn) {
  const SmallWorkspace workspace;
  SceneOptions options = workspace.Options();
  options.test_every = 2;
  const TrainingScene scene(PlanScene(options));
  EXPECT_TRUE(scene.IsHeldOut(0));
  EXPECT_FALSE(scene.IsHeldOut(1));
  EXPECT_TRUE(scene.IsHeldOut(2));
  options.test_every = 1;
  EXPECT_THAT(SceneErrorOf(options), HasSubstr("test_every 1: holds out all of the 3 photos"));
  options.test_every = -1;
  EXPECT_THAT(SceneErrorOf(options), HasSubstr("test_every -1"));
}

// Nothing but the memory differs: every ray, every label and every finding is that of a scene whose
// photos stay.
void ExpectTheSameWithoutMemory(const SceneOptions& options) {
  const TrainingScene held(PlanScene(options));
  ScenePlan plan = PlanScene(options);
  LoadOptions load;
  load.cache_bytes = static_cast<int64_t>(MemoryOf(plan).held) - 1;
  std::vector<int> reports;
  load.report = [&](int done, int total) {
    EXPECT_EQ(total, held.NumViews());
    reports.push_back(done);
  };
  TrainingScene scene(std::move(plan), load);
  EXPECT_TRUE(held.HoldsPixels());
  ASSERT_FALSE(scene.HoldsPixels());
  EXPECT_EQ(scene.CacheBytes(), load.cache_bytes);
  EXPECT_EQ(reports.size(), static_cast<size_t>(held.NumViews()));
  EXPECT_TRUE(std::is_sorted(reports.begin(), reports.end()));
  EXPECT_EQ(scene.MaskReport(), held.MaskReport());
  EXPECT_EQ(scene.Consistency().Line(), held.Consistency().Line());
  ASSERT_EQ(scene.NumClasses(), held.NumClasses());
  for (int c = 0; c < held.NumClasses(); ++c) {
    EXPECT_EQ(scene.Labels()[c].id, held.Labels()[c].id);
    EXPECT_EQ(scene.Labels()[c].name, held.Labels()[c].name);
  }
  for (int view = 0; view < held.NumViews(); ++view) {
    EXPECT_EQ(scene.LabelIds(view).data, held.LabelIds(view).data);
    EXPECT_EQ(scene.Survey(view).patches, held.Survey(view).patches);
    const std::unique_ptr<ViewPixels> pixels = scene.OpenView(view);
    for (int y = 0; y < held.Height(view); ++y) {
      for (int x = 0; x < held.Width(view); ++x) {
        TrainingRay a, b;
        const bool is_ray = held.Ray(view, x, y, &a);
        ASSERT_EQ(scene.RayOf(view, x, y, pixels->At(x, y), &b), is_ray);
        Eigen::Vector3f direction;
        ASSERT_EQ(scene.RayDirection(view, x, y, &direction), is_ray);
        if (!is_ray) continue;
        ASSERT_EQ(a.direction, b.direction);
        ASSERT_EQ(a.direction, direction);
        ASSERT_EQ(a.color, b.color);
        ASSERT_EQ(a.class_index, b.class_index);
        ASSERT_EQ(scene.Contrast(view)->At(x, y), held.Contrast(view)->At(x, y));
      }
    }
  }
}

TEST(Scene, PhotosThatDoNotFitIntoMemoryAreTheSame) {
  SmallWorkspace workspace;
  ExpectTheSameWithoutMemory(workspace.Options());
  fs::remove(workspace.temp / "object_mask/b.png");
  SceneOptions options = workspace.Options();
  options.max_image_size = 4;
  options.label_zero = LabelZero::kClass;
  ExpectTheSameWithoutMemory(options);
  options.use_masks = false;
  ExpectTheSameWithoutMemory(options);
  // Masks of a tracker that the tracks correct: split, renamed and dropped regions.
  options = TabletopOptions();
  options.test_every = 8;
  ExpectTheSameWithoutMemory(options);
  options.mask_consistency = MaskConsistency::kIndependent;
  ExpectTheSameWithoutMemory(options);
}

TEST(Scene, FilesThatGoOrChangeWhileTrainingReadsThemAreNamed) {
  SmallWorkspace workspace;
  LoadOptions load;
  load.cache_bytes = 1;
  const TrainingScene scene(PlanScene(workspace.Options()), load);
  const auto error_of = [&](int view) { return UserErrorOf([&] { scene.OpenView(view); }); };
  EXPECT_EQ(error_of(0), "");
  workspace.WritePhoto("a.png", 16, 12);
  EXPECT_THAT(error_of(0), HasSubstr("a.png: has changed its size since it was first looked at"));
  fs::remove(workspace.temp / "images/a.png");
  EXPECT_THAT(error_of(0), NamesMistake("images/a.png", {}, "is no longer there"));
  std::vector<uint8_t> other(8 * 6, 77);
  WritePng(workspace.temp / "object_mask/b.png", 8, 6, 8, PNG_COLOR_TYPE_GRAY, other);
  EXPECT_THAT(error_of(1), HasSubstr("object_mask/b.png: has changed its ids"));
  fs::remove(workspace.temp / "object_mask/b.png");
  EXPECT_THAT(error_of(1), HasSubstr("object_mask/b.png: is no longer there"));
}

TEST(Scene, WhatIsMissingOrDamagedIsNamed) {
  SmallWorkspace workspace;
  const fs::path root = workspace.temp.path();
  SceneOptions options = workspace.Options();
  options.image_path = root / "photos";
  EXPECT_THAT(SceneErrorOf(options), HasSubstr("photos: there is no such folder"));
  options = workspace.Options();
  options.input_path = root / "dense";
  EXPECT_THAT(SceneErrorOf(options), HasSubstr("dense: there is no such folder"));

  const std::string photo = ReadFile(root / "images/b.png");
  fs::remove(root / "images/b.png");
  EXPECT_THAT(SceneErrorOf(workspace.Options()), HasSubstr("images/b.png: is missing, while"));
  WriteFile(root / "images/b.png", photo.substr(0, photo.size() - 20));
  EXPECT_THAT(SceneErrorOf(workspace.Options()),
              HasSubstr("images/b.png: cannot be decoded completely"));
  WriteFile(root / "images/b.png", photo);
  const std::string mask = ReadFile(root / "object_mask/a.png");
  WriteFile(root / "object_mask/a.png", mask.substr(0, mask.size() - 20));
  EXPECT_THAT(SceneErrorOf(workspace.Options()),
              HasSubstr("object_mask/a.png: cannot be decoded completely"));
  WriteFile(root / "object_mask/a.png", mask);
  EXPECT_EQ(SceneErrorOf(workspace.Options()), "");

  workspace.model.images.clear();
  workspace.model.points.clear();
  workspace.WriteModelFiles();
  EXPECT_THAT(SceneErrorOf(workspace.Options()), HasSubstr("images.bin: has no registered image"));
}

TEST(Scene, PhotoRecordsKeepTheCameraAndThePose) {
  const SmallWorkspace workspace;
  const Image& image = workspace.model.images[0];
  const Camera& camera = workspace.model.cameras[0];
  const PhotoRecord record = MakePhotoRecord(camera, image, true);
  EXPECT_TRUE(record.held_out);
  EXPECT_EQ(record.camera_model, "OPENCV");
  Camera back = CameraOf(record, "scene.foam");
  back.id = camera.id;
  EXPECT_EQ(back, camera);
  EXPECT_LT((PoseOf(record).Center() - image.cam_from_world.Center()).norm(), 1e-15);
  for (const auto& damage : std::vector<std::function<void(PhotoRecord&)>>{
           [](PhotoRecord& r) { r.camera_model = "FISHY"; },
           [](PhotoRecord& r) { r.camera_model = "FISHEYE"; },
           [](PhotoRecord& r) { r.camera_params.pop_back(); },
           [](PhotoRecord& r) { r.camera_params[0] = NAN; },
           [](PhotoRecord& r) { r.camera_params[1] = 0; },
           [](PhotoRecord& r) { r.width = 0; },
           [](PhotoRecord& r) { r.height = -1; }}) {
    PhotoRecord broken = record;
    damage(broken);
    EXPECT_THAT(UserErrorOf([&] { CameraOf(broken, "scene.foam"); }),
                HasSubstr("scene.foam: the photo sub/c.png has no valid camera"));
  }
}

}  // namespace
}  // namespace semfoam
