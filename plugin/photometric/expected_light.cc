// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/photometric/expected_light.h"

#include "plugin/colmap/camera_rays.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include <Eigen/Geometry>
#include <glog/logging.h>

namespace semfoam {
namespace {

constexpr int kFewestOfLens = 4;
constexpr size_t kNearest = 3;
constexpr double kSquaredReach = 1e-4;
// Photos that are predicted from the others; each looks at all of them.
constexpr size_t kMostPredicted = 1000;
constexpr size_t kNone = std::numeric_limits<size_t>::max();

constexpr int kGains = 3;
constexpr int kFalloff = kGains + 3 * kNumShadingTerms;

}  // namespace

ExpectedLights::Terms ExpectedLights::TermsOf(const PhotoLight& light) {
  Terms terms;
  terms.head<kGains>() = light.gain.array().log();
  for (int c = 0; c < 3; ++c) {
    terms.segment<kNumShadingTerms>(kGains + c * kNumShadingTerms) = light.shading.row(c);
  }
  terms.segment<2>(kFalloff) = light.falloff;
  terms.tail<9>() = (light.tone - Eigen::Matrix3d::Identity()).reshaped();
  return terms;
}

PhotoLight ExpectedLights::LightOf(const Terms& terms) {
  PhotoLight light;
  light.gain = terms.head<kGains>().array().exp();
  for (int c = 0; c < 3; ++c) {
    light.shading.row(c) = terms.segment<kNumShadingTerms>(kGains + c * kNumShadingTerms);
  }
  light.falloff = terms.segment<2>(kFalloff);
  light.tone += terms.tail<9>().reshaped(3, 3);
  return light;
}

ExpectedLights::Place ExpectedLights::PlaceOf(const Pose& cam_from_world) {
  return {cam_from_world.UnitRotation().toRotationMatrix(), cam_from_world.Center()};
}

ExpectedLights::ExpectedLights(const std::vector<PhotoRecord>& photos,
                               const std::vector<int>& lenses,
                               std::vector<PhotoLight> lights)
    : lights_(std::move(lights)) {
  CHECK_EQ(lenses.size(), photos.size());
  CHECK_EQ(lights_.size(), photos.size());
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const PhotoRecord& photo : photos) {
    places_.push_back(PlaceOf(PoseOf(photo)));
    is_held_out_.push_back(photo.held_out ? 1 : 0);
    if (photo.held_out) continue;
    trained_places_.push_back(places_.back());
    mean += places_.back().center;
  }
  const auto count = static_cast<double>(std::max<size_t>(1, trained_places_.size()));
  double squares = 0;
  for (const Place& place : trained_places_) {
    squares += (place.center - mean / count).squaredNorm() / count;
  }
  // Cameras that turn about one place differ by their rotations alone.
  if (squares > 0) extent_ = std::sqrt(squares);
  FindLenses(lenses);
  FindTrust();
}

void ExpectedLights::FindLenses(const std::vector<int>& lenses) {
  struct Sum {
    Terms terms = Terms::Zero();
    int count = 0;
    void Add(const Sum& other) {
      terms += other.terms;
      count += other.count;
    }
    Terms Mean() const { return terms / std::max(1, count); }
  };
  std::map<int, Sum> sums;
  for (size_t i = 0; i < lenses.size(); ++i) {
    Sum& sum = sums[lenses[i]];
    if (is_held_out_[i] == 0) sum.Add({TermsOf(lights_[i]), 1});
  }
  Sum all, of_small;
  for (const auto& [lens, sum] : sums) {
    all.Add(sum);
    if (sum.count < kFewestOfLens) of_small.Add(sum);
  }
  of_any_lens_ = all.Mean();
  const Terms of_small_lens = of_small.count >= kFewestOfLens ? of_small.Mean() : of_any_lens_;
  for (size_t i = 0; i < lenses.size(); ++i) {
    const Sum& sum = sums.at(lenses[i]);
    of_lens_.push_back(sum.count >= kFewestOfLens ? sum.Mean() : of_small_lens);
    if (is_held_out_[i] == 0) residuals_.push_back(TermsOf(lights_[i]) - of_lens_.back());
  }
}

void ExpectedLights::FindTrust() {
  // Places in a photo of 4:3.
  constexpr int kEdge = 5;
  std::array<Eigen::Matrix<double, kNumShadingTerms, 1>, kEdge * kEdge> grid;
  for (int i = 0; i < kEdge * kEdge; ++i) {
    const Eigen::Vector2d pixel(i % kEdge + 0.5, i / kEdge + 0.5);
    grid[i] =
        ShadingTerms(PlaceInPhoto(pixel.cwiseProduct(Eigen::Vector2d(4, 3)), 4 * kEdge, 3 * kEdge));
  }
  // Falloff and tone are the same in all photos of a lens, and take no part.
  const auto at = [](const Terms& terms, int c, const auto& shading) {
    return terms[c] + terms.segment<kNumShadingTerms>(kGains + c * kNumShadingTerms).dot(shading);
  };
  double of_both = 0, of_predicted = 0;
  const size_t step = residuals_.size() / kMostPredicted + 1;
  for (size_t i = 0; i < residuals_.size(); i += step) {
    const Terms predicted = Nearest(trained_places_[i], i);
    for (const auto& shading : grid) {
      for (int c = 0; c < 3; ++c) {
        const double value = at(predicted, c, shading);
        of_both += value * at(residuals_[i], c, shading);
        of_predicted += value * value;
      }
    }
  }
  trust_ = of_predicted > 0 ? std::clamp(of_both / of_predicted, 0.0, 1.0) : 0;
}

double ExpectedLights::Distance(const Place& a, const Place& b) const {
  const double cosine = 0.5 * ((a.rotation.transpose() * b.rotation).trace() - 1);
  return (a.center - b.center).norm() / extent_ + std::acos(std::clamp(cosine, -1.0, 1.0));
}

ExpectedLights::Terms ExpectedLights::Nearest(const Place& place, size_t but) const {
  std::array<std::pair<double, size_t>, kNearest> nearest;
  nearest.fill({std::numeric_limits<double>::infinity(), kNone});
  for (size_t i = 0; i < trained_places_.size(); ++i) {
    const std::pair<double, size_t> candidate(Distance(place, trained_places_[i]), i);
    if (i == but || candidate >= nearest.back()) continue;
    nearest.back() = candidate;
    std::sort(nearest.begin(), nearest.end());
  }
  Terms sum = Terms::Zero();
  double weights = 0;
  for (const auto& [distance, i] : nearest) {
    if (i == kNone) continue;
    const double weight = 1 / (distance * distance + kSquaredReach);
    sum += weight * residuals_[i];
    weights += weight;
  }
  return weights > 0 ? Terms(sum / weights) : sum;
}

PhotoLight ExpectedLights::OfPhoto(size_t photo) const {
  if (is_held_out_.at(photo) == 0) return lights_[photo];
  return LightOf(of_lens_[photo] + trust_ * Nearest(places_[photo], kNone));
}

PhotoLight ExpectedLights::At(const Pose& cam_from_world) const {
  return LightOf(of_any_lens_ + trust_ * Nearest(PlaceOf(cam_from_world), kNone));
}

}  // namespace semfoam
