// SPDX-License-Identifier: GPL-3.0-or-later
//
// object_extractor, object_remover and object_inserter as a user meets them: on a small foam made
// by hand, which photos look at, and on a trained one.
#include "export/scene/exportable_scene.h"
#include "foam/edit/class_table.h"
#include "plugin/mask/mask_png.h"
#include "tools/options/object_choice.h"

#include <cmath>
#include <map>

#include "tests/tools/commands/ring_scene.h"
#include "tests/tools/program.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

// The middle of an object's box of sites, and its size, in the COLMAP frame.
Eigen::AlignedBox3d BoxOf(const fs::path& foam, int32_t id) {
  const Model model = ReadModel(foam);
  const ExportableScene scene = MakeExportableScene(model);
  Eigen::AlignedBox3d box;
  for (const ObjectInfo& object : scene.objects) {
    if (Value(object.id) != id) continue;
    for (const uint32_t cell : object.cells) {
      box.extend(model.world_from_normalized.Apply(model.foam.positions[cell].cast<double>()));
    }
  }
  EXPECT_FALSE(box.isEmpty()) << id;
  return box;
}

std::map<int32_t, size_t> CellsOfObjects(const fs::path& foam) {
  std::map<int32_t, size_t> cells;
  for (const ObjectInfo& object : MakeExportableScene(ReadModel(foam)).objects) {
    cells[Value(object.id)] = object.cells.size();
  }
  return cells;
}

class ObjectCommandsTest : public testing::Test {
 protected:
  void SetUp() override { WriteModel(Foam(), RingScene()); }

  fs::path Foam() const { return folder_ / "in.foam"; }
  fs::path Out(const std::string& name) const { return folder_ / name / "scene.foam"; }

  // Runs `command` into the folder `name`.
  Outcome Run(const std::string& command,
              const fs::path& foam,
              const std::string& name,
              std::vector<std::string> arguments) const {
    arguments.insert(
        arguments.begin(),
        {command, "--foam_path", foam.string(), "--output_path", (folder_ / name).string()});
    return RunSemfoam(arguments);
  }
  void Succeed(const std::string& command,
               const fs::path& foam,
               const std::string& name,
               const std::vector<std::string>& arguments,
               const std::string& says) const {
    const Outcome outcome = Run(command, foam, name, arguments);
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_THAT(outcome.err, HasSubstr(says));
    EXPECT_THAT(FilesBelow(folder_ / name), ElementsAre("scene.foam"));
  }
  void Fail(const std::string& command,
            const std::vector<std::string>& arguments,
            const std::string& says) const {
    const Outcome outcome = Run(command, Foam(), "failed", arguments);
    EXPECT_EQ(outcome.exit_code, 1) << says;
    ASSERT_THAT(outcome.Errors(), SizeIs(1)) << outcome.err;
    EXPECT_THAT(outcome.Errors()[0], HasSubstr(says));
    EXPECT_THAT(FilesBelow(folder_ / "failed"), IsEmpty()) << says;
  }

  TempFolder folder_;
};

TEST_F(ObjectCommandsTest, AnObjectGoesOutAndBackIn) {
  const std::map<int32_t, size_t> all = CellsOfObjects(Foam());
  ASSERT_EQ(all.size(), 3u);
  Succeed("object_extractor", Foam(), "ring", {"--labels", "ring"}, "Extracted ring (10): ");
  EXPECT_EQ(CellsOfObjects(Out("ring")), (std::map<int32_t, size_t>{{10, all.at(10)}}));
  Succeed("object_extractor", Foam(), "two", {"--labels", "12, ring"}, "ring (10), ball (12): ");
  EXPECT_EQ(CellsOfObjects(Out("two")).size(), 2u);
  Succeed("object_remover", Foam(), "rest", {"--labels", "10"}, "Removed ring (10): ");
  EXPECT_EQ(CellsOfObjects(Out("rest")),
            (std::map<int32_t, size_t>{{11, all.at(11)}, {12, all.at(12)}}));
  Succeed("object_inserter",
          Out("rest"),
          "back",
          {"--object_path", Out("ring").string()},
          "Inserted ring (10): ");
  EXPECT_EQ(CellsOfObjects(Out("back")), all);
  const Model before = ReadModel(Foam()), after = ReadModel(Out("back"));
  EXPECT_EQ(after.photos.size(), 4u);
  for (const CameraRays& view : SomeViews()) {
    EXPECT_LT(LargestDifference(Render(before, view), Render(after, view)), 1e-4f);
  }
}

TEST_F(ObjectCommandsTest, APixelNamesTheObjectThatItShows) {
  // The first photo looks down at the ball, past the ring.
  const PhotoPixel middle{"p, 0.png", 40, 39};
  const Model model = ReadModel(Foam());
  EXPECT_EQ(SurfaceAt(model, ViewRenderer(model.foam), middle, "x").label_id, LabelId{12});
  Succeed("object_extractor", Foam(), "pick", {"--pick", "p, 0.png,40,39"}, "ball (12)");
  Succeed("object_extractor", Foam(), "name", {"--labels", "ball"}, "ball (12)");
  EXPECT_EQ(ReadFile(Out("pick")), ReadFile(Out("name")));
  Succeed("object_remover", Foam(), "blank", {"--pick", "p, 0.png 40 39"}, "ball (12)");
}

TEST_F(ObjectCommandsTest, PlacementIsInTheFrameOfTheModel) {
  const Eigen::AlignedBox3d before = BoxOf(Foam(), 12);
  const auto insert = [&](const std::string& name, std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), {"--object_path", Foam().string(), "--labels", "ball"});
    Succeed("object_inserter", Foam(), name, arguments, "Inserted ball (12) as 1: ");
    return BoxOf(Out(name), 1);
  };
  const Eigen::AlignedBox3d moved = insert("moved", {"--translation", "0,0,20.5"});
  EXPECT_LT((moved.center() - before.center() - Eigen::Vector3d(0, 0, 20.5)).norm(), 1e-5);
  EXPECT_LT((moved.sizes() - before.sizes()).norm(), 1e-5);
  const Eigen::AlignedBox3d large = insert("large", {"--translation", "0,0,30", "--scale", "2.5"});
  EXPECT_LT((large.sizes() - 2.5 * before.sizes()).norm(), 1e-4);
  EXPECT_LT((large.center() - before.center() - Eigen::Vector3d(0, 0, 30)).norm(), 1e-4);
  // Onto its side: about x, then about z, the box's axes trade places.
  const Eigen::AlignedBox3d turned =
      insert("turned", {"--translation", "0 0 20", "--rotation", "90,0,90"});
  const Eigen::Vector3d s = before.sizes();
  EXPECT_LT((turned.sizes() - Eigen::Vector3d(s.z(), s.x(), s.y())).norm(), 1e-4);
  EXPECT_LT((turned.center() - before.center() - Eigen::Vector3d(0, 0, 20)).norm(), 1e-4);
}

TEST_F(ObjectCommandsTest, StandsObjectsOnSurfaces) {
  const auto align = [&](const std::string& name, std::vector<std::string> arguments) {
    arguments.insert(
        arguments.end(),
        {"--object_path", Foam().string(), "--labels", "ball", "--align_to", "p, 0.png,40,70"});
    Succeed("object_inserter", Foam(), name, arguments, "Inserted ball (12) as 1: ");
    return BoxOf(Out(name), 1);
  };
  // The table before the ring; its upper side is at z = -0.16, or -1.6 in the COLMAP frame.
  const Model model = ReadModel(Foam());
  const SeenSurface surface = SurfaceAt(model, ViewRenderer(model.foam), {"p, 0.png", 40, 70}, "x");
  EXPECT_EQ(surface.label_id, LabelId{11});
  EXPECT_NEAR(surface.point.z(), -1.6, 0.1);
  EXPECT_GT(surface.normal.z(), 0.999);
  const Eigen::AlignedBox3d box = align("upright", {});
  EXPECT_NEAR(box.min().z(), surface.point.z(), 0.4);
  EXPECT_LT((box.center() - surface.point).head<2>().norm(), 0.5);
  EXPECT_LT((box.sizes() - BoxOf(Foam(), 12).sizes()).norm(), 1);
  // Upside down it stands on its upper side, moved by the translation.
  const Eigen::AlignedBox3d over =
      align("over", {"--rotation", "180,0,0", "--translation", "0,1,2"});
  EXPECT_NEAR(over.min().z() - box.min().z(), 2, 0.4);
  EXPECT_NEAR(over.center().y() - box.center().y(), 1, 0.3);
}

TEST_F(ObjectCommandsTest, TheSameBytesOnAnyNumberOfThreadsAndFromAProjectFile) {
  const std::vector<std::string> options = {"--object_path",
                                            Foam().string(),
                                            "--labels",
                                            "ball,ring",
                                            "--translation",
                                            "1,2,3",
                                            "--rotation",
                                            "10,20,30"};
  std::vector<std::string> one = options, two = options;
  one.insert(one.end(), {"--num_threads", "1"});
  two.insert(two.end(), {"--num_threads", "2"});
  Succeed("object_inserter", Foam(), "one", one, "Inserted");
  Succeed("object_inserter", Foam(), "two", two, "Inserted");
  EXPECT_EQ(ReadFile(Out("one")), ReadFile(Out("two")));
  std::string project =
      "foam_path=" + Foam().string() + "\noutput_path=" + (folder_ / "ini").string();
  for (size_t i = 0; i < options.size(); i += 2) {
    project += "\n" + options[i].substr(2) + "=" + options[i + 1];
  }
  WriteFile(folder_ / "x.ini", project + "\n");
  const Outcome outcome =
      RunSemfoam({"object_inserter", "--project_path", (folder_ / "x.ini").string()});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(ReadFile(Out("ini")), ReadFile(Out("one")));
}

// The ring's name is the ball's id.
TEST_F(ObjectCommandsTest, APickTakesOneObjectWhateverTheOthersAreCalled) {
  Model model = RingScene();
  model.labels[0].name = "12";
  WriteModel(folder_ / "names.foam", model);
  for (const std::string command : {"object_extractor", "object_remover"}) {
    const std::string done = command == "object_extractor" ? "Extracted " : "Removed ";
    Succeed(command,
            folder_ / "names.foam",
            command,
            {"--pick", "p, 0.png,40,39"},
            done + "ball (12): ");
    const Outcome both = Run(command, folder_ / "names.foam", "failed", {"--labels", "12"});
    EXPECT_EQ(both.exit_code, 1);
    ExpectRefused(both,
                  {"", {"'12'", "ball (12)", "label 10", "id:12", "name:12"}, "is ambiguous"});
    EXPECT_THAT(FilesBelow(folder_ / "failed"), IsEmpty());
    Succeed(command,
            folder_ / "names.foam",
            command + "1",
            {"--labels", "id:12"},
            done + "ball (12): ");
    Succeed(command,
            folder_ / "names.foam",
            command + "2",
            {"--labels", "name:12"},
            done + "12 (10): ");
    Succeed(command,
            folder_ / "names.foam",
            command + "3",
            {"--exclude_labels", "name:12"},
            done + "table (11), ball (12): ");
  }
}

TEST_F(ObjectCommandsTest, SaysWhatIsWrong) {
  for (const std::string command : {"object_extractor", "object_remover"}) {
    Fail(command, {}, "no object is named; give either --labels (as mug,7) or --pick");
    Fail(command, {"--labels", "ring", "--pick", "a,1,2"}, "both --labels and --pick");
    Fail(command,
         {"--exclude_labels", "ring", "--pick", "a,1,2"},
         "both --exclude_labels and --pick");
    Fail(command, {"--labels", "mug"}, "'mug', which is no object; the scene has 10 (ring)");
    for (const char* bad : {"a", "1,2", "a,1,x", ",1,2", "a,1.5,2", "a,,1"}) {
      Fail(command, {"--pick", bad}, "for option '--pick' is invalid; it takes a photo's name");
    }
    Fail(command, {"--pick", "q.png,1,2"}, "has no photo q.png; one of its photos is p, 0.png");
    Fail(command, {"--pick", "p, 0.png,80,2"}, "has 80x80 pixels, and none at 80,2");
    Fail(command, {"--pick", "p, 0.png,2,-1"}, "has 80x80 pixels, and none at 2,-1");
    Fail(command, {"--pick", "p, 0.png,0,0"}, "there is nothing at 0,0 of p, 0.png");
  }
  const std::string object = Foam().string();
  Fail("object_inserter", {}, "'--object_path' is required but missing");
  Fail("object_inserter", {"--object_path", object, "--labels", "mug"}, "which is no object");
  for (const char* bad : {"1,2", "1,2,3,4", "a,b,c", "", "1,2,nan"}) {
    for (const std::string option : {"translation", "rotation"}) {
      Fail("object_inserter",
           {"--object_path", object, "--" + option, bad},
           "for option '--" + option + "' is invalid; it takes three numbers, x,y,z");
    }
  }
  Fail("object_inserter", {"--object_path", object, "--scale", "0"}, "--scale is 0; it must be");
  Fail("object_inserter", {"--object_path", object, "--align_to", "p, 0.png"}, "'--align_to'");
  Fail("object_inserter",
       {"--object_path", object, "--align_to", "p, 0.png,0,0"},
       "there is nothing at 0,0");
  Fail("object_inserter",
       {"--object_path", object, "--translation", "1000,0,0"},
       "place it nearer, or make it smaller");
  Fail(
      "object_inserter", {"--object_path", (folder_ / "no.foam").string()}, "no.foam: there is no");
  // What is read is not written over.
  fs::create_directories(folder_ / "same");
  fs::copy_file(Foam(), Out("same"));
  const std::string bytes = ReadFile(Out("same"));
  const Outcome same = Run("object_remover", Out("same"), "same", {"--labels", "ring"});
  EXPECT_EQ(same.exit_code, 1);
  EXPECT_THAT(same.err, HasSubstr("is read, so it will not be written; give another"));
  EXPECT_EQ(ReadFile(Out("same")), bytes);
}

TEST_F(ObjectCommandsTest, HelpNamesEveryOption) {
  const Outcome list = RunSemfoam({"help"});
  for (const std::string command : {"object_extractor", "object_remover", "object_inserter"}) {
    EXPECT_THAT(list.out, HasSubstr(command));
    const Outcome help = RunSemfoam({command, "-h"});
    EXPECT_EQ(help.exit_code, 0);
    EXPECT_EQ(help.err, "");
    for (const char* option : {"--foam_path", "--output_path", "--labels", "--project_path"}) {
      EXPECT_THAT(help.out, HasSubstr(option)) << command;
    }
    EXPECT_EQ(help.out.find("--pick") != std::string::npos, command != "object_inserter");
    EXPECT_EQ(help.out.find("--align_to") != std::string::npos, command == "object_inserter");
  }
}

TEST_F(ObjectCommandsTest, AFoamWithoutLabelsHasNoObjects) {
  Model model = RingScene();
  KeepClasses({}, &model);
  WriteModel(Foam(), model);
  Fail("object_extractor", {"--labels", "ring"}, "has no objects; a foam has them where it was");
  Fail("object_remover", {"--pick", "p, 0.png,40,39"}, "has no label; choose a pixel of an object");
  // But an object can be put into it.
  WriteModel(folder_ / "labelled.foam", RingScene());
  Succeed("object_inserter",
          Foam(),
          "in",
          {"--object_path", (folder_ / "labelled.foam").string(), "--labels", "ball"},
          "Inserted ball (12): ");
  EXPECT_EQ(CellsOfObjects(Out("in")).count(12), 1u);
}

TEST_F(ObjectCommandsTest, PhotosThatDoNotTellWhatIsUp) {
  Model model = RingScene();
  WriteModel(folder_ / "scene.foam", model);
  model.photos.clear();
  WriteModel(Foam(), model);
  const Outcome outcome =
      Run("object_inserter",
          folder_ / "scene.foam",
          "failed",
          {"--object_path", Foam().string(), "--labels", "ball", "--align_to", "p, 0.png,40,70"});
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_THAT(outcome.err, HasSubstr("its photos do not tell what is up"));
  EXPECT_THAT(FilesBelow(folder_ / "failed"), IsEmpty());
}

// A trained foam: out and in again within 0.1 dB of what it was, and every exporter reads it.
TEST(ObjectCommandsTrained, GoOutAndBackIn) {
  const TempFolder folder;
  const Outcome trained =
      RunSemfoam(TinyTraining(TrainerOn(kTabletop, folder / "in", {"--test_every", "8"})));
  ASSERT_EQ(trained.exit_code, 0) << trained.err;
  const auto foam = [&](const std::string& name) {
    return (folder / name / "scene.foam").string();
  };
  const auto run = [&](std::vector<std::string> arguments) {
    const Outcome outcome = RunSemfoam(arguments);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return outcome;
  };
  const auto psnr = [&](const std::string& name) {
    const fs::path json = folder / (name + ".json");
    run({"foam_evaluator",
         "--foam_path",
         foam(name),
         "--image_path",
         (kTabletop / "images").string(),
         "--json_path",
         json.string()});
    return nlohmann::json::parse(ReadFile(json))["psnr"].get<double>();
  };
  const std::map<int32_t, size_t> before = CellsOfObjects(foam("in"));
  ASSERT_FALSE(before.empty());
  const auto largest = std::max_element(
      before.begin(), before.end(), [](auto& a, auto& b) { return a.second < b.second; });
  const std::string id = std::to_string(largest->first);
  run({"object_extractor",
       "--foam_path",
       foam("in"),
       "--labels",
       id,
       "--output_path",
       (folder / "object").string()});
  run({"object_remover",
       "--foam_path",
       foam("in"),
       "--labels",
       id,
       "--output_path",
       (folder / "rest").string()});
  run({"object_inserter",
       "--foam_path",
       foam("rest"),
       "--object_path",
       foam("object"),
       "--output_path",
       (folder / "back").string()});
  EXPECT_EQ(CellsOfObjects(foam("object")),
            (std::map<int32_t, size_t>{{largest->first, largest->second}}));
  EXPECT_LT(psnr("rest"), psnr("in") - 0.1);
  EXPECT_NEAR(psnr("back"), psnr("in"), 0.1);

  run({"foam_renderer",
       "--foam_path",
       foam("object"),
       "--input_path",
       (kTabletop / "sparse" / "0").string(),
       "--views",
       "test",
       "--output_path",
       (folder / "renders").string()});
  EXPECT_THAT(FilesBelow(folder / "renders"), SizeIs(3 * 8));
  run({"mesh_exporter", "--foam_path", foam("back"), "--output_path", (folder / "back").string()});
  run({"volume_exporter",
       "--foam_path",
       foam("object"),
       "--output_path",
       (folder / "object").string()});
  EXPECT_TRUE(fs::exists(folder / "object" / "scene.vdb"));
}

}  // namespace
}  // namespace semfoam
