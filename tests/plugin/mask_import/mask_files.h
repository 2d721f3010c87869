// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/image/image.h"
#include "plugin/mask_import/pixel_runs.h"
#include "plugin/mask_import/run_lengths.h"

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "tests/plugin/test_util.h"
#include <nlohmann/json.hpp>
#include <zlib.h>

// Exact masks of a small scene, and the same as the files of other programs.
namespace semfoam {

// Photos of 24 x 18 pixels with three objects each: a mug, which a ball partly covers, and a plant
// of two parts, with a hole.
struct ExactScene {
  std::vector<std::string> photos = {"cam/0001.png", "cam/0002.png", "cam/0003.png"};
  std::map<int, std::string> names = {{1, "mug"}, {2, "ball"}, {3, "plant"}};
  // [photos]
  std::vector<LabelImage> masks;

  static constexpr PhotoSize kSize = {24, 18};

  ExactScene() {
    for (int i = 0; i < 3; ++i) {
      LabelImage mask{kSize.width, kSize.height, std::vector<int32_t>(24 * 18)};
      const auto paint = [&](int x0, int y0, int x1, int y1, int id) {
        for (int y = y0; y < y1; ++y) {
          for (int x = x0; x < x1; ++x) mask.data[y * kSize.width + x] = id;
        }
      };
      paint(1 + i, 2, 11 + i, 12, 1);
      paint(8 + i, 8, 12 + i, 13, 2);
      paint(16, 1 + i, 23, 9, 3);
      paint(18, 4, 20, 6, 0);  // the hole
      paint(15, 12, 17 + i, 17, 3);
      masks.push_back(std::move(mask));
    }
  }

  // The photos themselves.
  void WritePhotos(const std::filesystem::path& folder) const {
    const std::vector<uint8_t> rgb(size_t{3} * kSize.width * kSize.height, 99);
    for (const std::string& photo : photos) {
      WritePng(folder / photo, kSize.width, kSize.height, 8, PNG_COLOR_TYPE_RGB, rgb);
    }
  }

  // "cam/0001" of a photo, and "0001".
  std::string PathOf(size_t photo) const {
    const std::filesystem::path name = photos[photo];
    return (name.parent_path() / name.stem()).generic_string();
  }
  std::string StemOf(size_t photo) const {
    return std::filesystem::path(photos[photo]).stem().string();
  }
};

inline PixelRuns RunsOf(const LabelImage& mask, int id) {
  PixelRuns runs;
  for (size_t i = 0; i < mask.data.size(); ++i) {
    const auto at = static_cast<int64_t>(i);
    if (mask.data[i] == id) AppendRun({at, at + 1}, &runs);
  }
  return runs;
}

// A rectangle around each run: polygons without holes that cover exactly the pixels.
inline std::vector<Polygon> RectanglesOf(const PixelRuns& runs) {
  std::vector<Polygon> polygons;
  for (const PixelRun& run : runs) {
    const int width = ExactScene::kSize.width;
    for (int64_t begin = run.begin; begin < run.end;) {
      const int64_t y = begin / width;
      const int64_t end = std::min(run.end, (y + 1) * width);
      const auto x0 = static_cast<double>(begin % width),
                 x1 = x0 + static_cast<double>(end - begin);
      const auto top = static_cast<double>(y);
      polygons.push_back({{x0, top}, {x1, top}, {x1, top + 1}, {x0, top + 1}});
      begin = end;
    }
  }
  return polygons;
}

// One polygon that covers exactly the pixels: rectangles one after another, and back to the first
// corner of each, so that the way there and back encloses nothing (the even-odd rule).
inline Polygon OutlineOf(const PixelRuns& runs) {
  Polygon outline, back;
  for (const Polygon& rectangle : RectanglesOf(runs)) {
    outline.insert(outline.end(), rectangle.begin(), rectangle.end());
    outline.push_back(rectangle[0]);
    back.push_back(rectangle[0]);
  }
  outline.insert(outline.end(), back.rbegin(), back.rend());
  return outline;
}

inline nlohmann::json Flat(const Polygon& polygon) {
  nlohmann::json flat = nlohmann::json::array();
  for (const PolygonPoint& point : polygon) {
    flat.push_back(point.x);
    flat.push_back(point.y);
  }
  return flat;
}

inline nlohmann::json Points(const Polygon& polygon, double scale_x = 1, double scale_y = 1) {
  nlohmann::json points = nlohmann::json::array();
  for (const PolygonPoint& point : polygon)
    points.push_back({point.x * scale_x, point.y * scale_y});
  return points;
}

enum class Shape { kPolygons, kRawRuns, kCompressedRuns };

inline nlohmann::json SegmentationOf(const PixelRuns& runs, Shape shape) {
  if (shape == Shape::kPolygons) {
    nlohmann::json polygons = nlohmann::json::array();
    for (const Polygon& polygon : RectanglesOf(runs)) polygons.push_back(Flat(polygon));
    return polygons;
  }
  const std::vector<int64_t> lengths = LengthsOfRuns(runs, ExactScene::kSize);
  nlohmann::json segmentation;
  segmentation["size"] = {ExactScene::kSize.height, ExactScene::kSize.width};
  if (shape == Shape::kRawRuns) {
    segmentation["counts"] = lengths;
  } else {
    segmentation["counts"] = EncodeRunLengths(lengths);
  }
  return segmentation;
}

// COCO annotations whose files are named by `file_name`, such as Roboflow's.
template <typename FileName>
nlohmann::json CocoOf(const ExactScene& scene, Shape shape, const FileName& file_name) {
  nlohmann::json coco;
  for (const auto& [id, name] : scene.names) {
    coco["categories"].push_back({{"id", id}, {"name", name}, {"supercategory", ""}});
  }
  int next = 1;
  for (size_t i = 0; i < scene.photos.size(); ++i) {
    coco["images"].push_back({{"id", i + 7},
                              {"file_name", file_name(i)},
                              {"width", ExactScene::kSize.width},
                              {"height", ExactScene::kSize.height}});
    for (const auto& [id, name] : scene.names) {
      coco["annotations"].push_back(
          {{"id", next++},
           {"image_id", i + 7},
           {"category_id", id},
           {"iscrowd", 0},
           {"segmentation", SegmentationOf(RunsOf(scene.masks[i], id), shape)}});
    }
  }
  return coco;
}

inline std::string CocoText(const ExactScene& scene, Shape shape) {
  return CocoOf(scene, shape, [&](size_t i) { return scene.photos[i]; }).dump();
}

// Bytes of a .npy with these elements, little-endian, of `bytes` each.
inline std::string NpyOf(const LabelImage& mask, const std::string& descr, bool fortran_order) {
  std::string header =
      "{'descr': '" + descr + "', 'fortran_order': " + (fortran_order ? "True" : "False") +
      ", 'shape': (" + std::to_string(mask.height) + ", " + std::to_string(mask.width) + "), }";
  header.resize((10 + header.size() + 64) / 64 * 64 - 10, ' ');
  header.back() = '\n';
  std::string npy("\x93NUMPY\x01\x00", 8);
  npy += static_cast<char>(header.size() & 0xff);
  npy += static_cast<char>(header.size() >> 8);
  npy += header;
  const int bytes = descr[2] - '0';
  const auto append = [&](int32_t value) {
    std::string element;
    for (int k = 0; k < bytes; ++k) {
      element += k < 4 ? static_cast<char>(value >> (8 * k) & 0xff) : '\0';
    }
    if (descr[0] == '>') std::reverse(element.begin(), element.end());
    npy += element;
  };
  if (fortran_order) {
    for (int x = 0; x < mask.width; ++x) {
      for (int y = 0; y < mask.height; ++y) append(mask.data[y * mask.width + x]);
    }
  } else {
    for (const int32_t value : mask.data) append(value);
  }
  return npy;
}

// A zip archive of one member.
inline std::string ZipOf(const std::string& name, const std::string& bytes, bool deflated) {
  std::string packed = bytes;
  if (deflated) {
    z_stream stream = {};
    deflateInit2(&stream, 6, Z_DEFLATED, -MAX_WBITS, 8, Z_DEFAULT_STRATEGY);
    packed.resize(bytes.size() + 1000);
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
    stream.avail_in = static_cast<uInt>(bytes.size());
    stream.next_out = reinterpret_cast<Bytef*>(packed.data());
    stream.avail_out = static_cast<uInt>(packed.size());
    deflate(&stream, Z_FINISH);
    packed.resize(stream.total_out);
    deflateEnd(&stream);
  }
  const auto number = [](uint64_t value, int size) {
    std::string text;
    for (int i = 0; i < size; ++i) text += static_cast<char>(value >> (8 * i) & 0xff);
    return text;
  };
  const auto checksum =
      crc32(0, reinterpret_cast<const Bytef*>(bytes.data()), static_cast<uInt>(bytes.size()));
  const std::string common = number(20, 2) + number(0, 2) + number(deflated ? 8 : 0, 2) +
                             number(0, 4) + number(checksum, 4) + number(packed.size(), 4) +
                             number(bytes.size(), 4) + number(name.size(), 2) + number(0, 2);
  const std::string local = "PK\x03\x04" + common + name + packed;
  const std::string central =
      "PK\x01\x02" + number(20, 2) + common + number(0, 10) + number(0, 4) + name;
  return local + central + "PK\x05\x06" + number(0, 4) + number(1, 2) + number(1, 2) +
         number(central.size(), 4) + number(local.size(), 4) + number(0, 2);
}

// Samples of an 8-bit mask that is `value` where the mask has the id, else 0.
inline std::vector<uint8_t> BinaryOf(const LabelImage& mask, int id, uint8_t value) {
  std::vector<uint8_t> samples;
  for (const int32_t at : mask.data) samples.push_back(at == id ? value : 0);
  return samples;
}

// A brush mask as Label Studio packs it: words of 8 bits, all of them as they are, in runs of 8
// bits' length.
inline std::vector<uint8_t> BrushOf(const std::vector<uint8_t>& opacity) {
  std::vector<bool> bits;
  const auto append = [&](uint32_t value, int count) {
    for (int i = count - 1; i >= 0; --i) bits.push_back((value >> i & 1) != 0);
  };
  std::vector<uint8_t> values;
  for (const uint8_t value : opacity) values.insert(values.end(), 4, value);
  append(static_cast<uint32_t>(values.size()), 32);
  append(7, 5);
  for (const uint32_t size : {2, 3, 7, 15}) append(size, 4);
  for (size_t i = 0; i < values.size();) {
    size_t same = i;
    while (same < values.size() && values[same] == values[i] && same - i < 256) ++same;
    if (same - i > 1) {
      append(1, 1);
      append(2, 2);
      append(static_cast<uint32_t>(same - i - 1), 8);
      append(values[i], 8);
      i = same;
    } else {
      append(0, 1);
      append(0, 2);
      append(0, 3);
      append(values[i++], 8);
    }
  }
  std::vector<uint8_t> bytes((bits.size() + 7) / 8);
  for (size_t i = 0; i < bits.size(); ++i) {
    if (bits[i]) bytes[i / 8] |= static_cast<uint8_t>(0x80 >> i % 8);
  }
  return bytes;
}

inline std::string Base64(const std::string& bytes) {
  constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (size_t i = 0; i < bytes.size(); i += 3) {
    uint32_t group = 0;
    for (size_t k = 0; k < 3; ++k) {
      group = group << 8 | (i + k < bytes.size() ? static_cast<uint8_t>(bytes[i + k]) : 0u);
    }
    for (size_t k = 0; k < 4; ++k) {
      text += i + k > bytes.size() ? '=' : kDigits[group >> (18 - 6 * k) & 63];
    }
  }
  return text;
}

}  // namespace semfoam
