// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/data/training_views.h"
#include "foam/model/model.h"
#include "plugin/mask/mask_folders.h"
#include "plugin/photo/photo.h"

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace semfoam {

// Instance masks: one PNG per photo whose pixels hold the id of an object, such as DEVA writes.

// The file of the labels' names: `labels_path` where it is given (throws UserError when there is no
// such file), else labels.json beside `mask_folder`; empty where there is none.
std::filesystem::path FindLabelsFile(const std::filesystem::path& labels_path,
                                     const std::filesystem::path& mask_folder);

// DEVA's pred.json in the mask folder or beside it; empty where there is none.
std::filesystem::path FindPredictions(const std::filesystem::path& mask_folder);

// Which mask belongs to which photo, found by name and never by order.
struct MaskPairing {
  std::vector<std::filesystem::path> masks;   // one per photo; empty = this photo has none
  std::vector<std::filesystem::path> unused;  // masks of no photo given, sorted

  int NumPaired() const;
};

// Throws UserError, the sentence NoMaskIn, unless a photo has a mask.
void RequireMasks(const MaskPairing& pairing, const std::filesystem::path& mask_folder);

// Pairs the PNGs below `mask_folder` (sub-folders included, hidden files not) with the photos. The
// mask of `a/b.c.jpg` is the first there is of `a/b.c.jpg.png` (COLMAP's way), `a/b.c.png`,
// `a/b.png`, and the name less its last four characters (DEVA's way: `x.jpeg` has `x..png`).
// Throws UserError when two photos would share a mask, or when there are masks and none has a
// photo.
MaskPairing PairMasks(const std::filesystem::path& mask_folder,
                      const std::vector<std::string>& photo_names);

// What to call the masks of these photos, relative to their folder, so that PairMasks gives each
// its own: `a/b.png` is that of `a/b.jpg`. Where a photo would then have another one's, as of
// `a/b.jpg` and `a/b.png`, all are called as COLMAP calls them, `a/b.jpg.png`. The photos' names
// differ.
std::vector<std::string> NamesForMasks(const std::vector<std::string>& photo_names);

// The class of every pixel of a photo, row-major, in as few bytes as the number of classes allows.
class ClassImage {
 public:
  // An image without pixels: of a photo without a mask.
  ClassImage() = default;
  // All kUnlabelled.
  ClassImage(PhotoSize size, int num_classes) : ClassImage(NumPixelsOf(size), num_classes) {}
  ClassImage(size_t num_pixels, int num_classes);

  bool Empty() const { return NumPixels() == 0; }
  size_t NumPixels() const { return narrow_.empty() ? wide_.size() : narrow_.size(); }

  // The class at y * width + x, or kUnlabelled.
  int32_t operator[](size_t pixel) const {
    if (!narrow_.empty()) return narrow_[pixel] == kNarrowNone ? kUnlabelled : narrow_[pixel];
    return wide_[pixel] == kWideNone ? kUnlabelled : wide_[pixel];
  }
  void Set(size_t pixel, int32_t class_index);

  // Makes room for more classes than the image was made for; pixels keep theirs.
  void Widen(int num_classes);

  // Bytes for each pixel with this many classes.
  static int BytesPerPixel(int num_classes) { return num_classes <= kNarrowNone ? 1 : 2; }

 private:
  static size_t NumPixelsOf(PhotoSize size) {
    return static_cast<size_t>(size.width) * static_cast<size_t>(size.height);
  }

  static constexpr uint8_t kNarrowNone = 0xff;
  static constexpr uint16_t kWideNone = 0xffff;
  std::vector<uint8_t> narrow_;
  std::vector<uint16_t> wide_;
};

// What id 0 of the masks is. Trackers write 0 where they follow nothing. Where that is the odd gap,
// it says nothing of the pixel (kIgnore). Where few things were masked and the rest is 0, it says
// that the pixel is none of them, and without it everything would be learned as one of them
// (kClass). kAuto: a class where at least a fifth of the masks' pixels are 0.
enum class LabelZero { kIgnore, kClass, kAuto };

// What has to be known of each mask before any of them has classes.
struct MaskContents {
  bool is_rgb = false;
  std::vector<uint32_t> ids;  // every value that occurs, in order of first occurrence
  int64_t num_zero = 0;       // pixels of id 0, at the mask's size
  PhotoSize size;             // of the file; 0 x 0: there is no mask
};

// A mask by itself: its contents, and which of its ids each pixel of its photo has, read at the
// nearest pixel centre. One byte a pixel of the photo up to 255 ids, else two, whatever the size of
// the mask.
struct DecodedMask {
  MaskContents contents;
  ClassImage indices;  // at the photo's size, into contents.ids; never kUnlabelled
};

// Takes, beside the result, the memory that MaskHeader::decoding_bytes tells. Throws UserError, one
// sentence naming the file: a mask that is damaged or no PNG; one whose aspect is not the photo's
// (to a pixel); one with more than 65535 ids; interlaced rows that there is not the memory for.
DecodedMask DecodeMask(const std::filesystem::path& path, const PhotoSize& photo_size);

// The classes of a DecodedMask's indices; `classes` [ids of the mask] are less than `num_classes`,
// or kUnlabelled.
ClassImage ClassesOf(const ClassImage& indices,
                     const std::vector<int32_t>& classes,
                     int num_classes);

// DecodeMask for a mask that was looked at before, when it had these contents. Also throws
// UserError where its ids are others now: what is known of them would be wrong.
DecodedMask DecodeMaskAgain(const std::filesystem::path& path,
                            const PhotoSize& photo_size,
                            const MaskContents& contents);

// A sentence for the user about masks that seem to be of the photos before they were undistorted:
// larger or smaller than their photos by less than a tenth, as undistorting changes a photo and
// nobody reduces a mask. Read at the nearest pixel centre, they would lie beside what they show.
// Empty where there is none of them. `mask_sizes` [pairing.masks], of which those without a mask
// are not looked at, and `photo_sizes` are those of the files.
std::string MaskSizeWarning(const MaskPairing& pairing,
                            const std::vector<PhotoSize>& mask_sizes,
                            const std::vector<PhotoSize>& photo_sizes);

// The classes of a set of masks.
struct MaskClasses {
  std::vector<Label> labels;     // one per class, ascending by source id
  bool colors_are_grey = false;  // masks of colours are grey masks saved as RGB
  std::map<uint32_t, int32_t> class_of_id;

  // For ClassesOf: of each id of a mask.
  std::vector<int32_t> Of(const MaskContents& mask) const;
};

// Numbers the ids of all masks as classes; `contents` [pairing.masks] are of each.
//
// A pixel's id is: the value of a grey mask (1 to 16 bits); the index, never the colour, of a
// palette mask; R + 256 G + 65536 B of a colour mask (DEVA's long ids), unless no mask of the set
// has a pixel that is not grey: then they are grey masks saved as RGB. Alpha is ignored. Id 0 is no
// object: it becomes kUnlabelled, or a class of its own (`label_zero`).
//
// Label::id is the mask's id where all ids of the set are at most 65535; else they are numbered
// from 1 in ascending order, and Label::source_id keeps the mask's.
//
// Throws UserError, one sentence naming the file: long ids that DEVA's pred.json, in the mask
// folder or beside it, does not have (a resampled mask); more than 65535 classes.
MaskClasses NumberMasks(const std::vector<MaskContents>& contents,
                        const MaskPairing& pairing,
                        const std::filesystem::path& mask_folder,
                        LabelZero label_zero);

// Names the labels from a labels.json: a name is for the label whose Label::source_id, the masks'
// own id, is the name's by the table (LabelName). Where several names are (a foam that had an
// object inserted has two labels of one source id), the one whose id is Label::id. Throws what
// ReadLabelNames throws.
void NameLabels(const std::filesystem::path& labels_file, std::vector<Label>* labels);

// A sentence for the user about the file's names whose ids none of `labels` has, which name
// nothing. Empty where there is none. A name of id 0, which need not be a class, is none of them.
std::string UnusedNamesWarning(const std::filesystem::path& labels_file,
                               const std::vector<Label>& labels);

}  // namespace semfoam
