// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/views/trajectory.h"

#include "foam/util/error.h"
#include "foam/util/input_file.h"
#include "foam/util/json_file.h"
#include "plugin/colmap/camera_rays.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include <Eigen/Eigenvalues>
#include <glog/logging.h>
#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using Eigen::Vector3d;
using std::numbers::pi;

constexpr int kDefaultFrames = 60;
constexpr int kMaxFrames = 100'000;
constexpr int kMaxWidth = 16'384;
constexpr double kWidestGap = pi / 2;

double Quantile(std::vector<double> values, double share) {
  CHECK(!values.empty());
  std::sort(values.begin(), values.end());
  return values[static_cast<size_t>(std::lround(share * static_cast<double>(values.size() - 1)))];
}

Vector3d CenterOf(const PhotoRecord& photo) { return PoseOf(photo).Center(); }

// Returns the upward direction of the photos. Cameras are usually held level, so it is the
// direction most nearly perpendicular to the sideways axes of all cameras. (The mean of the upward
// directions is tilted where all cameras look down from one side.) It is the mean where the
// sideways axes do not determine it, because all are alike, or where they contradict the mean, as
// in photos in portrait orientation.
Vector3d UpOf(const std::vector<PhotoRecord>& photos) {
  Vector3d sum = Vector3d::Zero();
  Eigen::Matrix3d sideways = Eigen::Matrix3d::Zero();
  for (const PhotoRecord& photo : photos) {
    const Eigen::Quaterniond world_from_cam = photo.cam_from_world_rotation.conjugate();
    sum -= world_from_cam * Vector3d::UnitY();
    const Vector3d side = world_from_cam * Vector3d::UnitX();
    sideways += side * side.transpose();
  }
  const auto count = static_cast<double>(photos.size());
  if (sum.norm() < 1e-3 * count) {
    return photos.front().cam_from_world_rotation.conjugate() * -Vector3d::UnitY();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(sideways);
  Vector3d up = solver.eigenvectors().col(0);
  if (up.dot(sum) < 0) up = -up;
  const bool is_told = solver.eigenvalues()[1] > 0.01 * count && up.dot(sum.normalized()) > 0.7;
  return is_told ? up : sum.normalized();
}

Pose LookAt(const Vector3d& position, const Vector3d& target, const Vector3d& up) {
  const Vector3d forward = (target - position).normalized();
  Vector3d right = forward.cross(up);
  // Straight up or down there is no right; any will do.
  if (right.norm() < 1e-9) right = forward.unitOrthogonal();
  right.normalize();
  Eigen::Matrix3d cam_from_world;
  cam_from_world << right.transpose(), forward.cross(right).transpose(), forward.transpose();
  Pose pose;
  pose.rotation = Eigen::Quaterniond(cam_from_world).normalized();
  pose.translation = -(pose.rotation * position);
  return pose;
}

Camera Pinhole(int width, int height, double focal_length) {
  Camera camera;
  camera.model_id = FindCameraModel("PINHOLE")->id;
  camera.width = width;
  camera.height = height;
  camera.params = {focal_length, focal_length, width / 2.0, height / 2.0};
  return camera;
}

// Returns the first photo's field of view, undistorted, its principal point in the middle.
Camera CameraLike(const PhotoRecord& photo, const fs::path& foam_path, int width) {
  const Camera plain = WithoutDistortion(CameraOf(photo, foam_path));
  const double scale = width > 0 ? static_cast<double>(width) / photo.width : 1;
  const auto scaled = [&](int pixels) {
    return std::max(1, static_cast<int>(std::lround(scale * pixels)));
  };
  return Pinhole(scaled(photo.width), scaled(photo.height), scale * plain.params[0]);
}

// Horizontal half angle of the camera, or its vertical one where that is less.
double NarrowHalfAngle(const Camera& camera) {
  const auto narrow = static_cast<double>(std::min(camera.width, camera.height));
  return std::atan(narrow / 2 / camera.params[0]);
}

// Where the cameras are as seen from `middle`, in axes of which the third is up.
struct Surroundings {
  std::vector<double> distances;
  std::vector<double> elevations;  // radians, above the horizon
  std::vector<double> azimuths;    // radians
  Eigen::Matrix3d world_of_axes;
};

Surroundings SurroundingsOf(const std::vector<PhotoRecord>& photos, const Vector3d& middle) {
  Surroundings around;
  const Vector3d up = UpOf(photos);
  const Vector3d side = up.unitOrthogonal();
  around.world_of_axes << side, up.cross(side), up;
  for (const PhotoRecord& photo : photos) {
    const Vector3d arm = around.world_of_axes.transpose() * (CenterOf(photo) - middle);
    around.distances.push_back(arm.norm());
    around.elevations.push_back(std::atan2(arm.z(), std::hypot(arm.x(), arm.y())));
    around.azimuths.push_back(std::atan2(arm.y(), arm.x()));
  }
  return around;
}

// What of the circle the cameras cover, from `begin` on.
struct Arc {
  double begin = 0;
  double length = 0;  // 2 pi: all of it
};

Arc CoveredArc(std::vector<double> azimuths) {
  const double first = azimuths.front();
  std::sort(azimuths.begin(), azimuths.end());
  Arc arc{azimuths.front(), azimuths.back() - azimuths.front()};
  double gap = 2 * pi - arc.length;
  for (size_t i = 1; i < azimuths.size(); ++i) {
    if (azimuths[i] - azimuths[i - 1] <= gap) continue;
    gap = azimuths[i] - azimuths[i - 1];
    arc = {azimuths[i], 2 * pi - gap};
  }
  if (gap <= kWidestGap) return {first, 2 * pi};
  return arc;
}

// After `turns` (0..) around: on along a full circle, there and back along a part of one.
double AzimuthAt(const Arc& arc, double turns) {
  if (arc.length >= 2 * pi) return arc.begin + 2 * pi * turns;
  return arc.begin + arc.length * 0.5 * (1 + std::sin(2 * pi * turns));
}

// ---- a path from a file

Vector3d ReadVector(const Json& json, const std::string& what, const fs::path& path) {
  Vector3d vector;
  bool good = json.is_array() && json.size() == 3;
  for (int c = 0; good && c < 3; ++c) {
    good = json[c].is_number();
    if (good) vector[c] = json[c].get<double>();
  }
  if (good && vector.allFinite()) return vector;
  throw UserError(
      path.string(), ": ", what, " is ", Shortened(json.dump()), "; [x, y, z] would be right.");
}

double ReadNumber(const Json& json,
                  const char* key,
                  double low,
                  double high,
                  double otherwise,
                  const fs::path& path) {
  if (!json.contains(key)) return otherwise;
  const Json& value = json[key];
  if (value.is_number() && value.get<double>() >= low && value.get<double>() <= high) {
    return value.get<double>();
  }
  throw UserError(path.string(),
                  ": ",
                  key,
                  " is ",
                  Shortened(value.dump()),
                  "; a number from ",
                  low,
                  " to ",
                  high,
                  " would be right.");
}

int ReadWhole(const Json& json, const char* key, int high, int otherwise, const fs::path& path) {
  if (!json.contains(key)) return otherwise;
  if (const auto value = JsonInteger(json[key], 1, high)) return static_cast<int>(*value);
  throw UserError(path.string(),
                  ": ",
                  key,
                  " is ",
                  Shortened(json[key].dump()),
                  "; a whole number from 1 to ",
                  high,
                  " would be right.");
}

void RequireKnown(const Json& json, const std::set<std::string>& keys, const fs::path& path) {
  for (const auto& [key, value] : json.items()) {
    if (keys.contains(key)) continue;
    std::string known;
    for (const std::string& one : keys) known += (known.empty() ? "" : ", ") + one;
    throw UserError(
        path.string(), ": has '", Shortened(key), "', where only ", known, " would be right.");
  }
}

struct Keyframe {
  Vector3d position;
  Vector3d look_at;
  Vector3d up;
};

std::vector<Keyframe> ReadKeyframes(const Json& json, const Model& model, const fs::path& path) {
  if (!json.contains("keyframes") || !json["keyframes"].is_array() || json["keyframes"].empty()) {
    throw UserError(path.string(),
                    ": has no keyframes; a list of {\"position\", \"look_at\"} would be right.");
  }
  std::vector<Keyframe> keyframes;
  for (const Json& one : json["keyframes"]) {
    const std::string name = "keyframe " + std::to_string(keyframes.size());
    if (!one.is_object() || !one.contains("position") || !one.contains("look_at")) {
      throw UserError(path.string(),
                      ": ",
                      name,
                      " lacks its position or look_at; both, as [x, y, z], would be right.");
    }
    RequireKnown(one, {"position", "look_at", "up"}, path);
    Keyframe keyframe;
    keyframe.position = ReadVector(one["position"], name + "'s position", path);
    keyframe.look_at = ReadVector(one["look_at"], name + "'s look_at", path);
    if (one.contains("up")) {
      keyframe.up = ReadVector(one["up"], name + "'s up", path);
    } else if (model.photos.empty()) {
      throw UserError(
          path.string(),
          ": ",
          name,
          " has no up, which the foam has no photos to tell; \"up\": [x, y, z] would be right.");
    } else {
      keyframe.up = UpOf(model.photos);
    }
    if (keyframe.up.norm() == 0 || keyframe.look_at == keyframe.position) {
      throw UserError(
          path.string(),
          ": ",
          name,
          " looks at where it is, or has an up of no length; other values would be right.");
    }
    keyframe.up.normalize();
    keyframes.push_back(keyframe);
  }
  return keyframes;
}

// Between b and c, 0 <= t <= 1.
Vector3d CatmullRom(
    const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& d, double t) {
  return b + 0.5 * t * ((c - a) + t * ((2 * a - 5 * b + 4 * c - d) + t * (3 * (b - c) + d - a)));
}

Pose PoseAt(const std::vector<Keyframe>& keyframes, bool closed, double place) {
  const auto n = static_cast<int64_t>(keyframes.size());
  const auto key = [&](int64_t k) -> const Keyframe& {
    return keyframes[closed ? (k + n) % n : std::clamp<int64_t>(k, 0, n - 1)];
  };
  const auto at = static_cast<int64_t>(place);
  const double t = place - static_cast<double>(at);
  const auto spline = [&](Vector3d Keyframe::*of) {
    return CatmullRom(key(at - 1).*of, key(at).*of, key(at + 1).*of, key(at + 2).*of, t);
  };
  return LookAt(spline(&Keyframe::position), spline(&Keyframe::look_at), spline(&Keyframe::up));
}

// Returns the poses of the frames on the way along the keyframes.
std::vector<Pose> PosesAlong(const std::vector<Keyframe>& keyframes,
                             bool closed,
                             int num_frames,
                             const fs::path& path) {
  std::vector<Pose> poses;
  const auto n = static_cast<double>(keyframes.size());
  for (int frame = 0; frame < num_frames; ++frame) {
    // A closed path ends one frame before it begins again, an open one in its last keyframe.
    const double share = closed ? static_cast<double>(frame) / num_frames
                                : static_cast<double>(frame) / std::max(num_frames - 1, 1);
    const Pose pose = PoseAt(keyframes, closed, share * (closed ? n : n - 1));
    if (!pose.rotation.coeffs().allFinite() || !pose.translation.allFinite()) {
      throw UserError(path.string(),
                      ": in frame ",
                      frame,
                      " the camera would look at where it is, or be too far away; keyframes whose "
                      "position and look_at stay apart would be right.");
    }
    poses.push_back(pose);
  }
  return poses;
}

// The file's camera; what the file does not say is as the photos have it. `wanted_width` pixels
// wide, where that is not 0.
Camera ReadCamera(const Json& json, const Model& model, int wanted_width, const fs::path& path) {
  const bool has_camera = json.contains("width") && json.contains("height") && json.contains("fov");
  if (!has_camera && model.photos.empty()) {
    throw UserError(
        path.string(),
        ": lacks width, height or fov, which the foam has no photos to tell; all three would "
        "be right.");
  }
  const Camera like = has_camera ? Pinhole(1, 1, 1) : CameraLike(model.photos.front(), path, 0);
  const int width = ReadWhole(json, "width", kMaxWidth, static_cast<int>(like.width), path);
  const int height = ReadWhole(json, "height", kMaxWidth, static_cast<int>(like.height), path);
  const double like_fov =
      360 / pi * std::atan(static_cast<double>(like.width) / 2 / like.params[0]);
  const double fov = ReadNumber(json, "fov", 1, 170, like_fov, path);
  const double scale = wanted_width > 0 ? static_cast<double>(wanted_width) / width : 1;
  const int columns = std::max(1, static_cast<int>(std::lround(scale * width)));
  const int rows = std::max(1, static_cast<int>(std::lround(scale * height)));
  if (columns > kMaxWidth || rows > kMaxWidth) {
    throw UserError(path.string(),
                    ": frames of ",
                    columns,
                    " x ",
                    rows,
                    " pixels are too large; at most ",
                    kMaxWidth,
                    " a side would be right.");
  }
  return Pinhole(columns, rows, columns / 2.0 / std::tan(fov * pi / 360));
}

}  // namespace

Trajectory MakeTrajectory(const Model& model,
                          const fs::path& foam_path,
                          const std::optional<Eigen::AlignedBox3d>& box,
                          const TrajectoryOptions& options) {
  CHECK(options.path == "orbit" || options.path == "spiral");
  if (model.photos.empty()) {
    throw UserError(foam_path.string(),
                    ": has no photos, so nothing says from where to look; a trajectory from a JSON "
                    "file would be right.");
  }
  Trajectory trajectory;
  trajectory.camera = CameraLike(model.photos.front(), foam_path, options.width);
  const Vector3d middle =
      box.has_value() ? Vector3d(box->center()) : model.world_from_normalized.translation;
  const Surroundings around = SurroundingsOf(model.photos, middle);
  double distance = Quantile(around.distances, 0.5);
  if (box.has_value()) {
    // The ball around the box touches a cone of four fifths of the view.
    distance = 0.5 * box->diagonal().norm() / std::sin(0.8 * NarrowHalfAngle(trajectory.camera));
  }
  if (!(distance > 0)) distance = model.world_from_normalized.scale;
  const Arc arc = CoveredArc(around.azimuths);
  const bool is_spiral = options.path == "spiral";
  const int num_frames = options.num_frames > 0 ? options.num_frames : kDefaultFrames;
  for (int frame = 0; frame < num_frames; ++frame) {
    const double share = static_cast<double>(frame) / num_frames;
    const double elevation =
        is_spiral
            ? std::lerp(Quantile(around.elevations, 0.1), Quantile(around.elevations, 0.9), share)
            : Quantile(around.elevations, 0.5);
    const double reach = distance * (is_spiral ? std::lerp(1.2, 0.8, share) : 1);
    const double azimuth = AzimuthAt(arc, is_spiral ? 2 * share : share);
    const Vector3d arm(std::cos(elevation) * std::cos(azimuth),
                       std::cos(elevation) * std::sin(azimuth),
                       std::sin(elevation));
    trajectory.cam_from_world.push_back(
        LookAt(middle + reach * (around.world_of_axes * arm), middle, around.world_of_axes.col(2)));
  }
  return trajectory;
}

Trajectory ReadTrajectory(const fs::path& path,
                          const Model& model,
                          const TrajectoryOptions& options) {
  const Json json =
      ParseJson(path, ReadFileBytes(path, "a trajectory (orbit, spiral or a JSON file)"));
  if (!json.is_object()) {
    throw UserError(path.string(),
                    ": is no trajectory; orbit, spiral or a JSON file with keyframes would be "
                    "right.");
  }
  RequireKnown(
      json, {"version", "keyframes", "frames", "fps", "closed", "width", "height", "fov"}, path);
  if (!json.contains("version") || json["version"] != 1) {
    throw UserError(path.string(), ": has no \"version\": 1, the only one there is.");
  }
  const std::vector<Keyframe> keyframes = ReadKeyframes(json, model, path);
  if (json.contains("closed") && !json["closed"].is_boolean()) {
    throw UserError(path.string(),
                    ": closed is ",
                    Shortened(json["closed"].dump()),
                    "; true or false would be right.");
  }
  const bool closed = json.value("closed", false);

  Trajectory trajectory;
  trajectory.camera = ReadCamera(json, model, options.width, path);
  trajectory.frames_per_second = ReadNumber(json, "fps", 1, 100, 24, path);
  int num_frames = ReadWhole(json, "frames", kMaxFrames, kDefaultFrames, path);
  if (options.num_frames > 0) num_frames = options.num_frames;
  trajectory.cam_from_world = PosesAlong(keyframes, closed, num_frames, path);
  return trajectory;
}

}  // namespace semfoam
