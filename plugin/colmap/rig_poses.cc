// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/colmap/rig_poses.h"

#include "foam/util/error.h"

#include <numbers>
#include <optional>
#include <unordered_map>

namespace semfoam {
namespace {

// Of a rig's camera; none: the rig does not have it, or not its place.
struct CameraOnRig {
  bool known = false;
  std::optional<Pose> sensor_from_rig;
};

CameraOnRig FindCamera(const Rig& rig, uint32_t camera_id) {
  const auto is_camera = [&](const Sensor& sensor) {
    return sensor.type == SensorType::kCamera && sensor.id == camera_id;
  };
  if (rig.reference && is_camera(*rig.reference)) return {true, Pose()};
  for (const RigSensor& other : rig.others) {
    if (is_camera(other.sensor)) return {true, other.sensor_from_rig};
  }
  return {};
}

// Whether an image's pose is sensor_from_rig * rig_from_world, and how far it is from there.
struct PoseDifference {
  bool agrees = false;
  double distance = 0;  // of the centres, world units
  double degrees = 0;
};

PoseDifference Compare(const Pose& image, const Pose& sensor_from_rig, const Pose& rig_from_world) {
  constexpr double kTolerance = 1e-5;
  Pose composed;
  composed.rotation = sensor_from_rig.UnitRotation() * rig_from_world.UnitRotation();
  composed.translation =
      sensor_from_rig.UnitRotation() * rig_from_world.translation + sensor_from_rig.translation;
  const double turn =
      (composed.rotation.toRotationMatrix() - image.UnitRotation().toRotationMatrix()).norm();
  const double shift = (composed.translation - image.translation).norm();
  const double length = sensor_from_rig.translation.norm() + rig_from_world.translation.norm();
  return {turn <= kTolerance && shift <= kTolerance * length,
          (composed.Center() - image.Center()).norm(),
          composed.rotation.angularDistance(image.UnitRotation()) * 180 / std::numbers::pi};
}

// For messages.
struct RigFiles {
  const std::filesystem::path& rigs;
  const std::filesystem::path& frames;
  const std::filesystem::path& images;
};

void RequireRigsAndFrames(const Reconstruction& reconstruction, const RigFiles& files) {
  if (reconstruction.rigs && reconstruction.frames) return;
  const auto& missing = reconstruction.rigs ? files.frames : files.rigs;
  const auto& present = reconstruction.rigs ? files.rigs : files.frames;
  throw UserError(missing.string(),
                  ": is missing, while ",
                  present.filename().string(),
                  " is there; is the copy of the COLMAP model complete?");
}

// Checks that the image has the camera and the pose that its frame gives it.
void CheckImageOfFrame(const Frame& frame,
                       const Rig& rig,
                       uint32_t camera_id,
                       const Image& image,
                       const RigFiles& files) {
  const auto fail = [&](const auto&... words) {
    throw UserError(files.frames.string(),
                    ": frame ",
                    frame.id,
                    " has image ",
                    image.id,
                    " (",
                    image.name,
                    ")",
                    words...);
  };
  if (camera_id != image.camera_id) {
    fail(" by camera ",
         camera_id,
         ", while ",
         files.images.filename().string(),
         " has it by camera ",
         image.camera_id,
         "; are both files of one model?");
  }
  const CameraOnRig camera = FindCamera(rig, image.camera_id);
  if (!camera.known) {
    fail(" by camera ",
         image.camera_id,
         ", which its rig ",
         frame.rig_id,
         " in ",
         files.rigs.filename().string(),
         " does not have; are both files of one model?");
  }
  if (!camera.sensor_from_rig) return;
  const PoseDifference difference =
      Compare(image.cam_from_world, *camera.sensor_from_rig, frame.rig_from_world);
  if (difference.agrees) return;
  fail(" at another place than ",
       files.images.filename().string(),
       " has it (",
       difference.distance,
       " units and ",
       difference.degrees,
       " degrees away), where the same would be right; was one of the files changed alone?");
}

// By the id of the image.
using ImagesById = std::unordered_map<uint64_t, const Image*>;
using FrameOfImage = std::unordered_map<uint32_t, uint32_t>;

// Checks the images of a frame that the model has, and enters each into `frame_of_image`.
void CheckFrame(const Frame& frame,
                const Rig& rig,
                const ImagesById& images,
                const RigFiles& files,
                FrameOfImage* frame_of_image) {
  for (const FrameData& data : frame.data) {
    if (data.sensor.type != SensorType::kCamera) continue;
    const auto found = images.find(data.id);
    if (found == images.end()) continue;
    const Image& image = *found->second;
    const auto [other, first] = frame_of_image->emplace(image.id, frame.id);
    if (!first) {
      throw UserError(files.frames.string(),
                      ": frame ",
                      frame.id,
                      " has image ",
                      image.id,
                      " (",
                      image.name,
                      "), which frame ",
                      other->second,
                      " has too, where one frame would be right; is it damaged?");
    }
    CheckImageOfFrame(frame, rig, data.sensor.id, image, files);
  }
}

}  // namespace

void CheckRigPoses(const Reconstruction& reconstruction,
                   const std::filesystem::path& rigs_file,
                   const std::filesystem::path& frames_file,
                   const std::filesystem::path& images_file) {
  if (!reconstruction.rigs && !reconstruction.frames) return;
  const RigFiles files = {rigs_file, frames_file, images_file};
  RequireRigsAndFrames(reconstruction, files);
  std::unordered_map<uint32_t, const Rig*> rigs;
  for (const Rig& rig : *reconstruction.rigs) rigs.emplace(rig.id, &rig);
  ImagesById images;
  for (const Image& image : reconstruction.images) images.emplace(image.id, &image);
  FrameOfImage frame_of_image;
  for (const Frame& frame : *reconstruction.frames) {
    const auto rig = rigs.find(frame.rig_id);
    if (rig == rigs.end()) {
      throw UserError(frames_file.string(),
                      ": frame ",
                      frame.id,
                      " uses rig ",
                      frame.rig_id,
                      ", which ",
                      rigs_file.filename().string(),
                      " does not have; are both files of one model?");
    }
    CheckFrame(frame, *rig->second, images, files, &frame_of_image);
  }
  for (const Image& image : reconstruction.images) {
    if (frame_of_image.contains(image.id)) continue;
    throw UserError(frames_file.string(),
                    ": has no frame with image ",
                    image.id,
                    " (",
                    image.name,
                    "), which ",
                    images_file.filename().string(),
                    " has; are both files of one model?");
  }
}

}  // namespace semfoam
