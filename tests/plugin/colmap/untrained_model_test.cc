// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/colmap/untrained_model.h"

#include "foam/model/spherical_harmonics.h"
#include "foam/util/error.h"

#include <algorithm>
#include <filesystem>

#include <gtest/gtest.h>

namespace semfoam {
namespace {

const std::filesystem::path kModel = SEMFOAM_TEST_DATA "/tabletop/sparse/0";

TEST(UntrainedModel, HasACellAtEveryPointInItsColor) {
  const Reconstruction reconstruction = ReadReconstruction(kModel);
  const Model model = UntrainedModel(reconstruction, kModel, 0);
  EXPECT_EQ(model.photos.size(), reconstruction.images.size());
  EXPECT_TRUE(std::is_sorted(model.photos.begin(),
                             model.photos.end(),
                             [](const auto& a, const auto& b) { return a.name < b.name; }));
  EXPECT_FALSE(model.foam.HasSemantics());
  int found = 0;
  for (size_t k = 0; k < reconstruction.points.size(); k += 100) {
    const Point3D& point = reconstruction.points[k];
    for (size_t i = 0; i < model.foam.NumSites(); ++i) {
      const Eigen::Vector3d world =
          model.world_from_normalized.Apply(model.foam.positions[i].cast<double>());
      if ((world - point.position).norm() > 1e-5) continue;
      ++found;
      for (int c = 0; c < 3; ++c) {
        EXPECT_NEAR(0.5 + kShDc * model.foam.sh[3 * i + c], point.color[c] / 255.0, 1e-5);
      }
      break;
    }
  }
  EXPECT_GT(found, 50);
  EXPECT_EQ(found, static_cast<int>((reconstruction.points.size() + 99) / 100));
}

TEST(UntrainedModel, WantsImages) {
  Reconstruction reconstruction = ReadReconstruction(kModel);
  reconstruction.images.clear();
  EXPECT_THROW(UntrainedModel(reconstruction, kModel, 0), UserError);
  // Without points it is space around the cameras.
  reconstruction = ReadReconstruction(kModel);
  reconstruction.points.clear();
  EXPECT_GT(UntrainedModel(reconstruction, kModel, 0).foam.NumSites(), 1000);
}

}  // namespace
}  // namespace semfoam
