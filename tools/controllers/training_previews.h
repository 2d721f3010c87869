// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/data/pixel_range.h"
#include "foam/image/image.h"
#include "foam/train/trainer.h"
#include "plugin/dataset/training_scene.h"

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <set>
#include <vector>

namespace semfoam {

// The longer side of a preview's pictures is at most so long, in pixels: a preview then takes the
// time of a few iterations.
inline constexpr int kPreviewSize = 320;

// Throws UserError where `folder` holds an index.html that TrainingPreviews would replace and did
// not write.
void RequireReplaceablePreviews(const std::filesystem::path& folder);

// Shows a training while it runs: writes into a folder, every so many seconds, <iteration>.png (six
// digits or more) with the first held-out photo, or the first photo where none is held out, beside
// the foam's render and, where there are labels, the labels of that view; and index.html, a page
// with the newest of these pictures and links to the others, which reloads itself in a browser
// until the training is done.
class TrainingPreviews {
 public:
  // `scene` must outlive this object. `every` > 0, in seconds. `resumes`: keeps the pictures of the
  // part of the training that is not run again. Throws UserError where the folder cannot be written
  // to, or the photo not be read.
  TrainingPreviews(const TrainingScene& scene,
                   const std::filesystem::path& folder,
                   double every,
                   bool resumes);

  // Both only warn where a file cannot be written.
  // Takes over a report, for the text of the page.
  void Report(const TrainingProgress& progress);
  // Writes a preview if it is time for one, or if the iteration is the last.
  void Update(int64_t iteration, bool is_last, const TrainingHooks::RenderPixels& render);

 private:
  // Returns the picture of the view as the foam shows it.
  Image8 Draw(const TrainingHooks::RenderPixels& render) const;
  // There must be a picture.
  void WritePage() const;
  // Removes the pictures from this iteration on: they are of another training, or of a part that is
  // run again.
  void RemovePictures(int64_t first_iteration);

  const TrainingScene& scene_;
  const std::filesystem::path folder_;
  const double every_;
  // What is shown.
  int view_ = 0;
  int width_ = 0;
  int height_ = 0;
  // [height][width]
  std::vector<ViewPixel> pixels_;
  Image8 photo_;
  TrainingProgress progress_;
  // The iterations of those in the folder.
  std::set<int64_t> pictures_;
  std::chrono::steady_clock::time_point last_;
  bool is_first_ = true;
  bool is_done_ = false;
};

}  // namespace semfoam
