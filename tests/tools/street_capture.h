// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/util/parallel.h"
#include "foam/util/random.h"
#include "plugin/colmap/colmap_model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "tests/plugin/test_util.h"
#include "tests/street.h"
#include <Eigen/Geometry>

namespace semfoam {

// A COLMAP workspace of a drive along the street of tests/street.h: photos with noise, masks (1
// road, 2 wall, then a label for each house), SfM points with tracks. All of it is a function of
// its arguments and the seed.
class StreetCapture {
 public:
  // Photos stand at even distances, `photos_per_length` of them a unit of the street, and look
  // ahead, back and to both sides in turn.
  StreetCapture(int num_photos, int width, int height, int photos_per_length, uint64_t seed)
      : num_photos_(num_photos),
        width_(width),
        height_(height),
        length_(static_cast<double>(num_photos) / photos_per_length),
        spacing_(1.0 / photos_per_length),
        seed_(seed) {}

  void Write(const std::filesystem::path& workspace) const {
    ParallelForBlocks(num_photos_, 1, [&](int64_t photo, int64_t) {
      WritePhoto(workspace, static_cast<int>(photo));
    });
    WriteReconstruction(workspace / "sparse/0", Model(), ModelFormat::kBinary);
    std::ofstream names(workspace / "object_mask/labels.json");
    names << R"({"labels": {"1": "road", "2": "wall")";
    for (int house = 0; house < NumHouses(); ++house) {
      names << ", \"" << 3 + house << "\": \"house " << house << '"';
    }
    names << "}}\n";
  }

 private:
  struct Hit {
    double distance = std::numeric_limits<double>::infinity();
    Eigen::Vector3d place = Eigen::Vector3d::Zero();
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
    StreetPart part = StreetPart::kAir;
  };

  // How far a ray is followed along the street.
  static constexpr double kFar = 60;
  static constexpr int kPointsPerPhoto = 120;
  // Standard deviation of the photos' noise, in display values.
  static constexpr double kNoise = 0.01;

  double Focal() const { return 0.8 * width_; }
  int NumHouses() const { return static_cast<int>(std::ceil(length_ / kHouseSpacing)); }
  static std::string Name(int photo) {
    char name[32];
    std::snprintf(name, sizeof(name), "%06d.png", photo);
    return name;
  }

  Eigen::Vector3d Center(int photo) const {
    return {spacing_ * (photo + 0.5),
            0.2 + 0.15 * std::sin(0.7 * photo),
            0.35 + 0.08 * std::sin(1.9 * photo)};
  }

  // World to camera: x right, y down, z forward.
  static Eigen::Matrix3d Rotation(int photo) {
    constexpr std::array<double, 6> kTurns = {35, -90, 145, -35, 90, -145};
    const double turn = kTurns[photo % 6] * std::numbers::pi / 180;
    const Eigen::Vector3d forward =
        Eigen::Vector3d(std::cos(turn), std::sin(turn), -0.22).normalized();
    const Eigen::Vector3d right = forward.cross(Eigen::Vector3d::UnitZ()).normalized();
    Eigen::Matrix3d rotation;
    rotation << right.transpose(), forward.cross(right).transpose(), forward.transpose();
    return rotation;
  }

  // Where a ray meets the first surface of the street.
  Hit Cast(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const {
    Hit hit;
    const auto offer = [&](double distance,
                           const Eigen::Vector3d& normal,
                           StreetPart part,
                           const auto& is_inside) {
      if (!(distance > 1e-6 && distance < hit.distance && distance < kFar)) return;
      const Eigen::Vector3d place = origin + distance * direction;
      if (is_inside(place)) hit = {distance, place, normal, part};
    };
    const auto plane = [&](int axis, double at) {
      return direction[axis] == 0 ? -1.0 : (at - origin[axis]) / direction[axis];
    };
    const double end = kHouseSpacing * NumHouses();
    const auto along = [&](const Eigen::Vector3d& p) { return p.x() > 0 && p.x() < end; };
    offer(plane(2, 0), Eigen::Vector3d::UnitZ(), StreetPart::kRoad, [](const Eigen::Vector3d&) {
      return true;
    });
    offer(plane(1, kWallFront),
          -Eigen::Vector3d::UnitY(),
          StreetPart::kWall,
          [&](const Eigen::Vector3d& p) { return along(p) && p.z() > 0 && p.z() < kWallHeight; });
    offer(plane(1, kHouseFront),
          Eigen::Vector3d::UnitY(),
          StreetPart::kHouse,
          [&](const Eigen::Vector3d& p) {
            return along(p) && p.z() > 0 && p.z() < kHouseHeight &&
                   IsBesideHouse(static_cast<float>(p.x()));
          });
    if (direction.y() < 0 && direction.x() != 0) {
      // Sides of houses, seen through the gaps: those up to where the ray has left the houses' row.
      const double step = direction.x() > 0 ? kHouseSpacing : -kHouseSpacing;
      const double side = direction.x() > 0 ? kHouseBegin : kHouseEnd;
      double x = kHouseSpacing * std::floor(origin.x() / kHouseSpacing) + side;
      if ((x - origin.x()) * step < 0) x += step;
      for (; x > 0 && x < end; x += step) {
        const double distance = (x - origin.x()) / direction.x();
        if (distance > std::min(hit.distance, kFar)) break;
        offer(distance,
              {step > 0 ? -1.0 : 1.0, 0, 0},
              StreetPart::kHouse,
              [](const Eigen::Vector3d& p) {
                return p.y() < kHouseFront && p.y() > kHouseFront - 2 && p.z() > 0 &&
                       p.z() < kHouseHeight;
              });
      }
    }
    return hit;
  }

  // Value noise: cells of this many a unit, smooth between their corners, within [0, 1].
  double Noise(const Eigen::Vector3d& p, double frequency, uint64_t purpose) const {
    const Eigen::Vector3d q = frequency * p;
    const Eigen::Vector3d base = q.array().floor();
    const Eigen::Vector3d t = q - base;
    const Eigen::Vector3d s = t.array().square() * (3 - 2 * t.array());
    double sum = 0;
    for (int corner = 0; corner < 8; ++corner) {
      uint64_t key = 0;
      double weight = 1;
      for (int axis = 0; axis < 3; ++axis) {
        const int high = corner >> axis & 1;
        key = key * 0x100003 + static_cast<uint64_t>(static_cast<int64_t>(base[axis]) + high);
        weight *= high ? s[axis] : 1 - s[axis];
      }
      sum += weight * CounterRandom(seed_, purpose, key).Uniform();
    }
    return sum;
  }

  static double Mortar(double u, double v, double width, double height) {
    const double row = std::floor(v / height);
    const double shifted = u / width + 0.5 * (static_cast<int64_t>(row) & 1);
    const double du = std::abs(shifted - std::round(shifted)) * width;
    const double dv = std::abs(v / height - std::round(v / height)) * height;
    return std::min(du, dv) < 0.004 ? 1 : 0;
  }

  Eigen::Vector3d Color(const Hit& hit, const Eigen::Vector3d& direction) const {
    const Eigen::Vector3d& p = hit.place;
    if (hit.part == StreetPart::kAir) {
      const double up = std::clamp(direction.z(), 0.0, 1.0);
      return Eigen::Vector3d(0.85, 0.9, 0.95) - up * Eigen::Vector3d(0.5, 0.35, 0.1);
    }
    const double grain = 0.5 * Noise(p, 12, 1) + 0.3 * Noise(p, 40, 2) + 0.2 * Noise(p, 110, 3);
    const double light = 0.75 + 0.25 * hit.normal.dot(Eigen::Vector3d(0.3, 0.5, 0.81));
    Eigen::Vector3d color;
    if (hit.part == StreetPart::kRoad) {
      color = Eigen::Vector3d(0.35, 0.35, 0.37);
      const double dash = p.x() / 0.5 - std::floor(p.x() / 0.5);
      if (std::abs(p.y() - 0.25) < 0.02 && dash < 0.5) color = {0.9, 0.9, 0.85};
    } else if (hit.part == StreetPart::kWall) {
      const double tint = 0.3 * Noise(p, 3, 4);
      color = Mortar(p.x(), p.z(), 0.12, 0.05) > 0 ? Eigen::Vector3d(0.75, 0.73, 0.7)
                                                   : Eigen::Vector3d(0.6, 0.3 + tint, 0.22);
    } else {
      const double house = std::floor(p.x() / kHouseSpacing);
      CounterRandom paint(seed_, 5, static_cast<uint64_t>(house));
      for (double& channel : color) channel = 0.35 + 0.5 * paint.Uniform();
      const double u = AlongHouse(static_cast<float>(p.x())) / 0.24;
      const double v = p.z() / 0.3;
      const bool is_front = std::abs(hit.normal.y()) > 0.5;
      if (is_front && std::abs(u - std::round(u)) < 0.22 &&
          std::abs(v - std::floor(v) - 0.55) < 0.22) {
        color = {0.15, 0.17, 0.22};
      }
    }
    return light * (0.65 + 0.7 * grain) * color;
  }

  uint16_t Label(const Hit& hit) const {
    switch (hit.part) {
      case StreetPart::kRoad:
        return 1;
      case StreetPart::kWall:
        return 2;
      case StreetPart::kHouse:
        return static_cast<uint16_t>(3 + std::floor(hit.place.x() / kHouseSpacing));
      default:
        return 0;
    }
  }

  Eigen::Vector3d Direction(int photo, double x, double y) const {
    const Eigen::Vector3d in_camera((x - 0.5 * width_) / Focal(), (y - 0.5 * height_) / Focal(), 1);
    return (Rotation(photo).transpose() * in_camera).normalized();
  }

  void WritePhoto(const std::filesystem::path& workspace, int photo) const {
    std::vector<uint8_t> rgb, ids;
    rgb.reserve(size_t{3} * width_ * height_);
    ids.reserve(size_t{2} * width_ * height_);
    const Eigen::Vector3d center = Center(photo);
    CounterRandom noise(seed_, 6, static_cast<uint64_t>(photo));
    for (int y = 0; y < height_; ++y) {
      for (int x = 0; x < width_; ++x) {
        Eigen::Vector3d sum = Eigen::Vector3d::Zero();
        for (int sample = 0; sample < 4; ++sample) {
          const Eigen::Vector3d direction =
              Direction(photo, x + 0.25 + 0.5 * (sample & 1), y + 0.25 + 0.5 * (sample >> 1));
          sum += Color(Cast(center, direction), direction);
        }
        for (const double channel : sum) {
          const double value = 0.25 * channel + kNoise * noise.Normal();
          rgb.push_back(static_cast<uint8_t>(std::lround(255 * std::clamp(value, 0.0, 1.0))));
        }
        const uint16_t label = Label(Cast(center, Direction(photo, x + 0.5, y + 0.5)));
        ids.push_back(static_cast<uint8_t>(label >> 8));
        ids.push_back(static_cast<uint8_t>(label & 255));
      }
    }
    WritePng(workspace / "images" / Name(photo), width_, height_, 8, PNG_COLOR_TYPE_RGB, rgb);
    WritePng(
        workspace / "object_mask" / Name(photo), width_, height_, 16, PNG_COLOR_TYPE_GRAY, ids);
  }

  Reconstruction Model() const {
    Reconstruction model;
    Camera camera;
    camera.id = 1;
    camera.model_id = 1;
    camera.width = width_;
    camera.height = height_;
    camera.params = {Focal(), Focal(), 0.5 * width_, 0.5 * height_};
    model.cameras = {camera};
    for (int photo = 0; photo < num_photos_; ++photo) {
      Image image;
      image.id = static_cast<uint32_t>(photo + 1);
      image.camera_id = 1;
      image.name = Name(photo);
      const Eigen::Matrix3d rotation = Rotation(photo);
      image.cam_from_world.rotation = Eigen::Quaterniond(rotation);
      image.cam_from_world.translation = -rotation * Center(photo);
      model.images.push_back(image);
    }
    for (int photo = 0; photo < num_photos_; ++photo) {
      CounterRandom random(seed_, 7, static_cast<uint64_t>(photo));
      for (int k = 0; k < kPointsPerPhoto; ++k) {
        const double x = width_ * random.Uniform(), y = height_ * random.Uniform();
        const Eigen::Vector3d direction = Direction(photo, x, y);
        const Hit hit = Cast(Center(photo), direction);
        if (hit.distance > 4) continue;
        AddPoint(hit, Color(hit, direction), photo, random, &model);
      }
    }
    return model;
  }

  // Adds the point with its observations in all photos nearby that see it.
  void AddPoint(const Hit& hit,
                const Eigen::Vector3d& color,
                int photo,
                CounterRandom& random,
                Reconstruction* model) const {
    constexpr double kReach = 4;
    const int reach = static_cast<int>(kReach / spacing_);
    Point3D point;
    point.id = model->points.size() + 1;
    point.position = hit.place;
    for (int c = 0; c < 3; ++c) {
      point.color[c] = static_cast<uint8_t>(std::lround(255 * std::clamp(color[c], 0.0, 1.0)));
    }
    point.error = 0.3;
    for (int other = std::max(0, photo - reach); other <= std::min(num_photos_ - 1, photo + reach);
         ++other) {
      const Eigen::Vector3d to = hit.place - Center(other);
      const Eigen::Vector3d in_camera = Rotation(other) * to;
      if (in_camera.z() < 0.05 || to.norm() > kReach) continue;
      const double x = Focal() * in_camera.x() / in_camera.z() + 0.5 * width_;
      const double y = Focal() * in_camera.y() / in_camera.z() + 0.5 * height_;
      if (x < 0 || y < 0 || x >= width_ || y >= height_) continue;
      if (Cast(Center(other), to.normalized()).distance < to.norm() - 1e-3) continue;
      Image& image = model->images[other];
      point.track.push_back({image.id, static_cast<uint32_t>(image.points.size())});
      image.points.push_back({x + 0.3 * random.Normal(), y + 0.3 * random.Normal(), point.id});
    }
    if (point.track.size() >= 2) {
      model->points.push_back(point);
      return;
    }
    for (const TrackElement& element : point.track) {
      model->images[element.image_id - 1].points.pop_back();
    }
  }

  int num_photos_, width_, height_;
  double length_, spacing_;
  uint64_t seed_;
};

}  // namespace semfoam
