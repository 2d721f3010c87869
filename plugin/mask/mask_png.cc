// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask/mask_png.h"

#include "foam/util/error.h"
#include "foam/util/input_file.h"
#include "plugin/photo/photo.h"

#include <csetjmp>
#include <cstdio>
#include <cstring>
#include <string>

#include <png.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

using RowFunction =
    std::function<void(const MaskHeader& header, int y, std::span<const uint32_t> values)>;

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
  bool is_interlaced = false;
  png_uint_32 width = 0;
  png_uint_32 height = 0;
  std::vector<uint8_t> pixels;  // of one row, or of all where they are interlaced
  std::vector<png_bytep> rows;  // in `pixels`, where they are interlaced

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
  int interlace = PNG_INTERLACE_NONE;
  png_get_IHDR(
      d.png, d.info, &d.width, &d.height, &d.bits, &d.color_type, &interlace, nullptr, nullptr);
  d.is_interlaced = interlace != PNG_INTERLACE_NONE;
  d.channels = png_get_channels(d.png, d.info);
  d.is_colour_16 = d.bits == 16 && (d.color_type & PNG_COLOR_MASK_COLOR) != 0;
  const uint64_t packed = (uint64_t{d.width} * d.channels * d.bits + 7) / 8 * d.height;
  d.is_implausible = packed / kMostPngExpansion > d.file_size;
  if (d.is_colour_16 || d.is_implausible) return true;
  png_set_packing(d.png);
  png_set_interlace_handling(d.png);
  png_read_update_info(d.png, d.info);
  return true;
}

bool ReadAllRows(Decoder& d) {
  if (setjmp(png_jmpbuf(d.png))) return false;
  png_read_image(d.png, d.rows.data());
  return true;
}

bool ReadNextRow(Decoder& d) {
  if (setjmp(png_jmpbuf(d.png))) return false;
  png_read_row(d.png, d.pixels.data(), nullptr);
  return true;
}

bool ReadEnd(Decoder& d) {
  if (setjmp(png_jmpbuf(d.png))) return false;
  png_read_end(d.png, nullptr);
  return true;
}

[[noreturn]] void ThrowUndecodable(const fs::path& path, const char* reason) {
  throw UserError(path.string(),
                  ": the mask cannot be decoded completely (",
                  reason,
                  "); is the copy complete?");
}

// Reads up to the pixels, from d->file, which has d->file_size bytes.
void ReadUpToPixels(const fs::path& path, Decoder* decoder) {
  Decoder& d = *decoder;
  png_byte signature[8];
  if (std::fread(signature, 1, 8, d.file) != 8 || png_sig_cmp(signature, 0, 8) != 0) {
    throw UserError(path.string(), ": is no PNG file, where a mask of object ids should be.");
  }
  std::rewind(d.file);
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

void OpenPng(const fs::path& path, Decoder* decoder) {
  RequireRegularFile(path, "a mask");
  decoder->file = std::fopen(path.c_str(), "rb");
  if (decoder->file == nullptr) {
    throw UserError(path.string(), ": cannot be read; is it still there?");
  }
  decoder->file_size = fs::file_size(path);
  ReadUpToPixels(path, decoder);
}

MaskHeader HeaderOf(const Decoder& d) {
  MaskHeader header;
  header.size = {static_cast<int>(d.width), static_cast<int>(d.height)};
  header.is_rgb = d.channels >= 3;
  header.is_palette = d.color_type == PNG_COLOR_TYPE_PALETTE;
  header.bits = d.bits;
  png_colorp palette = nullptr;
  int num_colors = 0;
  if (header.is_palette && png_get_PLTE(d.png, d.info, &palette, &num_colors) != 0) {
    for (int i = 0; i < num_colors; ++i) {
      header.palette.push_back(palette[i].red + 256u * palette[i].green + 65536u * palette[i].blue);
    }
  }
  const uint64_t row_bytes = png_get_rowbytes(d.png, d.info);
  header.decoding_bytes =
      sizeof(uint32_t) * d.width +
      (d.is_interlaced ? (row_bytes + sizeof(png_bytep)) * d.height : row_bytes);
  return header;
}

// Decodes the pixels of an open PNG.
MaskHeader ReadRows(const fs::path& path,
                    const RowFunction& on_row,
                    bool reads_alpha,
                    Decoder* decoder) {
  Decoder& d = *decoder;
  const MaskHeader header = HeaderOf(d);
  RequireDecodingMemory(path, header.size, header.decoding_bytes);
  const size_t row_bytes = png_get_rowbytes(d.png, d.info);
  d.pixels.resize(row_bytes * (d.is_interlaced ? d.height : 1));
  if (d.is_interlaced) {
    for (png_uint_32 y = 0; y < d.height; ++y) d.rows.push_back(d.pixels.data() + y * row_bytes);
    if (!ReadAllRows(d)) ThrowUndecodable(path, d.message);
  }
  std::vector<uint32_t> values(d.width);
  const int bytes = d.bits == 16 ? 2 : 1;
  // Byte of a pixel where its alpha value begins; 0 where none is read.
  const bool has_alpha = reads_alpha && (d.color_type & PNG_COLOR_MASK_ALPHA) != 0;
  const int alpha_at = has_alpha ? (d.channels - 1) * bytes : 0;
  for (png_uint_32 y = 0; y < d.height; ++y) {
    if (!d.is_interlaced && !ReadNextRow(d)) ThrowUndecodable(path, d.message);
    const uint8_t* pixel = d.is_interlaced ? d.rows[y] : d.pixels.data();
    for (png_uint_32 x = 0; x < d.width; ++x, pixel += d.channels * bytes) {
      uint32_t value = pixel[0];
      if (alpha_at > 0) {
        value = bytes == 2 ? 256u * pixel[alpha_at] + pixel[alpha_at + 1] : pixel[alpha_at];
      } else if (header.is_rgb) {
        value = pixel[0] + 256u * pixel[1] + 65536u * pixel[2];
      } else if (bytes == 2) {
        value = 256u * pixel[0] + pixel[1];
      }
      values[x] = value;
    }
    on_row(header, static_cast<int>(y), values);
  }
  if (!ReadEnd(d)) ThrowUndecodable(path, d.message);
  return header;
}

MaskHeader ReadFileRows(const fs::path& path, const RowFunction& on_row, bool reads_alpha) {
  RequireRegularFile(path, "a mask");
  CheckPngChunks(path);
  Decoder d;
  OpenPng(path, &d);
  return ReadRows(path, on_row, reads_alpha, &d);
}

}  // namespace

MaskHeader ReadMaskHeader(const fs::path& path) {
  Decoder d;
  OpenPng(path, &d);
  return HeaderOf(d);
}

MaskHeader ReadMaskRows(const fs::path& path, const RowFunction& on_row) {
  return ReadFileRows(path, on_row, /*reads_alpha=*/false);
}

MaskHeader ReadAlphaOrIdRows(const fs::path& path, const RowFunction& on_row) {
  return ReadFileRows(path, on_row, /*reads_alpha=*/true);
}

MaskHeader ReadMaskRows(const fs::path& path, std::string_view png, const RowFunction& on_row) {
  if (png.empty()) ThrowUndecodable(path, "it is empty");
  Decoder d;
  d.file = ::fmemopen(const_cast<char*>(png.data()), png.size(), "rb");
  if (d.file == nullptr) ThrowUndecodable(path, "out of memory");
  d.file_size = png.size();
  ReadUpToPixels(path, &d);
  return ReadRows(path, on_row, /*reads_alpha=*/false, &d);
}

MaskPng ReadMaskPng(const fs::path& path) {
  MaskPng mask;
  ReadMaskRows(path, [&](const MaskHeader& header, int y, std::span<const uint32_t> values) {
    if (y == 0) {
      mask.width = header.size.width;
      mask.height = header.size.height;
      mask.is_rgb = header.is_rgb;
      const size_t pixels = static_cast<size_t>(mask.width) * mask.height;
      RequireDecodingMemory(path, header.size, sizeof(uint32_t) * pixels);
      mask.values.reserve(pixels);
    }
    mask.values.insert(mask.values.end(), values.begin(), values.end());
  });
  return mask;
}

}  // namespace semfoam
