// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/transfer/obj_labels.h"

#include "foam/util/error.h"

#include <fstream>

#include "tests/export/test_foams.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::string ReadAll(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

class ObjLabelsTest : public TemporaryFolderTest {
 protected:
  fs::path Write(const std::string& name, const std::string& bytes) {
    fs::create_directories((folder_ / name).parent_path());
    std::ofstream(folder_ / name, std::ios::binary) << bytes;
    return folder_ / name;
  }
  std::string Refusal(const std::string& bytes) {
    const fs::path path = Write("in.obj", bytes);
    try {
      RequireValidMesh(path, ReadObjMesh(path));
    } catch (const UserError& error) {
      return error.what();
    }
    return "";
  }
};

constexpr char kObj[] =
    "# by hand\r\nmtllib a b.mtl\r\nv +0.10 0 0 1 0 0\nv 1 0 0\nv 1 1 0\nvt 0.5 0.5\nvn 0 0 1\n"
    "g old\nusemtl red\nf 1/1/1 2/1/1 3/1/1\nv 0 1 0\nf -4//1 -2//1 -1//1\ns 1\n"
    "f 1 2 \\\n 3 4 # all\nf 2 3 4";

TEST_F(ObjLabelsTest, ReadsCornersOfAllKinds) {
  const PolygonMesh mesh = ReadObjMesh(Write("in.obj", kObj));
  ASSERT_EQ(mesh.vertices.size(), 4u);
  EXPECT_EQ(mesh.vertices[0], Eigen::Vector3d(0.1, 0, 0));
  ASSERT_EQ(mesh.NumFaces(), 4u);
  EXPECT_THAT(mesh.Face(0), ElementsAre(0, 1, 2));
  EXPECT_THAT(mesh.Face(1), ElementsAre(0, 2, 3));
  EXPECT_THAT(mesh.Face(2), ElementsAre(0, 1, 2, 3));
  EXPECT_THAT(mesh.Face(3), ElementsAre(1, 2, 3));
}

TEST_F(ObjLabelsTest, LabelsBecomeGroupsAndAllElseStays) {
  const SurfaceLabel mug{LabelId{7}, 1}, none;
  CopyObjWithLabels(Write("in.obj", kObj),
                    folder_ / "out.obj",
                    {{LabelId{7}, MaskId{7}, "my mug"}},
                    std::vector<SurfaceLabel>{mug, mug, none, mug});
  EXPECT_EQ(
      ReadAll(folder_ / "out.obj"),
      "# by hand\r\nmtllib a b.mtl\r\nv +0.10 0 0 1 0 0\nv 1 0 0\nv 1 1 0\nvt 0.5 0.5\nvn 0 0 1\n"
      "usemtl red\ng 7_my_mug\nf 1/1/1 2/1/1 3/1/1\nv 0 1 0\nf -4//1 -2//1 -1//1\ns 1\n"
      "g unlabelled\nf 1 2 \\\n 3 4 # all\ng 7_my_mug\nf 2 3 4");
}

TEST_F(ObjLabelsTest, MaterialsAndTexturesComeAlong) {
  const fs::path obj = Write("in/in.obj", kObj);
  Write("in/a b.mtl",
        "newmtl red\nmap_Kd -s 1 1 1 tex/red.png\nmap_Bump ../outside.png\nbump my bump.png\n");
  Write("in/tex/red.png", "red");
  Write("in/my bump.png", "bump");
  Write("outside.png", "outside");
  CopyFiles(ObjMaterialFiles(obj, folder_ / "out"));
  EXPECT_EQ(ReadAll(folder_ / "out/a b.mtl"), ReadAll(folder_ / "in/a b.mtl"));
  EXPECT_EQ(ReadAll(folder_ / "out/tex/red.png"), "red");
  EXPECT_EQ(ReadAll(folder_ / "out/my bump.png"), "bump");
  EXPECT_EQ(ObjMaterialFiles(obj, folder_ / "out").size(), 3u) << "the same may be there";

  Write("out/tex/red.png", "another");
  EXPECT_THROW(ObjMaterialFiles(obj, folder_ / "out"), UserError);
}

// Each part has the lines that it needs, and no other.
TEST_F(ObjLabelsTest, PartsKeepTheirLinesAndMaterials) {
  const fs::path obj =
      Write("in.obj",
            "# by hand\nmtllib a b.mtl\nv 0 0 0 1 0 0\nv 1 0 0\nv 1 1 0\nv 0 1.50 0\n"
            "v 9 9 9\nvt 0.1 0\nvt 0.2 0\nvt 0.30 1\nvn 0 0 1\nvn 0 0 2\ng old\n"
            "usemtl red\ns 1\nf 1/1 2/2 3/3\nusemtl blue\nf 1//2 3//2 -2//-1\n"
            "l 1 2\nusemtl green\nusemtl red\nf 4/3/1 3/2/1 2/1/1 # c\nf 3 2 1");
  const PolygonMesh mesh = ReadObjMesh(obj);
  const SurfaceLabel mug{LabelId{7}, 1}, cup{LabelId{8}, 1};
  const std::vector<WrittenFile> files = SplitLabelledObj(
      obj, mesh, folder_, {{LabelId{7}, MaskId{7}, "my mug"}}, {mug, cup, mug, {}}, false);
  ASSERT_EQ(files.size(), 2u);
  EXPECT_EQ(files[0].path, "objects/7_my_mug.obj");
  EXPECT_EQ(files[0].summary, "4 vertices, 2 faces");
  EXPECT_EQ(ReadAll(folder_ / files[0].path),
            "mtllib a b.mtl\nv 0 0 0 1 0 0\nv 1 0 0\nv 1 1 0\nv 0 1.50 0\nvt 0.1 0\nvt 0.2 0\n"
            "vt 0.30 1\nvn 0 0 1\ng 7_my_mug\nusemtl red\ns 1\nf 1/1 2/2 3/3\nusemtl red\n"
            "f 4/3/1 3/2/1 2/1/1\n");
  EXPECT_EQ(ReadAll(folder_ / files[1].path),
            "mtllib a b.mtl\nv 0 0 0 1 0 0\nv 1 1 0\nv 0 1.50 0\nvn 0 0 2\ng 8_label_8\ns 1\n"
            "usemtl blue\nf 1//1 2//1 3//1\n");
}

TEST_F(ObjLabelsTest, PartsMayBeClosed) {
  const fs::path obj = Write("in.obj",
                             "v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 1 1 0 0 0 1\nv 0 1 0\nv 0.5 0.5 1\n"
                             "f 1 2 5\nf 2 3 5\nf 3 4 5\nf 4 1 5\nf 4 3 2 1\n");
  const SurfaceLabel mug{LabelId{7}, 1};
  const std::vector<WrittenFile> files =
      SplitLabelledObj(obj, ReadObjMesh(obj), folder_, {}, {mug, mug, mug, mug, {}}, true);
  EXPECT_EQ(files[0].summary, "6 vertices, 8 faces, 1 cap");
  const PolygonMesh part = ReadObjMesh(folder_ / files[0].path);
  EXPECT_EQ(part.vertices[5], Eigen::Vector3d(0.5, 0.5, 0));
  Eigen::Vector3d area = Eigen::Vector3d::Zero();
  for (size_t f = 0; f < part.NumFaces(); ++f) area += part.FaceArea(f);
  EXPECT_LT(area.norm(), 1e-12) << "closed and oriented";
  EXPECT_THAT(ReadAll(folder_ / files[0].path), HasSubstr("\nv 0.5 0.5 0 "));
}

TEST_F(ObjLabelsTest, PartsNeedTexturesAndNormalsThatAreThere) {
  for (const auto& [corner, kind] :
       {std::pair("1/2", "vt"), {"1/x", "vt"}, {"1/1/1", "vn"}, {"1//0", "vn"}}) {
    const fs::path obj =
        Write("in.obj", std::string("v 0 0 0\nvt 0 0\nf 1 1 ") + corner + "\nvn 0 0 1\n");
    try {
      RequireSplittableObj(obj);
      ADD_FAILURE() << "accepted " << corner;
    } catch (const UserError& error) {
      EXPECT_THAT(error.what(), HasSubstr("line 3 is a face with a corner at a `")) << corner;
      EXPECT_THAT(error.what(), HasSubstr(kind)) << corner;
    }
  }
}

TEST_F(ObjLabelsTest, RefusesBadFilesWithOneSentence) {
  EXPECT_THAT(Refusal("v 0 0 0\n"), HasSubstr("has no faces"));
  EXPECT_THAT(Refusal("v 0 0\nf 1 1 1\n"), HasSubstr("line 1 is a vertex without three numbers"));
  EXPECT_THAT(Refusal("v 0 0 0\n\nf 1 1\n"), HasSubstr("line 3 is a face of fewer than three"));
  for (const char* corner : {"2", "0", "-2", "x", "99999999999999999999", "4294967296"}) {
    EXPECT_THAT(Refusal(std::string("v 0 0 0\nf 1 1 ") + corner + "\n"),
                HasSubstr("face 0 has a corner that is no vertex"))
        << corner;
  }
}

// Of cuts and changed bytes, a mesh or a refusal.
TEST_F(ObjLabelsTest, DamagedFilesAreReadOrRefused) {
  const std::string whole = kObj;
  std::vector<std::string> damaged;
  for (size_t at = 0; at < whole.size(); at += 3) {
    damaged.push_back(whole.substr(0, at));
    for (const char byte : {'\0', '\n', '\\', '-', '9', '\xff'}) {
      damaged.push_back(whole);
      damaged.back()[at] = byte;
    }
  }
  int refused = 0;
  for (const std::string& bytes : damaged) {
    const fs::path path = Write("in.obj", bytes);
    PolygonMesh mesh;
    try {
      mesh = ReadObjMesh(path);
      RequireValidMesh(path, mesh);
    } catch (const UserError& error) {
      EXPECT_THAT(error.what(), HasSubstr("in.obj"));
      ++refused;
      continue;
    }
    CopyObjWithLabels(path, folder_ / "out.obj", {}, std::vector<SurfaceLabel>(mesh.NumFaces()));
  }
  EXPECT_GT(refused, 50);
}

}  // namespace
}  // namespace semfoam
