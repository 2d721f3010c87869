// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/view/pixel_reduction.h"

#include <gtest/gtest.h>

namespace semfoam {
namespace {

// A pixel of 2 x 2 rays.
RenderedView FourRays(const std::vector<int32_t>& classes, const std::vector<float>& confidences) {
  RenderedView fine;
  fine.width = fine.height = 2;
  for (int i = 0; i < 4; ++i) {
    fine.color.emplace_back(0.25f * i, 1.f, 0.f);
    fine.opacity.push_back(i < 2 ? 1.f : 0.5f);
    fine.distance.push_back(9);
    fine.class_index.push_back(ClassIndex{classes[i]});
  }
  fine.confidence = confidences;
  return fine;
}

// The pixel, rendered through its centre, with the rays averaged into it.
RenderedView Averaged(const RenderedView& fine) {
  RenderedView center;
  center.width = center.height = 1;
  center.color = {{1, 0, 1}};
  center.opacity = {1};
  center.distance = {7};
  center.class_index = {ClassIndex{5}};
  center.confidence = {1};
  AverageRays(fine, 2, &center);
  return center;
}

TEST(PixelReduction, ColorsAndOpacitiesAreMeansAndDistancesStay) {
  const RenderedView view = Averaged(FourRays({-1, -1, -1, -1}, {0, 0, 0, 0}));
  EXPECT_EQ(view.color[0], Eigen::Vector3f(0.375f, 1.f, 0.f));
  EXPECT_EQ(view.opacity[0], 0.75f);
  EXPECT_EQ(view.distance[0], 7.f);
  EXPECT_EQ(view.class_index[0], kUnlabelled);
  EXPECT_EQ(view.confidence[0], 0.f);
}

TEST(PixelReduction, TheClassIsTheMostProbableOne) {
  RenderedView view = Averaged(FourRays({3, 1, 3, 2}, {0.5f, 0.75f, 0.5f, 0.25f}));
  EXPECT_EQ(view.class_index[0], ClassIndex{3});
  EXPECT_EQ(view.confidence[0], 0.25f);  // 1 of 4
  view = Averaged(FourRays({3, 1, -1, -1}, {0.5f, 0.5f, 0.f, 0.f}));
  EXPECT_EQ(view.class_index[0], ClassIndex{1}) << "the first of equals";
  EXPECT_EQ(view.confidence[0], 0.25f);
  EXPECT_EQ(Averaged(FourRays({3, -1, -1, -1}, {1, 0, 0, 0})).class_index[0], kUnlabelled);
}

TEST(PixelReduction, OneRayAPixelStaysAsItIs) {
  const RenderedView fine = FourRays({0, -1, 4, 1}, {0.5f, 0, 1, 0.25f});
  RenderedView view = fine;
  AverageRays(fine, 1, &view);
  EXPECT_EQ(view.color, fine.color);
  EXPECT_EQ(view.opacity, fine.opacity);
  EXPECT_EQ(view.distance, fine.distance);
  EXPECT_EQ(view.class_index, fine.class_index);
  EXPECT_EQ(view.confidence, fine.confidence);
}

}  // namespace
}  // namespace semfoam
