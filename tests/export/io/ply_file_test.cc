// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/io/ply_file.h"

#include "export/io/byte_writer.h"
#include "foam/util/error.h"

#include <fstream>

#include "tests/export/test_foams.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

class PlyFileTest : public TemporaryFolderTest {
 protected:
  std::filesystem::path Write(const std::string& bytes) {
    const std::filesystem::path path = folder_ / "a.ply";
    std::ofstream(path, std::ios::binary) << bytes;
    return path;
  }

  // What reading these bytes is refused with; empty where it is not.
  std::string Refusal(const std::string& bytes) {
    try {
      PlyFile file(Write(bytes));
    } catch (const UserError& error) {
      EXPECT_THAT(error.what(), HasSubstr("a.ply: "));
      return error.what();
    }
    return "";
  }
};

constexpr char kStart[] = "ply\nformat binary_little_endian 1.0\n";

TEST_F(PlyFileTest, ReadsEveryType) {
  std::string bytes = std::string(kStart) + "comment element nothing 3\nelement thing 2\n";
  for (const char* property :
       {"char a", "uint8 b", "short c", "uint16 d", "int e", "uint32 f", "float g", "float64 h"}) {
    bytes += std::string("property ") + property + "\n";
  }
  bytes += "element none 0\nproperty float x\nend_header\n";
  for (const int sign : {1, -1}) {
    AppendBinary(static_cast<int8_t>(-100 * sign), &bytes);
    AppendBinary(uint8_t{200}, &bytes);
    AppendBinary(static_cast<int16_t>(-30000 * sign), &bytes);
    AppendBinary(uint16_t{60000}, &bytes);
    AppendBinary(int32_t{-2000000000} * sign, &bytes);
    AppendBinary(uint32_t{4000000000u}, &bytes);
    AppendBinary(0.5f * sign, &bytes);
    AppendBinary(0.1 * sign, &bytes);
  }
  const PlyFile ply(Write(bytes));
  EXPECT_EQ(ply.Count("thing"), 2);
  EXPECT_TRUE(ply.HasElement("none"));
  EXPECT_FALSE(ply.HasElement("nothing"));
  EXPECT_THAT(ply.Properties("thing"), ElementsAre("a", "b", "c", "d", "e", "f", "g", "h"));
  EXPECT_THAT(ply.Values("thing", "a"), ElementsAre(-100, 100));
  EXPECT_THAT(ply.Values("thing", "b"), ElementsAre(200, 200));
  EXPECT_THAT(ply.Values("thing", "c"), ElementsAre(-30000, 30000));
  EXPECT_THAT(ply.Values("thing", "d"), ElementsAre(60000, 60000));
  EXPECT_THAT(ply.Values("thing", "e"), ElementsAre(-2e9, 2e9));
  EXPECT_THAT(ply.Values("thing", "f"), ElementsAre(4e9, 4e9));
  EXPECT_THAT(ply.Values("thing", "g"), ElementsAre(0.5, -0.5));
  EXPECT_THAT(ply.Values("thing", "h"), ElementsAre(0.1, -0.1));
  EXPECT_THAT(ply.Values("none", "x"), ElementsAre());
  EXPECT_THROW(ply.Values("thing", "i"), UserError);
  EXPECT_THROW(ply.Values("nothing", "a"), UserError);
}

TEST_F(PlyFileTest, RefusesWhatItDoesNotUnderstand) {
  const std::string start = kStart;
  const struct {
    std::string bytes;
    const char* sentence;
  } cases[] = {
      {"", "is no PLY file"},
      {"plywood\n", "is no PLY file"},
      {"ply\nformat ascii 1.0\nend_header\n", "is a PLY of format ascii"},
      {"ply\nformat binary_big_endian 1.0\nend_header\n", "is a PLY of format binary_big_endian"},
      {start, "has no end_header"},
      {start + std::string(1 << 17, '\n'), "has no end_header"},
      {start + "element vertex -1\nend_header\n", "'element vertex -1'"},
      {start + "element vertex 1e3\nend_header\n", "'element vertex 1e3'"},
      {start + "element vertex 99999999999999999999\nend_header\n", "'element vertex 9999"},
      {start + "element vertex\nend_header\n", "'element vertex'"},
      {start + "element a 0\nelement a 0\nend_header\n", "'element a 0'"},
      {start + "property float x\nend_header\n", "'property float x'"},
      {start + "element a 0\nproperty half x\nend_header\n", "'property half x'"},
      {start + "element a 0\nproperty float\nend_header\n", "'property float'"},
      {start + "element a 0\nproperty float x\nproperty int x\nend_header\n", "'property int x'"},
      {start + "element a 0\nproperty list uchar int x\nend_header\n", "has lists"},
      {start + "element a 2\nproperty int x\nend_header\n1234567", "of which there are 1"},
      {start + "element a 4611686018427387905\nproperty int x\nend_header\n1234",
       "of which there are 1"},
      {start + "element a 1\nproperty int x\nend_header\n12345", "has 1 bytes more"},
  };
  for (const auto& [bytes, sentence] : cases) {
    EXPECT_THAT(Refusal(bytes), HasSubstr(sentence)) << bytes.substr(0, 200);
  }
  EXPECT_THROW(PlyFile(folder_ / "none.ply"), UserError);
  EXPECT_THROW(PlyFile{folder_}, UserError);
  EXPECT_EQ(Refusal(start + "element a 1\nproperty int x\nend_header\n1234"), "");
}

}  // namespace
}  // namespace semfoam
