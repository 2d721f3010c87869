// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/images/view_images.h"

#include "export/scene/names.h"
#include "foam/util/parallel.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <map>

#include <glog/logging.h>

namespace semfoam {

void PutInLight(const PhotoLight& light, RenderedView* view) {
  constexpr int64_t kRowsOfBlock = 16;
  ParallelForBlocks(view->height, kRowsOfBlock, [&](int64_t begin, int64_t end) {
    for (int64_t y = begin; y < end; ++y) {
      for (int x = 0; x < view->width; ++x) {
        const Eigen::Vector2d place =
            PlaceInPhoto({x + 0.5, static_cast<double>(y) + 0.5}, view->width, view->height);
        Eigen::Vector3f& color = view->color[y * view->width + x];
        color = PhotographedColor(color, light, place);
      }
    }
  });
}

Image8 ColorImage(const RenderedView& view) {
  Image8 image{view.width, view.height, {}};
  image.data.reserve(3 * view.color.size());
  for (const Eigen::Vector3f& color : view.color) {
    for (int channel = 0; channel < 3; ++channel) {
      const float value = std::clamp(color[channel], 0.0f, 1.0f);
      image.data.push_back(static_cast<uint8_t>(std::lround(255 * value)));
    }
  }
  return image;
}

LabelImage LabelIdImage(const RenderedView& view, const std::vector<Label>& labels) {
  LabelImage ids{view.width, view.height, {}};
  ids.data.reserve(view.class_index.size());
  for (const ClassIndex c : view.class_index) ids.data.push_back(Value(LabelIdOf(labels, c)));
  return ids;
}

std::vector<float> DepthImage(const RenderedView& view,
                              const CameraRays& rays,
                              const Eigen::Vector3d& z_axis,
                              double scale) {
  CHECK_EQ(view.distance.size(), rays.directions.size());
  std::vector<float> depth(view.distance.size(), 0);
  for (size_t i = 0; i < depth.size(); ++i) {
    if (view.distance[i] <= 0) continue;
    const double along_z = rays.directions[i].cast<double>().dot(z_axis);
    depth[i] = static_cast<float>(scale * view.distance[i] * along_z);
  }
  return depth;
}

Image8 PaletteImage(const LabelImage& ids) {
  Image8 image{ids.width, ids.height, {}};
  image.data.reserve(3 * ids.data.size());
  std::map<int32_t, std::array<uint8_t, 3>> palette;
  for (const int32_t id : ids.data) {
    const auto [entry, is_new] = palette.try_emplace(id);
    if (is_new) entry->second = LabelColor(LabelId{id});
    image.data.insert(image.data.end(), entry->second.begin(), entry->second.end());
  }
  return image;
}

Image8 ErrorImage(const Image8& render, const Image8& photo) {
  CHECK_EQ(render.width, photo.width);
  CHECK_EQ(render.height, photo.height);
  constexpr std::array<std::array<double, 3>, 5> kColors = {
      {{0, 0, 0}, {80, 15, 110}, {190, 55, 85}, {250, 150, 40}, {255, 255, 255}}};
  Image8 image{render.width, render.height, {}};
  image.data.reserve(render.data.size());
  for (size_t i = 0; i < render.data.size(); i += 3) {
    int sum = 0;
    for (size_t c = i; c < i + 3; ++c) sum += std::abs(render.data[c] - photo.data[c]);
    const double place =
        std::min(sum / (3.0 * kWhiteError), 1.0) * static_cast<double>(kColors.size() - 1);
    const size_t below = std::min(static_cast<size_t>(place), kColors.size() - 2);
    const double share = place - static_cast<double>(below);
    for (int c = 0; c < 3; ++c) {
      const double value = (1 - share) * kColors[below][c] + share * kColors[below + 1][c];
      image.data.push_back(static_cast<uint8_t>(std::lround(value)));
    }
  }
  return image;
}

Image8 SideBySide(const std::vector<Image8>& images) {
  CHECK(!images.empty());
  Image8 joined{0, images.front().height, {}};
  for (const Image8& image : images) {
    CHECK_EQ(image.height, joined.height);
    joined.width += image.width;
  }
  joined.data.reserve(size_t{3} * joined.width * joined.height);
  for (int y = 0; y < joined.height; ++y) {
    for (const Image8& image : images) {
      const auto row = image.data.begin() + int64_t{3} * y * image.width;
      joined.data.insert(joined.data.end(), row, row + int64_t{3} * image.width);
    }
  }
  return joined;
}

Image8 ResizeNearest(const Image8& image, int width, int height) {
  Image8 resized{width, height, {}};
  resized.data.resize(size_t{3} * width * height);
  for (int y = 0; y < height; ++y) {
    const int64_t from_y = int64_t{y} * image.height / height;
    for (int x = 0; x < width; ++x) {
      const int64_t from_x = int64_t{x} * image.width / width;
      std::memcpy(&resized.data[3 * (size_t{1} * y * width + x)],
                  &image.data[3 * (from_y * image.width + from_x)],
                  3);
    }
  }
  return resized;
}

}  // namespace semfoam
