// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/data/solid_ground.h"
#include "foam/data/training_views.h"
#include "foam/geometry/similarity.h"
#include "foam/image/image.h"
#include "foam/model/model.h"
#include "plugin/colmap/camera_rays.h"
#include "plugin/dataset/photo_depths.h"
#include "plugin/dataset/scene_findings.h"
#include "plugin/dataset/scene_plan.h"
#include "plugin/mask/class_image.h"
#include "plugin/mask/ignored_pixels.h"
#include "plugin/mask/mask_classes.h"
#include "plugin/mask/mask_consistency.h"
#include "plugin/mask/mask_decoding.h"
#include "plugin/mask/pixel_blocks.h"
#include "plugin/photo/photo_light.h"
#include "plugin/photo/photo_survey.h"

#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// Loads a planned scene: photos and masks become views with rays, colours and classes, ready to
// train on and to compare with.

struct LoadOptions {
  // Memory in bytes for photos and masks. They are kept if SceneMemory::held does not exceed this;
  // otherwise none is kept, and this much is used for the pixels that training draws.
  int64_t cache_bytes = std::numeric_limits<int64_t>::max();
  // Maximum number of photos and masks decoded at a time; 0 = one per thread.
  int most_at_once = 0;
  // Called with the number of decoded photos and of all that are to be decoded; from any thread,
  // one at a time.
  std::function<void(int done, int total)> report;
  // What is known of the photos: those that are not drawn (ScenePlan::IsDrawn) are then not
  // decoded. Null: nothing is known.
  const SceneFindings* known = nullptr;
  // Whether to keep what TakeFindings returns.
  bool keeps_findings = false;
};

// The photos, their cameras and their labels. Views are sorted by name. In memory, of photos that
// are drawn (ScenePlan::IsDrawn): 3 bytes a pixel for the photo, 1 or 2 for its classes, where all
// of them fit into LoadOptions::cache_bytes (else HoldsPixels is false, and a photo and its mask
// are decoded at each request); and 12 for each distorted camera's table of rays (ray_tables.h;
// cameras without a table compute each ray).
class TrainingScene final : public TrainingViews {
 public:
  // Decodes every photo and mask (but those of which LoadOptions::known tells) completely, in
  // parallel, and names the labels
  // (NameCorrectedLabels), and gives them the features of their regions (MeanLabelFeatures). Throws
  // UserError naming the first, by name, that is damaged, and whatever DecodeMask, NumberMasks,
  // CorrectMasks, NameLabels, ReadRegionFeatures and ReadRegionEmbeddings throw. Also throws where
  // masks in a folder that the user named have no id but 0, and where embeddings differ in length.
  explicit TrainingScene(ScenePlan plan, const LoadOptions& load = {});

  int NumViews() const override { return static_cast<int>(views_.size()); }
  int Width(int view) const override { return plan_.photos[view].width; }
  int Height(int view) const override { return plan_.photos[view].height; }
  bool IsHeldOut(int view) const override { return plan_.photos[view].held_out; }
  Eigen::Vector3d Origin(int view) const override { return views_[view].origin; }
  // The colour is that of the pixel; after SetLights, its ReferenceColor, which is NaN where it is
  // not known.
  bool Ray(int view, int x, int y, TrainingRay* ray) const override;
  void Prefetch(int view, int x, int y) const override;
  bool RayDirection(int view, int x, int y, Eigen::Vector3f* direction) const override;
  bool RayOf(int view, int x, int y, const PixelValue& value, TrainingRay* ray) const override;

  const BlockContrast* Contrast(int view) const override { return &views_[view].contrast; }
  std::optional<SolidGround> Ground() const override { return ground_; }
  int PassesPerDraw(int view) const override {
    return passes_per_draw_.empty() ? 1 : passes_per_draw_[view];
  }
  bool HasLabels(int view) const override { return HasMask(view); }
  bool HoldsPixels() const override { return holds_pixels_; }
  int64_t CacheBytes() const override { return cache_bytes_; }
  int MostOpenViews() const override { return most_open_views_; }
  // Throws UserError also where a file has changed since the scene was loaded: it is missing, has
  // another size, or is a mask with other ids.
  std::unique_ptr<ViewPixels> OpenView(int view) const override;

  // Converts the colours of all later rays to the reference exposure. `lights` [views]; empty: the
  // colours stay as they are.
  void SetLights(std::vector<PhotoLight> lights);

  // Moves the cameras: all later rays are those of these poses. `cam_from_world` [views]. Photos()
  // has these poses, too.
  void SetPoses(const std::vector<Pose>& cam_from_world);

  // Sets the distances of all later rays (TrainingRay::distance). `depths` [views]; empty: none.
  void SetDepths(std::vector<PhotoDepths> depths);

  // Sets what things stand on, before a training.
  void SetGround(const std::optional<SolidGround>& ground) { ground_ = ground; }

  // Sets how often pixels are drawn (TrainingViews::PassesPerDraw), before a training. `passes`
  // [views]; empty: 1 for all.
  void SetPassesPerDraw(std::vector<int> passes);

  // Takes pixels out of the training: they have no ray, but still a direction. `excluded` [views];
  // empty: none.
  void SetExcluded(std::vector<PixelBlocks> excluded);

  const ScenePlan& Plan() const { return plan_; }
  const std::vector<PhotoRecord>& Photos() const { return plan_.photos; }
  const Similarity& WorldFromNormalized() const { return plan_.world_from_normalized; }
  // Appends dense seeds (SeedPoint::is_dense) to Seeds().
  void AddSeeds(std::vector<SeedPoint> dense);
  // Returns the SfM points, followed by those of the dense cloud, if there is one, and of AddSeeds.
  const std::vector<SeedPoint>& Seeds() const { return seeds_.empty() ? plan_.seeds : seeds_; }
  // Returns ScenePlan::seed_cloud without its points, which are among Seeds().
  const SeedCloud& Cloud() const { return plan_.seed_cloud; }

  // Returns one label for each class; none without masks, or when they are empty.
  const std::vector<Label>& Labels() const { return labels_; }
  int NumClasses() const { return static_cast<int>(labels_.size()); }

  // Whether Photo() has the photo; not those that are not drawn.
  bool HoldsPhoto(int view) const { return !views_[view].photo.data.empty(); }
  // CHECKs HoldsPhoto(view).
  const Image8& Photo(int view) const;
  // Returns what was looked up in the photos, without checksums; once, with
  // LoadOptions::keeps_findings.
  SceneFindings TakeFindings();
  // Returns the survey at the places of ScenePlan::tracks in this view, in their order.
  const PhotoSurvey& Survey(int view) const { return surveys_[view]; }
  // Whether nothing is learned from this pixel (SceneOptions::ignore_path): it has no ray.
  bool IsIgnored(int view, int x, int y) const { return views_[view].ignored.Contains(x, y); }
  bool HasMask(int view) const { return !plan_.masks.masks[view].empty(); }
  // Returns the label ids (Label::id) of a view's pixels at the photo's size; 0 where unlabelled or
  // without a mask.
  LabelImage LabelIds(int view) const;

  // Returns the time that decoding and checking the photos and masks took.
  double SecondsDecoding() const { return seconds_decoding_; }

  // Returns "64 of 64 photos have a mask, 13 labels, 0 masks unused", or that there are none.
  std::string MaskReport() const;
  // Returns sentences for the user about the masks and their names, besides those of the plan.
  std::vector<std::string> Warnings() const;
  // Returns the report on the correction of the masks by the tracks.
  const MaskConsistencyReport& Consistency() const { return consistency_; }
  // Returns one line about the photos: how many, how many held out, what was left out, rescaled or
  // ignored.
  std::string PhotoReport() const;

 private:
  struct View {
    Image8 photo;
    ClassImage classes;
    IgnoredPixels ignored;
    // Of the pixels that are not ignored.
    BlockContrast contrast;
    // Camera centre in the normalised frame, and rotation.
    Eigen::Vector3d origin;
    Eigen::Matrix3d world_from_cam;
    std::shared_ptr<const PixelRays> rays;
  };

  // The contents of all masks, before their ids are numbered as classes.
  struct DecodedMasks {
    // [views] DecodedMask::indices; empty where pixels are not held or not decoded.
    std::vector<IdImage> indices;
    // [views] Ids of each mask at the observed pixels of the seeds' tracks; empty unless masks are
    // corrected by the tracks.
    std::vector<IdSamples> samples;
  };

  void LoadPhotosAndMasks(const LoadOptions& load);
  DecodedMasks DecodeAll(const LoadOptions& load);
  // Returns whether the view's pixels are in memory after loading.
  bool HoldsPixelsOf(int view) const { return holds_pixels_ && plan_.IsDrawn(view); }
  // Corrects the masks by the tracks; takes them from the plan.
  void CorrectMaskClasses(std::vector<IdSamples> samples);
  // Gives the labels the mean features of their regions in the masks of photos that are not held
  // out (region_features.h).
  void AverageRegionFeatures();
  // Returns a sentence about masks without an id but 0; empty where there are ids, or no masks.
  std::string NoIdsSentence() const;
  void PlaceCamera(int view);
  Image8 DecodePhoto(int view) const;
  // Returns the classes of the corrected mask; `indices` as of DecodedMask.
  ClassImage ClassesOfMask(int view, IdImage indices) const;
  PixelValue ValueAt(const Image8& photo, const ClassImage& classes, int x, int y) const;

  ScenePlan plan_;
  // Empty: there is no dense cloud.
  std::vector<SeedPoint> seeds_;
  std::vector<View> views_;
  std::vector<PhotoSurvey> surveys_;
  bool holds_pixels_ = true;
  int64_t cache_bytes_ = 0;
  int most_open_views_ = 1;
  std::vector<MaskContents> mask_contents_;
  // [views] Empty unless LoadOptions::keeps_findings.
  std::vector<IdSamples> kept_samples_;
  MaskClasses mask_classes_;
  std::shared_ptr<const MaskRewriter> mask_rewriter_;
  // Empty: none.
  std::vector<PhotoLight> lights_;
  // Empty: none.
  std::vector<PhotoDepths> depths_;
  std::optional<SolidGround> ground_;
  // Empty: 1 for all.
  std::vector<int> passes_per_draw_;
  // Empty: none.
  std::vector<PixelBlocks> excluded_;
  std::vector<Label> labels_;
  MaskConsistencyReport consistency_;
  std::string names_warning_;
  std::string features_warning_;
  double seconds_decoding_ = 0;
};

}  // namespace semfoam
