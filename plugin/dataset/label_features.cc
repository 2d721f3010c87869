// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/dataset/label_features.h"

#include <cmath>

#include <glog/logging.h>

namespace semfoam {
namespace {

// A mean of unit vectors that is shorter has no direction but rounding.
constexpr double kLeastLength = 1e-6;

template <typename Vector>
double LengthOf(const Vector& vector) {
  double squares = 0;
  for (const double x : vector) squares += x * x;
  return std::sqrt(squares);
}

}  // namespace

void LabelFeatureMean::Add(int64_t pixels,
                           const RegionFeatures& region,
                           std::span<const float> embedding) {
  CHECK_GT(pixels, 0);
  const auto weight = static_cast<double>(pixels);
  if (!region.class_name.empty()) {
    score_of_class_[region.class_name] += weight * region.score.value_or(1);
    class_pixels_ += weight;
  } else if (region.score) {
    score_ += weight * *region.score;
    score_pixels_ += weight;
  }
  if (embedding.empty()) return;
  embedding_.resize(embedding.size(), 0.0);
  const double scale = weight / LengthOf(embedding);
  CHECK(std::isfinite(scale));
  for (size_t i = 0; i < embedding.size(); ++i) embedding_[i] += scale * double{embedding[i]};
  embedding_pixels_ += weight;
}

LabelFeatures LabelFeatureMean::Mean() const {
  LabelFeatures mean;
  for (const auto& [name, score] : score_of_class_) {
    if (mean.score && score / class_pixels_ <= *mean.score) continue;
    mean.class_name = name;
    mean.score = score / class_pixels_;
  }
  if (!mean.score && score_pixels_ > 0) mean.score = score_ / score_pixels_;
  const double length = LengthOf(embedding_);
  if (length > kLeastLength * embedding_pixels_) {
    for (const double x : embedding_) mean.embedding.push_back(static_cast<float>(x / length));
  }
  return mean;
}

}  // namespace semfoam
