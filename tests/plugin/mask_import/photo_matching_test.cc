// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask_import/photo_matching.h"

#include "tests/mistake.h"
#include "tests/plugin/test_util.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

using testing::ElementsAre;

using Names = std::vector<std::string>;

// The photo of one mask; "" for none.
std::string PhotoOf(const std::string& mask, const Names& photos) {
  // A second mask with a name, so that frame numbers are no way out.
  Names masks = {photos.back(), mask};
  const PhotoMatching matching = MatchPhotos("IN", masks, photos);
  return matching.photos[1] < 0 ? "" : photos[matching.photos[1]];
}

TEST(MatchPhotos, ByAllSpellings) {
  const Names photos = {"a/0001.jpg", "b/IMG_2.JPG", "c.d.png", "last.jpg"};
  for (const char* mask : {"0001",
                           "0001.png",
                           "0001.jpg",
                           "0001.jpg.png",
                           "x/y/0001.json",
                           "x\\a\\0001.jpg",
                           "mask_0001.npy",
                           "mask_0001",
                           "0001_mask.png",
                           "0001.mask.png",
                           "0001_jpg.rf.0123456789abcdef.jpg",
                           "train/images/0001_jpeg.rf.QrSt.jpg",
                           "1a2b3c4d-0001.jpg",
                           "/data/upload/7/1a2b3c4d-0001.png"}) {
    EXPECT_EQ(PhotoOf(mask, photos), "a/0001.jpg") << mask;
  }
  for (const char* mask : {"IMG_2.png", "IMG_2.JPG", "b/IMG_2", "IMG_2_JPG.rf.ab.jpg"}) {
    EXPECT_EQ(PhotoOf(mask, photos), "b/IMG_2.JPG") << mask;
  }
  EXPECT_EQ(PhotoOf("c.d.txt", photos), "c.d.png");
  for (const char* mask : {"1", "001.png", "img_2.png", "0001x.png", "c.png"}) {
    EXPECT_EQ(PhotoOf(mask, photos), "") << mask;
  }
}

TEST(MatchPhotos, ByFolders) {
  const Names photos = {"left/1.jpg", "right/1.jpg", "z.jpg"};
  EXPECT_EQ(PhotoOf("masks/right/1.png", photos), "right/1.jpg");
  EXPECT_EQ(PhotoOf("left/1.jpg.png", photos), "left/1.jpg");
  EXPECT_THAT(UserErrorOf([&] { PhotoOf("1.png", photos); }),
              NamesMistake("IN", {"1.png", "left/1.jpg", "right/1.jpg"}, "may be of"));
  EXPECT_THAT(UserErrorOf([&] {
                MatchPhotos("IN", {"z.png", "z_jpg.rf.1.jpg"}, photos);
              }),
              NamesMistake("IN", {"z.png", "z.jpg"}, "are both of"));
}

TEST(MatchPhotos, ByFrames) {
  const Names photos = {"frame_0001.jpg", "frame_0002.jpg", "frame_0003.jpg"};
  const PhotoMatching by_number = MatchPhotos("IN", {"00003", "00001"}, photos);
  EXPECT_THAT(by_number.photos, ElementsAre(2, 0));
  EXPECT_EQ(by_number.how, "by frame number");
  const PhotoMatching in_order = MatchPhotos("IN", {"00002", "00000", "00001"}, photos);
  EXPECT_THAT(in_order.photos, ElementsAre(2, 0, 1));
  EXPECT_EQ(in_order.how, "in their order");
  EXPECT_THAT(UserErrorOf([&] {
                MatchPhotos("IN", {"00000", "00001"}, photos);
              }),
              NamesMistake("IN", {"frame_0001", "00000", "2"}, "none of the"));
  EXPECT_THAT(UserErrorOf([&] {
                MatchPhotos("IN", {"a", "b", "c"}, photos);
              }),
              NamesMistake("IN", {"frame_0001", "3"}, "none of the"));
}

TEST(MatchPhotos, LongNames) {
  const std::string name(100'000, '1');
  EXPECT_NE(UserErrorOf([&] { MatchPhotos("IN", {name}, {"a.jpg"}); }), "");
}

TEST(NamesPhotosWithFolders, NeedsTheFolders) {
  const Names photos = {"a/1.jpg"};
  EXPECT_TRUE(NamesPhotosWithFolders({"x.png", "a/1.png"}, photos));
  EXPECT_TRUE(NamesPhotosWithFolders({"a/1.jpg.png"}, photos));
  EXPECT_FALSE(NamesPhotosWithFolders({"1.png", "b/1.png", "a/1_mask.png"}, photos));
}

}  // namespace
}  // namespace semfoam
