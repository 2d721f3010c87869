// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/colmap/camera_rays.h"
#include "plugin/colmap/colmap_model.h"
#include "plugin/mask/mask_pairing.h"
#include "tools/views/capture_path.h"

#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "tests/tools/program.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::SizeIs;

// Cameras that look along z from these places on the x axis.
std::vector<PhotoRecord> Row(const std::vector<double>& places) {
  std::vector<PhotoRecord> photos;
  for (const double x : places) {
    PhotoRecord photo;
    photo.name = "photo" + std::to_string(photos.size());
    photo.width = 40;
    photo.height = 30;
    photo.cam_from_world_translation = {-x, 0, 0};
    photos.push_back(photo);
  }
  return photos;
}

TEST(ViewInterpolatorPath, GoesAShortWay) {
  const std::vector<PhotoRecord> mixed = Row({0, 3, 1, 4, 2});
  EXPECT_THAT(CaptureOrder(mixed, 1, FilmOrder::kName), ElementsAre(0, 1, 2, 3, 4));
  EXPECT_THAT(CaptureOrder(mixed, 1, FilmOrder::kPath), ElementsAre(0, 2, 4, 1, 3));
  EXPECT_THAT(CaptureOrder(mixed, 1, FilmOrder::kAuto), ElementsAre(0, 2, 4, 1, 3));
  // By name it goes back once, and is little longer: that is how they were taken.
  const std::vector<PhotoRecord> film = Row({0, 1, 2, 1.8, 3, 4});
  EXPECT_THAT(CaptureOrder(film, 1, FilmOrder::kAuto), ElementsAre(0, 1, 2, 3, 4, 5));
  EXPECT_THAT(CaptureOrder(Row({7}), 1, FilmOrder::kAuto), ElementsAre(0));
}

TEST(ViewInterpolatorPath, TurningPiecesAroundHelpsWhereTheNearestMisleads) {
  // On a ring, the nearest-first way leaves photos behind and has to come back for them.
  std::vector<double> places;
  for (int k = 0; k < 40; ++k) places.push_back(std::sin(12.9898 * k) * 10);
  const std::vector<PhotoRecord> photos = Row(places);
  const std::vector<size_t> order = CaptureOrder(photos, 1, FilmOrder::kPath);
  double length = 0;
  for (size_t k = 1; k < order.size(); ++k)
    length += ViewDistance(photos[order[k - 1]], photos[order[k]], 1);
  EXPECT_THAT(std::set<size_t>(order.begin(), order.end()), SizeIs(40));
  EXPECT_EQ(order.front(), 0);
  // The best from where it begins: to the nearer end and then all along.
  const auto [low, high] = std::minmax_element(places.begin(), places.end());
  const double best = (*high - *low) + std::min(places[0] - *low, *high - places[0]);
  EXPECT_LT(length, 1.05 * best);
}

TEST(ViewInterpolatorPath, AFilmHasMorePicturesWhereStepsAreLong) {
  const std::vector<PhotoRecord> photos = Row({0, 1, 2, 6});
  const std::vector<FilmFrame> film = MakeFilm(photos, {0, 1, 2, 3}, 1, 2);
  ASSERT_THAT(film, SizeIs(4 + 2 + 2 + 8));
  EXPECT_EQ(film[0].next, 0);
  EXPECT_NEAR(film[1].cam_from_world.Center().x(), 1.0 / 3, 1e-12);
  EXPECT_NEAR(film[2].share, 2.0 / 3, 1e-12);
  EXPECT_NEAR(film[3].cam_from_world.Center().x(), 1, 1e-12);
  for (size_t k = 1; k < film.size(); ++k) {
    EXPECT_GT(film[k].cam_from_world.Center().x(), film[k - 1].cam_from_world.Center().x());
  }
  EXPECT_THAT(MakeFilm(photos, {0, 1, 2, 3}, 1, 0), SizeIs(4));
  // A tracker wants pictures of one size; between two sizes there is none.
  std::vector<PhotoRecord> two_sizes = photos;
  two_sizes[3].width = 41;
  EXPECT_THAT(MakeFilm(two_sizes, {0, 1, 2, 3}, 1, 2), SizeIs(8));
}

// An untrained foam of every tenth photo of the tabletop.
std::string MakeFoam(const TempFolder& folder) {
  Reconstruction model = ReadReconstruction(kTabletop / "sparse/0");
  model.points.clear();
  std::vector<Image> some;
  std::sort(model.images.begin(), model.images.end(), [](const Image& a, const Image& b) {
    return a.name < b.name;
  });
  for (size_t k = 0; k < model.images.size(); k += 10) {
    some.push_back(model.images[k]);
    some.back().points.clear();
  }
  model.images = some;
  WriteReconstruction(folder / "sparse", model, ModelFormat::kBinary);
  const std::string foam = (folder / "a.foam").string();
  EXPECT_EQ(
      RunSemfoam(
          {"foam_converter", "--input_path", (folder / "sparse").string(), "--output_path", foam})
          .exit_code,
      0);
  return foam;
}

Outcome MakeFilm(const std::string& foam,
                 const fs::path& output,
                 const std::string& between,
                 const std::string& order = "name") {
  return RunSemfoam({"view_interpolator",
                     "--foam_path",
                     foam,
                     "--image_path",
                     (kTabletop / "images").string(),
                     "--output_path",
                     output.string(),
                     "--between",
                     between,
                     "--order",
                     order});
}

Outcome BringBack(const fs::path& manifest, const fs::path& masks, const fs::path& output) {
  return RunSemfoam({"view_interpolator",
                     "--manifest_path",
                     manifest.string(),
                     "--mask_path",
                     masks.string(),
                     "--output_path",
                     output.string()});
}

TEST(ViewInterpolator, MasksComeBackToThePhotos) {
  const TempFolder folder;
  const Outcome film = MakeFilm(MakeFoam(folder), folder / "film", "1", "path");
  ASSERT_EQ(film.exit_code, 0) << film.err;
  const json manifest = json::parse(ReadFile(folder / "film" / "manifest.json"));
  EXPECT_EQ(FilesBelow(folder / "film" / "frames").size(), manifest["frames"].size());
  EXPECT_GE(manifest["frames"].size(), 7 + 6);

  // The tracker: a mask for each frame, here the photo's own or nothing.
  fs::create_directories(folder / "tracked");
  int photos = 0;
  for (const json& frame : manifest["frames"]) {
    const std::string file = frame["file"];
    if (!frame.contains("photo")) {
      EXPECT_THAT(frame["between"], SizeIs(2));
      WriteFile(folder / "tracked" / file, "not looked at");
      continue;
    }
    ++photos;
    const fs::path photo = frame["photo"].get<std::string>();
    fs::copy(kTabletop / "object_mask" / (photo.stem().string() + ".png"),
             folder / "tracked" / file);
  }
  EXPECT_EQ(photos, 7);
  WriteFile(folder / "pred.json", "{}");
  const auto bring_back = [&] {
    return BringBack(folder / "film/manifest.json", folder / "tracked", folder / "object_mask");
  };
  const Outcome back = bring_back();
  ASSERT_EQ(back.exit_code, 0) << back.err;
  EXPECT_THAT(back.err, HasSubstr("Masks of 7 of 7 photos"));
  const std::vector<std::string> masks = FilesBelow(folder / "object_mask");
  EXPECT_THAT(masks, SizeIs(8));
  for (const std::string& name : masks) {
    if (name == "pred.json") continue;
    EXPECT_EQ(ReadFile(folder / "object_mask" / name), ReadFile(kTabletop / "object_mask" / name))
        << name;
  }
  EXPECT_EQ(ReadFile(folder / "object_mask" / "pred.json"), "{}");

  // A mask that the tracker left out is said, all of them are an error.
  fs::remove(folder / "tracked" / manifest["frames"][0]["file"].get<std::string>());
  EXPECT_THAT(bring_back().err, HasSubstr("1 photos have no mask"));
  fs::remove_all(folder / "tracked");
  fs::create_directories(folder / "tracked");
  EXPECT_EQ(bring_back().exit_code, 1);
}

// Everything below a folder, by its name.
std::map<std::string, std::string> Everything(const fs::path& folder) {
  std::map<std::string, std::string> bytes;
  for (const std::string& name : FilesBelow(folder)) bytes[name] = ReadFile(folder / name);
  return bytes;
}

TEST(ViewInterpolator, PhotosThatDifferInTheirExtensionsKeepTheirMasks) {
  const TempFolder folder;
  WriteFile(folder / "manifest.json",
            R"({"version": 1, "frames": [{"file": "000000.png", "photo": "a/b.jpg"},
                                         {"file": "000001.png", "photo": "a/b.png"},
                                         {"file": "000002.png", "photo": "c.jpg"}]})");
  fs::create_directories(folder / "tracked");
  for (const char* file : {"000000.png", "000001.png", "000002.png"}) {
    WriteFile(folder / "tracked" / file, file);
  }
  const Outcome back =
      BringBack(folder / "manifest.json", folder / "tracked", folder / "object_mask");
  ASSERT_EQ(back.exit_code, 0) << back.err;
  EXPECT_EQ(Everything(folder / "object_mask"),
            (std::map<std::string, std::string>{{"a/b.jpg.png", "000000.png"},
                                                {"a/b.png.png", "000001.png"},
                                                {"c.jpg.png", "000002.png"}}));
  const MaskPairing pairing = PairMasks(folder / "object_mask", {"a/b.jpg", "a/b.png", "c.jpg"});
  EXPECT_THAT(pairing.masks,
              ElementsAre(folder / "object_mask/a/b.jpg.png",
                          folder / "object_mask/a/b.png.png",
                          folder / "object_mask/c.jpg.png"));
}

TEST(ViewInterpolator, MasksThatAreThereAreNotReplaced) {
  const TempFolder folder;
  WriteFile(folder / "manifest.json",
            R"({"version": 1, "frames": [{"file": "000000.png", "photo": "a.jpg"},
                                         {"file": "000001.png", "photo": "b.jpg"}]})");
  for (const char* name : {"tracked", "object_mask"}) fs::create_directories(folder / name);
  WriteFile(folder / "tracked/000000.png", "a");
  WriteFile(folder / "tracked/000001.png", "b");
  WriteFile(folder / "tracked/pred.json", "ids");
  const auto bring_back = [&] {
    return BringBack(folder / "manifest.json", folder / "tracked", folder / "object_mask");
  };
  for (const auto& [name, source] :
       {std::pair("b.png", "000001.png"), std::pair("pred.json", "pred.json")}) {
    const fs::path mine = folder / "object_mask" / name;
    WriteFile(mine, "painted by hand");
    const Outcome outcome = bring_back();
    ExpectRefused(
        outcome,
        {mine.string(), {(folder / "tracked" / source).string(), "output_path"}, "would be lost"});
    EXPECT_EQ(Everything(folder / "object_mask"),
              (std::map<std::string, std::string>{{name, "painted by hand"}}));
    fs::remove(mine);
  }
  // The same again is no loss, and other masks stay beside them.
  WriteFile(folder / "object_mask/c.png", "c");
  EXPECT_EQ(bring_back().exit_code, 0);
  EXPECT_EQ(bring_back().exit_code, 0);
  EXPECT_EQ(Everything(folder / "object_mask"),
            (std::map<std::string, std::string>{
                {"a.png", "a"}, {"b.png", "b"}, {"c.png", "c"}, {"pred.json", "ids"}}));
}

TEST(ViewInterpolator, AFilmReplacesNothingButAFilm) {
  const TempFolder folder;
  const std::string foam = MakeFoam(folder);
  const fs::path film = folder / "film";
  const auto expect_refusal = [&](const std::string& file, const std::string& kind) {
    const std::map<std::string, std::string> before = Everything(film);
    const Outcome outcome = MakeFilm(foam, film, "0");
    ExpectRefused(outcome, {(film / file).string(), {"output_path"}, kind});
    EXPECT_TRUE(Everything(film) == before) << file;
    fs::remove(film / file);
  };
  fs::create_directories(film / "frames");
  WriteFile(film / "manifest.json", R"({"name": "a web app"})");
  expect_refusal("manifest.json", "not written by view_interpolator and would be lost");
  fs::copy(kTabletop / "object_mask/0000.png", film / "frames/000003.png");
  expect_refusal("frames/000003.png",
                 "is no frame that view_interpolator wrote, and would be lost");
  fs::copy(kTabletop / "images/0000.jpg", film / "frames/0000.jpg");
  expect_refusal("frames/0000.jpg", "would be taken for one by a tracker");

  // A film takes the place of a longer one, of which nothing is left.
  ASSERT_EQ(MakeFilm(foam, film, "1").exit_code, 0);
  EXPECT_GE(FilesBelow(film).size(), 7 + 6 + 1);
  const Outcome shorter = MakeFilm(foam, film, "0");
  ASSERT_EQ(shorter.exit_code, 0) << shorter.err;
  EXPECT_THAT(shorter.err, HasSubstr("frames of the film that was here before"));
  const std::map<std::string, std::string> alone = Everything(film);
  EXPECT_THAT(alone, SizeIs(7 + 1));
  EXPECT_THAT(json::parse(alone.at("manifest.json"))["frames"], SizeIs(7));
  // So does one whose making was broken off before its manifest.
  fs::remove(film / "manifest.json");
  EXPECT_EQ(MakeFilm(foam, film, "0").exit_code, 0);
  EXPECT_TRUE(Everything(film) == alone);
}

TEST(ViewInterpolator, SaysWhatIsWrong) {
  const TempFolder folder;
  const std::string out = (folder / "out").string();
  WriteFile(folder / "bad.json", "{}");
  WriteFile(folder / "leaves.json",
            R"({"version": 1, "frames": [{"file": "0.png", "photo": "../../x.jpg"}]})");
  WriteFile(folder / "enters.json",
            R"({"version": 1, "frames": [{"file": "../0.png", "photo": "x.jpg"}]})");
  WriteFile(folder / "twice.json",
            R"({"version": 1, "frames": [{"file": "0.png", "photo": "x.jpg"},
                                         {"file": "1.png", "photo": "x.jpg"}]})");
  fs::create_directories(folder / "masks");
  const std::string masks = (folder / "masks").string();
  const auto at = [&](const char* file) { return (folder / file).string(); };
  const Mistake no_task = {"", {"foam_path", "manifest_path", "mask_path"}, "to make a film"};
  ExpectEachRefused(
      {"view_interpolator", "--output_path", out},
      {
          {{}, no_task},
          {{"--foam_path", "a", "--manifest_path", "b", "--mask_path", "c"}, no_task},
          {{"--manifest_path", "b"}, no_task},
          {{"--foam_path", "a", "--between", "101"}, {"", {"between", "101"}, "0 to 100"}},
          {{"--foam_path", "a", "--order", "random"}, {"", {"order", "'random'"}, "is invalid"}},
          {{"--manifest_path", at("bad.json"), "--mask_path", masks},
           {at("bad.json"), {}, "is no manifest"}},
          {{"--manifest_path", at("leaves.json"), "--mask_path", masks},
           {at("leaves.json"), {"../../x.jpg"}, "outside of its folder"}},
          {{"--manifest_path", at("enters.json"), "--mask_path", masks},
           {at("enters.json"), {"../0.png"}, "outside of its folder"}},
          {{"--manifest_path", at("twice.json"), "--mask_path", masks},
           {at("twice.json"), {"x.jpg"}, "twice"}},
      },
      out);
  EXPECT_FALSE(fs::exists(out));
}

}  // namespace
}  // namespace semfoam
