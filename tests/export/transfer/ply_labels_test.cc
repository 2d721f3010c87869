// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/transfer/ply_labels.h"

#include "foam/util/error.h"

#include <cstring>
#include <fstream>

#include "tests/export/test_foams.h"
#include "tests/small_files.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr char kNewProperties[] = "property int label\nproperty float confidence\n";

std::string ReadAll(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

class PlyLabelsTest : public TemporaryFolderTest {
 protected:
  // Returns the copy of a file of these bytes, in which record i of the vertices has the label 100
  // + i and of the faces 200 + i, with the confidence 1 / 2^i.
  std::string Copy(const std::string& bytes) {
    std::ofstream(folder_ / "in.ply", std::ios::binary) << bytes;
    positions_.clear();
    normals_.clear();
    const auto label = [](int base) {
      return [base](const PlyBlock& block, std::span<SurfaceLabel> labels) {
        for (size_t i = 0; i < labels.size(); ++i) {
          const int record = static_cast<int>(block.first + i);
          labels[i] = {LabelId{base + record}, std::ldexp(1.f, -record)};
        }
      };
    };
    CopyPlyWithLabels(
        folder_ / "in.ply",
        folder_ / "out.ply",
        {{LabelId{0}, MaskId{0}, ""}, {LabelId{7}, MaskId{7}, "mug\nof"}, {LabelId{8}, {}, ""}},
        [&](const PlyBlock& block, std::span<SurfaceLabel> labels) {
          positions_.insert(positions_.end(), block.positions.begin(), block.positions.end());
          normals_.insert(normals_.end(), block.normals.begin(), block.normals.end());
          label(100)(block, labels);
        },
        label(200));
    return ReadAll(folder_ / "out.ply");
  }

  std::string Refusal(const std::string& bytes) {
    try {
      Copy(bytes);
    } catch (const UserError& error) {
      EXPECT_FALSE(std::filesystem::exists(folder_ / "out.ply"));
      return error.what();
    }
    return "";
  }

  std::vector<Eigen::Vector3d> positions_;
  std::vector<Eigen::Vector3f> normals_;
};

std::string LabelBytes(int32_t label, float confidence, bool is_big_endian) {
  std::string bytes;
  for (int k = 0; k < 2; ++k) {
    std::string value;
    k == 0 ? AppendBinary(label, &value) : AppendBinary(confidence, &value);
    if (is_big_endian) std::reverse(value.begin(), value.end());
    bytes += value;
  }
  return bytes;
}

// The records of a cloud as OpenMVS writes it, with lists at their ends, of which the first is
// empty, and a face: all bytes are there again, in order, with eight more behind each record.
TEST_F(PlyLabelsTest, KeepsEveryByteOfBinaryFiles) {
  for (const bool is_big_endian : {false, true}) {
    const std::string in =
        SmallCloud(is_big_endian ? "binary_big_endian" : "binary_little_endian") + "and more";
    const std::string end = "end_header\n";
    const size_t data = in.find(end) + end.size();
    std::string header = in.substr(0, data);
    header.insert(header.find("element vertex"),
                  "comment label 7 mug of\ncomment label 8 label_8\n");
    header.insert(header.find("element face"), kNewProperties);
    header.insert(header.find(end), kNewProperties);
    std::string expected = header;
    size_t at = data;
    for (int i = 0; i < 3; ++i) {
      const size_t size = 12 + 3 + 2 + 8 * static_cast<size_t>(i);
      expected += in.substr(at, size) + LabelBytes(100 + i, std::ldexp(1.f, -i), is_big_endian);
      at += size;
    }
    expected += in.substr(at, 13) + LabelBytes(200, 1, is_big_endian) + "and more";
    EXPECT_EQ(Copy(in), expected);
    EXPECT_THAT(
        positions_,
        ElementsAre(
            Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(1, 0, 0.25), Eigen::Vector3d(0, 1, -0.5)));
    EXPECT_TRUE(normals_.empty());
  }
}

// Lines that end as on Windows, blanks, digits that no program would print again, another element
// between, empty lists.
TEST_F(PlyLabelsTest, KeepsEveryCharacterOfText) {
  EXPECT_EQ(
      Copy("ply\r\nformat ascii 1.0\r\nobj_info scanned\r\nelement vertex 2\r\nproperty float x\r\n"
           "property float y\r\nproperty float z\r\nproperty float nx\r\nproperty float ny\r\n"
           "property float nz\r\nelement camera 1\r\nproperty int of\r\nelement face 2\r\n"
           "property list uchar int vertex_indices\r\nend_header\r\n"
           "1.50 2e0  +3 0 0 1.0 \r\n4 5 6 0 1 0\r\n 9\r\n3 0 1 0\r\n0\r\n\r\n"),
      "ply\r\nformat ascii 1.0\r\ncomment label 7 mug of\r\ncomment label 8 label_8\r\n"
      "obj_info scanned\r\nelement vertex 2\r\nproperty float x\r\n"
      "property float y\r\nproperty float z\r\nproperty float nx\r\nproperty float ny\r\n"
      "property float nz\r\nproperty int label\r\nproperty float confidence\r\n"
      "element camera 1\r\nproperty int of\r\nelement face 2\r\n"
      "property list uchar int vertex_indices\r\nproperty int label\r\n"
      "property float confidence\r\nend_header\r\n"
      "1.50 2e0  +3 0 0 1.0 100 1 \r\n4 5 6 0 1 0 101 0.5\r\n 9\r\n3 0 1 0 200 1\r\n"
      "0 201 0.5\r\n\r\n");
  EXPECT_THAT(positions_, ElementsAre(Eigen::Vector3d(1.5, 2, 3), Eigen::Vector3d(4, 5, 6)));
  EXPECT_THAT(normals_, ElementsAre(Eigen::Vector3f(0, 0, 1), Eigen::Vector3f(0, 1, 0)));
}

// Labels of an earlier copy are replaced, wherever they stand.
TEST_F(PlyLabelsTest, ACopyOfACopyIsTheSame) {
  for (const char* format : {"ascii", "binary_little_endian", "binary_big_endian"}) {
    const std::string copy = Copy(SmallCloud(format));
    const std::string again = Copy(copy);
    EXPECT_EQ(again, copy) << format;
  }
  EXPECT_EQ(Copy("ply\nformat ascii 1.0\nelement vertex 2\nproperty float label\nproperty int x\n"
                 "property int y\nproperty int z\nend_header\n0.5 1 2 3\n0.25 4 5 6\n"),
            "ply\nformat ascii 1.0\ncomment label 7 mug of\ncomment label 8 label_8\n"
            "element vertex 2\nproperty int x\nproperty int y\nproperty int z\n"
            "property int label\nproperty float confidence\nend_header\n"
            " 1 2 3 100 1\n 4 5 6 101 0.5\n");
}

// More records than a block holds.
TEST_F(PlyLabelsTest, BlocksAreJoined) {
  constexpr int kCount = 70000;
  std::string in = "ply\nformat binary_little_endian 1.0\nelement vertex 70000\n";
  in += "property uchar x\nproperty uchar y\nproperty uchar z\nend_header\n";
  for (int i = 0; i < kCount; ++i) in += {static_cast<char>(i), 'y', 'z'};
  const std::string out = Copy(in);
  const std::string records = out.substr(out.size() - kCount * size_t{11});
  for (int i = 0; i < kCount; ++i) {
    int32_t label = 0;
    std::memcpy(&label, &records[i * size_t{11} + 3], sizeof(label));
    ASSERT_EQ(label, 100 + i);
    ASSERT_EQ(records.substr(i * size_t{11}, 3), std::string({static_cast<char>(i), 'y', 'z'}));
  }
  EXPECT_EQ(positions_.size(), size_t{kCount});
}

TEST_F(PlyLabelsTest, WhatIsNoCompletePlyIsRefused) {
  const std::string cloud = SmallCloud("binary_little_endian");
  EXPECT_THAT(Refusal(cloud.substr(0, cloud.size() - 40)), HasSubstr("in.ply: ends too early"));
  EXPECT_THAT(Refusal("png"), HasSubstr("is no PLY file"));
  EXPECT_THAT(Refusal("ply\nformat ascii 1.0\nelement vertex 1\nproperty int x\nend_header\n1\n"),
              HasSubstr("no property y"));
}

}  // namespace
}  // namespace semfoam
