// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/model/activation.h"
#include "foam/render/ray_loss.h"
#include "foam/render/ray_record.h"
#include "foam/render/walk.h"
#include "foam/util/ids.h"
#include "foam/util/random.h"

#include <algorithm>
#include <limits>
#include <vector>

#include <Eigen/Core>

// A training ray through a small foam, in any arithmetic: traced, differentiated by hand, and
// replayed along the sequence of cells that was recorded, which in ceres::Jet is the oracle of its
// gradient. For tests; knows neither GoogleTest nor Ceres.

namespace semfoam {

// All parameters of a small foam, in one row each.
template <typename T>
struct FoamParameters {
  int sh_degree = 0;
  int num_classes = 0;
  std::vector<Eigen::Matrix<T, 3, 1>> positions;  // [num_cells], guards included
  std::vector<T> raw_density;                     // [num_sites]
  std::vector<T> sh;                              // [num_sites][(sh_degree + 1)^2][3]
  std::vector<T> identity;                        // [num_sites][kIdentityDim]
  std::vector<T> weight, bias;                    // the classifier's
  std::vector<T> color_gradient;                  // [num_sites][3 axes][3 channels]

  // The k-th parameter of a kind; kinds in the order of kParameterKinds.
  T* Find(int kind, size_t k) {
    switch (kind) {
      case 0:
        return &positions[k / 3][k % 3];
      case 1:
        return &raw_density[k];
      case 2:
        return &sh[k];
      case 3:
        return &identity[k];
      case 4:
        return &weight[k];
      case 5:
        return &bias[k];
      default:
        return &color_gradient[k];
    }
  }

  // Activated densities of all cells, 0 for the guards: [num_cells].
  std::vector<T> Densities() const {
    std::vector<T> density(positions.size(), T(0));
    for (size_t i = 0; i < raw_density.size(); ++i) density[i] = Density(raw_density[i]);
    return density;
  }

  ClassifierView<T> Classifier() const { return {num_classes, weight.data(), bias.data()}; }

  // `density` is [num_cells], activated.
  CellShading<T> Shading(const std::vector<T>& density) const {
    return {sh_degree, density.data(), sh.data(), identity.data(), color_gradient.data()};
  }
};

inline constexpr int kNumParameterKinds = 7;
inline constexpr const char* kParameterKinds[kNumParameterKinds] = {"position",
                                                                    "raw density",
                                                                    "SH",
                                                                    "identity",
                                                                    "classifier weight",
                                                                    "classifier bias",
                                                                    "colour gradient"};

template <typename T, typename From>
FoamParameters<T> Cast(const FoamParameters<From>& p) {
  FoamParameters<T> out;
  out.sh_degree = p.sh_degree;
  out.num_classes = p.num_classes;
  for (const auto& v : p.positions) out.positions.push_back(v.template cast<T>());
  const auto cast = [](const std::vector<From>& from, std::vector<T>* to) {
    to->reserve(from.size());
    for (const From value : from) to->push_back(T(value));
  };
  cast(p.raw_density, &out.raw_density);
  cast(p.sh, &out.sh);
  cast(p.identity, &out.identity);
  cast(p.weight, &out.weight);
  cast(p.bias, &out.bias);
  cast(p.color_gradient, &out.color_gradient);
  return out;
}

// Values of every kind for the given cells, guards included: air, haze, matter, saturated matter,
// and cells that are transparent altogether; colours wide enough that some channels are clamped at
// black.
template <typename T>
FoamParameters<T> RandomParameters(const std::vector<Eigen::Matrix<T, 3, 1>>& cell_positions,
                                   size_t num_sites,
                                   int sh_degree,
                                   int num_classes,
                                   uint64_t seed) {
  FoamParameters<T> p;
  p.sh_degree = sh_degree;
  p.num_classes = num_classes;
  p.positions = cell_positions;
  CounterRandom random(seed, 0x52, 0);
  for (size_t i = 0; i < num_sites; ++i) {
    const double raw[] = {-0.6, -0.1, 0.05, 0.3, 40, -3};
    p.raw_density.push_back(T(raw[random.Below(6)] + 0.01 * random.Uniform()));
  }
  const auto fill = [&](size_t count, std::vector<T>* values) {
    for (size_t k = 0; k < count; ++k) values->push_back(T(random.Normal()));
  };
  fill(num_sites * 3 * NumShCoefficients(sh_degree), &p.sh);
  fill(num_sites * kIdentityDim, &p.identity);
  fill(size_t(num_classes) * kIdentityDim, &p.weight);
  fill(num_classes, &p.bias);
  for (size_t k = 0; k < num_sites * kColorGradientDim; ++k) {
    p.color_gradient.push_back(T(0.2 * random.Normal()));
  }
  return p;
}

struct RayCase {
  Eigen::Vector3d origin, direction;
  double quantile_tau[kNumQuantiles] = {0.3, 1.2};
  RayTarget target{{0.2f, 0.9f, 0.4f}, 1, 0.8f};
};

// Walks and shades the whole ray, however opaque it grows. `density` is [num_cells], activated.
template <typename Real>
RayRecord<Real> TraceCase(const WalkGeometry<Real>& geometry,
                          const FoamParameters<Real>& p,
                          const std::vector<Real>& density,
                          const RayCase& ray,
                          uint32_t start) {
  RayRecord<Real> record;
  record.origin = ray.origin.cast<Real>();
  record.direction = ray.direction.cast<Real>();
  for (int k = 0; k < kNumQuantiles; ++k) {
    record.composite.quantile_tau[k] = Real(ray.quantile_tau[k]);
  }
  TraceRay(geometry, p.Shading(density), start, std::numeric_limits<Real>::infinity(), &record);
  return record;
}

// The loss along a recorded sequence of cells, in any arithmetic.
template <typename T>
T ReplayLoss(const RayRecord<double>& record,
             const RayCase& ray,
             const FoamParameters<T>& p,
             const RayLossWeights& weights) {
  const Eigen::Matrix<T, 3, 1> origin = record.origin.cast<T>();
  const Eigen::Matrix<T, 3, 1> direction = record.direction.cast<T>();
  const int num_coefficients = NumShCoefficients(p.sh_degree);
  RayComposite<T> composite;
  for (int k = 0; k < kNumQuantiles; ++k) composite.quantile_tau[k] = T(ray.quantile_tau[k]);
  T basis[kMaxShCoefficients];
  ShBasis(p.sh_degree, direction, basis);
  T t_in = T(0);
  for (const RecordedSegment<double>& segment : record.segments) {
    const Eigen::Matrix<T, 3, 1> r = origin - p.positions[segment.cell];
    const Eigen::Matrix<T, 3, 1> n = p.positions[segment.next] - p.positions[segment.cell];
    T t_out = t_in;
    if (!segment.clamped) {
      t_out = IsGrazing<T>(n, direction) ? T(segment.t_out) : CrossingDistance<T>(r, n, direction);
    }
    if (segment.shaded >= 0) {
      const T sigma = Density(p.raw_density[segment.cell]);
      const ShadedSegment<T> shaded = AddSegment(t_in, t_out, sigma, segment.shaded, &composite);
      const bool counts = record.shaded[segment.shaded].weight > kNegligibleWeight;
      T color[3];
      const T* const sh = &p.sh[size_t(segment.cell) * 3 * num_coefficients];
      if (counts && !p.color_gradient.empty()) {
        const Eigen::Matrix<T, 3, 1> offset = r + shaded.centroid * direction;
        T slope[3];
        LinearColor(basis,
                    num_coefficients,
                    sh,
                    &p.color_gradient[size_t(segment.cell) * kColorGradientDim],
                    offset,
                    direction,
                    color,
                    slope);
      } else {
        ShColor(basis, counts ? num_coefficients : 1, sh, color);
      }
      for (int c = 0; c < 3; ++c) composite.color[c] += shaded.weight * color[c];
      for (int c = 0; counts && p.num_classes > 0 && c < kIdentityDim; ++c) {
        // As far as the identity loss is not to bend geometry, its weight is a constant.
        const double share = weights.identity_to_density;
        const T weight =
            T(share) * shaded.weight + T((1 - share) * record.shaded[segment.shaded].weight);
        composite.identity[c] += weight * p.identity[size_t(segment.cell) * kIdentityDim + c];
      }
    }
    t_in = t_out;
  }
  std::vector<T> logits(p.num_classes);
  return RayLoss(composite, ray.target, p.Classifier(), logits.data()).Total(weights);
}

// The hand-written gradient of one ray, by kind and parameter.
inline std::vector<std::vector<double>> HandWrittenGradient(const WalkGeometry<double>& geometry,
                                                            const RayRecord<double>& record,
                                                            const RayCase& ray,
                                                            const FoamParameters<double>& p,
                                                            const RayLossWeights& weights) {
  std::vector<std::vector<double>> out = {std::vector<double>(3 * p.positions.size()),
                                          std::vector<double>(p.raw_density.size()),
                                          std::vector<double>(p.sh.size()),
                                          std::vector<double>(p.identity.size()),
                                          std::vector<double>(p.weight.size()),
                                          std::vector<double>(p.bias.size()),
                                          std::vector<double>(p.color_gradient.size())};
  std::vector<double> logits(p.num_classes);
  RayLoss(record.composite, ray.target, p.Classifier(), logits.data());
  const RayGradient<double> gradient =
      RayLossGradient(record.composite, ray.target, p.Classifier(), weights, logits.data());
  if (ray.target.class_index != Value(kUnlabelled)) {
    for (int k = 0; k < p.num_classes; ++k) {
      for (int c = 0; c < kIdentityDim; ++c) {
        out[4][k * kIdentityDim + c] = logits[k] * record.composite.identity[c];
      }
      out[5][k] = logits[k];
    }
  }
  const int num_coefficients = NumShCoefficients(p.sh_degree);
  const auto emit = [&](const CellContribution<double>& c) {
    for (int a = 0; a < 3; ++a) out[0][3 * c.cell + a] += c.position[a];
    out[1][c.cell] += c.density * DensityDerivative(p.raw_density[c.cell]);
    const bool counts = c.weight > kNegligibleWeight;
    for (int k = 0; k < (counts ? num_coefficients : 1); ++k) {
      for (int a = 0; a < 3; ++a) {
        if (!(c.color_mask >> a & 1)) continue;
        out[2][(size_t(c.cell) * num_coefficients + k) * 3 + a] +=
            c.weight * gradient.color[a] * record.sh_basis[k];
      }
    }
    if (counts && !p.color_gradient.empty()) {
      const Eigen::Vector3d offset =
          record.origin + c.centroid * record.direction - p.positions[c.cell];
      for (int a = 0; a < kColorGradientDim; ++a) {
        if (!(c.color_mask >> (a % 3) & 1)) continue;
        const size_t k = size_t(c.cell) * kColorGradientDim + a;
        const double by_color = c.weight * gradient.color[a % 3];
        out[6][k] += by_color * offset[a / 3];
        out[0][3 * c.cell + a / 3] -= by_color * p.color_gradient[k];
      }
    }
    for (int a = 0; counts && p.num_classes > 0 && a < kIdentityDim; ++a) {
      out[3][size_t(c.cell) * kIdentityDim + a] += c.weight * gradient.identity[a];
    }
  };
  RayGradient<double> flowing = gradient;
  for (double& g : flowing.identity) g *= weights.identity_to_density;
  const bool to_density = weights.identity_to_density > 0 && p.num_classes > 0;
  BackpropagateRay(geometry, record, flowing, emit, to_density ? p.identity.data() : nullptr);
  return out;
}

}  // namespace semfoam
