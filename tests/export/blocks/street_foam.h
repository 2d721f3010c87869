// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/geometry/delaunay.h"
#include "foam/model/activation.h"
#include "foam/model/model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "tests/street.h"
#include <Eigen/Core>

namespace semfoam {

// The foam of a street (tests/street.h), as large as it is asked for. Seven in ten sites lie within
// a thin layer on either side of the surfaces, the others in the air, as in trained foams. The
// street grows longer with `num_sites`, so that the cells stay as small as they are. SH degree 3,
// no statistics; labels 1 road, 2 wall, 3 house.
inline Model StreetFoam(int num_sites, uint64_t seed, int sites_per_length = 20000) {
  const float length = static_cast<float>(num_sites) / static_cast<float>(sites_per_length);
  std::mt19937_64 random(seed);
  // The standard's distributions differ between libraries.
  const auto uniform = [&] { return static_cast<float>(random() >> 40) * 0x1p-24f; };
  constexpr float kLayer = 0.04f;
  std::vector<Eigen::Vector3f> sites;
  while (static_cast<int>(sites.size()) < num_sites) {
    Eigen::Vector3f p{length * uniform(), 2 * uniform() - 1, 1.2f * uniform() - 0.2f};
    if (uniform() < 0.7f) {
      const float off = kLayer * (2 * uniform() - 1);
      const float choice = uniform();
      if (choice < 0.5f) {
        p.z() = off;
      } else if (choice < 0.7f) {
        p.y() = kWallFront + off;
        p.z() = kWallHeight * uniform();
      } else if (IsBesideHouse(p.x())) {
        p.y() = kHouseFront + off;
        p.z() = kHouseHeight * uniform();
      } else {
        continue;
      }
    }
    sites.push_back(p);
  }
  const std::vector<uint32_t> order = HilbertOrder(sites);

  Model model;
  // Within the far radius of the normalised frame, however long the street is.
  const float scale = std::min(1.f, 50 / length);
  model.world_from_normalized.scale = 1 / scale;
  Foam& foam = model.foam;
  foam.sh_degree = 3;
  foam.num_classes = 3;
  foam.classifier_bias.assign(3, 0.f);
  foam.classifier_weight.assign(3 * kIdentityDim, 0.f);
  const char* const names[] = {"road", "wall", "house"};
  for (int k = 0; k < 3; ++k) {
    foam.classifier_weight[k * kIdentityDim + k] = 1;
    model.labels.push_back({LabelId{1 + k}, static_cast<MaskId>(1 + k), names[k]});
  }
  for (const uint32_t site : order) {
    const Eigen::Vector3f& p = sites[site];
    const StreetPart part = StreetPartAt(p);
    foam.positions.push_back(scale * (p - Eigen::Vector3f(0.5f * length, 0, 0)));
    foam.raw_density.push_back(
        part == StreetPart::kAir ? -10.f : static_cast<float>(RawDensity(1e4 / scale)));
    for (int c = 0; c < foam.ShStride(); ++c) {
      foam.sh.push_back(c < 3 ? std::sin(3 * p[c]) : 0.f);
    }
    for (int d = 0; d < kIdentityDim; ++d)
      foam.identity.push_back(d == std::max(static_cast<int>(part), 0) ? 3.f : 0.f);
  }
  return model;
}

}  // namespace semfoam
