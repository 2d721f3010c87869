// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/photometric/pose_refinement.h"

#include "foam/train/checkpoint_state.h"
#include "foam/util/parallel.h"
#include "foam/util/random.h"

#include <cmath>
#include <filesystem>
#include <vector>

#include "tests/plugin/colmap/small_model.h"
#include "tests/plugin/photometric/disturbed_poses.h"
#include "tests/plugin/test_util.h"
#include <ceres/jet.h>
#include <ceres/rotation.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

const fs::path kTabletop = fs::path(SEMFOAM_TEST_DATA) / "tabletop";
constexpr double kDegree = 3.14159265358979323846 / 180;

SceneOptions OptionsFor(const fs::path& workspace) {
  SceneOptions options;
  options.image_path = kTabletop / "images";
  options.input_path = workspace / "sparse/0";
  options.test_every = 8;
  options.use_masks = false;
  return options;
}

CameraMotion RandomMotion(uint64_t number, double angle, double shift) {
  CounterRandom random(7, 0x6d6f74, number);
  CameraMotion motion;
  for (int i = 0; i < 6; ++i) motion[i] = random.Normal() * (i < 3 ? angle : shift);
  return motion;
}

Camera SmallCamera() {
  Camera camera;
  camera.model_id = 2;
  camera.width = 160;
  camera.height = 120;
  camera.params = {140, 80, 60, -0.05};
  return camera;
}

// The tabletop's cameras, those that are not held out turned and moved at random.
struct Disturbed {
  Disturbed() : folder(), scene(Plan(folder)) {}
  static ScenePlan Plan(const TempFolder& folder) {
    WriteDisturbedModel(kTabletop / "sparse/0", folder / "sparse/0", 8);
    return PlanScene(OptionsFor(folder / ""));
  }

  // Returns the median angle to the true poses in degrees, and distance in percent of the extent.
  std::pair<double, double> Errors() const {
    static const TrainingScene truth(PlanScene(OptionsFor(kTabletop)));
    const Similarity& frame = truth.WorldFromNormalized();
    std::vector<double> angles, shifts;
    for (int view = 0; view < scene.NumViews(); ++view) {
      if (scene.IsHeldOut(view)) continue;
      const CameraPlacement a = PlacementOf(PoseOf(truth.Photos()[view]), frame);
      const CameraPlacement b = PlacementOf(PoseOf(scene.Photos()[view]), frame);
      angles.push_back(AngleBetween(a, b) / kDegree);
      shifts.push_back(100 * (a.center - b.center).norm());
    }
    std::sort(angles.begin(), angles.end());
    std::sort(shifts.begin(), shifts.end());
    return {angles[angles.size() / 2], shifts[shifts.size() / 2]};
  }

  TempFolder folder;
  TrainingScene scene;
};

TEST(PixelFrame, TellsWhereTheCameraSeesAPoint) {
  const Camera camera = SmallCamera();
  for (const Eigen::Vector2d& pixel : {Eigen::Vector2d(80, 60), Eigen::Vector2d(12.5, 100)}) {
    const auto frame = PixelFrameAt(camera, pixel);
    ASSERT_TRUE(frame);
    for (const Eigen::Vector2d& offset : {Eigen::Vector2d(0, 0), Eigen::Vector2d(1.5, -1)}) {
      const Eigen::Vector3d point = 3.7 * *Unproject(camera, pixel + offset);
      EXPECT_LT((frame->OffsetOf(point) - offset).norm(), 0.01);
    }
  }
}

TEST(OffsetByMotion, IsTheDerivative) {
  const CameraPlacement placement = Moved({}, RandomMotion(1, 1, 0.5));
  const PixelFrame frame = *PixelFrameAt(SmallCamera(), {30, 90});
  const Eigen::Vector3d point =
      placement.center +
      2 * (placement.world_from_cam * (frame.direction + Eigen::Vector3d(0.01, 0.02, 0)));
  const Eigen::Matrix<double, 2, 6> slope = OffsetByMotion(frame, placement, point);

  using Jet = ceres::Jet<double, 6>;
  Jet back[3], from_center[3], turned[3];
  for (int a = 0; a < 3; ++a) {
    back[a] = -Jet(0, a);
    from_center[a] = Jet(point[a] - placement.center[a]) - Jet(0, 3 + a);
  }
  ceres::AngleAxisRotatePoint(back, from_center, turned);
  const Eigen::Matrix<Jet, 3, 1> seen =
      placement.world_from_cam.transpose().cast<Jet>() * Eigen::Matrix<Jet, 3, 1>(turned);
  const Eigen::Matrix<Jet, 2, 1> offset = frame.OffsetOf(seen);
  for (int row = 0; row < 2; ++row) {
    EXPECT_LT((slope.row(row).transpose() - offset[row].v).norm(), 1e-9 * slope.norm());
  }

  for (int i = 0; i < 6; ++i) {
    const auto offset_at = [&](double step) {
      const CameraPlacement moved = Moved(placement, step * CameraMotion::Unit(i));
      return frame.OffsetOf<double>(moved.world_from_cam.transpose() * (point - moved.center));
    };
    const Eigen::Vector2d difference = (offset_at(1e-5) - offset_at(-1e-5)) / 2e-5;
    EXPECT_LT((slope.col(i) - difference).norm(), 1e-6 * slope.norm()) << i;
  }
}

TEST(SamplePatch, HasTheSlopeOfItsColour) {
  PhotoPatch patch;
  CounterRandom random(2, 0x70, 0);
  for (auto& channel : patch.values) {
    for (auto& row : channel) {
      for (float& value : row) value = static_cast<float>(random.Uniform());
    }
  }
  const Eigen::Vector2d offset(0.7, -1.3);
  const PatchSample sample = SamplePatch(patch, offset, 1.2);
  // The same in double, as a Jet.
  using Jet = ceres::Jet<double, 2>;
  const Jet x(offset.x(), 0), y(offset.y(), 1);
  for (int c = 0; c < 3; ++c) {
    Jet sum(0), weights(0);
    for (int row = 0; row < kPatchEdge; ++row) {
      for (int column = 0; column < kPatchEdge; ++column) {
        const Jet dx = double(column - kPatchRadius) - x, dy = double(row - kPatchRadius) - y;
        const Jet weight = exp(-(dx * dx + dy * dy) / (2 * 1.2 * 1.2));
        sum += weight * double(patch.values[c][row][column]);
        weights += weight;
      }
    }
    const Jet mean = sum / weights;
    // The samples are float.
    EXPECT_NEAR(sample.color[c], mean.a, 1e-6);
    EXPECT_NEAR(sample.slope(c, 0), mean.v[0], 1e-6);
    EXPECT_NEAR(sample.slope(c, 1), mean.v[1], 1e-6);
    for (int axis = 0; axis < 2; ++axis) {
      const Eigen::Vector2d step = 0.01 * Eigen::Vector2d::Unit(axis);
      const double after = SamplePatch(patch, offset + step, 1.2).color[c];
      const double before = SamplePatch(patch, offset - step, 1.2).color[c];
      EXPECT_NEAR(sample.slope(c, axis), (after - before) / 0.02, 1e-4);
    }
  }
}

TEST(RemoveDrift, TakesOutASimilarityAndNothingElse) {
  std::vector<CameraPlacement> reference, placements;
  const Eigen::AngleAxisd turn(0.01, Eigen::Vector3d(1, 2, -1).normalized());
  for (int i = 0; i < 12; ++i) {
    reference.push_back(Moved({}, RandomMotion(i, 1, 1)));
    placements.push_back({turn * reference[i].world_from_cam,
                          1.02 * (turn * reference[i].center) + Eigen::Vector3d(0.1, 0, -0.05)});
  }
  RemoveDrift(reference, &placements);
  for (int i = 0; i < 12; ++i) {
    EXPECT_LT(AngleBetween(reference[i], placements[i]), 1e-6);
    EXPECT_LT((reference[i].center - placements[i].center).norm(), 1e-5);
  }
  // One camera alone that has moved stays away from where it was.
  placements[3] = Moved(placements[3], RandomMotion(50, 0.02, 0.02));
  RemoveDrift(reference, &placements);
  EXPECT_GT(AngleBetween(reference[3], placements[3]), 0.01);
}

TEST(AlignPhoto, FindsTheCameraOfAPhoto) {
  // A relief that two cameras see.
  const Camera camera = SmallCamera();
  const auto color_at = [](const Eigen::Vector3d& point) {
    Eigen::Vector3d color;
    for (int c = 0; c < 3; ++c) {
      color[c] = 0.5 + 0.2 * std::sin(23 * point.x() + 2 * c) + 0.2 * std::sin(31 * point.y() - c);
    }
    return color;
  };
  // The surface z = 2 + 0.3 sin(3 x) + 0.3 sin(2 y).
  const auto surface_at = [&](const CameraPlacement& placement, const Eigen::Vector2d& pixel) {
    const Eigen::Vector3d direction = placement.world_from_cam * *Unproject(camera, pixel);
    double distance = 2;
    for (int step = 0; step < 30; ++step) {
      const Eigen::Vector3d x = placement.center + distance * direction;
      distance += 2 + 0.3 * std::sin(3 * x.x()) + 0.3 * std::sin(2 * x.y()) - x.z();
    }
    return Eigen::Vector3d(placement.center + distance * direction);
  };
  const CameraPlacement truth;
  const CameraPlacement start = Moved(truth, RandomMotion(3, 0.2 * kDegree, 0.002));
  std::vector<AlignedPixel> pixels;
  for (int y = 6; y < 114; y += 3) {
    for (int x = 6; x < 154; x += 3) {
      AlignedPixel& pixel = pixels.emplace_back();
      pixel.frame = *PixelFrameAt(camera, {x + 0.5, y + 0.5});
      pixel.point = surface_at(start, {x + 0.5, y + 0.5});
      pixel.render = color_at(pixel.point);
      // Something passes by in the photo.
      const bool is_spoiled = (x / 3 + y / 3) % 7 == 0;
      for (int row = 0; row < kPatchEdge; ++row) {
        for (int column = 0; column < kPatchEdge; ++column) {
          const Eigen::Vector2d place(x + column - kPatchRadius + 0.5,
                                      y + row - kPatchRadius + 0.5);
          const Eigen::Vector3d color =
              is_spoiled ? Eigen::Vector3d(0.9, 0.9, 0.1)
                         : Eigen::Vector3d(0.95 * color_at(surface_at(truth, place)));
          for (int c = 0; c < 3; ++c) pixel.photo.values[c][row][column] = float(color[c]);
        }
      }
      pixel.half = (x / 12 + y / 12) % 2;
    }
  }
  const PhotoAlignment alignment = AlignPhoto(pixels, start, -1, true);
  EXPECT_LT(AngleBetween(alignment.placement, truth), 0.1 * AngleBetween(start, truth));
  EXPECT_LT((alignment.placement.center - truth.center).norm(), 0.15 * start.center.norm());
  // A Gaussian takes some of the contrast.
  EXPECT_NEAR(alignment.gain.mean(), 0.95, 0.05);
  const PhotoAlignment still = AlignPhoto(pixels, start, 0, false);
  EXPECT_EQ(still.placement.center, start.center);
  EXPECT_LT(AlignmentError(pixels, AlignPhoto(pixels, start, 0, true), 1),
            0.7 * AlignmentError(pixels, still, 1));
}

TEST(AlignPhoto, StaysWithoutPixels) {
  const CameraPlacement start = Moved({}, RandomMotion(4, 1, 1));
  const PhotoAlignment alignment = AlignPhoto({}, start, -1, true);
  EXPECT_EQ(alignment.placement.center, start.center);
  EXPECT_EQ(alignment.gain, Eigen::Vector3d::Ones());
}

TEST(PoseRefiner, LeavesPosesThatFitTheTracks) {
  TrainingScene scene(PlanScene(OptionsFor(kTabletop)));
  const std::vector<PhotoRecord> before = scene.Photos();
  PoseRefiner refiner(&scene, EffectSwitch::kAuto);
  refiner.RefineByTracks();
  EXPECT_FALSE(refiner.IsOn()) << refiner.Report();
  EXPECT_THAT(refiner.Report(), HasSubstr("stay as they are"));
  const Effect effect = refiner.MakeEffect();
  EXPECT_FALSE(effect.on);
  EXPECT_FALSE(effect.by_option);
  EXPECT_LT(effect.measures.at("track_gain"), 0.02);
  EXPECT_GT(effect.measures.at("tracks"), 1000);
  for (int view = 0; view < scene.NumViews(); ++view) {
    EXPECT_EQ(scene.Photos()[view].cam_from_world_translation,
              before[view].cam_from_world_translation);
  }
}

TEST(PoseRefiner, BringsDisturbedPosesBackByTheTracks) {
  Disturbed disturbed;
  const auto [angle, shift] = disturbed.Errors();
  EXPECT_GT(angle, 0.15);
  EXPECT_GT(shift, 0.15);
  const std::vector<PhotoRecord> before = disturbed.scene.Photos();
  PoseRefiner off(&disturbed.scene, EffectSwitch::kOff);
  off.RefineByTracks();
  EXPECT_FALSE(off.IsOn());
  EXPECT_FALSE(off.IsLooking());
  EXPECT_EQ(disturbed.Errors().first, angle);

  PoseRefiner refiner(&disturbed.scene, EffectSwitch::kAuto);
  refiner.RefineByTracks();
  EXPECT_TRUE(refiner.IsOn()) << refiner.Report();
  const auto [angle_after, shift_after] = disturbed.Errors();
  EXPECT_LT(angle_after, 0.3 * angle);
  EXPECT_LT(shift_after, 0.6 * shift);
  const Effect effect = refiner.MakeEffect();
  EXPECT_GT(effect.measures.at("track_gain"), 0.4);
  EXPECT_NEAR(effect.measures.at("median_degrees"), angle, 0.5 * angle);
  EXPECT_NEAR(100 * effect.measures.at("median_shift"), shift, 0.5 * shift);
  // Held-out photos stay, to the bit.
  for (int view = 0; view < disturbed.scene.NumViews(); ++view) {
    if (!disturbed.scene.IsHeldOut(view)) continue;
    const PhotoRecord& after = disturbed.scene.Photos()[view];
    EXPECT_EQ(after.cam_from_world_translation, before[view].cam_from_world_translation);
    EXPECT_EQ(after.cam_from_world_rotation.coeffs(),
              before[view].cam_from_world_rotation.coeffs());
  }
}

TEST(PoseRefiner, GivesTheSameOnAnyThreadsAndFromACheckpoint) {
  std::vector<Pose> first;
  const auto expect_same = [&](const std::vector<Pose>& poses) {
    ASSERT_EQ(poses.size(), first.size());
    for (size_t i = 0; i < poses.size(); ++i) {
      EXPECT_EQ(poses[i].translation, first[i].translation);
      EXPECT_EQ(poses[i].rotation.coeffs(), first[i].rotation.coeffs());
    }
  };
  const auto rendered = [](const std::vector<ViewPixel>& pixels) {
    std::vector<RenderedRay> rays(pixels.size());
    for (size_t i = 0; i < pixels.size(); ++i) {
      const auto& [view, x, y] = pixels[i];
      rays[i].color = Eigen::Vector3f(float(x) / 320, float(y) / 240, float(view) / 64);
      rays[i].opacity = 1;
      rays[i].distance = 1.5f + 0.001f * float(x);
    }
    return rays;
  };
  for (const int threads : {1, 2, 5}) {
    const ThreadLimit limit(threads);
    Disturbed disturbed;
    PoseRefiner refiner(&disturbed.scene, EffectSwitch::kOn);
    refiner.RefineByTracks();
    EXPECT_TRUE(refiner.IsLooking());
    refiner.Refine(CompareViews(disturbed.scene, 20'000, rendered));
    EXPECT_TRUE(refiner.IsDecided());
    if (first.empty()) first = refiner.poses();
    expect_same(refiner.poses());
    if (threads < 5) continue;

    CheckpointContents contents;
    StateWriter writer("poses", &contents);
    refiner.Serialize(&writer);
    const fs::path path = disturbed.folder / "poses.checkpoint";
    WriteCheckpoint(path, contents);
    const Checkpoint checkpoint(path);
    Disturbed again;
    PoseRefiner resumed(&again.scene, EffectSwitch::kOn);
    resumed.RefineByTracks();
    StateReader reader("poses", checkpoint);
    resumed.Serialize(&reader);
    resumed.Restore();
    expect_same(resumed.poses());
    EXPECT_EQ(again.Errors(), disturbed.Errors());
    EXPECT_EQ(resumed.Report(), refiner.Report());
  }
}

TEST(WriteRefinedModel, ChangesPosesAlone) {
  for (const bool with_rigs : {false, true}) {
    Reconstruction model = SmallModel(with_rigs);
    if (with_rigs) {
      for (Rig& rig : *model.rigs) rig.others.clear();
    }
    for (const ModelFormat format : {ModelFormat::kBinary, ModelFormat::kText}) {
      TempFolder folder;
      Reconstruction given = model;
      if (with_rigs) {
        // A rig with one sensor for each camera.
        given.rigs->clear();
        given.frames->clear();
        for (const Camera& camera : given.cameras) {
          given.rigs->push_back({camera.id, Sensor{SensorType::kCamera, camera.id}, {}});
        }
        for (const Image& image : given.images) {
          given.frames->push_back({image.id,
                                   image.camera_id,
                                   image.cam_from_world,
                                   {{Sensor{SensorType::kCamera, image.camera_id}, image.id}}});
        }
      }
      WriteReconstruction(folder / "in", given, format);
      std::vector<PhotoRecord> photos(2);
      photos[0].name = given.images[1].name;
      photos[0].cam_from_world_translation = {1, 2, 3};
      photos[1].name = given.images[2].name;
      photos[1].held_out = true;
      WriteRefinedModel(folder / "in", photos, folder / "out");
      EXPECT_EQ(FindModelFormat(folder / "out"), format);
      given.images[1].cam_from_world = {Eigen::Quaterniond::Identity(), {1, 2, 3}};
      if (with_rigs) given.frames->at(1).rig_from_world = given.images[1].cam_from_world;
      WriteReconstruction(folder / "expected", given, format);
      for (const auto& entry : fs::directory_iterator(folder / "expected")) {
        const fs::path name = entry.path().filename();
        EXPECT_TRUE(ReadFile(folder / "out" / name) == ReadFile(entry.path())) << name;
      }
    }
  }
}

}  // namespace
}  // namespace semfoam
