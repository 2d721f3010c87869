// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/scene/frame_choice.h"

#include "export/scene/level_surface.h"
#include "foam/geometry/sim3.h"
#include "foam/util/error.h"
#include "foam/util/random.h"

#include <cmath>

#include "tests/export/test_foams.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

Eigen::Vector3d Apply(const ExportTransform& transform, const Eigen::Vector3d& x) {
  return transform.scale * (transform.rotation * x) + transform.translation;
}

Eigen::Vector3d CenterOf(const PhotoRecord& photo) {
  return -(photo.cam_from_world_rotation.inverse() * photo.cam_from_world_translation);
}

// Turns the camera about its own axis.
void Roll(double degrees, PhotoRecord* photo) {
  const Eigen::Quaterniond roll(Eigen::AngleAxisd(degrees * M_PI / 180, Eigen::Vector3d::UnitZ()));
  photo->cam_from_world_rotation = roll * photo->cam_from_world_rotation;
  photo->cam_from_world_translation = roll * photo->cam_from_world_translation;
}

// A capture of a world whose z is up, seen through `colmap`, the transform from that world to the
// COLMAP frame.
std::vector<PhotoRecord> Ring(const Sim3& colmap, int count = 24) {
  std::vector<PhotoRecord> photos;
  for (int k = 0; k < count; ++k) {
    const double yaw = 2 * M_PI * k / count;
    const Eigen::Vector3d center(2 * std::cos(yaw), 2 * std::sin(yaw), 1.5);
    // x to the right, y down, z towards the middle; then 30 degrees down.
    Eigen::Matrix3d level;
    level << -std::sin(yaw), std::cos(yaw), 0, 0, 0, -1, -std::cos(yaw), -std::sin(yaw), 0;
    const Eigen::Matrix3d in_world =
        Eigen::AngleAxisd(M_PI / 6, Eigen::Vector3d::UnitX()).toRotationMatrix() * level;
    PhotoRecord photo;
    photo.name = std::to_string(k) + ".jpg";
    photo.cam_from_world_rotation = Eigen::Quaterniond(in_world * colmap.rotation.transpose());
    photo.cam_from_world_translation = -(photo.cam_from_world_rotation * colmap.Apply(center));
    photos.push_back(photo);
  }
  return photos;
}

// A floor of that world at height 0.25 with noise, and clutter above it, in the COLMAP frame.
SurfaceSamples Floor(const Sim3& colmap) {
  SurfaceSamples samples;
  for (int i = 0; i < 2000; ++i) {
    CounterRandom random(1, 2, i);
    const double x = 2 * random.Uniform() - 1, y = 2 * random.Uniform() - 1;
    const double z = 0.25 + (i % 4 == 0 ? random.Uniform() : 0.005 * random.Normal());
    samples.points.push_back(colmap.Apply({x, y, z}));
    samples.weights.push_back(1);
  }
  samples.tolerance = 0.015 * colmap.scale;
  return samples;
}

// Tilted against all axes, far from the origin.
const Sim3 kTilted = {
    3,
    Eigen::AngleAxisd(2.4, Eigen::Vector3d(2, 1, -0.7).normalized()).toRotationMatrix(),
    {100, -200, 50}};

double DegreesOff(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b)) * 180 / M_PI;
}

// What is up in the world, in the files.
Eigen::Vector3d UpIn(const CompletedFrame& frame) {
  return frame.transform.rotation * kTilted.rotation.col(2);
}

FrameChoiceOptions LevelledBy(const std::string& level, UpAxis up_axis = UpAxis::kZ) {
  FrameChoiceOptions options;
  options.level = level;
  options.transform.up_axis = up_axis;
  return options;
}

// What the options are refused with; empty: nothing.
std::string Refusal(const FrameChoiceOptions& options,
                    const std::vector<PhotoRecord>& photos,
                    const SurfaceSamples& surface) {
  try {
    CompleteFrame(ParseFrameChoice(options), photos, surface);
  } catch (const UserError& error) {
    return error.what();
  }
  return "";
}

TEST(FrameChoice, ByDefaultItIsTheColmapFrameExactly) {
  const FrameChoice choice = ParseFrameChoice({});
  EXPECT_FALSE(NeedsSurface(choice));
  const CompletedFrame frame = CompleteFrame(choice, {}, {});
  EXPECT_TRUE(frame.transform.IsIdentity());
  EXPECT_FALSE(frame.leveled);
  EXPECT_FALSE(frame.referenced);
}

TEST(FrameChoice, LevelsByCamerasAPlaneOrALabel) {
  for (const std::string level : {"cameras", "plane", "floor"}) {
    for (const UpAxis up : {UpAxis::kY, UpAxis::kZ}) {
      const FrameChoice choice = ParseFrameChoice(LevelledBy(level, up));
      EXPECT_EQ(NeedsSurface(choice), level != "cameras");
      const CompletedFrame frame = CompleteFrame(choice, Ring(kTilted), Floor(kTilted));
      const Eigen::Vector3d axis = Eigen::Vector3d::Unit(up == UpAxis::kY ? 1 : 2);
      EXPECT_LT(DegreesOff(UpIn(frame), axis), 0.1) << level;
      const ExportTransform& transform = frame.transform;
      EXPECT_LT((transform.rotation * transform.rotation.transpose() - Eigen::Matrix3d::Identity())
                    .norm(),
                1e-12);
      EXPECT_NEAR(transform.rotation.determinant(), 1, 1e-12);
      EXPECT_EQ(transform.scale, 1);
      EXPECT_LT(transform.up_tilt_degrees, 0.1);
      ASSERT_TRUE(frame.leveled);
      EXPECT_GT(frame.leveled->turned_degrees, 5);
      if (level == "cameras") {
        EXPECT_TRUE(frame.leveled->by_horizon);
        continue;
      }
      EXPECT_NEAR(frame.leveled->rms, 0.015, 0.005);
      EXPECT_NEAR(frame.leveled->share, 0.75, 0.03);
      EXPECT_EQ(frame.leveled->cameras_above, 24);
      EXPECT_NEAR(
          frame.leveled->height, axis.dot(Apply(transform, kTilted.Apply({0, 0, 0.25}))), 0.01);
    }
  }
}

TEST(FrameChoice, TheMiddleOfThePlaneStaysWhereItIs) {
  // With z nearly up already the model is turned about the floor, wherever the origin is.
  const Sim3 nearly = {
      1,
      Eigen::AngleAxisd(0.1, Eigen::Vector3d(1, 1, 0).normalized()).toRotationMatrix(),
      {4e5, 5e6, 100}};
  const CompletedFrame frame =
      CompleteFrame(ParseFrameChoice(LevelledBy("plane")), Ring(nearly), Floor(nearly));
  const Eigen::Vector3d middle = nearly.Apply({0, 0, 0.25});
  EXPECT_LT((Apply(frame.transform, middle) - middle).norm(), 0.05);
}

TEST(FrameChoice, ThePlaneComesToHeightZero) {
  FrameChoiceOptions options = LevelledBy("floor");
  options.level_to_zero = true;
  options.transform.scale = 10;
  const CompletedFrame frame =
      CompleteFrame(ParseFrameChoice(options), Ring(kTilted), Floor(kTilted));
  EXPECT_NEAR(Apply(frame.transform, kTilted.Apply({0.3, 0.2, 0.25})).z(), 0, 0.05);
  EXPECT_NEAR(Apply(frame.transform, kTilted.Apply({0, 0, 1.25})).z(), 30, 0.05);
  EXPECT_EQ(frame.leveled->height, 0);
}

TEST(FrameChoice, CamerasUpsideDownTurnTheFloorOverAndThatIsTold) {
  std::vector<PhotoRecord> photos = Ring(kTilted);
  for (PhotoRecord& photo : photos) Roll(180, &photo);
  const CompletedFrame frame =
      CompleteFrame(ParseFrameChoice(LevelledBy("plane")), photos, Floor(kTilted));
  EXPECT_LT(DegreesOff(UpIn(frame), -Eigen::Vector3d::UnitZ()), 0.1);
  EXPECT_EQ(frame.leveled->cameras_above, 0);
}

TEST(FrameChoice, WherePhotosDoNotTellWhatIsUpTheyAreAboveThePlane) {
  // A camera that was turned over between two photos.
  std::vector<PhotoRecord> photos = {Ring(kTilted)[0], Ring(kTilted)[0]};
  Roll(180, &photos[1]);
  const CompletedFrame frame =
      CompleteFrame(ParseFrameChoice(LevelledBy("plane")), photos, Floor(kTilted));
  EXPECT_LT(DegreesOff(UpIn(frame), Eigen::Vector3d::UnitZ()), 0.1);
  EXPECT_TRUE(std::isnan(frame.transform.up_tilt_degrees));
  EXPECT_THAT(ExportTransformJson(frame.transform), testing::Not(HasSubstr("up_tilt_degrees")));
}

TEST(FrameChoice, UpAxisColmapUndoesTheLevel) {
  const FrameChoice choice = ParseFrameChoice(LevelledBy("plane", UpAxis::kColmap));
  EXPECT_FALSE(NeedsSurface(choice));
  const CompletedFrame frame = CompleteFrame(choice, Ring(kTilted), {});
  EXPECT_TRUE(frame.transform.IsIdentity());
  EXPECT_EQ(ExportTransformJson(frame.transform), ExportTransformJson({}));
}

TEST(FrameChoice, NamesThatAreKeywordsAreLabelsWithAPrefix) {
  EXPECT_EQ(ParseFrameChoice(LevelledBy("cameras")).level.by, LevelBy::kCameras);
  const LevelChoice level = ParseFrameChoice(LevelledBy("name:cameras")).level;
  EXPECT_EQ(level.by, LevelBy::kLabels);
  EXPECT_EQ(level.labels, "name:cameras");
}

TEST(FrameChoice, LevelsThatCannotBeAreUserErrors) {
  const std::vector<PhotoRecord> photos = Ring(kTilted);
  EXPECT_THAT(Refusal(LevelledBy(" "), photos, {}), StartsWith("level is ' '; it must be none"));
  FrameChoiceOptions options = LevelledBy("cameras");
  options.level_to_zero = true;
  EXPECT_THAT(Refusal(options, photos, {}), StartsWith("level_to_zero moves a plane"));
  EXPECT_THAT(Refusal(LevelledBy("cameras"), {}, {}),
              StartsWith("level is cameras, but the photos do not tell what is up"));
  SurfaceSamples line;
  line.tolerance = 1;
  for (int k = 0; k < 30; ++k) {
    line.points.emplace_back(k, k, k);
    line.weights.push_back(1);
  }
  EXPECT_THAT(Refusal(LevelledBy("plane"), photos, line),
              HasSubstr("has no plane to level by within 45 degrees"));
  EXPECT_THAT(Refusal(LevelledBy("mug"), {}, line),
              StartsWith("level is 'mug', but the surface has no plane"));
}

TEST(FrameChoice, TwoPointsAndTheirDistanceGiveTheScale) {
  FrameChoiceOptions options;
  options.transform.transform = "2 0 0 1 0 2 0 0 0 0 2 0";
  options.scale_points = "1,2,3 4,6,3";
  options.scale_distance = 50;
  const ExportTransform transform = ParseFrameChoice(options).transform;
  EXPECT_DOUBLE_EQ(transform.scale, 10);
  EXPECT_DOUBLE_EQ((Apply(transform, {1, 2, 3}) - Apply(transform, {4, 6, 3})).norm(), 50);
  const auto refusal = [](const std::string& points, double distance, double scale) {
    FrameChoiceOptions wrong;
    wrong.scale_points = points;
    wrong.scale_distance = distance;
    wrong.transform.scale = scale;
    return Refusal(wrong, {}, {});
  };
  EXPECT_EQ(refusal("0 0 0 0 0 1", 5, 1), "");
  for (const char* points : {"0 0 0 0 0", "1 2 3 1 2 3", "1 2 3 1 2 x", "1 2 3 1 2 inf"}) {
    EXPECT_THAT(refusal(points, 5, 1), HasSubstr("it must be two different points"));
  }
  for (const double distance : {0.0, -1.0}) {
    EXPECT_THAT(refusal("0 0 0 0 0 1", distance, 1), StartsWith("scale_distance is "));
  }
  EXPECT_THAT(refusal("", 5, 1), HasSubstr("there are no scale_points"));
  EXPECT_THAT(refusal("0 0 0 0 0 1", 5, 2), HasSubstr("and so does scale; give one"));
  EXPECT_THAT(refusal("0 0 0 0 0 1", 1e12, 1), HasSubstr("from 1e-9 to 1e9"));
}

TEST(FrameChoice, MeasuredPositionsGiveTheTransform) {
  const std::vector<PhotoRecord> photos = Ring(kTilted);
  FrameChoiceOptions options;
  options.transform.scale = 100;
  for (const PhotoRecord& photo : Ring({5, Eigen::Matrix3d::Identity(), {4e5, 5e6, 300}})) {
    options.references.push_back({photo.name, CenterOf(photo)});
  }
  options.references.push_back({"not there.jpg", {0, 0, 0}});
  options.references[3].position.x() += 40;  // a mistake
  const CompletedFrame frame = CompleteFrame(ParseFrameChoice(options), photos, {});
  const Eigen::Vector3d expected = 100 * Eigen::Vector3d(4e5 + 5, 5e6 + 10, 300 + 15);
  EXPECT_LT((Apply(frame.transform, kTilted.Apply({1, 2, 3})) - expected).norm(), 1e-3);
  ASSERT_TRUE(frame.referenced);
  EXPECT_EQ(frame.referenced->photos, 24);
  EXPECT_THAT(frame.referenced->left_out, testing::ElementsAre("3.jpg"));
  EXPECT_LT(frame.referenced->max, 1e-6);

  FrameChoiceOptions wrong = options;
  wrong.transform.transform = "1 0 0 0 0 1 0 0 0 0 1 0";
  EXPECT_THAT(Refusal(wrong, photos, {}),
              StartsWith("ref_images_path gives the transform, and so does transform"));
  wrong = options;
  wrong.transform.scale = 1;
  wrong.scale_points = "0 0 0 1 1 1";
  wrong.scale_distance = 1;
  EXPECT_THAT(Refusal(wrong, photos, {}),
              StartsWith("scale_points gives the scale, and so does ref_images_path"));
  wrong = options;
  wrong.references.resize(2);
  EXPECT_THAT(Refusal(wrong, photos, {}),
              StartsWith("ref_images_path has positions of 2 of the model's 24"));
  wrong = options;
  for (size_t k = 0; k < wrong.references.size(); ++k) {
    wrong.references[k].position = static_cast<double>(k) * Eigen::Vector3d(1, 2, 3);
  }
  EXPECT_THAT(Refusal(wrong, photos, {}), HasSubstr("which lie on one line"));
  EXPECT_THROW(CompleteByPhotos(ParseFrameChoice(wrong), photos), UserError);
}

TEST(FrameChoice, MeasuredPositionsAndALabelTogetherAreLevel) {
  FrameChoiceOptions options = LevelledBy("floor");
  for (const PhotoRecord& photo : Ring({5, kTilted.rotation, {1, 2, 3}})) {
    options.references.push_back({photo.name, CenterOf(photo)});
  }
  const CompletedFrame frame =
      CompleteFrame(ParseFrameChoice(options), Ring(kTilted), Floor(kTilted));
  EXPECT_NEAR(frame.transform.scale, 5.0 / 3, 1e-9);
  EXPECT_LT(DegreesOff(UpIn(frame), Eigen::Vector3d::UnitZ()), 0.1);
}

// The surface of cells: a slab of air above matter, tilted.
TEST(LevelSurface, TheTopOfASlabIsSampled) {
  const Eigen::Vector3f up = Eigen::Vector3f(0.3f, -0.2f, 1).normalized();
  Model model = MakeModel(RandomSites(6000, 3), 1, [&](const Eigen::Vector3f& p) {
    return p.dot(up) < 0 && p.dot(up) > -0.4f ? 0 : kAir;
  });
  model.world_from_normalized = {2, {1e5, 2e5, 3e5}};
  const ExportableScene scene = MakeExportableScene(model);
  for (const LevelChoice& level : {LevelChoice{LevelBy::kPlane, {}, false},
                                   LevelChoice{LevelBy::kLabels, "mug", false},
                                   LevelChoice{LevelBy::kLabels, "7", false}}) {
    const SurfaceSamples samples = LevelSurface(scene, level);
    EXPECT_GT(samples.points.size(), 300u);
    const std::optional<PlaneFit> fit = FitPlane(samples);
    ASSERT_TRUE(fit);
    const Eigen::Vector3d normal = fit->normal * (fit->normal.z() > 0 ? 1 : -1);
    EXPECT_LT(DegreesOff(normal, up.cast<double>()), 1.5);
  }
  try {
    LevelSurface(scene, {LevelBy::kLabels, "floor", false});
    ADD_FAILURE();
  } catch (const UserError& error) {
    EXPECT_THAT(
        error.what(),
        StartsWith("level: the labels name 'floor', which is no object; the scene has 7 (mug)"));
  }
}

TEST(LevelSurface, TooLittleToLevelByIsOneSentence) {
  int left = 4;
  const Model model = MakeModel(RandomSites(3000, 1), 2, [&](const Eigen::Vector3f& p) {
    if ((p - Eigen::Vector3f(-0.3f, 0, 0)).norm() < 0.3f) return 1;
    return (p - Eigen::Vector3f(0.5f, 0, 0)).norm() < 0.2f && left-- > 0 ? 0 : kAir;
  });
  ExportableSceneOptions options;
  options.components.keep_fragments = true;
  const ExportableScene scene = MakeExportableScene(model, options);
  try {
    LevelSurface(scene, {LevelBy::kLabels, "mug", false});
    ADD_FAILURE();
  } catch (const UserError& error) {
    EXPECT_THAT(error.what(), StartsWith("level is 'mug', of which photos show "));
    EXPECT_THAT(error.what(), HasSubstr("a plane needs 10 or more"));
  }
  EXPECT_THROW(
      LevelSurface(std::vector<Eigen::Vector3d>(5, {0, 0, 0}), {LevelBy::kPlane, {}, false}),
      UserError);
  EXPECT_THROW(
      LevelSurface(std::vector<Eigen::Vector3d>(50, {0, 0, 0}), {LevelBy::kLabels, "mug", false}),
      UserError);
  EXPECT_THROW(
      LevelSurface(std::vector<Eigen::Vector3d>(50, {1, 2, 3}), {LevelBy::kPlane, {}, false}),
      UserError);
}

}  // namespace
}  // namespace semfoam
