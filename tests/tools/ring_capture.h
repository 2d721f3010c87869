// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/util/parallel.h"
#include "plugin/colmap/colmap_model.h"

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <numbers>
#include <string>
#include <vector>

#include "tests/tools/program.h"
#include <Eigen/Geometry>
#include <OpenImageIO/imageio.h>

namespace semfoam {

// A COLMAP workspace of any number of photos of any size, quickly made: a chequered ball in a
// chequered room, both the same after a turn by 1 / kTurns around the vertical axis. So one picture
// is right for kTurns cameras around them, whose photos are links to one file. In every fourth
// picture the ball has a mask.
class RingCapture {
 public:
  static constexpr int kTurns = 50;

  // num_photos is a multiple of kTurns.
  RingCapture(const std::filesystem::path& workspace,
              int num_photos,
              int width,
              int height,
              int num_points = 6000)
      : width_(width), height_(height), num_points_(num_points) {
    std::filesystem::create_directories(workspace / "images");
    std::filesystem::create_directories(workspace / "object_mask");
    const int pictures = num_photos / kTurns;
    ParallelForBlocks(pictures, 1, [&](int64_t picture, int64_t) {
      const auto p = static_cast<int>(picture);
      WritePicture(workspace, p, pictures);
      for (int turn = 1; turn < kTurns; ++turn) {
        std::filesystem::create_hard_link(workspace / "images" / (Name(p, 0) + ".jpg"),
                                          workspace / "images" / (Name(p, turn) + ".jpg"));
        if (!HasMask(p)) continue;
        std::filesystem::create_hard_link(workspace / "object_mask" / (Name(p, 0) + ".png"),
                                          workspace / "object_mask" / (Name(p, turn) + ".png"));
      }
    });
    WriteModel(workspace / "sparse/0", pictures);
  }

 private:
  static std::string Name(int picture, int turn) {
    char name[32];
    std::snprintf(name, sizeof(name), "%03d_%02d", picture, turn);
    return name;
  }
  static bool HasMask(int picture) { return picture % 4 == 0; }

  static Eigen::Vector3d Center(int picture, int turn, int pictures) {
    const double angle = 2 * std::numbers::pi / kTurns * (turn + 1.0 * picture / pictures);
    const double height = 1.2 * std::sin(1.7 * picture);
    return {3 * std::cos(angle), 3 * std::sin(angle), height};
  }

  // Camera to world: x right, y down, z towards the ball.
  static Eigen::Matrix3d Rotation(const Eigen::Vector3d& center) {
    const Eigen::Vector3d forward = -center.normalized();
    const Eigen::Vector3d right = forward.cross(Eigen::Vector3d::UnitZ()).normalized();
    Eigen::Matrix3d rotation;
    rotation << right, forward.cross(right), forward;
    return rotation;
  }

  double Focal() const { return 1.1 * width_; }

  static bool IsDark(const Eigen::Vector3d& x, double bands) {
    const double turns = kTurns / 2.0 * std::atan2(x.y(), x.x()) / std::numbers::pi;
    const double band = bands * std::asin(std::clamp(x.z() / x.norm(), -1.0, 1.0));
    return (static_cast<int>(std::floor(2 * turns)) + static_cast<int>(std::floor(band))) & 1;
  }

  // The colour that a ray meets; whether it is the ball's.
  static bool Shade(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, uint8_t* rgb) {
    const double along = -origin.dot(direction);
    const double miss = origin.squaredNorm() - along * along;
    const bool is_ball = miss < 1;
    const double distance = is_ball ? along - std::sqrt(1 - miss) : along + std::sqrt(64 - miss);
    const Eigen::Vector3d x = origin + distance * direction;
    const bool dark = IsDark(x, is_ball ? 6 : 4);
    const uint8_t ball[] = {200, 60, 40}, room[] = {70, 120, 180};
    for (int c = 0; c < 3; ++c) {
      rgb[c] = static_cast<uint8_t>((is_ball ? ball[c] : room[c]) / (dark ? 2 : 1));
    }
    return is_ball;
  }

  void WritePicture(const std::filesystem::path& workspace, int picture, int pictures) const {
    const Eigen::Vector3d center = Center(picture, 0, pictures);
    const Eigen::Matrix3d rotation = Rotation(center);
    const size_t pixels = static_cast<size_t>(width_) * height_;
    std::vector<uint8_t> rgb(3 * pixels), mask(HasMask(picture) ? pixels : 0);
    for (int y = 0; y < height_; ++y) {
      for (int x = 0; x < width_; ++x) {
        const Eigen::Vector3d in_camera(
            (x + 0.5 - width_ / 2.0) / Focal(), (y + 0.5 - height_ / 2.0) / Focal(), 1);
        const size_t pixel = static_cast<size_t>(y) * width_ + x;
        const bool is_ball =
            Shade(center, (rotation * in_camera).normalized(), rgb.data() + 3 * pixel);
        if (!mask.empty()) mask[pixel] = is_ball ? 7 : 0;
      }
    }
    Write(workspace / "images" / (Name(picture, 0) + ".jpg"), 3, rgb);
    if (!mask.empty()) Write(workspace / "object_mask" / (Name(picture, 0) + ".png"), 1, mask);
  }

  void Write(const std::filesystem::path& path,
             int channels,
             const std::vector<uint8_t>& data) const {
    OIIO::ImageSpec spec(width_, height_, channels, OIIO::TypeDesc::UINT8);
    spec["CompressionQuality"] = 85;
    spec["png:compressionLevel"] = 1;
    auto output = OIIO::ImageOutput::create(path.string());
    ASSERT_TRUE(output && output->open(path.string(), spec));
    ASSERT_TRUE(output->write_image(OIIO::TypeDesc::UINT8, data.data()) && output->close());
  }

  // Points of the ball and the room, each seen by up to kObservations cameras.
  void WriteModel(const std::filesystem::path& folder, int pictures) const {
    constexpr int kObservations = 6;
    Reconstruction model;
    Camera camera;
    camera.id = 1;
    camera.model_id = 1;  // PINHOLE
    camera.width = static_cast<uint64_t>(width_);
    camera.height = static_cast<uint64_t>(height_);
    camera.params = {Focal(), Focal(), width_ / 2.0, height_ / 2.0};
    model.cameras = {camera};
    for (int picture = 0; picture < pictures; ++picture) {
      for (int turn = 0; turn < kTurns; ++turn) {
        Image image;
        image.id = static_cast<uint32_t>(model.images.size() + 1);
        image.name = Name(picture, turn) + ".jpg";
        image.camera_id = 1;
        const Eigen::Vector3d center = Center(picture, turn, pictures);
        const Eigen::Matrix3d cam_from_world = Rotation(center).transpose();
        image.cam_from_world.rotation = Eigen::Quaterniond(cam_from_world).normalized();
        image.cam_from_world.translation = -cam_from_world * center;
        model.images.push_back(image);
      }
    }
    for (int i = 0; i < num_points_; ++i) {
      // A spiral over the sphere, two thirds of it on the ball.
      const double z = 1 - (2 * i + 1.0) / num_points_, angle = 2.399963 * i;
      const Eigen::Vector3d unit(
          std::sqrt(1 - z * z) * std::cos(angle), std::sqrt(1 - z * z) * std::sin(angle), z);
      const bool on_ball = i % 3 != 0;
      Point3D point;
      point.id = static_cast<uint64_t>(i + 1);
      point.position = (on_ball ? 1 : 8) * unit;
      for (size_t k = 0; k < model.images.size() && point.track.size() < kObservations; ++k) {
        // Other cameras for each point.
        const size_t index = (k * 37 + static_cast<size_t>(i) * 101) % model.images.size();
        Image& image = model.images[index];
        const Eigen::Vector3d in_camera =
            image.cam_from_world.rotation * point.position + image.cam_from_world.translation;
        const Eigen::Vector3d to_camera = image.cam_from_world.Center() - point.position;
        if (in_camera.z() < 0.1 || (on_ball && to_camera.normalized().dot(unit) < 0.3)) continue;
        const double x = Focal() * in_camera.x() / in_camera.z() + width_ / 2.0;
        const double y = Focal() * in_camera.y() / in_camera.z() + height_ / 2.0;
        if (x < 2 || y < 2 || x > width_ - 2 || y > height_ - 2) continue;
        const Eigen::Vector3d center = image.cam_from_world.Center();
        uint8_t rgb[3];
        // What the camera sees there must be the point, not the ball in front of it.
        if (Shade(center, (point.position - center).normalized(), rgb) != on_ball) continue;
        point.color = {rgb[0], rgb[1], rgb[2]};
        point.track.push_back({image.id, static_cast<uint32_t>(image.points.size())});
        image.points.push_back({x, y, point.id});
      }
      if (point.track.size() < 2) {
        for (const auto& seen : point.track) model.images[seen.image_id - 1].points.pop_back();
        continue;
      }
      model.points.push_back(point);
    }
    WriteReconstruction(folder, model, ModelFormat::kBinary);
  }

  const int width_, height_, num_points_;
};

}  // namespace semfoam
