// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/dataset/scene_warnings.h"

#include <numbers>

#include "tests/mistake.h"
#include "tests/plugin/test_util.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

const fs::path kTabletopModel = fs::path(SEMFOAM_TEST_DATA) / "tabletop/sparse/0";

constexpr char kAlone[] = "this one alone is used";

// A model of so many photos, which are all that is asked of it.
void WriteModelOf(const fs::path& folder, int num_images, ModelFormat format) {
  Reconstruction model = ReadReconstruction(kTabletopModel);
  model.images.resize(num_images);
  model.points.clear();
  for (Image& image : model.images) image.points.clear();
  WriteReconstruction(folder, model, format);
}

TEST(SceneWarningsOtherModels, AreNamedWhereOneWasFoundAndNotChosen) {
  const TempFolder temp;
  const fs::path sparse = temp / "sparse";
  WriteModelOf(sparse / "0", 20, ModelFormat::kBinary);
  EXPECT_EQ(OtherModelsWarning(sparse, sparse / "0", 20), "");
  WriteModelOf(sparse / "1", 7, ModelFormat::kBinary);
  WriteModelOf(sparse / "10", 1, ModelFormat::kText);
  WriteModelOf(sparse / "old", 30, ModelFormat::kBinary);
  WriteModelOf(sparse / "4", 0, ModelFormat::kBinary);
  fs::create_directories(sparse / "5");
  WriteFile(sparse / "6/cameras.bin", "damaged");
  for (const char* stem : {"cameras", "images", "points3D"}) {
    WriteFile(sparse / "7" / (std::string(stem) + ".bin"), std::string(8, '\xff'));
  }
  const std::string used = (sparse / "0").string();
  EXPECT_THAT(
      OtherModelsWarning(sparse, used, 20),
      NamesMistake(used, {"20 photos", "1 (7 photos)", "10 (1 photo)", "input_path"}, kAlone));
  EXPECT_EQ(OtherModelsWarning(temp.path(), sparse / "0", 20),
            OtherModelsWarning(sparse, sparse / "0", 20));
  // The user has chosen.
  EXPECT_EQ(OtherModelsWarning(sparse / "0", sparse / "0", 20), "");
  EXPECT_EQ(OtherModelsWarning(sparse / "0/", sparse / "0/", 20), "");
  EXPECT_EQ(OtherModelsWarning(sparse / "old", sparse / "old", 30), "");
}

TEST(SceneWarningsOtherModels, ThatAreAsLargeAreNamedInAnyCase) {
  const TempFolder temp;
  const fs::path sparse = temp / "sparse";
  WriteModelOf(sparse / "0", 20, ModelFormat::kBinary);
  WriteModelOf(sparse / "1", 20, ModelFormat::kText);
  WriteModelOf(sparse / "2", 3, ModelFormat::kText);
  const std::string used = (sparse / "0").string();
  EXPECT_THAT(OtherModelsWarning(sparse, used, 20),
              NamesMistake(used,
                           {"20 photos",
                            "1 (20 photos)",
                            "2 (3 photos)",
                            "input_path " + (sparse / "1").string(),
                            "as many photos"},
                           kAlone));
  WriteModelOf(sparse / "3", 21, ModelFormat::kBinary);
  EXPECT_THAT(OtherModelsWarning(used, used, 20),
              NamesMistake(used,
                           {"20 photos",
                            "1 (20 photos)",
                            "3 (21 photos)",
                            "input_path " + (sparse / "3").string(),
                            "more photos"},
                           kAlone));
}

TEST(SceneWarningsUnregistered, PhotosAreToldOfWhereTheyAreMany) {
  EXPECT_EQ(UnregisteredWarning("W/images", 16, 64), "");
  EXPECT_THAT(UnregisteredWarning("W/images", 54, 64),
              NamesMistake("W/images", {"54 of its 118 photos", "sparse/"}, "not in the model"));
}

// Poses turned around their cameras by so many degrees, each another way.
Reconstruction Perturbed(Reconstruction model, double degrees) {
  for (size_t i = 0; i < model.images.size(); ++i) {
    Pose& pose = model.images[i].cam_from_world;
    const double way = 2.4 * static_cast<double>(i);
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(
        degrees * std::numbers::pi / 180, Eigen::Vector3d(std::cos(way), std::sin(way), 0)));
    pose.rotation = (turn * pose.rotation).normalized();
    pose.translation = turn * pose.translation;
  }
  return model;
}

// The same, as photos of another size would have made it.
Reconstruction Scaled(Reconstruction model, double factor) {
  for (Camera& camera : model.cameras) {
    camera = RescaledCamera(camera,
                            static_cast<uint64_t>(factor * static_cast<double>(camera.width)),
                            static_cast<uint64_t>(factor * static_cast<double>(camera.height)));
  }
  for (Image& image : model.images) {
    for (Point2D& point : image.points) {
      point.x *= factor;
      point.y *= factor;
    }
  }
  return model;
}

TEST(SceneWarningsReprojection, ErrorsOfPosesThatAreOffAreToldOf) {
  const Reconstruction model = ReadReconstruction(kTabletopModel);
  EXPECT_EQ(ReprojectionWarning("M", model), "");
  for (const double factor : {0.5, 1.0, 4.0, 12.0}) {
    EXPECT_EQ(ReprojectionWarning("M", Scaled(Perturbed(model, 0.02), factor)), "") << factor;
    EXPECT_THAT(ReprojectionWarning("M", Scaled(Perturbed(model, 1), factor)),
                HasSubstr("its poses do not fit its points"))
        << factor;
  }
  const std::string warning = ReprojectionWarning("M", Perturbed(model, 1));
  EXPECT_THAT(warning, NamesMistake("M", {"poses", "points"}, "do not fit"));
  EXPECT_THAT(warning, testing::ContainsRegex("[4-7]\\.[0-9] pixels \\([0-9.]+ % of the photo\\)"));
  EXPECT_THAT(ReprojectionWarning("M", Perturbed(model, 180)),
              HasSubstr("half of these are seen far from where the poses put them"));
}

TEST(SceneWarningsReprojection, OfModelsWithoutTracksIsNotAsked) {
  Reconstruction model = Perturbed(ReadReconstruction(kTabletopModel), 5);
  for (Point3D& point : model.points) point.track.clear();
  EXPECT_EQ(ReprojectionWarning("M", model), "");
  // Indices of other programs, which need not be right.
  model.points[0].track.assign(100, {model.images[0].id, 1'000'000});
  model.points[1].track.assign(100, {4'000'000, 0});
  EXPECT_EQ(ReprojectionWarning("M", model), "");
}

}  // namespace
}  // namespace semfoam
