// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask_import/cvat_reader.h"

#include "foam/util/error.h"
#include "foam/util/input_file.h"
#include "plugin/mask/mask_folders.h"
#include "plugin/mask/mask_png.h"

#include <algorithm>
#include <charconv>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

constexpr uint32_t kBlack = 0;
// The border between objects in Pascal VOC, which is of none of them.
constexpr uint32_t kVoid = 224 + 256 * 224 + 65536 * 192;

// The names of colours, R + 256 G + 65536 B; empty for those that are no object.
using LabelMap = std::map<uint32_t, std::string>;

// Reads lines "name:r,g,b:parts:actions".
LabelMap ReadLabelMap(const fs::path& file) {
  const std::string text = ReadFileBytes(file, "CVAT's label map");
  LabelMap labels;
  size_t line = 0;
  for (size_t begin = 0; begin < text.size();) {
    ++line;
    const size_t end = std::min(text.find('\n', begin), text.size());
    std::string_view row = std::string_view(text).substr(begin, end - begin);
    begin = end + 1;
    if (row.ends_with('\r')) row.remove_suffix(1);
    if (row.empty() || row[0] == '#') continue;
    const auto fail = [&] {
      throw UserError(file.string(),
                      ": line ",
                      line,
                      " is ",
                      Shortened(row),
                      ", where a name with a colour of its own, mug:250,50,83::, would be right.");
    };
    const size_t colon = row.find(':');
    if (colon == std::string_view::npos || colon == 0) fail();
    std::string name(row.substr(0, colon));
    std::string_view colors = row.substr(colon + 1);
    colors = colors.substr(0, colors.find(':'));
    uint32_t color = 0;
    for (int shift = 0; shift < 24; shift += 8) {
      uint8_t channel = 0;
      const size_t comma = shift < 16 ? colors.find(',') : colors.size();
      if (comma == std::string_view::npos) fail();
      const auto [last, error] = std::from_chars(colors.data(), colors.data() + comma, channel);
      if (error != std::errc() || last != colors.data() + comma) fail();
      color |= static_cast<uint32_t>(channel) << shift;
      colors.remove_prefix(std::min(comma + 1, colors.size()));
    }
    if (color == kBlack || color == kVoid || name == "background") name.clear();
    if (!labels.emplace(color, std::move(name)).second) fail();
  }
  labels.emplace(kBlack, "");
  labels.emplace(kVoid, "");
  return labels;
}

// The colour that a stored value stands for; grey values are colours of equal channels.
uint32_t ColorOf(const MaskHeader& header, uint32_t value) {
  if (header.is_rgb) return value;
  if (header.is_palette) return value < header.palette.size() ? header.palette[value] : kBlack;
  return value * 0x010101u;
}

std::string ColorText(uint32_t color) {
  return std::to_string(color & 0xff) + "," + std::to_string(color >> 8 & 0xff) + "," +
         std::to_string(color >> 16 & 0xff);
}

// The colours of a picture, whole.
struct Colors {
  PhotoSize size;
  std::vector<uint32_t> data;
};

Colors ReadColors(const fs::path& file) {
  Colors colors;
  ReadMaskRows(file, [&](const MaskHeader& header, int y, std::span<const uint32_t> values) {
    if (y == 0) {
      colors.size = header.size;
      const size_t pixels = static_cast<size_t>(header.size.width) * header.size.height;
      RequireDecodingMemory(file, header.size, sizeof(uint32_t) * pixels);
      colors.data.reserve(pixels);
    }
    for (const uint32_t value : values) colors.data.push_back(ColorOf(header, value));
  });
  return colors;
}

// Reads a picture's classes and, unless `object_file` is empty, the objects that they are of.
std::optional<PictureContents> ReadPicture(const fs::path& name,
                                           const fs::path& class_file,
                                           const fs::path& object_file,
                                           const LabelMap& labels) {
  const Colors classes = ReadColors(class_file);
  const Colors objects = object_file.empty() ? classes : ReadColors(object_file);
  if (objects.size != classes.size) {
    throw UserError(object_file.string(),
                    ": has another size than ",
                    class_file.string(),
                    ", where the same would be right.");
  }
  // Pixels of each object by class.
  std::map<uint32_t, std::map<uint32_t, int64_t>> counts;
  for (size_t i = 0; i < classes.data.size(); ++i) ++counts[objects.data[i]][classes.data[i]];
  PictureContents contents;
  contents.name = name.generic_string();
  contents.size = classes.size;
  const auto colors = std::make_shared<std::vector<uint32_t>>();
  for (const auto& [object, of_classes] : counts) {
    for (const auto& [color, unused] : of_classes) {
      if (labels.contains(color)) continue;
      throw UserError(class_file.string(),
                      ": has the colour ",
                      ColorText(color),
                      ", which labelmap.txt does not name; is it of another export?");
    }
    if (object == kBlack || object == kVoid) continue;
    const auto most =
        std::max_element(of_classes.begin(), of_classes.end(), [](const auto& a, const auto& b) {
          return a.second < b.second;
        });
    const std::string& label = labels.at(most->first);
    if (label.empty()) {
      if (!object_file.empty()) ++contents.left_out["object without a class"];
      continue;
    }
    contents.regions.push_back({label, -1});
    colors->push_back(object);
  }
  const auto pixels = std::make_shared<Colors>(objects);
  contents.draw = [pixels, colors](const PhotoSize& size) {
    std::map<uint32_t, PixelRuns> by_color = RunsByValue([&](const RowReceiver& on_row) {
      for (int y = 0; y < size.height; ++y) {
        on_row(y,
               std::span<const uint32_t>(pixels->data)
                   .subspan(static_cast<size_t>(y) * size.width, size.width));
      }
    });
    std::vector<PixelRuns> runs;
    for (const uint32_t color : *colors) runs.push_back(std::move(by_color[color]));
    return runs;
  };
  return contents;
}

}  // namespace

ImportedMasks ReadCvat(const fs::path& folder) {
  const fs::path class_folder = folder / "SegmentationClass";
  const fs::path object_folder = folder / "SegmentationObject";
  const fs::path label_map = folder / "labelmap.txt";
  if (!fs::is_directory(class_folder)) {
    throw UserError(class_folder.string(),
                    ": there is no such folder beside SegmentationObject/; CVAT's whole export "
                    "would be right.");
  }
  const LabelMap labels = ReadLabelMap(label_map);
  std::vector<fs::path> files;
  for (const auto& [name, file] : ListMasks(class_folder)) {
    if (fs::is_directory(object_folder) && !fs::is_regular_file(object_folder / name)) {
      throw UserError((object_folder / name).string(),
                      ": there is no such file, though there is one of this name in "
                      "SegmentationClass/; CVAT's whole export would be right.");
    }
    files.push_back(file);
  }
  const bool has_objects = fs::is_directory(object_folder);
  ImportedMasks masks = ReadPictures(
      "CVAT's segmentation masks",
      files,
      [labels, class_folder, object_folder, has_objects](const fs::path& file) {
        const fs::path name = file.lexically_relative(class_folder);
        return ReadPicture(name, file, has_objects ? object_folder / name : fs::path(), labels);
      });
  return masks;
}

}  // namespace semfoam
