// SPDX-License-Identifier: GPL-3.0-or-later
//
// Names come with data of others: of photos in a COLMAP model or a scene.foam, of labels in a
// labels.json. Whatever they are, nothing is read or written outside the given folders.
#include "foam/model/model.h"
#include "plugin/colmap/colmap_model.h"

#include <algorithm>
#include <map>
#include <set>
#include <sstream>

#include "tests/tools/program.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

const std::string kLongest(251, 'n');

// No name began a line or steered the terminal: all control characters are our own line ends, and
// every line that claims to be an error is the last one.
void ExpectPlainText(const Outcome& outcome) {
  for (const std::string& text : {outcome.out, outcome.err}) {
    EXPECT_TRUE(std::none_of(text.begin(), text.end(), [](char c) {
      return static_cast<unsigned char>(c) < 0x20 && c != '\n';
    })) << text;
    EXPECT_THAT(text, Not(HasSubstr("\nforged")));
  }
}

class HostileNames : public ::testing::Test {
 protected:
  // The tabletop, every fourth photo of which is called as the next of `names` says; the photos lie
  // where their names lead to.
  void MakeScene(const std::vector<std::string>& names) {
    CopyTabletop(Scene());
    Reconstruction model = ReadReconstruction(Scene() / "sparse" / "0");
    std::sort(model.images.begin(), model.images.end(), [](const Image& a, const Image& b) {
      return a.name < b.name;
    });
    for (size_t i = 0; i < names.size(); ++i) {
      Image& image = model.images.at(4 * i);
      const fs::path photo = Scene() / "images" / names[i];
      fs::create_directories(photo.parent_path());
      fs::rename(Scene() / "images" / image.name, photo);
      image.name = names[i];
    }
    WriteReconstruction(Scene() / "sparse" / "0", model, ModelFormat::kBinary);
  }

  Outcome Train() const {
    return RunSemfoam(TrainerOn(Scene(),
                                folder_ / "box" / "out",
                                {"--quality",
                                 "low",
                                 "--test_every",
                                 "4",
                                 "--FoamTraining.num_rays",
                                 "60000",
                                 "--FoamTraining.rays_per_iteration",
                                 "512",
                                 "--FoamTraining.final_sites",
                                 "2000",
                                 "--FoamTraining.max_image_size",
                                 "80",
                                 "--overwrite",
                                 "1"}));
  }

  fs::path Scene() const { return folder_ / "box" / "scene"; }
  fs::path Out() const { return folder_ / "box" / "out"; }
  std::string Foam() const { return (Out() / "scene.foam").string(); }

  // Beside the folder with the scene and the results there was nothing, and there is nothing.
  void TearDown() override {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder_.path())) {
      names.push_back(entry.path().filename());
    }
    EXPECT_THAT(names, ::testing::ElementsAre("box"));
    names.clear();
    for (const auto& entry : fs::directory_iterator(folder_ / "box")) {
      names.push_back(entry.path().filename());
    }
    EXPECT_THAT(names, ::testing::IsSubsetOf({"scene", "out"}));
  }

  TempFolder folder_;
};

TEST_F(HostileNames, OfPhotosThatTheFileSystemTakesAreTaken) {
  const std::vector<std::string> names = {"line\nforged: x.jpg",
                                          "tab\tbell\a.jpg",
                                          "\x1b[2Jterminal.jpg",
                                          "\xC3\xBC/\xE7\x8C\xAB.jpg",
                                          "back\\..\\..\\slash.jpg",
                                          "trailing.jpg ",
                                          " leading.jpg",
                                          "same.jpg",
                                          "SAME.JPG",
                                          "a/./deep//same.jpg",
                                          "-rf.jpg",
                                          "$(touch forged) `touch forged`;.jpg",
                                          "'\"%s%n&<>.jpg",
                                          "..jpg",
                                          "...",
                                          kLongest + ".jpg"};
  MakeScene(names);
  const Outcome trained = Train();
  ASSERT_EQ(trained.exit_code, 0) << trained.err;
  ExpectPlainText(trained);
  const std::string images = (Scene() / "images").string();
  const std::string sparse = (Scene() / "sparse" / "0").string();
  const auto out = [&](const char* name) { return (Out() / name).string(); };
  for (const std::vector<std::string>& arguments : std::vector<std::vector<std::string>>{
           {"foam_renderer",
            "--foam_path",
            Foam(),
            "--input_path",
            sparse,
            "--output_path",
            out("r"),
            "--preview",
            "1",
            "--image_path",
            images},
           {"foam_evaluator",
            "--foam_path",
            Foam(),
            "--image_path",
            images,
            "--maps_path",
            out("maps"),
            "--json_path",
            out("scores.json")},
           {"mask_analyzer", "--workspace_path", Scene().string(), "--output_path", out("m")},
           {"point_labeler", "--workspace_path", Scene().string(), "--output_path", out("p")},
           {"view_interpolator",
            "--foam_path",
            Foam(),
            "--image_path",
            images,
            "--output_path",
            out("film"),
            "--between",
            "0"},
           {"object_extractor",
            "--foam_path",
            Foam(),
            "--pick",
            names[0] + ",40,30",
            "--output_path",
            out("picked")}}) {
    SCOPED_TRACE(arguments[0]);
    const Outcome outcome = RunSemfoam(arguments);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    ExpectPlainText(outcome);
  }
  // The names of the results are the photos', below the folder.
  std::set<std::string> all;
  std::set<std::string> held_out;
  for (const PhotoRecord& photo : ReadModel(Foam()).photos) {
    const std::string file =
        fs::path(photo.name).lexically_normal().replace_extension(".png").generic_string();
    all.insert(file);
    if (photo.held_out) held_out.insert(file);
  }
  EXPECT_EQ(all.size(), 64u);
  for (const auto& [folder, expected] : {std::pair("r/rgb", all),
                                         std::pair("r/label", all),
                                         std::pair("r/preview", all),
                                         std::pair("maps/error", held_out)}) {
    const std::vector<std::string> files = FilesBelow(Out() / folder);
    EXPECT_EQ(std::set<std::string>(files.begin(), files.end()), expected) << folder;
  }
}

struct RefusedName {
  std::string name;
  std::string sentence;
};

TEST_F(HostileNames, OfPhotosThatLeaveTheFolderAreRefused) {
  CopyTabletop(Scene());
  const fs::path images = Scene() / "sparse" / "0" / "images.bin";
  const std::string good = ReadFile(images);
  const std::string outside = (folder_ / "x.jpg").string();
  for (const RefusedName& refused :
       std::vector<RefusedName>{{"../x.jpg", "has the name \"../x.jpg\""},
                                {"../../x.jpg", "path within the image folder would be right"},
                                {"a/../../x.jpg", "path within the image folder would be right"},
                                {"a/../x.jpg", "path within the image folder would be right"},
                                {outside, "has the name \"" + outside + "\""},
                                {"/etc/passwd", "has the name \"/etc/passwd\""},
                                {"", "has the name \"\""},
                                {".", "has the name \".\""},
                                {"..", "has the name \"..\""},
                                {"a/.", "has the name \"a/.\""},
                                {"a/", "has the name \"a/\""},
                                {"..\n/../forged", "has the name \"..\\x0a/../forged\""},
                                {std::string(4096, 'n') + ".jpg", "File name too long"},
                                {std::string(300, 'n') + ".jpg", "File name too long"},
                                {"not\xFFutf8.jpg", "its name is not UTF-8"}}) {
    SCOPED_TRACE(refused.name.substr(0, 40));
    // The first image's name, in place of the old one; names end with a zero.
    std::string bytes = good;
    const size_t at = bytes.find("0000.jpg");
    ASSERT_NE(at, bytes.npos);
    bytes.replace(at, 8, refused.name);
    WriteFile(images, bytes);
    if (refused.sentence.find("UTF-8") != std::string::npos) {
      fs::copy_file(kTabletop / "images" / "0000.jpg", Scene() / "images" / refused.name);
    }
    const Outcome outcome = Train();
    EXPECT_EQ(outcome.exit_code, 1) << outcome.err;
    ASSERT_EQ(outcome.Errors().size(), 1u) << outcome.err;
    EXPECT_THAT(outcome.Errors()[0], HasSubstr(refused.sentence));
    ExpectPlainText(outcome);
    EXPECT_FALSE(fs::exists(Foam()));
  }
}

TEST_F(HostileNames, ThatBecomeTheSameResultAreRefused) {
  for (const std::string other : {"0000.png", "./0000.JPG"}) {
    SCOPED_TRACE(other);
    fs::remove_all(Scene());
    MakeScene({"0000.jpg", other});
    // By its name the mask of both, which would be refused first.
    fs::remove(Scene() / "object_mask" / "0000.png");
    const Outcome trained = Train();
    ASSERT_EQ(trained.exit_code, 0) << trained.err;
    const Outcome rendered = RunSemfoam({"foam_renderer",
                                         "--foam_path",
                                         Foam(),
                                         "--input_path",
                                         (Scene() / "sparse" / "0").string(),
                                         "--output_path",
                                         (Out() / "r").string()});
    EXPECT_EQ(rendered.exit_code, 1);
    EXPECT_THAT(rendered.Errors(), Contains(HasSubstr("two images 0000.*")));
    Model model = ReadModel(Foam());
    for (PhotoRecord& photo : model.photos) photo.held_out = true;
    WriteModel(Foam(), model);
    const Outcome scored = RunSemfoam({"foam_evaluator",
                                       "--foam_path",
                                       Foam(),
                                       "--image_path",
                                       (Scene() / "images").string(),
                                       "--maps_path",
                                       (Out() / "maps").string()});
    EXPECT_EQ(scored.exit_code, 1) << scored.err;
    EXPECT_THAT(scored.Errors(), Contains(HasSubstr("two photos 0000.*")));
  }
}

// Of the folders of exact masks, after which objects are called.
TEST_F(HostileNames, OfObjectsThatJsonDoesNotTakeAreToldOfBeforeTheScores) {
  CopyTabletop(Scene());
  ASSERT_EQ(Train().exit_code, 0);
  const fs::path truth = Scene() / "truth";
  fs::create_directories(truth);
  fs::copy(kTabletop / "segmentation_labels/masks/mug", truth / "m\xFCg\nforged");
  std::vector<std::string> score = {"foam_evaluator",
                                    "--foam_path",
                                    Foam(),
                                    "--image_path",
                                    (Scene() / "images").string(),
                                    "--truth_path",
                                    truth.string()};
  const Outcome table = RunSemfoam(score);
  EXPECT_EQ(table.exit_code, 0) << table.err;
  EXPECT_THAT(table.out, HasSubstr("m\xEF\xBF\xBDg forged "));
  ExpectPlainText(table);
  score.insert(score.end(), {"--json_path", (Out() / "scores.json").string()});
  const Outcome refused = RunSemfoam(score);
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_EQ(refused.out, "");
  ASSERT_EQ(refused.Errors().size(), 1u) << refused.err;
  EXPECT_THAT(refused.Errors()[0], HasSubstr("its name is not UTF-8"));
  ExpectPlainText(refused);
  EXPECT_FALSE(fs::exists(Out() / "scores.json"));
}

// A scene.foam that somebody else made.
TEST_F(HostileNames, OfPhotosInAFoamAreRefused) {
  CopyTabletop(Scene());
  ASSERT_EQ(Train().exit_code, 0);
  const Model good = ReadModel(Foam());
  for (const std::string name : {"../../x.jpg", "/etc/passwd", "", "a/.."}) {
    SCOPED_TRACE(name);
    Model model = good;
    model.photos[0].name = name;
    WriteModel(Foam(), model);
    const Outcome outcome = RunSemfoam({"foam_evaluator",
                                        "--foam_path",
                                        Foam(),
                                        "--image_path",
                                        (Scene() / "images").string(),
                                        "--maps_path",
                                        (Out() / "maps").string()});
    EXPECT_EQ(outcome.exit_code, 1);
    EXPECT_THAT(outcome.Errors(),
                ::testing::ElementsAre(AllOf(HasSubstr("scene.foam: it is damaged"),
                                             HasSubstr("leaves the image folder"))));
  }
}

// Links that lie in an output folder are replaced, never written through.
TEST_F(HostileNames, LinksAmongTheResultsAreReplaced) {
  CopyTabletop(Scene());
  ASSERT_EQ(Train().exit_code, 0);
  WriteFile(Scene() / "precious", "untouched");
  fs::create_directories(Out() / "r" / "rgb");
  fs::create_symlink(Scene() / "precious", Out() / "r" / "rgb" / "0000.png");
  const Outcome outcome = RunSemfoam({"foam_renderer",
                                      "--foam_path",
                                      Foam(),
                                      "--input_path",
                                      (Scene() / "sparse" / "0").string(),
                                      "--output_path",
                                      (Out() / "r").string(),
                                      "--views",
                                      "test"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(ReadFile(Scene() / "precious"), "untouched");
  EXPECT_TRUE(fs::is_regular_file(fs::symlink_status(Out() / "r" / "rgb" / "0000.png")));
}

TEST_F(HostileNames, OfLabelsBecomeSafeFileNames) {
  CopyTabletop(Scene());
  const std::map<std::string, std::string> names = {{"1", "../../evil"},
                                                    {"2", "/etc/passwd"},
                                                    {"4", ""},
                                                    {"5", "line\nv 1 2 3\nforged"},
                                                    {"7", std::string(10000, 'n')},
                                                    {"8", "\x1b[2J\"'\\{}<>\xE7\x8C\xAB"},
                                                    {"6", "same"},
                                                    {"9", "same"}};
  WriteFile(Scene() / "labels.json", nlohmann::json({{"labels", names}}).dump());
  const Outcome trained = Train();
  ASSERT_EQ(trained.exit_code, 0) << trained.err;
  ExpectPlainText(trained);
  for (const std::vector<std::string>& arguments : std::vector<std::vector<std::string>>{
           {"volume_exporter",
            "--foam_path",
            Foam(),
            "--output_path",
            Out().string(),
            "--max_resolution",
            "12"},
           {"mesh_exporter", "--foam_path", Foam(), "--output_path", Out().string()},
           {"foam_analyzer", "--foam_path", Foam()},
           {"foam_converter",
            "--input_path",
            Foam(),
            "--output_path",
            (Out() / "points.ply").string(),
            "--output_type",
            "points"}}) {
    SCOPED_TRACE(arguments[0]);
    const Outcome outcome = RunSemfoam(arguments);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    ExpectPlainText(outcome);
  }
  const std::vector<std::string> files = FilesBelow(Out());
  for (const std::string& file : files) {
    EXPECT_EQ(file.find_first_not_of("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz"
                                     "0123456789_-./"),
              std::string::npos)
        << file;
    EXPECT_LE(fs::path(file).filename().string().size(), 130u);
  }
  const auto labels = nlohmann::json::parse(ReadFile(Out() / "labels.json"));
  int num_listed = 0;
  for (const auto& object : labels.at("objects")) {
    for (const auto& [kind, file] : object.at("files").items()) {
      EXPECT_THAT(files, Contains(file.get<std::string>()));
      ++num_listed;
    }
    EXPECT_EQ(labels.at("labels").at(std::to_string(object.at("id").get<int>())),
              object.at("name"));
  }
  EXPECT_GE(num_listed, 20);
  // A line break in a name would begin a vertex.
  const std::set<std::string> words = {"v",
                                       "vn",
                                       "vt",
                                       "f",
                                       "o",
                                       "g",
                                       "usemtl",
                                       "mtllib",
                                       "newmtl",
                                       "Kd",
                                       "map_Kd",
                                       "vt",
                                       "Ka",
                                       "Ks",
                                       "d",
                                       "illum",
                                       "Ns",
                                       "#",
                                       "s"};
  for (const std::string& file : files) {
    if (!file.ends_with(".obj") && !file.ends_with(".mtl")) continue;
    std::istringstream lines(ReadFile(Out() / file));
    for (std::string line; std::getline(lines, line);) {
      if (line.empty()) continue;
      EXPECT_TRUE(words.contains(line.substr(0, line.find(' ')))) << file << ": " << line;
      EXPECT_NE(line, "v 1 2 3");
    }
  }
}

}  // namespace
}  // namespace semfoam
