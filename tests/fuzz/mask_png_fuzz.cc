// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask/class_image.h"
#include "plugin/mask/mask_classes.h"
#include "plugin/mask/mask_decoding.h"
#include "plugin/mask/mask_pairing.h"
#include "plugin/mask/mask_png.h"

#include <string>
#include <vector>

#include "tests/fuzz/fuzz_input.h"
#include <zlib.h>

// Masks. Checksums would stop nearly every changed file at once, so they are made right: an input
// is either (first byte 'r') a PNG whose chunks get their checksums, or a header and rows that are
// packed into one.
namespace semfoam {

// Deflate packs 1032 to 1, eight pixels can share a byte, and each becomes four.
const double kLargestBlockPerByte = 40'000;

namespace {

constexpr char kSignature[] = "\x89PNG\r\n\x1a\n";

std::string BigEndian(uint32_t value) {
  std::string bytes;
  for (int shift = 24; shift >= 0; shift -= 8) bytes += static_cast<char>(value >> shift & 0xff);
  return bytes;
}

void AppendChunk(std::string_view name_and_data, std::string* png) {
  *png += BigEndian(static_cast<uint32_t>(name_and_data.size() - 4));
  *png += name_and_data;
  *png +=
      BigEndian(static_cast<uint32_t>(crc32(0,
                                            reinterpret_cast<const Bytef*>(name_and_data.data()),
                                            static_cast<uInt>(name_and_data.size()))));
}

std::string WithChecksums(std::string_view png) {
  std::string repaired(png.substr(0, 8));
  png.remove_prefix(repaired.size());
  while (png.size() >= 12) {
    uint64_t length = 0;
    for (int i = 0; i < 4; ++i) length = 256 * length + static_cast<uint8_t>(png[i]);
    if (length > png.size() - 12) break;
    AppendChunk(png.substr(4, length + 4), &repaired);
    png.remove_prefix(length + 12);
  }
  return repaired + std::string(png);
}

// Width, height, bits, kind of colour and interlacing in five bytes, then the rows as they are
// packed.
std::string Packed(std::string_view input) {
  std::string png(kSignature, 8);
  if (input.size() < 5) return png;
  const auto byte = [&](size_t i) { return static_cast<uint8_t>(input[i]); };
  std::string header = "IHDR" + BigEndian(byte(0)) + BigEndian(byte(1));
  header += {static_cast<char>(1 << (byte(2) % 5)), input[3], 0, 0, static_cast<char>(byte(4) % 2)};
  AppendChunk(header, &png);
  if (input[3] == 3) AppendChunk("PLTE" + std::string(3 * 16, 'x'), &png);
  input.remove_prefix(5);
  std::vector<Bytef> packed(compressBound(input.size()));
  uLongf size = packed.size();
  const int result = compress2(packed.data(),
                               &size,
                               reinterpret_cast<const Bytef*>(input.data()),
                               input.size(),
                               Z_BEST_SPEED);
  Require(result == Z_OK, "the rows can be packed");
  AppendChunk("IDAT" + std::string(packed.begin(), packed.begin() + static_cast<int64_t>(size)),
              &png);
  AppendChunk("IEND", &png);
  return png;
}

void Read(const MemoryFile& file) {
  const MaskPng mask = ReadMaskPng(file.path());
  const PhotoSize size = ReadMaskHeader(file.path()).size;
  Require(size == PhotoSize{mask.width, mask.height}, "both readers tell the same size");
  Require(mask.values.size() == static_cast<size_t>(mask.width) * mask.height,
          "there are as many values as pixels");
  const MaskPairing pairing{{file.path()}, {}};
  const DecodedMask decoded = DecodeMask(file.path(), size);
  const MaskClasses classes =
      NumberMasks({decoded.contents}, pairing, "/proc/self/fd", LabelZero::kAuto);
  const std::vector<Label>& labels = classes.labels;
  const ClassImage image =
      ClassesOf(decoded.indices, classes.Of(decoded.contents), static_cast<int>(labels.size()));
  for (size_t i = 0; i < mask.values.size(); ++i) {
    const int32_t k = Value(image[i]);
    Require(k < static_cast<int32_t>(labels.size()), "a pixel's class is in the table");
    Require(k < 0 || Value(labels[k].source_id) == mask.values[i] ||
                Value(labels[k].source_id) == (mask.values[i] & 0xff),
            "a pixel's class is that of its id");
  }
}

}  // namespace
}  // namespace semfoam

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static const semfoam::MemoryFile file;
  if (size == 0) return 0;
  const std::string_view input(reinterpret_cast<const char*>(data) + 1, size - 1);
  file.Set(data[0] == 'r' ? semfoam::WithChecksums(input) : semfoam::Packed(input));
  semfoam::ReadsOrRefuses(file.path(), [] { semfoam::Read(file); });
  return 0;
}
