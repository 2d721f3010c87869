// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask/masked_photos.h"

#include "plugin/colmap/camera_rays.h"
#include "plugin/colmap/seeds.h"
#include "plugin/mask/corrected_masks.h"
#include "plugin/mask/mask_evidence.h"
#include "plugin/mask/mask_png.h"
#include "plugin/util/files.h"

#include <algorithm>
#include <string>
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

// Reduces the photos to the size of their masks, where these are smaller and have their aspect.
// Returns MaskSizeWarning for the sizes before.
std::string ShrinkToMasks(const MaskPairing& pairing, std::vector<PhotoRecord>* photos) {
  std::vector<PhotoSize> sizes(photos->size());
  std::vector<PhotoSize> mask_sizes(photos->size());
  ForEachFile(static_cast<int64_t>(photos->size()), [&](int64_t i) {
    sizes[i] = {(*photos)[i].width, (*photos)[i].height};
    if (!pairing.masks[i].empty()) mask_sizes[i] = ReadMaskHeader(pairing.masks[i]).size;
  });
  for (size_t i = 0; i < photos->size(); ++i) {
    if (pairing.masks[i].empty()) continue;
    const PhotoSize mask = mask_sizes[i];
    if (!SameAspect(mask, sizes[i]) || mask.width >= sizes[i].width) continue;
    (*photos)[i].width = mask.width;
    (*photos)[i].height = mask.height;
  }
  return MaskSizeWarning(pairing, mask_sizes, sizes);
}

// MakeSeeds of a model.
struct ModelSeeds {
  std::vector<SeedPoint> seeds;
  // [seeds]
  std::vector<PixelObservations> tracks;
};

// Returns the seeds of the model, and fills the observations of its points.
ModelSeeds FindSeeds(const Reconstruction& model, MaskedPhotos* photos) {
  const std::vector<Image> images = SortedImages(model);
  const SeenImages seen = FindSeenImages(images, model.cameras, photos->photos);
  photos->observations.resize(model.points.size());
  for (size_t i = 0; i < model.points.size(); ++i) {
    AppendObservations(model.points[i], seen, &photos->observations[i]);
  }
  ModelSeeds result;
  MakeSeeds(model.points, NormalizedFrameOf(model), seen, &result.seeds, &result.tracks);
  return result;
}

// Decodes every mask once and fills the contents. Returns what each shows at the places of the
// tracks.
std::vector<IdSamples> DecodeMasks(const std::vector<PixelObservations>& tracks,
                                   MaskedPhotos* photos) {
  const size_t num_views = photos->photos.size();
  const std::vector<std::vector<Eigen::Vector2f>> places = PlacesByView(tracks, num_views);
  std::vector<IdSamples> samples(num_views);
  photos->contents.resize(num_views);
  ForEachFile(static_cast<int64_t>(num_views), [&](int64_t i) {
    samples[i].index_at.assign(places[i].size(), IdImage::kNone);
    if (!photos->HasMask(static_cast<int>(i))) return;
    const PhotoRecord& photo = photos->photos[i];
    DecodedMask mask = DecodeMask(photos->pairing.masks[i], {photo.width, photo.height});
    photos->contents[i] = std::move(mask.contents);
    samples[i] = LookAtMask(mask.indices, photo, places[i]);
  });
  return samples;
}

// Corrects the masks by the tracks, and fills what the masks, given and corrected, show at the
// observations.
void CorrectAndObserve(const ModelSeeds& seeds,
                       MaskConsistency consistency,
                       const std::vector<ViewEvidence>& evidence,
                       CorrectedPhotos* corrected) {
  MaskedPhotos* const photos = &corrected->photos;
  MaskCorrection correction = CorrectMasks(
      seeds.seeds, seeds.tracks, photos->photos, consistency, photos->given.labels, evidence);
  photos->consistency = std::move(correction.report);
  corrected->rewriter = correction.rewriter;
  const MaskRewriter* rewriter = correction.rewriter.get();
  if (rewriter != nullptr) photos->labels = rewriter->labels();
  CollectObservations(
      [&](int view) {
        ClassImage given = photos->GivenMask(view);
        ClassImage corrected =
            rewriter == nullptr ? given : rewriter->Rewrite(view, photos->photos[view], given);
        return ViewMasks{std::move(given), std::move(corrected)};
      },
      photos);
}

// LoadMaskedPhotos, with what corrects the masks.
CorrectedPhotos Load(const Reconstruction* model,
                     std::vector<PhotoRecord> photos,
                     const MaskPairing& pairing,
                     const std::filesystem::path& mask_folder,
                     LabelZero label_zero,
                     MaskConsistency consistency) {
  CHECK_EQ(photos.size(), pairing.masks.size());
  CorrectedPhotos corrected;
  MaskedPhotos& result = corrected.photos;
  result.pairing = pairing;
  result.size_warning = ShrinkToMasks(pairing, &photos);
  result.photos = std::move(photos);
  ModelSeeds seeds;
  if (model != nullptr) seeds = FindSeeds(*model, &result);
  std::vector<IdSamples> samples = DecodeMasks(seeds.tracks, &result);
  result.given = NumberMasks(result.contents, pairing, mask_folder, label_zero);
  result.labels = result.given.labels;
  std::vector<ViewEvidence> evidence;
  for (size_t i = 0; i < samples.size(); ++i) {
    evidence.push_back(GiveClasses(result.given.Of(result.contents[i]), samples[i]));
    samples[i] = {};
  }
  if (model != nullptr) CorrectAndObserve(seeds, consistency, evidence, &corrected);
  for (ViewEvidence& view : evidence) result.pixels.push_back(std::move(view.pixels_of));
  return corrected;
}

}  // namespace

std::vector<PhotoRecord> RegisteredPhotos(const Reconstruction& model) {
  std::unordered_map<uint32_t, const Camera*> cameras;
  for (const Camera& camera : model.cameras) cameras.emplace(camera.id, &camera);
  std::vector<PhotoRecord> photos;
  photos.reserve(model.images.size());
  for (const Image& image : model.images) {
    photos.push_back(MakePhotoRecord(*cameras.at(image.camera_id), image, /*held_out=*/false));
  }
  std::sort(photos.begin(), photos.end(), [](const PhotoRecord& a, const PhotoRecord& b) {
    return a.name < b.name;
  });
  return photos;
}

ClassImage MaskedPhotos::GivenMask(int view) const {
  if (!HasMask(view)) return {};
  const PhotoSize size = {photos[view].width, photos[view].height};
  const DecodedMask mask = DecodeMaskAgain(pairing.masks[view], size, contents[view]);
  return ClassesOf(mask.indices, given.Of(mask.contents), static_cast<int>(given.labels.size()));
}

void CollectObservations(const std::function<ViewMasks(int view)>& masks_of, MaskedPhotos* photos) {
  struct Place {
    size_t point, index;
  };
  std::vector<std::vector<Place>> places(photos->photos.size());
  photos->shown.clear();
  for (size_t point = 0; point < photos->observations.size(); ++point) {
    const PixelObservations& track = photos->observations[point];
    photos->shown.emplace_back(track.size());
    for (size_t k = 0; k < track.size(); ++k) places[track[k].view].push_back({point, k});
  }
  ForEachFile(static_cast<int64_t>(places.size()), [&](int64_t view) {
    if (places[view].empty()) return;
    const ViewMasks masks = masks_of(static_cast<int>(view));
    if (masks.given.Empty()) return;
    const PhotoRecord& photo = photos->photos[view];
    for (const Place& place : places[view]) {
      const Eigen::Vector2f pixel =
          photos->observations[place.point][place.index].pixel.cast<float>();
      const float x = pixel.x(), y = pixel.y();
      MaskObservation& shown = photos->shown[place.point][place.index];
      shown.given_radius = UniformRadius(masks.given, photo, x, y, RaggedRadius(photo));
      if (shown.given_radius < 0) continue;
      shown.corrected_radius = UniformRadius(masks.corrected, photo, x, y, SafeRadius(photo));
      const size_t at = static_cast<size_t>(y) * photo.width + static_cast<size_t>(x);
      shown.given_class = masks.given[at];
      shown.corrected_class = masks.corrected[at];
    }
  });
}

MaskedPhotos LoadMaskedPhotos(const Reconstruction* model,
                              std::vector<PhotoRecord> photos,
                              const MaskPairing& pairing,
                              const std::filesystem::path& mask_folder,
                              LabelZero label_zero,
                              MaskConsistency consistency) {
  return Load(model, std::move(photos), pairing, mask_folder, label_zero, consistency).photos;
}

CorrectedPhotos LoadCorrectedPhotos(const Reconstruction& model,
                                    std::vector<PhotoRecord> photos,
                                    const MaskPairing& pairing,
                                    const std::filesystem::path& mask_folder,
                                    LabelZero label_zero,
                                    MaskConsistency consistency) {
  return Load(&model, std::move(photos), pairing, mask_folder, label_zero, consistency);
}

ClassImage CorrectedPhotos::Mask(int view) const {
  ClassImage given = photos.GivenMask(view);
  if (rewriter == nullptr) return given;
  return rewriter->Rewrite(view, photos.photos[view], given);
}

}  // namespace semfoam
