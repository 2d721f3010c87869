// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/image_files.h"

#include "foam/error.h"
#include "foam/output_file.h"

#include <algorithm>
#include <memory>

#include <OpenImageIO/imageio.h>
#include <glog/logging.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

void WriteImage(const fs::path& path, const OIIO::ImageSpec& spec, const void* pixels) {
  OutputFile file(path);
  std::unique_ptr<OIIO::ImageOutput> output =
      OIIO::ImageOutput::create(file.temporary_path().string());
  const bool written = output != nullptr && output->open(file.temporary_path().string(), spec) &&
                       output->write_image(spec.format, pixels) && output->close();
  if (!written) {
    throw UserError(path.string(),
                    ": this image cannot be written (",
                    output == nullptr ? OIIO::geterror() : output->geterror(),
                    "); is the disk full?");
  }
  file.Commit();
}

}  // namespace

void WriteRgbPng(const fs::path& path, const Image8& image) {
  CHECK_EQ(image.data.size(), size_t{3} * image.width * image.height);
  OIIO::ImageSpec spec(image.width, image.height, 3, OIIO::TypeDesc::UINT8);
  spec.attribute("oiio:ColorSpace", "sRGB");
  WriteImage(path, spec, image.data.data());
}

void WriteLabelPng(const fs::path& path, const LabelImage& labels) {
  std::vector<uint16_t> ids;
  ids.reserve(labels.data.size());
  for (const int32_t id : labels.data) {
    CHECK(id >= 0 && id <= 65535) << id;
    ids.push_back(static_cast<uint16_t>(id));
  }
  const OIIO::ImageSpec spec(labels.width, labels.height, 1, OIIO::TypeDesc::UINT16);
  WriteImage(path, spec, ids.data());
}

void WriteDepthExr(const fs::path& path, int width, int height, const std::vector<float>& depth) {
  CHECK_EQ(depth.size(), static_cast<size_t>(width) * height);
  OIIO::ImageSpec spec(width, height, 1, OIIO::TypeDesc::FLOAT);
  // The name by which readers without a notion of depth still find a lone channel.
  spec.channelnames = {"Y"};
  spec.attribute("compression", "zip");
  WriteImage(path, spec, depth.data());
}

struct GifWriter::State {
  fs::path path;
  OutputFile file;
  std::unique_ptr<OIIO::ImageOutput> output;
  OIIO::ImageSpec spec;
  int num_images = 0;

  void Require(bool good) const {
    if (good) return;
    throw UserError(path.string(),
                    ": this animation cannot be written (",
                    output == nullptr ? OIIO::geterror() : output->geterror(),
                    "); is the disk full?");
  }
};

GifWriter::GifWriter(const fs::path& path, double frames_per_second)
    : state_(new State{path, OutputFile(path), nullptr, {}, 0}) {
  state_->output = OIIO::ImageOutput::create(state_->file.temporary_path().string());
  state_->Require(state_->output != nullptr);
  state_->spec = OIIO::ImageSpec(0, 0, 3, OIIO::TypeDesc::UINT8);
  state_->spec.attribute("gif:FPS", static_cast<float>(frames_per_second));
  state_->spec.attribute("FramesPerSecond", static_cast<float>(frames_per_second));
  state_->spec.attribute("gif:LoopCount", 0);
}

GifWriter::~GifWriter() = default;

void GifWriter::Add(const Image8& image) {
  CHECK_EQ(image.data.size(), size_t{3} * image.width * image.height);
  OIIO::ImageSpec spec = state_->spec;
  spec.width = spec.full_width = image.width;
  spec.height = spec.full_height = image.height;
  const auto mode =
      state_->num_images++ == 0 ? OIIO::ImageOutput::Create : OIIO::ImageOutput::AppendSubimage;
  state_->Require(state_->output->open(state_->file.temporary_path().string(), spec, mode) &&
                  state_->output->write_image(spec.format, image.data.data()));
}

void GifWriter::Finish() {
  CHECK_GT(state_->num_images, 0);
  state_->Require(state_->output->close());
  state_->file.Commit();
}

LabelImage ReadForeground(const fs::path& path) {
  const std::unique_ptr<OIIO::ImageInput> input = OIIO::ImageInput::open(path.string());
  if (input == nullptr) {
    throw UserError(
        path.string(), ": this mask cannot be read (", OIIO::geterror(), "); give a PNG.");
  }
  const OIIO::ImageSpec& spec = input->spec();
  LabelImage mask{spec.width, spec.height, {}};
  std::vector<uint8_t> pixels(size_t{1} * spec.width * spec.height * spec.nchannels);
  if (!input->read_image(0, 0, 0, spec.nchannels, OIIO::TypeDesc::UINT8, pixels.data())) {
    throw UserError(path.string(),
                    ": this mask cannot be read to its end (",
                    input->geterror(),
                    "); is the copy complete?");
  }
  for (size_t i = 0; i < pixels.size(); i += spec.nchannels) mask.data.push_back(pixels[i] > 128);
  return mask;
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
