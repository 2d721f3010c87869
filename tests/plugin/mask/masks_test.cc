// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask/label_naming.h"
#include "plugin/mask/mask_classes.h"
#include "plugin/mask/mask_decoding.h"
#include "plugin/mask/mask_pairing.h"
#include "plugin/mask/mask_png.h"

#include <string>

#include "tests/plugin/test_util.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

// A 4 x 2 mask of 8-bit grey ids.
void WriteGrey(const fs::path& path, const std::vector<uint8_t>& ids) {
  WritePng(path, 4, 2, 8, PNG_COLOR_TYPE_GRAY, ids);
}

std::vector<int32_t> ClassesOf(const ClassImage& image, size_t pixels) {
  std::vector<int32_t> classes;
  for (size_t i = 0; i < pixels; ++i) classes.push_back(image[i]);
  return classes;
}

struct LoadedMasks {
  std::vector<Label> labels;
  std::vector<ClassImage> classes;  // one per photo; empty without a mask
};

std::vector<int32_t> IdsOf(const LoadedMasks& set) {
  std::vector<int32_t> ids;
  for (const Label& label : set.labels) ids.push_back(label.id);
  return ids;
}

std::vector<uint32_t> SourceIdsOf(const LoadedMasks& set) {
  std::vector<uint32_t> ids;
  for (const Label& label : set.labels) ids.push_back(label.source_id);
  return ids;
}

// The masks of a folder for photos of one size.
LoadedMasks Load(const fs::path& folder,
                 const std::vector<std::string>& photos,
                 LabelZero label_zero = LabelZero::kIgnore,
                 const PhotoSize& size = {4, 2}) {
  const MaskPairing pairing = PairMasks(folder, photos);
  std::vector<DecodedMask> masks(photos.size());
  std::vector<MaskContents> contents(photos.size());
  for (size_t i = 0; i < photos.size(); ++i) {
    if (pairing.masks[i].empty()) continue;
    masks[i] = DecodeMask(pairing.masks[i], size);
    contents[i] = masks[i].contents;
  }
  const MaskClasses numbered = NumberMasks(contents, pairing, folder, label_zero);
  LoadedMasks loaded{numbered.labels, std::vector<ClassImage>(photos.size())};
  for (size_t i = 0; i < photos.size(); ++i) {
    if (pairing.masks[i].empty()) continue;
    loaded.classes[i] = ClassesOf(
        masks[i].indices, numbered.Of(contents[i]), static_cast<int>(loaded.labels.size()));
  }
  return loaded;
}

TEST(MasksPairing, FindsEachKindOfName) {
  TempFolder temp;
  const std::vector<uint8_t> ids(8, 1);
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"full.jpg", "full.jpg.png"},
      {"stem.jpg", "stem.png"},
      {"two.dots.jpg", "two.dots.png"},
      {"first.dot.jpg", "first.png"},
      {"deva.jpeg", "deva..png"},
      {"sub/folder/a.jpg", "sub/folder/a.png"},
      {"upper.JPG", "upper.PNG"},
      {"./plain.png", "plain.png"},
      {"left/same.jpg", "left/same.png"},
      {"right/same.jpg", "right/same.png"}};
  std::vector<std::string> photos;
  for (const auto& [photo, mask] : cases) {
    WriteGrey(temp / mask, ids);
    photos.push_back(photo);
  }
  photos.push_back("without.jpg");
  WriteGrey(temp / "nobody.png", ids);
  WriteGrey(temp / ".hidden.png", ids);
  WriteFile(temp / "notes.txt", "no mask");
  const MaskPairing pairing = PairMasks(temp.path(), photos);
  ASSERT_EQ(pairing.masks.size(), photos.size());
  for (size_t i = 0; i < cases.size(); ++i) {
    EXPECT_EQ(pairing.masks[i], temp / cases[i].second) << cases[i].first;
  }
  EXPECT_TRUE(pairing.masks.back().empty());
  EXPECT_EQ(pairing.NumPaired(), static_cast<int>(cases.size()));
  EXPECT_THAT(pairing.unused, ElementsAre(temp / "nobody.png"));
}

TEST(MasksPairing, TheFullestNameWinsAndTheOthersAreUnused) {
  TempFolder temp;
  for (const char* name : {"a.b.jpg.png", "a.b.png", "a.png"}) {
    WriteGrey(temp / name, std::vector<uint8_t>(8, 1));
  }
  const MaskPairing pairing = PairMasks(temp.path(), {"a.b.jpg"});
  EXPECT_EQ(pairing.masks[0], temp / "a.b.jpg.png");
  EXPECT_EQ(pairing.unused.size(), 2u);
}

TEST(MasksPairing, FindsMasksByTheNamesThatTheyAreGiven) {
  EXPECT_THAT(NamesForMasks({"a.jpg", "sub/a.jpg", "two.dots.jpg", "two.jpg", "./deva.jpeg"}),
              ElementsAre("a.png", "sub/a.png", "two.dots.png", "two.png", "deva.png"));
  // Sets in which a photo would have another one's mask, and one without it.
  for (const std::vector<std::string>& photos :
       {std::vector<std::string>{"a.jpg", "a.png", "sub/b.jpg"},
        {"a.jpg", "a.jpg.jpg"},
        {"a.jpg", "a.JPG", "a.b.jpg"},
        {"a.b.jpg", "a.jpg", "c.png"}}) {
    TempFolder temp;
    const std::vector<std::string> names = NamesForMasks(photos);
    ASSERT_EQ(names.size(), photos.size());
    for (const std::string& name : names) WriteGrey(temp / name, std::vector<uint8_t>(8, 1));
    const MaskPairing pairing = PairMasks(temp.path(), photos);
    for (size_t i = 0; i < photos.size(); ++i) {
      EXPECT_EQ(pairing.masks[i], temp / names[i]) << photos[i];
    }
  }
  EXPECT_THAT(NamesForMasks({"a/b.jpg", "a/b.png"}), ElementsAre("a/b.jpg.png", "a/b.png.png"));
}

TEST(MasksPairing, NeverGuesses) {
  TempFolder temp;
  EXPECT_THAT(UserErrorOf([&] { PairMasks(temp / "none", {"a.jpg"}); }),
              HasSubstr("none: there is no such folder"));
  EXPECT_EQ(PairMasks(temp.path(), {"a.jpg"}).NumPaired(), 0);
  WriteGrey(temp / "0001.png", std::vector<uint8_t>(8, 1));
  // As many masks as photos, in the same order, but of other names.
  EXPECT_THAT(UserErrorOf([&] { PairMasks(temp.path(), {"IMG_1.jpg"}); }),
              HasSubstr("none of the 1 masks has the name of a photo; IMG_1.png would be right"));
  WriteGrey(temp / "scan.png", std::vector<uint8_t>(8, 1));
  EXPECT_THAT(UserErrorOf([&] {
                PairMasks(temp.path(), {"scan.1.jpg", "scan.2.jpg"});
              }),
              HasSubstr("scan.png: is by its name the mask of both scan.1.jpg and scan.2.jpg"));
}

TEST(MasksPairing, FollowsLinksToFoldersButNotForEver) {
  TempFolder temp;
  WriteGrey(temp / "elsewhere/a.png", std::vector<uint8_t>(8, 1));
  fs::create_directories(temp / "masks/.hidden");
  fs::create_directory_symlink(temp / "elsewhere", temp / "masks/left");
  fs::create_directory_symlink("..", temp / "elsewhere/loop");
  fs::create_symlink("nothing", temp / "masks/broken.png");
  WriteGrey(temp / "masks/.hidden/b.png", std::vector<uint8_t>(8, 1));
  const MaskPairing pairing = PairMasks(temp / "masks", {"left/a.jpg", ".hidden/b.jpg"});
  EXPECT_EQ(pairing.masks[0], temp / "masks/left/a.png");
  EXPECT_TRUE(pairing.masks[1].empty());
}

TEST(MasksPng, ReadsEveryGreyDepthUnstretched) {
  TempFolder temp;
  const fs::path path = temp / "m.png";
  for (const bool interlaced : {false, true}) {
    WritePng(path, 5, 1, 1, PNG_COLOR_TYPE_GRAY, {0b10110000}, interlaced);
    EXPECT_THAT(ReadMaskPng(path).values, ElementsAre(1, 0, 1, 1, 0));
    WritePng(path, 5, 1, 2, PNG_COLOR_TYPE_GRAY, {0b00011011, 0b11000000}, interlaced);
    EXPECT_THAT(ReadMaskPng(path).values, ElementsAre(0, 1, 2, 3, 3));
    WritePng(path, 3, 2, 4, PNG_COLOR_TYPE_GRAY, {0x12, 0xf0, 0x34, 0x50}, interlaced);
    EXPECT_THAT(ReadMaskPng(path).values, ElementsAre(1, 2, 15, 3, 4, 5));
    WritePng(path, 3, 1, 8, PNG_COLOR_TYPE_GRAY, {0, 7, 255}, interlaced);
    EXPECT_THAT(ReadMaskPng(path).values, ElementsAre(0, 7, 255));
    WritePng(path, 2, 1, 16, PNG_COLOR_TYPE_GRAY, {0x01, 0x02, 0xff, 0xfe}, interlaced);
    EXPECT_THAT(ReadMaskPng(path).values, ElementsAre(0x0102, 0xfffe));
    WritePng(path, 2, 1, 8, PNG_COLOR_TYPE_GRAY_ALPHA, {9, 0, 8, 255}, interlaced);
    EXPECT_THAT(ReadMaskPng(path).values, ElementsAre(9, 8));
  }
}

TEST(MasksPng, ReadsPaletteIndicesNotColours) {
  TempFolder temp;
  const fs::path path = temp / "m.png";
  WritePng(path, 3, 1, 8, PNG_COLOR_TYPE_PALETTE, {0, 3, 250});
  EXPECT_THAT(ReadMaskPng(path).values, ElementsAre(0, 3, 250));
  EXPECT_FALSE(ReadMaskPng(path).is_rgb);
  WritePng(path, 3, 1, 4, PNG_COLOR_TYPE_PALETTE, {0x1f, 0x20});
  EXPECT_THAT(ReadMaskPng(path).values, ElementsAre(1, 15, 2));
  WritePng(path, 4, 1, 2, PNG_COLOR_TYPE_PALETTE, {0b00011011});
  EXPECT_THAT(ReadMaskPng(path).values, ElementsAre(0, 1, 2, 3));
  WritePng(path, 4, 1, 1, PNG_COLOR_TYPE_PALETTE, {0b01100000});
  EXPECT_THAT(ReadMaskPng(path).values, ElementsAre(0, 1, 1, 0));
}

TEST(MasksPng, ReadsLongIds) {
  TempFolder temp;
  const fs::path path = temp / "m.png";
  WritePng(path, 2, 1, 8, PNG_COLOR_TYPE_RGB, {1, 2, 3, 255, 255, 255});
  EXPECT_TRUE(ReadMaskPng(path).is_rgb);
  EXPECT_THAT(ReadMaskPng(path).values, ElementsAre(1 + 256 * 2 + 65536 * 3, 0xffffff));
  WritePng(path, 2, 1, 8, PNG_COLOR_TYPE_RGB_ALPHA, {1, 2, 3, 0, 0, 0, 0, 255});
  EXPECT_THAT(ReadMaskPng(path).values, ElementsAre(1 + 256 * 2 + 65536 * 3, 0));
  WritePng(path, 1, 1, 16, PNG_COLOR_TYPE_RGB, {0, 1, 0, 2, 0, 3});
  EXPECT_THAT(UserErrorOf([&] { ReadMaskPng(path); }), HasSubstr("holds 16-bit colours"));
}

TEST(MasksPng, DamageIsNamed) {
  TempFolder temp;
  const fs::path path = temp / "m.png";
  std::vector<uint8_t> ids(32 * 32);
  for (size_t i = 0; i < ids.size(); ++i) ids[i] = static_cast<uint8_t>(i * i);
  WritePng(path, 32, 32, 8, PNG_COLOR_TYPE_GRAY, ids);
  const std::string bytes = ReadFile(path);
  for (size_t size = 0; size < bytes.size(); ++size) {
    WriteFile(path, bytes.substr(0, size));
    ASSERT_THAT(UserErrorOf([&] { ReadMaskPng(path); }), testing::StartsWith(path.string() + ": "))
        << size;
  }
  for (size_t i = 0; i < bytes.size(); ++i) {
    std::string damaged = bytes;
    damaged[i] = static_cast<char>(damaged[i] ^ 0x10);
    WriteFile(path, damaged);
    ASSERT_NE(UserErrorOf([&] { ReadMaskPng(path); }), "") << i;
  }
  WriteFile(path, "\xff\xd8\xff\xe0 a JPEG by another name");
  EXPECT_THAT(UserErrorOf([&] { ReadMaskPng(path); }), HasSubstr("is no PNG file"));
  EXPECT_THAT(UserErrorOf([&] { ReadMaskPng(temp / "none.png"); }),
              HasSubstr("there is no such file"));
  EXPECT_THAT(UserErrorOf([&] { ReadMaskPng(temp.path()); }), HasSubstr("is a folder"));
}

// A PNG whose header is valid, checksum included, and promises far more than its bytes hold.
TEST(MasksPng, ImplausibleSizesTakeNoMemory) {
  TempFolder temp;
  const fs::path path = temp / "m.png";
  FILE* file = std::fopen(path.c_str(), "wb");
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(png);
  png_init_io(png, file);
  png_set_IHDR(png, info, 1'000'000, 1'000'000, 16, PNG_COLOR_TYPE_GRAY, 0, 0, 0);
  png_write_info(png, info);
  png_destroy_write_struct(&png, &info);
  const unsigned char kEnd[] = {0, 0, 0, 0, 'I', 'E', 'N', 'D', 0xae, 0x42, 0x60, 0x82};
  std::fwrite(kEnd, 1, sizeof(kEnd), file);
  std::fclose(file);
  EXPECT_NE(UserErrorOf([&] { ReadMaskPng(path); }), "");
}

TEST(Masks, IdsBecomeContiguousClassesOverTheWholeSet) {
  TempFolder temp;
  WriteGrey(temp / "a.png", {0, 0, 9, 9, 3, 3, 3, 0});
  WriteGrey(temp / "b.png", {200, 200, 200, 200, 9, 9, 9, 9});
  const LoadedMasks set = Load(temp.path(), {"a.jpg", "b.jpg", "c.jpg"});
  EXPECT_THAT(IdsOf(set), ElementsAre(3, 9, 200));
  EXPECT_THAT(SourceIdsOf(set), ElementsAre(3, 9, 200));
  EXPECT_THAT(ClassesOf(set.classes[0], 8), ElementsAre(-1, -1, 1, 1, 0, 0, 0, -1));
  EXPECT_THAT(ClassesOf(set.classes[1], 8), ElementsAre(2, 2, 2, 2, 1, 1, 1, 1));
  EXPECT_TRUE(set.classes[2].Empty());
}

TEST(Masks, ZeroCanBeAClass) {
  TempFolder temp;
  WriteGrey(temp / "a.png", {0, 0, 9, 9, 3, 3, 3, 0});
  const LoadedMasks set = Load(temp.path(), {"a.jpg"}, LabelZero::kClass);
  EXPECT_THAT(IdsOf(set), ElementsAre(0, 3, 9));
  EXPECT_THAT(ClassesOf(set.classes[0], 8), ElementsAre(0, 0, 2, 2, 1, 1, 1, 0));
}

TEST(Masks, ZeroIsAClassByItselfWhereItCoversAFifth) {
  TempFolder gap, background;
  WriteGrey(gap / "a.png", {9, 9, 9, 9, 3, 3, 3, 0});
  EXPECT_THAT(IdsOf(Load(gap.path(), {"a.jpg"}, LabelZero::kAuto)), ElementsAre(3, 9));
  WriteGrey(background / "a.png", {0, 0, 9, 9, 3, 3, 3, 3});
  EXPECT_THAT(IdsOf(Load(background.path(), {"a.jpg"}, LabelZero::kAuto)), ElementsAre(0, 3, 9));
}

TEST(Masks, EmptyMasksHaveNoClasses) {
  TempFolder temp;
  WriteGrey(temp / "a.png", std::vector<uint8_t>(8, 0));
  const LoadedMasks set = Load(temp.path(), {"a.jpg"});
  EXPECT_THAT(set.labels, IsEmpty());
  EXPECT_FALSE(set.classes[0].Empty());
  EXPECT_THAT(ClassesOf(set.classes[0], 8), testing::Each(kUnlabelled));
}

TEST(Masks, ManyClassesNeedTwoBytes) {
  TempFolder temp;
  std::vector<uint8_t> samples;
  for (int id = 0; id < 300; ++id) {
    samples.push_back(static_cast<uint8_t>(id >> 8));
    samples.push_back(static_cast<uint8_t>(id));
  }
  WritePng(temp / "a.png", 20, 15, 16, PNG_COLOR_TYPE_GRAY, samples);
  const LoadedMasks set = Load(temp.path(), {"a.jpg"}, LabelZero::kIgnore, {20, 15});
  ASSERT_EQ(set.labels.size(), 299u);
  EXPECT_EQ(set.classes[0][0], kUnlabelled);
  for (int id = 1; id < 300; ++id) EXPECT_EQ(set.classes[0][id], id - 1);
  EXPECT_EQ(ClassImage::BytesPerPixel(255), 1);
  EXPECT_EQ(ClassImage::BytesPerPixel(256), 2);
  // The last class of either width is told from none.
  for (const int classes : {255, 256, 65535}) {
    ClassImage image({2, 1}, classes);
    EXPECT_EQ(image[0], kUnlabelled);
    image.Set(0, classes - 1);
    EXPECT_EQ(image[0], classes - 1);
    image.Set(0, kUnlabelled);
    EXPECT_EQ(image[0], kUnlabelled);
  }
}

TEST(Masks, GreySavedAsRgbIsGrey) {
  TempFolder temp;
  WritePng(temp / "a.png", 2, 1, 8, PNG_COLOR_TYPE_RGB, {7, 7, 7, 0, 0, 0});
  const LoadedMasks set = Load(temp.path(), {"a.jpg"}, LabelZero::kIgnore, {2, 1});
  EXPECT_THAT(IdsOf(set), ElementsAre(7));
}

constexpr uint32_t kLongId = 0x654321;  // R 0x21, G 0x43, B 0x65
constexpr uint32_t kGreyLongId = 0x050505;

void WriteDeva(const TempFolder& temp) {
  WritePng(temp / "Annotations/a.png", 2, 1, 8, PNG_COLOR_TYPE_RGB, {0x21, 0x43, 0x65, 0, 0, 0});
  // A long id that happens to be grey, alone in its mask: the set says that these are long ids.
  WritePng(temp / "Annotations/b.png", 2, 1, 8, PNG_COLOR_TYPE_RGB, {5, 5, 5, 5, 5, 5});
}

LoadedMasks LoadDeva(const TempFolder& temp) {
  return Load(temp / "Annotations", {"a.jpg", "b.jpg"}, LabelZero::kIgnore, {2, 1});
}

std::string PredJson(const std::vector<uint32_t>& ids) {
  std::string segments;
  for (const uint32_t id : ids) {
    segments += std::string(segments.empty() ? "" : ", ") + R"({"category_id": null, "id": )" +
                std::to_string(id) + R"(, "score": 0.5, "area": 3})";
  }
  return R"({"annotations": [{"file_name": "a.jpg", "segments_info": [)" + segments + "]}]}";
}

TEST(Masks, DevasLongIdsAreNumberedAndKept) {
  TempFolder temp;
  WriteDeva(temp);
  const LoadedMasks set = LoadDeva(temp);
  EXPECT_THAT(IdsOf(set), ElementsAre(1, 2));
  EXPECT_THAT(SourceIdsOf(set), ElementsAre(kGreyLongId, kLongId));
  EXPECT_THAT(ClassesOf(set.classes[0], 2), ElementsAre(1, kUnlabelled));
  EXPECT_THAT(ClassesOf(set.classes[1], 2), ElementsAre(0, 0));
}

TEST(Masks, PredJsonKnowsTheIds) {
  TempFolder temp;
  WriteDeva(temp);
  WriteFile(temp / "pred.json", PredJson({kLongId, kGreyLongId, 999}));
  EXPECT_EQ(LoadDeva(temp).labels.size(), 2u);
  WriteFile(temp / "pred.json", PredJson({kGreyLongId}));
  const std::string message = UserErrorOf([&] { LoadDeva(temp); });
  EXPECT_THAT(message, HasSubstr("Annotations/a.png: has 1 colour that is no id in pred.json"));
  EXPECT_THAT(message, HasSubstr("not resampled"));
  // The file within the folder is nearer than the one beside it.
  WriteFile(temp / "Annotations/pred.json", PredJson({kLongId, kGreyLongId}));
  EXPECT_EQ(LoadDeva(temp).labels.size(), 2u);
  for (const char* bad : {"{",
                          "[]",
                          "{\"annotations\": 3}",
                          "{\"annotations\": [{}]}",
                          R"({"annotations": [{"segments_info": [{"id": -4}]}]})",
                          R"({"annotations": [{"segments_info": [{"id": "x"}]}]})",
                          R"({"annotations": [{"segments_info": [{"id": 16777216}]}]})"}) {
    WriteFile(temp / "Annotations/pred.json", bad);
    EXPECT_THAT(UserErrorOf([&] { LoadDeva(temp); }), HasSubstr("pred.json: ")) << bad;
  }
}

TEST(Masks, AnotherSizeIsReadAtPixelCentres) {
  TempFolder temp;
  WritePng(temp / "a.png", 2, 1, 8, PNG_COLOR_TYPE_GRAY, {1, 2});
  const LoadedMasks up = Load(temp.path(), {"a.jpg"}, LabelZero::kIgnore, {6, 3});
  EXPECT_THAT(ClassesOf(up.classes[0], 18),
              ElementsAre(0, 0, 0, 1, 1, 1, 0, 0, 0, 1, 1, 1, 0, 0, 0, 1, 1, 1));
  WritePng(temp / "a.png",
           6,
           3,
           8,
           PNG_COLOR_TYPE_GRAY,
           {1, 1, 1, 2, 2, 2, 3, 4, 3, 5, 6, 5, 1, 1, 1, 2, 2, 2});
  const LoadedMasks down = Load(temp.path(), {"a.jpg"}, LabelZero::kIgnore, {2, 1});
  EXPECT_EQ(down.labels[down.classes[0][0]].id, 4);
  EXPECT_EQ(down.labels[down.classes[0][1]].id, 6);
}

TEST(Masks, AnotherAspectIsNamedWithBothSizes) {
  TempFolder temp;
  WritePng(temp / "a.png", 48, 64, 8, PNG_COLOR_TYPE_GRAY, std::vector<uint8_t>(48 * 64, 1));
  const std::string message = UserErrorOf([&] {
    Load(temp.path(), {"a.jpg"}, LabelZero::kIgnore, {640, 480});
  });
  EXPECT_EQ(message,
            (temp / "a.png").string() +
                ": is 48 x 64 pixels and its photo 640 x 480; a mask of the photo's aspect would "
                "be right, made of the undistorted photo if COLMAP undistorted it.");
}

// Photos by COLMAP's image_undistorter, masks of the photos that it was given.
TEST(Masks, OfPhotosBeforeUndistortionAreCountedAndNamed) {
  MaskPairing pairing;
  pairing.masks = {"M/a.png", "", "M/c.png", "M/d.png"};
  const std::vector<PhotoSize> masks = {{320, 240}, {}, {320, 240}, {320, 240}};
  EXPECT_EQ(MaskSizeWarning(pairing, masks, {{320, 240}, {321, 240}, {321, 240}, {310, 233}}),
            "2 of 3 masks seem to be of photos that were not yet undistorted, the first of them "
            "M/c.png, 320 x 240 pixels for a photo of 321 x 240; masks made of the undistorted "
            "photos would be right.");
  // Half, a third, twice the size, and a common size of films, to rounded pixels: reduced or
  // enlarged on purpose.
  const MaskPairing one = {{"M/a.png"}, {}};
  for (const PhotoSize& photo : {PhotoSize{320, 240}, {641, 481}, {960, 720}, {160, 120}}) {
    EXPECT_EQ(MaskSizeWarning(one, {{320, 240}}, {photo}), "") << photo.width;
  }
  EXPECT_EQ(MaskSizeWarning(one, {{854, 480}}, {{1920, 1080}}), "");
  // Both sides have to be near.
  EXPECT_EQ(MaskSizeWarning(one, {{320, 240}}, {{356, 267}}), "");
  EXPECT_NE(MaskSizeWarning(one, {{320, 240}}, {{355, 266}}), "");
  EXPECT_NE(MaskSizeWarning(one, {{320, 240}}, {{320, 241}}), "");
}

TEST(Masks, TheFirstDamagedMaskIsNamedWhateverTheThreads) {
  TempFolder temp;
  std::vector<std::string> photos;
  for (int i = 0; i < 40; ++i) {
    const std::string stem = std::to_string(100 + i);
    WriteGrey(temp / (stem + ".png"), std::vector<uint8_t>(8, 1));
    photos.push_back(stem + ".jpg");
    if (i >= 7) WriteFile(temp / (stem + ".png"), "damaged");
  }
  EXPECT_THAT(UserErrorOf([&] { Load(temp.path(), photos); }), HasSubstr("107.png: "));
}

TEST(Masks, TooManyIdsAreNoObjects) {
  TempFolder temp;
  std::vector<uint8_t> samples;
  for (int i = 0; i < 300 * 300; ++i) {
    samples.push_back(static_cast<uint8_t>(i));
    samples.push_back(static_cast<uint8_t>(i >> 8));
    samples.push_back(static_cast<uint8_t>(1 + (i >> 16)));
  }
  WritePng(temp / "a.png", 300, 300, 8, PNG_COLOR_TYPE_RGB, samples);
  EXPECT_THAT(UserErrorOf([&] {
                Load(temp.path(), {"a.jpg"}, LabelZero::kIgnore, {300, 300});
              }),
              HasSubstr("a.png: has more than 65535 ids"));
}

TEST(MasksLabels, AreNamedByTheIdsOfTheMasks) {
  TempFolder temp;
  const fs::path file = temp / "labels.json";
  std::vector<Label> labels = {{3, 3, ""}, {1, 0x654321, ""}, {8, 8, ""}};
  WriteFile(file,
            R"({"version": 1, "labels": {"3": "mug", "6636321": "großer Ball", "77": "nobody"},
                "objects": [{"id": 3, "files": {}}]})");
  NameLabels(file, &labels);
  EXPECT_EQ(labels[0].name, "mug");
  EXPECT_EQ(labels[1].name, "großer Ball");
  EXPECT_EQ(labels[2].name, "");
  EXPECT_EQ(
      UnusedNamesWarning(file, labels),
      file.string() +
          ": 1 of its 3 names are of ids that no mask has: 77 (nobody); names of the masks' own "
          "ids would be right.");
  for (const char* bad : {"",
                          "{",
                          "3",
                          "[]",
                          "{}",
                          R"({"labels": []})",
                          R"({"labels": {"x": "y"}})",
                          R"({"labels": {"7": 5}})",
                          R"({"labels": {"-7": "y"}})",
                          R"({"labels": {"": "y"}})",
                          R"({"labels": {"99999999999": "y"}})",
                          R"({"labels": {"7": "y"}, "source_ids": 7})",
                          R"({"labels": {"7": "y"}, "source_ids": {"x": 7}})",
                          R"({"labels": {"7": "y"}, "source_ids": {"7": "8"}})",
                          R"({"labels": {"7": "y"}, "source_ids": {"7": -1}})"}) {
    WriteFile(file, bad);
    EXPECT_THAT(UserErrorOf([&] { NameLabels(file, &labels); }),
                testing::StartsWith(file.string() + ": "))
        << bad;
  }
  EXPECT_THAT(UserErrorOf([&] { NameLabels(temp / "none.json", &labels); }),
              HasSubstr("none.json: there is no such file"));
}

// As an export writes it where the masks' ids are above 65535: they have other ids in the table.
TEST(MasksLabels, AreNamedThroughTheSourceIdsOfATable) {
  TempFolder temp;
  const fs::path file = temp / "labels.json";
  const std::vector<Label> of_masks = {{1, 2, ""}, {2, 70'000, ""}, {3, 0x654321, ""}};
  std::vector<Label> labels = of_masks;
  // Read by the masks' ids, "2" would name what is 70000 in the masks.
  WriteFile(file,
            R"({"labels": {"1": "mug", "2": "ball", "3": "book"},
                "source_ids": {"1": 2, "2": 70000, "3": 6636321, "9": 5}})");
  NameLabels(file, &labels);
  EXPECT_EQ(labels[0].name, "mug");
  EXPECT_EQ(labels[1].name, "ball");
  EXPECT_EQ(labels[2].name, "book");
  EXPECT_EQ(UnusedNamesWarning(file, of_masks), "");

  // Ids that the table does not list are the masks' own.
  labels = of_masks;
  WriteFile(file,
            R"({"labels": {"0": "nothing", "2": "ball", "6636321": "book", "4": "a", "5": "b",
                           "6": "c\n", "8": "d"},
                "source_ids": {"2": 70000}})");
  NameLabels(file, &labels);
  EXPECT_EQ(labels[0].name, "");
  EXPECT_EQ(labels[1].name, "ball");
  EXPECT_EQ(labels[2].name, "book");
  EXPECT_EQ(
      UnusedNamesWarning(file, of_masks),
      file.string() +
          ": 4 of its 7 names are of ids that no mask has: 4 (a), 5 (b), 6 (c\\x0a), ...; names "
          "of the masks' own ids would be right.");

  // A foam with an object inserted from another has two labels of one source id.
  labels = {{7, 7, ""}, {1, 7, ""}};
  WriteFile(file, R"({"labels": {"1": "cup", "7": "mug"}, "source_ids": {"1": 7}})");
  NameLabels(file, &labels);
  EXPECT_EQ(labels[0].name, "mug");
  EXPECT_EQ(labels[1].name, "cup");
}

}  // namespace
}  // namespace semfoam
