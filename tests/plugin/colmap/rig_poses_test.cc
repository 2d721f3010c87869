// SPDX-License-Identifier: GPL-3.0-or-later
//
// Models of COLMAP 3.12 and later, built by hand from the documented format: two cameras on a rig,
// turned and shifted against each other, at two moments.
#include "plugin/colmap/rig_poses.h"

#include "plugin/colmap/colmap_model.h"
#include "plugin/dataset/training_scene.h"

#include <map>

#include "tests/mistake.h"
#include "tests/plugin/colmap/colmap_program.h"
#include "tests/plugin/test_util.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

using Files = std::map<std::string, std::string>;

#define HALF_ROOT "0.70710678118654757"  // cos 45 degrees

// The camera 5 is turned by 90 degrees about y against the rig, which is at frame 3 turned by 120
// degrees about (1, 1, 1) and at frame 9 by 90 degrees about x. The products in images.txt are
// computed by hand. The sensors beside them: an IMU whose place nobody knows, and its data.
Files StereoAsText() {
  return {{"cameras", "2 PINHOLE 8 6 10 11 4 3\n5 SIMPLE_RADIAL 4 2 5 2 1 0.01\n"},
          {"rigs",
           "# RIG_ID, NUM_SENSORS, REF_SENSOR_TYPE, REF_SENSOR_ID, SENSORS[]\n"
           "12 3 CAMERA 2 CAMERA 5 1 " HALF_ROOT " 0 " HALF_ROOT " 0 0.1 0.02 -0.03 IMU 1 0\n"},
          {"frames",
           "3 12 0.5 0.5 0.5 0.5 1 2 3 2 CAMERA 2 1 CAMERA 5 2\n"
           "9 12 " HALF_ROOT " " HALF_ROOT " 0 0 -2 0.5 4 3 CAMERA 2 3 CAMERA 5 4 IMU 1 3\n"},
          {"images",
           "1 0.5 0.5 0.5 0.5 1 2 3 2 left/0.png\n\n"
           "2 0 " HALF_ROOT " " HALF_ROOT " 0 3.1 2.02 -1.03 5 right/0.png\n\n"
           "3 " HALF_ROOT " " HALF_ROOT " 0 0 -2 0.5 4 2 left/1.png\n\n"
           "4 0.5 0.5 0.5 -0.5 4.1 0.52 1.97 5 right/1.png\n\n"},
          {"points3D", "7 1 2 3 10 20 30 0.5\n"}};
}

void WriteText(const fs::path& folder, const Files& files) {
  for (const auto& [stem, text] : files) WriteFile(folder / (stem + ".txt"), text);
}

// The bytes of numbers, one after the other, each in the size that its type has.
template <typename... Numbers>
std::string Bytes(Numbers... numbers) {
  std::string bytes;
  (bytes.append(reinterpret_cast<const char*>(&numbers), sizeof(numbers)), ...);
  return bytes;
}

constexpr double kHalfRoot = 0.70710678118654757;

std::string RigsAsBinary() {
  return Bytes(uint64_t{1}, uint32_t{12}, uint32_t{3}, int32_t{0}, uint32_t{2}) +
         Bytes(int32_t{0}, uint32_t{5}, uint8_t{1}, kHalfRoot, 0.0, kHalfRoot, 0.0) +
         Bytes(0.1, 0.02, -0.03) + Bytes(int32_t{1}, uint32_t{1}, uint8_t{0});
}

std::string FramesAsBinary() {
  return Bytes(uint64_t{2}, uint32_t{3}, uint32_t{12}, 0.5, 0.5, 0.5, 0.5, 1.0, 2.0, 3.0) +
         Bytes(uint32_t{2}, int32_t{0}, uint32_t{2}, uint64_t{1}) +
         Bytes(int32_t{0}, uint32_t{5}, uint64_t{2}) +
         Bytes(uint32_t{9}, uint32_t{12}, kHalfRoot, kHalfRoot, 0.0, 0.0, -2.0, 0.5, 4.0) +
         Bytes(uint32_t{3}, int32_t{0}, uint32_t{2}, uint64_t{3}) +
         Bytes(int32_t{0}, uint32_t{5}, uint64_t{4}) + Bytes(int32_t{1}, uint32_t{1}, uint64_t{3});
}

std::string ReadErrorOf(const Files& files) {
  const TempFolder temp;
  WriteText(temp.path(), files);
  std::string message = UserErrorOf([&] { ReadReconstruction(temp.path()); });
  const size_t folder = message.find(temp.path().string());
  if (folder != std::string::npos) message.erase(folder, temp.path().string().size() + 1);
  return message;
}

std::string Replaced(std::string text, const std::string& from, const std::string& to) {
  const size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

TEST(RigPoses, ReadsTheDocumentedTextAndBytes) {
  const TempFolder temp;
  WriteText(temp / "txt", StereoAsText());
  const Reconstruction text = ReadReconstruction(temp / "txt");
  ASSERT_EQ(text.rigs->size(), 1u);
  const Rig& rig = (*text.rigs)[0];
  EXPECT_EQ(rig.reference->id, 2u);
  ASSERT_EQ(rig.others.size(), 2u);
  EXPECT_EQ(rig.others[0].sensor_from_rig->translation, Eigen::Vector3d(0.1, 0.02, -0.03));
  EXPECT_EQ(rig.others[1].sensor.type, SensorType::kImu);
  ASSERT_EQ(text.frames->size(), 2u);
  EXPECT_EQ((*text.frames)[1].rig_from_world.translation, Eigen::Vector3d(-2, 0.5, 4));
  EXPECT_EQ((*text.frames)[1].data[1].id, 4u);
  // Our own writers give the very bytes, and ours alone would prove nothing.
  WriteReconstruction(temp / "bin", text, ModelFormat::kBinary);
  EXPECT_EQ(ReadFile(temp / "bin/rigs.bin"), RigsAsBinary());
  EXPECT_EQ(ReadFile(temp / "bin/frames.bin"), FramesAsBinary());
}

TEST(RigPoses, BinaryRigsArePreferred) {
  const TempFolder temp;
  WriteText(temp / "txt", StereoAsText());
  WriteReconstruction(temp / "both", ReadReconstruction(temp / "txt"), ModelFormat::kBinary);
  WriteFile(temp / "both/rigs.bin", RigsAsBinary());
  WriteFile(temp / "both/frames.bin", FramesAsBinary());
  Files other = StereoAsText();
  other["frames"] = "nonsense";
  other["images"] = Replaced(other["images"], "left/1.png", "left/other.png");
  WriteText(temp / "both", other);
  const Reconstruction read = ReadReconstruction(temp / "both");
  EXPECT_EQ(read.images[2].name, "left/1.png");
  EXPECT_EQ(read.frames->size(), 2u);
}

TEST(RigPoses, WhatOtherProgramsRoundIsTheSamePose) {
  Files files = StereoAsText();
  // The other quaternion of the same rotation, and seven digits.
  files["images"] = Replaced(files["images"], "4 0.5 0.5 0.5 -0.5", "4 -0.5 -0.5 -0.5 0.5");
  files["images"] =
      Replaced(files["images"], "0 " HALF_ROOT " " HALF_ROOT " 0", "0 0.7071068 0.7071068 0");
  files["images"] = Replaced(files["images"], "3.1 2.02 -1.03", "3.100001 2.019999 -1.03");
  EXPECT_EQ(ReadErrorOf(files), "");
  // An image that COLMAP left out of the model stays in its frame.
  files["images"] = files["images"].substr(0, files["images"].find("4 -0.5"));
  EXPECT_EQ(ReadErrorOf(files), "");
  // A camera whose place on the rig is not known: nothing to compare the image with.
  files = StereoAsText();
  files["rigs"] = "12 2 CAMERA 2 CAMERA 5 0\n";
  EXPECT_EQ(ReadErrorOf(files), "");
}

TEST(RigPoses, DisagreementIsNamed) {
  struct Case {
    std::string stem, from, to, message;
  };
  const std::vector<Case> cases = {
      {"images",
       "3.1 2.02 -1.03",
       "3.1 2.02 -1.53",
       "frames.txt: frame 3 has image 2 (right/0.png) at another place than images.txt has it (0.5 "
       "units and 0 degrees away)"},
      {"images", "3.1 2.02 -1.03", "3.1 2.02 -1.0301", "image 2 (right/0.png) at another place"},
      // The pose of the rig instead of the camera's: as if the rig were not there.
      {"images",
       "4 0.5 0.5 0.5 -0.5 4.1 0.52 1.97",
       "4 " HALF_ROOT " " HALF_ROOT " 0 0 -2 0.5 4",
       "frame 9 has image 4 (right/1.png) at another place than images.txt has it"},
      // Turned alone: the translation is still the same.
      {"images",
       "3 " HALF_ROOT " " HALF_ROOT " 0 0",
       "3 1 0 0 0",
       "frame 9 has image 3 (left/1.png) at another place than images.txt has it"},
      {"frames", "1 2 3 2 CAMERA", "1 2 3.1 2 CAMERA", "frame 3 has image 1 (left/0.png) at"},
      {"rigs", "1 " HALF_ROOT " 0", "1 0 " HALF_ROOT, "frame 3 has image 2 (right/0.png) at"},
      {"frames",
       "CAMERA 5 4",
       "CAMERA 5 2",
       "frame 9 has image 2 (right/0.png), which frame 3 has "
       "too, where one frame would be right"},
      {"frames",
       "2 CAMERA 2 1 CAMERA 5 2",
       "1 CAMERA 2 1",
       "frames.txt: has no frame with image 2 "
       "(right/0.png), which images.txt has"},
      {"frames",
       "CAMERA 5 2",
       "CAMERA 2 2",
       "frame 3 has image 2 (right/0.png) by camera 2, while "
       "images.txt has it by camera 5"},
      {"rigs",
       "CAMERA 5",
       "CAMERA 6",
       "frame 3 has image 2 (right/0.png) by camera 5, which its "
       "rig 12 in rigs.txt does not have"},
      {"rigs", "\n12 3", "\n13 3", "frames.txt: frame 3 uses rig 12, which rigs.txt does not have"},
  };
  ASSERT_EQ(ReadErrorOf(StereoAsText()), "");
  for (const Case& damage : cases) {
    Files files = StereoAsText();
    files[damage.stem] = Replaced(files[damage.stem], damage.from, damage.to);
    EXPECT_THAT(ReadErrorOf(files), HasSubstr(damage.message)) << damage.to;
  }
  for (const auto& [stem, other] : {std::pair("rigs", "frames"), std::pair("frames", "rigs")}) {
    Files files = StereoAsText();
    files.erase(stem);
    EXPECT_THAT(
        ReadErrorOf(files),
        NamesMistake(std::string(stem) + ".txt", {std::string(other) + ".txt"}, "is missing"));
  }
}

// The rays of a photo by the camera beside the reference start where that camera was.
TEST(RigPoses, TrainingSeesFromThePlaceOnTheRig) {
  const TempFolder temp;
  WriteText(temp / "sparse/0", StereoAsText());
  for (const char* name : {"left/0.png", "left/1.png"}) {
    WritePng(temp / "images" / name, 8, 6, 8, PNG_COLOR_TYPE_GRAY, std::vector<uint8_t>(48, 99));
  }
  for (const char* name : {"right/0.png", "right/1.png"}) {
    WritePng(temp / "images" / name, 4, 2, 8, PNG_COLOR_TYPE_GRAY, std::vector<uint8_t>(8, 99));
  }
  SceneOptions options;
  options.image_path = temp / "images";
  options.input_path = temp.path();
  const TrainingScene scene(PlanScene(options));
  ASSERT_EQ(scene.NumViews(), 4);
  ASSERT_EQ(scene.Photos()[3].name, "right/1.png");
  EXPECT_EQ(scene.Width(3), 4);
  // x_cam = (y + 4.1, -z + 0.52, -x + 1.97): the camera is where that is 0.
  const Eigen::Vector3d center = scene.WorldFromNormalized().Apply(scene.Origin(3));
  EXPECT_LT((center - Eigen::Vector3d(1.97, -4.1, 0.52)).norm(), 1e-9);
  // Its axis, through the corner of four pixels, is z of the camera: -x of the world.
  Eigen::Vector3f axis = Eigen::Vector3f::Zero();
  for (int k = 0; k < 4; ++k) {
    TrainingRay ray;
    ASSERT_TRUE(scene.Ray(3, 1 + k % 2, k / 2, &ray));
    axis += ray.direction / 4;
  }
  EXPECT_LT((axis.normalized() - Eigen::Vector3f(-1, 0, 0)).norm(), 1e-3);
}

// COLMAP 3.8 knows no rigs, and reads such models by the three files that it knows.
TEST(RigPoses, Colmap38ReadsTheSamePoses) {
  const TempFolder temp;
  WriteText(temp / "txt", StereoAsText());
  RunColmap(temp, "model_converter", temp / "txt", temp / "bin", "--output_type BIN");
  const Reconstruction ours = ReadReconstruction(temp / "txt");
  const Reconstruction colmaps = ReadReconstruction(temp / "bin");
  ASSERT_EQ(colmaps.images.size(), ours.images.size());
  EXPECT_FALSE(colmaps.rigs);
  for (const Image& image : colmaps.images) {
    const Image& same = ours.images[image.id - 1];
    EXPECT_EQ(image.name, same.name);
    EXPECT_LT((image.cam_from_world.Center() - same.cam_from_world.Center()).norm(), 1e-12);
    EXPECT_LT(image.cam_from_world.rotation.angularDistance(same.cam_from_world.rotation), 1e-7);
  }
}

}  // namespace
}  // namespace semfoam
