// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/model/foam.h"
#include "foam/util/host_device.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>

namespace semfoam {

// Computes the logit of class k by the linear layer from identity to classes (Semantic Foam,
// section 3): logits[k] = weight[k] . identity + bias[k]. `weight` is [num_classes][kIdentityDim].
template <typename T>
SEMFOAM_HOST_DEVICE T ClassLogit(const T* weight, const T* bias, int k, const T* identity) {
  T sum = bias[k];
  for (int c = 0; c < kIdentityDim; ++c) sum += weight[k * kIdentityDim + c] * identity[c];
  return sum;
}

// Computes the logits of all classes: `logits` [num_classes].
template <typename T>
SEMFOAM_HOST_DEVICE void ClassLogits(
    const T* weight, const T* bias, int num_classes, const T* identity, T* logits) {
  for (int k = 0; k < num_classes; ++k) logits[k] = ClassLogit(weight, bias, k, identity);
}

inline void ClassLogits(const Foam& foam, const float* identity, float* logits) {
  ClassLogits(foam.classifier_weight.data(),
              foam.classifier_bias.data(),
              foam.num_classes,
              identity,
              logits);
}

struct MostLikelyClass {
  int32_t class_index = -1;
  // Softmax of that class.
  float confidence = 0;
};

// Returns the class of the largest logit (ties: the lowest index) and its softmax. `logits` must
// not be empty.
inline MostLikelyClass ArgmaxSoftmax(std::span<const float> logits) {
  const auto best = std::max_element(logits.begin(), logits.end());
  float sum = 0;
  for (const float logit : logits) sum += std::exp(logit - *best);
  return {static_cast<int32_t>(best - logits.begin()), 1 / sum};
}

// Returns the same for an identity, without room for the logits of all classes.
template <typename T>
SEMFOAM_HOST_DEVICE MostLikelyClass
FindMostLikelyClass(const T* weight, const T* bias, int num_classes, const T* identity) {
  using std::exp;
  int best = 0;
  T largest = ClassLogit(weight, bias, 0, identity), sum = T(1);
  for (int k = 1; k < num_classes; ++k) {
    const T logit = ClassLogit(weight, bias, k, identity);
    if (logit > largest) {
      sum = sum * exp(largest - logit) + T(1);
      largest = logit;
      best = k;
    } else {
      sum += exp(logit - largest);
    }
  }
  return {best, static_cast<float>(T(1) / sum)};
}

}  // namespace semfoam
