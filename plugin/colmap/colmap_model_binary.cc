// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/util/error.h"
#include "plugin/colmap/colmap_model_formats.h"

#include <algorithm>
#include <bit>
#include <cstring>

namespace semfoam {
namespace {

static_assert(std::endian::native == std::endian::little, "the files are little-endian");

// Walks over the records of one file, and knows where it is when the bytes run out.
class Cursor {
 public:
  Cursor(const std::filesystem::path& path, const std::string& bytes, const char* record_name)
      : path_(path), bytes_(bytes), record_name_(record_name) {
    Require(sizeof(uint64_t));
    num_records_ = Get<uint64_t>();
  }

  uint64_t num_records() const { return num_records_; }

  // Returns how many of the promised records could be in the bytes that are left: what may be
  // reserved.
  uint64_t PlausibleRecords(uint64_t least_record_size) const {
    return std::min(num_records_, Left() / least_record_size);
  }

  void StartRecord(uint64_t index) { record_ = index + 1; }

  // Throws unless `count` * `size` more bytes are there; then Get may fetch them.
  void Require(uint64_t size, uint64_t count = 1) const {
    if (count <= Left() / size) return;
    if (record_ == 0) {
      throw UserError(path_.string(),
                      ": ends at byte ",
                      bytes_.size(),
                      ", before its number of records; is the copy complete?");
    }
    // A damaged count may exceed what 64 bits can say in bytes.
    const bool countable = count <= UINT64_MAX / size;
    throw UserError(path_.string(),
                    ": ends at byte ",
                    bytes_.size(),
                    ", ",
                    record_name_,
                    " ",
                    record_,
                    " of ",
                    num_records_,
                    " needs ",
                    countable ? std::to_string(count * size - Left()) : "2^64 or",
                    " more bytes; is the copy complete?");
  }

  template <typename T>
  T Get() {
    T value;
    std::memcpy(&value, bytes_.data() + position_, sizeof(T));
    position_ += sizeof(T);
    return value;
  }

  // Quaternion (w, x, y, z), then translation: 7 doubles.
  Pose GetPose() {
    Pose pose;
    pose.rotation.w() = Get<double>();
    pose.rotation.x() = Get<double>();
    pose.rotation.y() = Get<double>();
    pose.rotation.z() = Get<double>();
    for (int i = 0; i < 3; ++i) pose.translation[i] = Get<double>();
    return pose;
  }

  std::string GetName() {
    const size_t end = bytes_.find('\0', position_);
    if (end == std::string::npos) {
      throw UserError(path_.string(),
                      ": ends at byte ",
                      bytes_.size(),
                      " within the name of ",
                      record_name_,
                      " ",
                      record_,
                      " of ",
                      num_records_,
                      "; is the copy complete?");
    }
    std::string name = bytes_.substr(position_, end - position_);
    position_ = end + 1;
    return name;
  }

  // A message about the present record, for values that cannot be.
  template <typename... Parts>
  [[noreturn]] void Fail(const Parts&... parts) const {
    throw UserError(
        path_.string(), ": ", record_name_, " ", record_, " of ", num_records_, parts...);
  }

  void Finish() const {
    if (Left() == 0) return;
    throw UserError(path_.string(),
                    ": has ",
                    Left(),
                    " bytes after the last of its ",
                    num_records_,
                    " records, where it should end; is it damaged, or of another program?");
  }

 private:
  uint64_t Left() const { return bytes_.size() - position_; }

  const std::filesystem::path& path_;
  const std::string& bytes_;
  const char* record_name_;
  uint64_t position_ = 0;
  uint64_t num_records_ = 0;
  uint64_t record_ = 0;  // counted from 1
};

constexpr uint64_t kPoseSize = 7 * sizeof(double);

SensorType GetSensorType(Cursor& cursor) {
  const int32_t type = cursor.Get<int32_t>();
  if (type < -1 || type > 1) {
    cursor.Fail(" has the sensor type ", type, ", where -1, 0 or 1 would be right; is it damaged?");
  }
  return static_cast<SensorType>(type);
}

Sensor GetSensor(Cursor& cursor) {
  Sensor sensor;
  sensor.type = GetSensorType(cursor);
  sensor.id = cursor.Get<uint32_t>();
  return sensor;
}

template <typename T>
void Put(std::string* out, const T& value) {
  out->append(reinterpret_cast<const char*>(&value), sizeof(T));
}

void PutPose(std::string* out, const Pose& pose) {
  Put(out, pose.rotation.w());
  Put(out, pose.rotation.x());
  Put(out, pose.rotation.y());
  Put(out, pose.rotation.z());
  for (int i = 0; i < 3; ++i) Put(out, pose.translation[i]);
}

void PutSensor(std::string* out, const Sensor& sensor) {
  Put(out, static_cast<int32_t>(sensor.type));
  Put(out, sensor.id);
}

}  // namespace

std::vector<Camera> ParseCamerasBinary(const std::filesystem::path& path,
                                       const std::string& bytes) {
  constexpr uint64_t kFixedSize = 4 + 4 + 8 + 8;
  Cursor cursor(path, bytes, "camera");
  std::vector<Camera> cameras;
  cameras.reserve(cursor.PlausibleRecords(kFixedSize));
  for (uint64_t i = 0; i < cursor.num_records(); ++i) {
    cursor.StartRecord(i);
    cursor.Require(kFixedSize);
    Camera& camera = cameras.emplace_back();
    camera.id = cursor.Get<uint32_t>();
    camera.model_id = cursor.Get<int32_t>();
    camera.width = cursor.Get<uint64_t>();
    camera.height = cursor.Get<uint64_t>();
    const CameraModel* model = FindCameraModel(camera.model_id);
    if (model == nullptr) {
      cursor.Fail(" (id ",
                  camera.id,
                  ") has the unknown camera model ",
                  camera.model_id,
                  ", where 0 to 17 would be right; is it damaged, or of a newer COLMAP?");
    }
    cursor.Require(sizeof(double), model->num_params);
    for (int k = 0; k < model->num_params; ++k) camera.params.push_back(cursor.Get<double>());
  }
  cursor.Finish();
  return cameras;
}

std::vector<Image> ParseImagesBinary(const std::filesystem::path& path, const std::string& bytes) {
  constexpr uint64_t kFixedSize = 4 + kPoseSize + 4;
  Cursor cursor(path, bytes, "image");
  std::vector<Image> images;
  images.reserve(cursor.PlausibleRecords(kFixedSize + 1 + 8));
  for (uint64_t i = 0; i < cursor.num_records(); ++i) {
    cursor.StartRecord(i);
    cursor.Require(kFixedSize);
    Image& image = images.emplace_back();
    image.id = cursor.Get<uint32_t>();
    image.cam_from_world = cursor.GetPose();
    image.camera_id = cursor.Get<uint32_t>();
    image.name = cursor.GetName();
    cursor.Require(sizeof(uint64_t));
    const uint64_t num_points = cursor.Get<uint64_t>();
    cursor.Require(3 * 8, num_points);
    image.points.resize(num_points);
    for (Point2D& point : image.points) {
      point.x = cursor.Get<double>();
      point.y = cursor.Get<double>();
      point.point3d_id = cursor.Get<uint64_t>();
    }
  }
  cursor.Finish();
  return images;
}

std::vector<Point3D> ParsePointsBinary(const std::filesystem::path& path,
                                       const std::string& bytes) {
  constexpr uint64_t kFixedSize = 8 + 3 * 8 + 3 + 8 + 8;
  Cursor cursor(path, bytes, "record");
  std::vector<Point3D> points;
  points.reserve(cursor.PlausibleRecords(kFixedSize));
  for (uint64_t i = 0; i < cursor.num_records(); ++i) {
    cursor.StartRecord(i);
    cursor.Require(kFixedSize);
    Point3D& point = points.emplace_back();
    point.id = cursor.Get<uint64_t>();
    for (int k = 0; k < 3; ++k) point.position[k] = cursor.Get<double>();
    for (int k = 0; k < 3; ++k) point.color[k] = cursor.Get<uint8_t>();
    point.error = cursor.Get<double>();
    const uint64_t track_length = cursor.Get<uint64_t>();
    cursor.Require(4 + 4, track_length);
    point.track.resize(track_length);
    for (TrackElement& element : point.track) {
      element.image_id = cursor.Get<uint32_t>();
      element.point2d_index = cursor.Get<uint32_t>();
    }
  }
  cursor.Finish();
  return points;
}

std::vector<Rig> ParseRigsBinary(const std::filesystem::path& path, const std::string& bytes) {
  Cursor cursor(path, bytes, "rig");
  std::vector<Rig> rigs;
  rigs.reserve(cursor.PlausibleRecords(4 + 4));
  for (uint64_t i = 0; i < cursor.num_records(); ++i) {
    cursor.StartRecord(i);
    cursor.Require(4 + 4);
    Rig& rig = rigs.emplace_back();
    rig.id = cursor.Get<uint32_t>();
    const uint32_t num_sensors = cursor.Get<uint32_t>();
    if (num_sensors == 0) continue;
    cursor.Require(4 + 4);
    rig.reference = GetSensor(cursor);
    for (uint32_t k = 1; k < num_sensors; ++k) {
      cursor.Require(4 + 4 + 1);
      RigSensor& other = rig.others.emplace_back();
      other.sensor = GetSensor(cursor);
      const uint8_t has_pose = cursor.Get<uint8_t>();
      if (has_pose > 1) {
        cursor.Fail(
            " has the flag ", int{has_pose}, ", where 0 or 1 would be right; is it damaged?");
      }
      if (has_pose == 0) continue;
      cursor.Require(kPoseSize);
      other.sensor_from_rig = cursor.GetPose();
    }
  }
  cursor.Finish();
  return rigs;
}

std::vector<Frame> ParseFramesBinary(const std::filesystem::path& path, const std::string& bytes) {
  constexpr uint64_t kFixedSize = 4 + 4 + kPoseSize + 4;
  Cursor cursor(path, bytes, "frame");
  std::vector<Frame> frames;
  frames.reserve(cursor.PlausibleRecords(kFixedSize));
  for (uint64_t i = 0; i < cursor.num_records(); ++i) {
    cursor.StartRecord(i);
    cursor.Require(kFixedSize);
    Frame& frame = frames.emplace_back();
    frame.id = cursor.Get<uint32_t>();
    frame.rig_id = cursor.Get<uint32_t>();
    frame.rig_from_world = cursor.GetPose();
    const uint32_t num_data = cursor.Get<uint32_t>();
    cursor.Require(4 + 4 + 8, num_data);
    frame.data.resize(num_data);
    for (FrameData& data : frame.data) {
      data.sensor = GetSensor(cursor);
      data.id = cursor.Get<uint64_t>();
    }
  }
  cursor.Finish();
  return frames;
}

std::string CamerasToBinary(const std::vector<Camera>& cameras) {
  std::string out;
  Put(&out, uint64_t{cameras.size()});
  for (const Camera& camera : cameras) {
    Put(&out, camera.id);
    Put(&out, int32_t{camera.model_id});
    Put(&out, camera.width);
    Put(&out, camera.height);
    for (const double parameter : camera.params) Put(&out, parameter);
  }
  return out;
}

std::string ImagesToBinary(const std::vector<Image>& images) {
  std::string out;
  Put(&out, uint64_t{images.size()});
  for (const Image& image : images) {
    Put(&out, image.id);
    PutPose(&out, image.cam_from_world);
    Put(&out, image.camera_id);
    out.append(image.name.c_str(), image.name.size() + 1);
    Put(&out, uint64_t{image.points.size()});
    for (const Point2D& point : image.points) {
      Put(&out, point.x);
      Put(&out, point.y);
      Put(&out, point.point3d_id);
    }
  }
  return out;
}

std::string PointsToBinary(const std::vector<Point3D>& points) {
  std::string out;
  Put(&out, uint64_t{points.size()});
  for (const Point3D& point : points) {
    Put(&out, point.id);
    for (int k = 0; k < 3; ++k) Put(&out, point.position[k]);
    for (int k = 0; k < 3; ++k) Put(&out, point.color[k]);
    Put(&out, point.error);
    Put(&out, uint64_t{point.track.size()});
    for (const TrackElement& element : point.track) {
      Put(&out, element.image_id);
      Put(&out, element.point2d_index);
    }
  }
  return out;
}

std::string RigsToBinary(const std::vector<Rig>& rigs) {
  std::string out;
  Put(&out, uint64_t{rigs.size()});
  for (const Rig& rig : rigs) {
    Put(&out, rig.id);
    Put(&out, rig.reference ? static_cast<uint32_t>(1 + rig.others.size()) : uint32_t{0});
    if (!rig.reference) continue;
    PutSensor(&out, *rig.reference);
    for (const RigSensor& other : rig.others) {
      PutSensor(&out, other.sensor);
      Put(&out, static_cast<uint8_t>(other.sensor_from_rig.has_value()));
      if (other.sensor_from_rig) PutPose(&out, *other.sensor_from_rig);
    }
  }
  return out;
}

std::string FramesToBinary(const std::vector<Frame>& frames) {
  std::string out;
  Put(&out, uint64_t{frames.size()});
  for (const Frame& frame : frames) {
    Put(&out, frame.id);
    Put(&out, frame.rig_id);
    PutPose(&out, frame.rig_from_world);
    Put(&out, static_cast<uint32_t>(frame.data.size()));
    for (const FrameData& data : frame.data) {
      PutSensor(&out, data.sensor);
      Put(&out, data.id);
    }
  }
  return out;
}

}  // namespace semfoam
