// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/model/sh_rotation.h"

#include "foam/model/foam.h"
#include "foam/model/spherical_harmonics.h"
#include "foam/util/random_vectors.h"

#include <cmath>
#include <vector>

#include "tests/foam/random_cells.h"
#include <Eigen/Geometry>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

Eigen::Matrix3d RandomRotation(CounterRandom* random) {
  const double w = random->Normal();
  const Eigen::Vector3d v = NormalVector(random);
  return Eigen::Quaterniond(w, v.x(), v.y(), v.z()).normalized().toRotationMatrix();
}

std::vector<double> Color(int degree, const std::vector<float>& sh, const Eigen::Vector3d& d) {
  std::vector<double> basis(NumShCoefficients(degree)), color(3);
  ShBasis(degree, d, basis.data());
  for (size_t k = 0; k < basis.size(); ++k) {
    for (int c = 0; c < 3; ++c) color[c] += basis[k] * sh[3 * k + c];
  }
  return color;
}

TEST(ShRotation, ShowsAlongTheTurnedDirectionWhatItShowedBefore) {
  for (int degree = 0; degree <= 3; ++degree) {
    for (int trial = 0; trial < 20; ++trial) {
      CounterRandom random(3, degree, trial);
      const Eigen::Matrix3d rotation = RandomRotation(&random);
      std::vector<float> sh(3 * NumShCoefficients(degree));
      for (float& value : sh) value = static_cast<float>(0.3 * random.Normal());
      std::vector<float> turned = sh;
      ShRotation(degree, rotation).Apply(turned.data());
      for (int k = 0; k < 10; ++k) {
        const Eigen::Vector3d d = RandomDirection(&random);
        const std::vector<double> before = Color(degree, sh, d);
        const std::vector<double> after = Color(degree, turned, rotation * d);
        for (int c = 0; c < 3; ++c) EXPECT_NEAR(after[c], before[c], 1e-6) << degree;
      }
    }
  }
}

TEST(ShRotation, TurnsAddUp) {
  CounterRandom random(4, 0, 0);
  const Eigen::Matrix3d first = RandomRotation(&random), second = RandomRotation(&random);
  std::vector<float> in_steps(48), at_once;
  for (float& value : in_steps) value = static_cast<float>(random.Normal());
  at_once = in_steps;
  ShRotation(3, first).Apply(in_steps.data());
  ShRotation(3, second).Apply(in_steps.data());
  ShRotation(3, second * first).Apply(at_once.data());
  for (int i = 0; i < 48; ++i) EXPECT_NEAR(in_steps[i], at_once[i], 2e-6);
}

TEST(ShRotation, LeavesTheConstantTermAlone) {
  CounterRandom random(5, 0, 0);
  std::vector<float> sh = {0.1f, 0.2f, 0.3f};
  ShRotation(0, RandomRotation(&random)).Apply(sh.data());
  EXPECT_EQ(sh, (std::vector<float>{0.1f, 0.2f, 0.3f}));
}

}  // namespace
}  // namespace semfoam
