// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/colmap/colmap_model.h"

#include "plugin/colmap/colmap_model_formats.h"

#include <cstring>
#include <functional>
#include <sstream>

#include "tests/mistake.h"
#include "tests/plugin/colmap/small_model.h"
#include "tests/plugin/test_util.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

const std::vector<std::string> kStems = {"cameras", "images", "points3D", "rigs", "frames"};

std::string ReadErrorOf(const fs::path& folder) {
  return UserErrorOf([&] { ReadReconstruction(folder); });
}

// Parses one file's bytes, without the disk: what the tests that try every byte can afford.
std::string ParseErrorOf(const std::string& stem, bool binary, const std::string& bytes) {
  const fs::path path = stem;
  return UserErrorOf([&] {
    if (stem == "cameras") binary ? ParseCamerasBinary(path, bytes) : ParseCamerasText(path, bytes);
    if (stem == "images") binary ? ParseImagesBinary(path, bytes) : ParseImagesText(path, bytes);
    if (stem == "points3D") binary ? ParsePointsBinary(path, bytes) : ParsePointsText(path, bytes);
    if (stem == "rigs") binary ? ParseRigsBinary(path, bytes) : ParseRigsText(path, bytes);
    if (stem == "frames") binary ? ParseFramesBinary(path, bytes) : ParseFramesText(path, bytes);
  });
}

template <typename T>
void Overwrite(std::string* bytes, size_t offset, T value) {
  ASSERT_LE(offset + sizeof(T), bytes->size());
  std::memcpy(bytes->data() + offset, &value, sizeof(T));
}

class ColmapModel : public testing::TestWithParam<bool> {
 protected:
  const Reconstruction model_ = SmallModel(GetParam());
  TempFolder temp_;
};

TEST_P(ColmapModel, BinaryTextBinaryTextKeepsEveryByte) {
  WriteReconstruction(temp_ / "bin", model_, ModelFormat::kBinary);
  WriteReconstruction(temp_ / "txt", ReadReconstruction(temp_ / "bin"), ModelFormat::kText);
  WriteReconstruction(temp_ / "bin2", ReadReconstruction(temp_ / "txt"), ModelFormat::kBinary);
  WriteReconstruction(temp_ / "txt2", ReadReconstruction(temp_ / "bin2"), ModelFormat::kText);
  int files = 0;
  for (const std::string& stem : kStems) {
    if (!GetParam() && (stem == "rigs" || stem == "frames")) {
      EXPECT_FALSE(fs::exists(temp_ / "bin" / (stem + ".bin")));
      EXPECT_FALSE(fs::exists(temp_ / "txt" / (stem + ".txt")));
      continue;
    }
    EXPECT_EQ(ReadFile(temp_ / "bin" / (stem + ".bin")),
              ReadFile(temp_ / "bin2" / (stem + ".bin")));
    EXPECT_EQ(ReadFile(temp_ / "txt" / (stem + ".txt")),
              ReadFile(temp_ / "txt2" / (stem + ".txt")));
    ++files;
  }
  EXPECT_EQ(files, GetParam() ? 5 : 3);
}

TEST_P(ColmapModel, ReadsWhatWasWritten) {
  for (const ModelFormat format : {ModelFormat::kBinary, ModelFormat::kText}) {
    const fs::path folder = temp_ / (format == ModelFormat::kBinary ? "b" : "t");
    WriteReconstruction(folder, model_, format);
    const Reconstruction read = ReadReconstruction(folder);
    EXPECT_EQ(read.cameras, model_.cameras);
    ASSERT_EQ(read.images.size(), 3u);
    EXPECT_EQ(read.images[0].id, 77u);
    EXPECT_EQ(read.images[0].name, "left/day 1/a.b.jpg");
    EXPECT_EQ(read.images[0].cam_from_world.rotation.coeffs(),
              model_.images[0].cam_from_world.rotation.coeffs());
    EXPECT_EQ(read.images[0].cam_from_world.translation,
              model_.images[0].cam_from_world.translation);
    ASSERT_EQ(read.images[0].points.size(), 3u);
    EXPECT_EQ(read.images[0].points[1].point3d_id, kNoPoint3D);
    EXPECT_EQ(read.images[0].points[2].point3d_id, 1'000'000'000'000u);
    EXPECT_TRUE(read.images[1].points.empty());
    EXPECT_EQ(read.images[2].name, "c.jpg");
    ASSERT_EQ(read.points.size(), 3u);
    EXPECT_EQ(read.points[1].position, model_.points[1].position);
    EXPECT_EQ(read.points[1].color, model_.points[1].color);
    EXPECT_EQ(read.points[1].track[1].image_id, 77u);
    EXPECT_EQ(read.points[1].track[1].point2d_index, 0u);
    EXPECT_EQ(read.rigs.has_value(), GetParam());
    EXPECT_EQ(read.frames.has_value(), GetParam());
    if (!GetParam()) continue;
    EXPECT_EQ((*read.rigs)[0].others[0].sensor_from_rig->translation.x(), 1.0 / 3);
    EXPECT_FALSE((*read.rigs)[0].others[1].sensor_from_rig);
    EXPECT_EQ((*read.rigs)[0].others[1].sensor.type, SensorType::kImu);
    EXPECT_FALSE((*read.rigs)[2].reference);
    EXPECT_EQ((*read.frames)[0].data[1].id, 77u);
    EXPECT_EQ((*read.frames)[1].rig_id, 1u);
  }
}

TEST_P(ColmapModel, EveryCutOfEveryBinaryFileIsNamed) {
  const fs::path folder = temp_ / "m";
  WriteReconstruction(folder, model_, ModelFormat::kBinary);
  for (const std::string& stem : kStems) {
    const fs::path path = folder / (stem + ".bin");
    if (!fs::exists(path)) continue;
    const std::string bytes = ReadFile(path);
    for (size_t size = 0; size < bytes.size(); ++size) {
      const std::string message = ParseErrorOf(stem, /*binary=*/true, bytes.substr(0, size));
      ASSERT_THAT(message, NamesMistake(stem, {}, "ends at byte " + std::to_string(size)));
    }
    EXPECT_EQ(ParseErrorOf(stem, /*binary=*/true, bytes), "");
    // And through the files.
    WriteFile(path, bytes.substr(0, bytes.size() / 2));
    EXPECT_THAT(ReadErrorOf(folder), HasSubstr(path.string() + ": ends at byte "));
    WriteFile(path, "");
    EXPECT_THAT(ReadErrorOf(folder), HasSubstr(path.string() + ": ends at byte 0"));
    WriteFile(path, bytes + '\0');
    EXPECT_THAT(ReadErrorOf(folder), HasSubstr(path.string() + ": has 1 bytes after"));
    WriteFile(path, bytes);
    EXPECT_EQ(ReadErrorOf(folder), "");
  }
}

TEST_P(ColmapModel, EveryCutOfEveryTextFileIsReadOrNamed) {
  const fs::path folder = temp_ / "m";
  WriteReconstruction(folder, model_, ModelFormat::kText);
  for (const std::string& stem : kStems) {
    const fs::path path = folder / (stem + ".txt");
    if (!fs::exists(path)) continue;
    const std::string text = ReadFile(path);
    int complaints = 0;
    for (size_t size = 0; size < text.size(); ++size) {
      if (!ParseErrorOf(stem, /*binary=*/false, text.substr(0, size)).empty()) ++complaints;
    }
    // A cut after a record or a digit is no visible damage; most others are.
    EXPECT_GT(complaints, 20) << stem;
    EXPECT_EQ(ParseErrorOf(stem, /*binary=*/false, text), "");
  }
}

TEST_P(ColmapModel, HugeCountsNeitherAllocateNorSpin) {
  const fs::path folder = temp_ / "m";
  WriteReconstruction(folder, model_, ModelFormat::kBinary);
  for (const std::string& stem : kStems) {
    const fs::path path = folder / (stem + ".bin");
    if (!fs::exists(path)) continue;
    const std::string bytes = ReadFile(path);
    for (const uint64_t count : {uint64_t{4}, uint64_t{1} << 40, UINT64_MAX}) {
      std::string damaged = bytes;
      Overwrite(&damaged, 0, count);
      WriteFile(path, damaged);
      EXPECT_THAT(ReadErrorOf(folder), HasSubstr(" of " + std::to_string(count) + " needs"))
          << stem;
    }
    WriteFile(path, bytes);
    // Any eight bytes may be a count: none may crash, hang or take the memory it names.
    for (size_t offset = 8; offset + 8 <= bytes.size(); ++offset) {
      for (const uint64_t count : {uint64_t{1} << 40, UINT64_MAX / 8, UINT64_MAX}) {
        std::string damaged = bytes;
        Overwrite(&damaged, offset, count);
        ParseErrorOf(stem, /*binary=*/true, damaged);
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Versions, ColmapModel, testing::Bool(), [](const auto& info) {
  return info.param ? "WithRigs" : "Classic";
});

TEST(ColmapModelFiles, TheMessageSaysHowMuchIsMissing) {
  TempFolder temp;
  Reconstruction model;
  model.points.resize(2);
  model.points[1].id = 1;
  WriteReconstruction(temp.path(), model, ModelFormat::kBinary);
  const std::string bytes = ReadFile(temp / "points3D.bin");
  WriteFile(temp / "points3D.bin", bytes.substr(0, bytes.size() - 20));
  EXPECT_THAT(ReadErrorOf(temp.path()),
              NamesMistake((temp / "points3D.bin").string(), {"record 2 of 2"}, "ends at byte 90"));
}

TEST(ColmapModelFiles, BinaryIsPreferredAndMissingFilesAreNamed) {
  TempFolder temp;
  EXPECT_THAT(ReadErrorOf(temp / "nowhere"), HasSubstr("there is no such folder"));
  EXPECT_THAT(ReadErrorOf(temp.path()), HasSubstr("holds no COLMAP model"));
  Reconstruction model = SmallModel(false);
  WriteReconstruction(temp.path(), model, ModelFormat::kText);
  EXPECT_EQ(FindModelFormat(temp.path()), ModelFormat::kText);
  model.images[0].name = "other.jpg";
  WriteReconstruction(temp.path(), model, ModelFormat::kBinary);
  EXPECT_EQ(FindModelFormat(temp.path()), ModelFormat::kBinary);
  EXPECT_EQ(ReadReconstruction(temp.path()).images[0].name, "other.jpg");
  fs::remove(temp / "images.txt");
  fs::remove(temp / "images.bin");
  EXPECT_THAT(ReadErrorOf(temp.path()),
              HasSubstr((temp / "images.bin").string() + ": is missing, while cameras.bin"));
}

TEST(ColmapModelFiles, FindsTheModelInAWorkspace) {
  TempFolder temp;
  WriteReconstruction(temp / "w/sparse/0", SmallModel(false), ModelFormat::kBinary);
  WriteReconstruction(temp / "undistorted/sparse", SmallModel(false), ModelFormat::kText);
  for (const char* path : {"w", "w/sparse", "w/sparse/0", "w/sparse/0/"}) {
    EXPECT_TRUE(fs::equivalent(FindModelFolder(temp / path), temp / "w/sparse/0")) << path;
  }
  EXPECT_TRUE(fs::equivalent(FindModelFolder(temp / "undistorted"), temp / "undistorted/sparse"));
  EXPECT_THAT(UserErrorOf([&] { FindModelFolder(temp / "x"); }), HasSubstr("x: there is no such"));
  fs::remove(temp / "w/sparse/0/points3D.bin");
  EXPECT_THAT(UserErrorOf([&] { FindModelFolder(temp / "w"); }),
              HasSubstr("w/sparse/0/points3D.bin: is missing"));
}

TEST(ColmapModelFiles, BlankSecondLinesCommentsAndCarriageReturnsAreRead) {
  TempFolder temp;
  WriteFile(temp / "cameras.txt", "# a comment\r\n\r\n1 PINHOLE 640 480 500 +500 320 240\r\n");
  WriteFile(temp / "images.txt",
            "# IMAGE_ID ...\n"
            "3 1 0 0 0 0 0 0 1 a.jpg\n"
            "\n"
            "1  1 0 0 0  0 0 1  1  sub folder/b.jpg \n"
            "   \n"
            "2 1 0 0 0 0 0 2 1 c.jpg\n"
            "10 20 -1 30 40 5\n"
            "# between\n"
            "9 1 0 0 0 0 0 3 1 d.jpg\n");
  WriteFile(temp / "points3D.txt", "5 1 2 3 10 20 30 0.5 2 1\n7 1 2 3 10 20 30 0.5");
  const Reconstruction model = ReadReconstruction(temp.path());
  ASSERT_EQ(model.images.size(), 4u);
  EXPECT_EQ(model.images[0].name, "a.jpg");
  EXPECT_TRUE(model.images[0].points.empty());
  EXPECT_EQ(model.images[1].name, "sub folder/b.jpg");
  EXPECT_EQ(model.images[1].cam_from_world.translation.z(), 1);
  ASSERT_EQ(model.images[2].points.size(), 2u);
  EXPECT_EQ(model.images[2].points[1].point3d_id, 5u);
  EXPECT_EQ(model.images[3].id, 9u);
  ASSERT_EQ(model.points.size(), 2u);
  EXPECT_EQ(model.points[0].track.size(), 1u);
  EXPECT_EQ(model.cameras[0].params[1], 500);
}

TEST(ColmapModelFiles, ToleratesWhatOtherProgramsWrite) {
  TempFolder temp;
  WriteFile(temp / "cameras.txt", "1 EUCM 640 480 500 500 320 240 0.5 1\n");
  // A quaternion of 7 digits; a track index and a point that are not there; a point at infinity.
  WriteFile(temp / "images.txt", "1 0.7071068 0.7071068 0 0 0 0 0 1 a.jpg\n1 2 99\n");
  WriteFile(temp / "points3D.txt", "3 nan inf 3 10 20 30 0.5 1 12\n");
  ASSERT_EQ(ReadErrorOf(temp.path()), "");
  const Reconstruction model = ReadReconstruction(temp.path());
  EXPECT_NEAR(model.images[0].cam_from_world.UnitRotation().norm(), 1, 1e-15);
}

TEST(ColmapModelFiles, UnknownBinaryValuesAreNamed) {
  TempFolder temp;
  WriteReconstruction(temp.path(), SmallModel(true), ModelFormat::kBinary);
  std::string cameras = ReadFile(temp / "cameras.bin");
  Overwrite(&cameras, 8 + 4, int32_t{18});
  WriteFile(temp / "cameras.bin", cameras);
  EXPECT_THAT(ReadErrorOf(temp.path()), HasSubstr("unknown camera model 18"));
  Overwrite(&cameras, 8 + 4, int32_t{2});
  WriteFile(temp / "cameras.bin", cameras);
  std::string rigs = ReadFile(temp / "rigs.bin");
  Overwrite(&rigs, 8 + 4 + 4, int32_t{5});
  WriteFile(temp / "rigs.bin", rigs);
  EXPECT_THAT(ReadErrorOf(temp.path()), HasSubstr("sensor type 5"));
}

TEST(ColmapModelFiles, WritingNeverMixesModels) {
  TempFolder temp;
  WriteReconstruction(temp.path(), SmallModel(true), ModelFormat::kBinary);
  EXPECT_THAT(UserErrorOf([&] {
                WriteReconstruction(temp.path(), SmallModel(false), ModelFormat::kBinary);
              }),
              HasSubstr("rigs.bin: belongs to another model"));
  Reconstruction broken = SmallModel(false);
  broken.images[0].name = "a\nb.jpg";
  EXPECT_THAT(UserErrorOf([&] { WriteReconstruction(temp / "t", broken, ModelFormat::kText); }),
              HasSubstr("write the model as binary"));
  EXPECT_FALSE(fs::exists(temp / "t/cameras.txt"));
  WriteReconstruction(temp / "b", broken, ModelFormat::kBinary);
  EXPECT_EQ(ReadReconstruction(temp / "b").images[0].name, "a\nb.jpg");
}

TEST(ColmapModelFiles, RealModelRoundTrips) {
  const fs::path source = fs::path(SEMFOAM_TEST_DATA) / "tabletop/sparse/0";
  const Reconstruction model = ReadReconstruction(source);
  EXPECT_EQ(model.cameras.size(), 1u);
  EXPECT_EQ(model.images.size(), 64u);
  EXPECT_EQ(model.points.size(), 5621u);
  TempFolder temp;
  WriteReconstruction(temp / "bin", model, ModelFormat::kBinary);
  WriteReconstruction(temp / "txt", model, ModelFormat::kText);
  WriteReconstruction(temp / "back", ReadReconstruction(temp / "txt"), ModelFormat::kBinary);
  for (const char* file : {"cameras.bin", "images.bin", "points3D.bin"}) {
    EXPECT_EQ(ReadFile(temp / "bin" / file), ReadFile(source / file)) << file;
    EXPECT_EQ(ReadFile(temp / "back" / file), ReadFile(source / file)) << file;
  }
}

}  // namespace
}  // namespace semfoam
