// SPDX-License-Identifier: GPL-3.0-or-later
//
// mask_analyzer on the tabletop scene and on masks whose damage is known.
#include "export/scene/names.h"
#include "plugin/mask/mask_png.h"
#include "tools/images/contact_sheet.h"

#include <algorithm>
#include <cstdlib>
#include <map>
#include <memory>
#include <set>
#include <utility>

#include "tests/tools/commands/ring_scene.h"
#include "tests/tools/mask_corrupter.h"
#include "tests/tools/program.h"
#include <OpenImageIO/imageio.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::UnorderedElementsAre;

Outcome Analyze(const std::vector<std::string>& more) {
  std::vector<std::string> arguments = {"mask_analyzer"};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return RunSemfoam(arguments);
}

json AnalyzeAsJson(std::vector<std::string> more) {
  more.insert(more.end(), {"--json", "1"});
  const Outcome outcome = Analyze(more);
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  return json::parse(outcome.out);
}

const json& FileOf(const json& report, const std::string& photo) {
  for (const json& file : report["files"]) {
    if (file["photo"] == photo) return file;
  }
  ADD_FAILURE() << photo;
  return report;
}

// The faults of a photo; none where it is not suspicious.
std::vector<std::string> FaultsOf(const json& report, const std::string& photo) {
  std::vector<std::string> faults;
  for (const json& one : report["suspicious"]) {
    if (one["photo"] != photo) continue;
    for (const json& finding : one["findings"]) faults.push_back(finding["fault"]);
  }
  return faults;
}

// The pairs of a photo and an object in it that is not where the mask has it.
std::set<std::pair<std::string, int>> Suspected(const json& report) {
  std::set<std::pair<std::string, int>> objects;
  for (const json& photo : report["suspicious"]) {
    for (const json& finding : photo["findings"]) {
      for (const json& label : finding["is"]) {
        if (!finding.contains("region") || label["id"] != finding["region"]["id"]) {
          objects.emplace(photo["photo"].get<std::string>(), label["id"].get<int>());
        }
      }
    }
  }
  return objects;
}

TEST(MaskAnalyzer, SaysWhatIsInTheFolder) {
  const Outcome outcome = Analyze({"--workspace_path", kTabletop.string()});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("64 masks for 64 photos, 0 more of no photo\n"));
  EXPECT_THAT(outcome.out, HasSubstr("Format: 8-bit grey\nSize: 320 x 240\npred.json: none\n"));
  EXPECT_THAT(outcome.out, HasSubstr("47 ids (share of the photos that have it)"));
  EXPECT_THAT(outcome.out, testing::ContainsRegex("  6  mug +60 +0\\.[0-9]+ % +2\\.4"));
  EXPECT_THAT(outcome.out, HasSubstr("and 7 more, in fewer photos"));
  EXPECT_THAT(outcome.out, HasSubstr("Masks held against the tracks: of 741 regions"));
  EXPECT_THAT(outcome.out, HasSubstr("the most suspicious first\n  0046.jpg: 4 (rug) is missing"));
  EXPECT_THAT(outcome.out, HasSubstr(" (wall) and 5 (table): "));
}

TEST(MaskAnalyzer, TheReportIsCompleteAsJson) {
  const json report = AnalyzeAsJson({"--workspace_path", kTabletop.string()});
  EXPECT_EQ(report["photos"], 64);
  EXPECT_EQ(report["masks"], 64);
  EXPECT_EQ(report["model"], true);
  EXPECT_THAT(report["ids"], testing::SizeIs(47));
  EXPECT_EQ(report["consistency"]["method"], "tracks");
  EXPECT_GT(report["consistency"]["agreement_after"], 0.95);
  EXPECT_EQ(FileOf(report, "0007.jpg")["mask"], "0007.png");
  EXPECT_EQ(FileOf(report, "0007.jpg")["size"], (json{320, 240}));
  // The shares of the ids are those of the pixels, counted here.
  const MaskPng mask = ReadMaskPng(kTabletop / "object_mask/0046.png");
  std::map<uint32_t, double> share;
  for (const uint32_t id : mask.values) {
    share[id] += 1 / static_cast<double>(mask.values.size());
  }
  EXPECT_NEAR(FileOf(report, "0046.jpg")["unlabelled"], share[0], 1e-9);
  for (const json& id : report["ids"]) {
    if (!share.contains(id["id"])) continue;
    EXPECT_GE(id["area"]["most"], share[id["id"]] - 1e-9);
    EXPECT_LE(id["area"]["least"], share[id["id"]] + 1e-9);
  }
}

// Of damage that is known, most is found where there are points, and little else is suspected.
TEST(MaskAnalyzer, FindsTheDamageAndLittleElse) {
  const TempFolder folder;
  const fs::path masks = folder / "masks";
  DamageTabletopMasks(masks, "0.1");
  std::set<std::pair<std::string, int>> damaged;
  for (const std::string& name : FilesBelow(masks)) {
    const MaskPng before = ReadMaskPng(kTabletop / "object_mask" / name);
    const MaskPng after = ReadMaskPng(masks / name);
    std::map<uint32_t, int> pixels, changed;
    for (size_t i = 0; i < before.values.size(); ++i) {
      ++pixels[before.values[i]];
      changed[before.values[i]] += before.values[i] != after.values[i];
    }
    for (int id = 1; id <= 13; ++id) {
      if (pixels[id] >= 50 && 2 * changed[id] > pixels[id]) {
        damaged.insert({name.substr(0, 4) + ".jpg", id});
      }
    }
  }
  ASSERT_GT(damaged.size(), 50u);
  const std::string sparse = (kTabletop / "sparse").string();
  const auto suspected =
      Suspected(AnalyzeAsJson({"--mask_path", masks.string(), "--input_path", sparse}));
  const auto before = Suspected(AnalyzeAsJson({"--workspace_path", kTabletop.string()}));
  double found = 0, right = 0, all = 0;
  for (const auto& object : damaged) found += suspected.contains(object);
  for (const auto& object : suspected) {
    if (before.contains(object)) continue;  // the tracker's own errors
    ++all;
    right += damaged.contains(object);
  }
  EXPECT_GT(found / static_cast<double>(damaged.size()), 0.6);
  EXPECT_GT(right / all, 0.85);
}

TEST(MaskAnalyzer, WhatCannotBeUsedIsAFindingAndNoError) {
  const TempFolder folder;
  CopyTabletop(folder / "w");
  const fs::path masks = folder / "w" / "object_mask";
  fs::remove(masks / "0003.png");
  WriteFile(masks / "0011.png", ReadFile(masks / "0011.png").substr(0, 900));
  fs::rename(masks / "0012.png", masks / "stray.png");
  const auto output = OIIO::ImageOutput::create("x.png");
  const OIIO::ImageSpec spec(100, 100, 1, OIIO::TypeDesc::UINT8);
  const std::vector<uint8_t> pixels(10000, 3);
  ASSERT_TRUE(output->open((masks / "0020.png").string(), spec));
  ASSERT_TRUE(output->write_image(spec.format, pixels.data()) && output->close());
  const std::vector<std::string> arguments = {
      "--workspace_path", (folder / "w").string(), "--output_path", (folder / "out").string()};
  const json report = AnalyzeAsJson(arguments);
  EXPECT_THAT(FaultsOf(report, "0003.jpg"), ElementsAre("no mask"));
  EXPECT_THAT(FaultsOf(report, "0011.jpg"), ElementsAre("unreadable"));
  EXPECT_THAT(FaultsOf(report, "0012.jpg"), ElementsAre("no mask"));
  EXPECT_THAT(FaultsOf(report, "0020.jpg"), ElementsAre("wrong aspect"));
  EXPECT_EQ(report["unused_masks"], json{"stray.png"});
  EXPECT_FALSE(FileOf(report, "0003.jpg").contains("mask"));
  EXPECT_FALSE(FileOf(report, "0011.jpg").contains("unlabelled"));
  // These four come first.
  std::set<std::string> first;
  for (int i = 0; i < 4; ++i) first.insert(report["suspicious"][i]["photo"]);
  EXPECT_THAT(first, UnorderedElementsAre("0003.jpg", "0011.jpg", "0012.jpg", "0020.jpg"));
  EXPECT_EQ(json::parse(ReadFile(folder / "out" / "masks.json")), report);
  EXPECT_THAT(ReadFile(folder / "out" / "masks.json"), testing::Not(HasSubstr(masks.string())));
  const Outcome text = Analyze({"--workspace_path", (folder / "w").string()});
  EXPECT_THAT(text.out, HasSubstr("0020.jpg: its mask is 100 x 100, the photo 320 x 240"));
  EXPECT_THAT(text.out, HasSubstr("0003.jpg: has no mask"));
  EXPECT_THAT(text.out, HasSubstr("0011.jpg: its mask is unreadable: "));
}

TEST(MaskAnalyzer, WorksOnMasksAloneAndSaysWhatItCannotTell) {
  const TempFolder folder;
  fs::create_directories(folder / "w");
  fs::copy(kTabletop / "object_mask", folder / "w" / "masks", fs::copy_options::recursive);
  const std::vector<std::string> arguments = {
      "--mask_path", (folder / "w" / "masks").string(), "--output_path", (folder / "out").string()};
  const Outcome outcome = Analyze(arguments);
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("64 masks for 64 photos"));
  EXPECT_THAT(outcome.out, HasSubstr("47 ids"));
  EXPECT_THAT(outcome.out, HasSubstr("nothing tells whether the ids agree"));
  EXPECT_THAT(outcome.out, HasSubstr("0 suspicious photos\n"));
  WriteFile(folder / "w/pred.json", "{\"annotations\": []}");
  const json report = AnalyzeAsJson(arguments);
  EXPECT_EQ(report["model"], false);
  EXPECT_EQ(report["pred_json"], true);
  EXPECT_FALSE(report.contains("consistency"));
  // With photos, those without a mask are known.
  fs::copy(kTabletop / "images", folder / "w" / "images", fs::copy_options::recursive);
  fs::remove(folder / "w" / "masks" / "0005.png");
  EXPECT_THAT(FaultsOf(AnalyzeAsJson(arguments), "0005.jpg"), ElementsAre("no mask"));
}

struct Picture {
  int width = 0, height = 0;
  std::vector<uint8_t> data;
};

Picture ReadPicture(const fs::path& path) {
  const auto input = OIIO::ImageInput::open(path.string());
  EXPECT_NE(input, nullptr) << path;
  Picture picture{input->spec().width, input->spec().height, {}};
  picture.data.resize(size_t{3} * picture.width * picture.height);
  EXPECT_EQ(input->spec().nchannels, 3);
  EXPECT_TRUE(input->read_image(0, 0, 0, 3, OIIO::TypeDesc::UINT8, picture.data.data()));
  return picture;
}

TEST(MaskAnalyzer, TheContactSheetHasPagesOfBoundedSize) {
  const TempFolder folder;
  const fs::path out = folder / "out";
  ASSERT_EQ(
      Analyze({"--workspace_path", kTabletop.string(), "--output_path", out.string()}).exit_code,
      0);
  EXPECT_THAT(FilesBelow(out),
              UnorderedElementsAre("masks.json", "contact_sheet_1.png", "contact_sheet_2.png"));
  const Picture first = ReadPicture(out / "contact_sheet_1.png");
  const Picture second = ReadPicture(out / "contact_sheet_2.png");
  EXPECT_EQ(first.width, second.width);
  EXPECT_LT(first.width, 2000);
  EXPECT_LT(first.height, 3000);
  EXPECT_GT(first.height, 1500);           // eight rows
  EXPECT_LT(second.height, first.height);  // three
  // Suspicious photos have a red frame: long runs of that red, which nothing else has.
  int frames = 0;
  for (int y = 0; y < first.height; ++y) {
    int run = 0;
    for (int x = 0; x < first.width; ++x) {
      const uint8_t* p = &first.data[3 * (static_cast<size_t>(y) * first.width + x)];
      run = std::abs(p[0] - 204) < 3 && p[1] < 16 && p[2] < 16 ? run + 1 : 0;
      frames += run == 200;
    }
  }
  EXPECT_GT(frames, 30);
}

TEST(MaskAnalyzerContactSheet, OverlaysShowPhotoLabelsAndOutlines) {
  Image8 photo{4, 1, {}};
  photo.data.assign(12, 100);
  // The outline of 7 is at both its ends; 0 shows the photo.
  const Image8 tile = OverlayTile(photo, {8, 1, {7, 7, 7, 7, 7, 7, 0, 0}});
  const auto color = LabelColor(LabelId{7});
  ASSERT_EQ(tile.width, 4);
  for (int c = 0; c < 3; ++c) {
    EXPECT_EQ(tile.data[c], (100 + color[c]) / 2);
    EXPECT_EQ(tile.data[3 + c], (100 + color[c]) / 2);
    EXPECT_EQ(tile.data[6 + c], color[c]);
    EXPECT_EQ(tile.data[9 + c], 100);
  }
  // Without a photo the labels are over grey, and large ones are reduced.
  LabelImage wide{2 * kTileSide, 2, {}};
  wide.data.assign(size_t{4} * kTileSide, 0);
  const Image8 grey = OverlayTile({}, wide);
  EXPECT_EQ(grey.width, kTileSide);
  EXPECT_EQ(grey.height, 1);
  EXPECT_EQ(grey.data.front(), 200);
  EXPECT_TRUE(OverlayTile({}, {}).data.empty());
}

TEST(MaskAnalyzerContactSheet, PagesThatAreTooManyGo) {
  const TempFolder folder;
  const auto tile = [](int index) {
    SheetTile one;
    one.picture = Image8{2, 1, {0, 0, 0, 9, 9, 9}};
    one.caption = "photo " + std::to_string(index) + std::string(200, 'x');
    return one;
  };
  EXPECT_EQ(WriteContactSheet(folder / "s", "t", {}, kTilesPerPage + 1, tile), 2);
  EXPECT_THAT(FilesBelow(folder / ""), UnorderedElementsAre("s_1.png", "s_2.png"));
  EXPECT_EQ(WriteContactSheet(folder / "s", "t", {{"a", {1, 2, 3}}}, kTilesPerPage, tile), 1);
  EXPECT_THAT(FilesBelow(folder / ""), ElementsAre("s_1.png"));
}

TEST(MaskAnalyzer, SameBytesOnAnyNumberOfThreads) {
  const TempFolder folder;
  for (const std::string threads : {"1", "2", "5"}) {
    ASSERT_EQ(Analyze({"--workspace_path",
                       kTabletop.string(),
                       "--output_path",
                       (folder / threads).string(),
                       "--num_threads",
                       threads})
                  .exit_code,
              0);
    for (const char* file : {"masks.json", "contact_sheet_1.png", "contact_sheet_2.png"}) {
      EXPECT_TRUE(ReadFile(folder / threads / file) == ReadFile(folder / "1" / file)) << file;
    }
  }
}

TEST(MaskAnalyzer, SaysWhatIsWrongInOneSentence) {
  const TempFolder folder;
  fs::create_directories(folder / "empty");
  const std::string empty = (folder / "empty").string();
  const std::string out = (folder / "out").string();
  const std::string tabletop = kTabletop.string();
  const std::string nowhere = empty + "/x";
  ExpectEachRefused(
      {"mask_analyzer", "--output_path", out},
      {
          {{}, {"", {"object_mask/", "Annotations/", "mask_path"}, "neither"}},
          {{"--workspace_path", empty}, {empty, {"object_mask/", "Annotations/"}, "neither"}},
          {{"--workspace_path", nowhere}, {nowhere, {"workspace_path"}, "no such folder"}},
          {{"--mask_path", nowhere}, {nowhere, {"mask"}, "no such folder"}},
          {{"--mask_path", empty}, {empty, {"PNG"}, "is empty"}},
          {{"--workspace_path", tabletop, "--image_path", nowhere},
           {nowhere, {"photos"}, "no such folder"}},
          {{"--workspace_path", tabletop, "--input_path", empty},
           {empty, {}, "holds no COLMAP model"}},
          {{"--workspace_path", tabletop, "--labels_path", empty + "/l.json"},
           {empty + "/l.json", {}, "no such file"}},
          {{"--workspace_path", tabletop, "--json", "yes"}, {"", {"json", "'yes'"}, "is invalid"}},
      },
      out);
  EXPECT_THAT(Analyze({"-h"}).out, HasSubstr("contact_sheet_1.png"));
}

TEST(MaskAnalyzer, SuggestsPhotosToMaskBeforeThereAreMasks) {
  const TempFolder folder;
  const Outcome outcome = Analyze({"--input_path",
                                   (kTabletop / "sparse/0").string(),
                                   "--mask_path",
                                   folder.path().string(),
                                   "--suggest",
                                   "3",
                                   "--test_every",
                                   "8"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out,
              testing::MatchesRegex("No photo has a mask\nPhotos to mask next, in this order, and "
                                    "how much of the scene is shown then:\n"
                                    "  00[0-9]+.jpg  [0-9]+ %\n  00[0-9]+.jpg  [0-9]+ %\n"
                                    "  00[0-9]+.jpg  [0-9]+ %\n"));
}

TEST(MaskAnalyzer, SuggestsWhatTheMasksDoNotShow) {
  const TempFolder folder;
  for (const char* name : {"0000.png", "0004.png", "0020.png", "0036.png", "0052.png"}) {
    fs::copy_file(kTabletop / "object_mask" / name, folder.path() / name);
  }
  const json report = AnalyzeAsJson({"--input_path",
                                     (kTabletop / "sparse/0").string(),
                                     "--mask_path",
                                     folder.path().string(),
                                     "--suggest",
                                     "5",
                                     "--test_every",
                                     "8"});
  // 0000 is held out.
  EXPECT_EQ(report["masks"], 4);
  ASSERT_THAT(report["suggestions"], testing::SizeIs(5));
  double shown = report["shown"];
  double gain = 1;
  for (const json& photo : report["suggestions"]) {
    EXPECT_THAT((std::set<std::string>{"0004.jpg", "0020.jpg", "0036.jpg", "0052.jpg"}),
                testing::Not(testing::Contains(photo["photo"])));
    EXPECT_NE(std::stoi(photo["photo"].get<std::string>()) % 8, 0);
    // Each adds something, and less than the one before.
    EXPECT_GT(photo["shown"].get<double>(), shown);
    EXPECT_LE(photo["shown"].get<double>() - shown, gain);
    gain = photo["shown"].get<double>() - shown;
    shown = photo["shown"];
  }
}

// A foam that knows its labels on one side, and photos from four sides.
TEST(MaskAnalyzer, SuggestsWhatAFoamIsNotSureOf) {
  const TempFolder folder;
  Model model = RingScene();
  for (size_t i = 0; i < model.foam.NumSites(); ++i) {
    if (model.foam.positions[i].x() > -0.1f) continue;
    std::fill_n(&model.foam.identity[i * kIdentityDim], kIdentityDim, 0.f);
  }
  const fs::path foam = folder / "scene.foam";
  WriteModel(foam, model);
  const auto suggest = [&](const std::vector<std::string>& more) {
    std::vector<std::string> arguments = {"--suggest", "4", "--foam_path", foam.string()};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return AnalyzeAsJson(arguments);
  };
  // The photo from that side first; shares grow to nearly all that photos show.
  const json report = suggest({});
  ASSERT_THAT(report["suggestions"], testing::SizeIs(4));
  EXPECT_EQ(report["masks"], 0);
  EXPECT_EQ(report["shown"], 0.0);
  EXPECT_EQ(report["suggestions"][0]["photo"], "p, 1.png");
  double before = 0;
  for (const json& photo : report["suggestions"]) {
    EXPECT_GT(photo["shown"].get<double>(), before);
    before = photo["shown"].get<double>();
  }
  for (const char* threads : {"1", "5"}) EXPECT_EQ(suggest({"--num_threads", threads}), report);
  // Its mask leaves less to tell than the others have; a photo that is held out is none to mask.
  fs::create_directory(folder / "masks");
  WriteFile(folder / "masks/p, 1.png", "a mask, of which the name alone counts");
  const json with_mask = suggest({"--mask_path", (folder / "masks").string()});
  EXPECT_EQ(with_mask["masks"], 1);
  EXPECT_EQ(with_mask["shown"], report["suggestions"][0]["shown"]);
  ASSERT_THAT(with_mask["suggestions"], testing::SizeIs(3));
  EXPECT_EQ(with_mask["suggestions"][0], report["suggestions"][1]);
  model.photos[1].held_out = true;
  WriteModel(foam, model);
  for (const json& photo : suggest({})["suggestions"]) EXPECT_NE(photo["photo"], "p, 1.png");
  EXPECT_THAT(Analyze({"--suggest", "4", "--foam_path", foam.string()}).out,
              HasSubstr("how much of what the foam is not sure of is shown then:\n  p, "));
  // Photos, and those held out, are the foam's.
  for (const char* option : {"--test_every", "--input_path"}) {
    EXPECT_THAT(Analyze({"--suggest", "4", "--foam_path", foam.string(), option, "8"}),
                testing::Field(&Outcome::err, HasSubstr("no effect with --foam_path")));
  }
  EXPECT_THAT(Analyze({"--foam_path", foam.string(), "--mask_path", (folder / "masks").string()}),
              testing::Field(&Outcome::err, HasSubstr("no effect without --suggest")));
  model.photos.clear();
  WriteModel(foam, model);
  ExpectRefused(Analyze({"--suggest", "4", "--foam_path", foam.string()}),
                {foam.string(), {}, "has no photos"});
}

TEST(MaskAnalyzer, SuggestionsTakeNoOptionsOfTheReport) {
  const std::string workspace = kTabletop.string();
  EXPECT_THAT(
      Analyze({"--workspace_path", workspace, "--suggest", "2", "--Masks.consistency", "off"}),
      testing::Field(&Outcome::err, HasSubstr("no effect with --suggest")));
  EXPECT_THAT(Analyze({"--workspace_path", workspace, "--test_every", "8"}),
              testing::Field(&Outcome::err, HasSubstr("no effect without --suggest")));
  const Outcome negative = Analyze({"--workspace_path", workspace, "--suggest", "-1"});
  EXPECT_EQ(negative.exit_code, 1);
  EXPECT_THAT(negative.err, HasSubstr("--suggest is negative; it must be a number of photos."));
}

}  // namespace
}  // namespace semfoam
