// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/edit/class_table.h"

#include "foam/model/classifier.h"
#include "foam/util/error.h"

#include <vector>

#include "tests/foam/edit/object_scenes.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

MostLikelyClass Classify(const Foam& foam, const float* identity) {
  std::vector<float> logits(foam.num_classes);
  ClassLogits(foam, identity, logits.data());
  return ArgmaxSoftmax(logits);
}

// A classifier and features as training leaves them: neither axis-aligned nor of one length.
Model RandomClasses(int num_classes, int num_sites) {
  Model model;
  Foam& foam = model.foam;
  foam.num_classes = num_classes;
  for (int k = 0; k < num_classes; ++k) {
    CounterRandom random(1, 1, k);
    model.labels.push_back({LabelId{k + 1}, static_cast<MaskId>(k + 1), "label"});
    for (int c = 0; c < kIdentityDim; ++c) {
      foam.classifier_weight.push_back(static_cast<float>(random.Normal()));
    }
    foam.classifier_bias.push_back(static_cast<float>(0.5 * random.Normal()));
  }
  for (int i = 0; i < num_sites; ++i) {
    CounterRandom random(1, 2, i);
    const float* row = &foam.classifier_weight[(i % num_classes) * kIdentityDim];
    for (int c = 0; c < kIdentityDim; ++c) {
      foam.identity.push_back(static_cast<float>(0.5 * row[c] + 0.3 * random.Normal()));
    }
    foam.positions.emplace_back(0.f, 0.f, 0.f);
  }
  return model;
}

TEST(ClassTableAdd, CellsKeepTheirClassesAndNewOnesGetTheirs) {
  for (const int num_classes : {1, 2, 14, 40}) {
    Model model = RandomClasses(num_classes, 500);
    const Foam before = model.foam;
    std::vector<IdentityFeature> added;
    // More classes than the feature has dimensions.
    for (int32_t k = 0; k < 20; ++k) {
      const int32_t id = 1000 + k;
      added.push_back(AddClass({LabelId{id}, static_cast<MaskId>(id), "new"}, &model));
      ASSERT_EQ(model.foam.num_classes, num_classes + k + 1);
      EXPECT_EQ(model.labels.back().id, LabelId{id});
      // Cells of the new class, for the next ones to spare.
      model.foam.positions.emplace_back(0.f, 0.f, 0.f);
      model.foam.identity.insert(
          model.foam.identity.end(), added.back().begin(), added.back().end());
    }
    for (size_t k = 0; k < added.size(); ++k) {
      const MostLikelyClass best = Classify(model.foam, added[k].data());
      EXPECT_EQ(best.class_index, num_classes + static_cast<int32_t>(k));
      EXPECT_GT(best.confidence, 0.99f);
    }
    for (size_t i = 0; i < before.NumSites(); ++i) {
      const float* feature = &before.identity[i * kIdentityDim];
      const MostLikelyClass was = Classify(before, feature), is = Classify(model.foam, feature);
      ASSERT_EQ(is.class_index, was.class_index) << i;
      ASSERT_NEAR(is.confidence, was.confidence, 2e-3) << i;
    }
  }
}

TEST(ClassTableAdd, ARayShowsTheNewClassWhereItHasMostOfTheWeight) {
  Model model = RandomClasses(14, 500);
  const Foam before = model.foam;
  const IdentityFeature added = AddClass({LabelId{99}, MaskId{99}, "new"}, &model);
  for (size_t i = 0; i < before.NumSites(); ++i) {
    for (const float share : {0.1f, 0.2f, 0.8f, 1.f}) {
      float mixed[kIdentityDim];
      for (int c = 0; c < kIdentityDim; ++c) {
        mixed[c] = share * added[c] + (1 - share) * before.identity[i * kIdentityDim + c];
      }
      EXPECT_EQ(Classify(model.foam, mixed).class_index == 14, share > 0.5f) << share;
    }
  }
  // Half transparent matter, and nothing behind it.
  float dimmed[kIdentityDim];
  for (int c = 0; c < kIdentityDim; ++c) dimmed[c] = 0.6f * added[c];
  EXPECT_EQ(Classify(model.foam, dimmed).class_index, 14);
  EXPECT_NE(Classify(model.foam, std::vector<float>(kIdentityDim).data()).class_index, 14);
}

// A cell far off along every direction neither makes the new feature as long, nor loses its class.
TEST(ClassTableAdd, AnOutlierIsShortened) {
  Model model = RandomClasses(14, 5000);
  for (int c = 0; c < kIdentityDim; ++c) {
    model.foam.identity[c] = 40 * model.foam.classifier_weight[c];
  }
  const Foam before = model.foam;
  const IdentityFeature added = AddClass({LabelId{99}, MaskId{99}, "new"}, &model);
  float squared = 0;
  for (const float value : added) squared += value * value;
  EXPECT_LT(squared, 15 * 15);
  int changed = 0;
  for (size_t i = 0; i < before.NumSites(); ++i) {
    const float* old_feature = &before.identity[i * kIdentityDim];
    const float* feature = &model.foam.identity[i * kIdentityDim];
    changed += !std::equal(feature, feature + kIdentityDim, old_feature);
    ASSERT_EQ(Classify(model.foam, feature).class_index, Classify(before, old_feature).class_index);
  }
  EXPECT_GE(changed, 1);
  EXPECT_LE(changed, 5);
}

TEST(ClassTableAdd, WithoutSemanticsWhatWasThereIsUnlabelled) {
  Model model = ModelOf(RandomSites(50, 1), 0, 0, [](const Eigen::Vector3f&) { return 0; });
  ASSERT_FALSE(model.foam.HasSemantics());
  const IdentityFeature added = AddClass({LabelId{5}, MaskId{5}, "mug"}, &model);
  ASSERT_EQ(model.foam.num_classes, 2);
  EXPECT_EQ(model.labels[0].id, LabelId{0});
  EXPECT_EQ(model.labels[1].id, LabelId{5});
  ASSERT_EQ(model.foam.identity.size(), 50u * kIdentityDim);
  EXPECT_EQ(Classify(model.foam, model.foam.identity.data()).class_index, 0);
  EXPECT_EQ(Classify(model.foam, added.data()).class_index, 1);
}

TEST(ClassTableKeep, CellsOfTheOthersFallToTheLikeliestThatIsKept) {
  Model model = RandomClasses(5, 200);
  const Foam before = model.foam;
  KeepClasses({ClassIndex{4}, ClassIndex{1}}, &model);
  ASSERT_EQ(model.foam.num_classes, 2);
  EXPECT_EQ(model.labels[0].id, LabelId{5});
  EXPECT_EQ(model.labels[1].id, LabelId{2});
  for (size_t i = 0; i < before.NumSites(); ++i) {
    const float* feature = &before.identity[i * kIdentityDim];
    std::vector<float> logits(5);
    ClassLogits(before, feature, logits.data());
    EXPECT_EQ(Classify(model.foam, feature).class_index, logits[4] >= logits[1] ? 0 : 1);
  }
  KeepClasses({}, &model);
  EXPECT_FALSE(model.foam.HasSemantics());
  EXPECT_TRUE(model.foam.identity.empty());
  EXPECT_TRUE(model.labels.empty());
}

TEST(ClassTableWithFreeId, KeepsTheIdOrTakesTheSmallestThatIsFree) {
  const std::vector<Label> labels = {{LabelId{0}, MaskId{0}, ""},
                                     {LabelId{1}, MaskId{1}, "a"},
                                     {LabelId{2}, MaskId{2}, "b"},
                                     {LabelId{4}, MaskId{4}, "mug"}};
  EXPECT_EQ(WithFreeId(labels, {LabelId{7}, MaskId{7}, "mug"}).id, LabelId{7});
  const Label moved = WithFreeId(labels, {LabelId{4}, MaskId{81234}, "mug"});
  EXPECT_EQ(moved.id, LabelId{3});
  EXPECT_EQ(moved.source_id, MaskId{81234});
  EXPECT_EQ(moved.name, "mug");
  std::vector<Label> all;
  for (int32_t id = 1; id <= 65535; ++id) all.push_back({LabelId{id}, MaskId{0}, ""});
  EXPECT_THROW(WithFreeId(all, {LabelId{4}, MaskId{4}, ""}), UserError);
}

// One label for each of `num_sites` cells in turn, every eleventh cell unlabelled.
Model WithClasses(int num_labels, int num_sites) {
  Model model;
  model.foam.positions.assign(num_sites, Eigen::Vector3f::Zero());
  std::vector<Label> labels;
  for (int k = 0; k < num_labels; ++k) {
    labels.push_back({LabelId{k + 5}, static_cast<MaskId>(k + 5), "label"});
  }
  std::vector<ClassIndex> classes;
  for (int i = 0; i < num_sites; ++i) {
    classes.push_back(i % 11 == 0 ? kUnlabelled : ClassIndex{i % num_labels});
  }
  SetClasses(labels, classes, &model);
  return model;
}

TEST(SetClasses, GivesEachCellItsLabel) {
  for (const int num_labels : {1, 16, 17, 120}) {
    const Model model = WithClasses(num_labels, 300);
    ASSERT_EQ(model.labels.size(), static_cast<size_t>(num_labels + 1));
    for (int i = 0; i < 300; ++i) {
      const MostLikelyClass found = Classify(model.foam, &model.foam.identity[i * kIdentityDim]);
      const int32_t expected = i % 11 == 0 ? 0 : i % num_labels + 5;
      EXPECT_EQ(Value(model.labels[found.class_index].id), expected) << num_labels;
      EXPECT_GT(found.confidence, 0.99);
    }
  }
}

TEST(SetClasses, ARayBelongsToTheClassWithTheMostWeight) {
  const Model model = WithClasses(40, 41);
  for (int a = 1; a < 40; ++a) {
    const int b = a % 39 + 1;
    if (a % 11 == 0 || b % 11 == 0) continue;
    const float* of_a = &model.foam.identity[a * kIdentityDim];
    const float* of_b = &model.foam.identity[b * kIdentityDim];
    float both[kIdentityDim], little[kIdentityDim];
    for (int c = 0; c < kIdentityDim; ++c) {
      both[c] = 0.7f * of_a[c] + 0.3f * of_b[c];
      little[c] = 0.15f * of_a[c];
    }
    EXPECT_EQ(Value(model.labels[Classify(model.foam, both).class_index].id), a + 5);
    EXPECT_EQ(Value(model.labels[Classify(model.foam, little).class_index].id), 0);
  }
}

}  // namespace
}  // namespace semfoam
