// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/dataset/scene_findings.h"

#include "foam/train/checkpoint.h"
#include "foam/train/checkpoint_state.h"

#include <cstdint>
#include <cstring>
#include <numeric>

namespace semfoam {
namespace {

constexpr char kGroup[] = "findings";
constexpr size_t kPatchBytes = sizeof(PhotoSurvey::Patch);

size_t Sum(const std::vector<uint32_t>& counts) {
  return std::accumulate(counts.begin(), counts.end(), size_t{0});
}

// The findings of all photos, one after the other, as the file has them.
struct FlatFindings {
  // [photos] Lengths of the vectors of each.
  std::vector<uint32_t> num_places, num_contrasts, num_ids, num_samples, num_indices;
  // [photos]
  std::vector<int64_t> border_pixels, white_border_pixels, zero_pixels;
  std::vector<int32_t> mask_widths, mask_heights;
  std::vector<uint8_t> mask_is_rgb;
  // [places] Whether there is a patch, a contrast; and these, 0 where there is none.
  std::vector<uint8_t> has_patch, has_contrast, patches;
  std::vector<float> contrasts;
  std::vector<uint8_t> block_contrasts;
  std::vector<uint32_t> ids;
  // [samples] IdSamples::index_at; [indices] IdSamples::pixels_of.
  std::vector<int32_t> index_at, indices;
  std::vector<int64_t> pixels_of_index;
  std::vector<uint64_t> photo_checksums, mask_checksums;

  // Describes the file (foam/train/checkpoint_state.h). The lengths of the vectors come first.
  template <typename Archive>
  void Serialize(Archive* archive) {
    size_t num_photos = num_places.size(), num_mask_checksums = mask_checksums.size();
    archive->Number("photos", &num_photos);
    archive->Number("mask_checksums", &num_mask_checksums);
    archive->Array("num_places", &num_places, num_photos);
    archive->Array("num_contrasts", &num_contrasts, num_photos);
    archive->Array("num_ids", &num_ids, num_photos);
    archive->Array("num_samples", &num_samples, num_photos);
    archive->Array("num_indices", &num_indices, num_photos);
    archive->Array("border_pixels", &border_pixels, num_photos);
    archive->Array("white_border_pixels", &white_border_pixels, num_photos);
    archive->Array("zero_pixels", &zero_pixels, num_photos);
    archive->Array("mask_widths", &mask_widths, num_photos);
    archive->Array("mask_heights", &mask_heights, num_photos);
    archive->Array("mask_is_rgb", &mask_is_rgb, num_photos);
    archive->Array("photo_checksums", &photo_checksums, num_photos);
    archive->Array("mask_checksums", &mask_checksums, num_mask_checksums);
    archive->Array("has_patch", &has_patch, Sum(num_places));
    archive->Array("patches", &patches, kPatchBytes * Sum(num_places));
    archive->Array("has_contrast", &has_contrast, Sum(num_places));
    archive->Array("contrasts", &contrasts, Sum(num_places));
    archive->Array("block_contrasts", &block_contrasts, Sum(num_contrasts));
    archive->Array("ids", &ids, Sum(num_ids));
    archive->Array("index_at", &index_at, Sum(num_samples));
    archive->Array("indices", &indices, Sum(num_indices));
    archive->Array("pixels_of_index", &pixels_of_index, Sum(num_indices));
  }
};

void Append(const PhotoFindings& photo, FlatFindings* flat) {
  const PhotoSurvey& survey = photo.survey;
  flat->num_places.push_back(static_cast<uint32_t>(survey.patches.size()));
  for (size_t k = 0; k < survey.patches.size(); ++k) {
    const auto patch = survey.patches[k].value_or(PhotoSurvey::Patch{});
    flat->has_patch.push_back(survey.patches[k].has_value());
    flat->patches.insert(flat->patches.end(), patch.begin(), patch.end());
    flat->has_contrast.push_back(survey.contrasts[k].has_value());
    flat->contrasts.push_back(survey.contrasts[k].value_or(0.f));
  }
  flat->border_pixels.push_back(survey.border_pixels);
  flat->white_border_pixels.push_back(survey.white_border_pixels);

  const std::vector<uint8_t>& blocks = photo.contrast.Values();
  flat->num_contrasts.push_back(static_cast<uint32_t>(blocks.size()));
  flat->block_contrasts.insert(flat->block_contrasts.end(), blocks.begin(), blocks.end());

  flat->mask_is_rgb.push_back(photo.mask.is_rgb);
  flat->num_ids.push_back(static_cast<uint32_t>(photo.mask.ids.size()));
  flat->ids.insert(flat->ids.end(), photo.mask.ids.begin(), photo.mask.ids.end());
  flat->zero_pixels.push_back(photo.mask.num_zero);
  flat->mask_widths.push_back(photo.mask.size.width);
  flat->mask_heights.push_back(photo.mask.size.height);

  flat->num_samples.push_back(static_cast<uint32_t>(photo.samples.index_at.size()));
  for (const IdIndex index : photo.samples.index_at) {
    flat->index_at.push_back(static_cast<int32_t>(index));
  }
  flat->num_indices.push_back(static_cast<uint32_t>(photo.samples.pixels_of.size()));
  for (const auto& [index, pixels] : photo.samples.pixels_of) {
    flat->indices.push_back(static_cast<int32_t>(index));
    flat->pixels_of_index.push_back(pixels);
  }
}

// Takes the findings of the photos off the vectors, one photo after the other.
class Unpacker {
 public:
  explicit Unpacker(const FlatFindings& flat) : flat_(flat) {}

  PhotoFindings Next(const PhotoRecord& record) {
    const size_t photo = photo_++;
    PhotoFindings findings;
    for (uint32_t k = 0; k < flat_.num_places[photo]; ++k, ++place_) {
      PhotoSurvey::Patch patch;
      std::memcpy(patch.data(), &flat_.patches[kPatchBytes * place_], kPatchBytes);
      auto& survey = findings.survey;
      survey.patches.push_back(flat_.has_patch[place_] ? std::optional(patch) : std::nullopt);
      survey.contrasts.push_back(flat_.has_contrast[place_] ? std::optional(flat_.contrasts[place_])
                                                            : std::nullopt);
    }
    findings.survey.border_pixels = flat_.border_pixels[photo];
    findings.survey.white_border_pixels = flat_.white_border_pixels[photo];
    findings.contrast = BlockContrast(
        record.width, Take(flat_.block_contrasts, flat_.num_contrasts[photo], &block_));

    findings.mask.is_rgb = flat_.mask_is_rgb[photo] != 0;
    findings.mask.ids = Take(flat_.ids, flat_.num_ids[photo], &id_);
    findings.mask.num_zero = flat_.zero_pixels[photo];
    findings.mask.size = {flat_.mask_widths[photo], flat_.mask_heights[photo]};

    for (uint32_t k = 0; k < flat_.num_samples[photo]; ++k) {
      findings.samples.index_at.push_back(IdIndex{flat_.index_at[sample_++]});
    }
    for (uint32_t k = 0; k < flat_.num_indices[photo]; ++k, ++index_) {
      findings.samples.pixels_of[IdIndex{flat_.indices[index_]}] = flat_.pixels_of_index[index_];
    }
    return findings;
  }

 private:
  template <typename T>
  static std::vector<T> Take(const std::vector<T>& values, size_t count, size_t* begin) {
    const auto first = values.begin() + static_cast<std::ptrdiff_t>(*begin);
    *begin += count;
    return {first, first + static_cast<std::ptrdiff_t>(count)};
  }

  const FlatFindings& flat_;
  size_t photo_ = 0, place_ = 0, block_ = 0, id_ = 0, sample_ = 0, index_ = 0;
};

}  // namespace

void WriteSceneFindings(const std::filesystem::path& path, const SceneFindings& findings) {
  FlatFindings flat;
  for (const PhotoFindings& photo : findings.photos) Append(photo, &flat);
  flat.photo_checksums = findings.checksums.photos;
  flat.mask_checksums = findings.checksums.masks;
  CheckpointContents contents;
  StateWriter writer(kGroup, &contents);
  flat.Serialize(&writer);
  WriteCheckpoint(path, contents);
}

std::optional<SceneFindings> ReadSceneFindings(const std::filesystem::path& path,
                                               const ScenePlan& plan) {
  const Checkpoint file(path, /*keeps=*/{}, kRemedyOfSplit);
  StateReader reader(kGroup, file);
  FlatFindings flat;
  flat.Serialize(&reader);
  const size_t num_photos = plan.photos.size();
  if (flat.num_places.size() != num_photos) return std::nullopt;
  for (size_t i = 0; i < num_photos; ++i) {
    const PhotoRecord& photo = plan.photos[i];
    if (flat.num_contrasts[i] != BlockContrast::Bytes(photo.width, photo.height)) {
      return std::nullopt;
    }
  }
  SceneFindings findings;
  findings.photos.reserve(num_photos);
  Unpacker unpacker(flat);
  for (const PhotoRecord& photo : plan.photos) findings.photos.push_back(unpacker.Next(photo));
  findings.checksums = {flat.photo_checksums, flat.mask_checksums};
  return findings;
}

}  // namespace semfoam
