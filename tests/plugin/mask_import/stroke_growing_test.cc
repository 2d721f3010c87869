// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask_import/stroke_growing.h"

#include "foam/util/json_file.h"
#include "foam/util/parallel.h"
#include "plugin/mask/mask_png.h"
#include "plugin/mask/mask_tables.h"
#include "plugin/mask_import/mask_import.h"
#include "plugin/mask_import/superpixels.h"

#include <array>
#include <set>

#include "tests/mistake.h"
#include "tests/plugin/mask_import/clicks.h"
#include "tests/plugin/test_util.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using Rgb = std::array<uint8_t, 3>;

constexpr PhotoSize kSize = {160, 120};
constexpr Rgb kGrey = {150, 150, 145}, kRed = {190, 40, 30}, kBlue = {40, 60, 190},
              kGreen = {30, 160, 60};
// What is where in ColoredPhoto.
enum Thing { kWall = 1, kBook = 2, kBall = 3, kLeaf = 4 };

// A photo with noise, and what it shows.
struct ColoredPhoto {
  LabelImage truth{kSize.width, kSize.height, std::vector<int32_t>(160 * 120, kWall)};
  std::vector<uint8_t> rgb;

  ColoredPhoto() {
    for (int i = 0; i < kSize.width * kSize.height; ++i) Add(kGrey);
  }
  void Rectangle(int x0, int y0, int x1, int y1, int thing, const Rgb& color) {
    for (int y = y0; y < y1; ++y) {
      for (int x = x0; x < x1; ++x) Set(x, y, thing, color);
    }
  }
  void Disc(int x0, int y0, int radius, int thing, const Rgb& color) {
    for (int y = y0 - radius; y <= y0 + radius; ++y) {
      for (int x = x0 - radius; x <= x0 + radius; ++x) {
        if ((x - x0) * (x - x0) + (y - y0) * (y - y0) <= radius * radius) Set(x, y, thing, color);
      }
    }
  }
  void Write(const fs::path& file) const {
    std::vector<uint8_t> noisy = rgb;
    uint32_t state = 1;
    for (uint8_t& value : noisy) {
      state = state * 1664525u + 1013904223u;
      value = static_cast<uint8_t>(value + (state >> 24) % 13);
    }
    WritePng(file, kSize.width, kSize.height, 8, PNG_COLOR_TYPE_RGB, noisy);
  }

 private:
  void Add(const Rgb& color) { rgb.insert(rgb.end(), color.begin(), color.end()); }
  void Set(int x, int y, int thing, const Rgb& color) {
    const size_t i = static_cast<size_t>(y) * kSize.width + x;
    truth.data[i] = thing;
    std::copy(color.begin(), color.end(), rgb.begin() + 3 * static_cast<ptrdiff_t>(i));
  }
};

// A red book and a blue ball before a grey wall.
ColoredPhoto Room() {
  ColoredPhoto room;
  room.Rectangle(15, 20, 60, 70, kBook, kRed);
  room.Disc(110, 70, 25, kBall, kBlue);
  return room;
}

Mark Point(int id, double x, double y) { return {id, {{x, y}}, false}; }

MarkedPhoto Marked(const fs::path& file, std::vector<Mark> marks) {
  return {file, kSize, std::move(marks), {}};
}

// Intersection over union of a thing.
double Iou(const LabelImage& mask, const LabelImage& truth, int thing) {
  double both = 0, either = 0;
  for (size_t i = 0; i < truth.data.size(); ++i) {
    both += mask.data[i] == thing && truth.data[i] == thing;
    either += mask.data[i] == thing || truth.data[i] == thing;
  }
  return either > 0 ? both / either : 0;
}

double ShareOf(const LabelImage& mask, int x0, int y0, int x1, int y1, int id) {
  int count = 0;
  for (int y = y0; y < y1; ++y) {
    for (int x = x0; x < x1; ++x) count += mask.data[y * mask.width + x] == id;
  }
  return static_cast<double>(count) / ((x1 - x0) * (y1 - y0));
}

TEST(Superpixels, AreConnectedAndKeepToColors) {
  const ColoredPhoto room = Room();
  const Superpixels superpixels = DivideIntoSuperpixels({kSize.width, kSize.height, room.rgb}, 8);
  ASSERT_EQ(superpixels.of_pixel.size(), room.truth.data.size());
  std::vector<int> areas(superpixels.areas.size()), first(superpixels.areas.size(), -1);
  int mixed = 0;
  for (size_t i = 0; i < superpixels.of_pixel.size(); ++i) {
    const int32_t k = superpixels.of_pixel[i];
    ASSERT_GE(k, 0);
    ASSERT_LT(k, static_cast<int32_t>(areas.size()));
    ++areas[k];
    if (first[k] < 0) first[k] = room.truth.data[i];
    mixed += first[k] != room.truth.data[i];
  }
  EXPECT_THAT(superpixels.areas, testing::ElementsAreArray(areas));
  EXPECT_LT(mixed, 100);
  EXPECT_GT(areas.size(), 150u);
  EXPECT_LT(areas.size(), 1000u);
  // CIELAB of kRed, by OpenCV.
  const Eigen::Vector3f red = superpixels.colors[superpixels.of_pixel[40 * kSize.width + 40]];
  EXPECT_NEAR(red.x(), 42.03, 0.1);
  EXPECT_NEAR(red.y(), 57.63, 0.1);
  EXPECT_NEAR(red.z(), 43.39, 0.1);
  for (const SuperpixelBorder& border : superpixels.borders) {
    EXPECT_LT(border.a, border.b);
    EXPECT_GT(border.length, 0);
  }
}

TEST(StrokeGrowing, GrowsPointsToTheThings) {
  const TempFolder temp;
  const ColoredPhoto room = Room();
  room.Write(temp / "a.png");
  const std::vector<LabelImage> masks = GrowMarks({Marked(
      temp / "a.png", {Point(kWall, 80, 10), Point(kBook, 30, 40), Point(kBall, 105, 75)})});
  ASSERT_EQ(masks.size(), 1u);
  EXPECT_EQ(masks[0].width, kSize.width);
  EXPECT_EQ(masks[0].height, kSize.height);
  for (const int thing : {kWall, kBook, kBall}) {
    EXPECT_GT(Iou(masks[0], room.truth, thing), 0.93) << thing;
  }
}

TEST(StrokeGrowing, DoesNotDependOnTheThreads) {
  const TempFolder temp;
  std::vector<MarkedPhoto> photos;
  for (int i = 0; i < 4; ++i) {
    ColoredPhoto room = Room();
    room.Rectangle(70, 10 * i, 85, 10 * i + 30, kLeaf, kGreen);
    const fs::path file = temp / (std::to_string(i) + ".png");
    room.Write(file);
    photos.push_back(
        Marked(file, {Point(kWall, 5, 110), Point(kBook, 30, 40), Point(kBall, 105, 75)}));
    if (i == 2) photos.back().marks.push_back(Point(kLeaf, 75, 10 * i + 15));
  }
  std::vector<std::vector<int32_t>> results;
  for (const int threads : {1, 2, 5}) {
    const ThreadLimit limit(threads);
    std::vector<int32_t>& all = results.emplace_back();
    for (const LabelImage& mask : GrowMarks(photos)) {
      all.insert(all.end(), mask.data.begin(), mask.data.end());
    }
  }
  EXPECT_EQ(results[0], results[1]);
  EXPECT_EQ(results[0], results[2]);
}

TEST(StrokeGrowing, LeavesUnknownThingsUnlabelled) {
  const TempFolder temp;
  ColoredPhoto room = Room();
  room.Rectangle(100, 5, 140, 30, kLeaf, kGreen);
  room.Write(temp / "a.png");
  const LabelImage mask = GrowMarks({Marked(temp / "a.png", {Point(kBook, 30, 40)})})[0];
  EXPECT_GT(Iou(mask, room.truth, kBook), 0.9);
  EXPECT_GT(ShareOf(mask, 100, 5, 140, 30, 0), 0.9);
  EXPECT_GT(ShareOf(mask, 95, 55, 125, 85, 0), 0.9);
}

TEST(StrokeGrowing, LearnsColorsFromOtherPhotos) {
  const TempFolder temp;
  // A ball on a red foot; the second photo is marked on one of them.
  ColoredPhoto room;
  room.Disc(80, 60, 30, kBall, kBlue);
  room.Rectangle(50, 61, 110, 100, kBall, kRed);
  room.Write(temp / "a.png");
  room.Write(temp / "b.png");
  const MarkedPhoto a =
      Marked(temp / "a.png", {Point(kWall, 20, 20), Point(kBall, 80, 45), Point(kBall, 80, 80)});
  const MarkedPhoto b = Marked(temp / "b.png", {Point(kWall, 20, 20), Point(kBall, 80, 45)});
  EXPECT_LT(ShareOf(GrowMarks({b})[0], 55, 66, 105, 95, kBall), 0.5);
  EXPECT_GT(ShareOf(GrowMarks({a, b})[1], 55, 66, 105, 95, kBall), 0.9);
}

TEST(StrokeGrowing, StaysInItsBox) {
  const TempFolder temp;
  ColoredPhoto room;
  room.Rectangle(20, 30, 120, 70, kBook, kRed);
  room.Write(temp / "a.png");
  const Mark box = {kBook, {{70, 75}, {15, 25}}, true};
  for (const bool has_point : {true, false}) {
    std::vector<Mark> marks = {box, Point(kWall, 80, 110)};
    if (has_point) marks.push_back(Point(kBook, 30, 50));
    const LabelImage mask = GrowMarks({Marked(temp / "a.png", marks)})[0];
    EXPECT_GT(ShareOf(mask, 25, 35, 65, 65, kBook), 0.9) << has_point;
    EXPECT_EQ(ShareOf(mask, 78, 30, 120, 70, kBook), 0) << has_point;
  }
}

TEST(StrokeGrowing, FollowsLinesAndKeepsWhatIsKnown) {
  const TempFolder temp;
  ColoredPhoto room;
  // Three stripes of a thing, which one line crosses.
  room.Rectangle(20, 20, 50, 100, kBook, kRed);
  room.Rectangle(50, 20, 80, 100, kBook, kGreen);
  room.Rectangle(80, 20, 110, 100, kBook, kBlue);
  room.Write(temp / "a.png");
  MarkedPhoto photo = Marked(
      temp / "a.png", {{kBook, {{30, 60}, {60, 50}, {100, 60}}, false}, Point(kWall, 140, 60)});
  EXPECT_GT(Iou(GrowMarks({photo})[0], room.truth, kBook), 0.9);
  // Half of the first stripe is known as another thing, to the pixel.
  photo.known = {kSize.width, kSize.height, std::vector<int32_t>(160 * 120)};
  for (int y = 20; y < 60; ++y) {
    for (int x = 20; x < 50; ++x) photo.known.data[y * kSize.width + x] = kLeaf;
  }
  EXPECT_EQ(ShareOf(GrowMarks({photo})[0], 20, 20, 50, 60, kLeaf), 1);
}

TEST(StrokeGrowing, TakesMarksAnywhereAndSmallPhotos) {
  const TempFolder temp;
  for (const PhotoSize size : {PhotoSize{1, 1}, PhotoSize{3, 700}, PhotoSize{700, 3}}) {
    WritePng(temp / "a.png",
             size.width,
             size.height,
             8,
             PNG_COLOR_TYPE_RGB,
             std::vector<uint8_t>(size_t{3} * size.width * size.height, 90));
    const Mark line = {1, {{-1e300, 2}, {1e300, -1e308}, {0, 1}}, false};
    const Mark box = {2, {{-1e308, -1e308}, {1e308, 1e308}}, true};
    const Mark flat_box = {3, {{1, 1}, {1, 1}}, true};
    const std::vector<LabelImage> masks =
        GrowMarks({{temp / "a.png", size, {line, box, flat_box}, {}}});
    EXPECT_EQ(masks[0].data.size(), static_cast<size_t>(masks[0].width) * masks[0].height);
    EXPECT_LE(masks[0].width, kGrownSide);
    EXPECT_LE(masks[0].height, kGrownSide);
  }
}

// Exact masks of a photo of the table scene, held out for scores.
LabelImage ExactMask(const fs::path& scene,
                     const std::string& stem,
                     const std::set<std::string>& names) {
  LabelImage exact;
  int id = 0;
  for (const std::string& name : names) {
    ++id;
    const fs::path file = scene / "segmentation_labels/masks" / name / (stem + ".png");
    if (!fs::exists(file)) continue;
    const MaskPng mask = ReadMaskPng(file);
    exact.width = mask.width;
    exact.height = mask.height;
    exact.data.resize(mask.values.size(), 0);
    for (size_t i = 0; i < mask.values.size(); ++i) {
      if (mask.values[i] != 0) exact.data[i] = id;
    }
  }
  return exact;
}

// Three clicks a thing on three photos. As measured: 79 % of the pixels get a label, and 96 % of
// these the right one.
TEST(StrokeGrowing, GrowsThreeClicksOnTheTable) {
  const fs::path scene = fs::path(SEMFOAM_TEST_DATA) / "tabletop";
  std::set<std::string> names;
  for (const auto& entry : fs::directory_iterator(scene / "segmentation_labels/masks")) {
    names.insert(entry.path().filename().string());
  }
  ASSERT_EQ(names.size(), 13u);
  std::vector<MarkedPhoto> photos;
  std::vector<LabelImage> exact;
  for (const std::string stem : {"0008", "0024", "0048"}) {
    const LabelImage& mask = exact.emplace_back(ExactMask(scene, stem, names));
    MarkedPhoto photo = {scene / "images" / (stem + ".jpg"), {mask.width, mask.height}, {}, {}};
    for (int id = 1; id <= 13; ++id) {
      for (const PolygonPoint& click : ClicksOn(mask, id, 3)) {
        photo.marks.push_back({id, {click}, false});
      }
    }
    photos.push_back(std::move(photo));
  }
  const std::vector<LabelImage> grown = GrowMarks(photos);
  double labelled = 0, right = 0, pixels = 0;
  for (size_t i = 0; i < grown.size(); ++i) {
    ASSERT_EQ(grown[i].data.size(), exact[i].data.size());
    for (size_t k = 0; k < grown[i].data.size(); ++k) {
      labelled += grown[i].data[k] != 0;
      right += grown[i].data[k] != 0 && grown[i].data[k] == exact[i].data[k];
      pixels += 1;
    }
  }
  EXPECT_GT(labelled / pixels, 0.75);
  EXPECT_GT(right / labelled, 0.93);
  RecordProperty("labelled", std::to_string(labelled / pixels));
  RecordProperty("right", std::to_string(right / labelled));
  for (int id = 1; id <= 13; ++id) {
    double both = 0, either = 0;
    for (size_t i = 0; i < grown.size(); ++i) {
      for (size_t k = 0; k < grown[i].data.size(); ++k) {
        both += grown[i].data[k] == id && exact[i].data[k] == id;
        either += grown[i].data[k] == id || exact[i].data[k] == id;
      }
    }
    EXPECT_GT(both / either, 0.2) << *std::next(names.begin(), id - 1);
  }
}

Json Shape(const char* label, const char* type, const Json& points) {
  return {{"label", label}, {"shape_type", type}, {"points", points}, {"group_id", nullptr}};
}

Json LabelMe(const std::string& photo, const Json& shapes) {
  return {{"version", "5.4.1"},
          {"shapes", shapes},
          {"imagePath", photo},
          {"imageData", nullptr},
          {"imageWidth", kSize.width},
          {"imageHeight", kSize.height}};
}

TEST(StrokeImport, GrowsLabelMesStrokes) {
  const TempFolder temp;
  const ColoredPhoto room = Room();
  for (const char* name : {"a.png", "b.png", "c.png"}) room.Write(temp / "photos" / name);
  WriteFile(temp / "strokes/a.json",
            LabelMe("a.png",
                    {Shape("wall", "point", Json::array({{80, 10}})),
                     Shape("wall", "linestrip", {{5, 115}, {60, 110}, {150, 115}}),
                     Shape("book", "point", Json::array({{30, 40}})),
                     Shape("book", "line", {{20, 30}, {50, 60}}),
                     Shape("ball", "rectangle", {{84, 44}, {136, 96}})})
                .dump());
  // A photo of areas alone is a mask.
  WriteFile(
      temp / "strokes/b.json",
      LabelMe("b.png", Json::array({Shape("book", "rectangle", {{15, 20}, {60, 70}})})).dump());
  const fs::path out = temp / "out";
  fs::create_directories(out);
  const std::vector<std::string> names = PhotoNames(temp / "photos");
  const MaskImport import = ImportMasks(
      RecognizeMasks(temp / "strokes", names), temp / "photos", names, SameName::kObjects, out);
  EXPECT_EQ(import.num_masks, 2);
  EXPECT_EQ(import.num_grown, 1);
  EXPECT_GT(import.grown_share, 0.9);
  EXPECT_THAT(import.warnings, testing::IsEmpty());
  EXPECT_THAT(import.left_out, testing::IsEmpty());
  EXPECT_THAT(DescribeImport(import)[1], testing::HasSubstr("grown from strokes"));
  ASSERT_EQ(import.labels.size(), 3u);
  EXPECT_EQ(import.labels[0].name, "wall");
  EXPECT_EQ(import.labels[1].name, "book");
  EXPECT_EQ(import.labels[1].num_photos, 2);
  EXPECT_EQ(import.labels[2].name, "ball");
  const MaskPng mask = ReadMaskPng(out / "a.png");
  const LabelImage grown = {mask.width, mask.height, {mask.values.begin(), mask.values.end()}};
  for (const int thing : {kWall, kBook, kBall}) {
    EXPECT_GT(Iou(grown, room.truth, thing), 0.9) << thing;
  }
  const MaskPng area = ReadMaskPng(out / "b.png");
  const LabelImage filled = {area.width, area.height, {area.values.begin(), area.values.end()}};
  EXPECT_EQ(Iou(filled, room.truth, kBook), 1);
  // What is not clear is not "nothing".
  EXPECT_TRUE(SaysZeroIsUnlabelled(out));
}

// As the page of report_writer saves them.
TEST(StrokeImport, ReadsSeveralPhotosOfOneFile) {
  const TempFolder temp;
  const ColoredPhoto room = Room();
  for (const char* name : {"a.png", "b.png"}) room.Write(temp / "photos" / name);
  const Json a = LabelMe("a.png",
                         {Shape("wall", "point", Json::array({{80, 10}})),
                          Shape("book", "point", Json::array({{30, 40}}))}),
             b = LabelMe("b.png",
                         {Shape("book", "polygon", {{20, 30}, {50, 30}, {40, 60}}),
                          Shape("book", "point", Json::array({{35, 40}})),
                          Shape("ball", "point", Json::array({{110, 70}}))});
  WriteFile(temp / "marks.json", Json::array({a, b}).dump());
  WriteFile(temp / "apart/a.json", a.dump());
  WriteFile(temp / "apart/b.json", b.dump());
  const std::vector<std::string> names = PhotoNames(temp / "photos");
  const auto import = [&](const char* from, const char* to) {
    fs::create_directories(temp / to);
    return ImportMasks(
        RecognizeMasks(temp / from, names), temp / "photos", names, SameName::kObjects, temp / to);
  };
  const MaskImport together = import("marks.json", "one"), apart = import("apart", "two");
  EXPECT_EQ(together.num_grown, 2);
  ASSERT_EQ(together.labels.size(), 3u);
  for (size_t k = 0; k < 3; ++k) EXPECT_EQ(together.labels[k].name, apart.labels[k].name);
  for (const char* name : {"a.png", "b.png"}) {
    EXPECT_EQ(ReadMaskPng(temp / "one" / name).values, ReadMaskPng(temp / "two" / name).values);
  }
  const auto refused = [&](const Json& list) {
    WriteFile(temp / "marks.json", list.dump());
    return UserErrorOf([&] { import("marks.json", "refused"); });
  };
  Json unnamed = b;
  unnamed.erase("imagePath");
  EXPECT_THAT(refused(Json::array({a, unnamed})),
              NamesMistake("marks.json", {"[1]", "\"imagePath\""}, "has no"));
  EXPECT_THAT(refused(Json::array({a, 7})), NamesMistake("marks.json", {"[1]", "7"}, "shapes"));
}

TEST(StrokeImport, RefusesDamagedStrokes) {
  const TempFolder temp;
  Room().Write(temp / "photos/a.png");
  const std::vector<std::string> names = PhotoNames(temp / "photos");
  const auto refused = [&](const Json& labelme) {
    WriteFile(temp / "strokes/a.json", labelme.dump());
    fs::create_directories(temp / "out");
    const std::string sentence = UserErrorOf([&] {
      ImportMasks(RecognizeMasks(temp / "strokes", names),
                  temp / "photos",
                  names,
                  SameName::kObjects,
                  temp / "out");
    });
    EXPECT_TRUE(FilesBelow(temp / "out").empty());
    return sentence;
  };
  const Json point = Shape("wall", "point", Json::array({{80, 10}}));
  EXPECT_THAT(refused(LabelMe("a.png", Json::array({Shape("wall", "point", Json::array())}))),
              NamesMistake("strokes/a.json", {"shapes[0].points"}, "at least one point"));
  EXPECT_THAT(refused(LabelMe("a.png", {point, Shape("b", "rectangle", {{1, 2}, {3, 4}, {5, 6}})})),
              NamesMistake("strokes/a.json", {"shapes[1].points"}, "opposite corners"));
  EXPECT_THAT(refused(LabelMe("a.png", {point, Shape("", "line", {{1, 2}, {3, 4}})})),
              NamesMistake("strokes/a.json", {"shapes[1].label"}, "a name"));
  Json wide = LabelMe("a.png", Json::array({point}));
  wide["imageWidth"] = 320;
  EXPECT_THAT(refused(wide), NamesMistake("strokes/a.json", {"320 x 120"}, "the same shape"));
  WriteFile(temp / "photos/a.png", ReadFile(temp / "photos/a.png").substr(0, 2000));
  EXPECT_THAT(refused(LabelMe("a.png", Json::array({point}))),
              NamesMistake("photos/a.png", {}, "decoded"));
}

}  // namespace
}  // namespace semfoam
