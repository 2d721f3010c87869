// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask/label_png.h"

#include "foam/util/error.h"
#include "foam/util/output_file.h"

#include <csetjmp>
#include <cstdint>
#include <string>
#include <vector>

#include <glog/logging.h>
#include <png.h>

namespace semfoam {
namespace {

// Areas of one id pack well at any level, and the lowest ones are fastest.
constexpr int kCompressionLevel = 3;

// All objects with destructors live here, as libpng leaves an error by longjmp.
struct Encoder {
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png == nullptr ? nullptr : png_create_info_struct(png);
  std::string bytes;
  std::vector<png_byte> row;
  // Empty: 16-bit grey.
  std::vector<png_color> palette;

  ~Encoder() { png_destroy_write_struct(&png, &info); }
};

void Append(png_structp png, png_bytep bytes, size_t count) {
  static_cast<std::string*>(png_get_io_ptr(png))
      ->append(reinterpret_cast<const char*>(bytes), count);
}

bool Encode(const LabelImage& labels, Encoder& e) {
  if (e.info == nullptr || setjmp(png_jmpbuf(e.png))) return false;
  png_set_write_fn(e.png, &e.bytes, Append, nullptr);
  png_set_IHDR(e.png,
               e.info,
               static_cast<png_uint_32>(labels.width),
               static_cast<png_uint_32>(labels.height),
               e.palette.empty() ? 16 : 8,
               e.palette.empty() ? PNG_COLOR_TYPE_GRAY : PNG_COLOR_TYPE_PALETTE,
               PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT,
               PNG_FILTER_TYPE_DEFAULT);
  if (!e.palette.empty()) {
    png_set_PLTE(e.png, e.info, e.palette.data(), static_cast<int>(e.palette.size()));
  }
  png_text text = {};
  text.compression = PNG_TEXT_COMPRESSION_NONE;
  text.key = const_cast<char*>("Software");
  text.text = const_cast<char*>(kImageSoftware);
  png_set_text(e.png, e.info, &text, 1);
  png_set_compression_level(e.png, kCompressionLevel);
  png_set_filter(e.png, PNG_FILTER_TYPE_DEFAULT, PNG_FILTER_UP);
  png_write_info(e.png, e.info);
  for (int y = 0; y < labels.height; ++y) {
    const int32_t* ids = labels.data.data() + static_cast<size_t>(y) * labels.width;
    png_byte* byte = e.row.data();
    for (int x = 0; x < labels.width; ++x) {
      if (e.palette.empty()) *byte++ = static_cast<png_byte>(ids[x] >> 8);
      *byte++ = static_cast<png_byte>(ids[x] & 0xff);
    }
    png_write_row(e.png, e.row.data());
  }
  png_write_end(e.png, e.info);
  return true;
}

void Write(const std::filesystem::path& path, const LabelImage& labels, Encoder* encoder) {
  CHECK(labels.width > 0 && labels.height > 0);
  CHECK_EQ(labels.data.size(), static_cast<size_t>(labels.width) * labels.height);
  encoder->row.resize(2 * static_cast<size_t>(labels.width));
  if (!Encode(labels, *encoder)) {
    throw UserError(path.string(), ": this image cannot be written; is it too large?");
  }
  WriteTextFile(path, encoder->bytes);
}

}  // namespace

void WriteLabelPng(const std::filesystem::path& path, const LabelImage& labels) {
  for (const int32_t id : labels.data) CHECK(id >= 0 && id <= 65535) << id;
  Encoder encoder;
  Write(path, labels, &encoder);
}

void WritePalettePng(const std::filesystem::path& path,
                     const LabelImage& labels,
                     const std::vector<std::array<uint8_t, 3>>& colors) {
  CHECK(!colors.empty() && colors.size() <= 256) << colors.size();
  const auto num_colors = static_cast<int32_t>(colors.size());
  for (const int32_t id : labels.data) CHECK(id >= 0 && id < num_colors) << id;
  Encoder encoder;
  for (const auto& [red, green, blue] : colors) encoder.palette.push_back({red, green, blue});
  Write(path, labels, &encoder);
}

}  // namespace semfoam
