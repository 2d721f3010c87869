// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/colmap/camera_rays.h"

#include "foam/util/error.h"
#include "foam/util/parallel.h"
#include "foam/view/pixel_reduction.h"

#include <algorithm>
#include <cmath>

#include <glog/logging.h>

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

namespace {

// Rays cast together where a view is rendered in bands.
constexpr int64_t kRaysOfBand = int64_t{1} << 18;

// The rays of the rows [begin_row, end_row).
CameraRays MakeRows(const Camera& camera,
                    const Pose& cam_from_world,
                    const Similarity& world_from_normalized,
                    int begin_row,
                    int end_row) {
  const PixelRays pixel_rays(camera, /*tabulate=*/false);
  const Eigen::Matrix3d world_from_cam =
      cam_from_world.UnitRotation().toRotationMatrix().transpose();
  CameraRays rays;
  rays.width = static_cast<int>(camera.width);
  rays.height = end_row - begin_row;
  rays.origin = world_from_normalized.Invert(cam_from_world.Center());
  rays.directions.assign(camera.width * rays.height, Eigen::Vector3f::Zero());
  ParallelForBlocks(rays.height, 16, [&](int64_t begin, int64_t end) {
    for (int64_t y = begin; y < end; ++y) {
      for (int x = 0; x < rays.width; ++x) {
        Eigen::Vector3f direction;
        if (!pixel_rays.Direction(x, begin_row + static_cast<int>(y), &direction)) continue;
        rays.directions[y * rays.width + x] = RotateToWorld(world_from_cam, direction);
      }
    }
  });
  return rays;
}

void Append(const RenderedView& band, RenderedView* view) {
  const auto append = [](const auto& from, auto* to) {
    to->insert(to->end(), from.begin(), from.end());
  };
  view->width = band.width;
  view->height += band.height;
  append(band.color, &view->color);
  append(band.opacity, &view->opacity);
  append(band.distance, &view->distance);
  append(band.class_index, &view->class_index);
  append(band.confidence, &view->confidence);
}

}  // namespace

CameraRays MakeCameraRays(const Camera& camera,
                          const Pose& cam_from_world,
                          const Similarity& world_from_normalized) {
  return MakeRows(
      camera, cam_from_world, world_from_normalized, 0, static_cast<int>(camera.height));
}

RenderedView RenderCamera(const ViewRenderer& renderer,
                          const Camera& camera,
                          const Pose& cam_from_world,
                          const Similarity& world_from_normalized,
                          int samples) {
  CHECK_GE(samples, 1);
  if (samples == 1) {
    return renderer.Render(MakeCameraRays(camera, cam_from_world, world_from_normalized));
  }
  const Camera fine = RescaledCamera(camera, samples * camera.width, samples * camera.height);
  const auto height = static_cast<int>(camera.height);
  const auto rows = static_cast<int>(
      std::max<int64_t>(1, kRaysOfBand / static_cast<int64_t>(fine.width * samples)));
  RenderedView view;
  for (int begin = 0; begin < height; begin += rows) {
    const int end = std::min(height, begin + rows);
    RenderedView band =
        renderer.Render(MakeRows(camera, cam_from_world, world_from_normalized, begin, end));
    const CameraRays rays =
        MakeRows(fine, cam_from_world, world_from_normalized, begin * samples, end * samples);
    AverageRays(renderer.Render(rays), samples, &band);
    Append(band, &view);
  }
  return view;
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
