// SPDX-License-Identifier: GPL-3.0-or-later
//
// Models as COLMAP's other commands leave them: moved, merged, cut, undistorted. What they mean to
// us must be what they mean to COLMAP.
#include "plugin/colmap/colmap_model.h"
#include "plugin/dataset/training_scene.h"
#include "plugin/photo/photo.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <sstream>

#include "tests/mistake.h"
#include "tests/plugin/colmap/colmap_program.h"
#include "tests/plugin/colmap/reprojection.h"
#include "tests/plugin/test_util.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector2d;
using Eigen::Vector3d;
using testing::HasSubstr;

const fs::path kTabletop = fs::path(SEMFOAM_TEST_DATA) / "tabletop";

Reconstruction Tabletop() { return ReadReconstruction(kTabletop / "sparse/0"); }

ScenePlan PlanOf(const fs::path& model) {
  SceneOptions options;
  options.image_path = kTabletop / "images";
  options.input_path = model;
  options.use_masks = false;
  return PlanScene(options);
}

std::map<std::string, Vector3d> Centers(const Reconstruction& model) {
  std::map<std::string, Vector3d> centers;
  for (const Image& image : model.images) centers[image.name] = image.cam_from_world.Center();
  return centers;
}

// The images with these indices, and the points that two or more of them see.
Reconstruction Part(const Reconstruction& whole, size_t first, size_t last) {
  Reconstruction part;
  part.cameras = whole.cameras;
  part.images.assign(whole.images.begin() + first, whole.images.begin() + last);
  std::set<uint32_t> images;
  for (const Image& image : part.images) images.insert(image.id);
  std::set<uint64_t> points;
  for (Point3D point : whole.points) {
    std::erase_if(point.track, [&](const auto& e) { return !images.contains(e.image_id); });
    if (point.track.size() < 2) continue;
    points.insert(point.id);
    part.points.push_back(point);
  }
  for (Image& image : part.images) {
    for (Point2D& point : image.points) {
      if (!points.contains(point.point3d_id)) point.point3d_id = kNoPoint3D;
    }
  }
  return part;
}

// By which the axes change their places: x becomes y, y z and z x.
Eigen::Matrix3d AxesTurned() {
  Eigen::Matrix3d rotation;
  rotation << 0, 0, 1, 1, 0, 0, 0, 1, 0;
  return rotation;
}

TEST(ColmapTools, MovedModelsAreTheSameSceneElsewhere) {
  const TempFolder temp;
  const double scale = 2.5;
  const Vector3d shift(10, 20, 30);
  WriteColmapTransform(temp, {scale, AxesTurned(), shift}, temp / "transform.txt");
  RunColmap(temp,
            "model_transformer",
            kTabletop / "sparse/0",
            temp / "moved",
            "--transform_path '" + (temp / "transform.txt").string() + "'");
  const Reconstruction model = Tabletop();
  const Reconstruction moved = ReadReconstruction(temp / "moved");
  ASSERT_EQ(moved.images.size(), 64u);
  ASSERT_EQ(moved.points.size(), model.points.size());
  EXPECT_NEAR(MeanReprojectionError(moved), MeanReprojectionError(model), 1e-9);

  // In the normalised frame nothing has changed but the directions of the axes.
  const auto turned = [](const Vector3d& x) { return Vector3d(x.z(), x.x(), x.y()); };
  const ScenePlan before = PlanOf(kTabletop / "sparse/0");
  const ScenePlan after = PlanOf(temp / "moved");
  for (size_t i = 0; i < before.photos.size(); ++i) {
    ASSERT_EQ(before.photos[i].name, after.photos[i].name);
    const Vector3d center = PoseOf(before.photos[i]).Center();
    const Vector3d now = PoseOf(after.photos[i]).Center();
    EXPECT_LT((scale * turned(center) + shift - now).norm(), 1e-9);
    EXPECT_LT((turned(before.world_from_normalized.Invert(center)) -
               after.world_from_normalized.Invert(now))
                  .norm(),
              1e-9);
  }
  ASSERT_EQ(before.seeds.size(), after.seeds.size());
  for (size_t i = 0; i < before.seeds.size(); ++i) {
    const Vector3d seed = before.seeds[i].position.cast<double>();
    EXPECT_LT((turned(seed) - after.seeds[i].position.cast<double>()).norm(),
              1e-5 * (1 + seed.norm()));
  }
}

// The commands that put a model upright or where it was measured move it rigidly or by a
// similarity.
TEST(ColmapTools, AlignedModelsAreSeenAsBefore) {
  const TempFolder temp;
  const Reconstruction model = Tabletop();
  const double error = MeanReprojectionError(model);
  RunColmap(temp,
            "model_orientation_aligner",
            kTabletop / "sparse/0",
            temp / "upright",
            "--method IMAGE-ORIENTATION --image_path '" + (kTabletop / "images").string() + "'");
  const Reconstruction upright = ReadReconstruction(temp / "upright");
  EXPECT_NEAR(MeanReprojectionError(upright), error, 1e-6);
  const auto before = Centers(model);
  const auto after = Centers(upright);
  EXPECT_GT((before.at("0000.jpg") - after.at("0000.jpg")).norm(), 0.1);  // it did turn it
  EXPECT_NEAR((before.at("0000.jpg") - before.at("0040.jpg")).norm(),
              (after.at("0000.jpg") - after.at("0040.jpg")).norm(),
              1e-9);

  std::string measured;
  const auto place = [](const Vector3d& x) {
    return Vector3d(4e5 + 3 * x.x(), 5e6 + 3 * x.y(), 3 * x.z());
  };
  for (const auto& [name, center] : before) {
    std::ostringstream line;
    line.precision(12);
    line << name << " " << place(center).transpose() << "\n";
    measured += line.str();
  }
  WriteFile(temp / "measured.txt", measured);
  RunColmap(temp,
            "model_aligner",
            kTabletop / "sparse/0",
            temp / "aligned",
            "--ref_is_gps 0 " + MaxErrorOption(temp) + " 1 --ref_images_path '" +
                (temp / "measured.txt").string() + "'");
  const Reconstruction aligned = ReadReconstruction(temp / "aligned");
  EXPECT_NEAR(MeanReprojectionError(aligned), error, 1e-4);
  for (const auto& [name, center] : Centers(aligned)) {
    EXPECT_LT((center - place(before.at(name))).norm(), 0.01) << name;
  }
}

TEST(ColmapTools, MergedModelsAreOneScene) {
  const TempFolder temp;
  const Reconstruction model = Tabletop();
  WriteReconstruction(temp / "first", Part(model, 0, 40), ModelFormat::kBinary);
  WriteReconstruction(temp / "other", Part(model, 24, 64), ModelFormat::kText);
  const Sim3 second_from_first{3, AxesTurned(), {1, 2, 3}};
  WriteColmapTransform(temp, second_from_first, temp / "transform.txt");
  RunColmap(temp,
            "model_transformer",
            temp / "other",
            temp / "second",
            "--transform_path '" + (temp / "transform.txt").string() + "'");
  fs::create_directories(temp / "merged");
  RunColmap(temp,
            "model_merger --input_path1 '" + (temp / "first").string() + "' --input_path2 '" +
                (temp / "second").string() + "' --output_path '" + (temp / "merged").string() +
                "'");
  const Reconstruction merged = ReadReconstruction(temp / "merged");
  EXPECT_EQ(merged.images.size(), 64u);
  EXPECT_GT(merged.points.size(), 5000u);
  EXPECT_LT(MeanReprojectionError(merged), 1);
  // COLMAP 3.8 merges into the frame of the first model, 3.10 into that of the second.
  const bool is_new = ColmapIsNew(temp);
  const auto before = Centers(model);
  for (const auto& [name, center] : Centers(merged)) {
    const Vector3d& first = before.at(name);
    const Vector3d expected = is_new ? second_from_first.Apply(first) : first;
    EXPECT_LT((center - expected).norm(), is_new ? 3e-4 : 1e-4) << name;
  }
  EXPECT_EQ(PlanOf(temp / "merged").photos.size(), 64u);
}

// Commands that take something out of a model or only touch it up.
TEST(ColmapTools, WhatOtherCommandsLeaveIsRead) {
  const TempFolder temp;
  const std::string images = "--image_path '" + (kTabletop / "images").string() + "'";
  WriteFile(temp / "names.txt", "0003.jpg\n0041.jpg\n");
  const std::string names = "--image_names_path '" + (temp / "names.txt").string() + "'";
  struct Case {
    std::string command, options, folder;
    size_t num_images;
  };
  const std::vector<Case> cases = {
      {"point_filtering", "--max_reproj_error 1", "", 64},
      {"color_extractor", images, "", 64},
      {"image_deleter", names, "", 62},
      {"image_filterer", "", "", 64},
      {"model_cropper", "--boundary -1,-1,-1,1,1,2", "", 64},
      {"model_splitter", "--split_type parts --split_params 1,1,1", "0", 64},
      {"bundle_adjuster", "--BundleAdjustment.max_num_iterations 5", "", 64},
  };
  for (const Case& step : cases) {
    SCOPED_TRACE(step.command);
    const fs::path out = temp / step.command;
    RunColmap(temp, step.command, kTabletop / "sparse/0", out, step.options);
    const Reconstruction model = ReadReconstruction(out / step.folder);
    EXPECT_EQ(model.images.size(), step.num_images);
    EXPECT_GT(model.points.size(), 500u);
    EXPECT_LT(MeanReprojectionError(model), 1);
    const ScenePlan plan = PlanOf(out / step.folder);
    EXPECT_EQ(plan.photos.size(), step.num_images);
    EXPECT_EQ(plan.num_unregistered, static_cast<int>(64 - step.num_images));
    EXPECT_GT(plan.seeds.size(), 500u);
  }
}

// The mean difference, in steps of 8 bits, between what two photos show in the directions of the
// first one's pixels, read from the second `shift` pixels off.
double ColourDifference(const TrainingScene& a, const TrainingScene& b, int view, double shift) {
  const Camera camera = CameraOf(b.Photos()[view], "b");
  const Eigen::Matrix3d cam_from_world = PoseOf(a.Photos()[view]).UnitRotation().toRotationMatrix();
  const Image8& photo = b.Photo(view);
  double sum = 0;
  int count = 0;
  for (int y = 0; y < a.Height(view); ++y) {
    for (int x = 0; x < a.Width(view); ++x) {
      TrainingRay ray;
      if (!a.Ray(view, x, y, &ray)) continue;
      const auto pixel = Project(camera, cam_from_world * ray.direction.cast<double>());
      if (!pixel) continue;
      const double px = pixel->x() - 0.5 + shift, py = pixel->y() - 0.5 + shift;
      const int left = static_cast<int>(std::floor(px)), top = static_cast<int>(std::floor(py));
      if (left < 0 || top < 0 || left + 1 >= photo.width || top + 1 >= photo.height) continue;
      const auto green = [&](int dx, int dy) {
        return photo.data[3 * ((top + dy) * photo.width + left + dx) + 1];
      };
      const double u = px - left, v = py - top;
      sum += std::abs((1 - v) * ((1 - u) * green(0, 0) + u * green(1, 0)) +
                      v * ((1 - u) * green(0, 1) + u * green(1, 1)) - 255 * ray.color.y());
      ++count;
    }
  }
  EXPECT_GT(count, 10000);
  return sum / count;
}

// A workspace of image_undistorter is a workspace: its pinhole rays see in its photos what the
// distorted rays see in the originals. COLMAP takes the pixels as they are stored, whatever EXIF
// says of turning them.
TEST(ColmapTools, UndistortedWorkspacesShowTheSame) {
  const std::vector<Camera> lenses = {
      {1, FindCameraModel("SIMPLE_RADIAL")->id, 320, 240, {266.7, 160, 120, -0.2}},
      {1,
       FindCameraModel("OPENCV")->id,
       320,
       240,
       {266.7, 270, 157, 122, -0.25, 0.08, 0.004, -0.003}},
      {1, FindCameraModel("OPENCV_FISHEYE")->id, 320, 240, {200, 201, 160, 121, 0.02, 0.01, 0, 0}},
  };
  for (const Camera& lens : lenses) {
    SCOPED_TRACE(FindCameraModel(lens.model_id)->name);
    const TempFolder temp;
    Reconstruction model = Part(Tabletop(), 0, 4);
    const uint32_t camera_id = model.cameras[0].id;
    model.cameras = {lens};
    model.cameras[0].id = camera_id;
    for (Image& image : model.images) {
      const std::string bytes = ReadFile(kTabletop / "images" / image.name);
      image.name = "sub folder/" + image.name;
      WriteFile(temp / "images" / image.name, &image == &model.images[1] ? Turned(bytes) : bytes);
    }
    WriteReconstruction(temp / "sparse", model, ModelFormat::kBinary);
    RunColmap(temp,
              "image_undistorter",
              temp / "sparse",
              temp / "dense",
              "--output_type COLMAP --image_path '" + (temp / "images").string() + "'");
    SceneOptions distorted;
    distorted.image_path = temp / "images";
    distorted.input_path = temp.path();
    SceneOptions undistorted;
    undistorted.image_path = temp / "dense/images";
    undistorted.input_path = temp / "dense";
    const TrainingScene a(PlanScene(distorted));
    const TrainingScene b(PlanScene(undistorted));
    ASSERT_EQ(b.NumViews(), 4);
    EXPECT_EQ(b.Photos()[0].camera_model, "PINHOLE");
    EXPECT_EQ(a.Plan().num_rescaled + b.Plan().num_rescaled, 0);
    for (int view = 0; view < 4; ++view) {
      ASSERT_EQ(a.Photos()[view].name, b.Photos()[view].name);
      const double right = ColourDifference(a, b, view, 0);
      EXPECT_LT(right, 4) << view;
      // Half a pixel is the mistake to be afraid of.
      for (const double shift : {-0.5, 0.5}) {
        EXPECT_GT(ColourDifference(a, b, view, shift), 1.1 * right) << view;
      }
    }
  }
}

// What its other output types leave has no COLMAP model in it.
TEST(ColmapTools, WorkspacesForOtherProgramsAreNamed) {
  const TempFolder temp;
  RunColmap(temp,
            "image_undistorter",
            kTabletop / "sparse/0",
            temp / "pmvs",
            "--output_type PMVS --image_path '" + (kTabletop / "images").string() + "'");
  EXPECT_THAT(UserErrorOf([&] { FindModelFolder(temp / "pmvs"); }),
              NamesMistake("pmvs", {"cameras", "images", "points3D"}, "holds no COLMAP model"));
}

}  // namespace
}  // namespace semfoam
