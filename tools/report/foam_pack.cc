// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/report/foam_pack.h"

#include "foam/geometry/guard_sites.h"
#include "foam/model/classifier.h"
#include "foam/model/spherical_harmonics.h"
#include "foam/render/cell_shading.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>
#include <span>

#include <glog/logging.h>
#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

static_assert(std::endian::native == std::endian::little, "sections are written as they lie");

template <typename T>
void Append(std::span<const T> values, std::string* bytes) {
  bytes->append(reinterpret_cast<const char*>(values.data()), values.size_bytes());
}

void AppendLeb128(uint32_t value, std::string* bytes) {
  for (; value >= 0x80; value >>= 7) bytes->push_back(static_cast<char>(value | 0x80));
  bytes->push_back(static_cast<char>(value));
}

template <typename T>
void Store(T value, char* to) {
  std::copy_n(reinterpret_cast<const char*>(&value), sizeof(T), to);
}

// Appends the bits of positions, as differences that gzip finds small: see PackedFoam::bytes.
void AppendPositions(const std::vector<Eigen::Vector3f>& cells, std::string* bytes) {
  const size_t begin = bytes->size(), count = cells.size();
  bytes->resize(begin + 12 * count);
  for (int axis = 0; axis < 3; ++axis) {
    uint32_t before = 0;
    for (size_t i = 0; i < count; ++i) {
      const auto bits = std::bit_cast<uint32_t>(cells[i][axis]);
      const uint32_t difference = bits - before;
      before = bits;
      const uint32_t zigzag = difference << 1 ^ (0u - (difference >> 31));
      for (int b = 0; b < 4; ++b) {
        (*bytes)[begin + (4 * axis + b) * count + i] = static_cast<char>(zigzag >> 8 * b);
      }
    }
  }
}

// Numbers beyond the largest half become the largest half, as a page has no use for infinity.
uint16_t Half(float value) {
  constexpr float kLargestHalf = 65504;
  const Eigen::half half(std::clamp(value, -kLargestHalf, kLargestHalf));
  return Eigen::numext::bit_cast<uint16_t>(half);
}

// Stores values as integers times one power of two, and returns its exponent: that of the largest
// value, but at least `least_exponent`, since steps that nobody sees would cost bytes.
int8_t StoreScaled(std::span<const float> values, int least_exponent, char* to) {
  float largest = 0;
  for (const float value : values) largest = std::max(largest, std::abs(value));
  int exponent = least_exponent;
  if (largest > 0) {
    std::frexp(largest / 127, &exponent);  // the next power of two above
    exponent = std::clamp(exponent, std::max(-100, least_exponent), 100);
  }
  for (size_t i = 0; i < values.size(); ++i) {
    const float scaled = std::clamp(std::ldexp(values[i], -exponent), -127.f, 127.f);
    to[i] = static_cast<char>(std::lround(scaled));
  }
  return static_cast<int8_t>(exponent);
}

// The sites to keep, ascending.
std::vector<uint32_t> ChooseSites(const Model& model, const Delaunay& delaunay, int64_t max_cells) {
  std::vector<uint32_t> sites(delaunay.num_sites);
  std::iota(sites.begin(), sites.end(), 0u);
  if (max_cells <= 0 || max_cells >= static_cast<int64_t>(sites.size())) return sites;
  const std::vector<float>& contribution = model.statistics.contribution;
  const auto of = [&](uint32_t cell) {
    return cell < contribution.size() ? contribution[cell] : 0.f;
  };
  std::vector<float> best(sites.size());
  for (const uint32_t site : sites) {
    best[site] = of(site);
    for (const uint32_t neighbor : delaunay.Neighbors(site)) {
      best[site] = std::max(best[site], of(neighbor));
    }
  }
  std::nth_element(sites.begin(), sites.begin() + max_cells, sites.end(), [&](auto a, auto b) {
    return best[a] != best[b] ? best[a] > best[b] : a < b;
  });
  sites.resize(max_cells);
  std::sort(sites.begin(), sites.end());
  return sites;
}

uint16_t PackedClass(const Foam& foam, uint32_t site, const std::vector<int32_t>& object_of_cell) {
  if (!foam.HasSemantics()) return kNoPackedClass | kLooseCell;
  const float* const identity = &foam.identity[size_t{site} * kIdentityDim];
  const int32_t best =
      FindMostLikelyClass(
          foam.classifier_weight.data(), foam.classifier_bias.data(), foam.num_classes, identity)
          .class_index;
  CHECK_LT(best, int32_t{kNoPackedClass});
  return static_cast<uint16_t>(best | (object_of_cell[site] < 0 ? kLooseCell : 0));
}

// The exponent of the step in which a cell's colour gradient is stored: across half the mean
// distance to its neighbours it amounts to half a step of kPackedColorExponent.
int LeastGradientExponent(const Foam& foam, const Delaunay& delaunay, uint32_t site) {
  double distance = 0;
  int count = 0;
  for (const uint32_t neighbor : delaunay.Neighbors(site)) {
    if (neighbor >= foam.NumSites()) continue;  // guards are far away
    distance += (foam.positions[neighbor] - foam.positions[site]).norm();
    ++count;
  }
  if (count == 0 || !(distance > 0)) return kPackedColorExponent;
  return kPackedColorExponent - static_cast<int>(std::ceil(std::log2(distance / count)));
}

void PackRecord(const Foam& foam,
                const Delaunay& delaunay,
                uint32_t site,
                uint16_t packed_class,
                char* record) {
  const int stride = foam.ShStride();
  const float* const sh = &foam.sh[size_t{site} * stride];
  Store(Half(ShownDensity(foam, site)), record);
  for (int c = 0; c < 3; ++c) Store(Half(sh[c]), record + 2 + 2 * c);
  Store(packed_class, record + 8);
  if (foam.HasColorGradients()) {
    record[10] =
        StoreScaled({&foam.color_gradient[size_t{site} * kColorGradientDim], kColorGradientDim},
                    LeastGradientExponent(foam, delaunay, site),
                    record + 13);
  }
  record[11] = StoreScaled({sh + 3, sh + stride}, kPackedColorExponent, record + kPackedHeadBytes);
}

}  // namespace

nlohmann::json PackedFoam::Header() const {
  return {{"num_sites", num_sites},
          {"num_cells", num_cells},
          {"num_classes", num_classes},
          {"num_left_out", num_left_out},
          {"sh_degree", sh_degree},
          {"record_bytes", record_bytes},
          {"classifier_begin", classifier_begin},
          {"records_begin", records_begin},
          {"identities_begin", identities_begin},
          {"neighbors_begin", neighbors_begin},
          {"bytes", bytes.size()}};
}

PackedFoam PackFoam(const Model& model,
                    const Delaunay& delaunay,
                    const std::vector<int32_t>& object_of_cell,
                    int64_t max_cells) {
  const Foam& foam = model.foam;
  CHECK_EQ(foam.NumSites(), delaunay.num_sites);
  CHECK(!foam.HasSemantics() || object_of_cell.size() == foam.NumSites());
  const std::vector<uint32_t> sites = ChooseSites(model, delaunay, max_cells);
  std::vector<Eigen::Vector3f> kept;
  kept.reserve(sites.size());
  for (const uint32_t site : sites) kept.push_back(foam.positions[site]);
  const std::vector<Eigen::Vector3f> cells = WithGuardSites(kept);
  const bool is_thinned = sites.size() < foam.NumSites();
  const Delaunay thinned = is_thinned ? Triangulate(cells) : Delaunay{};
  const Delaunay& kept_delaunay = is_thinned ? thinned : delaunay;

  PackedFoam packed;
  packed.num_left_out = static_cast<int64_t>(foam.NumSites() - sites.size());
  packed.num_sites = static_cast<uint32_t>(sites.size());
  packed.num_cells = kept_delaunay.num_cells;
  packed.num_classes = foam.num_classes;
  packed.sh_degree = foam.sh_degree;
  packed.record_bytes = (kPackedHeadBytes + foam.ShStride() - 3 + 15) / 16 * 16;
  std::string& bytes = packed.bytes;
  AppendPositions(cells, &bytes);
  packed.classifier_begin = bytes.size();
  for (int k = 0; k < foam.num_classes; ++k) {
    Append(std::span<const float>(&foam.classifier_weight[size_t(k) * kIdentityDim], kIdentityDim),
           &bytes);
    Append(std::span<const float>(&foam.classifier_bias[k], 1), &bytes);
  }
  packed.records_begin = bytes.size();
  packed.identities_begin = packed.records_begin + sites.size() * packed.record_bytes;
  packed.neighbors_begin =
      packed.identities_begin + (foam.HasSemantics() ? sites.size() * kIdentityDim : 0);
  bytes.resize(packed.neighbors_begin, '\0');
  for (size_t i = 0; i < sites.size(); ++i) {
    char* const record = bytes.data() + packed.records_begin + i * packed.record_bytes;
    PackRecord(foam, delaunay, sites[i], PackedClass(foam, sites[i], object_of_cell), record);
    if (!foam.HasSemantics()) continue;
    const float* const identity = &foam.identity[size_t{sites[i]} * kIdentityDim];
    record[12] = StoreScaled(
        {identity, kIdentityDim}, -100, bytes.data() + packed.identities_begin + i * kIdentityDim);
  }
  for (uint32_t cell = 0; cell < kept_delaunay.num_cells; ++cell) {
    const std::span<const uint32_t> neighbors = kept_delaunay.Neighbors(cell);
    const auto above = std::upper_bound(neighbors.begin(), neighbors.end(), cell);
    AppendLeb128(static_cast<uint32_t>(neighbors.end() - above), &bytes);
    uint32_t before = cell;
    for (auto neighbor = above; neighbor != neighbors.end(); ++neighbor) {
      AppendLeb128(*neighbor - before, &bytes);
      before = *neighbor;
    }
  }
  return packed;
}

}  // namespace semfoam
