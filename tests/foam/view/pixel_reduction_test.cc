// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/view/pixel_reduction.h"

#include <gtest/gtest.h>

namespace semfoam {
namespace {

// One pixel of 2 x 2 rays.
RenderedView FourRays(const std::vector<float>& distances,
                      const std::vector<int32_t>& classes,
                      const std::vector<float>& confidences) {
  RenderedView fine;
  fine.width = fine.height = 2;
  for (int i = 0; i < 4; ++i) {
    fine.color.emplace_back(0.25f * i, 1.f, 0.f);
    fine.opacity.push_back(i < 2 ? 1.f : 0.5f);
  }
  fine.distance = distances;
  for (const int32_t c : classes) fine.class_index.push_back(ClassIndex{c});
  fine.confidence = confidences;
  return fine;
}

TEST(PixelReduction, ColorsAndOpacitiesAreMeans) {
  const RenderedView view = AverageRays(FourRays({0, 0, 0, 0}, {-1, -1, -1, -1}, {0, 0, 0, 0}), 2);
  ASSERT_EQ(view.width, 1);
  ASSERT_EQ(view.height, 1);
  EXPECT_EQ(view.color[0], Eigen::Vector3f(0.375f, 1.f, 0.f));
  EXPECT_EQ(view.opacity[0], 0.75f);
  EXPECT_EQ(view.distance[0], 0.f);
  EXPECT_EQ(view.class_index[0], kUnlabelled);
  EXPECT_EQ(view.confidence[0], 0.f);
}

TEST(PixelReduction, NoDepthLiesBetweenTwoSurfaces) {
  const auto depth = [](const std::vector<float>& distances) {
    return AverageRays(FourRays(distances, {-1, -1, -1, -1}, {0, 0, 0, 0}), 2).distance[0];
  };
  EXPECT_EQ(depth({1, 9, 9, 1}), 1.f);
  EXPECT_EQ(depth({9, 9, 1, 9}), 9.f);
  EXPECT_EQ(depth({0, 0, 7, 5}), 5.f);  // half of the rays end
  EXPECT_EQ(depth({0, 0, 7, 0}), 0.f);
}

TEST(PixelReduction, TheClassIsTheMostProbableOne) {
  const auto reduce = [](const std::vector<int32_t>& classes,
                         const std::vector<float>& confidences) {
    return AverageRays(FourRays({1, 1, 1, 1}, classes, confidences), 2);
  };
  RenderedView view = reduce({3, 1, 3, 2}, {0.5f, 0.75f, 0.5f, 0.25f});
  EXPECT_EQ(view.class_index[0], ClassIndex{3});
  EXPECT_EQ(view.confidence[0], 0.25f);  // 1 of 4
  view = reduce({3, 1, -1, -1}, {0.5f, 0.5f, 0.f, 0.f});
  EXPECT_EQ(view.class_index[0], ClassIndex{1}) << "the first of equals";
  EXPECT_EQ(view.confidence[0], 0.25f);
  EXPECT_EQ(reduce({3, -1, -1, -1}, {1, 0, 0, 0}).class_index[0], kUnlabelled);
}

TEST(PixelReduction, OneRayAPixelStaysAsItIs) {
  const RenderedView fine = FourRays({1, 0, 2, 3}, {0, -1, 4, 1}, {0.5f, 0, 1, 0.25f});
  const RenderedView view = AverageRays(fine, 1);
  EXPECT_EQ(view.color, fine.color);
  EXPECT_EQ(view.opacity, fine.opacity);
  EXPECT_EQ(view.distance, fine.distance);
  EXPECT_EQ(view.class_index, fine.class_index);
  EXPECT_EQ(view.confidence, fine.confidence);
}

}  // namespace
}  // namespace semfoam
