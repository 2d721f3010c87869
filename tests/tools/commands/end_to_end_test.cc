// SPDX-License-Identifier: GPL-3.0-or-later
//
// Whole runs on the tabletop scene, short and of no quality, but complete: what they leave is
// there, valid, and says the same everywhere.
#include "plugin/mask/mask_png.h"
#include "plugin/photo/photo.h"
#include "tools/images/image_files.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <memory>
#include <regex>
#include <set>

#include "tests/tools/program.h"
#include <OpenImageIO/imageio.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::IsSupersetOf;
using ::testing::Not;
using ::testing::SizeIs;

// One run of automatic_segmenter for all tests of this file.
class EndToEndTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TempFolder;
    run_ = new Outcome(RunSemfoam(TinyTraining({"automatic_segmenter",
                                                "--workspace_path",
                                                kTabletop.string(),
                                                "--output_path",
                                                Out().string(),
                                                "--test_every",
                                                "8",
                                                "--VolumeExport.max_resolution",
                                                "96"})));
  }
  static void TearDownTestSuite() {
    delete run_;
    delete folder_;
  }
  void SetUp() override { ASSERT_EQ(run_->exit_code, 0) << run_->err; }

  static fs::path Out() { return *folder_ / "all of it"; }
  static std::string FoamPath() { return (Out() / "scene.foam").string(); }
  static json Labels() { return json::parse(ReadFile(Out() / "labels.json")); }

  static TempFolder* folder_;
  static Outcome* run_;
};
TempFolder* EndToEndTest::folder_ = nullptr;
Outcome* EndToEndTest::run_ = nullptr;

TEST_F(EndToEndTest, SaysWhatItMatchedAndWhatItDoes) {
  EXPECT_THAT(run_->err, HasSubstr("64 of 64 photos have a mask, 14 labels, 0 masks unused"));
  EXPECT_THAT(run_->err, HasSubstr("Masks held against the tracks: of 643 regions"));
  EXPECT_THAT(run_->err, HasSubstr("47 ids became 14 labels"));
  EXPECT_THAT(run_->err, HasSubstr("64 photos, 8 held out"));
  EXPECT_THAT(run_->err, HasSubstr("rays/s"));
  EXPECT_THAT(run_->err, Not(HasSubstr("\r")));  // this is no terminal
  EXPECT_THAT(run_->Errors(), IsEmpty());
}

TEST_F(EndToEndTest, LeavesEveryFileAndNoOther) {
  std::set<std::string> expected = {"scene.foam",
                                    "effects.json",
                                    "labels.json",
                                    "training_log.csv",
                                    "training_plot.svg",
                                    "training_plot.png",
                                    "report.html",
                                    "scene.vdb",
                                    "scene.glb",
                                    "scene.usda"};
  const json labels = Labels();
  ASSERT_GE(labels["objects"].size(), 2u) << run_->err;
  for (const json& object : labels["objects"]) {
    const std::string stem = "objects/" + std::to_string(object["id"].get<int>()) + "_" +
                             object["name"].get<std::string>();
    for (const std::string format : {"vdb", "om", "ply", "obj", "mtl", "png", "glb"}) {
      expected.insert(stem + "." + format);
      EXPECT_EQ(object["files"][format], stem + "." + format);
    }
    EXPECT_EQ(object["files"].size(), 7u);
  }
  EXPECT_EQ(labels["files"],
            (json{{"vdb", "scene.vdb"}, {"glb", "scene.glb"}, {"usda", "scene.usda"}}));
  const std::vector<std::string> files = FilesBelow(Out());
  EXPECT_EQ(std::set<std::string>(files.begin(), files.end()), expected);
  for (const std::string& file : files) EXPECT_GT(fs::file_size(Out() / file), 0u) << file;
}

TEST_F(EndToEndTest, VolumesHoldTheGridsTheyPromise) {
  const auto expect_grids = [](const fs::path& path, std::vector<std::string> grids) {
    const Outcome print = RunProgram("vdb_print", {"-l", path.string()});
    EXPECT_EQ(print.exit_code, 0) << path << print.err;
    for (const std::string& grid : grids) EXPECT_THAT(print.out, HasSubstr(grid)) << path;
  };
  expect_grids(Out() / "scene.vdb", {"density", "color", "label", "confidence"});
  const json labels = Labels();  // a temporary would not outlive the head of the loop
  for (const json& object : labels["objects"]) {
    expect_grids(Out() / object["files"]["vdb"].get<std::string>(),
                 {"density", "color", "label", "confidence", "surface"});
  }
}

// Every object, in both formats that CGAL reads, and both surfaces.
// Whether a mesh is of a thing of which photos show one side, so that it may be a sheet with a rim.
bool MayBeSheet(const std::string& file) {
  static const std::regex kSheets(".*_(floor|wall|picture|rug)\\.[a-z]+");
  return std::regex_match(file, kSheets);
}

TEST_F(EndToEndTest, SurfacesHoldWhatTheyPromise) {
  const std::string smooth = (*folder_ / "smooth").string();
  ASSERT_EQ(RunSemfoam({"mesh_exporter",
                        "--foam_path",
                        FoamPath(),
                        "--output_path",
                        smooth,
                        "--method",
                        "smooth",
                        "--close_sheets",
                        "1",
                        "--formats",
                        "ply,obj"})
                .exit_code,
            0);
  std::vector<std::string> meshes;
  size_t num_sheets = 0;
  for (const fs::path& folder : {Out(), fs::path(smooth)}) {
    for (const std::string& file : FilesBelow(folder / "objects")) {
      const std::string extension = fs::path(file).extension();
      if (extension != ".ply" && extension != ".obj") continue;
      const bool is_sheet = folder == Out() && MayBeSheet(file);
      num_sheets += is_sheet;
      if (!is_sheet) meshes.push_back((folder / "objects" / file).string());
    }
  }
  EXPECT_EQ(meshes.size() + num_sheets, 4 * Labels()["objects"].size());
  const Outcome outcome = RunProgram(SEMFOAM_CHECK_SURFACES, meshes);
  EXPECT_EQ(outcome.exit_code, 0) << outcome.out << outcome.err;
}

using Triangle = std::array<int64_t, 3>;

// Every directed edge occurs once, and so does its opposite, but at the rim of a sheet: counts
// these.
void CountRim(const std::vector<Triangle>& triangles, const std::string& name, int64_t* rim) {
  ASSERT_FALSE(triangles.empty()) << name;
  std::map<std::pair<int64_t, int64_t>, int> edges;
  for (const Triangle& t : triangles) {
    for (int k = 0; k < 3; ++k) ++edges[{t[k], t[(k + 1) % 3]}];
  }
  for (const auto& [edge, count] : edges) {
    ASSERT_EQ(count, 1) << name;
    *rim += edges.count({edge.second, edge.first}) == 0;
  }
}

// The triangles of a binary little-endian PLY with one list, and its number of vertices; read by
// the header, as any other program would.
std::vector<Triangle> ReadPly(const fs::path& path, int64_t* num_vertices) {
  const std::string bytes = ReadFile(path);
  const std::map<std::string, size_t> sizes = {{"double", 8},
                                               {"float", 4},
                                               {"int", 4},
                                               {"uint", 4},
                                               {"uchar", 1},
                                               {"float64", 8},
                                               {"float32", 4},
                                               {"int32", 4},
                                               {"uint32", 4},
                                               {"uint8", 1}};
  const std::string end = "end_header\n";
  const size_t body = bytes.find(end) + end.size();
  std::istringstream header(bytes.substr(0, body));
  std::string element;
  std::map<std::string, int64_t> counts;
  size_t vertex_bytes = 0;
  size_t after_list = 0;
  for (std::string line; std::getline(header, line);) {
    std::istringstream words(line);
    std::string word, type;
    words >> word >> type;
    if (word == "format") {
      EXPECT_EQ(type, "binary_little_endian");
    }
    if (word == "element") {
      element = type;
      words >> counts[element];
    } else if (word == "property" && element == "vertex") {
      vertex_bytes += sizes.at(type);
    } else if (word == "property" && element == "face" && type != "list") {
      after_list += sizes.at(type);
    }
  }
  *num_vertices = counts["vertex"];
  std::vector<Triangle> triangles;
  size_t at = body + counts["vertex"] * vertex_bytes;
  for (int64_t face = 0; face < counts["face"]; ++face) {
    EXPECT_LE(at + 13 + after_list, bytes.size()) << path;
    EXPECT_EQ(bytes[at], 3) << path;
    int32_t corner[3];
    std::memcpy(corner, bytes.data() + at + 1, sizeof(corner));
    triangles.push_back({corner[0], corner[1], corner[2]});
    at += 13 + after_list;
  }
  EXPECT_EQ(at, bytes.size()) << path;
  return triangles;
}

std::vector<Triangle> ReadObj(const fs::path& path, int64_t* num_vertices) {
  std::istringstream lines(ReadFile(path));
  std::vector<Triangle> triangles;
  *num_vertices = 0;
  for (std::string line; std::getline(lines, line);) {
    if (line.rfind("v ", 0) == 0) ++*num_vertices;
    if (line.rfind("f ", 0) != 0) continue;
    std::istringstream words(line.substr(2));
    Triangle triangle;
    for (int64_t& corner : triangle) {
      std::string word;
      words >> word;
      corner = std::stoll(word) - 1;
    }
    triangles.push_back(triangle);
  }
  return triangles;
}

TEST_F(EndToEndTest, SurfacesAreTheSameInEveryFormatAndBodiesAreClosed) {
  const json labels = Labels();  // a temporary would not outlive the head of the loop
  for (const json& object : labels["objects"]) {
    const std::string ply = object["files"]["ply"];
    const std::string obj = object["files"]["obj"];
    int64_t ply_vertices = 0;
    int64_t obj_vertices = 0;
    const std::vector<Triangle> from_ply = ReadPly(Out() / ply, &ply_vertices);
    int64_t rim = 0;
    CountRim(from_ply, ply, &rim);
    if (!MayBeSheet(ply)) {
      EXPECT_EQ(rim, 0) << ply;
    }
    if (object["name"] == "wall") {
      EXPECT_GT(rim, 0) << ply;
    }
    EXPECT_EQ(ReadObj(Out() / obj, &obj_vertices), from_ply) << obj;
    EXPECT_EQ(obj_vertices, ply_vertices);
    for (const Triangle& triangle : from_ply) {
      for (const int64_t corner : triangle) {
        ASSERT_GE(corner, 0);
        ASSERT_LT(corner, ply_vertices);
      }
    }
  }
}

TEST_F(EndToEndTest, LabelsAreCompleteAndBelievable) {
  const json labels = Labels();
  EXPECT_EQ(labels["version"], 1);
  const json input = json::parse(ReadFile(kTabletop / "labels.json"));
  for (const auto& [id, name] : input["labels"].items()) {
    EXPECT_EQ(labels["labels"][id], name);
  }
  for (const json& object : labels["objects"]) {
    EXPECT_EQ(object["name"], labels["labels"][std::to_string(object["id"].get<int>())]);
    EXPECT_GT(object["cells"].get<int64_t>(), 0);
    EXPECT_GT(object["volume"].get<double>(), 0);
    EXPECT_GT(object["confidence"].get<double>(), 0);
    EXPECT_LE(object["confidence"].get<double>(), 1);
    EXPECT_THAT(object["color"], SizeIs(3));
    EXPECT_GT(object["area"].get<double>(), 0);
    EXPECT_GE(object["pieces"].get<int>(), 1);
    // 64 photos of 320x240 look at the table from all sides.
    EXPECT_LE(object["photos"].size(), 64u);
    for (const auto& [photo, pixels] : object["photos"].items()) {
      EXPECT_TRUE(fs::exists(kTabletop / "images" / photo)) << photo;
      EXPECT_GT(pixels.get<int>(), 0);
      EXPECT_LE(pixels.get<int>(), 320 * 240);
    }
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_LT(object["bounding_box"][0][axis].get<double>(),
                object["centroid"][axis].get<double>());
      EXPECT_LT(object["centroid"][axis].get<double>(),
                object["bounding_box"][1][axis].get<double>());
      EXPECT_LT(object["bounding_box"][0][axis].get<double>(),
                object["bounding_box"][1][axis].get<double>());
    }
  }
}

TEST_F(EndToEndTest, TheLogGoesOverTheWholeRun) {
  std::istringstream lines(ReadFile(Out() / "training_log.csv"));
  std::string head, line, last;
  std::getline(lines, head);
  EXPECT_THAT(head, HasSubstr("seconds,iteration,rays,sites,"));
  while (std::getline(lines, line)) last = line;
  ASSERT_FALSE(last.empty());
  std::vector<std::string> fields;
  std::istringstream words(last);
  for (std::string field; std::getline(words, field, ',');) fields.push_back(field);
  ASSERT_THAT(fields, SizeIs(12));
  // In batches of 512.
  EXPECT_EQ(std::stoll(fields[1]), 586);
  EXPECT_GE(std::stoll(fields[2]), 300000);
  // A foam that has learned nothing, a white one say, lies far below.
  EXPECT_GT(std::stod(fields[9]), 12);
  EXPECT_GT(std::stod(fields[10]), 0.05);
}

struct Picture {
  int width = 0;
  int height = 0;
  int channels = 0;
  OIIO::TypeDesc format;
  std::vector<float> values;  // integers as they are stored
};

Picture ReadPicture(const fs::path& path) {
  Picture picture;
  const std::unique_ptr<OIIO::ImageInput> input = OIIO::ImageInput::open(path.string());
  EXPECT_NE(input, nullptr) << path;
  if (input == nullptr) return picture;
  const OIIO::ImageSpec spec = input->spec();
  picture.width = spec.width;
  picture.height = spec.height;
  picture.channels = spec.nchannels;
  picture.format = spec.format;
  const size_t count = size_t{1} * spec.width * spec.height * spec.nchannels;
  picture.values.resize(count);
  if (spec.format == OIIO::TypeDesc::UINT16) {
    std::vector<uint16_t> ids(count);
    EXPECT_TRUE(input->read_image(0, 0, 0, spec.nchannels, spec.format, ids.data()));
    picture.values.assign(ids.begin(), ids.end());
  } else {
    EXPECT_TRUE(
        input->read_image(0, 0, 0, spec.nchannels, OIIO::TypeDesc::FLOAT, picture.values.data()));
  }
  return picture;
}

TEST_F(EndToEndTest, RendersTheHeldOutViews) {
  const fs::path renders = *folder_ / "renders";
  const Outcome outcome = RunSemfoam({"foam_renderer",
                                      "--foam_path",
                                      FoamPath(),
                                      "--input_path",
                                      (kTabletop / "sparse/0").string(),
                                      "--image_path",
                                      (kTabletop / "images").string(),
                                      "--output_path",
                                      renders.string(),
                                      "--views",
                                      "test",
                                      "--preview",
                                      "1"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  std::set<std::string> expected;
  for (const char* stem : {"0000", "0008", "0016", "0024", "0032", "0040", "0048", "0056"}) {
    expected.insert("rgb/" + std::string(stem) + ".png");
    expected.insert("label/" + std::string(stem) + ".png");
    expected.insert("depth/" + std::string(stem) + ".exr");
    expected.insert("preview/" + std::string(stem) + ".png");
  }
  const std::vector<std::string> files = FilesBelow(renders);
  EXPECT_EQ(std::set<std::string>(files.begin(), files.end()), expected);

  const Picture rgb = ReadPicture(renders / "rgb/0008.png");
  EXPECT_EQ(std::tuple(rgb.width, rgb.height, rgb.channels), std::tuple(320, 240, 3));
  EXPECT_EQ(rgb.format, OIIO::TypeDesc::UINT8);

  const Picture label = ReadPicture(renders / "label/0008.png");
  EXPECT_EQ(std::tuple(label.width, label.height, label.channels), std::tuple(320, 240, 1));
  EXPECT_EQ(label.format, OIIO::TypeDesc::UINT16);
  std::set<int> ids(label.values.begin(), label.values.end());
  EXPECT_GE(ids.size(), 3u);
  const json known = Labels()["labels"];
  for (const int id : ids) EXPECT_TRUE(id == 0 || known.contains(std::to_string(id))) << id;

  const Picture depth = ReadPicture(renders / "depth/0008.exr");
  EXPECT_EQ(std::tuple(depth.width, depth.height, depth.channels), std::tuple(320, 240, 1));
  EXPECT_EQ(depth.format, OIIO::TypeDesc::FLOAT);
  int64_t hits = 0;
  for (const float value : depth.values) {
    ASSERT_TRUE(std::isfinite(value));
    ASSERT_GE(value, 0);
    hits += value > 0;
  }
  // A closed room: nearly every ray ends on something.
  EXPECT_GT(hits, static_cast<int64_t>(depth.values.size()) / 2);

  const Picture preview = ReadPicture(renders / "preview/0008.png");
  EXPECT_EQ(std::tuple(preview.width, preview.height), std::tuple(3 * 320, 240));
}

TEST_F(EndToEndTest, RendersTheViewsOfAListOnly) {
  WriteFile(*folder_ / "list.txt", "0001.jpg\n\n0008.jpg\r\n");
  const fs::path renders = *folder_ / "listed";
  const Outcome outcome = RunSemfoam({"foam_renderer",
                                      "--foam_path",
                                      FoamPath(),
                                      "--input_path",
                                      (kTabletop / "sparse/0").string(),
                                      "--output_path",
                                      renders.string(),
                                      "--views",
                                      (*folder_ / "list.txt").string()});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  std::vector<std::string> rgb = FilesBelow(renders / "rgb");
  std::sort(rgb.begin(), rgb.end());
  EXPECT_THAT(rgb, ElementsAre("0001.png", "0008.png"));
  EXPECT_FALSE(fs::exists(renders / "preview"));

  WriteFile(*folder_ / "list.txt", "nosuch.jpg\n");
  const Outcome wrong = RunSemfoam({"foam_renderer",
                                    "--foam_path",
                                    FoamPath(),
                                    "--input_path",
                                    (kTabletop / "sparse/0").string(),
                                    "--output_path",
                                    (*folder_ / "nothing").string(),
                                    "--views",
                                    (*folder_ / "list.txt").string()});
  EXPECT_EQ(wrong.exit_code, 1);
  ASSERT_THAT(wrong.Errors(), SizeIs(1));
  EXPECT_THAT(wrong.Errors().front(), HasSubstr("nosuch.jpg"));
  EXPECT_THAT(FilesBelow(*folder_ / "nothing"), IsEmpty());
}

TEST_F(EndToEndTest, RendersOneObjectAlone) {
  const json object = Labels()["objects"][0];
  const fs::path turn = *folder_ / "turn";
  const Outcome outcome = RunSemfoam({"foam_renderer",
                                      "--foam_path",
                                      FoamPath(),
                                      "--output_path",
                                      turn.string(),
                                      "--trajectory",
                                      "orbit",
                                      "--object",
                                      object["name"].get<std::string>(),
                                      "--frames",
                                      "2",
                                      "--width",
                                      "64"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_TRUE(fs::exists(turn / "trajectory.gif"));
  const uint32_t id = object["id"].get<uint32_t>();
  for (const char* frame : {"frame_00000", "frame_00001"}) {
    const Image8 color = ReadPhoto(turn / "rgb" / (std::string(frame) + ".png"));
    ASSERT_EQ(color.width, 64);
    const MaskPng labels = ReadMaskPng(turn / "label" / (std::string(frame) + ".png"));
    int seen = 0;
    int others = 0;
    int white = 0;
    for (size_t i = 0; i < labels.values.size(); ++i) {
      seen += labels.values[i] == id;
      // What is hidden in it may show another label here and there.
      others += labels.values[i] != 0 && labels.values[i] != id;
      white += color.data[3 * i] == 255 && color.data[3 * i + 1] == 255;
    }
    EXPECT_GT(seen, 10 * others) << frame;
    EXPECT_GT(white, 0) << frame;
  }
}

TEST_F(EndToEndTest, ScoresTheHeldOutViews) {
  const fs::path scores_path = *folder_ / "scores.json";
  const Outcome outcome = RunSemfoam({"foam_evaluator",
                                      "--foam_path",
                                      FoamPath(),
                                      "--image_path",
                                      (kTabletop / "images").string(),
                                      "--json_path",
                                      scores_path.string(),
                                      "--maps_path",
                                      (*folder_ / "maps").string()});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("PSNR"));
  EXPECT_THAT(outcome.out, HasSubstr("mean"));
  const json scores = json::parse(ReadFile(scores_path));
  EXPECT_EQ(scores["frames"], 8);
  EXPECT_GT(scores["psnr"].get<double>(), 12);
  EXPECT_GT(scores["ssim"].get<double>(), 0.1);
  EXPECT_THAT(scores["objects"], SizeIs(13));
  for (const char* reading : {"prompt", "direct"}) {
    const double iou = scores[reading]["mIoU"];
    EXPECT_GE(iou, 0) << reading;
    EXPECT_LE(iou, 1) << reading;
  }
  EXPECT_GT(scores["prompt"]["mIoU"].get<double>(), 0.05);
  // An object's score is the mean over the views that see it.
  const json& mug = scores["objects"]["mug"];
  EXPECT_THAT(mug["views"], SizeIs(8));
  double sum = 0;
  for (const json& view : mug["views"]) sum += view["direct"]["boundary_iou"].get<double>();
  EXPECT_NEAR(sum / 8, mug["direct"]["boundary_iou"].get<double>(), 1e-12);

  const std::vector<std::string> maps = FilesBelow(*folder_ / "maps");
  EXPECT_THAT(maps, SizeIs(16));
  EXPECT_THAT(maps, IsSupersetOf({"error/0008.png", "confidence/0008.png"}));

  const Outcome as_json = RunSemfoam({"foam_evaluator",
                                      "--foam_path",
                                      FoamPath(),
                                      "--image_path",
                                      (kTabletop / "images").string(),
                                      "--json",
                                      "1"});
  ASSERT_EQ(as_json.exit_code, 0) << as_json.err;
  EXPECT_EQ(json::parse(as_json.out), scores);
}

// Exact masks of other kinds than 0 and 255.
TEST_F(EndToEndTest, NoObjectIsLeftOutOfTheScoresInSilence) {
  const fs::path truth = *folder_ / "truth";
  fs::copy(kTabletop / "segmentation_labels/masks", truth, fs::copy_options::recursive);
  // Whatever is white becomes `value`.
  const auto repaint = [&](const std::string& object, uint8_t value) {
    for (const std::string& file : FilesBelow(truth / object)) {
      Image8 mask = ReadPhoto(truth / object / file);
      for (uint8_t& pixel : mask.data) pixel = pixel > 128 ? value : 0;
      WriteRgbPng(truth / object / file, mask);
    }
  };
  repaint("mug", 1);
  repaint("donut", 0);
  repaint("stool", 100);
  fs::remove_all(truth / "ball");
  fs::create_directories(truth / "ball");
  const auto score = [&](const std::string& truth_path, const char* json_file) {
    return RunSemfoam({"foam_evaluator",
                       "--foam_path",
                       FoamPath(),
                       "--image_path",
                       (kTabletop / "images").string(),
                       "--truth_path",
                       truth_path,
                       "--json_path",
                       (*folder_ / json_file).string()});
  };
  ASSERT_EQ(score((kTabletop / "segmentation_labels/masks").string(), "all.json").exit_code, 0);
  const Outcome outcome = score(truth.string(), "some.json");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const json all = json::parse(ReadFile(*folder_ / "all.json"));
  const json some = json::parse(ReadFile(*folder_ / "some.json"));
  EXPECT_THAT(some["objects"], SizeIs(13 - 3));
  for (const auto& [name, object] : some["objects"].items()) {
    EXPECT_EQ(object, all["objects"][name]) << name;
  }
  EXPECT_TRUE(some["objects"].contains("mug"));
  for (const auto& [object, why] :
       {std::pair("ball", "no file there is named as a held-out photo"),
        std::pair("donut", "its masks of all held-out photos are empty"),
        std::pair("stool", "the largest value in its masks is 100 of 255")}) {
    EXPECT_THAT(outcome.err,
                HasSubstr("WARNING: " + (truth / object).string() +
                          ": this object is not scored, because " + why));
  }
  // A folder of masks is no folder of such folders.
  const Outcome wrong = score((truth / "mug").string(), "none.json");
  ExpectRefused(wrong,
                {(truth / "mug").string(), {"truth_path"}, "no folder of an object's masks"});
}

TEST_F(EndToEndTest, AnalyzerSaysWhatIsInTheFoam) {
  const Outcome outcome = RunSemfoam({"foam_analyzer", "--foam_path", FoamPath()});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  for (const char* text : {"SH degree ",
                           "14 classes",
                           "64 photos, 8 of them held out",
                           "table",
                           "num_rays = 300000"}) {
    EXPECT_THAT(outcome.out, HasSubstr(text));
  }
  // What labels.json says, a row for each object.
  std::istringstream lines(outcome.out);
  std::map<int, std::string> rows;
  bool in_table = false;
  for (std::string line; std::getline(lines, line);) {
    if (line.rfind("Options", 0) == 0) in_table = false;
    if (in_table) {
      EXPECT_LE(line.size(), 130u) << line;
      if (std::isdigit(static_cast<unsigned char>(line[6]))) rows[std::stoi(line)] = line;
    }
    if (line.rfind("Objects", 0) == 0) in_table = true;
  }
  const json labels = Labels();
  ASSERT_GE(rows.size(), labels["objects"].size());
  for (const json& object : labels["objects"]) {
    std::istringstream words(rows.at(object["id"].get<int>()));
    std::string id, name, cells, pieces, cavities, genus, volume, area, confidence, photos, x;
    words >> id >> name >> cells >> pieces >> cavities >> genus >> volume >> area >> confidence >>
        photos >> x;
    EXPECT_EQ(name, object["name"].get<std::string>());
    EXPECT_EQ(std::stoll(cells), object["cells"].get<int64_t>());
    EXPECT_EQ(std::stoi(pieces), object["pieces"].get<int>());
    EXPECT_EQ(std::stoll(cavities), object["cavities"].get<int64_t>());
    EXPECT_EQ(std::stoll(genus), object["genus"].get<int64_t>());
    EXPECT_NEAR(std::stod(volume) / object["volume"].get<double>(), 1, 0.01);
    EXPECT_NEAR(std::stod(area) / object["area"].get<double>(), 1, 0.01);
    EXPECT_NEAR(std::stod(confidence), object["confidence"].get<double>(), 0.001);
    EXPECT_EQ(std::stoul(photos), object["photos"].size());
    double size = 0;
    for (int axis = 0; axis < 3; ++axis) {
      size = std::max(size,
                      object["bounding_box"][1][axis].get<double>() -
                          object["bounding_box"][0][axis].get<double>());
    }
    EXPECT_NEAR(std::stod(x), object["centroid"][0].get<double>(), 0.006 * size);
  }
}

TEST_F(EndToEndTest, ExportersWriteTheSameAsTheWholeRun) {
  const fs::path again = *folder_ / "again";
  // In this order: the stage names the volumes that are there.
  for (const char* command : {"volume_exporter", "mesh_exporter"}) {
    std::vector<std::string> arguments = {
        command, "--foam_path", FoamPath(), "--output_path", again.string()};
    if (std::string(command) == "volume_exporter") {
      arguments.insert(arguments.end(), {"--VolumeExport.max_resolution", "96"});
    } else {
      arguments.insert(arguments.end(), {"--workspace_path", kTabletop.string()});
    }
    const Outcome outcome = RunSemfoam(arguments);
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  }
  std::vector<std::string> files = FilesBelow(again);
  files.push_back("scene.foam");
  files.insert(files.end(),
               {"effects.json",
                "report.html",
                "training_log.csv",
                "training_plot.svg",
                "training_plot.png"});
  EXPECT_THAT(files, testing::UnorderedElementsAreArray(FilesBelow(Out())));
  for (const std::string& file : FilesBelow(again)) {
    EXPECT_TRUE(ReadFile(again / file) == ReadFile(Out() / file)) << file;
  }
}

TEST_F(EndToEndTest, ADamagedFoamIsOneSentence) {
  const std::string bytes = ReadFile(FoamPath());
  std::string flipped = bytes;
  flipped[bytes.size() / 2] = static_cast<char>(flipped[bytes.size() / 2] ^ 1);
  for (const std::string& damaged : {bytes.substr(0, bytes.size() / 2),
                                     bytes + "x",
                                     bytes.substr(0, 10),
                                     std::string(),
                                     flipped}) {
    WriteFile(*folder_ / "damaged.foam", damaged);
    const Outcome outcome =
        RunSemfoam({"foam_analyzer", "--foam_path", (*folder_ / "damaged.foam").string()});
    EXPECT_EQ(outcome.exit_code, 1);
    ASSERT_THAT(outcome.Errors(), SizeIs(1)) << outcome.err;
    EXPECT_THAT(outcome.Errors().front(), HasSubstr("damaged.foam"));
    EXPECT_EQ(outcome.out, "");
  }
}

// Its own outputs are a valid input; and a photo set without masks trains colour only, and says so.
TEST_F(EndToEndTest, TrainsColourOnlyWithoutMasks) {
  const fs::path workspace = *folder_ / "no masks";
  CopyTabletop(workspace);
  fs::remove_all(workspace / "object_mask");
  fs::copy_file(
      Out() / "labels.json", workspace / "labels.json", fs::copy_options::overwrite_existing);
  const fs::path out = *folder_ / "colour only";
  const Outcome outcome = RunSemfoam(TinyTraining({"automatic_segmenter",
                                                   "--workspace_path",
                                                   workspace.string(),
                                                   "--output_path",
                                                   out.string(),
                                                   "--VolumeExport.max_resolution",
                                                   "64"}));
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.Errors(), IsEmpty());
  EXPECT_THAT(outcome.err, HasSubstr("colour only"));
  EXPECT_THAT(outcome.err, HasSubstr("the scene is whole, everything is in " + out.string()));
  EXPECT_THAT(FilesBelow(out),
              testing::UnorderedElementsAre("scene.foam",
                                            "effects.json",
                                            "labels.json",
                                            "report.html",
                                            "training_log.csv",
                                            "scene.vdb",
                                            "scene.om",
                                            "scene.ply",
                                            "scene.obj",
                                            "scene.mtl",
                                            "scene.png",
                                            "scene.glb",
                                            "scene.usda"));
  EXPECT_THAT(json::parse(ReadFile(out / "labels.json"))["objects"], IsEmpty());

  // The last line names the next step, as a shell takes it.
  const std::string hint = "by their shape: ";
  ASSERT_THAT(outcome.err, HasSubstr(hint));
  const std::string command = outcome.err.substr(outcome.err.rfind(hint) + hint.size());
  EXPECT_THAT(command, testing::HasSubstr(" scene_segmenter --foam_path "));
  EXPECT_EQ(command.find('\n'), command.size() - 1);
  EXPECT_THAT(run_->err, testing::Not(HasSubstr(hint)));
  const Outcome segmented = RunProgram("sh", {"-c", command});
  EXPECT_EQ(segmented.exit_code, 0) << segmented.err;
  EXPECT_TRUE(fs::exists(out / "segments/scene.foam"));

  // No photo was held out of this one.
  const std::string foam = (out / "scene.foam").string();
  const fs::path renders = *folder_ / "no renders";
  for (const std::vector<std::string>& arguments :
       {std::vector<std::string>{
            "foam_evaluator", "--foam_path", foam, "--image_path", (kTabletop / "images").string()},
        std::vector<std::string>{"foam_renderer",
                                 "--foam_path",
                                 foam,
                                 "--input_path",
                                 (kTabletop / "sparse/0").string(),
                                 "--output_path",
                                 renders.string(),
                                 "--views",
                                 "test"}}) {
    const Outcome nothing = RunSemfoam(arguments);
    EXPECT_EQ(nothing.exit_code, 1);
    ASSERT_THAT(nothing.Errors(), SizeIs(1)) << nothing.err;
    EXPECT_THAT(nothing.Errors().front(), HasSubstr("test_every 8"));
  }
  EXPECT_THAT(FilesBelow(renders), IsEmpty());
}

TEST_F(EndToEndTest, TakesItsOwnLabelsAndAProjectFile) {
  WriteFile(*folder_ / "project.ini",
            "image_path = " + (kTabletop / "images").string() +
                "\ninput_path = " + (kTabletop / "sparse").string() +
                "\nmask_path = " + (kTabletop / "object_mask").string() +
                "\nlabels_path = " + (Out() / "labels.json").string() +
                "\ntest_every = 8\nquality = low\n"
                "[FoamTraining]\nnum_rays = 999999999\nfinal_sites = 3000\n");
  const fs::path out = *folder_ / "from a project";
  const Outcome outcome = RunSemfoam({"foam_trainer",
                                      "--project_path",
                                      (*folder_ / "project.ini").string(),
                                      "--output_path",
                                      out.string(),
                                      "--FoamTraining.num_rays",
                                      "30000"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(FilesBelow(out),
              testing::UnorderedElementsAre("scene.foam",
                                            "effects.json",
                                            "labels.json",
                                            "training_log.csv",
                                            "training_plot.svg",
                                            "training_plot.png"));
  EXPECT_EQ(json::parse(ReadFile(out / "labels.json"))["labels"], Labels()["labels"]);
}

TEST(EndToEndProgram, HelpAndVersion) {
  for (const std::vector<std::string>& arguments :
       {std::vector<std::string>{}, {"help"}, {"-h"}, {"--help"}}) {
    const Outcome outcome = RunSemfoam(arguments);
    EXPECT_EQ(outcome.exit_code, 0);
    for (const char* command : {"automatic_segmenter",
                                "scene_analyzer",
                                "foam_trainer",
                                "foam_renderer",
                                "foam_evaluator",
                                "foam_analyzer",
                                "foam_converter",
                                "volume_exporter",
                                "mesh_exporter",
                                "object_extractor",
                                "object_remover",
                                "object_inserter",
                                "mesh_evaluator",
                                "point_labeler",
                                "mask_analyzer",
                                "view_interpolator",
                                "accuracy_profiler",
                                "self_test"}) {
      EXPECT_THAT(outcome.out, HasSubstr(command));
      if (!arguments.empty()) continue;
      const Outcome help = RunSemfoam({command, "-h"});
      EXPECT_EQ(help.exit_code, 0) << command;
      EXPECT_THAT(help.out, HasSubstr("--project_path")) << command;
      EXPECT_EQ(help.err, "") << command;
    }
  }
  EXPECT_THAT(RunSemfoam({"version"}).out, HasSubstr("semfoam "));
}

}  // namespace
}  // namespace semfoam
