// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/exportable_scene.h"
#include "foam/model/activation.h"
#include "foam/model/model.h"

#include <cmath>
#include <filesystem>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <gtest/gtest.h>
#include <unistd.h>

namespace semfoam {

inline constexpr int kAir = -1;

// A model whose cells are what `class_of` says of their sites: matter of class 0, 1, ... (label ids
// 7, 8, ...), or air. Matter is solid beyond doubt, air empty beyond doubt; colours depend on the
// place. No statistics, so every cell counts as photographed.
inline Model MakeModel(const std::vector<Eigen::Vector3f>& sites,
                       int num_classes,
                       const std::function<int(const Eigen::Vector3f&)>& class_of) {
  Model model;
  Foam& foam = model.foam;
  foam.positions = sites;
  foam.num_classes = num_classes;
  foam.classifier_bias.assign(num_classes, 0.f);
  foam.classifier_weight.assign(num_classes * kIdentityDim, 0.f);
  for (int k = 0; k < num_classes; ++k) {
    foam.classifier_weight[k * kIdentityDim + k] = 1;
    model.labels.push_back({LabelId{7 + k}, static_cast<MaskId>(7 + k), k == 0 ? "mug" : ""});
  }
  for (size_t i = 0; i < sites.size(); ++i) {
    const int k = class_of(sites[i]);
    foam.raw_density.push_back(k == kAir ? -10.f : static_cast<float>(RawDensity(1e4)));
    for (int c = 0; c < 3; ++c) foam.sh.push_back(std::sin(3 * sites[i][c]));
    for (int d = 0; d < kIdentityDim; ++d) {
      foam.identity.push_back(d == std::max(k, 0) ? 3 + 0.5f * std::sin(sites[i].x()) : 0.f);
    }
  }
  return model;
}

inline std::vector<Eigen::Vector3f> RandomSites(int count, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> coordinate(-1, 1);
  std::vector<Eigen::Vector3f> sites;
  for (int i = 0; i < count; ++i) {
    const float x = coordinate(random), y = coordinate(random), z = coordinate(random);
    sites.emplace_back(x, y, z);
  }
  return sites;
}

// size^3 sites, `spacing` apart, centred on the origin, each moved by up to `jitter` of the
// spacing. Without jitter and with a spacing that is a power of two the sites are exactly
// cospherical.
inline std::vector<Eigen::Vector3f> GridSites(int size,
                                              float spacing,
                                              float jitter,
                                              unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> move(-jitter, jitter);
  std::vector<Eigen::Vector3f> sites;
  for (int x = 0; x < size; ++x) {
    for (int y = 0; y < size; ++y) {
      for (int z = 0; z < size; ++z) {
        Eigen::Vector3f site =
            Eigen::Vector3f(x, y, z) - Eigen::Vector3f::Constant(0.5f * (size - 1));
        // One after the other: compilers differ in the order of a call's arguments.
        for (int a = 2; jitter > 0 && a >= 0; --a) site[a] += move(random);
        sites.push_back(spacing * site);
      }
    }
  }
  return sites;
}

// Two balls of different classes that touch, in random sites.
inline Model TouchingBalls(int count = 3000) {
  return MakeModel(RandomSites(count, 1), 2, [](const Eigen::Vector3f& p) {
    if ((p - Eigen::Vector3f(-0.3f, 0, 0)).norm() < 0.3f) return 0;
    if ((p - Eigen::Vector3f(0.3f, 0, 0)).norm() < 0.3f) return 1;
    return kAir;
  });
}

// A ring around the z axis.
inline Model Torus() {
  return MakeModel(GridSites(22, 0.09f, 0.2f, 4), 1, [](const Eigen::Vector3f& p) {
    const float ring = p.head<2>().norm() - 0.6f;
    return std::hypot(ring, p.z()) < 0.25f ? 0 : kAir;
  });
}

// The hardest labelling: every cell within a ball draws one of three classes or air by lot, so
// objects are crumbs that touch in faces, edges and vertices, with themselves and with others.
inline Model ClassesByLot(unsigned seed) {
  std::mt19937 random(seed);
  return MakeModel(RandomSites(2000, seed), 3, [&](const Eigen::Vector3f& p) {
    const int k = static_cast<int>(random() % 4);
    return p.norm() < 0.7f && k < 3 ? k : kAir;
  });
}

// Exact grids, where eight cells meet in every corner and circumcentres coincide: a cube, and two
// classes by lot.
inline Model CubeInAGrid() {
  return MakeModel(GridSites(8, 0.25f, 0, 0), 1, [](const Eigen::Vector3f& p) {
    return p.cwiseAbs().maxCoeff() < 0.5f ? 0 : kAir;
  });
}
inline Model LotsInAGrid() {
  std::mt19937 random(5);
  return MakeModel(GridSites(10, 0.125f, 0, 0), 2, [&](const Eigen::Vector3f& p) {
    const int k = static_cast<int>(random() % 3);
    return p.cwiseAbs().maxCoeff() < 0.5f && k < 2 ? k : kAir;
  });
}
// Nearly cospherical sites: slivers of every kind.
inline Model BallInANearGrid() {
  return MakeModel(GridSites(10, 0.125f, 1e-3f, 3), 1, [](const Eigen::Vector3f& p) {
    return p.norm() < 0.4f ? 0 : kAir;
  });
}

// A folder of its own for each test, removed at its end.
class TemporaryFolderTest : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
    folder_ = std::filesystem::temp_directory_path() /
              (std::string("semfoam_") + info->test_suite_name() + "_" + info->name() + "_" +
               std::to_string(::getpid()));
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path folder_;
};

}  // namespace semfoam
