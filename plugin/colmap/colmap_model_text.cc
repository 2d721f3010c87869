// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/util/error.h"
#include "foam/util/input_file.h"
#include "plugin/colmap/colmap_model_formats.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <string_view>
#include <type_traits>
#include <utility>

namespace semfoam {
namespace {

constexpr std::string_view kBlanks = " \t\r\v\f";

std::string_view Trimmed(std::string_view text) {
  const size_t begin = text.find_first_not_of(kBlanks);
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(kBlanks) - begin + 1);
}

// The fields of one line, taken from the left.
class Fields {
 public:
  Fields(const std::filesystem::path& path, int64_t line_number, std::string_view line)
      : path_(path), line_number_(line_number), rest_(Trimmed(line)) {}

  bool Empty() const { return rest_.empty(); }

  std::string_view Word(const char* what) {
    if (rest_.empty()) Fail(" ends before ", what, "; is it complete?");
    const size_t end = std::min(rest_.find_first_of(kBlanks), rest_.size());
    const std::string_view word = rest_.substr(0, end);
    rest_ = Trimmed(rest_.substr(end));
    return word;
  }

  // All that is left of the line.
  std::string_view Rest(const char* what) {
    if (rest_.empty()) Fail(" ends before ", what, "; is it complete?");
    return std::exchange(rest_, std::string_view());
  }

  template <typename T>
  T Number(const char* what) {
    const std::string_view word = Word(what);
    // std::from_chars knows no plus sign.
    const std::string_view digits = word.starts_with('+') ? word.substr(1) : word;
    T value{};
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    if (error == std::errc::result_out_of_range && std::is_floating_point_v<T>) {
      Fail(" has ", what, " \"", Shortened(word), "\", which exceeds a double; is it damaged?");
    }
    if (error != std::errc() || end != digits.data() + digits.size()) {
      Fail(" has ",
           what,
           " \"",
           Shortened(word),
           "\", where ",
           std::is_floating_point_v<T> ? "a number" : "a whole number in range",
           " would be right.");
    }
    return value;
  }

  template <typename... Parts>
  [[noreturn]] void Fail(const Parts&... parts) const {
    throw UserError(path_.string(), ": line ", line_number_, parts...);
  }

  void Finish() const {
    if (!rest_.empty()) Fail(" goes on with \"", Shortened(rest_), "\", where it should end.");
  }

 private:
  const std::filesystem::path& path_;
  int64_t line_number_;
  std::string_view rest_;
};

class Lines {
 public:
  explicit Lines(std::string_view text) : rest_(WithoutByteOrderMark(text)) {}

  // The next line, whatever is in it. False at the end.
  bool NextRaw(std::string_view* line) {
    if (rest_.empty()) return false;
    const size_t end = rest_.find('\n');
    *line = rest_.substr(0, end);
    rest_ = end == std::string_view::npos ? std::string_view() : rest_.substr(end + 1);
    ++number_;
    return true;
  }

  // The next line that is neither blank nor a comment.
  bool NextRecord(std::string_view* line) {
    while (NextRaw(line)) {
      *line = Trimmed(*line);
      if (!line->empty() && line->front() != '#') return true;
    }
    return false;
  }

  int64_t number() const { return number_; }

 private:
  std::string_view rest_;
  int64_t number_ = 0;
};

Pose GetPose(Fields& fields) {
  Pose pose;
  pose.rotation.w() = fields.Number<double>("QW");
  pose.rotation.x() = fields.Number<double>("QX");
  pose.rotation.y() = fields.Number<double>("QY");
  pose.rotation.z() = fields.Number<double>("QZ");
  pose.translation.x() = fields.Number<double>("TX");
  pose.translation.y() = fields.Number<double>("TY");
  pose.translation.z() = fields.Number<double>("TZ");
  return pose;
}

constexpr std::array<std::pair<std::string_view, SensorType>, 3> kSensorNames = {
    {{"INVALID", SensorType::kInvalid},
     {"CAMERA", SensorType::kCamera},
     {"IMU", SensorType::kImu}}};

Sensor GetSensor(Fields& fields) {
  const std::string_view word = fields.Word("SENSOR_TYPE");
  for (const auto& [name, type] : kSensorNames) {
    if (word == name) return {type, fields.Number<uint32_t>("SENSOR_ID")};
  }
  fields.Fail(
      " has the sensor type \"", Shortened(word), "\", where CAMERA or IMU would be right.");
}

// 17 digits hold every double, and are what COLMAP writes.
void PutNumber(std::string* out, double value) {
  char buffer[40];
  const auto result =
      std::to_chars(buffer, buffer + sizeof(buffer), value, std::chars_format::general, 17);
  out->append(buffer, result.ptr);
}

void PutNumber(std::string* out, uint64_t value) { *out += std::to_string(value); }

// A blank, then the number.
template <typename T>
void PutNext(std::string* out, T value) {
  *out += ' ';
  PutNumber(out, value);
}

void PutPose(std::string* out, const Pose& pose) {
  PutNext(out, pose.rotation.w());
  PutNext(out, pose.rotation.x());
  PutNext(out, pose.rotation.y());
  PutNext(out, pose.rotation.z());
  for (int i = 0; i < 3; ++i) PutNext(out, pose.translation[i]);
}

void PutSensor(std::string* out, const Sensor& sensor) {
  for (const auto& [name, type] : kSensorNames) {
    if (sensor.type == type) *out += " " + std::string(name);
  }
  PutNext(out, uint64_t{sensor.id});
}

}  // namespace

std::vector<Camera> ParseCamerasText(const std::filesystem::path& path, const std::string& bytes) {
  std::vector<Camera> cameras;
  Lines lines(bytes);
  for (std::string_view line; lines.NextRecord(&line);) {
    Fields fields(path, lines.number(), line);
    Camera& camera = cameras.emplace_back();
    camera.id = fields.Number<uint32_t>("CAMERA_ID");
    const std::string_view name = fields.Word("MODEL");
    const CameraModel* model = FindCameraModel(name);
    if (model == nullptr) {
      fields.Fail(" has the unknown camera model \"",
                  Shortened(name),
                  "\", where one of COLMAP's would be right, such as SIMPLE_RADIAL.");
    }
    camera.model_id = model->id;
    camera.width = fields.Number<uint64_t>("WIDTH");
    camera.height = fields.Number<uint64_t>("HEIGHT");
    while (!fields.Empty()) camera.params.push_back(fields.Number<double>("a parameter"));
    if (camera.params.size() != static_cast<size_t>(model->num_params)) {
      fields.Fail(" gives ",
                  camera.params.size(),
                  " parameters for camera ",
                  camera.id,
                  ", where the model ",
                  name,
                  " has ",
                  model->num_params,
                  ".");
    }
  }
  return cameras;
}

std::vector<Image> ParseImagesText(const std::filesystem::path& path, const std::string& bytes) {
  std::vector<Image> images;
  Lines lines(bytes);
  for (std::string_view line; lines.NextRecord(&line);) {
    Fields fields(path, lines.number(), line);
    Image& image = images.emplace_back();
    image.id = fields.Number<uint32_t>("IMAGE_ID");
    image.cam_from_world = GetPose(fields);
    image.camera_id = fields.Number<uint32_t>("CAMERA_ID");
    image.name = fields.Rest("NAME");
    // The second line is part of the record even when it is blank; editors cut a blank one off the
    // end of the file.
    if (!lines.NextRaw(&line)) break;
    Fields points(path, lines.number(), line);
    while (!points.Empty()) {
      Point2D& point = image.points.emplace_back();
      point.x = points.Number<double>("X");
      point.y = points.Number<double>("Y");
      const int64_t id = points.Number<int64_t>("POINT3D_ID");
      if (id < -1) points.Fail(" has POINT3D_ID ", id, ", where -1 or more would be right.");
      point.point3d_id = id == -1 ? kNoPoint3D : static_cast<uint64_t>(id);
    }
  }
  return images;
}

std::vector<Point3D> ParsePointsText(const std::filesystem::path& path, const std::string& bytes) {
  std::vector<Point3D> points;
  Lines lines(bytes);
  for (std::string_view line; lines.NextRecord(&line);) {
    Fields fields(path, lines.number(), line);
    Point3D& point = points.emplace_back();
    point.id = fields.Number<uint64_t>("POINT3D_ID");
    for (int k = 0; k < 3; ++k) point.position[k] = fields.Number<double>("XYZ");
    for (int k = 0; k < 3; ++k) point.color[k] = fields.Number<uint8_t>("RGB");
    point.error = fields.Number<double>("ERROR");
    while (!fields.Empty()) {
      TrackElement& element = point.track.emplace_back();
      element.image_id = fields.Number<uint32_t>("IMAGE_ID");
      element.point2d_index = fields.Number<uint32_t>("POINT2D_IDX");
    }
  }
  return points;
}

std::vector<Rig> ParseRigsText(const std::filesystem::path& path, const std::string& bytes) {
  std::vector<Rig> rigs;
  Lines lines(bytes);
  for (std::string_view line; lines.NextRecord(&line);) {
    Fields fields(path, lines.number(), line);
    Rig& rig = rigs.emplace_back();
    rig.id = fields.Number<uint32_t>("RIG_ID");
    const uint32_t num_sensors = fields.Number<uint32_t>("NUM_SENSORS");
    if (num_sensors > 0) rig.reference = GetSensor(fields);
    for (uint32_t k = 1; k < num_sensors; ++k) {
      RigSensor& other = rig.others.emplace_back();
      other.sensor = GetSensor(fields);
      const uint32_t has_pose = fields.Number<uint32_t>("HAS_POSE");
      if (has_pose > 1) fields.Fail(" has HAS_POSE ", has_pose, ", where 0 or 1 would be right.");
      if (has_pose == 1) other.sensor_from_rig = GetPose(fields);
    }
    fields.Finish();
  }
  return rigs;
}

std::vector<Frame> ParseFramesText(const std::filesystem::path& path, const std::string& bytes) {
  std::vector<Frame> frames;
  Lines lines(bytes);
  for (std::string_view line; lines.NextRecord(&line);) {
    Fields fields(path, lines.number(), line);
    Frame& frame = frames.emplace_back();
    frame.id = fields.Number<uint32_t>("FRAME_ID");
    frame.rig_id = fields.Number<uint32_t>("RIG_ID");
    frame.rig_from_world = GetPose(fields);
    const uint32_t num_data = fields.Number<uint32_t>("NUM_DATA_IDS");
    for (uint32_t k = 0; k < num_data; ++k) {
      FrameData& data = frame.data.emplace_back();
      data.sensor = GetSensor(fields);
      data.id = fields.Number<uint64_t>("DATA_ID");
    }
    fields.Finish();
  }
  return frames;
}

std::string CamerasToText(const std::vector<Camera>& cameras) {
  std::string out = "# One camera a line: CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]\n";
  out += "# Number of cameras: " + std::to_string(cameras.size()) + "\n";
  for (const Camera& camera : cameras) {
    PutNumber(&out, uint64_t{camera.id});
    out += ' ';
    out += FindCameraModel(camera.model_id)->name;
    PutNext(&out, camera.width);
    PutNext(&out, camera.height);
    for (const double parameter : camera.params) PutNext(&out, parameter);
    out += '\n';
  }
  return out;
}

std::string ImagesToText(const std::vector<Image>& images) {
  std::string out =
      "# Two lines an image: IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME, then its points as (X Y "
      "POINT3D_ID), which may be none\n";
  out += "# Number of images: " + std::to_string(images.size()) + "\n";
  for (const Image& image : images) {
    PutNumber(&out, uint64_t{image.id});
    PutPose(&out, image.cam_from_world);
    PutNext(&out, uint64_t{image.camera_id});
    out += " " + image.name + "\n";
    bool first = true;
    for (const Point2D& point : image.points) {
      if (!first) out += ' ';
      first = false;
      PutNumber(&out, point.x);
      PutNext(&out, point.y);
      if (point.point3d_id == kNoPoint3D) {
        out += " -1";
      } else {
        PutNext(&out, point.point3d_id);
      }
    }
    out += '\n';
  }
  return out;
}

std::string PointsToText(const std::vector<Point3D>& points) {
  std::string out =
      "# One point a line: POINT3D_ID X Y Z R G B ERROR, then its track as (IMAGE_ID "
      "POINT2D_IDX)\n";
  out += "# Number of points: " + std::to_string(points.size()) + "\n";
  for (const Point3D& point : points) {
    PutNumber(&out, point.id);
    for (int k = 0; k < 3; ++k) PutNext(&out, point.position[k]);
    for (int k = 0; k < 3; ++k) PutNext(&out, uint64_t{point.color[k]});
    PutNext(&out, point.error);
    for (const TrackElement& element : point.track) {
      PutNext(&out, uint64_t{element.image_id});
      PutNext(&out, uint64_t{element.point2d_index});
    }
    out += '\n';
  }
  return out;
}

std::string RigsToText(const std::vector<Rig>& rigs) {
  std::string out =
      "# One rig a line: RIG_ID NUM_SENSORS REF_SENSOR_TYPE REF_SENSOR_ID, then the other sensors "
      "as (SENSOR_TYPE SENSOR_ID HAS_POSE [QW QX QY QZ TX TY TZ])\n";
  out += "# Number of rigs: " + std::to_string(rigs.size()) + "\n";
  for (const Rig& rig : rigs) {
    PutNumber(&out, uint64_t{rig.id});
    PutNext(&out, uint64_t{rig.reference ? 1 + rig.others.size() : 0});
    if (rig.reference) {
      PutSensor(&out, *rig.reference);
      for (const RigSensor& other : rig.others) {
        PutSensor(&out, other.sensor);
        PutNext(&out, uint64_t{other.sensor_from_rig.has_value()});
        if (other.sensor_from_rig) PutPose(&out, *other.sensor_from_rig);
      }
    }
    out += '\n';
  }
  return out;
}

std::string FramesToText(const std::vector<Frame>& frames) {
  std::string out =
      "# One frame a line: FRAME_ID RIG_ID QW QX QY QZ TX TY TZ (rig from world) NUM_DATA_IDS, "
      "then the data as (SENSOR_TYPE SENSOR_ID DATA_ID)\n";
  out += "# Number of frames: " + std::to_string(frames.size()) + "\n";
  for (const Frame& frame : frames) {
    PutNumber(&out, uint64_t{frame.id});
    PutNext(&out, uint64_t{frame.rig_id});
    PutPose(&out, frame.rig_from_world);
    PutNext(&out, uint64_t{frame.data.size()});
    for (const FrameData& data : frame.data) {
      PutSensor(&out, data.sensor);
      PutNext(&out, data.id);
    }
    out += '\n';
  }
  return out;
}

}  // namespace semfoam
