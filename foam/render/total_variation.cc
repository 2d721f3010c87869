// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/render/total_variation.h"

#include "foam/render/update_loops.h"
#include "foam/util/parallel.h"

#include <algorithm>
#include <atomic>
#include <type_traits>

namespace semfoam {

std::vector<float> TotalVariationWeights(const Delaunay& delaunay,
                                         const std::vector<double>& face_areas) {
  constexpr int64_t kBlock = 4096;
  std::vector<double> mean_area(delaunay.num_sites, 0.0);
  std::atomic<size_t> num_directed = 0;
  ParallelForBlocks(delaunay.num_sites, kBlock, [&](int64_t block_begin, int64_t block_end) {
    size_t count = 0;
    for (int64_t i = block_begin; i < block_end; ++i) {
      const uint32_t begin = delaunay.offsets[i], end = delaunay.offsets[i + 1];
      for (uint32_t e = begin; e < end; ++e) {
        mean_area[i] += face_areas[e] / (end - begin);
        count += delaunay.neighbors[e] < delaunay.num_sites;
      }
    }
    num_directed += count;
  });
  const float normalization = 2.f / (std::max<size_t>(num_directed, 2) * float(kIdentityDim));
  std::vector<float> weights(delaunay.neighbors.size(), 0.f);
  ParallelForBlocks(delaunay.num_sites, kBlock, [&](int64_t block_begin, int64_t block_end) {
    for (int64_t i = block_begin; i < block_end; ++i) {
      for (uint32_t e = delaunay.offsets[i]; e < delaunay.offsets[i + 1]; ++e) {
        const uint32_t j = delaunay.neighbors[e];
        if (j >= delaunay.num_sites) continue;
        const double mean = 0.5 * (mean_area[i] + mean_area[j]);
        const double share = mean > 0 ? std::clamp(face_areas[e] / mean, 0.1, 10.0) : 0.1;
        weights[e] = normalization * static_cast<float>(share);
      }
    }
  });
  return weights;
}

template <typename Real>
double TotalVariation(const Delaunay& delaunay,
                      const std::vector<Real>& weights,
                      std::span<const std::type_identity_t<Real>> identity,
                      Real scale,
                      std::vector<Real>* gradient) {
  constexpr int64_t kBlock = 1024;
  gradient->resize(identity.size());
  std::vector<double> sums((delaunay.num_sites + kBlock - 1) / kBlock, 0.0);
  ParallelForBlocks(delaunay.num_sites, kBlock, [&](int64_t begin, int64_t end) {
    if constexpr (std::is_same_v<Real, float>) {
      sums[begin / kBlock] = TotalVariationOfCells(delaunay.offsets.data(),
                                                   delaunay.neighbors.data(),
                                                   weights.data(),
                                                   delaunay.num_sites,
                                                   identity.data(),
                                                   scale,
                                                   static_cast<uint32_t>(begin),
                                                   static_cast<uint32_t>(end),
                                                   gradient->data());
      return;
    }
    double sum = 0;
    for (int64_t i = begin; i < end; ++i) {
      const Real* f_i = &identity[i * kIdentityDim];
      Real own[kIdentityDim] = {};
      for (uint32_t e = delaunay.offsets[i]; e < delaunay.offsets[i + 1]; ++e) {
        const uint32_t j = delaunay.neighbors[e];
        if (j >= delaunay.num_sites) continue;
        const Real* f_j = &identity[size_t(j) * kIdentityDim];
        const Real weight = weights[e];
        for (int c = 0; c < kIdentityDim; ++c) {
          own[c] += weight * (Real(f_i[c] > f_j[c]) - Real(f_i[c] < f_j[c]));
        }
        sum += EdgeVariation(weight, f_i, f_j);
      }
      for (int c = 0; c < kIdentityDim; ++c) (*gradient)[i * kIdentityDim + c] = scale * own[c];
    }
    sums[begin / kBlock] = sum;
  });
  double total = 0;
  for (const double sum : sums) total += sum;
  return total / 2;  // every edge was met from both sides
}

template double TotalVariation(
    const Delaunay&, const std::vector<float>&, std::span<const float>, float, std::vector<float>*);
template double TotalVariation(const Delaunay&,
                               const std::vector<double>&,
                               std::span<const double>,
                               double,
                               std::vector<double>*);

}  // namespace semfoam
