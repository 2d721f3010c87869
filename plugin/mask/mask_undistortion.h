// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/colmap/camera_models.h"
#include "plugin/colmap/colmap_model.h"
#include "plugin/photo/photo.h"

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace semfoam {

// Makes masks for the photos of COLMAP's image_undistorter from masks of the photos that it was
// given. Both models together tell what it did: it computes the ray of each pixel centre of the
// undistorted camera, and shows there what the original camera has at the projection of that ray.

// A photo that both models have.
struct UndistortedPhoto {
  std::string name;
  Camera original;
  Camera undistorted;
};

// The photos of the model that image_undistorter was given, and of the one that it wrote.
struct UndistortedPhotos {
  // Sorted by name, as are the names of those that only one of the models has.
  std::vector<UndistortedPhoto> photos;
  std::vector<std::string> only_original;
  std::vector<std::string> only_undistorted;

  // Returns the names of the original photos: those of `photos`, then only_original.
  std::vector<std::string> OriginalNames() const;
};

// Pairs the images of two models by name; the folders are those of the models, for messages. Throws
// UserError, one sentence, where they are not before and after image_undistorter: they have no name
// in common, an undistorted camera has distortion, or a photo's rotations differ by more than
// rounding.
UndistortedPhotos PairUndistorted(const Reconstruction& original,
                                  const std::filesystem::path& original_folder,
                                  const Reconstruction& undistorted,
                                  const std::filesystem::path& undistorted_folder);

// Returned by SourcePixel for places outside of the original photo.
inline constexpr int64_t kOutsideOfPhoto = -1;

// Returns the pixel y * width + x of the original photo that holds the place which the centre of
// the undistorted photo's pixel (x, y) shows, or kOutsideOfPhoto. `original_size` is the size of
// the original photo, or of its mask, whatever the resolution. Like COLMAP, follows rays beyond the
// radius where a distortion folds back: the undistorted photo shows the same pixels twice, and so
// does the mask. Places on the border of two pixels, to rounding, belong to the right, the lower
// one.
int64_t SourcePixel(const UndistortedPhoto& photo, const PhotoSize& original_size, int x, int y);

// What became of the masks.
struct MaskUndistortion {
  // Photos that have a mask now.
  int num_masks = 0;
  // Masks that are left out: the photo is not in the undistorted model, or there is none.
  std::vector<std::string> without_photo;
  // The share of the new masks' pixels that show no place of an original photo.
  double share_outside = 0;
  // Whether id 0 is a class of its own (LabelZero::kAuto), to which the pixels outside belong then.
  bool zero_is_class = false;
  // Ids that are others than in the original masks (MaskTable::original_ids).
  int num_renumbered = 0;
};

// Writes the masks of the undistorted photos into `output_path`: 16-bit PNGs of label ids, of the
// size of the undistorted camera and named by NamesForMasks, and labels.json (MaskFolderWriter).
// Each pixel has the id of its SourcePixel, or 0. `mask_folder` has the masks of the original
// photos, of any kind that NumberMasks takes, paired with them by PairMasks and read at the smaller
// one of their own and the original camera's size. Ids are those of MaskClasses::labels: the masks'
// own up to 65535, else numbered from 1. labels.json has the names of `labels_file` (empty: none)
// by these ids, the masks' own ids where they were numbered (MaskTable::original_ids), and says
// that id 0 is unlabelled where it is. One photo for each thread is in memory.
//
// Throws UserError, one sentence naming the file, as PairMasks, LoadMaskedPhotos, ReadLabelNames
// and MaskFolderWriter do, and where the masks have the size of the undistorted photos, another
// aspect than the original ones, or no photo in the undistorted model.
MaskUndistortion UndistortMasks(const UndistortedPhotos& photos,
                                const std::filesystem::path& mask_folder,
                                const std::filesystem::path& labels_file,
                                const std::filesystem::path& output_path);

// Does the same with binary masks of ignored pixels (ReadIgnoredPixels). `files` [OriginalNames()]
// are those of the original photos in `ignore_folder`, empty where there is none. Writes 0 for what
// is excluded or outside of the original photo and 65535 for the rest, whether or not the masks
// were `inverted`, into PNGs named as COLMAP names them: `a/b.jpg.png`.
MaskUndistortion UndistortIgnoredPixels(const UndistortedPhotos& photos,
                                        const std::filesystem::path& ignore_folder,
                                        const std::vector<std::filesystem::path>& files,
                                        bool inverted,
                                        const std::filesystem::path& output_path);

}  // namespace semfoam
