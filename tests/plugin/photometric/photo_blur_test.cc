// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/photometric/photo_blur.h"

#include "plugin/photometric/effects.h"

#include <memory>
#include <vector>

#include "tests/plugin/photo/changed_photos.h"
#include "tests/plugin/photometric/tabletop_photos.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;
using testing::StartsWith;

// The tabletop with these photos blurred.
struct Shaken {
  explicit Shaken(const std::vector<int>& numbers) {
    WriteChangedWorkspace(TabletopPath(), folder / "w", {.shaken = numbers});
    scene = std::make_unique<TrainingScene>(PlanScene(PhotosOf(folder / "w")));
  }

  TempFolder folder;
  std::unique_ptr<TrainingScene> scene;
};

TEST(PhotoBlur, SharpPhotosAreSharp) {
  const PhotoBlur blur = FindBlurredPhotos(Tabletop());
  EXPECT_THAT(blur.blurred, IsEmpty());
  EXPECT_THAT(blur.PassesPerDraw(), IsEmpty());
  ASSERT_THAT(blur.contrasts, SizeIs(Tabletop().NumViews()));
  for (int view = 0; view < Tabletop().NumViews(); ++view) {
    ASSERT_EQ(blur.contrasts[view].has_value(), !Tabletop().IsHeldOut(view)) << view;
    if (!blur.contrasts[view]) continue;
    EXPECT_GT(*blur.contrasts[view], 0.7) << view;
    EXPECT_LT(*blur.contrasts[view], 1.5) << view;
  }
  EXPECT_THAT(blur.Report(Tabletop()), StartsWith("no photo; "));
}

// 16 is held out: nothing is asked of it.
TEST(PhotoBlur, BlurredPhotosAreFound) {
  const Shaken shaken({5, 16, 30, 43});
  const PhotoBlur blur = FindBlurredPhotos(*shaken.scene);
  EXPECT_THAT(blur.blurred, ElementsAre(5, 30, 43));
  const std::vector<int> passes = blur.PassesPerDraw();
  ASSERT_THAT(passes, SizeIs(64));
  for (int view = 0; view < 64; ++view) {
    EXPECT_EQ(passes[view], view == 5 || view == 30 || view == 43 ? kPassesOfBlurred : 1) << view;
    if (passes[view] == 1) {
      EXPECT_GT(blur.contrasts[view].value_or(1), 0.65) << view;
    }
  }
  const std::string report = blur.Report(*shaken.scene);
  EXPECT_THAT(report, StartsWith("3 of 56 photos have 0."));
  EXPECT_THAT(report, HasSubstr("0043.png"));
  EXPECT_THAT(report, Not(HasSubstr("0016.png")));
}

TEST(PhotoBlur, IsSimulatedUnlessSwitchedOff) {
  const Shaken shaken({30});
  const SceneEffects effects = ProbeEffects(*shaken.scene, {});
  EXPECT_TRUE(effects.Find("blur").on);
  EXPECT_THAT(effects.Find("blur").evidence, StartsWith("1 of 56 photos has 0."));
  ASSERT_THAT(effects.passes_per_draw, SizeIs(64));
  shaken.scene->SetPassesPerDraw(effects.passes_per_draw);
  EXPECT_EQ(shaken.scene->PassesPerDraw(30), kPassesOfBlurred);
  EXPECT_EQ(shaken.scene->PassesPerDraw(29), 1);
  const SceneEffects off = ProbeEffects(*shaken.scene, {.blur = false});
  EXPECT_FALSE(off.Find("blur").on);
  EXPECT_TRUE(off.Find("blur").by_option);
  EXPECT_THAT(off.passes_per_draw, IsEmpty());
}

// What is too bright for a photo has no contrast in it, and so it has no say.
TEST(PhotoBlur, WronglyExposedPhotosAreNotBlurred) {
  const TempFolder folder;
  WriteChangedWorkspace(TabletopPath(), folder / "w", {.exposure = 0.6, .seed = 1});
  const TrainingScene scene(PlanScene(PhotosOf(folder / "w")));
  const PhotoBlur blur = FindBlurredPhotos(scene);
  EXPECT_THAT(blur.blurred, IsEmpty()) << blur.Report(scene);
}

// Where so many are soft, the others are no measure.
TEST(PhotoBlur, ManyBlurredPhotosAreLeftAsTheyAre) {
  std::vector<int> third;
  for (int number = 1; number < 64; number += 3) third.push_back(number);
  const Shaken shaken(third);
  const PhotoBlur blur = FindBlurredPhotos(*shaken.scene);
  int soft = 0;
  for (const std::optional<double>& contrast : blur.contrasts) {
    soft += contrast && *contrast < kBlurredContrast;
  }
  EXPECT_GT(soft, 56 / 4);
  EXPECT_EQ(blur.num_soft, soft);
  EXPECT_THAT(blur.blurred, IsEmpty());
  EXPECT_THAT(blur.Report(*shaken.scene), HasSubstr(" of 56 photos have less than 0.5 "));
}

}  // namespace
}  // namespace semfoam
