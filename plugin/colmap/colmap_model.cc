// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/colmap/colmap_model.h"

#include "foam/util/error.h"
#include "foam/util/input_file.h"
#include "foam/util/output_file.h"
#include "foam/util/photo_name.h"
#include "plugin/colmap/colmap_model_formats.h"
#include "plugin/colmap/rig_poses.h"

#include <cmath>
#include <fstream>
#include <unordered_set>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

const char* Extension(ModelFormat format) {
  return format == ModelFormat::kBinary ? ".bin" : ".txt";
}

bool HasModel(const fs::path& folder, ModelFormat format) {
  for (const char* stem : {"cameras", "images", "points3D"}) {
    if (!fs::is_regular_file(folder / (std::string(stem) + Extension(format)))) return false;
  }
  return true;
}

void CheckPose(const fs::path& path, const std::string& what, const Pose& pose) {
  if (!pose.rotation.coeffs().allFinite() || !pose.translation.allFinite()) {
    throw UserError(path.string(), ": ", what, " has a pose that is not finite; is it damaged?");
  }
  const double norm = pose.rotation.norm();
  if (std::abs(norm - 1) > 1e-3) {
    throw UserError(path.string(),
                    ": ",
                    what,
                    " has a rotation quaternion of length ",
                    norm,
                    " where 1 would be right; is the order QW QX QY QZ?");
  }
}

void CheckCamera(const fs::path& path, const Camera& camera) {
  constexpr uint64_t kMaxSide = 1'000'000;
  if (camera.width < 1 || camera.height < 1 || camera.width > kMaxSide ||
      camera.height > kMaxSide) {
    throw UserError(path.string(),
                    ": camera ",
                    camera.id,
                    " has ",
                    camera.width,
                    " x ",
                    camera.height,
                    " pixels, where 1 to ",
                    kMaxSide,
                    " a side would be right; is it damaged?");
  }
  const CameraModel& model = *FindCameraModel(camera.model_id);
  for (const double parameter : camera.params) {
    if (!std::isfinite(parameter)) {
      throw UserError(path.string(),
                      ": camera ",
                      camera.id,
                      " has a parameter that is not finite; is it damaged?");
    }
  }
  for (int i = 0; i < model.num_params; ++i) {
    if (!MustBePositive(model, i) || camera.params[i] > 0) continue;
    throw UserError(path.string(),
                    ": camera ",
                    camera.id,
                    model.num_focal_lengths > 0 ? " has the focal length " : " has the size ",
                    camera.params[i],
                    ", where a positive one would be right; did the calibration fail?");
  }
}

// Names become paths below the image folder and below output folders: they must stay there.
void CheckName(const fs::path& path, const Image& image) {
  if (StaysBelowFolder(image.name)) return;
  throw UserError(path.string(),
                  ": image ",
                  image.id,
                  " has the name \"",
                  Shortened(image.name),
                  "\", where a file's path within the image folder would be right.");
}

template <typename Id>
void InsertOnce(const fs::path& path,
                const char* what,
                const Id& id,
                std::unordered_set<Id>* seen) {
  if (seen->insert(id).second) return;
  throw UserError(
      path.string(), ": ", what, " ", id, " occurs twice; it should occur once; is it damaged?");
}

std::unordered_set<uint32_t> CheckCameras(const fs::path& path,
                                          const std::vector<Camera>& cameras) {
  std::unordered_set<uint32_t> ids;
  for (const Camera& camera : cameras) {
    InsertOnce(path, "camera", camera.id, &ids);
    CheckCamera(path, camera);
  }
  return ids;
}

std::unordered_set<uint32_t> CheckImages(const fs::path& path,
                                         const fs::path& cameras_file,
                                         const std::vector<Image>& images,
                                         const std::unordered_set<uint32_t>& camera_ids) {
  std::unordered_set<uint32_t> ids;
  std::unordered_set<std::string> names;
  for (const Image& image : images) {
    InsertOnce(path, "image", image.id, &ids);
    CheckName(path, image);
    InsertOnce(path, "the image name", image.name, &names);
    CheckPose(path, "image " + std::to_string(image.id), image.cam_from_world);
    if (!camera_ids.contains(image.camera_id)) {
      throw UserError(path.string(),
                      ": image ",
                      image.id,
                      " (",
                      image.name,
                      ") uses camera ",
                      image.camera_id,
                      ", which ",
                      cameras_file.filename().string(),
                      " does not have; are both files of one model?");
    }
  }
  return ids;
}

void CheckPoints(const fs::path& path,
                 const fs::path& images_file,
                 const std::vector<Point3D>& points,
                 const std::unordered_set<uint32_t>& image_ids) {
  std::unordered_set<uint64_t> ids;
  ids.reserve(points.size());
  for (const Point3D& point : points) {
    InsertOnce(path, "point", point.id, &ids);
    for (const TrackElement& element : point.track) {
      if (image_ids.contains(element.image_id)) continue;
      throw UserError(path.string(),
                      ": point ",
                      point.id,
                      " is seen by image ",
                      element.image_id,
                      ", which ",
                      images_file.filename().string(),
                      " does not have; are both files of one model?");
    }
  }
}

void CheckRigs(const fs::path& path, const std::vector<Rig>& rigs) {
  std::unordered_set<uint32_t> ids;
  for (const Rig& rig : rigs) {
    InsertOnce(path, "rig", rig.id, &ids);
    for (const RigSensor& other : rig.others) {
      if (!other.sensor_from_rig) continue;
      CheckPose(path, "rig " + std::to_string(rig.id), *other.sensor_from_rig);
    }
  }
}

void CheckFrames(const fs::path& path, const std::vector<Frame>& frames) {
  std::unordered_set<uint32_t> ids;
  for (const Frame& frame : frames) {
    InsertOnce(path, "frame", frame.id, &ids);
    CheckPose(path, "frame " + std::to_string(frame.id), frame.rig_from_world);
  }
}

void CheckReconstruction(const fs::path& folder,
                         ModelFormat format,
                         const Reconstruction& reconstruction) {
  const auto file = [&](const char* stem) {
    return folder / (std::string(stem) + Extension(format));
  };
  const fs::path cameras = file("cameras"), images = file("images");
  const fs::path rigs = file("rigs"), frames = file("frames");
  const std::unordered_set<uint32_t> camera_ids = CheckCameras(cameras, reconstruction.cameras);
  const std::unordered_set<uint32_t> image_ids =
      CheckImages(images, cameras, reconstruction.images, camera_ids);
  CheckPoints(file("points3D"), images, reconstruction.points, image_ids);
  if (reconstruction.rigs) CheckRigs(rigs, *reconstruction.rigs);
  if (reconstruction.frames) CheckFrames(frames, *reconstruction.frames);
  CheckRigPoses(reconstruction, rigs, frames, images);
}

}  // namespace

fs::path FindModelFolder(const fs::path& path) {
  for (const fs::path& folder : {path, path / "0", path / "sparse" / "0", path / "sparse"}) {
    if (HasModel(folder, ModelFormat::kBinary) || HasModel(folder, ModelFormat::kText)) {
      return folder;
    }
  }
  // The folder that comes nearest to a model has the better message.
  for (const fs::path& folder : {path / "sparse" / "0", path / "0"}) {
    if (fs::is_directory(folder)) FindModelFormat(folder);
  }
  FindModelFormat(path);
  return path;
}

ModelFormat FindModelFormat(const fs::path& folder) {
  if (!fs::is_directory(folder)) {
    throw UserError(folder.string(),
                    ": there is no such folder; it should hold a COLMAP model (cameras.bin, "
                    "images.bin, points3D.bin).");
  }
  for (const ModelFormat format : {ModelFormat::kBinary, ModelFormat::kText}) {
    if (HasModel(folder, format)) return format;
  }
  for (const ModelFormat format : {ModelFormat::kBinary, ModelFormat::kText}) {
    for (const char* present : {"cameras", "images", "points3D"}) {
      if (!fs::exists(folder / (std::string(present) + Extension(format)))) continue;
      for (const char* missing : {"cameras", "images", "points3D"}) {
        const fs::path file = folder / (std::string(missing) + Extension(format));
        if (fs::exists(file)) RequireRegularFile(file, "a COLMAP model's file");
        if (fs::exists(file)) continue;
        throw UserError(file.string(),
                        ": is missing, while ",
                        present,
                        Extension(format),
                        " is there; is the copy of the COLMAP model complete?");
      }
    }
  }
  throw UserError(folder.string(),
                  ": holds no COLMAP model; cameras, images and points3D, all as .bin or all as "
                  ".txt, should be there.");
}

Reconstruction ReadReconstruction(const fs::path& folder) {
  const ModelFormat format = FindModelFormat(folder);
  const bool binary = format == ModelFormat::kBinary;
  const auto read = [&](const char* stem, auto parse_binary, auto parse_text) {
    const fs::path path = folder / (std::string(stem) + Extension(format));
    const std::string bytes = ReadFileBytes(path, "a COLMAP model's file");
    return binary ? parse_binary(path, bytes) : parse_text(path, bytes);
  };
  const auto exists = [&](const char* stem) {
    return fs::exists(folder / (std::string(stem) + Extension(format)));
  };
  Reconstruction result;
  result.cameras = read("cameras", ParseCamerasBinary, ParseCamerasText);
  result.images = read("images", ParseImagesBinary, ParseImagesText);
  result.points = read("points3D", ParsePointsBinary, ParsePointsText);
  if (exists("rigs")) result.rigs = read("rigs", ParseRigsBinary, ParseRigsText);
  if (exists("frames")) result.frames = read("frames", ParseFramesBinary, ParseFramesText);
  CheckReconstruction(folder, format, result);
  return result;
}

int64_t CountImages(const fs::path& folder) {
  const ModelFormat format = FindModelFormat(folder);
  const fs::path path = folder / (std::string("images") + Extension(format));
  const char* const what = "a COLMAP model's file";
  if (format == ModelFormat::kText) {
    return static_cast<int64_t>(ParseImagesText(path, ReadFileBytes(path, what)).size());
  }
  RequireRegularFile(path, what);
  // An id, a pose, a camera, an empty name's end and a count of features.
  constexpr uint64_t kLeastBytesOfImage = 4 + 7 * 8 + 4 + 1 + 8;
  uint64_t count = 0;
  std::ifstream file(path, std::ios::binary);
  file.read(reinterpret_cast<char*>(&count), sizeof(count));
  if (!file || count > fs::file_size(path) / kLeastBytesOfImage) {
    throw UserError(path.string(), ": is cut or damaged; is the copy complete?");
  }
  return static_cast<int64_t>(count);
}

void WriteReconstruction(const fs::path& folder,
                         const Reconstruction& reconstruction,
                         ModelFormat format) {
  const bool binary = format == ModelFormat::kBinary;
  const auto path = [&](const char* stem) {
    return folder / (std::string(stem) + Extension(format));
  };
  for (const auto& [stem, ours] : {std::pair("rigs", reconstruction.rigs.has_value()),
                                   std::pair("frames", reconstruction.frames.has_value())}) {
    if (ours || !fs::exists(path(stem))) continue;
    throw UserError(path(stem).string(),
                    ": belongs to another model, and would be read with this one; choose an empty "
                    "folder.");
  }
  if (!binary) {
    for (const Image& image : reconstruction.images) {
      const std::string& name = image.name;
      if (name.find_first_of("\r\n") == std::string::npos && name.front() != ' ' &&
          name.back() != ' ') {
        continue;
      }
      throw UserError(path("images").string(),
                      ": the name of image ",
                      image.id,
                      " has a line break or a space at its end and cannot be written as text; "
                      "write the model as binary.");
    }
  }
  WriteTextFile(
      path("cameras"),
      binary ? CamerasToBinary(reconstruction.cameras) : CamerasToText(reconstruction.cameras));
  WriteTextFile(
      path("images"),
      binary ? ImagesToBinary(reconstruction.images) : ImagesToText(reconstruction.images));
  WriteTextFile(
      path("points3D"),
      binary ? PointsToBinary(reconstruction.points) : PointsToText(reconstruction.points));
  if (reconstruction.rigs) {
    WriteTextFile(path("rigs"),
                  binary ? RigsToBinary(*reconstruction.rigs) : RigsToText(*reconstruction.rigs));
  }
  if (reconstruction.frames) {
    WriteTextFile(
        path("frames"),
        binary ? FramesToBinary(*reconstruction.frames) : FramesToText(*reconstruction.frames));
  }
}

}  // namespace semfoam
