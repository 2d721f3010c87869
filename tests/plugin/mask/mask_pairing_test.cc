// SPDX-License-Identifier: GPL-3.0-or-later
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

TEST(MaskPairing, FindsEachKindOfName) {
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

TEST(MaskPairing, TheFullestNameWinsAndTheOthersAreUnused) {
  TempFolder temp;
  for (const char* name : {"a.b.jpg.png", "a.b.png", "a.png"}) {
    WriteGrey(temp / name, std::vector<uint8_t>(8, 1));
  }
  const MaskPairing pairing = PairMasks(temp.path(), {"a.b.jpg"});
  EXPECT_EQ(pairing.masks[0], temp / "a.b.jpg.png");
  EXPECT_EQ(pairing.unused.size(), 2u);
}

TEST(MaskPairing, FindsMasksByTheNamesThatTheyAreGiven) {
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

TEST(MaskPairing, NeverGuesses) {
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

TEST(MaskPairing, FollowsLinksToFoldersButNotForEver) {
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

// Photos by COLMAP's image_undistorter, masks of the photos that it was given.
TEST(MaskPairing, MasksOfPhotosBeforeUndistortionAreCountedAndNamed) {
  MaskPairing pairing;
  pairing.masks = {"M/a.png", "", "M/c.png", "M/d.png"};
  const std::vector<PhotoSize> masks = {{320, 240}, {}, {320, 240}, {320, 240}};
  EXPECT_THAT(
      MaskSizeWarning(pairing, masks, {{320, 240}, {321, 240}, {321, 240}, {310, 233}}),
      NamesMistake(
          "", {"2 of 3 masks", "M/c.png", "320 x 240 pixels", "321 x 240"}, "not yet undistorted"));
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

}  // namespace
}  // namespace semfoam
