// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/stereo/plane_sweep.h"

#include "plugin/stereo/plane_warp.h"
#include "plugin/stereo/window_correlation.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Core>
#include <glog/logging.h>

namespace semfoam {
namespace {

constexpr float kLeastScore = 0.7f;
constexpr float kLeastLead = 0.05f;
// Pixels in a partner over which the score of one surface falls off.
constexpr double kPeakWidth = 2;
constexpr size_t kMostMatched = 4;

// Returns how many planes around the best one belong to its peak.
int PeakPlanes(const StereoView& view,
               const std::vector<const StereoView*>& partners,
               double spacing) {
  double widest = 0;
  for (const StereoView* partner : partners) {
    // The pixels by which a point in the middle moves from plane to plane, about.
    const double baseline = (partner->origin - view.origin).norm();
    widest = std::max(widest, partner->focal.x() * baseline * spacing);
  }
  return std::clamp(
      static_cast<int>(std::ceil(kPeakWidth / std::max(widest, 1e-9))), 2, kNumPlanes / 4);
}

// Returns the position of the maximum of the parabola through (-1, a), (0, b), (1, c), of which b
// is the largest.
float ParabolaPeak(float a, float b, float c) {
  const float curvature = a - 2 * b + c;
  return curvature < 0 ? std::clamp(0.5f * (a - c) / curvature, -0.5f, 0.5f) : 0;
}

}  // namespace

DepthMap SweepPlanes(const StereoView& view,
                     const std::vector<const StereoView*>& partners,
                     const InverseDepths& depths) {
  CHECK(!partners.empty() && partners.size() <= kMostMatched);
  const size_t num_pixels = view.NumPixels();
  DepthMap map;
  map.inverse.assign(num_pixels, 0.f);
  if (depths.IsEmpty() || partners.size() < 2 || view.width <= 2 * kWindowRadius ||
      view.height <= 2 * kWindowRadius) {
    return map;
  }
  const double spacing = (depths.near - depths.far) / (kNumPlanes - 1);
  std::vector<PlaneWarp> warps;
  warps.reserve(partners.size());
  for (const StereoView* partner : partners) warps.emplace_back(view, *partner);

  const WindowCorrelation correlation(view);
  WindowCorrelation::Buffers buffers;
  ImageValues warped(num_pixels), scores(num_pixels), best(num_pixels), second(num_pixels);
  // [kNumPlanes][pixels]
  ImageValues volume(kNumPlanes * num_pixels);
  for (int plane = 0; plane < kNumPlanes; ++plane) {
    const auto inverse_depth = static_cast<float>(depths.far + plane * spacing);
    std::fill(best.begin(), best.end(), kNoCorrelation);
    std::fill(second.begin(), second.end(), kNoCorrelation);
    for (size_t k = 0; k < partners.size(); ++k) {
      warps[k].Warp({0, 0, inverse_depth}, view.width, view.height, *partners[k], &warped);
      correlation.Correlate(warped, &buffers, &scores);
      for (size_t i = 0; i < num_pixels; ++i) {
        second[i] = std::max(second[i], std::min(best[i], scores[i]));
        best[i] = std::max(best[i], scores[i]);
      }
    }
    float* out = &volume[plane * num_pixels];
    for (size_t i = 0; i < num_pixels; ++i) out[i] = 0.5f * (best[i] + second[i]);
  }

  const int peak = PeakPlanes(view, partners, spacing);
  float of_pixel[kNumPlanes];
  for (size_t i = 0; i < num_pixels; ++i) {
    for (int plane = 0; plane < kNumPlanes; ++plane)
      of_pixel[plane] = volume[plane * num_pixels + i];
    const int winner =
        static_cast<int>(std::max_element(of_pixel, of_pixel + kNumPlanes) - of_pixel);
    const float score = of_pixel[winner];
    if (!(score >= kLeastScore) || winner == 0 || winner == kNumPlanes - 1) continue;
    if (correlation.IsFlat(static_cast<int>(i % view.width), static_cast<int>(i / view.width))) {
      continue;
    }
    float other = kNoCorrelation;
    for (int plane = 0; plane < kNumPlanes; ++plane) {
      if (std::abs(plane - winner) > peak) other = std::max(other, of_pixel[plane]);
    }
    if (score - other < kLeastLead) continue;
    const float offset = ParabolaPeak(of_pixel[winner - 1], score, of_pixel[winner + 1]);
    map.inverse[i] = static_cast<float>(depths.far + (winner + offset) * spacing);
  }
  return map;
}

int64_t SweepPlanesBytes() {
  constexpr int64_t kOtherImages = 12;
  return (kNumPlanes + kOtherImages) * int64_t{sizeof(float)} * kStereoPixels * 102 / 100;
}

}  // namespace semfoam
