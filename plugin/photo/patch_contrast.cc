// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/photo/patch_contrast.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace semfoam {
namespace {

// Added to the mean display value, so that dark patches do not have the contrast of their noise.
constexpr double kDarkest = 0.02;
// Display values from here on are cut off: what is too bright for the photo has no contrast.
constexpr uint8_t kCutOff = 250;

// Returns whether a channel is cut off within `reach` pixels, both ways, of a place inside.
bool IsCutOff(const Image8& photo, const Eigen::Vector2d& place, double reach) {
  const auto first = [&](double at) { return static_cast<int>(at - reach); };
  const auto end = [&](double at, int size) {
    return std::min(size, static_cast<int>(std::ceil(at + reach)));
  };
  for (int y = first(place.y()); y < end(place.y(), photo.height); ++y) {
    const uint8_t* const row = &photo.data[3 * static_cast<size_t>(y) * photo.width];
    const auto is_cut_off = [](uint8_t value) { return value >= kCutOff; };
    if (std::any_of(row + 3 * first(place.x()), row + 3 * end(place.x(), photo.width), is_cut_off))
      return true;
  }
  return false;
}

// Returns the sum of the channels of a pixel.
int BrightnessAt(const Image8& photo, int x, int y) {
  const uint8_t* const rgb = &photo.data[3 * (static_cast<size_t>(y) * photo.width + x)];
  return rgb[0] + rgb[1] + rgb[2];
}

// Interpolates between the centres of four pixels. The place must lie between centres.
double BrightnessAt(const Image8& photo, double x, double y) {
  const double left = x - 0.5, top = y - 0.5;
  const int column = static_cast<int>(left), row = static_cast<int>(top);
  const double u = left - column, v = top - row;
  const auto across = [&](int at) {
    return (1 - u) * BrightnessAt(photo, column, at) + u * BrightnessAt(photo, column + 1, at);
  };
  return ((1 - v) * across(row) + v * across(row + 1)) / (3 * 255);
}

}  // namespace

std::optional<float> PatchContrast(const Image8& photo,
                                   const Eigen::Vector2d& place,
                                   double spacing) {
  if (!(spacing >= 1 && spacing <= kLargestSampleSpacing)) return std::nullopt;
  const double reach = 0.5 * kPatchSamples * spacing + 0.5;
  const bool inside = place.x() >= reach && place.y() >= reach && place.x() < photo.width - reach &&
                      place.y() < photo.height - reach;
  if (!inside) return std::nullopt;  // not numbers, too
  if (IsCutOff(photo, place, reach)) return std::nullopt;
  const int parts = static_cast<int>(std::lround(spacing));
  double samples[kPatchSamples][kPatchSamples];
  double mean = 0;
  for (int row = 0; row < kPatchSamples; ++row) {
    for (int column = 0; column < kPatchSamples; ++column) {
      double sum = 0;
      for (int i = 0; i < parts * parts; ++i) {
        const auto offset = [&](int sample, int part) {
          return spacing * (sample - kPatchSamples / 2 + (part + 0.5) / parts - 0.5);
        };
        sum += BrightnessAt(
            photo, place.x() + offset(column, i % parts), place.y() + offset(row, i / parts));
      }
      samples[row][column] = sum / (parts * parts);
      mean += samples[row][column] / (kPatchSamples * kPatchSamples);
    }
  }
  double squares = 0;
  const auto add = [&](double difference) { squares += difference * difference; };
  for (int i = 0; i < kPatchSamples; ++i) {
    for (int k = 0; k + 1 < kPatchSamples; ++k) {
      add(samples[i][k + 1] - samples[i][k]);
      add(samples[k + 1][i] - samples[k][i]);
    }
  }
  constexpr int kPairs = 2 * kPatchSamples * (kPatchSamples - 1);
  return static_cast<float>(squares / kPairs / ((mean + kDarkest) * (mean + kDarkest)));
}

}  // namespace semfoam
