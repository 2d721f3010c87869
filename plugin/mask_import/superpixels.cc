// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask_import/superpixels.h"

#include "foam/image/srgb.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include <glog/logging.h>

namespace semfoam {
namespace {

using Colors = std::vector<Eigen::Vector3f>;

// Of distances in the picture against those of colours, in units of CIELAB; and how often centres
// are moved, after which hardly any pixel changes.
constexpr float kCompactness = 12;
constexpr int kRounds = 6;
// Of the smoothing: pixels on each side, and a difference of colours that is no longer noise.
constexpr int kSmoothingRadius = 2;
constexpr float kSmoothingColor = 8;

float LabRoot(float t) {
  constexpr float kLinearBelow = 216.f / 24389, kSlope = 24389.f / 27;
  return t > kLinearBelow ? std::cbrt(t) : (kSlope * t + 16) / 116;
}

// CIELAB of the colours, by the matrix of sRGB and its white (IEC 61966-2-1).
Colors LabOf(const Image8& photo) {
  std::array<float, 256> linear;
  for (int v = 0; v < 256; ++v) linear[v] = LinearFromDisplay(static_cast<float>(v) / 255);
  Eigen::Matrix3f xyz;
  xyz << 0.4124564f, 0.3575761f, 0.1804375f, 0.2126729f, 0.7151522f, 0.0721750f, 0.0193339f,
      0.1191920f, 0.9503041f;
  const Eigen::Vector3f white = xyz * Eigen::Vector3f::Ones();
  Colors lab(photo.data.size() / 3);
  for (size_t i = 0; i < lab.size(); ++i) {
    const uint8_t* rgb = &photo.data[3 * i];
    const Eigen::Vector3f share =
        (xyz * Eigen::Vector3f(linear[rgb[0]], linear[rgb[1]], linear[rgb[2]]))
            .cwiseQuotient(white);
    const float x = LabRoot(share.x()), y = LabRoot(share.y()), z = LabRoot(share.z());
    lab[i] = {116 * y - 16, 500 * (x - y), 200 * (y - z)};
  }
  return lab;
}

// A bilateral filter.
Colors Smoothed(const Colors& lab, int width, int height) {
  Colors smooth(lab.size());
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const Eigen::Vector3f& centre = lab[static_cast<size_t>(y) * width + x];
      Eigen::Vector3f sum = Eigen::Vector3f::Zero();
      float weight = 0;
      for (int v = std::max(0, y - kSmoothingRadius);
           v <= std::min(height - 1, y + kSmoothingRadius);
           ++v) {
        for (int u = std::max(0, x - kSmoothingRadius);
             u <= std::min(width - 1, x + kSmoothingRadius);
             ++u) {
          const Eigen::Vector3f& other = lab[static_cast<size_t>(v) * width + u];
          const float w =
              std::exp(-(other - centre).squaredNorm() / (2 * kSmoothingColor * kSmoothingColor));
          sum += w * other;
          weight += w;
        }
      }
      smooth[static_cast<size_t>(y) * width + x] = sum / weight;
    }
  }
  return smooth;
}

// A centre of SLIC, or the sums that its next place comes from.
struct Centre {
  Eigen::Vector2f place = Eigen::Vector2f::Zero();
  Eigen::Vector3f color = Eigen::Vector3f::Zero();
  float count = 0;
};

// Returns [pixels] the nearest of the centres, which begin on a grid. A pixel compares those that
// began in its own place of the grid and in the eight around it.
std::vector<int32_t> NearestCentres(const Colors& lab, int width, int height, int spacing) {
  const int columns = std::max(1, width / spacing), rows = std::max(1, height / spacing);
  std::vector<Centre> centres(static_cast<size_t>(columns) * rows);
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      const int x = (2 * c + 1) * width / (2 * columns), y = (2 * r + 1) * height / (2 * rows);
      centres[static_cast<size_t>(r) * columns + c] = {
          {static_cast<float>(x), static_cast<float>(y)},
          lab[static_cast<size_t>(y) * width + x],
          1};
    }
  }
  const float scale = kCompactness / static_cast<float>(spacing);
  std::vector<int32_t> nearest(lab.size());
  for (int round = 0; round < kRounds; ++round) {
    std::vector<Centre> sums(centres.size());
    for (int y = 0; y < height; ++y) {
      const int row = y * rows / height;
      for (int x = 0; x < width; ++x) {
        const int column = x * columns / width;
        const size_t pixel = static_cast<size_t>(y) * width + x;
        const Eigen::Vector2f place(static_cast<float>(x), static_cast<float>(y));
        float least = std::numeric_limits<float>::infinity();
        for (int r = std::max(0, row - 1); r <= std::min(rows - 1, row + 1); ++r) {
          for (int c = std::max(0, column - 1); c <= std::min(columns - 1, column + 1); ++c) {
            const int32_t k = r * columns + c;
            const float distance = (centres[k].color - lab[pixel]).squaredNorm() +
                                   scale * scale * (centres[k].place - place).squaredNorm();
            if (distance >= least) continue;
            least = distance;
            nearest[pixel] = k;
          }
        }
        Centre& sum = sums[nearest[pixel]];
        sum.place += place;
        sum.color += lab[pixel];
        sum.count += 1;
      }
    }
    for (size_t k = 0; k < sums.size(); ++k) {
      if (sums[k].count == 0) continue;
      centres[k] = {sums[k].place / sums[k].count, sums[k].color / sums[k].count, 1};
    }
  }
  return nearest;
}

// Numbers the connected pieces of equal values.
void NumberPieces(const std::vector<int32_t>& values, Superpixels* result) {
  const int width = result->width, height = result->height;
  result->of_pixel.assign(values.size(), -1);
  std::vector<int32_t> stack;
  for (size_t first = 0; first < values.size(); ++first) {
    if (result->of_pixel[first] >= 0) continue;
    const auto piece = static_cast<int32_t>(result->areas.size());
    int32_t area = 0;
    const auto visit = [&](int32_t pixel) {
      if (result->of_pixel[pixel] >= 0 || values[pixel] != values[first]) return;
      result->of_pixel[pixel] = piece;
      ++area;
      stack.push_back(pixel);
    };
    visit(static_cast<int32_t>(first));
    while (!stack.empty()) {
      const int32_t pixel = stack.back(), x = pixel % width, y = pixel / width;
      stack.pop_back();
      if (x > 0) visit(pixel - 1);
      if (x + 1 < width) visit(pixel + 1);
      if (y > 0) visit(pixel - width);
      if (y + 1 < height) visit(pixel + width);
    }
    result->areas.push_back(area);
  }
}

void MeasureBorders(Superpixels* result) {
  std::map<std::pair<int32_t, int32_t>, int32_t> lengths;
  const auto add = [&](int32_t a, int32_t b) {
    if (a != b) ++lengths[std::minmax(a, b)];
  };
  for (int y = 0; y < result->height; ++y) {
    for (int x = 0; x < result->width; ++x) {
      const int32_t* pixel = &result->of_pixel[static_cast<size_t>(y) * result->width + x];
      if (x + 1 < result->width) add(pixel[0], pixel[1]);
      if (y + 1 < result->height) add(pixel[0], pixel[result->width]);
    }
  }
  for (const auto& [pair, length] : lengths) {
    result->borders.push_back({pair.first, pair.second, length});
  }
}

}  // namespace

Superpixels DivideIntoSuperpixels(const Image8& photo, int spacing) {
  CHECK_GT(spacing, 0);
  CHECK(photo.width > 0 && photo.height > 0);
  Superpixels result;
  result.width = photo.width;
  result.height = photo.height;
  const Colors lab = Smoothed(LabOf(photo), photo.width, photo.height);
  NumberPieces(NearestCentres(lab, photo.width, photo.height, spacing), &result);
  result.colors.assign(result.areas.size(), Eigen::Vector3f::Zero());
  for (size_t i = 0; i < lab.size(); ++i) result.colors[result.of_pixel[i]] += lab[i];
  for (size_t k = 0; k < result.areas.size(); ++k) {
    result.colors[k] /= static_cast<float>(result.areas[k]);
  }
  MeasureBorders(&result);
  return result;
}

}  // namespace semfoam
