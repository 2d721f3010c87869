// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/image/image.h"
#include "plugin/mask_import/pixel_runs.h"
#include "plugin/photo/photo.h"

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace semfoam {

// What a reader of a mask format finds: pictures, and in each of them regions that are drawn when
// they are needed. So one picture's pixels for each thread are in memory, whatever their number.

struct ImportedRegion {
  // Index into ImportedMasks::names; -1 = it has no name.
  int32_t name = -1;
  // Id of the object, the same in all pictures that show it; -1 = the format has none.
  int64_t track = -1;
  // How sure the detector is of the region, >= 0; nothing: the format does not tell.
  std::optional<double> score = std::nullopt;
};

// A mark of a region that tells where an object is, not all of it, from which it is grown in the
// photo (stroke_growing.h).
struct Stroke {
  // Index into the picture's regions.
  size_t region = 0;
  // In pixels of the picture; a point, a line from one to the next, or two corners of a box.
  std::vector<PolygonPoint> points;
  bool is_box = false;
};

struct ImportedPicture {
  // The file that it is read from, for messages.
  std::filesystem::path file;
  // Name of its photo, as the format has it: with or without folders and extension.
  std::string name;
  // Size of the mask in pixels; 0 x 0: any, as coordinates are shares of the picture.
  PhotoSize size;
  std::vector<ImportedRegion> regions;
  // Where there are some, the regions are grown from them and from what `draw` returns, and pixels
  // without a region are unlabelled. Their number is that of marks that a person made.
  std::vector<Stroke> strokes;
  // Returns the pixels of each of `regions` in a mask of this size, which is `size` unless that is
  // 0 x 0. Throws UserError, one sentence naming the file, where they are damaged. Is called in
  // parallel for several pictures.
  std::function<std::vector<PixelRuns>(const PhotoSize& size)> draw;
};

struct ImportedMasks {
  // "COCO annotations", for the user.
  std::string format;
  std::vector<std::string> names;
  // [names] The format's own ids of the names, or empty; they are kept where they fit.
  std::vector<int64_t> name_ids;
  std::vector<ImportedPicture> pictures;
  // What was not taken, and why, one part of a sentence each: "3 annotations without pixels".
  std::vector<std::string> left_out;
};

// Numbers names in the order in which they come.
class NameTable {
 public:
  explicit NameTable(std::vector<std::string>* names);

  // The index of a name, which is added where it is new; -1 for an empty one.
  int32_t IndexOf(const std::string& name);

 private:
  std::vector<std::string>* const names_;
  std::map<std::string, int32_t> indices_;
};

// One picture of a format that has a file, or a folder, for each.
struct PictureContents {
  std::string name;
  PhotoSize size;
  struct Region {
    std::string name;
    int64_t track = -1;
    std::optional<double> score = std::nullopt;
  };
  std::vector<Region> regions;
  std::vector<Stroke> strokes;
  std::function<std::vector<PixelRuns>(const PhotoSize& size)> draw;
  // Counts of what is left out, by what it is: "box" for "3 boxes".
  std::map<std::string, int64_t> left_out;
};

// Reads each of `files`, in parallel, and again when it is drawn, so that only the names of their
// regions stay in memory. `read` returns nothing for a file that is not of the format; it throws
// UserError naming the file for one that is damaged. Those of other forms are counted in left_out.
ImportedMasks ReadPictures(
    const std::string& format,
    const std::vector<std::filesystem::path>& files,
    const std::function<std::optional<PictureContents>(const std::filesystem::path& file)>& read);

// Does the same for a format that may have several pictures in a file. `read` returns none for a
// file that is not of the format.
ImportedMasks ReadPictureLists(
    const std::string& format,
    const std::vector<std::filesystem::path>& files,
    const std::function<std::vector<PictureContents>(const std::filesystem::path& file)>& read);

// Paints regions, largest first, so that what lies on top of a larger region stays visible; of
// equally large ones the last is on top. `ids` [runs] are those of the regions, > 0.
LabelImage PaintRegions(const PhotoSize& size,
                        const std::vector<PixelRuns>& runs,
                        const std::vector<int32_t>& ids);

}  // namespace semfoam
