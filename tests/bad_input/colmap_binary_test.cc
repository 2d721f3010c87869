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
      {"no cameras",
       Remove("cameras.bin"),
       "IN/cameras.bin: is missing, while images.bin is there; is the copy of the COLMAP model "
       "complete?"},
      {"no images",
       Remove("images.bin"),
       "IN/images.bin: is missing, while cameras.bin is there; is the copy of the COLMAP model "
       "complete?"},
      {"no points",
       Remove("points3D.bin"),
       "IN/points3D.bin: is missing, while cameras.bin is there; is the copy of the COLMAP model "
       "complete?"},
      {"cameras are a folder",
       MakeFolder("cameras.bin"),
       "IN/cameras.bin: is a folder, where a COLMAP model's file should be."},
      {"images are a pipe",
       MakePipe("images.bin"),
       "IN/images.bin: is a pipe, where a COLMAP model's file should be."},
      {"points are a device",
       MakeDevice("points3D.bin"),
       "IN/points3D.bin: is a device, where a COLMAP model's file should be."},
      {"rigs are a pipe",
       MakePipe("rigs.bin"),
       "IN/rigs.bin: is a pipe, where a COLMAP model's file should be."},
      {"frames are a folder",
       MakeFolder("frames.bin"),
       "IN/frames.bin: is a folder, where a COLMAP model's file should be."},
      {"empty cameras",
       CutTo("cameras.bin", 0),
       "IN/cameras.bin: ends at byte 0, before its number of records; is the copy complete?"},
      {"empty images",
       CutTo("images.bin", 0),
       "IN/images.bin: ends at byte 0, before its number of records; is the copy complete?"},
      {"empty points",
       CutTo("points3D.bin", 0),
       "IN/points3D.bin: ends at byte 0, before its number of records; is the copy complete?"},
      {"empty rigs",
       CutTo("rigs.bin", 0),
       "IN/rigs.bin: ends at byte 0, before its number of records; is the copy complete?"},
      {"empty frames",
       CutTo("frames.bin", 0),
       "IN/frames.bin: ends at byte 0, before its number of records; is the copy complete?"},
      {"cut count",
       CutTo("cameras.bin", 7),
       "IN/cameras.bin: ends at byte 7, before its number of records; is the copy complete?"},
      {"count alone",
       CutTo("cameras.bin", 8),
       "IN/cameras.bin: ends at byte 8, camera 1 of 2 needs 24 more bytes; is the copy complete?"},
      {"cut camera",
       CutTo("cameras.bin", 31),
       "IN/cameras.bin: ends at byte 31, camera 1 of 2 needs 1 more bytes; is the copy complete?"},
      {"cut parameters",
       CutTo("cameras.bin", 40),
       "IN/cameras.bin: ends at byte 40, camera 1 of 2 needs 24 more bytes; is the copy complete?"},
      {"cut pose",
       CutTo("images.bin", 40),
       "IN/images.bin: ends at byte 40, image 1 of 3 needs 32 more bytes; is the copy complete?"},
      {"cut name",
       CutTo("images.bin", 80),
       "IN/images.bin: ends at byte 80 within the name of image 1 of 3; is the copy complete?"},
      {"cut before features",
       CutTo("images.bin", 90),
       "IN/images.bin: ends at byte 90 within the name of image 1 of 3; is the copy complete?"},
      {"cut features",
       CutTo("images.bin", 120),
       "IN/images.bin: ends at byte 120, image 1 of 3 needs 51 more bytes; is the copy complete?"},
      {"cut point",
       CutTo("points3D.bin", 20),
       "IN/points3D.bin: ends at byte 20, record 1 of 3 needs 39 more bytes; is the copy "
       "complete?"},
      {"cut track",
       CutTo("points3D.bin", 60),
       "IN/points3D.bin: ends at byte 60, record 1 of 3 needs 7 more bytes; is the copy complete?"},
      {"cut rig",
       CutTo("rigs.bin", 30),
       "IN/rigs.bin: ends at byte 30, rig 1 of 3 needs 3 more bytes; is the copy complete?"},
      {"cut frame",
       CutTo("frames.bin", 60),
       "IN/frames.bin: ends at byte 60, frame 1 of 2 needs 16 more bytes; is the copy complete?"},
      {"one camera too many",
       Bytes("cameras.bin", 0, uint64_t{3}),
       "IN/cameras.bin: ends at byte 184, camera 3 of 3 needs 24 more bytes; is the copy "
       "complete?"},
      {"one camera too few",
       Bytes("cameras.bin", 0, uint64_t{1}),
       "IN/cameras.bin: has 120 bytes after the last of its 1 records, where it should end; is it "
       "damaged, or of another program?"},
      {"2^60 cameras",
       Bytes("cameras.bin", 0, uint64_t{1} << 60),
       "IN/cameras.bin: ends at byte 184, camera 3 of 1152921504606846976 needs 24 more bytes; is "
       "the copy complete?"},
      {"2^60 images",
       Bytes("images.bin", 0, uint64_t{1} << 60),
       "IN/images.bin: ends at byte 357, image 4 of 1152921504606846976 needs 64 more bytes; is "
       "the copy complete?"},
      {"2^64 - 1 points",
       Bytes("points3D.bin", 0, ~uint64_t{0}),
       "IN/points3D.bin: ends at byte 185, record 4 of 18446744073709551615 needs 51 more bytes; "
       "is the copy complete?"},
      {"2^60 rigs",
       Bytes("rigs.bin", 0, uint64_t{1} << 60),
       "IN/rigs.bin: ends at byte 122, rig 4 of 1152921504606846976 needs 8 more bytes; is the "
       "copy complete?"},
      {"2^60 frames",
       Bytes("frames.bin", 0, uint64_t{1} << 60),
       "IN/frames.bin: ends at byte 192, frame 3 of 1152921504606846976 needs 68 more bytes; is "
       "the copy complete?"},
      {"2^60 features",
       Bytes("images.bin", 91, uint64_t{1} << 60),
       "IN/images.bin: ends at byte 357, image 1 of 3 needs 2^64 or more bytes; is the copy "
       "complete?"},
      {"2^61 observations",
       Bytes("points3D.bin", 51, uint64_t{1} << 61),
       "IN/points3D.bin: ends at byte 185, record 1 of 3 needs 2^64 or more bytes; is the copy "
       "complete?"},
      {"2^32 - 1 sensors",
       Bytes("rigs.bin", 12, ~uint32_t{0}),
       "IN/rigs.bin: rig 1 of 3 has the sensor type 50331648, where -1, 0 or 1 would be right; is "
       "it damaged?"},
      {"2^32 - 1 data",
       Bytes("frames.bin", 72, ~uint32_t{0}),
       "IN/frames.bin: ends at byte 192, frame 1 of 2 needs 68719476604 more bytes; is the copy "
       "complete?"},
      {"bytes after the cameras",
       Append("cameras.bin", "x"),
       "IN/cameras.bin: has 1 bytes after the last of its 2 records, where it should end; is it "
       "damaged, or of another program?"},
      {"bytes after the images",
       Append("images.bin", std::string(9, '\0')),
       "IN/images.bin: has 9 bytes after the last of its 3 records, where it should end; is it "
       "damaged, or of another program?"},
      {"bytes after the points",
       Append("points3D.bin", "x"),
       "IN/points3D.bin: has 1 bytes after the last of its 3 records, where it should end; is it "
       "damaged, or of another program?"},
      {"bytes after the rigs",
       Append("rigs.bin", "x"),
       "IN/rigs.bin: has 1 bytes after the last of its 3 records, where it should end; is it "
       "damaged, or of another program?"},
      {"bytes after the frames",
       Append("frames.bin", "x"),
       "IN/frames.bin: has 1 bytes after the last of its 2 records, where it should end; is it "
       "damaged, or of another program?"},
      // Cameras
      {"unknown camera model",
       Bytes("cameras.bin", 12, int32_t{99}),
       "IN/cameras.bin: camera 1 of 2 (id 4000000000) has the unknown camera model 99, where 0 to "
       "17 would be right; is it damaged, or of a newer COLMAP?"},
      {"negative camera model",
       Bytes("cameras.bin", 12, int32_t{-1}),
       "IN/cameras.bin: camera 1 of 2 (id 4000000000) has the unknown camera model -1, where 0 to "
       "17 would be right; is it damaged, or of a newer COLMAP?"},
      {"another model's parameters",
       Bytes("cameras.bin", 12, int32_t{4}),
       "IN/cameras.bin: camera 2 of 2 (id 0) has the unknown camera model 1079590912, where 0 to "
       "17 would be right; is it damaged, or of a newer COLMAP?"},
      {"same camera twice",
       Changed([](auto& m) { m.cameras[1].id = 4'000'000'000u; }),
       "IN/cameras.bin: camera 4000000000 occurs twice; it should occur once; is it damaged?"},
      {"no width",
       Changed([](auto& m) { m.cameras[0].width = 0; }),
       "IN/cameras.bin: camera 4000000000 has 0 x 480 pixels, where 1 to 1000000 a side would be "
       "right; is it damaged?"},
      {"huge height",
       Changed([](auto& m) { m.cameras[0].height = 1'000'001; }),
       "IN/cameras.bin: camera 4000000000 has 640 x 1000001 pixels, where 1 to 1000000 a side "
       "would be right; is it damaged?"},
      {"focal length 0",
       Changed([](auto& m) { m.cameras[0].params[0] = 0; }),
       "IN/cameras.bin: camera 4000000000 has the focal length 0, where a positive one would be "
       "right; did the calibration fail?"},
      {"negative focal length",
       Changed([](auto& m) { m.cameras[1].params[1] = -3; }),
       "IN/cameras.bin: camera 3 has the focal length -3, where a positive one would be right; did "
       "the calibration fail?"},
      {"focal length nan",
       Changed([](auto& m) { m.cameras[0].params[0] = kNan; }),
       "IN/cameras.bin: camera 4000000000 has a parameter that is not finite; is it damaged?"},
      {"distortion inf",
       Changed([](auto& m) { m.cameras[0].params[3] = kInfinity; }),
       "IN/cameras.bin: camera 4000000000 has a parameter that is not finite; is it damaged?"},
      // Images
      {"same image twice",
       Changed([](auto& m) { m.images[1].id = 77; }),
       "IN/images.bin: image 77 occurs twice; it should occur once; is it damaged?"},
      {"same name twice",
       Changed([](auto& m) { m.images[1].name = "c.jpg"; }),
       "IN/images.bin: the image name c.jpg occurs twice; it should occur once; is it damaged?"},
      {"empty name",
       Changed([](auto& m) { m.images[1].name = ""; }),
       "IN/images.bin: image 5 has the name \"\", where a file's path within the image folder "
       "would be right."},
      {"absolute name",
       Changed([](auto& m) { m.images[1].name = "/etc/passwd"; }),
       "IN/images.bin: image 5 has the name \"/etc/passwd\", where a file's path within the image "
       "folder would be right."},
      {"name that leaves",
       Changed([](auto& m) { m.images[1].name = "a/../../b.jpg"; }),
       "IN/images.bin: image 5 has the name \"a/../../b.jpg\", where a file's path within the "
       "image folder would be right."},
      {"name of a folder",
       Changed([](auto& m) { m.images[1].name = "a/"; }),
       "IN/images.bin: image 5 has the name \"a/\", where a file's path within the image folder "
       "would be right."},
      {"image without camera",
       Changed([](auto& m) { m.images[1].camera_id = 4; }),
       "IN/images.bin: image 5 (right/b.png) uses camera 4, which cameras.bin does not have; are "
       "both files of one model?"},
      {"zero quaternion",
       Changed([](auto& m) { m.images[1].cam_from_world.rotation.coeffs().setZero(); }),
       "IN/images.bin: image 5 has a rotation quaternion of length 0 where 1 would be right; is "
       "the order QW QX QY QZ?"},
      {"long quaternion",
       Changed([](auto& m) { m.images[1].cam_from_world.rotation.coeffs() *= 2; }),
       "IN/images.bin: image 5 has a rotation quaternion of length 2 where 1 would be right; is "
       "the order QW QX QY QZ?"},
      {"quaternion nan",
       Changed([](auto& m) { m.images[1].cam_from_world.rotation.x() = kNan; }),
       "IN/images.bin: image 5 has a pose that is not finite; is it damaged?"},
      {"translation inf",
       Changed([](auto& m) { m.images[1].cam_from_world.translation.y() = -kInfinity; }),
       "IN/images.bin: image 5 has a pose that is not finite; is it damaged?"},
      // Points, rigs, frames
      {"same point twice",
       Changed([](auto& m) { m.points[1].id = 2; }),
       "IN/points3D.bin: point 2 occurs twice; it should occur once; is it damaged?"},
      {"observation in no image",
       Changed([](auto& m) { m.points[1].track[0].image_id = 8; }),
       "IN/points3D.bin: point 9 is seen by image 8, which images.bin does not have; are both "
       "files of one model?"},
      {"same rig twice",
       Changed([](auto& m) { (*m.rigs)[1].id = 12; }),
       "IN/rigs.bin: rig 12 occurs twice; it should occur once; is it damaged?"},
      {"unknown sensor",
       Bytes("rigs.bin", 16, int32_t{7}),
       "IN/rigs.bin: rig 1 of 3 has the sensor type 7, where -1, 0 or 1 would be right; is it "
       "damaged?"},
      {"flag of a pose",
       Bytes("rigs.bin", 32, uint8_t{2}),
       "IN/rigs.bin: rig 1 of 3 has the flag 2, where 0 or 1 would be right; is it damaged?"},
      {"pose in a rig nan",
       Changed([](auto& m) { (*m.rigs)[0].others[0].sensor_from_rig->translation.x() = kNan; }),
       "IN/rigs.bin: rig 12 has a pose that is not finite; is it damaged?"},
      {"same frame twice",
       Changed([](auto& m) { (*m.frames)[1].id = 40; }),
       "IN/frames.bin: frame 40 occurs twice; it should occur once; is it damaged?"},
      {"frame without rig",
       Changed([](auto& m) { (*m.frames)[1].rig_id = 99; }),
       "IN/frames.bin: frame 2 uses rig 99, which rigs.bin does not have; are both files of one "
       "model?"},
      {"frame's zero quaternion",
       Changed([](auto& m) { (*m.frames)[1].rig_from_world.rotation.coeffs().setZero(); }),
       "IN/frames.bin: frame 2 has a rotation quaternion of length 0 where 1 would be right; is "
       "the order QW QX QY QZ?"},
      {"frame's unknown sensor",
       Bytes("frames.bin", 76, int32_t{-2}),
       "IN/frames.bin: frame 1 of 2 has the sensor type -2, where -1, 0 or 1 would be right; is it "
       "damaged?"},
  };
  ExpectSentences(cases, WriteSmallModel, ReadReconstruction);
}

}  // namespace
}  // namespace semfoam
