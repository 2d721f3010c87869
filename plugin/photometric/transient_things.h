// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/dataset/training_scene.h"
#include "plugin/mask/pixel_blocks.h"
#include "plugin/photo/photo_light.h"
#include "plugin/photometric/effects.h"
#include "plugin/photometric/view_comparison.h"

#include <cstdint>
#include <string>
#include <vector>

namespace semfoam {

// Finds what passes by while a scene is photographed: a hand, a person, a shadow, seen in one photo
// or a few and not in the others that look at the same place. Such pixels teach a foam matter that
// hangs before one camera, and are left out of the training.
//
// A foam of 15 % of the run already shows what most photos agree on, so a photo differs from its
// render where something passes by. It differs in other places too: edges and far things not
// learned yet, mirrored lamps. Hence a pixel of the grid speaks for a transient thing only if
// - the mean difference over its 3x3 neighbours is kLeastRatio times what photos usually show at
//   that place: the median over at least kFewestViews photos that see the same voxel, whose edge is
//   about 1.5 times the distance of the samples (up to 4 times that where there are fewer photos);
// - the foam shows that place well in the others (their median is at most kMostUsual);
// - and it is kLeastOwnRatio times the photo's own median.
// Pixels that remain after an opening by 3x3 form regions, of at least kLeastShare of the photo;
// where the photo is brighter in all channels, five times that, because mirrored lamps are. Regions
// grow over neighbours that differ at all, and by one block. A photo of which the foam shows the
// rest poorly is not judged, nor one with more than kMostShare in regions, nor one that is compared
// on a grid of less than 600 places, as in very short trainings. (Cf. Sabour et al.,
// RobustNeRF, CVPR 2023, whose trimmed loss knows no other views.)
//
// What was found before is judged anew, as its pixels are rendered too. Held-out photos take no
// part.

// Squares of differences of display values, and ratios of them.
inline constexpr double kLeastRatio = 6;
inline constexpr double kMostUsual = 0.004;
inline constexpr double kLeastOwnRatio = 8;
inline constexpr int kFewestViews = 5;
// Of a photo's area.
inline constexpr double kLeastShare = 0.006;
inline constexpr double kMostShare = 0.4;

class TransientFinder {
 public:
  // `enabled` = false: finds nothing. `scene` must outlive this object.
  TransientFinder(TrainingScene* scene, bool enabled);

  bool IsEnabled() const { return enabled_; }

  // Finds transient things in the training photos and takes them out of the scene's rays
  // (TrainingScene::SetExcluded). `lights` are those of the photos [views], or empty. The result
  // does not depend on the number of threads.
  void Find(const std::vector<ComparedView>& views, const std::vector<PhotoLight>& lights);

  // Returns the number of photos with something that passes by, and its share of their pixels.
  int NumPhotos() const;
  double Share() const;
  // [views] What is left out of each photo.
  const std::vector<PixelBlocks>& blocks() const { return blocks_; }
  // Returns a line about what was found.
  std::string Report() const;
  // Returns the effect "transients" for effects.json.
  Effect MakeEffect() const;

  // Describes what was found for checkpoints. After reading, Restore must be called.
  template <typename Archive>
  void Serialize(Archive* archive) {
    archive->Number("transient_looked", &looked_);
    for (size_t view = 0; view < blocks_.size(); ++view) {
      const std::string name = "transient_" + std::to_string(view);
      PixelBlocks& of_view = blocks_[view];
      archive->Number(name + "_edge", &of_view.edge);
      if (of_view.edge == 0) continue;
      auto count = static_cast<uint64_t>(of_view.is_in.size());
      archive->Number(name + "_columns", &of_view.columns);
      archive->Number(name + "_blocks", &count);
      archive->Array(name, &of_view.is_in, count);
    }
  }
  // Sets the scene's excluded pixels to those that were read.
  void Restore();

 private:
  TrainingScene* const scene_;
  const bool enabled_;
  bool looked_ = false;
  // [views]
  std::vector<PixelBlocks> blocks_;
};

}  // namespace semfoam
