// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask_import/segmentation.h"

#include "plugin/mask_import/run_lengths.h"
#include "plugin/photo/size_text.h"

#include <optional>
#include <utility>

namespace semfoam {
namespace {

constexpr size_t kLeastPoints = 3;

}  // namespace

Polygon ReadFlatPolygon(const JsonField& field) {
  const size_t count = field.Size();
  if (count % 2 != 0) {
    field.FailBecause("has " + std::to_string(count) +
                      " numbers, where x and y of each point, an even number, would be right");
  }
  Polygon polygon;
  polygon.reserve(count / 2);
  for (size_t i = 0; i < count; i += 2) {
    polygon.push_back({field[i].Number(), field[i + 1].Number()});
  }
  return polygon;
}

Polygon ReadPolygon(const JsonField& field) {
  Polygon polygon;
  const size_t count = field.Size();
  polygon.reserve(count);
  for (size_t i = 0; i < count; ++i) {
    const JsonField point = field[i];
    if (point.Size() != 2) point.Fail("a list of two numbers, x and y,");
    polygon.push_back({point[size_t{0}].Number(), point[size_t{1}].Number()});
  }
  return polygon;
}

Segmentation ReadSegmentation(const JsonField& field, const std::string& place) {
  Segmentation result;
  result.place = place;
  if (field.IsList()) {
    for (size_t i = 0; i < field.Size(); ++i) {
      Polygon polygon = ReadFlatPolygon(field[i]);
      if (polygon.size() >= kLeastPoints) result.polygons.push_back(std::move(polygon));
    }
    return result;
  }
  if (!field.IsObject()) field.Fail("a list of polygons, or run lengths with size and counts,");
  const JsonField size = field["size"];
  if (size.Size() != 2) size.Fail("a list of two numbers, height and width,");
  result.size.height = static_cast<int>(size[size_t{0}].Integer(1, kLargestSide));
  result.size.width = static_cast<int>(size[size_t{1}].Integer(1, kLargestSide));
  const JsonField counts = field["counts"];
  if (counts.IsText()) {
    result.compressed = counts.Text();
    return result;
  }
  if (!counts.IsList()) counts.Fail("a text, or a list of numbers,");
  const int64_t num_pixels = static_cast<int64_t>(result.size.width) * result.size.height;
  result.lengths.reserve(counts.Size());
  for (size_t i = 0; i < counts.Size(); ++i) {
    result.lengths.push_back(counts[i].Integer(0, num_pixels));
  }
  return result;
}

PixelRuns Segmentation::Draw(const std::filesystem::path& file, const PhotoSize& picture) const {
  if (size == PhotoSize{}) return FillPolygons(polygons, picture);
  if (size != picture) {
    throw UserError(file.string(),
                    ": ",
                    place,
                    " has run lengths of ",
                    SizeText(size),
                    " pixels in a picture of ",
                    SizeText(picture),
                    "; the same size would be right.");
  }
  RunLengths decoded;
  if (compressed.empty()) {
    decoded.lengths = lengths;
  } else {
    decoded = DecodeRunLengths(compressed);
    if (!decoded.error.empty()) {
      throw UserError(file.string(),
                      ": ",
                      place,
                      " has damaged run lengths (",
                      decoded.error,
                      "); is the file complete?");
    }
  }
  std::optional<PixelRuns> runs = RunsOfLengths(decoded.lengths, size);
  if (!runs) {
    throw UserError(file.string(),
                    ": ",
                    place,
                    " has run lengths that do not add up to ",
                    SizeText(size),
                    " pixels; is the file complete?");
  }
  return std::move(*runs);
}

}  // namespace semfoam
