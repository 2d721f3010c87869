// SPDX-License-Identifier: GPL-3.0-or-later
//
// Bad COLMAP models in binary.
#include "plugin/colmap/colmap_model_formats.h"

#include <cmath>
#include <limits>

#include "tests/bad_input/bad_input.h"
#include "tests/plugin/colmap/small_model.h"

namespace semfoam {
namespace {

namespace fs = std::filesystem;

void WriteSmallModel(const fs::path& folder) {
  WriteReconstruction(folder, SmallModel(true), ModelFormat::kBinary);
}

// A spoiler: the model is written with a change in it.
auto Changed(const std::function<void(Reconstruction&)>& change) {
  return [=](const fs::path& folder) {
    Reconstruction model = SmallModel(true);
    change(model);
    WriteReconstruction(folder, model, ModelFormat::kBinary);
  };
}

// A spoiler: the bytes from `at` on become those of `value`.
template <typename T>
auto Bytes(const std::string& file, size_t at, T value) {
  return [=](const fs::path& folder) {
    std::string bytes = ReadFile(folder / file);
    bytes.replace(at, sizeof(value), reinterpret_cast<const char*>(&value), sizeof(value));
    WriteFile(folder / file, bytes);
  };
}

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

TEST(ColmapBinary, ColmapBinary) {
  const std::vector<BadInput> cases = {
      // Cut and overcounted files
      {"no cameras", Remove("cameras.bin"), {"IN/cameras.bin", {}, "is missing"}},
      {"no images", Remove("images.bin"), {"IN/images.bin", {}, "is missing"}},
      {"no points", Remove("points3D.bin"), {"IN/points3D.bin", {}, "is missing"}},
      {"cameras are a folder", MakeFolder("cameras.bin"), {"IN/cameras.bin", {}, "is a folder"}},
      {"images are a pipe", MakePipe("images.bin"), {"IN/images.bin", {}, "is a pipe"}},
      {"points are a device", MakeDevice("points3D.bin"), {"IN/points3D.bin", {}, "is a device"}},
      {"rigs are a pipe", MakePipe("rigs.bin"), {"IN/rigs.bin", {}, "is a pipe"}},
      {"frames are a folder", MakeFolder("frames.bin"), {"IN/frames.bin", {}, "is a folder"}},
      {"empty cameras",
       CutTo("cameras.bin", 0),
       {"IN/cameras.bin", {"number of records"}, "ends at byte 0"}},
      {"empty images",
       CutTo("images.bin", 0),
       {"IN/images.bin", {"number of records"}, "ends at byte 0"}},
      {"empty points",
       CutTo("points3D.bin", 0),
       {"IN/points3D.bin", {"number of records"}, "ends at byte 0"}},
      {"empty rigs",
       CutTo("rigs.bin", 0),
       {"IN/rigs.bin", {"number of records"}, "ends at byte 0"}},
      {"empty frames",
       CutTo("frames.bin", 0),
       {"IN/frames.bin", {"number of records"}, "ends at byte 0"}},
      {"cut count",
       CutTo("cameras.bin", 7),
       {"IN/cameras.bin", {"number of records"}, "ends at byte 7"}},
      {"count alone",
       CutTo("cameras.bin", 8),
       {"IN/cameras.bin", {"camera 1 of 2"}, "ends at byte 8"}},
      {"cut camera",
       CutTo("cameras.bin", 31),
       {"IN/cameras.bin", {"camera 1 of 2"}, "ends at byte 31"}},
      {"cut parameters",
       CutTo("cameras.bin", 40),
       {"IN/cameras.bin", {"camera 1 of 2"}, "ends at byte 40"}},
      {"cut pose", CutTo("images.bin", 40), {"IN/images.bin", {"image 1 of 3"}, "ends at byte 40"}},
      {"cut name",
       CutTo("images.bin", 80),
       {"IN/images.bin", {"name", "image 1 of 3"}, "ends at byte 80"}},
      {"cut before features",
       CutTo("images.bin", 90),
       {"IN/images.bin", {"name", "image 1 of 3"}, "ends at byte 90"}},
      {"cut features",
       CutTo("images.bin", 120),
       {"IN/images.bin", {"image 1 of 3"}, "ends at byte 120"}},
      {"cut point",
       CutTo("points3D.bin", 20),
       {"IN/points3D.bin", {"record 1 of 3"}, "ends at byte 20"}},
      {"cut track",
       CutTo("points3D.bin", 60),
       {"IN/points3D.bin", {"record 1 of 3"}, "ends at byte 60"}},
      {"cut rig", CutTo("rigs.bin", 30), {"IN/rigs.bin", {"rig 1 of 3"}, "ends at byte 30"}},
      {"cut frame",
       CutTo("frames.bin", 60),
       {"IN/frames.bin", {"frame 1 of 2"}, "ends at byte 60"}},
      {"one camera too many",
       Bytes("cameras.bin", 0, uint64_t{3}),
       {"IN/cameras.bin", {"camera 3 of 3"}, "ends at byte 184"}},
      {"one camera too few",
       Bytes("cameras.bin", 0, uint64_t{1}),
       {"IN/cameras.bin", {"120 bytes"}, "after the last"}},
      {"2^60 cameras",
       Bytes("cameras.bin", 0, uint64_t{1} << 60),
       {"IN/cameras.bin", {"camera 3 of 1152921504606846976"}, "ends at byte 184"}},
      {"2^60 images",
       Bytes("images.bin", 0, uint64_t{1} << 60),
       {"IN/images.bin", {"image 4 of 1152921504606846976"}, "ends at byte 357"}},
      {"2^64 - 1 points",
       Bytes("points3D.bin", 0, ~uint64_t{0}),
       {"IN/points3D.bin", {"record 4 of 18446744073709551615"}, "ends at byte 185"}},
      {"2^60 rigs",
       Bytes("rigs.bin", 0, uint64_t{1} << 60),
       {"IN/rigs.bin", {"rig 4 of 1152921504606846976"}, "ends at byte 122"}},
      {"2^60 frames",
       Bytes("frames.bin", 0, uint64_t{1} << 60),
       {"IN/frames.bin", {"frame 3 of 1152921504606846976"}, "ends at byte 192"}},
      {"2^60 features",
       Bytes("images.bin", 91, uint64_t{1} << 60),
       {"IN/images.bin", {"image 1 of 3", "2^64"}, "ends at byte 357"}},
      {"2^61 observations",
       Bytes("points3D.bin", 51, uint64_t{1} << 61),
       {"IN/points3D.bin", {"record 1 of 3", "2^64"}, "ends at byte 185"}},
      {"2^32 - 1 sensors",
       Bytes("rigs.bin", 12, ~uint32_t{0}),
       {"IN/rigs.bin", {"rig 1 of 3", "50331648"}, "sensor type"}},
      {"2^32 - 1 data",
       Bytes("frames.bin", 72, ~uint32_t{0}),
       {"IN/frames.bin", {"frame 1 of 2"}, "ends at byte 192"}},
      {"bytes after the cameras",
       Append("cameras.bin", "x"),
       {"IN/cameras.bin", {"1 bytes"}, "after the last"}},
      {"bytes after the images",
       Append("images.bin", std::string(9, '\0')),
       {"IN/images.bin", {"9 bytes"}, "after the last"}},
      {"bytes after the points",
       Append("points3D.bin", "x"),
       {"IN/points3D.bin", {"1 bytes"}, "after the last"}},
      {"bytes after the rigs",
       Append("rigs.bin", "x"),
       {"IN/rigs.bin", {"1 bytes"}, "after the last"}},
      {"bytes after the frames",
       Append("frames.bin", "x"),
       {"IN/frames.bin", {"1 bytes"}, "after the last"}},
      // Cameras
      {"unknown camera model",
       Bytes("cameras.bin", 12, int32_t{99}),
       {"IN/cameras.bin", {"camera 1 of 2", "id 4000000000", "99"}, "unknown camera model"}},
      {"negative camera model",
       Bytes("cameras.bin", 12, int32_t{-1}),
       {"IN/cameras.bin", {"camera 1 of 2", "id 4000000000", "-1"}, "unknown camera model"}},
      {"another model's parameters",
       Bytes("cameras.bin", 12, int32_t{4}),
       {"IN/cameras.bin", {"camera 2 of 2", "id 0", "1079590912"}, "unknown camera model"}},
      {"same camera twice",
       Changed([](auto& m) { m.cameras[1].id = 4'000'000'000u; }),
       {"IN/cameras.bin", {"camera 4000000000"}, "occurs twice"}},
      {"no width",
       Changed([](auto& m) { m.cameras[0].width = 0; }),
       {"IN/cameras.bin", {"camera 4000000000", "0 x 480 pixels"}, "1 to 1000000"}},
      {"huge height",
       Changed([](auto& m) { m.cameras[0].height = 1'000'001; }),
       {"IN/cameras.bin", {"camera 4000000000", "640 x 1000001 pixels"}, "1 to 1000000"}},
      {"focal length 0",
       Changed([](auto& m) { m.cameras[0].params[0] = 0; }),
       {"IN/cameras.bin", {"camera 4000000000", "0"}, "focal length"}},
      {"negative focal length",
       Changed([](auto& m) { m.cameras[1].params[1] = -3; }),
       {"IN/cameras.bin", {"camera 3", "-3"}, "focal length"}},
      {"focal length nan",
       Changed([](auto& m) { m.cameras[0].params[0] = kNan; }),
       {"IN/cameras.bin", {"camera 4000000000", "parameter"}, "not finite"}},
      {"distortion inf",
       Changed([](auto& m) { m.cameras[0].params[3] = kInfinity; }),
       {"IN/cameras.bin", {"camera 4000000000", "parameter"}, "not finite"}},
      // Images
      {"same image twice",
       Changed([](auto& m) { m.images[1].id = 77; }),
       {"IN/images.bin", {"image 77"}, "occurs twice"}},
      {"same name twice",
       Changed([](auto& m) { m.images[1].name = "c.jpg"; }),
       {"IN/images.bin", {"c.jpg"}, "occurs twice"}},
      {"empty name",
       Changed([](auto& m) { m.images[1].name = ""; }),
       {"IN/images.bin", {"image 5", "\"\""}, "within the image folder"}},
      {"absolute name",
       Changed([](auto& m) { m.images[1].name = "/etc/passwd"; }),
       {"IN/images.bin", {"image 5", "\"/etc/passwd\""}, "within the image folder"}},
      {"name that leaves",
       Changed([](auto& m) { m.images[1].name = "a/../../b.jpg"; }),
       {"IN/images.bin", {"image 5", "\"a/../../b.jpg\""}, "within the image folder"}},
      {"name of a folder",
       Changed([](auto& m) { m.images[1].name = "a/"; }),
       {"IN/images.bin", {"image 5", "\"a/\""}, "within the image folder"}},
      {"image without camera",
       Changed([](auto& m) { m.images[1].camera_id = 4; }),
       {"IN/images.bin", {"image 5", "right/b.png", "camera 4", "cameras.bin"}, "does not have"}},
      {"zero quaternion",
       Changed([](auto& m) { m.images[1].cam_from_world.rotation.coeffs().setZero(); }),
       {"IN/images.bin", {"image 5", "length 0"}, "rotation quaternion"}},
      {"long quaternion",
       Changed([](auto& m) { m.images[1].cam_from_world.rotation.coeffs() *= 2; }),
       {"IN/images.bin", {"image 5", "length 2"}, "rotation quaternion"}},
      {"quaternion nan",
       Changed([](auto& m) { m.images[1].cam_from_world.rotation.x() = kNan; }),
       {"IN/images.bin", {"image 5", "pose"}, "not finite"}},
      {"translation inf",
       Changed([](auto& m) { m.images[1].cam_from_world.translation.y() = -kInfinity; }),
       {"IN/images.bin", {"image 5", "pose"}, "not finite"}},
      // Points, rigs, frames
      {"same point twice",
       Changed([](auto& m) { m.points[1].id = 2; }),
       {"IN/points3D.bin", {"point 2"}, "occurs twice"}},
      {"observation in no image",
       Changed([](auto& m) { m.points[1].track[0].image_id = 8; }),
       {"IN/points3D.bin", {"point 9", "image 8", "images.bin"}, "does not have"}},
      {"same rig twice",
       Changed([](auto& m) { (*m.rigs)[1].id = 12; }),
       {"IN/rigs.bin", {"rig 12"}, "occurs twice"}},
      {"unknown sensor",
       Bytes("rigs.bin", 16, int32_t{7}),
       {"IN/rigs.bin", {"rig 1 of 3", "7"}, "sensor type"}},
      {"flag of a pose",
       Bytes("rigs.bin", 32, uint8_t{2}),
       {"IN/rigs.bin", {"rig 1 of 3"}, "flag 2"}},
      {"pose in a rig nan",
       Changed([](auto& m) { (*m.rigs)[0].others[0].sensor_from_rig->translation.x() = kNan; }),
       {"IN/rigs.bin", {"rig 12", "pose"}, "not finite"}},
      {"same frame twice",
       Changed([](auto& m) { (*m.frames)[1].id = 40; }),
       {"IN/frames.bin", {"frame 40"}, "occurs twice"}},
      {"frame without rig",
       Changed([](auto& m) { (*m.frames)[1].rig_id = 99; }),
       {"IN/frames.bin", {"frame 2", "rig 99", "rigs.bin"}, "does not have"}},
      {"frame's zero quaternion",
       Changed([](auto& m) { (*m.frames)[1].rig_from_world.rotation.coeffs().setZero(); }),
       {"IN/frames.bin", {"frame 2", "length 0"}, "rotation quaternion"}},
      {"frame's unknown sensor",
       Bytes("frames.bin", 76, int32_t{-2}),
       {"IN/frames.bin", {"frame 1 of 2", "-2"}, "sensor type"}},
  };
  ExpectMistakes(cases, WriteSmallModel, ReadReconstruction);
}

}  // namespace
}  // namespace semfoam
