// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask/mask_classes.h"

#include "plugin/mask/class_image.h"
#include "plugin/mask/mask_decoding.h"
#include "plugin/mask/mask_pairing.h"

#include <string>
#include <vector>

#include "tests/mistake.h"
#include "tests/plugin/mask/grey_mask.h"
#include "tests/plugin/test_util.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

std::vector<int32_t> ClassesOf(const ClassImage& image, size_t pixels) {
  std::vector<int32_t> classes;
  for (size_t i = 0; i < pixels; ++i) classes.push_back(Value(image[i]));
  return classes;
}

struct LoadedMasks {
  std::vector<Label> labels;
  std::vector<ClassImage> classes;  // one per photo; empty without a mask
};

std::vector<int32_t> IdsOf(const LoadedMasks& set) {
  std::vector<int32_t> ids;
  for (const Label& label : set.labels) ids.push_back(Value(label.id));
  return ids;
}

std::vector<uint32_t> SourceIdsOf(const LoadedMasks& set) {
  std::vector<uint32_t> ids;
  for (const Label& label : set.labels) ids.push_back(Value(label.source_id));
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

TEST(MaskClasses, IdsBecomeContiguousClassesOverTheWholeSet) {
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

TEST(MaskClasses, ZeroCanBeAClass) {
  TempFolder temp;
  WriteGrey(temp / "a.png", {0, 0, 9, 9, 3, 3, 3, 0});
  const LoadedMasks set = Load(temp.path(), {"a.jpg"}, LabelZero::kClass);
  EXPECT_THAT(IdsOf(set), ElementsAre(0, 3, 9));
  EXPECT_THAT(ClassesOf(set.classes[0], 8), ElementsAre(0, 0, 2, 2, 1, 1, 1, 0));
}

TEST(MaskClasses, ZeroIsAClassByItselfWhereItCoversAFifth) {
  TempFolder gap, background;
  WriteGrey(gap / "a.png", {9, 9, 9, 9, 3, 3, 3, 0});
  EXPECT_THAT(IdsOf(Load(gap.path(), {"a.jpg"}, LabelZero::kAuto)), ElementsAre(3, 9));
  WriteGrey(background / "a.png", {0, 0, 9, 9, 3, 3, 3, 3});
  EXPECT_THAT(IdsOf(Load(background.path(), {"a.jpg"}, LabelZero::kAuto)), ElementsAre(0, 3, 9));
  // Masks grown from strokes say that it is none, unless the user knows better.
  WriteFile(background / "labels.json", R"({"labels": {}, "label_zero": "ignore"})");
  EXPECT_THAT(IdsOf(Load(background.path(), {"a.jpg"}, LabelZero::kAuto)), ElementsAre(3, 9));
  EXPECT_THAT(IdsOf(Load(background.path(), {"a.jpg"}, LabelZero::kClass)), ElementsAre(0, 3, 9));
  WriteFile(background / "labels.json", R"({"labels": {}, "label_zero": 0})");
  EXPECT_THAT(IdsOf(Load(background.path(), {"a.jpg"}, LabelZero::kAuto)), ElementsAre(0, 3, 9));
}

TEST(MaskClasses, EmptyMasksHaveNoClasses) {
  TempFolder temp;
  WriteGrey(temp / "a.png", std::vector<uint8_t>(8, 0));
  const LoadedMasks set = Load(temp.path(), {"a.jpg"});
  EXPECT_THAT(set.labels, IsEmpty());
  EXPECT_FALSE(set.classes[0].Empty());
  EXPECT_THAT(ClassesOf(set.classes[0], 8), testing::Each(-1));
}

TEST(MaskClasses, ManyClassesNeedTwoBytes) {
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
  for (int id = 1; id < 300; ++id) EXPECT_EQ(set.classes[0][id], ClassIndex{id - 1});
  EXPECT_EQ(ClassImage::BytesPerPixel(255), 1);
  EXPECT_EQ(ClassImage::BytesPerPixel(256), 2);
  // The last class of either width is told from none.
  for (const int classes : {255, 256, 65535}) {
    ClassImage image({2, 1}, classes);
    EXPECT_EQ(image[0], kUnlabelled);
    image.Set(0, ClassIndex{classes - 1});
    EXPECT_EQ(image[0], ClassIndex{classes - 1});
    image.Set(0, kUnlabelled);
    EXPECT_EQ(image[0], kUnlabelled);
  }
}

TEST(MaskClasses, GreySavedAsRgbIsGrey) {
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

TEST(MaskClasses, DevasLongIdsAreNumberedAndKept) {
  TempFolder temp;
  WriteDeva(temp);
  const LoadedMasks set = LoadDeva(temp);
  EXPECT_THAT(IdsOf(set), ElementsAre(1, 2));
  EXPECT_THAT(SourceIdsOf(set), ElementsAre(kGreyLongId, kLongId));
  EXPECT_THAT(ClassesOf(set.classes[0], 2), ElementsAre(1, -1));
  EXPECT_THAT(ClassesOf(set.classes[1], 2), ElementsAre(0, 0));
}

TEST(MaskClasses, PredJsonKnowsTheIds) {
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

TEST(MaskClasses, AnotherSizeIsReadAtPixelCentres) {
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
  EXPECT_EQ(down.labels[Value(down.classes[0][0])].id, LabelId{4});
  EXPECT_EQ(down.labels[Value(down.classes[0][1])].id, LabelId{6});
}

TEST(MaskClasses, AnotherAspectIsNamedWithBothSizes) {
  TempFolder temp;
  WritePng(temp / "a.png", 48, 64, 8, PNG_COLOR_TYPE_GRAY, std::vector<uint8_t>(48 * 64, 1));
  const std::string message = UserErrorOf([&] {
    Load(temp.path(), {"a.jpg"}, LabelZero::kIgnore, {640, 480});
  });
  EXPECT_THAT(message,
              NamesMistake((temp / "a.png").string(), {"48 x 64 pixels", "640 x 480"}, "aspect"));
}

TEST(MaskClasses, TheFirstDamagedMaskIsNamedWhateverTheThreads) {
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

TEST(MaskClasses, TooManyIdsAreNoObjects) {
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

}  // namespace
}  // namespace semfoam
