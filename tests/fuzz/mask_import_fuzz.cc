// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask_import/coco_reader.h"
#include "plugin/mask_import/label_studio_reader.h"
#include "plugin/mask_import/labelme_reader.h"
#include "plugin/mask_import/npy_reader.h"
#include "plugin/mask_import/region_list_reader.h"
#include "plugin/mask_import/run_lengths.h"
#include "plugin/mask_import/yolo_reader.h"

#include <filesystem>
#include <functional>
#include <optional>
#include <vector>

#include "tests/fuzz/fuzz_input.h"

// Masks of other programs. The first byte of an input says what the rest is.
namespace semfoam {

// Deflate, in .npz, packs 1032 to 1.
const double kLargestBlockPerByte = 1100;

namespace {

// Larger pictures are read, but not drawn.
constexpr int64_t kMostPixels = 1 << 16;
constexpr PhotoSize kPhoto = {12, 9};

void RequireInside(const PixelRuns& runs, const PhotoSize& size) {
  int64_t last = -1;
  for (const PixelRun& run : runs) {
    Require(run.begin > last && run.end > run.begin, "runs are ascending and apart");
    last = run.end;
  }
  Require(last <= static_cast<int64_t>(size.width) * size.height, "runs are in the picture");
}

void Draw(const PhotoSize& its_size,
          size_t num_regions,
          const std::function<std::vector<PixelRuns>(const PhotoSize&)>& draw) {
  const PhotoSize size = its_size == PhotoSize{} ? kPhoto : its_size;
  if (num_regions == 0 || static_cast<int64_t>(size.width) * size.height > kMostPixels) return;
  const std::vector<PixelRuns> regions = draw(size);
  Require(regions.size() == num_regions, "each region is drawn");
  for (const PixelRuns& runs : regions) RequireInside(runs, size);
}

void Draw(const ImportedMasks& masks) {
  for (const ImportedPicture& picture : masks.pictures) {
    for (const ImportedRegion& region : picture.regions) {
      Require(region.name < static_cast<int32_t>(masks.names.size()), "a region's name is there");
    }
    Draw(picture.size, picture.regions.size(), picture.draw);
  }
}

void Draw(const std::optional<PictureContents>& contents) {
  if (!contents) return;
  for (const Stroke& stroke : contents->strokes) {
    Require(stroke.region < contents->regions.size(), "a stroke's region is there");
    Require(stroke.is_box ? stroke.points.size() == 2 : !stroke.points.empty(), "it has points");
  }
  Draw(contents->size, contents->regions.size(), contents->draw);
}

// Run lengths that are refused, or come back.
void ReadRunLengths(std::string_view text) {
  const RunLengths decoded = DecodeRunLengths(text);
  Require(decoded.error.empty() || decoded.lengths.empty(), "there are lengths or an error");
  if (!decoded.error.empty()) return;
  Require(DecodeRunLengths(EncodeRunLengths(decoded.lengths)).lengths == decoded.lengths,
          "lengths come back");
  const std::optional<PixelRuns> runs = RunsOfLengths(decoded.lengths, kPhoto);
  if (!runs) return;
  RequireInside(*runs, kPhoto);
  Require(RunsOfLengths(LengthsOfRuns(*runs, kPhoto), kPhoto) == runs, "runs come back");
}

void Read(char kind, std::string_view input, const MemoryFile& file) {
  const std::vector<std::filesystem::path> files = {file.path()};
  switch (kind) {
    case 'r':
      ReadRunLengths(input);
      break;
    case 'b':
      DecodeBrush({input.begin(), input.end()}, 4 * kPhoto.width * kPhoto.height);
      break;
    case 'c':
      Draw(ReadCoco(files));
      break;
    case 'm':
      for (const PictureContents& photo : ReadLabelMe(file.path())) Draw(photo);
      break;
    case 's':
      Draw(ReadRegionList(file.path()));
      break;
    case 't':
      Draw(ReadLabelStudio(files));
      break;
    case 'y':
      Draw(ReadYolo(file.path().parent_path(), files));
      break;
    case 'n':
      Draw(ReadNpyMask(file.path()));
      break;
    default:
      break;
  }
}

}  // namespace
}  // namespace semfoam

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static const semfoam::MemoryFile file;
  if (size == 0) return 0;
  const std::string_view input(reinterpret_cast<const char*>(data) + 1, size - 1);
  file.Set(input);
  semfoam::ReadsOrRefuses(file.path(),
                          [&] { semfoam::Read(static_cast<char>(data[0]), input, file); });
  return 0;
}
