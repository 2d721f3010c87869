// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/transfer/las_labels.h"

#include "foam/util/error.h"

#include <fstream>

#include "tests/export/test_foams.h"
#include "tests/export/transfer/test_meshes.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

constexpr LabelId kMug{7}, kOther{300};

class LasLabelsTest : public TemporaryFolderTest {
 protected:
  fs::path Write(const std::string& bytes) {
    std::ofstream(folder_ / "in.las", std::ios::binary) << bytes;
    return folder_ / "in.las";
  }
  std::string ReadAll(const fs::path& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  std::string Refusal(const std::string& bytes) {
    try {
      ReadLasHeader(Write(bytes));
    } catch (const UserError& error) {
      return error.what();
    }
    return "";
  }
};

const std::vector<Eigen::Vector3d> kPoints = {{100, 200, 300}, {99.5, 201.25, 3e5}, {0, 0, 0.001}};

TEST_F(LasLabelsTest, ReadsPlaces) {
  const PolygonMesh cloud = ReadLasPoints(Write(LasOf(kPoints, 2, 1)));
  ASSERT_EQ(cloud.vertices.size(), 3u);
  for (size_t k = 0; k < 3; ++k) EXPECT_LT((cloud.vertices[k] - kPoints[k]).norm(), 1e-9);
}

// Of every version and format, over the end of a block.
TEST_F(LasLabelsTest, SetsClassesAndKeepsAllElse) {
  std::vector<Eigen::Vector3d> many = kPoints;
  many.resize(65536 + 7, {1, 2, 3});
  for (const auto& [minor, format] :
       {std::pair(0, 0), {1, 1}, {2, 2}, {2, 3}, {3, 4}, {3, 5}, {4, 6}, {4, 7}, {4, 10}}) {
    const std::string las = LasOf(minor == 4 ? many : kPoints, minor, format);
    const fs::path input = Write(las);
    std::vector<LabelId> given;
    CopyLasWithLabels(input,
                      folder_ / "out.las",
                      {{kMug, 7}, {kOther, 31}},
                      [&](const PlyBlock& block, std::span<SurfaceLabel> labels) {
                        EXPECT_EQ(block.first, given.size());
                        EXPECT_TRUE(block.normals.empty());
                        for (SurfaceLabel& label : labels) {
                          const size_t k = given.size();
                          label.id = k % 3 == 0 ? kMug : k % 3 == 1 ? kOther : kNoObject;
                          given.push_back(label.id);
                        }
                      });
    const std::string copy = ReadAll(folder_ / "out.las");
    std::string expected = las;
    const size_t begin = (minor == 4 ? 375 : 227) + 60;
    const auto record = static_cast<uint8_t>(las[105]) + 256u * static_cast<uint8_t>(las[106]);
    ASSERT_EQ(given.size(), minor == 4 ? many.size() : 3);
    for (size_t k = 0; k < given.size(); ++k) {
      char& byte = expected[begin + k * record + (format < 6 ? 15 : 16)];
      const int to = given[k] == kMug ? 7 : given[k] == kOther ? 31 : 0;
      byte = static_cast<char>(format < 6 ? (byte & 0xe0) | to : to);
    }
    EXPECT_EQ(copy, expected) << minor << " " << format;
    EXPECT_NE(copy, las);
  }
}

TEST_F(LasLabelsTest, ClassesAreIdsWhereTheseFit) {
  LasHeader old, recent;
  recent.format = 6;
  const auto labels = [](std::initializer_list<int> ids) {
    std::vector<Label> table;
    for (const int id : ids) table.push_back({LabelId{id}, MaskId{0}, ""});
    return table;
  };
  EXPECT_EQ(ClassesOf("a.las", old, labels({0, 31, 4})),
            (LasClasses{{LabelId{4}, 4}, {LabelId{31}, 31}}));
  EXPECT_EQ(ClassesOf("a.las", old, labels({32, 4})),
            (LasClasses{{LabelId{4}, 1}, {LabelId{32}, 2}}));
  EXPECT_EQ(ClassesOf("a.las", recent, labels({32, 4})),
            (LasClasses{{LabelId{4}, 4}, {LabelId{32}, 32}}));
  std::vector<Label> many;
  for (int id = 1; id <= 32; ++id) many.push_back({LabelId{id}, MaskId{0}, ""});
  EXPECT_EQ(ClassesOf("a.las", recent, many).size(), 32u);
  try {
    ClassesOf("a.las", old, many);
    ADD_FAILURE() << "accepted";
  } catch (const UserError& error) {
    EXPECT_THAT(error.what(), HasSubstr("can have 31 classes, but there are 32 labels"));
  }
}

TEST_F(LasLabelsTest, RefusesBadFilesWithOneSentence) {
  const std::string las = LasOf(kPoints, 2, 1);
  const auto with = [&](size_t at, char byte) {
    std::string bytes = las;
    bytes[at] = byte;
    return Refusal(bytes);
  };
  EXPECT_EQ(Refusal(las), "");
  EXPECT_THAT(Refusal("LASX"), HasSubstr("in.las: is no LAS"));
  EXPECT_THAT(Refusal(las.substr(0, 200)), HasSubstr("ends within its header"));
  EXPECT_THAT(Refusal(LasOf(kPoints, 4, 6).substr(0, 300)), HasSubstr("ends within its header"));
  EXPECT_THAT(Refusal(las.substr(0, las.size() - 20)),
              HasSubstr("says 3 points from byte 287 on, but there is room for 2"));
  EXPECT_THAT(with(110, 1), HasSubstr("says 16777219 points"));
  EXPECT_THAT(with(99, 1), HasSubstr("room for 0"));
  EXPECT_THAT(with(25, 5), HasSubstr("is a LAS of version 1.5"));
  EXPECT_THAT(with(104, '\x81'), HasSubstr("is compressed (LAZ)"));
  EXPECT_THAT(with(104, 11), HasSubstr("format 11"));
  EXPECT_THAT(with(105, 3), HasSubstr("with 3 bytes each"));
  EXPECT_THAT(with(138, '\xff'), HasSubstr("a scale"));
  EXPECT_THAT(Refusal(LasOf({}, 2, 1)), HasSubstr("has no points"));
}

}  // namespace
}  // namespace semfoam
