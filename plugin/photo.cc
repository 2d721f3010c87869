// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/photo.h"

#include "foam/error.h"
#include "foam/input_file.h"
#include "foam/srgb.h"

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

// One line of the decoder's words, for the inside of a sentence.
std::string OneLine(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  while (!text.empty() && (text.back() == ' ' || text.back() == '.')) text.pop_back();
  return text;
}

[[noreturn]] void ThrowUndecodable(const fs::path& path, const std::string& reason) {
  throw UserError(path.string(),
                  ": cannot be decoded completely (",
                  OneLine(reason),
                  "); is the copy complete?");
}

std::unique_ptr<OIIO::ImageInput> Open(const fs::path& path) {
  // The photos are decoded in parallel already; more threads below them would escape the user's
  // --num_threads.
  static const bool single_threaded = OIIO::attribute("threads", 1);
  CHECK(single_threaded);
  RequireRegularFile(path, "a photo");
  OIIO::ImageSpec hints;
  hints["oiio:UnassociatedAlpha"] = 1;
  std::unique_ptr<OIIO::ImageInput> input = OIIO::ImageInput::open(path.string(), &hints);
  if (input == nullptr) {
    const std::string reason = OIIO::geterror();
    throw UserError(path.string(),
                    ": is no readable image (",
                    OneLine(reason),
                    "); a photo, such as a JPEG or PNG, would be right.");
  }
  const OIIO::ImageSpec& spec = input->spec();
  if (spec.get_int_attribute("oiio:Movie") != 0) {
    throw UserError(path.string(), ": is an animation, where one still picture would be right.");
  }
  const uint64_t pixels = static_cast<uint64_t>(std::max(spec.width, 0)) *
                          static_cast<uint64_t>(std::max(spec.height, 0));
  // No compressed photo comes near this; a damaged header easily does.
  constexpr uint64_t kPixelsPerByte = 20'000;
  constexpr uint64_t kAlwaysPlausible = 1 << 24;
  if (pixels == 0 || spec.depth > 1 ||
      (pixels > kAlwaysPlausible && pixels / kPixelsPerByte > fs::file_size(path))) {
    throw UserError(path.string(),
                    ": claims ",
                    spec.width,
                    " x ",
                    spec.height,
                    " pixels in ",
                    fs::file_size(path),
                    " bytes; is it damaged?");
  }
  return input;
}

uint32_t BigEndian(const char* bytes) {
  const auto* b = reinterpret_cast<const uint8_t*>(bytes);
  return uint32_t{b[0]} << 24 | uint32_t{b[1]} << 16 | uint32_t{b[2]} << 8 | uint32_t{b[3]};
}

}  // namespace

void CheckPngChunks(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  char signature[8];
  if (!file.read(signature, 8) || std::memcmp(signature, "\x89PNG\r\n\x1a\n", 8) != 0) return;
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

PhotoSize ReadPhotoSize(const fs::path& path) {
  const auto input = Open(path);
  return {input->spec().width, input->spec().height};
}

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
  if (channels == 3 && alpha < 0) {
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
