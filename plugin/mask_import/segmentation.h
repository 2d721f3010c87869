// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/mask_import/json_field.h"
#include "plugin/mask_import/pixel_runs.h"

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace semfoam {

// A region as COCO's "segmentation" gives it, in about as much memory as its text.
struct Segmentation {
  // Empty where there are run lengths.
  std::vector<Polygon> polygons;
  // Compressed run lengths; those of a raw list are kept as numbers.
  std::string compressed;
  std::vector<int64_t> lengths;
  // Of the run lengths; 0 x 0 with polygons.
  PhotoSize size;
  // Place in its file, for messages.
  std::string place;

  bool IsEmpty() const { return polygons.empty() && size == PhotoSize{}; }

  // Returns the pixels in a mask of this size. Throws UserError naming `file` and the place where
  // run lengths are damaged or of a picture of another size.
  PixelRuns Draw(const std::filesystem::path& file, const PhotoSize& size) const;
};

// Reads the value of "segmentation": a list of polygons [x, y, x, y, ...], or {"size": [height,
// width], "counts": text or list}. An empty list, and polygons of fewer than three points, are no
// region. Throws UserError where it has another form.
Segmentation ReadSegmentation(const JsonField& field, const std::string& place);

// Reads a list of coordinates x, y, x, y, ... as a polygon.
Polygon ReadFlatPolygon(const JsonField& field);

// Reads a list of points [x, y] as a polygon.
Polygon ReadPolygon(const JsonField& field);

}  // namespace semfoam
