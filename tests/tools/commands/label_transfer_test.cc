// SPDX-License-Identifier: GPL-3.0-or-later
//
// label_transfer as a user meets it, on a foam of two balls.
#include "foam/model/model.h"

#include "tests/export/test_foams.h"
#include "tests/export/transfer/test_meshes.h"
#include "tests/tools/program.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::UnorderedElementsAre;

// The last line of what a command has said.
std::string Sentence(const Outcome& outcome) {
  std::string text = outcome.err;
  while (text.ends_with('\n')) text.pop_back();
  return text.substr(text.rfind('\n') + 1);
}

class LabelTransferCommandTest : public testing::Test {
 protected:
  LabelTransferCommandTest() {
    Model model = TouchingBalls(4000);
    model.world_from_normalized = {2, {10, 0, 0}};
    WriteModel(folder_ / "scene.foam", model);
    AddBall({9.4, 0, 0}, 0.59, 16, &mesh_);
    AddBall({10.6, 0, 0}, 0.59, 16, &mesh_);
    WriteFile(folder_ / "a mesh.ply", PlyOf(mesh_));
  }

  Outcome Run(const fs::path& input, const fs::path& output, std::vector<std::string> more = {}) {
    more.insert(more.begin(),
                {"label_transfer",
                 "--foam_path",
                 (folder_ / "scene.foam").string(),
                 "--input_path",
                 input.string(),
                 "--output_path",
                 output.string()});
    return RunSemfoam(more);
  }

  TempFolder folder_;
  PolygonMesh mesh_;
};

TEST_F(LabelTransferCommandTest, LeavesTheLabelledFileAndATable) {
  const fs::path out = folder_ / "out";
  const Outcome outcome = Run(folder_ / "a mesh.ply", out);
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(FilesBelow(out), UnorderedElementsAre("a mesh.ply", "labels.json"));
  EXPECT_THAT(outcome.err, HasSubstr("a mesh.ply: 1088 vertices and 1920 faces labelled in 0:0"));
  EXPECT_THAT(outcome.out, HasSubstr("mug"));

  const PlyLabels labels = ReadPlyLabels(out / "a mesh.ply");
  const json table = json::parse(ReadFile(out / "labels.json"));
  EXPECT_EQ(table["version"], 1);
  EXPECT_EQ(table["labels"], json({{"7", "mug"}, {"8", "label_8"}}));
  EXPECT_EQ(table["source_model_xxh64"], ChecksumOf(folder_ / "scene.foam"));
  EXPECT_EQ(table["transfer"]["file"], "a mesh.ply");
  EXPECT_EQ(table["transfer"]["vertices"], labels.vertices.size());
  EXPECT_EQ(table["transfer"]["faces"], labels.faces.size());
  EXPECT_EQ(table["transfer"]["labelled_vertices"], labels.vertices.size());
  ASSERT_EQ(table["objects"].size(), 2u);
  for (const json& object : table["objects"]) {
    const LabelId id{object["id"].get<int32_t>()};
    int vertices = 0, faces = 0;
    for (const SurfaceLabel& label : labels.vertices) vertices += label.id == id;
    for (const SurfaceLabel& label : labels.faces) faces += label.id == id;
    EXPECT_EQ(object["vertices"], vertices);
    EXPECT_EQ(object["faces"], faces);
    EXPECT_GT(object["confidence"], 0.5);
  }

  // Its own files are replaced, by the same bytes; from an output one gets the same again.
  const std::string bytes = ReadFile(out / "a mesh.ply");
  ASSERT_EQ(Run(folder_ / "a mesh.ply", out, {"--num_threads", "1"}).exit_code, 0);
  EXPECT_EQ(ReadFile(out / "a mesh.ply"), bytes);
  ASSERT_EQ(Run(out / "a mesh.ply", folder_ / "again").exit_code, 0);
  EXPECT_EQ(ReadFile(folder_ / "again" / "a mesh.ply"), bytes);
  EXPECT_EQ(ReadFile(folder_ / "again" / "labels.json"), ReadFile(out / "labels.json"));
}

TEST_F(LabelTransferCommandTest, TheFrameOptionsAreThoseOfTheExporters) {
  PolygonMesh moved = mesh_;
  for (Eigen::Vector3d& x : moved.vertices) x = 100 * Eigen::Vector3d(-x.y(), x.x(), x.z());
  WriteFile(folder_ / "moved.ply", PlyOf(moved));
  const Outcome wrong = Run(folder_ / "moved.ply", folder_ / "wrong");
  EXPECT_EQ(wrong.exit_code, 1);
  EXPECT_THAT(
      Sentence(wrong),
      NamesMistake((folder_ / "moved.ply").string(), {"transform"}, "is off that of the matter"))
      << wrong.err;
  EXPECT_FALSE(fs::exists(folder_ / "wrong"));
  ASSERT_EQ(Run(folder_ / "moved.ply",
                folder_ / "right",
                {"--transform", "0 -1 0 0 1 0 0 0 0 0 1 0", "--scale", "100"})
                .exit_code,
            0);
  ASSERT_EQ(Run(folder_ / "a mesh.ply", folder_ / "here").exit_code, 0);
  EXPECT_EQ(ReadPlyLabels(folder_ / "right" / "moved.ply").faces.size(), mesh_.NumFaces());
  size_t same = 0;
  const PlyLabels right = ReadPlyLabels(folder_ / "right" / "moved.ply");
  const PlyLabels here = ReadPlyLabels(folder_ / "here" / "a mesh.ply");
  for (size_t f = 0; f < mesh_.NumFaces(); ++f) same += right.faces[f].id == here.faces[f].id;
  EXPECT_GE(same, mesh_.NumFaces() - 4);
}

// The SfM points of the tabletop as a cloud, without a foam: the votes of all photos that see a
// point say what those of its track say, mostly: so few points hide each other badly.
TEST_F(LabelTransferCommandTest, MasksAloneTellTheLabels) {
  const fs::path points = folder_ / "P" / "points.ply";
  ASSERT_EQ(RunSemfoam({"point_labeler",
                        "--workspace_path",
                        kTabletop.string(),
                        "--output_path",
                        points.parent_path().string()})
                .exit_code,
            0);
  const Outcome outcome = RunSemfoam({"label_transfer",
                                      "--workspace_path",
                                      kTabletop.string(),
                                      "--input_path",
                                      points.string(),
                                      "--output_path",
                                      (folder_ / "M").string()});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("64 of 64 photos have a mask"));
  const PlyLabels by_track = ReadPlyLabels(points);
  const PlyLabels by_masks = ReadPlyLabels(folder_ / "M" / "points.ply");
  ASSERT_EQ(by_masks.vertices.size(), by_track.vertices.size());
  int sure = 0, same = 0;
  for (size_t i = 0; i < by_track.vertices.size(); ++i) {
    if (by_track.vertices[i].confidence < 0.95f) continue;
    ++sure;
    same += by_masks.vertices[i].id == by_track.vertices[i].id;
  }
  EXPECT_GT(sure, 4000);
  EXPECT_GT(same, 0.75 * sure);
  const json table = json::parse(ReadFile(folder_ / "M" / "labels.json"));
  EXPECT_EQ(table["labels"]["6"], "mug");
  EXPECT_EQ(table["objects"].size(), 13u);

  const Outcome moved = RunSemfoam({"label_transfer",
                                    "--workspace_path",
                                    kTabletop.string(),
                                    "--input_path",
                                    points.string(),
                                    "--output_path",
                                    (folder_ / "far").string(),
                                    "--transform",
                                    "1 0 0 1000 0 1 0 0 0 0 1 0"});
  EXPECT_EQ(moved.exit_code, 1);
  EXPECT_THAT(Sentence(moved),
              NamesMistake(points.string(), {"transform"}, "are seen by no photo"));
  EXPECT_FALSE(fs::exists(folder_ / "far"));
}

TEST_F(LabelTransferCommandTest, ObjectsMayBeFilesOfTheirOwn) {
  const fs::path out = folder_ / "out";
  ASSERT_EQ(Run(folder_ / "a mesh.ply", out, {"--split", "1"}).exit_code, 0);
  EXPECT_THAT(FilesBelow(out),
              UnorderedElementsAre(
                  "a mesh.ply", "labels.json", "objects/7_mug.ply", "objects/8_label_8.ply"));
  const json table = json::parse(ReadFile(out / "labels.json"));
  size_t faces = 0;
  for (const json& object : table["objects"]) {
    const PlyLabels part = ReadPlyLabels(out / object["files"]["ply"].get<std::string>());
    EXPECT_EQ(part.faces.size(), object["faces"]);
    for (const SurfaceLabel& label : part.faces) EXPECT_EQ(Value(label.id), object["id"]);
    faces += part.faces.size();
  }
  EXPECT_EQ(faces, mesh_.NumFaces());
  EXPECT_EQ(Run(folder_ / "a mesh.ply", out, {"--split", "1"}).exit_code, 0);
  fs::remove(out / "labels.json");
  fs::remove(out / "a mesh.ply");
  EXPECT_THAT(Sentence(Run(folder_ / "a mesh.ply", out, {"--split", "1"})),
              NamesMistake((out / "objects").string(), {}, "would be lost"));
}

// The labelled mesh of an STL is a PLY, its objects are STLs.
TEST_F(LabelTransferCommandTest, AnStlHasNoPlaceForLabels) {
  WriteFile(folder_ / "a mesh.stl", StlOf(mesh_, ""));
  const fs::path out = folder_ / "out";
  const Outcome outcome = Run(folder_ / "a mesh.stl", out, {"--split", "1", "--cap", "1"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(FilesBelow(out),
              UnorderedElementsAre(
                  "a mesh.ply", "labels.json", "objects/7_mug.stl", "objects/8_label_8.stl"));
  EXPECT_THAT(outcome.err,
              HasSubstr("a mesh.stl has no place for labels, so the labelled mesh is a PLY"));
  const json table = json::parse(ReadFile(out / "labels.json"));
  EXPECT_EQ(table["transfer"]["file"], "a mesh.ply");
  EXPECT_EQ(table["objects"][0]["files"]["stl"], "objects/7_mug.stl");
  EXPECT_EQ(ReadPlyLabels(out / "a mesh.ply").faces.size(), mesh_.NumFaces());
  EXPECT_THAT(Sentence(Run(folder_ / "a mesh.stl", folder_ / "out.stl")),
              NamesMistake((folder_ / "out.stl").string(), {"split"}, "no place for labels"));
  EXPECT_FALSE(fs::exists(folder_ / "out.stl"));
}

TEST_F(LabelTransferCommandTest, ObjectsOfAnObjKeepTheirMaterials) {
  fs::create_directories(folder_ / "in");
  WriteFile(folder_ / "in" / "a.mtl", "newmtl all\nmap_Kd all.png\n");
  WriteFile(folder_ / "in" / "all.png", "png");
  std::string obj = "mtllib a.mtl\nvt 0.25 0.5\nusemtl all\n";
  for (const Eigen::Vector3d& x : mesh_.vertices) {
    obj += "v " + std::to_string(x.x()) + " " + std::to_string(x.y()) + " " +
           std::to_string(x.z()) + "\n";
  }
  for (size_t f = 0; f < mesh_.NumFaces(); ++f) {
    obj += "f";
    for (const uint32_t corner : mesh_.Face(f)) obj += " " + std::to_string(corner + 1) + "/1";
    obj += "\n";
  }
  WriteFile(folder_ / "in" / "a.obj", obj);
  const fs::path out = folder_ / "out";
  const Outcome outcome = Run(folder_ / "in" / "a.obj", out, {"--split", "1"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(FilesBelow(out),
              UnorderedElementsAre("a.obj",
                                   "a.mtl",
                                   "all.png",
                                   "labels.json",
                                   "objects/7_mug.obj",
                                   "objects/8_label_8.obj",
                                   "objects/a.mtl",
                                   "objects/all.png"));
  EXPECT_THAT(ReadFile(out / "objects/7_mug.obj"),
              HasSubstr("vt 0.25 0.5\ng 7_mug\nusemtl all\nf "));
  EXPECT_EQ(Run(folder_ / "in" / "a.obj", out, {"--split", "1"}).exit_code, 0) << "again";
}

TEST_F(LabelTransferCommandTest, OneSourceOfLabelsIsNeeded) {
  const std::string mesh = (folder_ / "a mesh.ply").string(), out = (folder_ / "out").string();
  EXPECT_THAT(Sentence(RunSemfoam({"label_transfer", "--input_path", mesh, "--output_path", out})),
              NamesMistake("", {"foam_path", "workspace_path"}, "neither"));
  EXPECT_THAT(Sentence(Run(mesh, out, {"--workspace_path", kTabletop.string()})),
              NamesMistake("", {"foam_path", "workspace_path"}, "both"));
  EXPECT_THAT(Sentence(Run(mesh, out, {"--mask_path", out})),
              NamesMistake("", {"mask_path", "foam_path"}, "no effect"));
  EXPECT_THAT(Sentence(Run(mesh, out, {"--cap", "1"})),
              NamesMistake("", {"cap", "split"}, "no effect"));
  EXPECT_THAT(Sentence(Run(folder_ / "a.obj", out, {})),
              NamesMistake((folder_ / "a.obj").string(), {}, "there is no such file"));
  EXPECT_FALSE(fs::exists(out));
}

TEST_F(LabelTransferCommandTest, NamesAreThoseOfTheUser) {
  WriteFile(folder_ / "names.json", R"({"labels": {"8": "cup"}})");
  ASSERT_EQ(Run(folder_ / "a mesh.ply",
                folder_ / "out",
                {"--labels_path", (folder_ / "names.json").string()})
                .exit_code,
            0);
  EXPECT_THAT(ReadFile(folder_ / "out" / "a mesh.ply"),
              HasSubstr("comment label 7 mug\ncomment label 8 cup\n"));
}

TEST_F(LabelTransferCommandTest, FilesOfOthersStay) {
  const fs::path mesh = folder_ / "a mesh.ply";
  const Outcome onto_itself = Run(mesh, folder_.path());
  EXPECT_EQ(onto_itself.exit_code, 1);
  EXPECT_THAT(onto_itself.err, HasSubstr("is read, so it will not be written"));
  const fs::path names = folder_ / "named" / "labels.json";
  fs::create_directories(folder_ / "named");
  WriteFile(names, R"({"labels": {"7": "cup"}})");
  EXPECT_THAT(Sentence(Run(mesh, folder_ / "named")),
              NamesMistake(names.string(), {}, "was not written by label_transfer"));
  fs::create_directories(folder_ / "meshes");
  WriteFile(folder_ / "meshes" / "a mesh.ply", "mine");
  EXPECT_THAT(Sentence(Run(mesh, folder_ / "meshes")),
              NamesMistake((folder_ / "meshes" / "a mesh.ply").string(), {}, "would be lost"));
  EXPECT_EQ(ReadFile(folder_ / "meshes" / "a mesh.ply"), "mine");
}

TEST_F(LabelTransferCommandTest, BadInputIsOneSentence) {
  EXPECT_THAT(Sentence(Run(folder_ / "none.ply", folder_ / "out")),
              NamesMistake((folder_ / "none.ply").string(), {}, "no such file"));
  WriteFile(folder_ / "a.ply", "no mesh");
  EXPECT_THAT(Sentence(Run(folder_ / "a.ply", folder_ / "out")),
              NamesMistake((folder_ / "a.ply").string(), {}, "is no PLY file"));
  EXPECT_THAT(Sentence(Run(folder_ / "a mesh.ply", folder_ / "out", {"--tolerance", "-1"})),
              NamesMistake("", {"tolerance", "-1"}, "must be 0 or a length"));
  EXPECT_THAT(Sentence(Run(folder_ / "a mesh.ply", folder_ / "out", {"--smoothness", "-3"})),
              NamesMistake("", {"smoothness", "-3"}, "must be a length"));
  EXPECT_FALSE(fs::exists(folder_ / "out"));
}

}  // namespace
}  // namespace semfoam
