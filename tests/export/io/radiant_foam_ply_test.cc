// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/io/radiant_foam_ply.h"

#include "export/io/byte_writer.h"
#include "export/io/ply_file.h"
#include "foam/geometry/guard_sites.h"
#include "foam/model/spherical_harmonics.h"
#include "foam/util/error.h"

#include <fstream>
#include <map>

#include "tests/export/test_foams.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

using testing::HasSubstr;

using RadiantFoamPlyTest = TemporaryFolderTest;

std::string Bytes(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

// Two balls, with colours of degree `degree`, in a world of other size and place.
Model Balls(int degree) {
  Model model = TouchingBalls(400);
  const size_t n = model.foam.NumSites();
  LargePageVector<float> sh;
  for (size_t i = 0; i < n; ++i) {
    for (int k = 0; k < 3 * NumShCoefficients(degree); ++k) {
      sh.push_back(k < 3 ? model.foam.sh[3 * i + k]
                         : 0.01f * static_cast<float>(k) + 1e-4f * static_cast<float>(i));
    }
    model.foam.raw_density[i] = 0.1f + 0.001f * static_cast<float>(i);
  }
  model.foam.sh = sh;
  model.foam.sh_degree = degree;
  model.world_from_normalized = {2.5, {10, -20, 30}};
  return model;
}

TEST_F(RadiantFoamPlyTest, HasTheLayoutThatRadiantFoamWrites) {
  const Model model = Balls(1);
  const ExportableScene scene = MakeExportableScene(model);
  WriteRadiantFoamPly(folder_ / "a.ply", model, scene);
  const std::string bytes = Bytes(folder_ / "a.ply");
  const std::string header = bytes.substr(0, bytes.find("end_header\n") + 11);
  const size_t num_neighbors = PlyFile(folder_ / "a.ply").Count("adjacency");
  EXPECT_EQ(header,
            "ply\nformat binary_little_endian 1.0\nelement vertex 400\n"
            "property float x\nproperty float y\nproperty float z\n"
            "property uchar red\nproperty uchar green\nproperty uchar blue\n"
            "property float density\nproperty uint adjacency_offset\n"
            "property float color_sh_0\nproperty float color_sh_1\nproperty float color_sh_2\n"
            "property float color_sh_3\nproperty float color_sh_4\nproperty float color_sh_5\n"
            "property float color_sh_6\nproperty float color_sh_7\nproperty float color_sh_8\n"
            "element adjacency " +
                std::to_string(num_neighbors) + "\nproperty uint adjacency\nend_header\n");

  // The offsets end where a site's neighbours end, and the neighbours are those of the sites alone,
  // in both directions.
  const PlyFile ply(folder_ / "a.ply");
  const std::vector<double> ends = ply.Values("vertex", "adjacency_offset");
  const std::vector<double> adjacency = ply.Values("adjacency", "adjacency");
  EXPECT_EQ(ends.back(), num_neighbors);
  std::map<std::pair<uint32_t, uint32_t>, int> edges;
  for (uint32_t i = 0; i < 400; ++i) {
    const size_t begin = i == 0 ? 0 : static_cast<size_t>(ends[i - 1]);
    std::vector<uint32_t> expected;
    for (const uint32_t j : scene.delaunay.Neighbors(i)) {
      if (j < 400) expected.push_back(j);
    }
    EXPECT_EQ(std::vector<uint32_t>(adjacency.begin() + static_cast<int64_t>(begin),
                                    adjacency.begin() + static_cast<int64_t>(ends[i])),
              expected);
    for (const uint32_t j : expected) ++edges[std::minmax(i, j)];
  }
  for (const auto& [edge, count] : edges) EXPECT_EQ(count, 2);

  const std::vector<double> x = ply.Values("vertex", "x");
  const std::vector<double> density = ply.Values("vertex", "density");
  const std::vector<double> red = ply.Values("vertex", "red");
  const std::vector<double> rest = ply.Values("vertex", "color_sh_4");
  for (size_t i = 0; i < 400; ++i) {
    EXPECT_NEAR(x[i], 2.5 * model.foam.positions[i].x() + 10, 1e-5);
    EXPECT_NEAR(density[i] * 2.5, Density<double>(model.foam.raw_density[i]), 1e-4);
    EXPECT_NEAR(red[i], 255 * std::clamp(0.5 + kShDc * model.foam.sh[12 * i], 0.0, 1.0), 0.5);
    // Coefficient by coefficient: the second one's green.
    EXPECT_EQ(rest[i], model.foam.sh[12 * i + 3 + 4]);
  }
}

TEST_F(RadiantFoamPlyTest, ComesBack) {
  for (const int degree : {0, 1, 2, 3}) {
    const Model model = Balls(degree);
    const ExportableScene scene = MakeExportableScene(model);
    WriteRadiantFoamPly(folder_ / "a.ply", model, scene);
    const Model back = ReadRadiantFoamPly(folder_ / "a.ply");
    ASSERT_EQ(back.foam.NumSites(), 400);
    EXPECT_EQ(back.foam.sh_degree, degree);
    EXPECT_FALSE(back.foam.HasSemantics());
    EXPECT_TRUE(back.photos.empty());
    // The site nearest to each one of the original, whatever the order and the frame.
    const std::vector<Eigen::Vector3f> cells = WithGuardSites(back.foam.positions);
    const Delaunay delaunay = Triangulate(cells);
    for (size_t i = 0; i < 400; ++i) {
      const Eigen::Vector3d world =
          model.world_from_normalized.Apply(model.foam.positions[i].cast<double>());
      const uint32_t j = NearestCell(cells, delaunay, back.world_from_normalized.Invert(world), 0);
      ASSERT_LT(j, 400);
      EXPECT_LT((back.world_from_normalized.Apply(cells[j].cast<double>()) - world).norm(), 1e-5);
      EXPECT_NEAR(Density<double>(back.foam.raw_density[j]) / back.world_from_normalized.scale,
                  Density<double>(model.foam.raw_density[i]) / 2.5,
                  1e-4);
      const int stride = back.foam.ShStride();
      for (int k = 0; k < stride; ++k) {
        const float was = model.foam.sh[i * stride + k];
        // 8 bits for what is shown, cut to 0..1.
        const float cut = static_cast<float>(0.5 / kShDc);
        if (k < 3)
          EXPECT_NEAR(back.foam.sh[j * stride + k], std::clamp(was, -cut, cut), 0.51 / 255 / kShDc);
        else
          EXPECT_EQ(back.foam.sh[j * stride + k], was);
      }
    }
    // The frame is one that training would choose: sites around the origin, none beyond the far
    // radius.
    for (const Eigen::Vector3f& site : back.foam.positions) EXPECT_LT(site.norm(), kFarRadius);
  }
}

TEST_F(RadiantFoamPlyTest, TakesFarSitesAndAirAndSitesInOnePlace) {
  std::string bytes = "ply\nformat binary_little_endian 1.0\nelement vertex 5\n";
  for (const char* name : {"x", "y", "z"}) bytes += std::string("property float ") + name + "\n";
  for (const char* name : {"red", "green", "blue"})
    bytes += std::string("property uchar ") + name + "\n";
  bytes +=
      "property float density\nproperty uint adjacency_offset\nelement adjacency 0\nproperty uint "
      "adjacency\nend_header\n";
  const float xs[] = {0, 0, 1, 2, 1e6f};
  for (const float x : xs) {
    for (const float coordinate : {x, 0.f, 0.f}) AppendBinary(coordinate, &bytes);
    for (int c = 0; c < 3; ++c) AppendBinary(uint8_t{255}, &bytes);
    AppendBinary(0.f, &bytes);
    AppendBinary(uint32_t{0}, &bytes);
  }
  std::ofstream(folder_ / "a.ply", std::ios::binary) << bytes;
  const Model model = ReadRadiantFoamPly(folder_ / "a.ply");
  for (size_t i = 0; i < 5; ++i) {
    EXPECT_LT(model.foam.positions[i].norm(), kFarRadius);
    EXPECT_LT(Density<double>(model.foam.raw_density[i]), 1e-8);
    EXPECT_FLOAT_EQ(model.foam.sh[3 * i], static_cast<float>(0.5 / kShDc));
  }
  WriteModel(folder_ / "a.foam", model);
  EXPECT_EQ(ReadModel(folder_ / "a.foam").foam.NumSites(), 5);
}

TEST_F(RadiantFoamPlyTest, RefusesWhatDoesNotFitTogether) {
  const Model model = Balls(0);
  WriteRadiantFoamPly(folder_ / "a.ply", model, MakeExportableScene(model));
  const std::string good = Bytes(folder_ / "a.ply");
  const size_t data = good.find("end_header\n") + 11;
  const auto spoilt = [&](size_t at, auto value) {
    std::string bytes = good;
    std::memcpy(&bytes[data + at], &value, sizeof(value));
    return bytes;
  };
  const auto without = [&](const std::string& text, const std::string& instead) {
    std::string bytes = good;
    bytes.replace(bytes.find(text), text.size(), instead);
    return bytes;
  };
  constexpr size_t kStride = 12 + 3 + 4 + 4;
  const struct {
    std::string bytes;
    const char* sentence;
  } cases[] = {
      {spoilt(0, std::nanf("")), "site 0 has a position"},
      {spoilt(kStride + 15, -1.f), "site 1 has the density -1"},
      {spoilt(15, INFINITY), "has the density inf"},
      {spoilt(19, 4000000000u), "do not ascend"},
      {spoilt(399 * kStride + 19, 4000000000u), "neighbours, while the last adjacency_offset"},
      {spoilt(400 * kStride, 400u), "names a neighbour 400 of 400 sites"},
      {without("float density", "float opacity"), "has no property density"},
      {without("float z", "float w"), "has no property z"},
      {without("property uint adjacency\n", "property uint neighbors\n"),
       "has no property adjacency"},
      {without("float density", "float color_sh_0"), "has 1 properties color_sh_*"},
      {good.substr(0, good.size() - 1), "ends too early"},
  };
  for (const auto& [bytes, sentence] : cases) {
    std::ofstream(folder_ / "b.ply", std::ios::binary) << bytes;
    try {
      ReadRadiantFoamPly(folder_ / "b.ply");
      ADD_FAILURE() << sentence;
    } catch (const UserError& error) {
      EXPECT_THAT(error.what(), HasSubstr(sentence));
      EXPECT_THAT(error.what(), HasSubstr("b.ply"));
    }
  }
}

TEST_F(RadiantFoamPlyTest, SaysWhereFloatsDoNotSuffice) {
  Model model = Balls(0);
  model.world_from_normalized.translation.x() = 5e8;
  EXPECT_THROW(WriteRadiantFoamPly(folder_ / "a.ply", model, MakeExportableScene(model)),
               UserError);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "a.ply"));
}

}  // namespace
}  // namespace semfoam
