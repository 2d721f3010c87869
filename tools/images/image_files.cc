// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/images/image_files.h"

#include "foam/util/error.h"
#include "foam/util/output_file.h"
#include "plugin/mask/label_png.h"
#include "plugin/photo/photo.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <glog/logging.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

// OpenImageIO does not look whether its bytes reach the disk: it writes into memory, we write the
// file.
class MemoryOutput {
 public:
  // The format is chosen by the extension of `path`; `what` is what error sentences call the file.
  MemoryOutput(fs::path path, const char* what)
      : path_(std::move(path)),
        what_(what),
        output_(OIIO::ImageOutput::create(path_.extension().string().substr(1))) {
    Require(output_ != nullptr && output_->supports("ioproxy"));
  }

  void Add(OIIO::ImageSpec spec, const void* pixels, OIIO::ImageOutput::OpenMode mode) {
    if (mode == OIIO::ImageOutput::Create) Require(output_->set_ioproxy(&bytes_));
    // Else OpenEXR's files would carry the time at which they were written.
    spec.attribute("DateTime", "");
    spec.attribute("Software", kImageSoftware);
    Require(output_->open(path_.string(), spec, mode) && output_->write_image(spec.format, pixels));
  }

  // Returns the bytes of the file.
  std::string Close() {
    Require(output_->close());
    const std::vector<unsigned char>& bytes = bytes_.buffer();
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
  }

  const fs::path& path() const { return path_; }

 private:
  void Require(bool good) const {
    if (good) return;
    throw UserError(path_.string(),
                    ": this ",
                    what_,
                    " cannot be written (",
                    output_ == nullptr ? OIIO::geterror() : output_->geterror(),
                    "); is it too large?");
  }

  fs::path path_;
  const char* what_;
  OIIO::Filesystem::IOVecOutput bytes_;
  std::unique_ptr<OIIO::ImageOutput> output_;
};

std::string Encode(const char* name, const Image8& image, OIIO::ImageSpec spec) {
  CHECK_EQ(image.data.size(), size_t{3} * image.width * image.height);
  spec.attribute("oiio:ColorSpace", "sRGB");
  MemoryOutput output(name, "image");
  output.Add(spec, image.data.data(), OIIO::ImageOutput::Create);
  return output.Close();
}

void WriteImage(const fs::path& path, const OIIO::ImageSpec& spec, const void* pixels) {
  MemoryOutput output(path, "image");
  output.Add(spec, pixels, OIIO::ImageOutput::Create);
  WriteTextFile(path, output.Close());
}

// Sets how long each frame of a GIF is shown, in hundredths of a second: OpenImageIO 2.5 writes one
// second whatever it is told. (GIF89a specification, sections 18 to 27.)
void SetFrameTime(int hundredths, std::string* gif) {
  const auto byte = [&](size_t at) { return static_cast<uint8_t>(gif->at(at)); };
  const auto color_table_bytes = [](uint8_t packed) {
    return (packed & 0x80) != 0 ? size_t{3} << ((packed & 7) + 1) : size_t{0};
  };
  size_t at = 13 + color_table_bytes(byte(10));
  while (byte(at) != 0x3b) {
    if (byte(at) == 0x21) {        // an extension
      if (byte(at + 1) == 0xf9) {  // the graphic control of the next frame
        (*gif)[at + 4] = static_cast<char>(hundredths & 0xff);
        (*gif)[at + 5] = static_cast<char>(hundredths >> 8);
      }
      at += 2;
    } else {
      CHECK_EQ(byte(at), 0x2c);  // a frame
      at += 11 + color_table_bytes(byte(at + 9));
    }
    while (byte(at) != 0) at += size_t{1} + byte(at);
    ++at;
  }
}

}  // namespace

void WriteRgbPng(const fs::path& path, const Image8& image) {
  CHECK_EQ(image.data.size(), size_t{3} * image.width * image.height);
  OIIO::ImageSpec spec(image.width, image.height, 3, OIIO::TypeDesc::UINT8);
  spec.attribute("oiio:ColorSpace", "sRGB");
  WriteImage(path, spec, image.data.data());
}

std::string EncodePng(const Image8& image) {
  return Encode("image.png", image, {image.width, image.height, 3, OIIO::TypeDesc::UINT8});
}

std::string EncodeJpeg(const Image8& image, int quality) {
  OIIO::ImageSpec spec(image.width, image.height, 3, OIIO::TypeDesc::UINT8);
  spec.attribute("Compression", "jpeg:" + std::to_string(quality));
  return Encode("image.jpg", image, spec);
}

void WriteDepthExr(const fs::path& path, int width, int height, const std::vector<float>& depth) {
  CHECK_EQ(depth.size(), static_cast<size_t>(width) * height);
  OIIO::ImageSpec spec(width, height, 1, OIIO::TypeDesc::FLOAT);
  // The name by which readers without a notion of depth still find a lone channel.
  spec.channelnames = {"Y"};
  spec.attribute("compression", "zip");
  WriteImage(path, spec, depth.data());
}

bool IsOwnImage(const fs::path& path) {
  if (!fs::is_regular_file(path)) return false;  // of a pipe or a device nothing is read
  const std::unique_ptr<OIIO::ImageInput> input = OIIO::ImageInput::open(path.string());
  if (input == nullptr) OIIO::geterror();  // or it would be printed at the end
  return input != nullptr && input->spec().get_string_attribute("Software") == kImageSoftware;
}

struct GifWriter::State {
  MemoryOutput output;
  OIIO::ImageSpec spec;
  int frame_hundredths = 0;
  int num_images = 0;
};

GifWriter::GifWriter(const fs::path& path, double frames_per_second)
    : state_(new State{{path, "animation"}, OIIO::ImageSpec(0, 0, 3, OIIO::TypeDesc::UINT8)}) {
  state_->frame_hundredths =
      static_cast<int>(std::clamp(std::round(100 / frames_per_second), 1.0, 65535.0));
  state_->spec.attribute("gif:LoopCount", 0);
}

GifWriter::~GifWriter() = default;

void GifWriter::Add(const Image8& image) {
  CHECK_EQ(image.data.size(), size_t{3} * image.width * image.height);
  OIIO::ImageSpec spec = state_->spec;
  spec.width = spec.full_width = image.width;
  spec.height = spec.full_height = image.height;
  state_->output.Add(
      spec,
      image.data.data(),
      state_->num_images++ == 0 ? OIIO::ImageOutput::Create : OIIO::ImageOutput::AppendSubimage);
}

void GifWriter::Finish() {
  CHECK_GT(state_->num_images, 0);
  std::string bytes = state_->output.Close();
  SetFrameTime(state_->frame_hundredths, &bytes);
  WriteTextFile(state_->output.path(), bytes);
}

Foreground ReadForeground(const fs::path& path) {
  const std::unique_ptr<OIIO::ImageInput> input = OIIO::ImageInput::open(path.string());
  if (input == nullptr) {
    throw UserError(
        path.string(), ": this mask cannot be read (", OIIO::geterror(), "); give a PNG.");
  }
  const OIIO::ImageSpec& spec = input->spec();
  RequirePlausible(path, {spec.width, spec.height, spec.depth, spec.nchannels});
  const size_t num_pixels = static_cast<size_t>(spec.width) * static_cast<size_t>(spec.height);
  // 16 bits of all channels, an id each, and what some decoders hold of their own.
  RequireDecodingMemory(path,
                        {spec.width, spec.height},
                        num_pixels * (2 * static_cast<size_t>(spec.nchannels) + sizeof(int32_t)) +
                            spec.image_bytes(true));
  std::vector<uint16_t> pixels(num_pixels * spec.nchannels);
  if (!input->read_image(0, 0, 0, spec.nchannels, OIIO::TypeDesc::UINT16, pixels.data())) {
    throw UserError(path.string(),
                    ": this mask cannot be read to its end (",
                    input->geterror(),
                    "); is the copy complete?");
  }
  const bool has_16_bits = spec.format == OIIO::TypeDesc::UINT16;
  // What 1 of the file was read as.
  const uint16_t one = has_16_bits ? 1 : 257;
  uint16_t largest = 0;
  for (size_t i = 0; i < pixels.size(); i += spec.nchannels) largest = std::max(largest, pixels[i]);
  const uint16_t threshold = largest == one ? 0 : 128 * 257;
  Foreground foreground;
  foreground.largest = largest / one;
  foreground.white = has_16_bits ? 65535 : 255;
  foreground.mask = {spec.width, spec.height, {}};
  foreground.mask.data.reserve(num_pixels);
  for (size_t i = 0; i < pixels.size(); i += spec.nchannels) {
    foreground.mask.data.push_back(pixels[i] > threshold);
  }
  return foreground;
}

LabelImage ResizeNearest(const LabelImage& image, int width, int height) {
  LabelImage resized{width, height, {}};
  resized.data.reserve(static_cast<size_t>(width) * height);
  for (int y = 0; y < height; ++y) {
    const int64_t from_y = int64_t{y} * image.height / height;
    for (int x = 0; x < width; ++x) {
      const int64_t from_x = int64_t{x} * image.width / width;
      resized.data.push_back(image.data[from_y * image.width + from_x]);
    }
  }
  return resized;
}

}  // namespace semfoam
