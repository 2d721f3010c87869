// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask_png.h"

#include "foam/error.h"
#include "foam/input_file.h"
#include "plugin/photo.h"

#include <csetjmp>
#include <cstdio>
#include <cstring>
#include <memory>
#include <string>

#include <png.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

// What libpng is told to do with trouble: keep its words and leave by longjmp. No object with a
// destructor may be made between setjmp and there, so all of them live here.
struct Decoder {
  FILE* file = nullptr;
  png_structp png = nullptr;
  png_infop info = nullptr;
  char message[256] = "";
  uint64_t file_size = 0;
  int channels = 0;
  int bits = 0;
  int color_type = 0;
  bool is_colour_16 = false;
  bool is_implausible = false;
  png_uint_32 width = 0;
  png_uint_32 height = 0;
  std::vector<uint8_t> pixels;
  std::vector<png_bytep> rows;

  ~Decoder() {
    if (png != nullptr) png_destroy_read_struct(&png, info != nullptr ? &info : nullptr, nullptr);
    if (file != nullptr) std::fclose(file);
  }
};

void OnError(png_structp png, png_const_charp message) {
  auto* decoder = static_cast<Decoder*>(png_get_error_ptr(png));
  std::snprintf(decoder->message, sizeof(decoder->message), "%s", message);
  png_longjmp(png, 1);
}

// A warning about the pixels is an error: no pixel may be guessed.
void OnWarning(png_structp png, png_const_charp message) { OnError(png, message); }

bool ReadHeader(Decoder& d) {
  if (setjmp(png_jmpbuf(d.png))) return false;
  // Colour profiles, texts and times say nothing about ids, and their faults do not matter.
  static const png_byte kIgnored[] =
      "iCCP\0sRGB\0gAMA\0cHRM\0iTXt\0tEXt\0zTXt\0tIME\0pHYs\0bKGD\0eXIf\0hIST\0sPLT\0sBIT\0oFFs";
  png_set_keep_unknown_chunks(
      d.png, PNG_HANDLE_CHUNK_NEVER, kIgnored, static_cast<int>(sizeof(kIgnored) / 5));
  png_init_io(d.png, d.file);
  png_read_info(d.png, d.info);
  png_get_IHDR(
      d.png, d.info, &d.width, &d.height, &d.bits, &d.color_type, nullptr, nullptr, nullptr);
  d.channels = png_get_channels(d.png, d.info);
  d.is_colour_16 = d.bits == 16 && (d.color_type & PNG_COLOR_MASK_COLOR) != 0;
  // Deflate packs at most 1032 bytes into one, so a header that promises more is wrong, and no
  // memory is taken for it.
  const uint64_t packed = (uint64_t{d.width} * d.channels * d.bits + 7) / 8 * d.height;
  d.is_implausible = packed / 1100 > d.file_size;
  if (d.is_colour_16 || d.is_implausible) return true;
  png_set_packing(d.png);
  png_set_interlace_handling(d.png);
  png_read_update_info(d.png, d.info);
  return true;
}

bool ReadPixels(Decoder& d) {
  if (setjmp(png_jmpbuf(d.png))) return false;
  png_read_image(d.png, d.rows.data());
  png_read_end(d.png, nullptr);
  return true;
}

[[noreturn]] void ThrowUndecodable(const fs::path& path, const char* reason) {
  throw UserError(path.string(),
                  ": the mask cannot be decoded completely (",
                  reason,
                  "); is the copy complete?");
}

// Reads up to the pixels.
void OpenPng(const fs::path& path, Decoder* decoder) {
  Decoder& d = *decoder;
  RequireRegularFile(path, "a mask");
  d.file = std::fopen(path.c_str(), "rb");
  if (d.file == nullptr) throw UserError(path.string(), ": cannot be read; is it still there?");
  png_byte signature[8];
  if (std::fread(signature, 1, 8, d.file) != 8 || png_sig_cmp(signature, 0, 8) != 0) {
    throw UserError(path.string(), ": is no PNG file, where a mask of object ids should be.");
  }
  std::rewind(d.file);
  d.file_size = fs::file_size(path);
  d.png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &d, OnError, OnWarning);
  if (d.png != nullptr) d.info = png_create_info_struct(d.png);
  if (d.info == nullptr) ThrowUndecodable(path, "out of memory");
  if (!ReadHeader(d)) ThrowUndecodable(path, d.message);
  if (d.is_colour_16) {
    throw UserError(path.string(),
                    ": holds 16-bit colours, where grey values, palette indices or DEVA's 8-bit "
                    "RGB ids would be right.");
  }
  if (d.is_implausible) {
    throw UserError(path.string(),
                    ": claims ",
                    d.width,
                    " x ",
                    d.height,
                    " pixels in ",
                    d.file_size,
                    " bytes; is it damaged?");
  }
}

}  // namespace

PhotoSize ReadMaskSize(const fs::path& path) {
  Decoder d;
  OpenPng(path, &d);
  return {static_cast<int>(d.width), static_cast<int>(d.height)};
}

MaskPng ReadMaskPng(const fs::path& path) {
  RequireRegularFile(path, "a mask");
  CheckPngChunks(path);
  Decoder d;
  OpenPng(path, &d);
  const size_t row_bytes = png_get_rowbytes(d.png, d.info);
  d.pixels.resize(row_bytes * d.height);
  for (png_uint_32 y = 0; y < d.height; ++y) d.rows.push_back(d.pixels.data() + y * row_bytes);
  if (!ReadPixels(d)) ThrowUndecodable(path, d.message);

  MaskPng mask;
  mask.width = static_cast<int>(d.width);
  mask.height = static_cast<int>(d.height);
  mask.is_rgb = d.channels >= 3;
  mask.is_palette = d.color_type == PNG_COLOR_TYPE_PALETTE;
  mask.bits = d.bits;
  mask.values.resize(size_t{d.width} * d.height);
  const int bytes = d.bits == 16 ? 2 : 1;
  size_t next = 0;
  for (png_uint_32 y = 0; y < d.height; ++y) {
    const uint8_t* pixel = d.rows[y];
    for (png_uint_32 x = 0; x < d.width; ++x, pixel += d.channels * bytes) {
      uint32_t value = pixel[0];
      if (mask.is_rgb) {
        value = pixel[0] + 256u * pixel[1] + 65536u * pixel[2];
      } else if (bytes == 2) {
        value = 256u * pixel[0] + pixel[1];
      }
      mask.values[next++] = value;
    }
  }
  return mask;
}

}  // namespace semfoam
