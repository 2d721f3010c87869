// SPDX-License-Identifier: GPL-3.0-or-later
//
// The command mesh_evaluator on what mesh_exporter wrote of a small foam.
#include "foam/model/model.h"

#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "tests/export/test_foams.h"
#include "tests/small_files.h"
#include "tests/tools/peak_memory.h"
#include "tests/tools/program.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::SizeIs;

// A ball as an OBJ: `rings` times twice as many quads.
std::string BallObj(const Eigen::Vector3d& center, double radius, int rings = 40) {
  std::ostringstream obj;
  const int around = 2 * rings;
  for (int i = 0; i <= rings; ++i) {
    for (int k = 0; k < around; ++k) {
      const double a = M_PI * i / rings, b = 2 * M_PI * k / around;
      const Eigen::Vector3d x =
          center + radius * Eigen::Vector3d(sin(a) * cos(b), sin(a) * sin(b), cos(a));
      obj << "v " << x.x() << " " << x.y() << " " << x.z() << "\n";
    }
  }
  for (int i = 0; i < rings; ++i) {
    for (int k = 0; k < around; ++k) {
      const int next = (k + 1) % around;
      obj << "f " << 1 + i * around + k << " " << 1 + (i + 1) * around + k << " "
          << 1 + (i + 1) * around + next << " " << 1 + i * around + next << "\n";
    }
  }
  return obj.str();
}

class MeshEvaluator : public testing::Test {
 protected:
  void SetUp() override {
    WriteModel(folder_ / "scene.foam", TouchingBalls(20000));
    const Outcome exported = RunSemfoam({"mesh_exporter",
                                         "--foam_path",
                                         (folder_ / "scene.foam").string(),
                                         "--output_path",
                                         (folder_ / "out").string()});
    ASSERT_EQ(exported.exit_code, 0) << exported.err;
    fs::create_directories(folder_ / "truth");
    WriteFile(folder_ / "truth/mug.obj", BallObj({-0.3, 0, 0}, 0.3));
    WriteFile(folder_ / "truth/label_8.obj", BallObj({0.3, 0, 0}, 0.3));
  }

  Outcome Run(std::vector<std::string> more,
              const std::string& meshes = "out",
              const std::string& truth = "truth") const {
    std::vector<std::string> arguments = {"mesh_evaluator",
                                          "--mesh_path",
                                          (folder_ / meshes).string(),
                                          "--reference_path",
                                          (folder_ / truth).string()};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return RunSemfoam(arguments);
  }

  json Scores(std::vector<std::string> more,
              const std::string& meshes = "out",
              const std::string& truth = "truth") const {
    more.insert(more.end(), {"--json", (folder_ / "scores.json").string()});
    const Outcome outcome = Run(more, meshes, truth);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return json::parse(ReadFile(folder_ / "scores.json"));
  }

  void ExpectRefused(const Outcome& outcome,
                     const std::string& sentence,
                     const std::string& field = "") const {
    EXPECT_EQ(outcome.exit_code, 1);
    ASSERT_THAT(outcome.Errors(), SizeIs(1)) << outcome.err;
    EXPECT_THAT(outcome.Errors()[0], AllOf(HasSubstr(sentence), HasSubstr(field)));
    EXPECT_EQ(outcome.out, "");
  }

  const TempFolder folder_;
};

TEST_F(MeshEvaluator, ScoresEveryObjectAndTheirMean) {
  const Outcome outcome = Run({});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  for (const char* text : {"within 0.01", "within 0.02", "\nmug ", "\nlabel_8 ", "\nmean "}) {
    EXPECT_THAT(outcome.out, HasSubstr(text));
  }
  // Cells are some 0.06 across, the diagonal is 1.04.
  const json scores = Scores({"--tolerances", "0.002,0.03,0.1"});
  EXPECT_EQ(scores["tolerances"], json({0.002, 0.03, 0.1}));
  ASSERT_EQ(scores["objects"].size(), 2u);
  for (const auto& [name, object] : scores["objects"].items()) {
    EXPECT_NEAR(object["diagonal"].get<double>(), 0.6 * std::sqrt(3), 1e-3);
    EXPECT_LT(object["f_score"][0].get<double>(), 0.3);
    EXPECT_GT(object["f_score"][1].get<double>(), 0.5);
    EXPECT_GT(object["f_score"][2].get<double>(), 0.99);
    EXPECT_LT(object["accuracy"].get<double>(), object["accuracy_max"].get<double>());
    EXPECT_LT(object["completeness_max"].get<double>(), 0.1);
    EXPECT_GT(object["completeness"].get<double>(), 0.002);
  }
  for (const char* key : {"precision", "recall", "f_score"}) {
    const double mean = scores["objects"]["mug"][key][1].get<double>() / 2 +
                        scores["objects"]["label_8"][key][1].get<double>() / 2;
    EXPECT_NEAR(scores["mean"][key][1].get<double>(), mean, 1e-12) << key;
  }
  // The folder with the files alone, and any of the formats, give the same.
  EXPECT_EQ(Scores({}, "out/objects"), Scores({}));
  EXPECT_EQ(Scores({}, "out/objects/7_mug.ply", "truth/mug.obj")["objects"]["mug"],
            Scores({})["objects"]["mug"]);
  EXPECT_EQ(Scores({"--num_threads", "1"}), Scores({"--num_threads", "3"}));
}

TEST_F(MeshEvaluator, DistancesAreToSamplesOrToTheSurface) {
  EXPECT_EQ(Scores({}), Scores({"--nearest", "samples"}));
  const json samples = Scores({})["mean"], surface = Scores({"--nearest", "surface"})["mean"];
  EXPECT_LT(surface["accuracy"].get<double>(), samples["accuracy"].get<double>());
  EXPECT_NEAR(surface["accuracy"].get<double>(), samples["accuracy"].get<double>(), 2e-3);
  ExpectRefused(Run({"--nearest", "corners"}), "for option '--nearest' is invalid");
}

TEST_F(MeshEvaluator, AMissingMeshScoresNothing) {
  WriteFile(folder_ / "truth/cat.obj", BallObj({0, 0, 0}, 1));
  const json scores = Scores({});
  EXPECT_EQ(scores["objects"]["cat"]["f_score"], json({0.0, 0.0}));
  const double others = scores["objects"]["mug"]["f_score"][1].get<double>() +
                        scores["objects"]["label_8"]["f_score"][1].get<double>();
  EXPECT_NEAR(scores["mean"]["f_score"][1].get<double>(), others / 3, 1e-12);
  EXPECT_THAT(Run({}).out, HasSubstr("no mesh of that name"));
}

TEST_F(MeshEvaluator, OnlyVisiblePointsCountForRecall) {
  fs::create_directories(folder_ / "seen");
  for (const char* name : {"mug", "label_8"}) {
    WriteFile(folder_ / "seen" / (std::string(name) + ".ply"),
              "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\n"
              "property float z\nend_header\n0 0 0\n0 9 0\n");
  }
  const json scores =
      Scores({"--tolerances", "0.1", "--visible_path", (folder_ / "seen").string()});
  EXPECT_EQ(scores["objects"]["mug"]["recall"][0], 0.5);
  EXPECT_GT(scores["objects"]["mug"]["precision"][0].get<double>(), 0.99);
}

TEST_F(MeshEvaluator, ATransformBringsMeshesToTheirReferences) {
  fs::create_directories(folder_ / "moved");
  // x_moved = 2 x + (1, 0, 0)
  WriteFile(folder_ / "moved/mug.obj", BallObj({0.4, 0, 0}, 0.6));
  EXPECT_LT(Scores({}, "out", "moved")["mean"]["f_score"][1].get<double>(), 0.3);
  const json scores = Scores({"--transform", "2 0 0 1 0 2 0 0 0 0 2 0"}, "out", "moved");
  const json plain = Scores({})["objects"]["mug"];
  EXPECT_NEAR(scores["mean"]["f_score"][1].get<double>(), plain["f_score"][1].get<double>(), 2e-3);
}

// Small files whose counts promise what would take gigabytes.
TEST_F(MeshEvaluator, CountsOfAFileTakeNoMemory) {
  constexpr uint32_t kHuge = 0xf0000000;
  std::vector<std::pair<std::string, std::string>> files;
  for (const char* format : {"ascii", "binary_little_endian", "binary_big_endian"}) {
    files.emplace_back(std::string(format) + ".ply", SmallPlyMesh(format, kHuge));
  }
  const std::string vertices = "0 0 0\n1 0 0\n0 1 0\n";
  files.emplace_back("vertices.off", "OFF\n400000000 1 0\n" + vertices + "3 0 1 2\n");
  files.emplace_back("faces.off", "OFF\n3 400000000 0\n" + vertices + "3 0 1 2\n");
  files.emplace_back("corners.off", "OFF\n3 1 0\n" + vertices + "400000000 0 1 2\n");
  const std::string om = ReadFile(folder_ / "out/objects/7_mug.om");
  for (const auto& [name, at] : {std::pair("vertices", 4), {"faces", 8}, {"edges", 12}}) {
    std::string huge;
    AppendBinary(kHuge / 4, &huge);
    files.emplace_back(std::string(name) + ".om", std::string(om).replace(at, huge.size(), huge));
  }
  for (const auto& [name, bytes] : files) {
    SCOPED_TRACE(name);
    WriteFile(folder_ / name, bytes);
    const MeasuredRun run = MeasureSemfoam({"mesh_evaluator",
                                            "--mesh_path",
                                            (folder_ / name).string(),
                                            "--reference_path",
                                            (folder_ / "truth/mug.obj").string()},
                                           /*memory_limit=*/int64_t{4} << 30);
    ExpectRefused(run.outcome, name + ": ");
    EXPECT_LT(run.peak_bytes, int64_t{400} << 20);
  }
}

// A file system takes names that a JSON file does not; that is told before the work.
TEST_F(MeshEvaluator, NamesThatAreNotUtf8AreForTheTableAlone) {
  const std::string name = "m\xFCg.obj";
  fs::create_directories(folder_ / "odd");
  fs::copy(folder_ / "truth/mug.obj", folder_ / "odd" / name);
  const Outcome table = Run({}, "odd", "odd");
  EXPECT_EQ(table.exit_code, 0) << table.err;
  EXPECT_THAT(table.out, HasSubstr("m\xEF\xBF\xBDg "));
  const Outcome refused = Run({"--json_path", (folder_ / "scores.json").string()}, "odd", "odd");
  ExpectRefused(refused, "m\xEF\xBF\xBDg.obj: its name is not UTF-8");
  EXPECT_EQ(refused.out, "");
  EXPECT_FALSE(fs::exists(folder_ / "scores.json"));
}

TEST_F(MeshEvaluator, PrintsTheScoresAsJsonOnRequest) {
  const json written = Scores({});
  fs::remove(folder_ / "scores.json");
  const Outcome outcome = Run({"--json", "1", "--json_path", (folder_ / "scores.json").string()});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(json::parse(outcome.out), written);
  EXPECT_EQ(json::parse(ReadFile(folder_ / "scores.json")), written);
  EXPECT_THAT(Run({"--json", "0"}).out, HasSubstr("within 0.01"));
  ExpectRefused(Run({"--json", "a.json", "--json_path", "b.json"}), "given more than once");
}

TEST_F(MeshEvaluator, ScoresTakeNoMeshesPlace) {
  const std::string mug = ReadFile(folder_ / "truth/mug.obj");
  ExpectRefused(Run({"--json_path", (folder_ / "truth/mug.obj").string()}),
                "mug.obj: is read, so it will not be written");
  EXPECT_TRUE(ReadFile(folder_ / "truth/mug.obj") == mug);
}

TEST_F(MeshEvaluator, BadInputIsOneSentence) {
  for (const char* tolerances : {"", "0", "-0.1", "0.1,", "a", "0.1,nan", "1e999"}) {
    ExpectRefused(Run({"--tolerances", tolerances}), "for option '--tolerances' is invalid");
  }
  ExpectRefused(Run({"--transform", "1 2 3"}), "--transform is '1 2 3'");
  ExpectRefused(Run({}, "nothing"), "there is no such file or folder", "mesh_path");
  ExpectRefused(Run({}, "out", "nothing"), "there is no such file or folder", "reference_path");
  ExpectRefused(Run({"--visible_path", (folder_ / "no").string()}), "no: ", "visible_path");
  ExpectRefused(RunSemfoam({"mesh_evaluator"}), "'--mesh_path' is required but missing");
  fs::create_directories(folder_ / "others");
  WriteFile(folder_ / "others/cat.obj", BallObj({0, 0, 0}, 1));
  ExpectRefused(Run({}, "out", "others"), "has no mesh that is named as a reference");
  WriteFile(folder_ / "truth/mug.obj", "no mesh");
  ExpectRefused(Run({}), "mug.obj: cannot be read as a mesh");
  WriteFile(folder_ / "truth/mug.obj", "v 0 0 0\n");
  ExpectRefused(Run({}), "mug.obj: has no face with an area");
}

}  // namespace
}  // namespace semfoam
