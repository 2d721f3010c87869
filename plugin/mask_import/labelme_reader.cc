// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask_import/labelme_reader.h"

#include "foam/util/base64.h"
#include "foam/util/json_file.h"
#include "plugin/mask/mask_png.h"
#include "plugin/mask_import/json_field.h"
#include "plugin/mask_import/segmentation.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

// A shape, as its kind draws it.
using Draw = std::function<PixelRuns(const PhotoSize& size)>;

PixelRuns FillCircle(const PolygonPoint& centre, double radius, const PhotoSize& size) {
  PixelRuns runs;
  for (int y = 0; y < size.height; ++y) {
    const double dy = y + 0.5 - centre.y;
    if (std::abs(dy) > radius) continue;
    const double half = std::sqrt(radius * radius - dy * dy);
    const double width = size.width;
    const auto begin =
        static_cast<int64_t>(std::clamp(std::ceil(centre.x - half - 0.5), 0., width));
    const auto end = static_cast<int64_t>(std::clamp(std::ceil(centre.x + half - 0.5), 0., width));
    AppendRun(
        {static_cast<int64_t>(y) * size.width + begin, static_cast<int64_t>(y) * size.width + end},
        &runs);
  }
  return runs;
}

// A picture of the shape alone, whose first pixel is at the shape's first point.
Draw ReadMaskShape(const fs::path& file, const JsonField& shape, const Polygon& points) {
  const JsonField field = shape["mask"];
  std::optional<std::string> png = DecodeBase64(field.Text());
  if (!png) field.FailBecause("is no base64, as LabelMe encodes a PNG");
  if (points.size() != 2) shape["points"].Fail("a list of two points, the corners of the mask,");
  const double left = std::floor(points[0].x), top = std::floor(points[0].y);
  if (left < 0 || top < 0 || left > kLargestSide || top > kLargestSide) {
    shape["points"].FailBecause("lies outside of the picture");
  }
  return [file,
          png = std::move(*png),
          x0 = static_cast<int64_t>(left),
          y0 = static_cast<int64_t>(top)](const PhotoSize& size) {
    PixelRuns runs;
    ReadMaskRows(file, png, [&](const MaskHeader& header, int y, std::span<const uint32_t> values) {
      if (x0 + header.size.width > size.width || y0 + header.size.height > size.height) {
        throw UserError(file.string(),
                        ": has a mask that lies partly outside of the picture of ",
                        size.width,
                        " x ",
                        size.height,
                        " pixels; is imageHeight or imageWidth wrong?");
      }
      const int64_t row = (y0 + y) * size.width + x0;
      for (size_t x = 0; x < values.size(); ++x) {
        const auto at = row + static_cast<int64_t>(x);
        if (values[x] != 0) AppendRun({at, at + 1}, &runs);
      }
    });
    return runs;
  };
}

std::string TypeOf(const JsonField& shape) {
  return shape.Has("shape_type") ? shape["shape_type"].Text() : "polygon";
}

// Whether it marks an object, and does not outline it.
bool IsStroke(const std::string& type) {
  return type == "point" || type == "points" || type == "line" || type == "linestrip";
}

Polygon ReadStroke(const JsonField& field, bool is_box) {
  Polygon points = ReadPolygon(field);
  if (points.empty()) field.Fail("a list of at least one point");
  // Later versions write all corners of a rectangle.
  if (is_box && points.size() == 4) points = {points[0], points[2]};
  if (is_box && points.size() != 2) field.Fail("a list of two points, opposite corners,");
  return points;
}

// Returns nothing for shapes without an area.
Draw ReadShape(const fs::path& file, const JsonField& shape) {
  const std::string type = TypeOf(shape);
  Polygon points = ReadPolygon(shape["points"]);
  if (type == "mask") return ReadMaskShape(file, shape, points);
  if (type == "circle") {
    if (points.size() != 2) shape["points"].Fail("a list of two points, the centre and one on it,");
    const double radius = std::hypot(points[1].x - points[0].x, points[1].y - points[0].y);
    return [points, radius](const PhotoSize& size) { return FillCircle(points[0], radius, size); };
  }
  if (type == "rectangle" && points.size() == 2) {
    points = {points[0], {points[1].x, points[0].y}, points[1], {points[0].x, points[1].y}};
  } else if (type != "polygon" && type != "rectangle" && type != "rotation" &&
             type != "oriented_rectangle") {
    return nullptr;
  }
  if (points.size() < 3) return nullptr;
  return [points](const PhotoSize& size) { return FillPolygons({points}, size); };
}

// Reads the shapes of one photo, which is called `file_name` where it does not say.
PictureContents ReadPhoto(const fs::path& file,
                          const JsonField& root,
                          const std::string& file_name) {
  PictureContents contents;
  contents.name = root.Has("imagePath") ? root["imagePath"].Text() : file_name;
  contents.size.width = static_cast<int>(root["imageWidth"].Integer(1, kLargestSide));
  contents.size.height = static_cast<int>(root["imageHeight"].Integer(1, kLargestSide));
  const auto draws = std::make_shared<std::vector<std::vector<Draw>>>();
  std::map<std::pair<std::string, std::optional<int64_t>>, size_t> region_of_group;
  const JsonField shapes = root["shapes"];
  bool has_strokes = false;
  for (size_t i = 0; i < shapes.Size(); ++i) has_strokes |= IsStroke(TypeOf(shapes[i]));
  for (size_t i = 0; i < shapes.Size(); ++i) {
    const JsonField shape = shapes[i];
    const std::string label = shape["label"].Text();
    if (label.empty()) shape["label"].Fail("a name");
    const std::string type = TypeOf(shape);
    const bool is_box = has_strokes && type == "rectangle";
    const bool is_stroke = IsStroke(type) || is_box;
    Draw draw = is_stroke ? nullptr : ReadShape(file, shape);
    if (draw == nullptr && !is_stroke) {
      ++contents.left_out["shape without an area"];
      continue;
    }
    size_t region = draws->size();
    if (shape.Has("group_id") || has_strokes) {
      // Strokes of one name are of one object.
      constexpr auto kMost = std::numeric_limits<int64_t>::max();
      const std::optional<int64_t> group =
          shape.Has("group_id") ? std::optional(shape["group_id"].Integer(-kMost, kMost))
                                : std::nullopt;
      region = region_of_group.emplace(std::pair(label, group), region).first->second;
    }
    if (region == draws->size()) {
      draws->emplace_back();
      contents.regions.push_back({label, -1});
    }
    if (is_stroke) {
      contents.strokes.push_back({region, ReadStroke(shape["points"], is_box), is_box});
    } else {
      (*draws)[region].push_back(std::move(draw));
    }
  }
  contents.draw = [draws](const PhotoSize& size) {
    std::vector<PixelRuns> runs;
    for (const std::vector<Draw>& of_region : *draws) {
      PixelRuns all;
      for (const Draw& draw : of_region) {
        const PixelRuns part = draw(size);
        all.insert(all.end(), part.begin(), part.end());
      }
      runs.push_back(UnionOf(std::move(all)));
    }
    return runs;
  };
  return contents;
}

}  // namespace

std::vector<PictureContents> ReadLabelMe(const fs::path& file) {
  const nlohmann::json json = ReadJsonFile(file);
  const JsonField root(file, json);
  std::vector<PictureContents> photos;
  if (root.IsList()) {
    for (size_t i = 0; i < root.Size(); ++i) {
      if (!root[i].IsObject() || !root[i].Has("shapes")) {
        root[i].Fail("an object with the \"shapes\" of a photo");
      }
      root[i]["imagePath"].Text();  // The file's name is that of no photo.
      photos.push_back(ReadPhoto(file, root[i], ""));
    }
  } else if (root.Has("shapes")) {
    photos.push_back(ReadPhoto(file, root, file.stem().string()));
  }
  return photos;
}

}  // namespace semfoam
