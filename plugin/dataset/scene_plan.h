// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/data/training_views.h"
#include "foam/geometry/similarity.h"
#include "foam/model/model.h"
#include "plugin/colmap/seed_cloud.h"
#include "plugin/colmap/tracks.h"
#include "plugin/dataset/scene_options.h"
#include "plugin/mask/mask_pairing.h"
#include "plugin/photo/photo.h"

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace semfoam {

// Plans what a training loads, from a COLMAP model and the headers of photos and masks, without
// decoding a pixel.

// Vectors marked [photos] are parallel to `photos`.
struct ScenePlan {
  // The registered images, sorted by name, with cameras of the size used in training.
  std::vector<PhotoRecord> photos;
  // [photos] Files and their sizes.
  std::vector<std::filesystem::path> files;
  std::vector<PhotoSize> file_sizes;
  // [photos] 0: no pixel of the photo is drawn, as in the training of a block far from it. Empty:
  // all are.
  std::vector<uint8_t> is_drawn;
  // [photos] PhotoHeader::decoding_bytes and MaskHeader::decoding_bytes; 0 without a mask.
  std::vector<uint64_t> photo_decoding;
  std::vector<uint64_t> mask_decoding;
  // Masks of `files`; all empty without masks.
  MaskPairing masks;
  // [photos] Binary masks of ignored pixels; empty where a photo has none.
  std::vector<std::filesystem::path> ignore_files;
  // Copied from SceneOptions.
  bool ignore_inverted = false;
  // Empty: no masks; no names.
  std::filesystem::path mask_folder;
  std::filesystem::path labels_file;
  // File of the regions' classes, scores and embeddings (region_features.h); empty: none.
  std::filesystem::path features_file;
  // Whether the user named them; false: they were found by their usual names.
  bool masks_are_given = false;
  bool labels_are_given = false;
  // Copied from SceneOptions.
  LabelZero label_zero = LabelZero::kAuto;
  MaskConsistency mask_consistency = MaskConsistency::kAuto;
  Similarity world_from_normalized;
  // The SfM points that training starts from (MakeSeeds).
  std::vector<SeedPoint> seeds;
  // The dense point cloud that it starts from, too; empty without SceneOptions::seed_path.
  SeedCloud seed_cloud;
  // [seeds] Pixels at which training photos observe them; empty unless masks are corrected by them.
  std::vector<PixelObservations> seed_tracks;
  // Number of points in the model; larger than seeds.size() where some are no seeds.
  int64_t num_points = 0;
  // Number of photos in the image folder that the model does not have.
  int num_unregistered = 0;
  // Number of photos whose size differs from their camera's.
  int num_rescaled = 0;
  // Number of photos larger than max_image_size.
  int num_reduced = 0;
  // The first view of each camera whose rays are tabulated (ChooseTables).
  std::vector<int> table_views;
  // Whether a rig of the model has several sensors, so that poses depend on each other.
  bool has_rigs = false;
  // A sample of the model's tracks (SampleTracks).
  std::vector<Track> tracks;
  // [photos] Index of the lens (LensOfPhotos).
  std::vector<int> lenses;
  // DistortionAtCorners of the most distorted camera, in pixels.
  double distortion = 0;
  // Sentences for the user: scene_warnings.h, NoMasksWarning.
  std::vector<std::string> warnings;

  bool IsDrawn(size_t photo) const { return is_drawn.empty() || is_drawn[photo] != 0; }
};

// Reads the model and the photos' headers, pairs the masks, and chooses the normalised frame.
//
// Seeds are the model's points within kFarRadius, in ascending order of their ids, finite, each
// position once (with the tracks of all points that are there). Points without a track are left
// out, unless no point has one (models of other programs).
//
// Throws UserError, one sentence naming the file: whatever ReadReconstruction and PairMasks throw;
// no registered image; a registered image without a photo, or whose photo is no image or has
// another aspect than its camera; a mask or label path that is given but missing; a mask path
// without a mask; a label path without masks; an ignore path without a mask of a photo; what
// ReadSeedCloud throws of the dense cloud; what ReadPhotoHeader and ReadMaskHeader throw of the
// photos and masks. Throws FieldError where test_every holds out everything or is negative.
ScenePlan PlanScene(const SceneOptions& options);

}  // namespace semfoam
