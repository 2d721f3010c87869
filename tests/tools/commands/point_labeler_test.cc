// SPDX-License-Identifier: GPL-3.0-or-later
//
// point_labeler on the tabletop scene: what it leaves is complete, right, and read by others.
#include "export/scene/names.h"
#include "plugin/colmap/colmap_model.h"
#include "plugin/mask/mask_png.h"
#include "tools/images/image_files.h"

#include <cstring>
#include <map>
#include <set>

#include "tests/tools/mask_corrupter.h"
#include "tests/tools/program.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::HasSubstr;
using testing::SizeIs;
using testing::UnorderedElementsAre;

Outcome LabelTabletop(const fs::path& output, const std::vector<std::string>& more = {}) {
  std::vector<std::string> arguments = {
      "point_labeler", "--workspace_path", kTabletop.string(), "--output_path", output.string()};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return RunSemfoam(arguments);
}

struct PlyPoint {
  double position[3];
  uint8_t color[3];
  int32_t label;
  float confidence;
};

// By the header, as any other program would.
std::vector<PlyPoint> ReadPointsPly(const fs::path& path) {
  const std::string bytes = ReadFile(path);
  const std::string end = "end_header\n";
  const size_t body = bytes.find(end) + end.size();
  const std::string expected =
      "property double x\nproperty double y\nproperty double z\nproperty uchar red\nproperty uchar "
      "green\nproperty uchar blue\nproperty int label\nproperty float confidence\nend_header\n";
  EXPECT_THAT(bytes.substr(0, body), HasSubstr("ply\nformat binary_little_endian 1.0\n"));
  EXPECT_EQ(bytes.substr(body - expected.size(), expected.size()), expected);
  const std::string element = "element vertex ";
  const size_t count = std::stoull(bytes.substr(bytes.find(element) + element.size()));
  constexpr size_t kBytes = 24 + 3 + 4 + 4;
  EXPECT_EQ(bytes.size(), body + count * kBytes);
  std::vector<PlyPoint> points(count);
  for (size_t i = 0; i < count; ++i) {
    const char* at = bytes.data() + body + i * kBytes;
    std::memcpy(points[i].position, at, 24);
    std::memcpy(points[i].color, at + 24, 3);
    std::memcpy(&points[i].label, at + 27, 4);
    std::memcpy(&points[i].confidence, at + 31, 4);
  }
  return points;
}

TEST(PointLabeler, LeavesThreeFilesThatSayTheSame) {
  const TempFolder folder;
  const fs::path out = folder / "out";
  const Outcome outcome = LabelTabletop(out);
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(FilesBelow(out),
              UnorderedElementsAre(
                  "cameras.bin", "images.bin", "points3D.bin", "points.ply", "points_labels.json"));
  EXPECT_THAT(outcome.err, HasSubstr("64 of 64 photos have a mask, 0 masks unused"));
  EXPECT_THAT(outcome.err, HasSubstr("Masks held against the tracks"));

  // Cameras, images and tracks are untouched, to the byte; of the points, colours alone differ.
  const fs::path sparse = kTabletop / "sparse/0";
  EXPECT_EQ(ReadFile(out / "cameras.bin"), ReadFile(sparse / "cameras.bin"));
  EXPECT_EQ(ReadFile(out / "images.bin"), ReadFile(sparse / "images.bin"));
  const Reconstruction before = ReadReconstruction(sparse);
  Reconstruction after = ReadReconstruction(out);
  const std::vector<PlyPoint> points = ReadPointsPly(out / "points.ply");
  ASSERT_EQ(points.size(), before.points.size());
  ASSERT_EQ(after.points.size(), before.points.size());
  std::map<int32_t, int64_t> count;
  std::map<int32_t, double> confidence;
  for (size_t i = 0; i < points.size(); ++i) {
    for (int k = 0; k < 3; ++k) {
      ASSERT_EQ(points[i].position[k], before.points[i].position[k]);
      ASSERT_EQ(points[i].color[k], before.points[i].color[k]);
      ASSERT_EQ(after.points[i].color[k],
                points[i].label == 0 ? 128 : LabelColor(LabelId{points[i].label})[k]);
    }
    ASSERT_EQ(points[i].label == 0, points[i].confidence == 0);
    ASSERT_LE(points[i].confidence, 1);
    ++count[points[i].label];
    confidence[points[i].label] += points[i].confidence;
    after.points[i].color = before.points[i].color;
  }
  WriteReconstruction(folder / "again", after, ModelFormat::kBinary);
  EXPECT_EQ(ReadFile(folder / "again" / "points3D.bin"), ReadFile(sparse / "points3D.bin"));

  const json labels = json::parse(ReadFile(out / "points_labels.json"));
  EXPECT_EQ(labels["version"], 1);
  EXPECT_EQ(labels["labels"]["6"], "mug");
  EXPECT_EQ(labels["points"], points.size());
  EXPECT_EQ(labels["labelled"], points.size() - count[0]);
  EXPECT_GT(count[6], 300);
  int64_t sum = 0;
  for (const json& object : labels["objects"]) {
    const int32_t id = object["id"];
    EXPECT_EQ(object["points"], count[id]);
    EXPECT_NEAR(object["confidence"], confidence[id] / static_cast<double>(count[id]), 1e-6);
    EXPECT_EQ(object["color"], LabelColor(LabelId{id}));
    EXPECT_EQ(object["name"], labels["labels"][std::to_string(id)]);
    sum += count[id];
    for (const PlyPoint& point : points) {
      for (int k = 0; k < 3 && point.label == id; ++k) {
        ASSERT_GE(point.position[k], object["bounding_box"][0][k]);
        ASSERT_LE(point.position[k], object["bounding_box"][1][k]);
      }
    }
  }
  EXPECT_EQ(labels["labelled"], sum);
  EXPECT_THAT(labels["objects"], SizeIs(13));
}

// The photos of an object are those with a feature of one of its points.
TEST(PointLabeler, NamesThePhotosOfAnObject) {
  const TempFolder folder;
  ASSERT_EQ(LabelTabletop(folder / "out").exit_code, 0);
  const std::vector<PlyPoint> points = ReadPointsPly(folder / "out" / "points.ply");
  const Reconstruction model = ReadReconstruction(kTabletop / "sparse/0");
  std::map<uint32_t, std::string> name_of;
  for (const Image& image : model.images) name_of[image.id] = image.name;
  std::set<std::string> expected;
  for (size_t i = 0; i < points.size(); ++i) {
    if (points[i].label != 13) continue;
    for (const TrackElement& element : model.points[i].track) {
      expected.insert(name_of.at(element.image_id));
    }
  }
  ASSERT_GT(expected.size(), 5u);
  EXPECT_LT(expected.size(), 64u);
  const json labels = json::parse(ReadFile(folder / "out" / "points_labels.json"));
  for (const json& object : labels["objects"]) {
    if (object["id"] != 13) continue;
    EXPECT_EQ(object["photos"], json(expected));
  }
}

// Masks in which a fifth of the objects' views are damaged lead to nearly the same labels; without
// the tracks' word they do not.
TEST(PointLabeler, TheTracksRepairDamagedMasks) {
  const TempFolder folder;
  const fs::path masks = folder / "masks";
  DamageTabletopMasks(masks, "0.2");
  ASSERT_EQ(LabelTabletop(folder / "right").exit_code, 0);
  const std::vector<std::string> damaged = {"--mask_path",
                                            masks.string(),
                                            "--labels_path",
                                            (kTabletop / "labels.json").string(),
                                            "--FoamTraining.label_zero",
                                            "ignore"};
  ASSERT_EQ(LabelTabletop(folder / "repaired", damaged).exit_code, 0);
  std::vector<std::string> believed = damaged;
  believed.insert(believed.end(), {"--Masks.consistency", "off"});
  ASSERT_EQ(LabelTabletop(folder / "believed", believed).exit_code, 0);
  const auto right = ReadPointsPly(folder / "right" / "points.ply");
  const auto differing = [&](const char* name) {
    const auto points = ReadPointsPly(folder / name / "points.ply");
    double count = 0;
    for (size_t i = 0; i < points.size(); ++i) count += points[i].label != right[i].label;
    return count / static_cast<double>(points.size());
  };
  EXPECT_LT(differing("repaired"), 0.03);
  EXPECT_GT(differing("believed"), 0.06);
}

TEST(PointLabeler, IdZeroIsAClassWhereTheUserSaysSo) {
  const TempFolder folder;
  ASSERT_EQ(LabelTabletop(folder / "ignore",
                          {"--FoamTraining.label_zero", "ignore", "--Masks.consistency", "off"})
                .exit_code,
            0);
  ASSERT_EQ(LabelTabletop(folder / "class", {"--label_zero", "class", "--Masks.consistency", "off"})
                .exit_code,
            0);
  int background = 0;
  const auto with = ReadPointsPly(folder / "class" / "points.ply");
  const auto without = ReadPointsPly(folder / "ignore" / "points.ply");
  for (size_t i = 0; i < with.size(); ++i) {
    background += with[i].label == 0 && with[i].confidence > 0;
    EXPECT_TRUE(without[i].label != 0 || without[i].confidence == 0);
  }
  EXPECT_GT(background, 50);
}

TEST(PointLabeler, SameBytesOnAnyNumberOfThreads) {
  const TempFolder folder;
  for (const std::string threads : {"1", "2", "5"}) {
    ASSERT_EQ(LabelTabletop(folder / threads, {"--num_threads", threads}).exit_code, 0);
    for (const char* file : {"points3D.bin", "points.ply", "points_labels.json"}) {
      EXPECT_TRUE(ReadFile(folder / threads / file) == ReadFile(folder / "1" / file)) << file;
    }
  }
}

// Masks are found beside the model's folder, and a text model gives a text model.
TEST(PointLabeler, TakesAModelAloneAndKeepsItsFormat) {
  const TempFolder folder;
  CopyTabletop(folder / "w");
  const fs::path sparse = folder / "w" / "sparse/0";
  const Reconstruction model = ReadReconstruction(sparse);
  fs::remove_all(sparse);
  WriteReconstruction(sparse, model, ModelFormat::kText);
  const Outcome outcome = RunSemfoam({"point_labeler",
                                      "--input_path",
                                      sparse.string(),
                                      "--output_path",
                                      (folder / "out").string()});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(FilesBelow(folder / "out"),
              UnorderedElementsAre(
                  "cameras.txt", "images.txt", "points3D.txt", "points.ply", "points_labels.json"));
  EXPECT_EQ(ReadFile(folder / "out" / "images.txt"), ReadFile(sparse / "images.txt"));
  ASSERT_EQ(LabelTabletop(folder / "from binary").exit_code, 0);
  EXPECT_EQ(ReadFile(folder / "out" / "points.ply"),
            ReadFile(folder / "from binary" / "points.ply"));
  EXPECT_EQ(ReadFile(folder / "out" / "points_labels.json"),
            ReadFile(folder / "from binary" / "points_labels.json"));
}

TEST(PointLabeler, ColmapReadsTheModel) {
  const TempFolder folder;
  ASSERT_EQ(LabelTabletop(folder / "out").exit_code, 0);
  ASSERT_EQ(LabelTabletop(folder / "out").exit_code, 0);  // and over its own output
  const auto colmap = [](std::vector<std::string> arguments) {
    std::vector<std::string> all = {"QT_QPA_PLATFORM=offscreen", "colmap"};
    all.insert(all.end(), arguments.begin(), arguments.end());
    return RunProgram("/usr/bin/env", all);
  };
  const Outcome analysis = colmap({"model_analyzer", "--path", (folder / "out").string()});
  EXPECT_EQ(analysis.exit_code, 0) << analysis.err;
  EXPECT_THAT(analysis.out + analysis.err, HasSubstr("Points: 5621"));
  fs::create_directories(folder / "ply");
  const Outcome ply = colmap({"model_converter",
                              "--input_path",
                              (folder / "out").string(),
                              "--output_path",
                              (folder / "ply") / "colmap.ply",
                              "--output_type",
                              "PLY"});
  EXPECT_EQ(ply.exit_code, 0) << ply.err;
  fs::create_directories(folder / "txt");
  const Outcome text = colmap({"model_converter",
                               "--input_path",
                               (folder / "out").string(),
                               "--output_path",
                               (folder / "txt").string(),
                               "--output_type",
                               "TXT"});
  ASSERT_EQ(text.exit_code, 0) << text.err;
  std::map<uint64_t, Eigen::Matrix<uint8_t, 3, 1>> colors;
  for (const Point3D& point : ReadReconstruction(folder / "out").points) {
    colors[point.id] = point.color;
  }
  for (const Point3D& point : ReadReconstruction(folder / "txt").points) {
    ASSERT_EQ(point.color, colors.at(point.id));
  }
}

TEST(PointLabeler, SaysWhatIsWrongInOneSentence) {
  const TempFolder folder;
  CopyTabletop(folder / "w");
  const std::string workspace = (folder / "w").string();
  const std::string out = (folder / "out").string();
  fs::create_directories(folder / "empty");
  fs::create_directories(folder / "text");
  fs::copy(kTabletop / "sparse/0", folder / "other");
  WriteFile(folder / "text" / "points3D.txt", "");
  fs::create_directories(folder / "no masks" / "sparse");
  fs::copy(kTabletop / "sparse/0", folder / "no masks" / "sparse" / "0");
  const std::string empty = (folder / "empty").string();
  const std::string without_masks = (folder / "no masks").string();
  ExpectEachRefused(
      {"point_labeler"},
      {
          {{"--output_path", out}, {"", {"workspace_path", "input_path"}, "neither"}},
          {{"--workspace_path", workspace}, {"", {"output_path"}, "required but missing"}},
          {{"--workspace_path", workspace + "/nowhere", "--output_path", out},
           {workspace + "/nowhere", {"workspace_path"}, "no such folder"}},
          {{"--workspace_path", empty, "--output_path", out},
           {empty + "/sparse", {"COLMAP model"}, "no such folder"}},
          {{"--workspace_path", without_masks, "--output_path", out},
           {without_masks, {"object_mask/", "Annotations/", "mask_path"}, "neither"}},
          {{"--workspace_path", workspace, "--mask_path", empty, "--output_path", out},
           {empty, {"PNG"}, "is empty"}},
          {{"--workspace_path", workspace, "--mask_path", workspace + "/no", "--output_path", out},
           {workspace + "/no", {"mask"}, "no such folder"}},
          {{"--workspace_path", workspace, "--labels_path", workspace + "/l", "--output_path", out},
           {workspace + "/l", {}, "no such file"}},
          {{"--workspace_path", workspace, "--output_path", workspace + "/sparse/0"},
           {workspace + "/sparse/0", {"colours"}, "folder of the model itself"}},
          {{"--workspace_path", workspace, "--output_path", (folder / "text").string()},
           {"text/points3D.txt", {}, "is of another model"}},
          {{"--workspace_path", workspace, "--output_path", (folder / "other").string()},
           {"other/cameras.bin", {"lost"}, "is of another model"}},
          {{"--workspace_path", workspace, "--output_path", out, "--Masks.consistency", "yes"},
           {"", {"Masks.consistency", "'yes'"}, "is invalid"}},
          {{"--workspace_path", workspace, "--output_path", out, "--FoamTraining.label_zero", "1"},
           {"", {"FoamTraining.label_zero", "'1'"}, "is invalid"}},
      },
      out);
  EXPECT_THAT(FilesBelow(folder / "text"), testing::ElementsAre("points3D.txt"));
  WriteFile(folder / "w" / "object_mask/0003.png", "no image");
  const Outcome damaged =
      RunSemfoam({"point_labeler", "--workspace_path", workspace, "--output_path", out});
  EXPECT_EQ(damaged.exit_code, 1);
  EXPECT_THAT(damaged.err, HasSubstr("0003.png: is no PNG file"));
  EXPECT_THAT(FilesBelow(out), testing::IsEmpty());
}

TEST(PointLabeler, TakesItsOptionsFromAProjectFile) {
  const TempFolder folder;
  WriteFile(folder / "p.ini",
            "workspace_path=" + kTabletop.string() + "\noutput_path=" + (folder / "out").string() +
                "\n[Masks]\nconsistency=off\n");
  const Outcome outcome =
      RunSemfoam({"point_labeler", "--project_path", (folder / "p.ini").string()});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(FilesBelow(folder / "out"), SizeIs(5));
  EXPECT_THAT(outcome.err, testing::Not(HasSubstr("Masks held")));
  EXPECT_THAT(RunSemfoam({"point_labeler", "-h"}).out, HasSubstr("without training"));
}

// DEVA's masks of colours: ids of three bytes, which tables number anew. Such a table, edited,
// names the same things again.
TEST(PointLabeler, ReadsTheNamesOfItsOwnTableBack) {
  const TempFolder folder;
  const fs::path workspace = folder / "workspace";
  CopyTabletop(workspace);
  // By the masks' ids the order is another one, and one of them is the new id of another thing.
  const auto source_id = [](uint32_t id) { return id <= 1 ? 5 * id : 0x20000 + 1000 * (20 - id); };
  for (const auto& entry : fs::directory_iterator(kTabletop / "object_mask")) {
    const MaskPng mask = ReadMaskPng(entry.path());
    Image8 rgb{mask.width, mask.height, {}};
    for (const uint32_t id : mask.values) {
      for (int shift : {0, 8, 16}) rgb.data.push_back(source_id(id) >> shift & 0xff);
    }
    WriteRgbPng(workspace / "object_mask" / entry.path().filename(), rgb);
  }
  const json given = json::parse(ReadFile(kTabletop / "labels.json"));
  json names;
  for (const auto& [id, name] : given["labels"].items()) {
    names["labels"][std::to_string(source_id(std::stoul(id)))] = name;
  }
  WriteFile(workspace / "labels.json", names.dump());
  const auto label = [&](const std::string& output, const std::vector<std::string>& more) {
    std::vector<std::string> arguments = {"point_labeler",
                                          "--workspace_path",
                                          workspace.string(),
                                          "--output_path",
                                          (folder / output).string()};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const Outcome outcome = RunSemfoam(arguments);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_THAT(outcome.err, testing::Not(HasSubstr("WARNING")));
    return json::parse(ReadFile(folder / output / "points_labels.json"));
  };

  json table = label("first", {});
  EXPECT_EQ(table["labels"]["1"], "floor");
  EXPECT_EQ(table["source_ids"]["1"], 5);
  EXPECT_EQ(table["labels"]["2"], "stool");
  EXPECT_EQ(table["labels"]["5"], "knot");
  for (auto& [id, name] : table["labels"].items()) name = name.get<std::string>() + ", edited";
  WriteFile(folder / "edited.json", table.dump());
  const json again = label("again", {"--labels_path", (folder / "edited.json").string()});
  EXPECT_EQ(again["labels"], table["labels"]);
  EXPECT_EQ(again["source_ids"], table["source_ids"]);
}

TEST(PointLabeler, TellsOfNamesThatItCannotUse) {
  const TempFolder folder;
  WriteFile(folder / "names.json",
            R"({"labels": {"6": "cup", "101": "a", "102": "b", "103": "c", "104": "d"}})");
  const std::string sentence = (folder / "names.json").string() +
                               ": 4 of its 5 names are of ids that no mask has: 101 (a), 102 (b), "
                               "103 (c), ...";
  const std::vector<std::string> given = {"--labels_path", (folder / "names.json").string()};
  EXPECT_THAT(LabelTabletop(folder / "out", given).err, HasSubstr(sentence));
  EXPECT_EQ(json::parse(ReadFile(folder / "out/points_labels.json"))["labels"]["6"], "cup");
  // The names that lie beside masks whose ids mean nothing.
  EXPECT_THAT(
      LabelTabletop(folder / "independent", {"--Masks.consistency", "independent"}).err,
      HasSubstr("tabletop/labels.json: its names are not used, as the masks' ids mean nothing"));
}

}  // namespace
}  // namespace semfoam
