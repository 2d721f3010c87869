// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/views/trajectory.h"

#include "foam/model/spherical_harmonics.h"
#include "foam/util/error.h"
#include "tools/images/image_files.h"

#include <cmath>
#include <memory>
#include <numbers>
#include <optional>
#include <set>

#include "tests/tools/program.h"
#include <OpenImageIO/imageio.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector3d;
using std::numbers::pi;
using testing::HasSubstr;
using testing::SizeIs;

const Vector3d kMiddle(5, 6, 7);

// Cameras around kMiddle, z up: so far away, so high, and looking at it, from `begin` to `end`
// degrees.
Model Around(double distance, double elevation, double begin, double end, int count = 24) {
  Model model;
  model.world_from_normalized = {2, kMiddle};
  for (int k = 0; k < count; ++k) {
    const double azimuth = (begin + (end - begin) * k / (count - 1)) * pi / 180;
    const double e = elevation * pi / 180;
    const Vector3d arm =
        distance *
        Vector3d(std::cos(e) * std::cos(azimuth), std::cos(e) * std::sin(azimuth), std::sin(e));
    const Vector3d forward = -arm.normalized();
    const Vector3d right = forward.cross(Vector3d::UnitZ()).normalized();
    Eigen::Matrix3d rotation;
    rotation << right.transpose(), forward.cross(right).transpose(), forward.transpose();
    PhotoRecord photo;
    photo.name = std::to_string(100 + k) + ".jpg";
    photo.camera_model = "SIMPLE_PINHOLE";
    photo.width = 400;
    photo.height = 200;
    photo.camera_params = {200, 190, 110};
    photo.cam_from_world_rotation = Eigen::Quaterniond(rotation);
    photo.cam_from_world_translation = -(rotation * (kMiddle + arm));
    model.photos.push_back(photo);
  }
  return model;
}

Trajectory Make(const Model& model,
                const std::string& path,
                int num_frames = 0,
                std::optional<Eigen::AlignedBox3d> box = std::nullopt) {
  return MakeTrajectory(model, "a.foam", box, {path, num_frames, 0});
}

double Elevation(const Vector3d& arm) { return std::asin(arm.normalized().z()) * 180 / pi; }
double Azimuth(const Vector3d& arm) { return std::atan2(arm.y(), arm.x()) * 180 / pi; }

// The point of the world that a camera shows at a pixel of the frame's middle, so far away.
Vector3d Ahead(const Pose& pose, double distance) {
  return pose.Center() + distance * (pose.UnitRotation().conjugate() * Vector3d::UnitZ());
}

TEST(Trajectory, AnOrbitIsOnceAroundAtTheCamerasHeight) {
  const Trajectory orbit = Make(Around(3, 30, 0, 345), "orbit", 36);
  ASSERT_THAT(orbit.cam_from_world, SizeIs(36));
  std::set<int> directions;
  for (const Pose& pose : orbit.cam_from_world) {
    const Vector3d arm = pose.Center() - kMiddle;
    EXPECT_NEAR(arm.norm(), 3, 1e-9);
    EXPECT_NEAR(Elevation(arm), 30, 1e-6);
    directions.insert(static_cast<int>(std::lround(Azimuth(arm) / 10 + 36)) % 36);
    EXPECT_LT((Ahead(pose, 3) - kMiddle).norm(), 1e-9);
    // Upright: the picture's up has no sideways part, and points up.
    const Vector3d up = pose.UnitRotation().conjugate() * -Vector3d::UnitY();
    EXPECT_GT(up.z(), 0.8);
    EXPECT_NEAR(pose.UnitRotation().toRotationMatrix().determinant(), 1, 1e-12);
  }
  EXPECT_THAT(directions, SizeIs(36));
  // The first photo's view, its middle in the middle.
  EXPECT_EQ(orbit.camera.width, 400);
  EXPECT_EQ(orbit.camera.height, 200);
  EXPECT_EQ(orbit.camera.params, (std::vector<double>{200, 200, 200, 100}));
  EXPECT_EQ(
      MakeTrajectory(Around(3, 30, 0, 345), "", std::nullopt, {"orbit", 1, 100}).camera.params,
      (std::vector<double>{50, 50, 50, 25}));
  EXPECT_THAT(Make(Around(3, 30, 0, 345), "orbit").cam_from_world, SizeIs(60));
}

TEST(Trajectory, StaysWhereTheCamerasWere) {
  // From 100 to 220 degrees, across the place where angles jump.
  for (const char* path : {"orbit", "spiral"}) {
    double least = 999, most = -999;
    for (const Pose& pose : Make(Around(3, 30, 100, 220), path, 100).cam_from_world) {
      const double azimuth = std::fmod(Azimuth(pose.Center() - kMiddle) + 360, 360);
      least = std::min(least, azimuth);
      most = std::max(most, azimuth);
    }
    EXPECT_NEAR(least, 100, 1) << path;
    EXPECT_NEAR(most, 220, 1) << path;
  }
}

TEST(Trajectory, ASpiralClimbsAndComesNearer) {
  Model model = Around(3, 10, 0, 345);
  const Model high = Around(3, 50, 0, 345);
  model.photos.insert(model.photos.end(), high.photos.begin(), high.photos.end());
  const Trajectory spiral = Make(model, "spiral", 50);
  const Vector3d first = spiral.cam_from_world.front().Center() - kMiddle;
  const Vector3d last = spiral.cam_from_world.back().Center() - kMiddle;
  EXPECT_NEAR(Elevation(first), 10, 1e-6);
  EXPECT_NEAR(Elevation(last), 50, 1);
  EXPECT_NEAR(first.norm(), 3.6, 1e-6);
  EXPECT_NEAR(last.norm(), 2.4, 0.05);
}

TEST(Trajectory, AnObjectFillsThePicture) {
  const Vector3d at(6, 6, 7);
  const Eigen::AlignedBox3d box(at - Vector3d::Constant(0.2), at + Vector3d::Constant(0.2));
  const Trajectory orbit = Make(Around(3, 30, 0, 345), "orbit", 8, box);
  for (const Pose& pose : orbit.cam_from_world) {
    const double distance = (pose.Center() - at).norm();
    EXPECT_LT((Ahead(pose, distance) - at).norm(), 1e-9);
    double lowest = 1e9, highest = -1e9;
    for (int corner = 0; corner < 8; ++corner) {
      const Vector3d x_cam =
          pose.rotation * box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(corner)) +
          pose.translation;
      const auto pixel = Project(orbit.camera, x_cam);
      ASSERT_TRUE(pixel.has_value());
      lowest = std::min(lowest, pixel->y());
      highest = std::max(highest, pixel->y());
    }
    EXPECT_GT(lowest, 0);
    EXPECT_LT(highest, 200);
    EXPECT_GT(highest - lowest, 80);
  }
}

TEST(Trajectory, WantsPhotos) { EXPECT_THROW(Make(Model(), "orbit"), UserError); }

class TrajectoryFile : public testing::Test {
 protected:
  Trajectory Read(const std::string& text, const Model& model, TrajectoryOptions options = {}) {
    WriteFile(folder_ / "path.json", text);
    return ReadTrajectory(folder_ / "path.json", model, options);
  }
  TempFolder folder_;
};

constexpr char kSquare[] =
    R"({"version": 1, "frames": 5, "fps": 10, "width": 300, "height": 200, "fov": 90, "keyframes": [
        {"position": [0, 0, 1], "look_at": [0, 0, 0], "up": [0, 1, 0]},
        {"position": [1, 0, 1], "look_at": [1, 0, 0], "up": [0, 1, 0]},
        {"position": [1, 1, 1], "look_at": [1, 1, 0], "up": [0, 1, 0]}]})";

TEST_F(TrajectoryFile, PassesItsKeyframes) {
  const Trajectory open = Read(kSquare, Model());
  ASSERT_THAT(open.cam_from_world, SizeIs(5));
  EXPECT_LT((open.cam_from_world[0].Center() - Vector3d(0, 0, 1)).norm(), 1e-12);
  EXPECT_LT((open.cam_from_world[2].Center() - Vector3d(1, 0, 1)).norm(), 1e-12);
  EXPECT_LT((open.cam_from_world[4].Center() - Vector3d(1, 1, 1)).norm(), 1e-12);
  // Between them on a curve, not on the chord; always looking down, up as said.
  EXPECT_GT((open.cam_from_world[1].Center() - Vector3d(0.5, 0, 1)).norm(), 0.01);
  for (const Pose& pose : open.cam_from_world) {
    EXPECT_LT((Ahead(pose, 1) - (pose.Center() - Vector3d::UnitZ())).norm(), 1e-12);
    EXPECT_LT((pose.UnitRotation().conjugate() * -Vector3d::UnitY() - Vector3d::UnitY()).norm(),
              1e-12);
  }
  EXPECT_EQ(open.frames_per_second, 10);
  EXPECT_EQ(open.camera.width, 300);
  EXPECT_NEAR(open.camera.params[0], 150, 1e-9);

  std::string closed_text = kSquare;
  closed_text.replace(closed_text.find("\"fps\""), 5, "\"closed\": true, \"fps\"");
  const Trajectory closed = Read(closed_text, Model(), {"", 6, 150});
  ASSERT_THAT(closed.cam_from_world, SizeIs(6));
  EXPECT_LT((closed.cam_from_world[4].Center() - Vector3d(1, 1, 1)).norm(), 1e-12);
  EXPECT_GT((closed.cam_from_world[5].Center() - closed.cam_from_world[4].Center()).norm(), 0.1);
  EXPECT_EQ(closed.camera.height, 100);
  EXPECT_NEAR(closed.camera.params[0], 75, 1e-9);
}

TEST_F(TrajectoryFile, TakesFromThePhotosWhatItDoesNotSay) {
  const Trajectory one =
      Read(R"({"version": 1, "keyframes": [{"position": [9, 6, 7], "look_at": [5, 6, 7]}]})",
           Around(3, 30, 0, 345));
  EXPECT_THAT(one.cam_from_world, SizeIs(60));
  EXPECT_EQ(one.camera.width, 400);
  EXPECT_NEAR(one.camera.params[0], 200, 1e-9);
  EXPECT_LT(
      (one.cam_from_world[30].UnitRotation().conjugate() * -Vector3d::UnitY() - Vector3d::UnitZ())
          .norm(),
      1e-3);
}

TEST_F(TrajectoryFile, SaysWhatIsWrong) {
  const std::string key = R"({"position": [0, 0, 1], "look_at": [0, 0, 0], "up": [0, 1, 0]})";
  const struct {
    std::string text;
    const char* sentence;
  } cases[] = {
      {"", "ends after 0 bytes"},
      {"[1]", "is no trajectory"},
      {R"({"keyframes": [)" + key + "]}", "\"version\": 1"},
      {R"({"version": 2, "keyframes": [)" + key + "]}", "\"version\": 1"},
      {R"({"version": 1})", "has no keyframes"},
      {R"({"version": 1, "keyframes": []})", "has no keyframes"},
      {R"({"version": 1, "keyframes": [3]})", "keyframe 0 lacks"},
      {R"({"version": 1, "keyframes": [{"position": [0, 0, 1]}]})", "keyframe 0 lacks"},
      {R"({"version": 1, "keyframes": [{"position": [0, 0], "look_at": [0, 0, 0]}]})",
       "[0,0]; [x, y, z]"},
      {R"({"version": 1, "keyframes": [{"position": ["a", 0, 0], "look_at": [0, 0, 0]}]})",
       "[x, y, z]"},
      {R"({"version": 1, "keyframes": [{"position": [1, 0, 0], "look_at": [1, 0, 0], "up": [0, 0, 1]}]})",
       "looks at where it is"},
      {R"({"version": 1, "keyframes": [{"position": [1, 0, 0], "look_at": [0, 0, 0], "up": [0, 0, 0]}]})",
       "no length"},
      {R"({"version": 1, "keyframes": [{"position": [1, 0, 0], "look_at": [0, 0, 0]}]})",
       "has no up"},
      {R"({"version": 1, "keyframes": [)" + key + "]}", "lacks width, height or fov"},
      {R"({"version": 1, "speed": 3, "keyframes": [)" + key + "]}", "'speed'"},
      {R"({"version": 1, "fps": 0, "keyframes": [)" + key +
           R"(], "width": 9, "height": 9, "fov": 60})",
       "fps is 0"},
      {R"({"version": 1, "closed": 1, "keyframes": [)" + key +
           R"(], "width": 9, "height": 9, "fov": 60})",
       "closed is 1"},
      {R"({"version": 1, "keyframes": [)" + key + R"(], "width": 9, "height": 9, "fov": 180})",
       "fov is 180"},
      {R"({"version": 1, "keyframes": [)" + key + R"(], "width": 1e9, "height": 9, "fov": 60})",
       "width is 1"},
      {R"({"version": 1, "frames": "many", "keyframes": [)" + key +
           R"(], "width": 9, "height": 9, "fov": 60})",
       "frames is \"many\""},
  };
  for (const auto& [text, sentence] : cases) {
    try {
      Read(text, Model());
      ADD_FAILURE() << sentence;
    } catch (const UserError& error) {
      EXPECT_THAT(error.what(), HasSubstr(sentence));
      EXPECT_THAT(error.what(), HasSubstr("path.json"));
    }
  }
  EXPECT_THROW(ReadTrajectory(folder_ / "none.json", Model(), {}), UserError);
}

TEST(TrajectoryGif, HoldsAllFramesAndTheirTime) {
  const TempFolder folder;
  {
    GifWriter writer(folder / "a.gif", 10);
    for (int k = 0; k < 3; ++k) {
      Image8 image{8, 4, {}};
      for (int i = 0; i < 32; ++i) {
        for (const int value : {k == 0 ? 250 : 0, k == 1 ? 250 : 0, k == 2 ? 250 : 0})
          image.data.push_back(static_cast<uint8_t>(value));
      }
      writer.Add(image);
    }
    EXPECT_FALSE(fs::exists(folder / "a.gif"));
    writer.Finish();
  }
  const std::string bytes = ReadFile(folder / "a.gif");
  EXPECT_EQ(bytes.substr(0, 6), "GIF89a");
  const auto input = OIIO::ImageInput::open((folder / "a.gif").string());
  ASSERT_NE(input, nullptr);
  for (int k = 0; k < 3; ++k) {
    ASSERT_TRUE(input->seek_subimage(k, 0)) << k;
    EXPECT_EQ(input->spec().width, 8);
    std::vector<uint8_t> pixels(8 * 4 * input->spec().nchannels);
    ASSERT_TRUE(
        input->read_image(k, 0, 0, input->spec().nchannels, OIIO::TypeDesc::UINT8, pixels.data()));
    EXPECT_GT(pixels[k], 200) << k;
    EXPECT_LT(pixels[(k + 1) % 3], 50) << k;
  }
  EXPECT_FALSE(input->seek_subimage(3, 0));
  // A tenth of a second each: 10 hundredths in the graphic control extension.
  EXPECT_NE(bytes.find(std::string("\x21\xF9\x04") + bytes[bytes.find("\x21\xF9\x04") + 3] +
                       std::string("\x0A\x00", 2)),
            std::string::npos);

  { GifWriter unfinished(folder / "b.gif", 10); }
  EXPECT_FALSE(fs::exists(folder / "b.gif"));
}

TEST(TrajectoryRenderer, RendersFramesAndAnAnimation) {
  const TempFolder folder;
  const std::string foam = (folder / "a.foam").string();
  ASSERT_EQ(RunSemfoam({"foam_converter",
                        "--input_path",
                        (kTabletop / "sparse/0").string(),
                        "--output_path",
                        foam})
                .exit_code,
            0);
  const Outcome orbit = RunSemfoam({"foam_renderer",
                                    "--foam_path",
                                    foam,
                                    "--output_path",
                                    (folder / "R").string(),
                                    "--trajectory",
                                    "orbit",
                                    "--frames",
                                    "3",
                                    "--width",
                                    "40"});
  ASSERT_EQ(orbit.exit_code, 0) << orbit.err;
  EXPECT_THAT(FilesBelow(folder / "R"),
              testing::UnorderedElementsAre("depth/frame_00000.exr",
                                            "depth/frame_00001.exr",
                                            "depth/frame_00002.exr",
                                            "rgb/frame_00000.png",
                                            "rgb/frame_00001.png",
                                            "rgb/frame_00002.png",
                                            "trajectory.gif"));
  const struct {
    std::vector<std::string> more;
    const char* sentence;
  } cases[] = {
      {{}, "--input_path"},
      {{"--trajectory", "orbit", "--object", "spoon"}, "'spoon'"},
      {{"--trajectory", "orbit", "--frames", "-1"}, "--frames 0 to"},
      {{"--trajectory", "orbit", "--width", "20000"}, "--width 0 to"},
      {{"--trajectory", "figure8"}, "figure8: there is no such file, where a trajectory"},
      {{"--trajectory", "orbit", "--preview", "1", "--image_path", "x"}, "no trajectory"},
  };
  for (const auto& [more, sentence] : cases) {
    std::vector<std::string> arguments = {
        "foam_renderer", "--foam_path", foam, "--output_path", (folder / "N").string()};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const Outcome outcome = RunSemfoam(arguments);
    EXPECT_EQ(outcome.exit_code, 1) << sentence;
    ASSERT_THAT(outcome.Errors(), SizeIs(1)) << outcome.err;
    EXPECT_THAT(outcome.Errors().front(), HasSubstr(sentence));
    EXPECT_FALSE(fs::exists(folder / "N")) << sentence;
  }
}

}  // namespace
}  // namespace semfoam
