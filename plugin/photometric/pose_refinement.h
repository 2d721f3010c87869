// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/colmap/colmap_model.h"
#include "plugin/dataset/scene_options.h"
#include "plugin/dataset/training_scene.h"
#include "plugin/photometric/effects.h"
#include "plugin/photometric/photo_alignment.h"
#include "plugin/photometric/view_comparison.h"

#include <filesystem>
#include <string>
#include <vector>

namespace semfoam {

// Refines the camera poses of the training photos, where that pays.
//
// Before the training, poses are adjusted to the tracks of the SfM points (track_adjustment.h), at
// first to every other track. They are refined where this lowers the squared reprojection errors of
// the tracks that were held back by kLeastTrackGain or more: COLMAP's own poses fit all tracks
// already, and those of half the tracks fit the other half no better.
//
// During the training, each photo is aligned to the foam's render (photo_alignment.h), at the
// moments of TrainingHooks::adapt_views. Whether that pays is decided on pixels that the alignments
// have not seen: each photo's grid is divided into blocks like a chessboard, alignments are found
// on either colour and compared on the other. They must explain kLeastPixelGain of the robust
// squared error there.
//
// Held-out photos stay where they are and take no part, and neither the frame of the model nor its
// scale changes (RemoveDrift). Cameras on rigs of several sensors have poses that depend on each
// other; those are not refined.

// Share of the squared reprojection errors of held-back tracks.
inline constexpr double kLeastTrackGain = 0.1;
// Share of the robust squared error on held-back pixels.
inline constexpr double kLeastPixelGain = 0.03;

class PoseRefiner {
 public:
  // `mode`: kOff never changes poses, kOn changes them without a least gain. `scene` must outlive
  // this object.
  PoseRefiner(TrainingScene* scene, EffectSwitch mode);

  // Adjusts the poses to the tracks of the scene's plan and sets those of the scene
  // (TrainingScene::SetPoses), where that pays. The result does not depend on the number of
  // threads.
  void RefineByTracks();

  // Returns whether Refine would look at renders.
  bool IsLooking() const { return IsPossible() && !(decided_ && !by_pixels_); }

  // Aligns the photos to their renders and sets the scene's poses, where that pays and the refiner
  // IsLooking. `views` are those of CompareViews; they no longer fit the scene's rays afterwards.
  // The result does not depend on the number of threads.
  void Refine(const std::vector<ComparedView>& views);

  // Returns whether a Refine has found out if the scene calls for it.
  bool IsDecided() const { return decided_; }
  // Returns whether the scene has other poses than its model.
  bool IsOn() const { return by_tracks_ || by_pixels_; }
  // [views] The current poses; those of held-out photos are the model's.
  const std::vector<Pose>& poses() const { return poses_; }
  // Returns a line about the decision and the movements.
  std::string Report() const;
  // Returns the effect "poses" for effects.json.
  Effect MakeEffect() const;

  // Describes the decision and the poses for checkpoints. After reading, Restore must be called.
  template <typename Archive>
  void Serialize(Archive* archive) {
    archive->Number("poses_by_tracks", &by_tracks_);
    archive->Number("poses_track_gain", &track_gain_);
    archive->Number("poses_tracks", &num_tracks_);
    archive->Number("poses_decided", &decided_);
    archive->Number("poses_by_pixels", &by_pixels_);
    archive->Number("poses_pixel_gain", &pixel_gain_);
    if (!IsOn()) return;
    for (size_t view = 0; view < poses_.size(); ++view) {
      const std::string name = "pose_" + std::to_string(view) + "_";
      Pose& pose = poses_[view];
      for (int i = 0; i < 4; ++i) {
        archive->Number(name + std::to_string(i), &pose.rotation.coeffs()[i]);
      }
      for (int i = 0; i < 3; ++i) {
        archive->Number(name + std::to_string(4 + i), &pose.translation[i]);
      }
    }
  }
  // Sets the scene's poses to those that were read.
  void Restore();

 private:
  // How far the training photos moved: degrees, and shares of the normalised frame's unit.
  struct Movements {
    double median_degrees = 0, largest_degrees = 0, median_shift = 0, largest_shift = 0;
  };
  Movements MeasureMovements() const;
  std::vector<AlignedPixel> PixelsOf(const ComparedView& compared) const;
  bool IsPossible() const { return mode_ != EffectSwitch::kOff && !scene_->Plan().has_rigs; }

  TrainingScene* const scene_;
  const EffectSwitch mode_;
  // [views]
  const std::vector<Pose> given_;
  std::vector<Pose> poses_;
  // The share of held-back errors that tracks explained, and their number; 0 where there are none.
  double track_gain_ = 0;
  size_t num_tracks_ = 0;
  bool by_tracks_ = false;
  // The share of the error on held-back pixels that alignments explained when it was decided.
  double pixel_gain_ = 0;
  bool decided_ = false;
  bool by_pixels_ = false;
};

// Writes the model in `input_path` to `folder` with the poses of the photos, in the same format.
// All else is as in the file: names, ids, features, points, the order of all. `photos` are those of
// the scene. Throws UserError as ReadReconstruction and WriteReconstruction do.
void WriteRefinedModel(const std::filesystem::path& input_path,
                       const std::vector<PhotoRecord>& photos,
                       const std::filesystem::path& folder);

}  // namespace semfoam
