// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/io/cell_points.h"

#include "export/io/ply_file.h"
#include "export/scene/object_selection.h"

#include <fstream>
#include <sstream>

#include "tests/export/test_foams.h"
#include <Eigen/Geometry>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

using testing::Each;
using testing::ElementsAre;
using testing::HasSubstr;

using CellPointsTest = TemporaryFolderTest;

Model BallsInTheWorld() {
  Model model = TouchingBalls(2000);
  model.world_from_normalized = {2.5, {10, -20, 30}};
  return model;
}

TEST_F(CellPointsTest, VisibleCellsAreMatterThatPhotosShow) {
  Model model = BallsInTheWorld();
  const ExportableScene scene = MakeExportableScene(model);
  const std::vector<uint32_t> all = VisibleCells(scene, {});
  const std::vector<uint32_t> mug = VisibleCells(scene, FilterObjects(scene, {"mug"}));
  const std::vector<uint32_t> other = VisibleCells(scene, FilterObjects(scene, {"8"}));
  EXPECT_GT(mug.size(), 10);
  EXPECT_EQ(mug.size() + other.size(), all.size());
  for (const uint32_t cell : all) EXPECT_TRUE(scene.labels.solid[cell]);
  for (const uint32_t cell : mug) EXPECT_EQ(scene.label_id[cell], LabelId{7});

  // One that no photo shows is none.
  const uint32_t hidden = mug.front();
  model.statistics.contribution.assign(model.foam.NumSites(), 1.f);
  model.statistics.mean_color.assign(model.foam.NumSites(), Eigen::Vector3f::Constant(0.5f));
  model.statistics.contribution[hidden] = 0;
  const std::vector<uint32_t> seen = VisibleCells(MakeExportableScene(model), {});
  EXPECT_EQ(seen.size() + 1, all.size());
  EXPECT_FALSE(std::binary_search(seen.begin(), seen.end(), hidden));
}

TEST_F(CellPointsTest, PointsLieAtTheSitesInTheColmapFrame) {
  const Model model = BallsInTheWorld();
  const ExportableScene scene = MakeExportableScene(model);
  const std::vector<uint32_t> cells = VisibleCells(scene, FilterObjects(scene, {"mug"}));
  WriteCellPoints(folder_ / "p.ply", scene, cells);
  const PlyFile ply(folder_ / "p.ply");
  ASSERT_EQ(ply.Count("vertex"), cells.size());
  EXPECT_THAT(ply.Properties("vertex"),
              ElementsAre("x",
                          "y",
                          "z",
                          "red",
                          "green",
                          "blue",
                          "label",
                          "object",
                          "confidence",
                          "density",
                          "radius"));
  EXPECT_THAT(ply.Values("vertex", "label"), Each(7));
  const std::vector<double> z = ply.Values("vertex", "z");
  const std::vector<double> radius = ply.Values("vertex", "radius");
  const std::vector<double> density = ply.Values("vertex", "density");
  const std::vector<double> green = ply.Values("vertex", "green");
  for (size_t k = 0; k < cells.size(); ++k) {
    EXPECT_DOUBLE_EQ(z[k], 2.5 * double{model.foam.positions[cells[k]].z()} + 30);
    EXPECT_NEAR(radius[k], 2.5 * scene.radius[cells[k]], 1e-6);
    // The optical depth is the same in both frames.
    EXPECT_NEAR(
        density[k] * radius[k] / (scene.density[cells[k]] * scene.radius[cells[k]]), 1, 1e-6);
    EXPECT_NEAR(green[k], 255 * std::clamp(scene.display_color[cells[k]][1], 0.f, 1.f), 0.51);
  }
}

// The same cells, whether an object is asked for or looked up among all: some of the mug's class
// lie in no object, and some of the mug are of another class.
TEST_F(CellPointsTest, TheObjectOfAPointIsTheOneThatItsCellIsWrittenWith) {
  Model model = BallsInTheWorld();
  // A speck of the mug far off.
  const Eigen::Vector3f corner(-0.8f, -0.8f, 0.8f);
  size_t speck = 0;
  for (size_t i = 0; i < model.foam.NumSites(); ++i) {
    if ((model.foam.positions[i] - corner).norm() < (model.foam.positions[speck] - corner).norm()) {
      speck = i;
    }
  }
  model.foam.raw_density[speck] = static_cast<float>(RawDensity(1e4));
  ExportableScene scene = MakeExportableScene(model);
  const uint32_t strange = scene.objects[0].cells.front();
  scene.label_id[strange] = LabelId{8};
  const std::vector<uint32_t> all = VisibleCells(scene, {});
  const std::vector<uint32_t> mug = VisibleCells(scene, FilterObjects(scene, {"mug"}));
  WriteCellPoints(folder_ / "all.ply", scene, all);
  WriteSplats(folder_ / "splats.ply", model, scene, all, 1);
  for (const char* name : {"all.ply", "splats.ply"}) {
    const PlyFile ply(folder_ / name);
    const std::vector<double> label = ply.Values("vertex", "label");
    const std::vector<double> object = ply.Values("vertex", "object");
    std::vector<uint32_t> of_object;
    size_t of_class = 0, strangers = 0;
    for (size_t k = 0; k < all.size(); ++k) {
      if (object[k] == 7) of_object.push_back(all[k]);
      of_class += label[k] == 7;
      strangers += object[k] == 7 && label[k] != 7;
      EXPECT_EQ(object[k], Value(scene.ObjectId(all[k])));
      EXPECT_EQ(label[k], Value(scene.label_id[all[k]]));
    }
    EXPECT_EQ(of_object, mug) << name;
    EXPECT_EQ(strangers, 1u);
    EXPECT_EQ(of_class, mug.size()) << "with the speck, without the stranger";
  }
}

// Cells that are boxes of 1 x 2 x 4, axis by axis another length, in a grid that is turned.
TEST_F(CellPointsTest, SplatsHaveTheShapeOfTheirCells) {
  const Eigen::Quaternionf turn(Eigen::AngleAxisf(0.7f, Eigen::Vector3f(1, 2, 3).normalized()));
  std::vector<Eigen::Vector3f> sites;
  for (int x = -3; x <= 3; ++x) {
    for (int y = -3; y <= 3; ++y) {
      for (int z = -3; z <= 3; ++z) {
        // Moved a hair, for a grid that is not exactly cospherical.
        const Eigen::Vector3f hair =
            1e-4f *
            Eigen::Vector3f(std::sin(x + 7.f * y), std::sin(y + 5.f * z), std::sin(z + 3.f * x));
        sites.push_back(turn * (Eigen::Vector3f(0.1f * x, 0.2f * y, 0.4f * z) + hair));
      }
    }
  }
  Model model = MakeModel(sites, 1, [](const Eigen::Vector3f&) { return 0; });
  model.world_from_normalized = {2, {1, 2, 3}};
  const ExportableScene scene = MakeExportableScene(model);
  const uint32_t middle = 3 * 49 + 3 * 7 + 3;
  WriteSplats(folder_ / "s.ply", model, scene, {middle}, 1);
  const PlyFile ply(folder_ / "s.ply");
  const auto value = [&](const std::string& name) { return ply.Values("vertex", name).at(0); };
  EXPECT_NEAR(value("x"), 1, 1e-3);
  EXPECT_NEAR(value("z"), 3, 1e-3);
  EXPECT_EQ(value("label"), 7);
  EXPECT_NEAR(value("f_dc_1"), model.foam.sh[3 * middle + 1], 1e-6);
  EXPECT_EQ(value("f_rest_44"), 0);
  EXPECT_NEAR(value("opacity"), std::log(1e4), 1e-2);  // opaque: as near to 1 as it gets

  // Corners at half an edge: their deviation along each axis, by sqrt(3 / 5) that of a body, in a
  // world twice as large. Sorted as eigenvalues are, from the shortest on.
  Eigen::Quaterniond rotation(value("rot_0"), value("rot_1"), value("rot_2"), value("rot_3"));
  EXPECT_NEAR(rotation.norm(), 1, 1e-6);
  const double edges[] = {0.1, 0.2, 0.4};
  for (int k = 0; k < 3; ++k) {
    const double deviation = std::exp(value("scale_" + std::to_string(k)));
    EXPECT_NEAR(deviation / (2 * 0.5 * edges[k] * std::sqrt(0.6)), 1, 0.02) << k;
    const Eigen::Vector3d axis = rotation * Eigen::Vector3d::Unit(k);
    EXPECT_NEAR(std::abs(axis.dot((turn * Eigen::Vector3f::Unit(k)).cast<double>())), 1, 1e-3);
  }

  WriteSplats(folder_ / "t.ply", model, scene, {middle}, 3);
  EXPECT_NEAR(PlyFile(folder_ / "t.ply").Values("vertex", "scale_0").at(0) - value("scale_0"),
              std::log(3),
              1e-5);
}

TEST_F(CellPointsTest, SplatsHaveTheCoefficientsChannelByChannel) {
  Model model = BallsInTheWorld();
  model.foam.sh_degree = 1;
  model.foam.sh.clear();
  for (size_t i = 0; i < model.foam.NumSites(); ++i) {
    for (int k = 0; k < 12; ++k) model.foam.sh.push_back(static_cast<float>(k));
  }
  const ExportableScene scene = MakeExportableScene(model);
  const std::vector<uint32_t> cells = VisibleCells(scene, {});
  WriteSplats(folder_ / "s.ply", model, scene, cells, 1);
  const PlyFile ply(folder_ / "s.ply");
  // f_rest: 15 of red, 15 of green, 15 of blue. Coefficient 2 (the third), blue: 3 * 2 + 2 = 8.
  EXPECT_THAT(ply.Values("vertex", "f_dc_2"), Each(2));
  EXPECT_THAT(ply.Values("vertex", "f_rest_0"), Each(3));
  EXPECT_THAT(ply.Values("vertex", "f_rest_15"), Each(4));
  EXPECT_THAT(ply.Values("vertex", "f_rest_31"), Each(8));
  EXPECT_THAT(ply.Values("vertex", "f_rest_3"), Each(0));
  // Every splat is one: finite, of a size, turned by a rotation.
  for (const std::string& name : ply.Properties("vertex")) {
    for (const double number : ply.Values("vertex", name))
      ASSERT_TRUE(std::isfinite(number)) << name;
  }
}

TEST_F(CellPointsTest, TextSaysEverything) {
  const Model model = BallsInTheWorld();
  const ExportableScene scene = MakeExportableScene(model);
  WriteFoamText(folder_ / "f.txt", model, scene);
  std::ifstream file(folder_ / "f.txt");
  std::string comments;
  uint32_t sites = 0;
  for (std::string line; std::getline(file, line);) {
    if (line[0] == '#') {
      comments += line + "\n";
      continue;
    }
    std::istringstream words(line);
    uint32_t site, num_neighbors;
    double x, y, z, density, radius, volume, confidence, sh;
    int label, red, green, blue, object;
    words >> site >> x >> y >> z >> density >> radius >> volume >> label >> confidence >> red >>
        green >> blue >> object >> sh >> sh >> sh >> num_neighbors;
    ASSERT_TRUE(words) << line;
    ASSERT_EQ(site, sites++);
    EXPECT_EQ(y, 2.5 * double{model.foam.positions[site].y()} - 20);
    EXPECT_NEAR(volume, scene.volume[site] * 2.5 * 2.5 * 2.5, 1e-6 * volume);
    EXPECT_EQ(label, Value(scene.label_id[site]));
    EXPECT_EQ(
        object,
        scene.object_of_cell[site] < 0 ? 0 : Value(scene.objects[scene.object_of_cell[site]].id));
    EXPECT_EQ(static_cast<float>(sh), model.foam.sh[3 * site + 2]);
    std::vector<uint32_t> neighbors(num_neighbors);
    for (uint32_t& neighbor : neighbors) words >> neighbor;
    EXPECT_TRUE(words);
    for (const uint32_t neighbor : neighbors) EXPECT_LT(neighbor, scene.NumSites());
    std::string more;
    EXPECT_FALSE(words >> more);
  }
  EXPECT_EQ(sites, scene.NumSites());
  EXPECT_THAT(comments, HasSubstr("2000 sites, SH degree 0, 2 classes"));
  EXPECT_THAT(comments, HasSubstr("x_colmap = 2.5 * x_normalized + (10, -20, 30)"));
  EXPECT_THAT(comments, HasSubstr("# label 7: mug"));
}

}  // namespace
}  // namespace semfoam
