// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask_import/label_studio_reader.h"

#include "foam/util/json_file.h"
#include "plugin/mask_import/json_field.h"
#include "plugin/mask_import/segmentation.h"
#include "plugin/util/plural.h"

#include <map>
#include <memory>
#include <string>
#include <utility>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

constexpr int kChannels = 4;        // of a brush mask; the last is its opacity
constexpr int kBitsOfLength = 32;   // of the number of values
constexpr int kBitsOfWordSize = 5;  // of the bits of a value, less one
constexpr int kBitsOfRunSize = 4;   // of each of four sizes of run lengths, less one
constexpr double kPercent = 100;

// Reads bits from the most significant of the first byte on.
class BitReader {
 public:
  explicit BitReader(const std::vector<uint8_t>& bytes) : bytes_(bytes) {}

  // Returns nothing where fewer bits are left.
  std::optional<uint32_t> Read(int bits) {
    if (at_ + bits > 8 * bytes_.size()) return std::nullopt;
    uint32_t value = 0;
    for (int i = 0; i < bits; ++i, ++at_) {
      value = value << 1 | (bytes_[at_ / 8] >> (7 - at_ % 8) & 1u);
    }
    return value;
  }

 private:
  const std::vector<uint8_t>& bytes_;
  size_t at_ = 0;
};

// A shape of one result, in percent, or a brush.
struct Shape {
  Polygon percent;
  std::vector<uint8_t> brush;
  std::string place;
};

PixelRuns DrawBrush(const fs::path& file, const Shape& shape, const PhotoSize& size) {
  const int64_t pixels = static_cast<int64_t>(size.width) * size.height;
  const auto values = DecodeBrush(shape.brush, kChannels * pixels);
  if (!values) {
    throw UserError(file.string(),
                    ": ",
                    shape.place,
                    " has a brush mask that does not decode to ",
                    size.width,
                    " x ",
                    size.height,
                    " pixels; is the file complete?");
  }
  PixelRuns runs;
  for (int64_t i = 0; i < pixels; ++i) {
    if ((*values)[kChannels * i + kChannels - 1] != 0) AppendRun({i, i + 1}, &runs);
  }
  return runs;
}

// Reads the tasks of a file, one after another.
class TaskReader {
 public:
  TaskReader(const fs::path& file, ImportedMasks* masks)
      : file_(file), masks_(masks), names_(&masks->names) {}

  void Read(const nlohmann::json& json, size_t index) {
    const JsonField task(file_, json, "task " + std::to_string(index + 1));
    ImportedPicture picture;
    picture.file = file_;
    picture.name = ImageOf(task["data"]);
    auto shapes = std::make_shared<std::vector<Shape>>();
    const JsonField annotations = task["annotations"];
    for (size_t i = 0; i < annotations.Size(); ++i) {
      const JsonField annotation = annotations[i];
      if (annotation.Has("was_cancelled") && annotation["was_cancelled"].value() == true) continue;
      const JsonField results = annotation["result"];
      for (size_t k = 0; k < results.Size(); ++k) ReadResult(results[k], &picture, shapes.get());
      break;
    }
    picture.draw = [file = file_, shapes](const PhotoSize& size) {
      std::vector<PixelRuns> runs;
      for (const Shape& shape : *shapes) {
        if (!shape.brush.empty()) {
          runs.push_back(DrawBrush(file, shape, size));
          continue;
        }
        Polygon polygon = shape.percent;
        for (PolygonPoint& point : polygon) {
          point = {point.x / kPercent * size.width, point.y / kPercent * size.height};
        }
        runs.push_back(FillPolygons({polygon}, size));
      }
      return runs;
    };
    masks_->pictures.push_back(std::move(picture));
  }

  int64_t num_without_area() const { return num_without_area_; }

 private:
  // The only text among the data, or that named image.
  static std::string ImageOf(const JsonField& data) {
    if (data.Has("image")) return data["image"].Text();
    if (!data.IsObject()) data.Fail("an object with the image");
    for (const auto& [key, value] : data.value().items()) {
      if (value.is_string()) return value.get<std::string>();
    }
    data.FailBecause("has no \"image\"");
  }

  void ReadResult(const JsonField& result, ImportedPicture* picture, std::vector<Shape>* shapes) {
    const std::string type = result.Has("type") ? result["type"].Text() : "";
    const bool is_polygon = type == "polygonlabels";
    const bool is_brush = type == "brushlabels";
    if (!is_polygon && !is_brush && type != "rectanglelabels") {
      ++num_without_area_;
      return;
    }
    const PhotoSize size = {static_cast<int>(result["original_width"].Integer(1, kLargestSide)),
                            static_cast<int>(result["original_height"].Integer(1, kLargestSide))};
    if (picture->size == PhotoSize{}) picture->size = size;
    if (picture->size != size) result["original_width"].FailBecause("differs within one image");
    const JsonField value = result["value"];
    const JsonField labels = value[type.c_str()];
    if (labels.Size() == 0) labels.FailBecause("is empty, where a label would be right");
    Shape shape;
    shape.place = "an image's result";
    if (is_brush) {
      const JsonField rle = value["rle"];
      if (rle.Size() == 0) rle.FailBecause("is empty, where the bytes of a brush would be right");
      for (size_t i = 0; i < rle.Size(); ++i) {
        shape.brush.push_back(static_cast<uint8_t>(rle[i].Integer(0, 255)));
      }
    } else if (is_polygon) {
      shape.percent = ReadPolygon(value["points"]);
    } else {
      const double x = value["x"].Number(), y = value["y"].Number();
      const double right = x + value["width"].Number(), bottom = y + value["height"].Number();
      shape.percent = {{x, y}, {right, y}, {right, bottom}, {x, bottom}};
    }
    picture->regions.push_back({names_.IndexOf(labels[size_t{0}].Text()), -1});
    shapes->push_back(std::move(shape));
  }

  const fs::path file_;
  ImportedMasks* const masks_;
  NameTable names_;
  int64_t num_without_area_ = 0;
};

}  // namespace

std::optional<std::vector<uint8_t>> DecodeBrush(const std::vector<uint8_t>& bytes, int64_t count) {
  BitReader bits(bytes);
  const auto length = bits.Read(kBitsOfLength);
  const auto word = bits.Read(kBitsOfWordSize);
  if (!length || !word || *length != count || *word + 1 > 8) return std::nullopt;
  uint32_t sizes[4];
  for (uint32_t& size : sizes) {
    const auto read = bits.Read(kBitsOfRunSize);
    if (!read) return std::nullopt;
    size = *read + 1;
  }
  std::vector<uint8_t> values;
  while (static_cast<int64_t>(values.size()) < count) {
    const auto is_run = bits.Read(1);
    const auto which = bits.Read(2);
    if (!is_run || !which) return std::nullopt;
    const auto run = bits.Read(static_cast<int>(sizes[*which]));
    if (!run || static_cast<int64_t>(*run) >= count - static_cast<int64_t>(values.size())) {
      return std::nullopt;
    }
    const uint32_t num_words = *is_run != 0 ? 1 : *run + 1;
    for (uint32_t i = 0; i < num_words; ++i) {
      const auto value = bits.Read(static_cast<int>(*word) + 1);
      if (!value) return std::nullopt;
      values.insert(
          values.end(), *is_run != 0 ? size_t{*run} + 1 : size_t{1}, static_cast<uint8_t>(*value));
    }
  }
  return values;
}

ImportedMasks ReadLabelStudio(const std::vector<fs::path>& files) {
  ImportedMasks masks;
  masks.format = "Label Studio's JSON";
  int64_t without_area = 0;
  for (const fs::path& file : files) {
    TaskReader reader(file, &masks);
    const nlohmann::json json = ReadJsonFile(
        file, "", [&](const nlohmann::json& task, size_t index) { reader.Read(task, index); });
    const JsonField root(file, json);
    if (!root.IsList()) root.Fail("a list of tasks");
    if (root.Size() > 0) root[size_t{0}].Fail("a task, an object,");
    without_area += reader.num_without_area();
  }
  if (without_area > 0)
    masks.left_out.push_back(Plural(without_area, "result") + " without an area");
  return masks;
}

}  // namespace semfoam
