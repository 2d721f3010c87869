// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/data/training_views.h"
#include "foam/geometry/similarity.h"
#include "foam/image/image.h"
#include "foam/model/model.h"
#include "plugin/colmap/camera_rays.h"
#include "plugin/colmap/tracks.h"
#include "plugin/mask/mask_classes.h"
#include "plugin/mask/mask_consistency.h"
#include "plugin/mask/mask_decoding.h"
#include "plugin/mask/mask_pairing.h"
#include "plugin/photo/photo.h"
#include "plugin/photo/photo_light.h"
#include "plugin/photo/photo_survey.h"

#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// Whether an effect is simulated: as the photos call for it, or as the user says.
enum class EffectSwitch { kAuto, kOn, kOff };

struct SceneOptions {
  // Folder that image names are relative to.
  std::filesystem::path image_path;
  // A COLMAP model, or a folder that FindModelFolder knows.
  std::filesystem::path input_path;
  // Folder of the masks; empty: what FindMaskFolder finds in workspace_path, then beside
  // image_path, if anything.
  std::filesystem::path mask_path;
  std::filesystem::path workspace_path;
  // File of the labels' names; empty: labels.json beside the mask folder, if there is one.
  std::filesystem::path labels_path;
  // Hold out every so many photos by name, from the first; 0 = none.
  int test_every = 0;
  // What id 0 of the masks is.
  LabelZero label_zero = LabelZero::kAuto;
  MaskConsistency mask_consistency = MaskConsistency::kAuto;
  // Longest side in pixels to which larger photos are reduced; -1 = keep their size.
  int max_image_size = -1;
  // Whether to read masks; false: train as if there were none.
  bool use_masks = true;
  // kAuto: treat cameras whose distortion moves no corner by kLeastDistortion as pinhole cameras.
  EffectSwitch distortion = EffectSwitch::kAuto;
  // Seed of the sample of tracks.
  uint64_t random_seed = 0;
};

inline constexpr double kLeastDistortion = 0.1;  // pixels

// What there is to load, found without decoding a pixel. Vectors marked [photos] are parallel to
// `photos`.
struct ScenePlan {
  // The registered images, sorted by name, with cameras of the size that is trained on.
  std::vector<PhotoRecord> photos;
  // [photos] Files and their sizes.
  std::vector<std::filesystem::path> files;
  std::vector<PhotoSize> file_sizes;
  // [photos] PhotoHeader::decoding_bytes and MaskHeader::decoding_bytes; 0 without a mask.
  std::vector<uint64_t> photo_decoding;
  std::vector<uint64_t> mask_decoding;
  // Masks of `files`; all empty without masks.
  MaskPairing masks;
  // Empty: no masks; no names.
  std::filesystem::path mask_folder;
  std::filesystem::path labels_file;
  // Whether the user named them; false: they were found.
  bool masks_are_given = false;
  bool labels_are_given = false;
  LabelZero label_zero = LabelZero::kAuto;
  MaskConsistency mask_consistency = MaskConsistency::kAuto;
  Similarity world_from_normalized;
  std::vector<SeedPoint> seeds;
  // [seeds] Where training photos observe them; empty unless masks are held against them.
  std::vector<PixelObservations> seed_tracks;
  // Number of points in the model; larger than seeds.size() where some are unfit.
  int64_t num_points = 0;
  // Number of files in the image folder that the model does not have.
  int num_unregistered = 0;
  // Number of photos whose size differs from their camera's.
  int num_rescaled = 0;
  // Number of photos larger than max_image_size.
  int num_reduced = 0;
  // The first view of each camera whose rays are tabulated.
  std::vector<int> table_views;
  // A sample of the model's tracks (SampleTracks).
  std::vector<Track> tracks;
  // [photos] Index of the lens (LensOfPhotos).
  std::vector<int> lenses;
  // DistortionAtCorners of the most distorted camera, in pixels.
  double distortion = 0;
  // Sentences for the user: scene_warnings.h, NoMasksWarning.
  std::vector<std::string> warnings;

  // Memory in bytes, at the most. Of all photos, masks and ray tables, where they are held.
  uint64_t MemoryBytes() const;
  // Of these, the tables.
  uint64_t TableBytes() const;
  // What loading one more photo and mask at a time takes beside what is held.
  uint64_t LoadingBytes() const;
  // What opening a photo and its mask takes (TrainingScene::OpenView), where they are not held.
  uint64_t OpeningBytes() const;
  // What holding the masks against the tracks takes, before there is a foam.
  uint64_t CorrectionBytes() const;
};

// How a planned dataset is loaded.
struct LoadOptions {
  // Keep photos and masks in memory if ScenePlan::MemoryBytes does not exceed this. Otherwise keep
  // none of them, and use this much for the pixels that training draws.
  int64_t cache_bytes = std::numeric_limits<int64_t>::max();
  // Maximum number of photos and masks decoded at a time; 0 = one per thread.
  int most_at_once = 0;
  // Called with the number of decoded photos and of all photos; from any thread, one at a time.
  std::function<void(int done, int total)> report;
};

// Reads the model and the photos' headers, pairs the masks, and chooses the normalised frame.
//
// Seeds are the model's points within kFarRadius, in ascending order of their ids, finite, each
// position once (with the tracks of all points that are there). Points without a track are left
// out, unless no point has one (models of other programs).
//
// Throws UserError, one sentence naming the file or option: whatever ReadReconstruction and
// PairMasks throw; no registered image; a registered image without a photo, or whose photo is no
// image or has another aspect than its camera; a test_every that
// holds out everything or is negative; a mask or label path that is given but missing; a mask path
// without a mask; a label path without masks; what ReadPhotoHeader and ReadMaskHeader throw of the
// photos and masks.
ScenePlan PlanScene(const SceneOptions& options);

// The photos, their cameras and their labels, ready to train on and to compare with. Views are
// sorted by name. In memory: 3 bytes a pixel for the photo, 1 or 2 for its classes, where all of
// them fit into LoadOptions::cache_bytes (else HoldsPixels is false, and a photo and its mask are
// decoded whenever they are asked for); and 12 for each distorted camera's table of rays (up to
// 1 GiB of tables; cameras shared by the most photos come first, and those without a table compute
// each ray).
class TrainingScene final : public TrainingViews {
 public:
  // Decodes every photo and mask completely, in parallel. Throws UserError naming the first, by
  // name, that is damaged, and whatever DecodeMask, NumberMasks, CorrectMasks and NameLabels throw.
  // Also where masks in a folder that the user named have no id but 0. Labels are named by
  // NameCorrectedLabels.
  explicit TrainingScene(ScenePlan plan, const LoadOptions& load = {});

  int NumViews() const override { return static_cast<int>(views_.size()); }
  int Width(int view) const override { return plan_.photos[view].width; }
  int Height(int view) const override { return plan_.photos[view].height; }
  bool IsHeldOut(int view) const override { return plan_.photos[view].held_out; }
  Eigen::Vector3d Origin(int view) const override { return views_[view].origin; }
  // The colour is the pixel's; after SetLights, what ReferenceColor makes of it, not a number where
  // that is not known.
  bool Ray(int view, int x, int y, TrainingRay* ray) const override;
  bool RayDirection(int view, int x, int y, Eigen::Vector3f* direction) const override;
  bool RayOf(int view, int x, int y, const PixelValue& value, TrainingRay* ray) const override;

  bool HoldsPixels() const override { return holds_pixels_; }
  int64_t CacheBytes() const override { return cache_bytes_; }
  int MostOpenViews() const override { return most_open_views_; }
  // Throws UserError also where a file is not what it was when the scene was loaded: gone, of
  // another size, or a mask with other ids.
  std::unique_ptr<ViewPixels> OpenView(int view) const override;

  // From now on colours are brought to the reference exposure. One light for each view; none: the
  // photos stay as they are, and nothing is stored.
  void SetLights(std::vector<PhotoLight> lights);

  const ScenePlan& Plan() const { return plan_; }
  const std::vector<PhotoRecord>& Photos() const { return plan_.photos; }
  const Similarity& WorldFromNormalized() const { return plan_.world_from_normalized; }
  const std::vector<SeedPoint>& Seeds() const { return plan_.seeds; }

  // One label per class; none without masks, or when they are empty.
  const std::vector<Label>& Labels() const { return labels_; }
  int NumClasses() const { return static_cast<int>(labels_.size()); }

  // CHECKs HoldsPixels().
  const Image8& Photo(int view) const;
  // At the places of ScenePlan::tracks in this view, in their order.
  const PhotoSurvey& Survey(int view) const { return surveys_[view]; }
  bool HasMask(int view) const { return !plan_.masks.masks[view].empty(); }
  // The label ids (Label::id) of a view's pixels at the photo's size; 0 where unlabelled or without
  // a mask.
  LabelImage LabelIds(int view) const;

  // Time that decoding and checking the photos and masks took.
  double SecondsDecoding() const { return seconds_decoding_; }

  // "64 of 64 photos have a mask, 13 labels, 0 masks unused", or that there are none.
  std::string MaskReport() const;
  // Sentences for the user about the masks and their names, besides those of the plan.
  std::vector<std::string> Warnings() const;
  // What holding the masks against the tracks has come to.
  const MaskConsistencyReport& Consistency() const { return consistency_; }
  // The photos, in one line: how many, how many held out, what was left out or rescaled.
  std::string PhotoReport() const;

 private:
  struct View {
    Image8 photo;
    ClassImage classes;
    Eigen::Vector3d origin;          // normalised frame
    Eigen::Matrix3d world_from_cam;  // rotation
    std::shared_ptr<const PixelRays> rays;
  };

  void LoadPhotosAndMasks(const LoadOptions& load);
  // Masks without an id but 0; empty where there are ids, or no masks.
  std::string NoIdsSentence() const;
  void PlaceCameras();
  Image8 DecodePhoto(int view) const;
  // The classes that the corrected mask gives; `indices` as of DecodedMask.
  ClassImage ClassesOfMask(int view, ClassImage indices) const;
  PixelValue ValueAt(const Image8& photo, const ClassImage& classes, int x, int y) const;

  ScenePlan plan_;
  std::vector<View> views_;
  std::vector<PhotoSurvey> surveys_;
  bool holds_pixels_ = true;
  int64_t cache_bytes_ = 0;
  int most_open_views_ = 1;
  std::vector<MaskContents> mask_contents_;
  MaskClasses mask_classes_;
  std::shared_ptr<const MaskRewriter> mask_rewriter_;
  std::vector<PhotoLight> lights_;  // empty: none
  std::vector<Label> labels_;
  MaskConsistencyReport consistency_;
  std::string names_warning_;
  double seconds_decoding_ = 0;
};

}  // namespace semfoam
