// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/model/classifier.h"
#include "foam/render/compositing.h"
#include "foam/util/host_device.h"
#include "foam/util/ids.h"

#include <cmath>
#include <cstdint>

namespace semfoam {

// Weights of the terms of one ray's loss.
struct RayLossWeights {
  double color = 1;
  // Pulls the opacity to 1, because every pixel of a photo shows a surface or a background.
  double opacity = 0.1;
  // Pulls the two depth quantiles together, so that surfaces are thin.
  double quantile = 1e-4;
  // Of the cross-entropy, which is divided by ln(max(K, 2)).
  double identity = 1;
  // Share of the derivative of the identity term that flows through the rendering weights into
  // densities and positions. 0, as in the paper: it flows into identities and the classifier only.
  double identity_to_density = 0;
  // Pulls the depth quantiles to the distance that other photos tell (RayTarget::distance).
  double distance = 0;
};

// Targets of a ray.
struct RayTarget {
  // Display values, in [0, 1].
  float color[3];
  int32_t class_index = Value(kUnlabelled);
  // Distance along the ray to the surface that other photos see there; 0: not known.
  float distance = 0;
  // Bit c: channel c of the colour is at least as bright as `color` says, for the photo is
  // saturated.
  uint32_t at_least = 0;
};

// Returns by how much a channel that is seen differs from the target; 0 where it is brighter and
// may be.
template <typename T>
SEMFOAM_HOST_DEVICE T ColorDifference(const T& seen, const RayTarget& target, int channel) {
  const T difference = seen - T(target.color[channel]);
  if ((target.at_least >> channel & 1) != 0 && difference > T(0)) return T(0);
  return difference;
}

// The terms of one ray's loss, unweighted; or sums of them.
template <typename T>
struct RayLossTerms {
  // ColorLoss of the difference between the colour over white and the photo's (ColorDifference).
  T color = T(0);
  // (1 - opacity)^2
  T opacity = T(0);
  // |depth_0 - depth_1|; 0 unless the ray reaches both quantiles.
  T quantile = T(0);
  // Cross-entropy of the class of the rendered identity / ln(max(K, 2)); 0 where unlabelled.
  T identity = T(0);
  // DistanceLoss, sum over the depth quantiles that the ray reaches; 0 where no distance is known.
  T distance = T(0);

  SEMFOAM_HOST_DEVICE T Total(const RayLossWeights& w) const {
    return T(w.color) * color + T(w.opacity) * opacity + T(w.quantile) * quantile +
           T(w.identity) * identity + T(w.distance) * distance;
  }

  template <typename U>
  SEMFOAM_HOST_DEVICE RayLossTerms& operator+=(const RayLossTerms<U>& other) {
    color += other.color;
    opacity += other.opacity;
    quantile += other.quantile;
    identity += other.identity;
    distance += other.distance;
    return *this;
  }
  SEMFOAM_HOST_DEVICE RayLossTerms operator/(T divisor) const {
    return {color / divisor,
            opacity / divisor,
            quantile / divisor,
            identity / divisor,
            distance / divisor};
  }
};

// The parameters of the classifier. Borrowed. num_classes = 0: no semantics.
template <typename T>
struct ClassifierView {
  int num_classes = 0;
  const T* weight = nullptr;  // [num_classes][kIdentityDim]
  const T* bias = nullptr;    // [num_classes]
};

// Returns the log of the sum of exp(logits), `count` > 0 of them. Subtracts the largest one first,
// so that logits of 1e4 do not overflow.
template <typename T>
SEMFOAM_HOST_DEVICE T LogSumExp(const T* logits, int count) {
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

// Returns ln(max(K, 2)), the cross-entropy of guessing, by which the cross-entropy of any number of
// classes K is divided.
SEMFOAM_HOST_DEVICE inline double ClassNormalization(int num_classes) {
  return std::log(std::max(num_classes, 2));
}

// Returns the cross-entropy of an identity [kIdentityDim] against a class, divided by
// ClassNormalization. Writes the identity's logits to `logits` [num_classes].
template <typename T>
SEMFOAM_HOST_DEVICE T ClassEntropy(const T* identity,
                                   int32_t class_index,
                                   const ClassifierView<T>& classifier,
                                   T* logits) {
  const int count = classifier.num_classes;
  ClassLogits(classifier.weight, classifier.bias, count, identity, logits);
  return (LogSumExp(logits, count) - logits[class_index]) / T(ClassNormalization(count));
}

// Adds `weight` times the derivative of ClassEntropy by the identity to `gradient` [kIdentityDim].
// `logits` must be as ClassEntropy left it; overwrites it with `weight` times the derivative by the
// logits.
template <typename T>
SEMFOAM_HOST_DEVICE void AddClassEntropyGradient(int32_t class_index,
                                                 const ClassifierView<T>& classifier,
                                                 double weight,
                                                 T* logits,
                                                 T* gradient) {
  using std::exp;
  const int count = classifier.num_classes;
  const T scale = T(weight / ClassNormalization(count));
  const T log_sum = LogSumExp(logits, count);
  for (int k = 0; k < count; ++k) {
    logits[k] = scale * (exp(logits[k] - log_sum) - T(k == class_index));
    for (int c = 0; c < kIdentityDim; ++c) {
      gradient[c] += logits[k] * classifier.weight[k * kIdentityDim + c];
    }
  }
}

// Returns the same as ClassEntropy without room for the logits of all classes: computes them twice
// instead. Adds `weight` times the derivative by the identity to `gradient` [kIdentityDim], and
// writes the log of the sum of exp(logits) to `log_sum`.
template <typename T>
SEMFOAM_HOST_DEVICE T AddClassEntropy(const T* identity,
                                      int32_t class_index,
                                      const ClassifierView<T>& classifier,
                                      double weight,
                                      T* gradient,
                                      T* log_sum) {
  using std::exp;
  using std::log;
  const int count = classifier.num_classes;
  T largest = ClassLogit(classifier.weight, classifier.bias, 0, identity);
  T sum = T(1), own = largest;
  for (int k = 1; k < count; ++k) {
    const T logit = ClassLogit(classifier.weight, classifier.bias, k, identity);
    if (k == class_index) own = logit;
    if (logit > largest) {
      sum = sum * exp(largest - logit) + T(1);
      largest = logit;
    } else {
      sum += exp(logit - largest);
    }
  }
  *log_sum = largest + log(sum);
  const T scale = T(weight / ClassNormalization(count));
  for (int k = 0; k < count; ++k) {
    const T logit = ClassLogit(classifier.weight, classifier.bias, k, identity);
    const T by_logit = scale * (exp(logit - *log_sum) - T(k == class_index));
    for (int c = 0; c < kIdentityDim; ++c) {
      gradient[c] += by_logit * classifier.weight[k * kIdentityDim + c];
    }
  }
  return (*log_sum - own) / T(ClassNormalization(count));
}

// From about this difference on (in display values), a colour counts by less than its square. The
// noise of photos is below it; what is above it, edges that are not in place yet and sheen that
// nothing explains, would otherwise decide alone.
inline constexpr double kColorLossKnee = 0.05;

// Returns the loss of a colour that differs from its target by `mean_square`, mean over the
// channels: half of it where that is small, and in proportion to its power of 3/4 where it is
// large. This is the general robust loss of shape 3/2 (Barron, CVPR 2019, equation 1).
template <typename T>
SEMFOAM_HOST_DEVICE T ColorLoss(const T& mean_square) {
  using std::sqrt;
  constexpr double kSquaredKnee = kColorLossKnee * kColorLossKnee;
  const T x = mean_square / T(kSquaredKnee);
  // (1 + x)^(3/4) - 1 = r^3 - 1 without cancellation, where r = (1 + x)^(1/4).
  const T root = sqrt(T(1) + x);
  const T r = sqrt(root);
  return T(2 * kSquaredKnee / 3) * (x / (root + T(1))) * ((r * r + r + T(1)) / (r + T(1)));
}

// Returns twice the derivative of ColorLoss: the factor on the gradient of half the mean square.
template <typename T>
SEMFOAM_HOST_DEVICE T ColorLossSlope(const T& mean_square) {
  using std::sqrt;
  constexpr double kSquaredKnee = kColorLossKnee * kColorLossKnee;
  return T(1) / sqrt(sqrt(T(1) + mean_square / T(kSquaredKnee)));
}

// Depths that differ from a known distance by less than this share of it are right: about half of
// the known distances are no better. A surface that is seen at a grazing angle bends visibly by
// less than 1 %.
inline constexpr double kDistanceTolerance = 0.004;
// From about this share on, beyond the tolerance, a depth before a known distance counts by its
// difference and not by the square of it: some distances are wrong.
inline constexpr double kDistanceLossKnee = 0.02;
// From about this share on, a depth behind a known distance counts less and less: the ray goes on
// to what a glossy surface mirrors, what glass shows, or what lies farther away than was looked
// for.
inline constexpr double kDistanceLossReach = 0.05;
inline constexpr double kSquaredDistanceKnee = kDistanceLossKnee * kDistanceLossKnee;
inline constexpr double kSquaredDistanceReach = kDistanceLossReach * kDistanceLossReach;
// Depths so many times as far as a known distance count as if they were no farther, so that squares
// stay finite.
inline constexpr double kFarthestDepth = 1e9;

// Returns the part of `depth` / `distance` - 1 beyond the tolerance; 0 within it.
template <typename T>
SEMFOAM_HOST_DEVICE T DistanceExcess(const T& depth, double distance) {
  const T difference = depth / T(distance) - T(1);
  if (difference > T(kFarthestDepth)) return T(kFarthestDepth);
  if (difference > T(kDistanceTolerance)) return difference - T(kDistanceTolerance);
  if (difference < T(-kDistanceTolerance)) return difference + T(kDistanceTolerance);
  return T(0);
}

// Returns the loss of a depth quantile where the surface is known to be at `distance` > 0, of the
// DistanceExcess x, about x^2 / (2 kDistanceLossKnee) where that is small: before the surface the
// pseudo-Huber loss (Charbonnier et al., Two deterministic half-quadratic regularization algorithms
// for computed imaging, ICIP 1994), behind it the loss of Geman and McClure (Statistical methods
// for tomographic image reconstruction, 1987).
template <typename T>
SEMFOAM_HOST_DEVICE T DistanceLoss(const T& depth, double distance) {
  using std::sqrt;
  const T x = DistanceExcess(depth, distance);
  if (x > T(0)) {
    return T(kSquaredDistanceReach / (2 * kDistanceLossKnee)) *
           (x * x / (x * x + T(kSquaredDistanceReach)));
  }
  // sqrt(x^2 + knee^2) - knee without cancellation.
  return x * x / (sqrt(x * x + T(kSquaredDistanceKnee)) + T(kDistanceLossKnee));
}

// Returns the derivative of DistanceLoss by the depth.
template <typename T>
SEMFOAM_HOST_DEVICE T DistanceLossSlope(const T& depth, double distance) {
  using std::sqrt;
  const T x = DistanceExcess(depth, distance);
  if (x > T(0)) {
    const T share = T(kSquaredDistanceReach) / (x * x + T(kSquaredDistanceReach));
    return share * share * x / T(kDistanceLossKnee * distance);
  }
  return x / (sqrt(x * x + T(kSquaredDistanceKnee)) * T(distance));
}

// Returns all terms, unweighted. `logits` is scratch of num_classes values; afterwards it holds the
// ray's class logits if the ray is labelled.
template <typename T>
SEMFOAM_HOST_DEVICE RayLossTerms<T> RayLoss(const RayComposite<T>& ray,
                                            const RayTarget& target,
                                            const ClassifierView<T>& classifier,
                                            T* logits) {
  using std::abs;
  RayLossTerms<T> loss;
  const T transmittance = ray.Transmittance();
  T mean_square = T(0);
  for (int c = 0; c < 3; ++c) {
    const T difference = ColorDifference(ray.color[c] + transmittance, target, c);  // over white
    mean_square += difference * difference / T(3);
  }
  loss.color = ColorLoss(mean_square);
  loss.opacity = transmittance * transmittance;
  if (ray.quantile_segment[0] >= 0 && ray.quantile_segment[1] >= 0) {
    loss.quantile = abs(ray.quantile_depth[0] - ray.quantile_depth[1]);
  }
  if (classifier.num_classes > 0 && target.class_index != Value(kUnlabelled)) {
    loss.identity = ClassEntropy(ray.identity, target.class_index, classifier, logits);
  }
  for (int q = 0; q < kNumQuantiles && target.distance > 0; ++q) {
    if (ray.quantile_segment[q] < 0) continue;
    loss.distance += DistanceLoss(ray.quantile_depth[q], target.distance);
  }
  return loss;
}

// Returns the derivative of RayLoss(...).Total(weights) by the quantities accumulated along the
// ray, written out by hand. `logits` must be as RayLoss left it; overwrites it with the derivative
// of the loss by the logits. At equal quantile depths, where the loss has a kink, the derivative is
// 0.
template <typename T>
SEMFOAM_HOST_DEVICE RayGradient<T> RayLossGradient(const RayComposite<T>& ray,
                                                   const RayTarget& target,
                                                   const ClassifierView<T>& classifier,
                                                   const RayLossWeights& weights,
                                                   T* logits) {
  RayGradient<T> gradient;
  const T transmittance = ray.Transmittance();
  T difference[3];
  T mean_square = T(0);
  for (int c = 0; c < 3; ++c) {
    difference[c] = ColorDifference(ray.color[c] + transmittance, target, c);
    mean_square += difference[c] * difference[c] / T(3);
  }
  const T scale = T(weights.color) * ColorLossSlope(mean_square) / T(3);
  for (int c = 0; c < 3; ++c) {
    gradient.color[c] = scale * difference[c];
    gradient.opacity -= gradient.color[c];  // the white background gives way as opacity grows
  }
  gradient.opacity -= T(2 * weights.opacity) * transmittance;
  if (ray.quantile_segment[0] >= 0 && ray.quantile_segment[1] >= 0) {
    const T spread = ray.quantile_depth[0] - ray.quantile_depth[1];
    const T sign = T(spread > T(0)) - T(spread < T(0));
    gradient.quantile_depth[0] = T(weights.quantile) * sign;
    gradient.quantile_depth[1] = -gradient.quantile_depth[0];
  }
  for (int q = 0; q < kNumQuantiles && target.distance > 0; ++q) {
    if (ray.quantile_segment[q] < 0) continue;
    gradient.quantile_depth[q] +=
        T(weights.distance) * DistanceLossSlope(ray.quantile_depth[q], target.distance);
  }
  if (classifier.num_classes > 0 && target.class_index != Value(kUnlabelled)) {
    AddClassEntropyGradient(
        target.class_index, classifier, weights.identity, logits, gradient.identity);
  }
  return gradient;
}

}  // namespace semfoam
