// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/masked_photos.h"

#include "foam/error.h"
#include "plugin/camera_rays.h"
#include "plugin/files.h"
#include "plugin/mask_png.h"
#include "plugin/seeds.h"

#include <algorithm>
#include <unordered_map>
#include <utility>

#include <glog/logging.h>

namespace semfoam {
namespace {

std::vector<Image> SortedImages(const Reconstruction& model) {
  std::vector<Image> images = model.images;
  std::sort(
      images.begin(), images.end(), [](const Image& a, const Image& b) { return a.name < b.name; });
  return images;
}

}  // namespace

std::vector<PhotoRecord> RegisteredPhotos(const Reconstruction& model) {
  std::unordered_map<uint32_t, const Camera*> cameras;
  for (const Camera& camera : model.cameras) cameras.emplace(camera.id, &camera);
  std::vector<PhotoRecord> photos;
  for (const Image& image : model.images) {
    photos.push_back(MakePhotoRecord(*cameras.at(image.camera_id), image, /*held_out=*/false));
  }
  std::sort(photos.begin(), photos.end(), [](const PhotoRecord& a, const PhotoRecord& b) {
    return a.name < b.name;
  });
  return photos;
}

MaskedPhotos LoadMaskedPhotos(const Reconstruction* model,
                              std::vector<PhotoRecord> photos,
                              const MaskPairing& pairing,
                              const std::filesystem::path& mask_folder,
                              LabelZero label_zero,
                              MaskConsistency consistency) {
  CHECK_EQ(photos.size(), pairing.masks.size());
  MaskedPhotos result;
  std::vector<PhotoSize> sizes(photos.size());
  std::vector<PhotoSize> mask_sizes(photos.size());
  ForEachFile(static_cast<int64_t>(photos.size()), [&](int64_t i) {
    sizes[i] = {photos[i].width, photos[i].height};
    if (pairing.masks[i].empty()) return;
    mask_sizes[i] = ReadMaskSize(pairing.masks[i]);
  });
  result.size_warning = MaskSizeWarning(pairing, mask_sizes, sizes);
  for (size_t i = 0; i < photos.size(); ++i) {
    if (pairing.masks[i].empty()) continue;
    const PhotoSize mask = mask_sizes[i];
    if (SameAspect(mask, sizes[i]) && mask.width < sizes[i].width) sizes[i] = mask;
    photos[i].width = sizes[i].width;
    photos[i].height = sizes[i].height;
  }
  result.given = LoadMasks(pairing, sizes, mask_folder, label_zero);
  result.corrected = result.given;
  if (model != nullptr) {
    const std::vector<Image> images = SortedImages(*model);
    const SeenImages seen = FindSeenImages(images, model->cameras, photos);
    result.sightings.resize(model->points.size());
    for (size_t i = 0; i < model->points.size(); ++i) {
      AppendSightings(model->points[i], seen, &result.sightings[i]);
    }
    std::vector<SeedPoint> seeds;
    std::vector<Sightings> seed_sightings;
    MakeSeeds(model->points, NormalizedFrameOf(*model), seen, &seeds, &seed_sightings);
    result.consistency =
        MakeMasksConsistent(seeds, seed_sightings, photos, consistency, &result.corrected);
  }
  result.photos = std::move(photos);
  return result;
}

}  // namespace semfoam
