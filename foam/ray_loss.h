// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/classifier.h"
#include "foam/compositing.h"
#include "foam/training_views.h"

#include <cmath>
#include <cstdint>

namespace semfoam {

// Weights of the terms of one ray's loss.
struct RayLossWeights {
  double color = 1;
  double opacity = 0.1;    // pulls opacity to 1: photos show something everywhere
  double quantile = 1e-4;  // pulls the two depth quantiles together: matter in thin layers
  double identity = 1;     // cross-entropy, divided by ln(max(K, 2))
};

// What a ray should have shown.
struct RayTarget {
  float color[3];
  int32_t class_index = kUnlabelled;
};

// The terms of one ray's loss, unweighted.
template <typename T>
struct RayLossTerms {
  T color = T(
      0);  // mean over channels of SmoothL1 (beta 1) between the colour over white and the photo's
  T opacity = T(0);   // (1 - opacity)^2
  T quantile = T(0);  // |depth_0 - depth_1|, 0 unless the ray reaches both
  T identity =
      T(0);  // cross-entropy of the rendered identity's class / ln(max(K, 2)); 0 where unlabelled

  T Total(const RayLossWeights& w) const {
    return T(w.color) * color + T(w.opacity) * opacity + T(w.quantile) * quantile +
           T(w.identity) * identity;
  }
};

// The classifier as the loss sees it. num_classes = 0: no semantics.
template <typename T>
struct ClassifierView {
  int num_classes = 0;
  const T* weight = nullptr;  // [num_classes][kIdentityDim]
  const T* bias = nullptr;    // [num_classes]
};

// Log of the sum of exp(logits), shifted by the largest one, so that logits of 1e4 are no trouble.
template <typename T>
T LogSumExp(const T* logits, int count) {
  using std::exp;
  using std::log;
  T largest = logits[0];
  for (int k = 1; k < count; ++k) {
    if (logits[k] > largest) largest = logits[k];
  }
  T sum = T(0);
  for (int k = 0; k < count; ++k) sum += exp(logits[k] - largest);
  return largest + log(sum);
}

inline double ClassNormalization(int num_classes) { return std::log(std::max(num_classes, 2)); }

// `logits` is scratch of num_classes values; afterwards it holds the ray's class logits if the ray
// is labelled.
template <typename T>
RayLossTerms<T> RayLoss(const RayComposite<T>& ray,
                        const RayTarget& target,
                        const ClassifierView<T>& classifier,
                        T* logits) {
  using std::abs;
  RayLossTerms<T> loss;
  const T transmittance = ray.Transmittance();
  for (int c = 0; c < 3; ++c) {
    const T difference = ray.color[c] + transmittance - T(target.color[c]);  // over white
    loss.color +=
        (abs(difference) < T(1) ? T(0.5) * difference * difference : abs(difference) - T(0.5)) /
        T(3);
  }
  loss.opacity = transmittance * transmittance;
  if (ray.quantile_piece[0] >= 0 && ray.quantile_piece[1] >= 0) {
    loss.quantile = abs(ray.quantile_depth[0] - ray.quantile_depth[1]);
  }
  if (classifier.num_classes > 0 && target.class_index != kUnlabelled) {
    ClassLogits(classifier.weight, classifier.bias, classifier.num_classes, ray.identity, logits);
    loss.identity = (LogSumExp(logits, classifier.num_classes) - logits[target.class_index]) /
                    T(ClassNormalization(classifier.num_classes));
  }
  return loss;
}

// The hand-written derivative of RayLoss(...).Total(weights) by what the ray gathered. `logits`
// must be as RayLoss left it; it is overwritten with the derivative of the loss by the logits.
// Kinks: at equal quantile depths the derivative is 0.
template <typename T>
RayGradient<T> RayLossGradient(const RayComposite<T>& ray,
                               const RayTarget& target,
                               const ClassifierView<T>& classifier,
                               const RayLossWeights& weights,
                               T* logits) {
  using std::exp;
  RayGradient<T> gradient;
  const T transmittance = ray.Transmittance();
  for (int c = 0; c < 3; ++c) {
    T difference = ray.color[c] + transmittance - T(target.color[c]);
    if (difference > T(1)) difference = T(1);
    if (difference < T(-1)) difference = T(-1);
    gradient.color[c] = T(weights.color) * difference / T(3);
    gradient.opacity -= gradient.color[c];  // the white background gives way as opacity grows
  }
  gradient.opacity -= T(2 * weights.opacity) * transmittance;
  if (ray.quantile_piece[0] >= 0 && ray.quantile_piece[1] >= 0) {
    const T spread = ray.quantile_depth[0] - ray.quantile_depth[1];
    const T sign = T(spread > T(0)) - T(spread < T(0));
    gradient.quantile_depth[0] = T(weights.quantile) * sign;
    gradient.quantile_depth[1] = -gradient.quantile_depth[0];
  }
  if (classifier.num_classes > 0 && target.class_index != kUnlabelled) {
    const int count = classifier.num_classes;
    const T scale = T(weights.identity / ClassNormalization(count));
    const T log_sum = LogSumExp(logits, count);
    for (int k = 0; k < count; ++k) {
      logits[k] = scale * (exp(logits[k] - log_sum) - T(k == target.class_index));
      for (int c = 0; c < kIdentityDim; ++c) {
        gradient.identity[c] += logits[k] * classifier.weight[k * kIdentityDim + c];
      }
    }
  }
  return gradient;
}

}  // namespace semfoam
