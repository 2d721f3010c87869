// SPDX-License-Identifier: GPL-3.0-or-later
//
// The bytes of a packed foam, read back as the page reads them.
#include "tools/report/foam_pack.h"

#include "foam/geometry/guard_sites.h"
#include "foam/model/activation.h"
#include "foam/util/random.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <set>
#include <string>
#include <vector>

#include "tests/foam/random_cells.h"
#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

template <typename T>
T At(const std::string& bytes, size_t place) {
  T value;
  std::memcpy(&value, bytes.data() + place, sizeof(T));
  return value;
}

float HalfAt(const std::string& bytes, size_t place) {
  return static_cast<float>(Eigen::numext::bit_cast<Eigen::half>(At<uint16_t>(bytes, place)));
}

// The neighbours of every cell; expects that the bytes end with them.
std::vector<std::vector<uint32_t>> NeighborsOf(const PackedFoam& packed) {
  size_t next = packed.neighbors_begin;
  const auto read = [&] {
    uint32_t value = 0;
    for (int shift = 0;; shift += 7) {
      const auto byte = static_cast<uint8_t>(packed.bytes.at(next++));
      value |= uint32_t{byte & 127u} << shift;
      if (byte < 128) return value;
    }
  };
  std::vector<std::vector<uint32_t>> neighbors(packed.num_cells);
  for (uint32_t cell = 0; cell < packed.num_cells; ++cell) {
    uint32_t other = cell;
    for (uint32_t left = read(); left > 0; --left) {
      other += read();
      neighbors[cell].push_back(other);
      neighbors.at(other).push_back(cell);
    }
  }
  EXPECT_EQ(next, packed.bytes.size());
  return neighbors;
}

std::vector<Eigen::Vector3f> PositionsOf(const PackedFoam& packed) {
  const size_t count = packed.num_cells;
  std::vector<Eigen::Vector3f> positions(count);
  for (size_t axis = 0; axis < 3; ++axis) {
    uint32_t bits = 0;
    for (size_t i = 0; i < count; ++i) {
      uint32_t zigzag = 0;
      for (size_t b = 0; b < 4; ++b) {
        zigzag |= uint32_t{static_cast<uint8_t>(packed.bytes[(4 * axis + b) * count + i])} << 8 * b;
      }
      bits += zigzag % 2 == 0 ? zigzag / 2 : ~(zigzag / 2);
      std::memcpy(&positions[i][axis], &bits, sizeof(bits));
    }
  }
  return positions;
}

Model RandomModel(size_t num_sites, int sh_degree, int num_classes) {
  Model model;
  Foam& foam = model.foam;
  foam.sh_degree = sh_degree;
  foam.num_classes = num_classes;
  foam.positions = RandomSites(static_cast<int>(num_sites), 7);
  CounterRandom random(3, 1, 0);
  const auto fill = [&](size_t count, double size, auto* values) {
    for (size_t i = 0; i < count; ++i) {
      values->push_back(static_cast<float>(size * (2 * random.Uniform() - 1)));
    }
  };
  fill(num_sites, 2, &foam.raw_density);
  fill(num_sites * foam.ShStride(), 0.7, &foam.sh);
  fill(num_sites * kColorGradientDim, 3, &foam.color_gradient);
  if (num_classes > 0) fill(num_sites * kIdentityDim, 1, &foam.identity);
  fill(size_t(num_classes) * kIdentityDim, 1, &foam.classifier_weight);
  fill(num_classes, 1, &foam.classifier_bias);
  fill(num_sites, 1, &model.statistics.contribution);
  for (int k = 0; k < num_classes; ++k) model.labels.push_back({LabelId{k + 1}, MaskId(k + 1), ""});
  return model;
}

std::vector<int32_t> EveryOtherCell(size_t num_sites) {
  std::vector<int32_t> object(num_sites, -1);
  for (size_t i = 0; i < num_sites; i += 2) object[i] = 0;
  return object;
}

class PackFoamOfDegree : public testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Degrees, PackFoamOfDegree, testing::Values(0, 1, 2, 3));

TEST_P(PackFoamOfDegree, ComesBack) {
  const Model model = RandomModel(300, GetParam(), 5);
  const Foam& foam = model.foam;
  const Delaunay delaunay = Triangulate(WithGuardSites(foam.positions));
  const PackedFoam packed = PackFoam(model, delaunay, EveryOtherCell(300), 0);
  const std::string& bytes = packed.bytes;
  EXPECT_EQ(packed.num_left_out, 0);
  EXPECT_EQ(packed.num_cells, 300u + kNumGuardSites);
  EXPECT_EQ(packed.Header()["bytes"], bytes.size());

  const std::vector<std::vector<uint32_t>> neighbors = NeighborsOf(packed);
  for (uint32_t i = 0; i < packed.num_cells; ++i) {
    EXPECT_THAT(neighbors[i], testing::ElementsAreArray(delaunay.Neighbors(i)));
  }
  const int stride = foam.ShStride();
  const std::vector<Eigen::Vector3f> positions = PositionsOf(packed);
  EXPECT_EQ(positions, WithGuardSites(foam.positions));
  for (uint32_t i = 0; i < packed.num_sites; ++i) {
    const size_t record = packed.records_begin + size_t{i} * packed.record_bytes;
    const float density = Density(foam.raw_density[i]);
    EXPECT_NEAR(HalfAt(bytes, record), density, 1e-3 * density + 1e-7);
    for (int c = 0; c < 3; ++c) {
      EXPECT_NEAR(HalfAt(bytes, record + 2 + 2 * c), foam.sh[i * stride + c], 1e-3);
    }
    EXPECT_EQ(At<uint16_t>(bytes, record + 8) >> 15, i % 2);
    // Half a step of 1/127 of the largest, and up to twice that for the power of two; but no step
    // below `step`.
    const auto expect_near =
        [&](size_t place, int exponent_place, const float* values, int count, double step = 0) {
          float largest = 0;
          for (int k = 0; k < count; ++k) largest = std::max(largest, std::abs(values[k]));
          for (int k = 0; k < count; ++k) {
            const float value = std::ldexp(1.f * At<int8_t>(bytes, place + k),
                                           At<int8_t>(bytes, record + exponent_place));
            EXPECT_NEAR(value, values[k], std::max<double>(largest / 127, step / 2));
          }
        };
    double distance = 0;
    int count = 0;
    for (const uint32_t neighbor : delaunay.Neighbors(i)) {
      if (neighbor >= packed.num_sites) continue;
      distance += (foam.positions[neighbor] - foam.positions[i]).norm();
      ++count;
    }
    expect_near(record + 13,
                10,
                &foam.color_gradient[i * kColorGradientDim],
                kColorGradientDim,
                count / (128 * distance));
    expect_near(record + kPackedHeadBytes, 11, &foam.sh[i * stride + 3], stride - 3, 1. / 128);
    expect_near(packed.identities_begin + i * kIdentityDim,
                12,
                &foam.identity[i * kIdentityDim],
                kIdentityDim);
  }
  EXPECT_EQ(packed.record_bytes % 16, 0);
  for (int k = 0; k < 5; ++k) {
    const size_t row = packed.classifier_begin + size_t(k) * 4 * (kIdentityDim + 1);
    EXPECT_EQ(At<float>(bytes, row), foam.classifier_weight[k * kIdentityDim]);
    EXPECT_EQ(At<float>(bytes, row + 4 * kIdentityDim), foam.classifier_bias[k]);
  }
}

TEST(PackFoam, WithoutSemanticsHasNoClass) {
  const Model model = RandomModel(40, 1, 0);
  const Delaunay delaunay = Triangulate(WithGuardSites(model.foam.positions));
  const PackedFoam packed = PackFoam(model, delaunay, {}, 0);
  EXPECT_EQ(packed.identities_begin, packed.neighbors_begin);
  EXPECT_EQ(At<uint16_t>(packed.bytes, packed.records_begin + 8), kNoPackedClass | kLooseCell);
}

TEST(PackFoam, KeepsWhatMatters) {
  Model model = RandomModel(500, 0, 2);
  std::vector<float>& contribution = model.statistics.contribution;
  std::fill(contribution.begin(), contribution.end(), 0.f);
  const std::set<uint32_t> seen = {3, 77, 410};
  for (const uint32_t site : seen) contribution[site] = 0.5f;
  const Delaunay delaunay = Triangulate(WithGuardSites(model.foam.positions));
  std::set<uint32_t> expected = seen;
  for (const uint32_t site : seen) {
    for (const uint32_t neighbor : delaunay.Neighbors(site)) {
      if (neighbor < 500) expected.insert(neighbor);
    }
  }
  const PackedFoam packed =
      PackFoam(model, delaunay, EveryOtherCell(500), static_cast<int64_t>(expected.size()));
  EXPECT_EQ(packed.num_left_out, 500 - static_cast<int64_t>(expected.size()));
  std::vector<float> kept, wanted;
  const std::vector<Eigen::Vector3f> positions = PositionsOf(packed);
  for (uint32_t i = 0; i < packed.num_sites; ++i) kept.push_back(positions[i].x());
  for (const uint32_t site : expected) wanted.push_back(model.foam.positions[site].x());
  EXPECT_EQ(kept, wanted);
  EXPECT_EQ(NeighborsOf(packed).size(), packed.num_cells);
}

}  // namespace
}  // namespace semfoam
