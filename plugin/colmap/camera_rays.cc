// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/colmap/camera_rays.h"

#include "foam/util/error.h"
#include "foam/util/parallel.h"

#include <cmath>

namespace semfoam {

PixelRays::PixelRays(const Camera& camera, bool tabulate)
    : camera_(camera), distorted_(IsDistorted(camera)), width_(camera.width) {
  const std::vector<double> plain = WithoutDistortion(camera).params;
  focal_ = {plain[0], plain[1]};
  center_ = {plain[2], plain[3]};
  if (!distorted_ || !tabulate) return;
  std::vector<Eigen::Vector3f> table(camera.width * camera.height);
  ParallelForBlocks(static_cast<int64_t>(camera.height), 16, [&](int64_t begin, int64_t end) {
    for (int64_t y = begin; y < end; ++y) {
      for (size_t x = 0; x < width_; ++x) {
        table[y * width_ + x] = Compute(static_cast<int>(x), static_cast<int>(y));
      }
    }
  });
  table_ = std::move(table);
}

uint64_t PixelRays::TableBytes(const Camera& camera) {
  return IsDistorted(camera) ? camera.width * camera.height * sizeof(Eigen::Vector3f) : 0;
}

Eigen::Vector3f PixelRays::Compute(int x, int y) const {
  const auto ray = Unproject(camera_, {x + 0.5, y + 0.5});
  return ray ? Eigen::Vector3f(ray->cast<float>()) : Eigen::Vector3f::Zero();
}

CameraRays MakeCameraRays(const Camera& camera,
                          const Pose& cam_from_world,
                          const Similarity& world_from_normalized) {
  const PixelRays pixel_rays(camera, /*tabulate=*/false);
  const Eigen::Matrix3d world_from_cam =
      cam_from_world.UnitRotation().toRotationMatrix().transpose();
  CameraRays rays;
  rays.width = static_cast<int>(camera.width);
  rays.height = static_cast<int>(camera.height);
  rays.origin = world_from_normalized.Invert(cam_from_world.Center());
  rays.directions.assign(camera.width * camera.height, Eigen::Vector3f::Zero());
  ParallelForBlocks(rays.height, 16, [&](int64_t begin, int64_t end) {
    for (int64_t y = begin; y < end; ++y) {
      for (int x = 0; x < rays.width; ++x) {
        Eigen::Vector3f direction;
        if (!pixel_rays.Direction(x, static_cast<int>(y), &direction)) continue;
        rays.directions[y * rays.width + x] = RotateToWorld(world_from_cam, direction);
      }
    }
  });
  return rays;
}

CameraRays MakeCameraRays(const PhotoRecord& photo,
                          const Similarity& world_from_normalized,
                          const std::filesystem::path& model_file) {
  return MakeCameraRays(CameraOf(photo, model_file), PoseOf(photo), world_from_normalized);
}

PhotoRecord MakePhotoRecord(const Camera& camera, const Image& image, bool held_out) {
  PhotoRecord photo;
  photo.name = image.name;
  photo.camera_model = std::string(FindCameraModel(camera.model_id)->name);
  photo.width = static_cast<int>(camera.width);
  photo.height = static_cast<int>(camera.height);
  photo.camera_params = camera.params;
  photo.cam_from_world_rotation = image.cam_from_world.UnitRotation();
  photo.cam_from_world_translation = image.cam_from_world.translation;
  photo.held_out = held_out;
  return photo;
}

Pose PoseOf(const PhotoRecord& photo) {
  return {photo.cam_from_world_rotation, photo.cam_from_world_translation};
}

Camera CameraOf(const PhotoRecord& photo, const std::filesystem::path& model_file) {
  const CameraModel* model = FindCameraModel(photo.camera_model);
  bool valid = model != nullptr && photo.width > 0 && photo.height > 0 &&
               photo.camera_params.size() == static_cast<size_t>(model->num_params);
  for (int i = 0; valid && i < model->num_params; ++i) {
    valid = std::isfinite(photo.camera_params[i]) &&
            (!MustBePositive(*model, i) || photo.camera_params[i] > 0);
  }
  if (!valid) {
    throw UserError(model_file.string(),
                    ": the photo ",
                    photo.name,
                    " has no valid camera (model \"",
                    photo.camera_model,
                    "\"); is the file damaged?");
  }
  Camera camera;
  camera.model_id = model->id;
  camera.width = static_cast<uint64_t>(photo.width);
  camera.height = static_cast<uint64_t>(photo.height);
  camera.params = photo.camera_params;
  return camera;
}

}  // namespace semfoam
