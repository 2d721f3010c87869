// SPDX-License-Identifier: GPL-3.0-or-later
// The real colmap program reads what we write and writes what we read.
#include "plugin/colmap/camera_models.h"
#include "plugin/colmap/colmap_model.h"

#include <algorithm>

#include "tests/plugin/colmap/colmap_program.h"
#include "tests/plugin/colmap/reprojection.h"
#include "tests/plugin/colmap/small_model.h"
#include "tests/plugin/test_util.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

void Convert(const TempFolder& temp, const fs::path& from, const fs::path& to, const char* type) {
  RunColmap(temp, "model_converter", from, to, std::string("--output_type ") + type);
}

// COLMAP 3.8 writes in the order of its hash maps: the content is the same, the order is not.
Reconstruction Sorted(Reconstruction model) {
  const auto by_id = [](const auto& a, const auto& b) { return a.id < b.id; };
  std::sort(model.cameras.begin(), model.cameras.end(), by_id);
  std::sort(model.images.begin(), model.images.end(), by_id);
  std::sort(model.points.begin(), model.points.end(), by_id);
  return model;
}

// The binary files of the sorted model: equal bytes are equal models.
std::vector<std::string> Content(const TempFolder& temp, const Reconstruction& model) {
  const fs::path folder = temp / "content";
  WriteReconstruction(folder, Sorted(model), ModelFormat::kBinary);
  return {ReadFile(folder / "cameras.bin"),
          ReadFile(folder / "images.bin"),
          ReadFile(folder / "points3D.bin")};
}

// A model that COLMAP 3.8 takes as it is: consistent tracks, names without blanks (its text format
// ends a name there).
Reconstruction ConsistentModel() {
  Reconstruction model = SmallModel(false);
  model.images[0].name = "left/day_1/a.b.jpg";
  model.points.pop_back();
  // COLMAP 3.8 normalises quaternions as it reads; this one has length 1 exactly.
  for (Image& image : model.images) {
    image.cam_from_world.rotation = Eigen::Quaterniond(0.5, -0.5, 0.5, 0.5);
  }
  return model;
}

TEST(ColmapInterop, ReadsWhatColmapWrites) {
  TempFolder temp;
  const fs::path source = fs::path(SEMFOAM_TEST_DATA) / "tabletop/sparse/0";
  const auto ours = Content(temp, ReadReconstruction(source));
  Convert(temp, source, temp / "txt", "TXT");
  EXPECT_TRUE(fs::exists(temp / "txt/images.txt"));
  EXPECT_EQ(Content(temp, ReadReconstruction(temp / "txt")), ours);
  Convert(temp, temp / "txt", temp / "bin", "BIN");
  EXPECT_TRUE(fs::exists(temp / "bin/images.bin"));
  EXPECT_EQ(Content(temp, ReadReconstruction(temp / "bin")), ours);
}

TEST(ColmapInterop, ColmapAcceptsWhatWeWrite) {
  TempFolder temp;
  const Reconstruction model = ConsistentModel();
  const auto ours = Content(temp, model);
  WriteReconstruction(temp / "bin", model, ModelFormat::kBinary);
  WriteReconstruction(temp / "txt", model, ModelFormat::kText);
  for (const char* format : {"bin", "txt"}) {
    const std::string output =
        RunColmap(temp, "model_analyzer --path '" + (temp / format).string() + "'");
    EXPECT_THAT(output, HasSubstr("Cameras: 2"));
    EXPECT_THAT(output, HasSubstr("Registered images: 3"));
    EXPECT_THAT(output, HasSubstr("Points: 2"));
    EXPECT_THAT(output, HasSubstr("Observations: 3"));
    for (const char* type : {"BIN", "TXT"}) {
      const fs::path converted = temp / (std::string(format) + "_to_" + type);
      Convert(temp, temp / format, converted, type);
      EXPECT_EQ(Content(temp, ReadReconstruction(converted)), ours) << format << " to " << type;
    }
  }
}

TEST(ColmapInterop, ColmapAcceptsTheRealModelAsText) {
  TempFolder temp;
  const Reconstruction model =
      ReadReconstruction(fs::path(SEMFOAM_TEST_DATA) / "tabletop/sparse/0");
  WriteReconstruction(temp / "txt", model, ModelFormat::kText);
  const std::string output =
      RunColmap(temp, "model_analyzer --path '" + (temp / "txt").string() + "'");
  EXPECT_THAT(output, HasSubstr("Points: 5621"));
  Convert(temp, temp / "txt", temp / "bin", "BIN");
  EXPECT_EQ(Content(temp, ReadReconstruction(temp / "bin")), Content(temp, model));
}

// COLMAP stored the mean reprojection error of every point, when the photos were twice as large;
// projected anew by us, the observations must give the same.
TEST(ColmapInterop, OurProjectionReproducesColmapsErrors) {
  const Reconstruction model =
      ReadReconstruction(fs::path(SEMFOAM_TEST_DATA) / "tabletop/sparse/0");
  double stored = 0;
  for (const Point3D& point : model.points) stored += point.error;
  const double ours = MeanReprojectionError(model);
  EXPECT_NEAR(2 * ours, stored / static_cast<double>(model.points.size()), 0.001);
  EXPECT_LT(ours, 1);
}

}  // namespace
}  // namespace semfoam
