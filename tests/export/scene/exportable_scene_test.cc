// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/scene/exportable_scene.h"

#include "export/scene/names.h"

#include <algorithm>
#include <map>

#include "tests/export/test_foams.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

const ObjectInfo& Object(const ExportableScene& scene, int32_t id) {
  for (const ObjectInfo& object : scene.objects) {
    if (Value(object.id) == id) return object;
  }
  ADD_FAILURE() << "no object " << id;
  return scene.objects.front();
}

uint32_t CellAt(const ExportableScene& scene, const Eigen::Vector3d& place) {
  return NearestCell(scene.cell_positions, scene.delaunay, place, 0);
}

// A grid of 16^3 cells, 1/8 apart, whose coordinates are -15/16, -13/16, .., 15/16.
Model GridModel(int num_classes, const std::function<int(const Eigen::Vector3f&)>& class_of) {
  return MakeModel(GridSites(16, 0.125f, 0, 0), num_classes, class_of);
}

// The cells of a ball of radius 1/2; those within `hollow` of the centre are air.
Model HollowBall(float hollow) {
  return GridModel(1, [hollow](const Eigen::Vector3f& p) {
    return p.norm() < 0.5f && p.norm() >= hollow ? 0 : kAir;
  });
}

TEST(ExportableScene, ObjectsAreTheSolidCellsOfTheirClass) {
  const Model model = TouchingBalls();
  const ExportableScene scene = MakeExportableScene(model);
  ASSERT_EQ(scene.objects.size(), 2u);
  EXPECT_THAT(scene.labels_without_cells, IsEmpty());
  for (int k = 0; k < 2; ++k) {
    const ObjectInfo& object = scene.objects[k];
    EXPECT_EQ(object.id, LabelId{7 + k});
    EXPECT_EQ(object.color, LabelColor(LabelId{7 + k}));
    std::vector<uint32_t> expected;
    double volume = 0;
    for (uint32_t i = 0; i < scene.NumSites(); ++i) {
      const Eigen::Vector3f center(k == 0 ? -0.3f : 0.3f, 0, 0);
      if ((scene.cell_positions[i] - center).norm() >= 0.3f) continue;
      expected.push_back(i);
      volume += scene.volume[i];
      EXPECT_EQ(scene.label_id[i], LabelId{7 + k});
    }
    EXPECT_EQ(object.cells, expected);
    EXPECT_DOUBLE_EQ(object.volume, volume);
    EXPECT_GT(object.confidence, 0.5);
    EXPECT_LE(object.confidence, 1);
  }
  EXPECT_EQ(scene.objects[0].name, "mug");
  EXPECT_EQ(scene.objects[0].file_stem, "7_mug");
  EXPECT_EQ(scene.objects[1].name, "label_8");
  EXPECT_EQ(scene.objects[1].file_stem, "8_label_8");
}

TEST(ExportableScene, MeasuresInWorldUnits) {
  Model model = GridModel(1, [](const Eigen::Vector3f& p) {
    return std::abs(p.x()) < 0.25f && std::abs(p.y()) < 0.5f && std::abs(p.z()) < 0.125f ? 0 : kAir;
  });
  model.world_from_normalized = {4, {5e5, 4.5e6, 100}};
  const ExportableScene scene = MakeExportableScene(model);
  const ObjectInfo& box = Object(scene, 7);
  EXPECT_EQ(box.cells.size(), 4u * 8 * 2);
  EXPECT_NEAR(box.volume, 2 * 4 * 1, 1e-5);
  EXPECT_TRUE(box.bounding_box.min().isApprox(Eigen::Vector3d(5e5 - 1, 4.5e6 - 2, 99.5), 1e-14));
  EXPECT_TRUE(box.bounding_box.max().isApprox(Eigen::Vector3d(5e5 + 1, 4.5e6 + 2, 100.5), 1e-14));
}

TEST(ExportableScene, LabelZeroAndEmptyLabelsMakeNoObject) {
  Model model = GridModel(3, [](const Eigen::Vector3f& p) {
    if (p.norm() > 0.5f) return kAir;
    return p.x() > 0 ? 1 : 2;  // nothing of class 0
  });
  model.labels[2] = {LabelId{0}, MaskId{0}, ""};
  const ExportableScene scene = MakeExportableScene(model);
  ASSERT_EQ(scene.objects.size(), 1u);
  EXPECT_EQ(scene.objects[0].id, LabelId{8});
  ASSERT_EQ(scene.labels_without_cells.size(), 1u);
  EXPECT_EQ(scene.labels_without_cells[0].id, LabelId{7});
}

TEST(ExportableScene, ObjectsComeByIdWhateverTheOrderOfTheTable) {
  Model model = TouchingBalls(500);
  model.labels[0].id = LabelId{300};
  model.labels[1].id = LabelId{2};
  const ExportableScene scene = MakeExportableScene(model);
  ASSERT_EQ(scene.objects.size(), 2u);
  EXPECT_EQ(scene.objects[0].id, LabelId{2});
  EXPECT_EQ(scene.objects[1].id, LabelId{300});
  for (uint32_t i = 0; i < scene.NumSites(); ++i) {
    const int32_t index = scene.object_of_cell[i];
    if (index >= 0) {
      EXPECT_EQ(scene.objects[index].id, scene.label_id[i]);
    }
  }
}

TEST(ExportableScene, WithoutSemanticsThereAreNoObjects) {
  Model model = TouchingBalls(500);
  model.foam.num_classes = 0;
  model.foam.identity.clear();
  model.foam.classifier_bias.clear();
  model.foam.classifier_weight.clear();
  model.labels.clear();
  const ExportableScene scene = MakeExportableScene(model);
  EXPECT_THAT(scene.objects, IsEmpty());
  EXPECT_THAT(scene.labels_without_cells, IsEmpty());
  EXPECT_EQ(scene.label_id, std::vector<LabelId>(500, kNoObject));
}

TEST(ExportableScene, SitesAtOnePlaceHaveOneCellBetweenThem) {
  Model model = TouchingBalls(500);
  const ExportableScene before = MakeExportableScene(model);
  // Every site a second time.
  const Foam once = model.foam;
  const auto twice = [](auto& array, const auto& part) {
    array.insert(array.end(), part.begin(), part.end());
  };
  twice(model.foam.positions, once.positions);
  twice(model.foam.raw_density, once.raw_density);
  twice(model.foam.sh, once.sh);
  twice(model.foam.identity, once.identity);
  const ExportableScene scene = MakeExportableScene(model);
  ASSERT_EQ(scene.objects.size(), before.objects.size());
  for (size_t k = 0; k < scene.objects.size(); ++k) {
    EXPECT_EQ(scene.objects[k].cells, before.objects[k].cells);
  }
}

TEST(ExportableScene, AnEnclosedPocketBelongsToTheObject) {
  const ExportableScene full = MakeExportableScene(HollowBall(0));
  const ExportableScene hollow = MakeExportableScene(HollowBall(0.3f));
  EXPECT_EQ(Object(hollow, 7).cells, Object(full, 7).cells);
  // Its confidence is that of the shell: the pocket has a class of no meaning.
  EXPECT_GT(Object(hollow, 7).confidence, 0.9);

  ExportableSceneOptions options;
  options.fill_hidden_space = false;
  const ExportableScene shell = MakeExportableScene(HollowBall(0.3f), options);
  EXPECT_LT(Object(shell, 7).cells.size(), Object(full, 7).cells.size());
}

TEST(ExportableScene, APocketWithAnOpeningIsNotFilled) {
  const auto mug = [](const Eigen::Vector3f& p) {
    const bool opening = std::abs(p.x()) < 0.1f && std::abs(p.y()) < 0.1f && p.z() > 0;
    return p.norm() < 0.5f && p.norm() >= 0.3f && !opening ? 0 : kAir;
  };
  const Model model = GridModel(1, mug);
  const ExportableScene scene = MakeExportableScene(model);
  for (const uint32_t cell : Object(scene, 7).cells) {
    EXPECT_EQ(mug(scene.cell_positions[cell]), 0);
  }
}

TEST(ExportableScene, ARoomIsNotFilledByItsWalls) {
  // A camera stands in the hollow.
  Model model = HollowBall(0.3f);
  model.world_from_normalized = {2, {10, 20, 30}};
  PhotoRecord photo;
  photo.cam_from_world_rotation = Eigen::AngleAxisd(1, Eigen::Vector3d::UnitY());
  const Eigen::Vector3d center_in_world = model.world_from_normalized.Apply({0.1, 0, -0.1});
  photo.cam_from_world_translation = -(photo.cam_from_world_rotation * center_in_world);
  model.photos.push_back(photo);
  const ExportableScene with_camera = MakeExportableScene(model);
  const uint32_t middle = CellAt(with_camera, {0.06, 0.06, 0.06});
  EXPECT_EQ(with_camera.object_of_cell[middle], -1);
  model.photos.clear();
  EXPECT_EQ(MakeExportableScene(model).object_of_cell[middle], 0);

  // Something photographed stands in the hollow: a single cell of another class.
  const Model furnished = GridModel(2, [](const Eigen::Vector3f& p) {
    if (p.norm() < 0.11f && p.minCoeff() > 0) return 1;
    return p.norm() < 0.5f && p.norm() >= 0.3f ? 0 : kAir;
  });
  const ExportableScene room = MakeExportableScene(furnished);
  EXPECT_EQ(Object(room, 8).cells.size(), 1u);
  EXPECT_EQ(room.object_of_cell[CellAt(room, {-0.06, -0.06, -0.06})], -1);
}

// A ball of class 0 that stands on a slab of class 1, in a foam that knows what rays said: a shell
// that is open below, and haze of the ball's class beside it. Nobody has seen the ball's inside,
// nor what is under the slab.
Model BallOnSlab() {
  const auto in_ball = [](const Eigen::Vector3f& p) { return p.norm() < 0.5f; };
  const auto in_hollow = [](const Eigen::Vector3f& p) {
    return p.norm() < 0.3f ||
           (p.norm() < 0.5f && std::abs(p.x()) < 0.1f && std::abs(p.y()) < 0.1f && p.z() < 0);
  };
  const auto in_haze = [](const Eigen::Vector3f& p) {
    return p.x() > 0.5f && p.x() < 0.7f && std::abs(p.y()) < 0.1f && std::abs(p.z()) < 0.1f;
  };
  Model model = GridModel(2, [&](const Eigen::Vector3f& p) {
    if (in_hollow(p)) return kAir;
    if (in_ball(p) || in_haze(p)) return 0;
    return p.z() < -0.5f && p.z() > -0.75f ? 1 : kAir;
  });
  for (const Eigen::Vector3f& p : model.foam.positions) {
    const bool is_unseen = in_hollow(p) || p.z() < -0.75f;
    const bool is_matter = !is_unseen && (in_ball(p) || p.z() < -0.5f);
    model.statistics.contribution.push_back(is_matter ? 0.8f : in_haze(p) ? 0.2f : 0.f);
    model.statistics.mean_color.push_back({0.5f, 0.5f, 0.5f});
    // A few rays have lost their way into the hollow.
    model.statistics.passed.push_back(is_unseen ? 3.f : is_matter ? 5.f : 100.f);
    model.statistics.stopped.push_back(is_unseen ? 0.f : is_matter ? 100.f : 2.f);
  }
  return model;
}

TEST(ExportableScene, WhatNobodyHasSeenInsideIsTheObjects) {
  const Model model = BallOnSlab();
  const ExportableScene scene = MakeExportableScene(model);
  EXPECT_EQ(Object(scene, 7).cells, Object(MakeExportableScene(HollowBall(0)), 7).cells);
  // The slab is as thick as it was; under it, and in the ball, nothing is its.
  for (const uint32_t cell : Object(scene, 8).cells) {
    const float z = scene.cell_positions[cell].z();
    EXPECT_TRUE(z < -0.5f && z > -0.75f) << z;
  }
  EXPECT_EQ(Object(scene, 8).cells.size(), 2u * 16 * 16);

  ExportableSceneOptions options;
  options.fill_hidden_space = false;
  const ExportableScene hollow = MakeExportableScene(model, options);
  EXPECT_EQ(hollow.object_of_cell[CellAt(hollow, {0.06, 0.06, 0.06})], -1);
  // Three looks are enough to know it for empty, if one says so.
  options = {};
  options.fewest_looks = 2;
  const ExportableScene seen = MakeExportableScene(model, options);
  EXPECT_EQ(seen.object_of_cell[CellAt(seen, {0.06, 0.06, 0.06})], -1);
}

TEST(ExportableScene, HazeIsNoMatter) {
  Model model = BallOnSlab();
  const Eigen::Vector3d haze(0.56, 0.06, 0.06);
  const ExportableScene scene = MakeExportableScene(model);
  EXPECT_EQ(scene.labels.solid[CellAt(scene, haze)], 1);
  EXPECT_EQ(scene.object_of_cell[CellAt(scene, haze)], -1);
  // Without what rays said, it is dense enough.
  model.statistics.passed.clear();
  model.statistics.stopped.clear();
  const ExportableScene unknown = MakeExportableScene(model);
  EXPECT_EQ(unknown.object_of_cell[CellAt(unknown, haze)], 0);
  // And a hollow with an opening is open.
  EXPECT_EQ(unknown.object_of_cell[CellAt(unknown, {0.06, 0.06, 0.06})], -1);
}

TEST(ExportableScene, UnseenMatterCountsOnlyWhereItHangsTogetherWithSeenMatter) {
  // A ball whose outer shell alone is photographed, and a second one that nobody has seen.
  const auto second = [](const Eigen::Vector3f& p) {
    return (p - Eigen::Vector3f::Constant(0.7f)).norm() < 0.2f;
  };
  Model model = GridModel(
      1, [&](const Eigen::Vector3f& p) { return p.norm() < 0.5f || second(p) ? 0 : kAir; });
  for (const Eigen::Vector3f& p : model.foam.positions) {
    model.statistics.contribution.push_back(p.norm() > 0.35f && !second(p) ? 0.8f : 0.01f);
    model.statistics.mean_color.push_back({0.25f, 1.5f, -1});
  }
  const ExportableScene scene = MakeExportableScene(model);
  EXPECT_EQ(Object(scene, 7).cells, Object(MakeExportableScene(HollowBall(0)), 7).cells);
  // The measured colours are used, and are cut to the range of display values.
  EXPECT_EQ(scene.display_color[0], Eigen::Vector3f(0.25f, 1, 0));

  // Unseen altogether, the label has no object.
  model.statistics.contribution.assign(model.foam.NumSites(), 0.f);
  const ExportableScene unseen = MakeExportableScene(model);
  EXPECT_THAT(unseen.objects, IsEmpty());
  EXPECT_EQ(unseen.labels_without_cells.size(), 1u);
}

TEST(ExportableScene, CrumbsAreLeftOutAndLargeComponentsStay) {
  // Two balls of one class, one with a sixth of the other's cells, and a single cell far off.
  const auto shape = [](const Eigen::Vector3f& p) {
    const bool large = (p + Eigen::Vector3f::Constant(0.3f)).norm() < 0.55f;
    const bool small = (p - Eigen::Vector3f(0.6f, 0.6f, 0.6f)).norm() < 0.3f;
    return large ? 1 : small ? 2 : p.x() > 0.9f && p.y() < -0.9f && p.z() < -0.9f ? 3 : 0;
  };
  const Model model =
      GridModel(1, [&](const Eigen::Vector3f& p) { return shape(p) > 0 ? 0 : kAir; });
  const auto components_left = [&](float share) {
    ExportableSceneOptions options;
    options.min_component_share = share;
    const ExportableScene scene = MakeExportableScene(model, options);
    std::map<int, size_t> cells;
    for (const uint32_t cell : Object(scene, 7).cells) ++cells[shape(scene.cell_positions[cell])];
    for (uint32_t i = 0; i < scene.NumSites(); ++i) {
      const bool listed =
          std::binary_search(Object(scene, 7).cells.begin(), Object(scene, 7).cells.end(), i);
      EXPECT_EQ(scene.object_of_cell[i] == 0, listed);
    }
    cells[0] = static_cast<size_t>(Object(scene, 7).left_out.cells);
    return cells;
  };
  const auto all = components_left(0);
  ASSERT_EQ(all.size(), 4u);
  EXPECT_EQ(all.at(0), 0u);
  const auto by_default = components_left(ExportableSceneOptions().min_component_share);
  EXPECT_EQ(by_default.at(1), all.at(1));
  EXPECT_EQ(by_default.at(2), all.at(2));
  EXPECT_EQ(by_default.count(3), 0u);
  EXPECT_EQ(by_default.at(0), 1u);
  EXPECT_EQ(components_left(1).count(2), 0u);
}

TEST(ExportableScene, NestedObjectsShareNoCell) {
  // Shells of two classes around each other around a pocket: the pocket belongs to the inner one.
  const Model model = GridModel(2, [](const Eigen::Vector3f& p) {
    const float r = p.norm();
    return r < 0.3f ? kAir : r < 0.5f ? 0 : r < 0.75f ? 1 : kAir;
  });
  const ExportableScene scene = MakeExportableScene(model);
  EXPECT_EQ(scene.object_of_cell[CellAt(scene, {0.06, 0.06, 0.06})], 0);
  std::vector<uint32_t> both;
  std::set_intersection(scene.objects[0].cells.begin(),
                        scene.objects[0].cells.end(),
                        scene.objects[1].cells.begin(),
                        scene.objects[1].cells.end(),
                        std::back_inserter(both));
  EXPECT_THAT(both, IsEmpty());
}

TEST(ExportableScene, ColoursComeFromTheHarmonicsWithoutStatistics) {
  Model model = TouchingBalls(100);
  model.foam.sh[0] = 1;
  model.foam.sh[1] = 100;
  model.foam.sh[2] = -100;
  const ExportableScene scene = MakeExportableScene(model);
  EXPECT_FLOAT_EQ(scene.display_color[0].x(), 0.5f + 0.28209479f);
  EXPECT_FLOAT_EQ(scene.display_color[0].y(), 1);
  EXPECT_FLOAT_EQ(scene.display_color[0].z(), 0);
}

TEST(ExportableScene, AFoamWithoutSitesHasNothing) {
  const ExportableScene scene =
      MakeExportableScene(MakeModel({}, 1, [](const auto&) { return 0; }));
  EXPECT_THAT(scene.objects, IsEmpty());
  EXPECT_EQ(scene.NumSites(), 0u);
}

}  // namespace
}  // namespace semfoam
