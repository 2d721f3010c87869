// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/photo/photo.h"

#include "foam/image/srgb.h"
#include "foam/train/memory_plan.h"
#include "foam/util/available_memory.h"
#include "foam/util/error.h"
#include "foam/util/input_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <fstream>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <OpenImageIO/imageio.h>
#include <glog/logging.h>
#include <zlib.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

// Returns one line of the decoder's words, for the inside of a sentence.
std::string ReasonInSentence(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  while (!text.empty() && (text.back() == ' ' || text.back() == '.')) text.pop_back();
  return text;
}

[[noreturn]] void ThrowUndecodable(const fs::path& path, const std::string& reason) {
  throw UserError(path.string(),
                  ": cannot be decoded completely (",
                  ReasonInSentence(reason),
                  "); is the copy complete?");
}

constexpr char kPngSignature[] = "\x89PNG\r\n\x1a\n";

bool IsPng(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  char signature[8];
  return file.read(signature, 8) && std::memcmp(signature, kPngSignature, 8) == 0;
}

// Returns null and the decoder's words where `path` cannot be opened.
std::unique_ptr<OIIO::ImageInput> OpenAsItsFormat(const fs::path& path, std::string& reason) {
  OIIO::ImageSpec hints;
  hints["oiio:UnassociatedAlpha"] = 1;
  if (!IsPng(path)) {
    std::unique_ptr<OIIO::ImageInput> input = OIIO::ImageInput::open(path.string(), &hints);
    if (input == nullptr) reason = OIIO::geterror();
    return input;
  }
  // By its name, a PNG that is named .jpg would be tried as a JPEG first, and what the JPEG decoder
  // says would be the reason given.
  std::unique_ptr<OIIO::ImageInput> input = OIIO::ImageInput::create("png");
  CHECK(input != nullptr) << OIIO::geterror();
  OIIO::ImageSpec spec;
  if (input->open(path.string(), spec, hints)) return input;
  reason = input->geterror();
  return nullptr;
}

std::unique_ptr<OIIO::ImageInput> Open(const fs::path& path) {
  // The photos are decoded in parallel already; more threads below them would escape the user's
  // --num_threads.
  static const bool single_threaded = OIIO::attribute("threads", 1);
  CHECK(single_threaded);
  RequireRegularFile(path, "a photo");
  std::string reason;
  std::unique_ptr<OIIO::ImageInput> input = OpenAsItsFormat(path, reason);
  if (input == nullptr) {
    throw UserError(path.string(),
                    ": is no readable image (",
                    ReasonInSentence(reason),
                    "); a photo, such as a JPEG or PNG, would be right.");
  }
  const OIIO::ImageSpec& spec = input->spec();
  if (spec.get_int_attribute("oiio:Movie") != 0) {
    throw UserError(path.string(), ": is an animation, where one still picture would be right.");
  }
  RequirePlausible(path, {spec.width, spec.height, spec.depth, spec.nchannels});
  return input;
}

uint32_t BigEndian(const char* bytes) {
  const auto* b = reinterpret_cast<const uint8_t*>(bytes);
  return uint32_t{b[0]} << 24 | uint32_t{b[1]} << 16 | uint32_t{b[2]} << 8 | uint32_t{b[3]};
}

// The sum over the components of a JPEG of the pixels that each has (fewer where it is subsampled),
// if its frame is progressive, whose coefficients libjpeg holds all at once; else 0.
uint64_t ProgressiveJpegValues(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  uint8_t head[4];
  const auto read = [&](uint8_t* bytes, std::streamsize count) {
    return static_cast<bool>(file.read(reinterpret_cast<char*>(bytes), count));
  };
  if (!read(head, 2) || head[0] != 0xff || head[1] != 0xd8) return 0;
  while (read(head, 4) && head[0] == 0xff) {
    const uint8_t marker = head[1];
    const int length = head[2] << 8 | head[3];
    // SOF0 to SOF15 without the markers of tables among them.
    const bool is_frame =
        (marker & 0xf0) == 0xc0 && marker != 0xc4 && marker != 0xc8 && marker != 0xcc;
    if (!is_frame) {
      if (length < 2) return 0;
      file.seekg(length - 2, std::ios::cur);
      continue;
    }
    if ((marker & 3) != 2) return 0;
    uint8_t frame[6 + 3 * 4];
    if (!read(frame, 6) || frame[5] > 4 || !read(frame + 6, 3 * frame[5])) return 0;
    const uint64_t height = frame[1] << 8 | frame[2], width = frame[3] << 8 | frame[4];
    uint64_t most = 1, sum = 0;  // of the sampling factors' products
    for (int c = 0; c < frame[5]; ++c) {
      const uint8_t factors = frame[6 + 3 * c + 1];
      const uint64_t product = uint64_t{factors} / 16 * (factors % 16);
      most = std::max(most, product);
      sum += product;
    }
    return width * height * sum / most;
  }
  return 0;
}

struct PngHeader {
  uint64_t bits_per_pixel = 0;  // 0: the file is no PNG
  bool is_interlaced = false;
};

PngHeader ReadPngHeader(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  char bytes[29];
  if (!file.read(bytes, sizeof(bytes)) || std::memcmp(bytes, kPngSignature, 8) != 0) return {};
  // By colour type: grey, -, RGB, palette, grey and alpha, -, RGB and alpha.
  constexpr uint64_t kChannels[] = {1, 1, 3, 1, 2, 1, 4, 1};
  return {static_cast<uint8_t>(bytes[24]) * kChannels[bytes[25] & 7], bytes[28] != 0};
}

// What ReadPhoto makes its result of: 8-bit values of all channels.
bool IsResult(const OIIO::ImageSpec& spec) { return spec.nchannels == 3 && spec.alpha_channel < 0; }

PhotoHeader HeaderOf(const fs::path& path, const OIIO::ImageInput& input) {
  const OIIO::ImageSpec& spec = input.spec();
  const std::string_view format = input.format_name();
  const uint64_t pixels = static_cast<uint64_t>(spec.width) * static_cast<uint64_t>(spec.height);
  // Memory of the decoder besides the rows that it returns.
  uint64_t decoder = 0;
  if (format == "jpeg") {
    decoder = sizeof(int16_t) * ProgressiveJpegValues(path);
  } else if (format == "png" ? ReadPngHeader(path).is_interlaced
                             : format != "bmp" && format != "pnm") {
    decoder = spec.image_bytes(/*native=*/true);
  }
  PhotoHeader header;
  header.size = {spec.width, spec.height};
  header.decoding_bytes = pixels * static_cast<uint64_t>(spec.nchannels) +
                          std::max(decoder, IsResult(spec) ? 0 : 3 * pixels);
  return header;
}

}  // namespace

void RequirePlausible(const fs::path& path, const PictureClaim& claim) {
  // No compressed photo comes near this; a damaged header easily does.
  constexpr uint64_t kPixelsPerByte = 20'000;
  constexpr uint64_t kAlwaysPlausible = 1 << 24;
  const uint64_t pixels = static_cast<uint64_t>(std::max(claim.width, 0)) *
                          static_cast<uint64_t>(std::max(claim.height, 0));
  const uint64_t file_size = fs::file_size(path);
  const uint64_t png_bits = ReadPngHeader(path).bits_per_pixel;
  const bool fits = png_bits > 0
                        ? pixels / 8 * png_bits / kMostPngExpansion <= file_size
                        : pixels <= kAlwaysPlausible || pixels / kPixelsPerByte <= file_size;
  if (pixels == 0 || claim.depth > 1 || !fits) {
    throw UserError(path.string(),
                    ": claims ",
                    claim.width,
                    " x ",
                    claim.height,
                    " pixels in ",
                    file_size,
                    " bytes; is it damaged?");
  }
  if (claim.channels > kMostChannels) {
    throw UserError(path.string(),
                    ": has ",
                    claim.channels,
                    " channels, where grey or colours, with or without alpha, would be right.");
  }
}

void RequireDecodingMemory(const fs::path& path, const PhotoSize& size, uint64_t bytes) {
  // So little is there, or the system will find it.
  constexpr uint64_t kAlwaysThere = 32'000'000;
  if (bytes > kAlwaysThere) RequireDecodingMemory(path, size, bytes, AvailableMemory());
}

void RequireDecodingMemory(const fs::path& path,
                           const PhotoSize& size,
                           uint64_t bytes,
                           int64_t available) {
  if (bytes <= static_cast<uint64_t>(std::max<int64_t>(0, available))) return;
  throw UserError(path.string(),
                  ": is ",
                  size.width,
                  " x ",
                  size.height,
                  " pixels, which take ",
                  FormatBytes(static_cast<int64_t>(bytes)),
                  " of memory to decode, and ",
                  FormatBytes(available),
                  " are available; a smaller picture would be right.");
}

void CheckPngChunks(const fs::path& path) {
  if (!IsPng(path)) return;
  std::ifstream file(path, std::ios::binary);
  file.seekg(8);
  uint64_t left = fs::file_size(path) - 8;
  std::vector<char> chunk;
  for (;;) {
    char head[8];
    if (left < 12 || !file.read(head, 8)) ThrowUndecodable(path, "the PNG has no end");
    const uint64_t length = BigEndian(head);
    if (length > left - 12) ThrowUndecodable(path, "the PNG ends within a chunk");
    chunk.resize(length + 8);
    std::memcpy(chunk.data(), head + 4, 4);
    if (!file.read(chunk.data() + 4, static_cast<std::streamsize>(length + 4))) {
      ThrowUndecodable(path, "the PNG ends within a chunk");
    }
    const auto crc =
        crc32(0, reinterpret_cast<const Bytef*>(chunk.data()), static_cast<uInt>(length + 4));
    if (crc != BigEndian(chunk.data() + 4 + length)) {
      ThrowUndecodable(path, "a checksum in the PNG is wrong");
    }
    const std::string_view name(chunk.data(), 4);
    if (name == "IEND") return;
    if (name == "acTL") {
      throw UserError(path.string(),
                      ": is an animated PNG, where one still picture would be right.");
    }
    left -= length + 12;
  }
}

bool SameAspect(const PhotoSize& a, const PhotoSize& b) {
  const double expected_height = static_cast<double>(a.width) * b.height / b.width;
  const double expected_width = static_cast<double>(a.height) * b.width / b.height;
  return std::abs(a.height - expected_height) <= 1 || std::abs(a.width - expected_width) <= 1;
}

PhotoSize ReducedSize(const PhotoSize& size, int max_image_size) {
  const int longest = std::max(size.width, size.height);
  if (max_image_size <= 0 || longest <= max_image_size) return size;
  const double scale = static_cast<double>(max_image_size) / longest;
  return {std::max(1, static_cast<int>(std::lround(scale * size.width))),
          std::max(1, static_cast<int>(std::lround(scale * size.height)))};
}

Image8 ReducePhoto(const Image8& photo, const PhotoSize& size) {
  CHECK(size.width > 0 && size.width <= photo.width);
  CHECK(size.height > 0 && size.height <= photo.height);
  static const std::array<float, 256> linear = [] {
    std::array<float, 256> values;
    for (int i = 0; i < 256; ++i) values[i] = static_cast<float>(LinearFromDisplay(i / 255.0));
    return values;
  }();
  const auto display = [](double light) {
    return static_cast<uint8_t>(std::lround(255 * std::clamp(DisplayFromLinear(light), 0.0, 1.0)));
  };
  // Which pixels a smaller one covers along an axis, and how much of each.
  struct Cover {
    int first;
    std::vector<double> share;
  };
  const auto covers = [](int from, int to) {
    std::vector<Cover> all(to);
    const double step = static_cast<double>(from) / to;
    for (int i = 0; i < to; ++i) {
      const double begin = i * step, end = std::min((i + 1) * step, static_cast<double>(from));
      all[i].first = static_cast<int>(begin);
      for (int k = all[i].first; k < end && k < from; ++k) {
        all[i].share.push_back((std::min(end, k + 1.0) - std::max(begin, double(k))) / step);
      }
    }
    return all;
  };
  const std::vector<Cover> columns = covers(photo.width, size.width);
  const std::vector<Cover> rows = covers(photo.height, size.height);
  Image8 reduced{size.width, size.height, {}};
  reduced.data.reserve(size_t{3} * size.width * size.height);
  for (const Cover& row : rows) {
    for (const Cover& column : columns) {
      double sum[3] = {0, 0, 0};
      for (size_t y = 0; y < row.share.size(); ++y) {
        const uint8_t* pixel =
            &photo.data[3 * ((row.first + y) * static_cast<size_t>(photo.width) + column.first)];
        for (const double share : column.share) {
          for (int c = 0; c < 3; ++c) sum[c] += row.share[y] * share * linear[*pixel++];
        }
      }
      for (const double value : sum) reduced.data.push_back(display(value));
    }
  }
  return reduced;
}

PhotoHeader ReadPhotoHeader(const fs::path& path) { return HeaderOf(path, *Open(path)); }

PhotoSize ReadPhotoSize(const fs::path& path) { return ReadPhotoHeader(path).size; }

Image8 ReadPhoto(const fs::path& path) {
  RequireRegularFile(path, "a photo");
  CheckPngChunks(path);
  const auto input = Open(path);
  const OIIO::ImageSpec& spec = input->spec();
  if (spec.format.is_floating_point()) {
    throw UserError(path.string(),
                    ": holds floating-point values, where the display values of a photo (8 or 16 "
                    "bits, such as a JPEG or PNG) would be right.");
  }
  const PhotoHeader header = HeaderOf(path, *input);
  RequireDecodingMemory(path, header.size, header.decoding_bytes);
  const int channels = spec.nchannels;
  const int alpha = spec.alpha_channel;
  const bool premultiplied = spec.get_int_attribute("oiio:UnassociatedAlpha") == 0;
  const size_t pixels = static_cast<size_t>(spec.width) * spec.height;
  std::vector<uint8_t> raw(pixels * channels);
  const bool complete = input->read_image(0, 0, 0, channels, OIIO::TypeDesc::UINT8, raw.data());
  const std::string complaint = input->geterror();
  if (!complete || !complaint.empty()) {
    ThrowUndecodable(path, complaint.empty() ? "no reason given" : complaint);
  }

  Image8 image{spec.width, spec.height, {}};
  if (IsResult(spec)) {
    image.data = std::move(raw);
    return image;
  }
  // Grey, or grey with alpha, counts as three equal colours.
  const bool grey = channels < 3;
  image.data.resize(3 * pixels);
  for (size_t i = 0; i < pixels; ++i) {
    const uint8_t* pixel = raw.data() + i * channels;
    const int coverage = alpha >= 0 && alpha < channels ? pixel[alpha] : 255;
    for (int k = 0; k < 3; ++k) {
      const int color = pixel[grey ? 0 : k];
      const int covered = premultiplied ? color : (color * coverage + 127) / 255;
      image.data[3 * i + k] = static_cast<uint8_t>(std::min(255, covered + 255 - coverage));
    }
  }
  return image;
}

}  // namespace semfoam
