// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/colmap/camera_models.h"

#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace semfoam {

// A COLMAP model (a "sparse reconstruction"), as COLMAP's documentation describes its files: those
// of 3.8 and, since 3.12, rigs and frames. All values and their order are kept as in the files, so
// that reading and writing back gives the same bytes.

inline constexpr uint64_t kNoPoint3D = std::numeric_limits<uint64_t>::max();

// x_target = rotation * x_source + translation. The rotation is stored as in the file, with unit
// length to 1e-3; use UnitRotation() for computations.
struct Pose {
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  Eigen::Quaterniond UnitRotation() const { return rotation.normalized(); }
  // Returns the target frame's origin in the source frame: -R^T t.
  Eigen::Vector3d Center() const { return UnitRotation().conjugate() * -translation; }
};

// A feature of an image, and the point that it was triangulated to.
struct Point2D {
  // Position in pixels.
  double x = 0;
  double y = 0;
  uint64_t point3d_id = kNoPoint3D;
};

// A registered image.
struct Image {
  uint32_t id = 0;
  uint32_t camera_id = 0;
  // Path relative to the image folder, with '/' between folders.
  std::string name;
  // For models with rigs, the product of the frame's and the sensor's pose (CheckRigPoses).
  Pose cam_from_world;
  std::vector<Point2D> points;
};

// One observation of a point: feature `point2d_index` of an image. The index is not checked and may
// be out of range in models of other programs.
struct TrackElement {
  uint32_t image_id = 0;
  uint32_t point2d_index = 0;
};

// A triangulated point.
struct Point3D {
  uint64_t id = 0;
  // World frame; may be non-finite in the file.
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  // Display values.
  Eigen::Matrix<uint8_t, 3, 1> color = Eigen::Matrix<uint8_t, 3, 1>::Zero();
  // Mean reprojection error in pixels; -1: unknown.
  double error = 0;
  std::vector<TrackElement> track;
};

enum class SensorType : int32_t { kInvalid = -1, kCamera = 0, kImu = 1 };

struct Sensor {
  SensorType type = SensorType::kInvalid;
  uint32_t id = 0;
};

// A sensor on a rig other than the reference one.
struct RigSensor {
  Sensor sensor;
  std::optional<Pose> sensor_from_rig;
};

// Sensors with fixed relative poses.
struct Rig {
  uint32_t id = 0;
  // Nothing: a rig without sensors.
  std::optional<Sensor> reference;
  std::vector<RigSensor> others;
};

// The data of one sensor of a rig at one time.
struct FrameData {
  Sensor sensor;
  // Id of the image, for a camera.
  uint64_t id = 0;
};

// The pose of a rig at one time, and the data of its sensors.
struct Frame {
  uint32_t id = 0;
  uint32_t rig_id = 0;
  Pose rig_from_world;
  std::vector<FrameData> data;
};

// The content of a model.
struct Reconstruction {
  std::vector<Camera> cameras;
  std::vector<Image> images;
  std::vector<Point3D> points;
  // Nothing: the model has no such file.
  std::optional<std::vector<Rig>> rigs;
  std::optional<std::vector<Frame>> frames;
};

enum class ModelFormat { kBinary, kText };

// Returns the folder with the model's files: `path` itself, or `path`/0, `path`/sparse/0 or
// `path`/sparse. Throws UserError when none of them holds a model.
std::filesystem::path FindModelFolder(const std::filesystem::path& path);

// Reads the model in `folder`: binary where both formats are complete, as COLMAP does. Throws
// UserError, one sentence naming the file, when a file is missing, cut, over-counted, followed by
// other bytes, or inconsistent: a camera or image that is referred to but missing, an id or image
// name that occurs twice, a pose that is not finite or not a rotation, rigs and frames that do not
// agree with the images (CheckRigPoses), parameters that do not suit the camera model, an image
// name that leaves the image folder. Counts in a file are not trusted: memory is only allocated for
// records that exist.
Reconstruction ReadReconstruction(const std::filesystem::path& folder);

// Returns the number of registered images of a model. Reads only the count of a binary model, and
// checks it against the file's size alone. Throws UserError as ReadReconstruction does.
int64_t CountImages(const std::filesystem::path& folder);

// Returns the format that ReadReconstruction would choose. Throws UserError when neither is
// complete.
ModelFormat FindModelFormat(const std::filesystem::path& folder);

// Writes the model's files, each by means of OutputFile, and creates the folder if missing. Throws
// UserError when a file cannot be written, when the folder holds rigs or frames that are not this
// model's, or when a name cannot be written as text (a line break in it).
void WriteReconstruction(const std::filesystem::path& folder,
                         const Reconstruction& reconstruction,
                         ModelFormat format);

}  // namespace semfoam
