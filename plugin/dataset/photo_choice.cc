// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/dataset/photo_choice.h"

#include "foam/util/error.h"
#include "plugin/colmap/camera_models.h"
#include "plugin/colmap/camera_rays.h"
#include "plugin/photo/photo.h"
#include "plugin/util/files.h"

#include <algorithm>
#include <set>
#include <string>
#include <unordered_map>
#include <vector>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

void RequireImages(const SceneOptions& options,
                   const Reconstruction& model,
                   const fs::path& images_file) {
  if (model.images.empty()) {
    throw UserError(images_file.string(),
                    ": has no registered image, where at least one would be right; did the "
                    "reconstruction fail?");
  }
  if (!fs::is_directory(options.image_path)) {
    throw UserError(options.image_path.string(),
                    ": there is no such folder; it should hold the photos of the model.");
  }
}

void CheckTestEvery(int test_every, size_t num_photos) {
  if (test_every < 0) {
    throw FieldError(
        "test_every", " ", test_every, ": 0 (train on all photos) or more would be right.");
  }
  if (test_every == 1 || (test_every > 0 && num_photos < 2)) {
    throw FieldError("test_every",
                     " ",
                     test_every,
                     ": holds out all of the ",
                     num_photos,
                     " photos and leaves none to train on; 0 would train on all.");
  }
}

// Returns the camera as it is simulated: without a distortion that is off.
Camera SimulatedCamera(const Camera& camera, EffectSwitch distortion) {
  if (distortion == EffectSwitch::kOn || !IsDistorted(camera)) return camera;
  const bool off =
      distortion == EffectSwitch::kOff || DistortionAtCorners(camera) < kLeastDistortion;
  return off ? WithoutDistortion(camera) : camera;
}

PhotoSize SizeOf(const Camera& camera) {
  return {static_cast<int>(camera.width), static_cast<int>(camera.height)};
}

PhotoHeader ReadHeader(const fs::path& file, const Camera& camera, const fs::path& images_file) {
  if (!fs::is_regular_file(file)) {
    throw UserError(file.string(),
                    ": is missing, while ",
                    images_file.string(),
                    " has this image; is ",
                    Field{"image_path"},
                    " the folder that was given to COLMAP?");
  }
  const PhotoHeader header = ReadPhotoHeader(file);
  const PhotoSize size = header.size;
  const PhotoSize camera_size = SizeOf(camera);
  if (!SameAspect(size, camera_size)) {
    throw UserError(file.string(),
                    ": is ",
                    size.width,
                    " x ",
                    size.height,
                    " pixels, while its camera (",
                    camera.id,
                    ") has ",
                    camera_size.width,
                    " x ",
                    camera_size.height,
                    "; the photo that COLMAP saw, or a smaller copy of it, neither turned nor "
                    "cropped, would be right.");
  }
  return header;
}

// Returns the photo with its camera at the size that is trained on.
PhotoRecord RecordOf(const SceneOptions& options,
                     const Camera& camera,
                     const Image& image,
                     const PhotoSize& file_size,
                     bool held_out) {
  const PhotoSize reduced = ReducedSize(file_size, options.max_image_size);
  const Camera simulated = SimulatedCamera(camera, options.distortion);
  return MakePhotoRecord(reduced != SizeOf(camera)
                             ? RescaledCamera(simulated, reduced.width, reduced.height)
                             : simulated,
                         image,
                         held_out);
}

// Counts the photos that the model does not have: those that the mapper did not register.
int CountUnregistered(const fs::path& image_path, const std::vector<PhotoRecord>& photos) {
  std::set<std::string> registered;
  for (const PhotoRecord& photo : photos) {
    registered.insert(fs::path(photo.name).lexically_normal().generic_string());
  }
  int count = 0;
  for (const fs::path& path : ListPhotos(image_path)) {
    if (!registered.contains(path.lexically_relative(image_path).generic_string())) ++count;
  }
  return count;
}

}  // namespace

void ChoosePhotos(const SceneOptions& options,
                  const Reconstruction& model,
                  const fs::path& images_file,
                  ScenePlan* plan) {
  RequireImages(options, model, images_file);
  const size_t num_views = model.images.size();
  CheckTestEvery(options.test_every, num_views);
  std::unordered_map<uint32_t, const Camera*> cameras;
  for (const Camera& camera : model.cameras) cameras.emplace(camera.id, &camera);
  plan->photos.resize(num_views);
  plan->file_sizes.resize(num_views);
  plan->photo_decoding.resize(num_views);
  for (const Image& image : model.images) {
    plan->distortion =
        std::max(plan->distortion, DistortionAtCorners(*cameras.at(image.camera_id)));
    plan->files.push_back(options.image_path / image.name);
  }
  std::vector<char> is_rescaled(num_views, 0);
  ForEachFile(static_cast<int64_t>(num_views), [&](int64_t i) {
    const Image& image = model.images[i];
    const Camera& camera = *cameras.at(image.camera_id);
    const PhotoHeader header = ReadHeader(plan->files[i], camera, images_file);
    plan->photo_decoding[i] = header.decoding_bytes;
    plan->file_sizes[i] = header.size;
    is_rescaled[i] = header.size != SizeOf(camera);
    const bool held_out = options.test_every > 0 && i % options.test_every == 0;
    plan->photos[i] = RecordOf(options, camera, image, header.size, held_out);
  });
  for (size_t i = 0; i < num_views; ++i) {
    plan->num_reduced += plan->photos[i].width < plan->file_sizes[i].width;
  }
  plan->num_rescaled = static_cast<int>(std::count(is_rescaled.begin(), is_rescaled.end(), 1));
  plan->num_unregistered = CountUnregistered(options.image_path, plan->photos);
}

}  // namespace semfoam
