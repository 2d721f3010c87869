// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/scene/names.h"

#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

TEST(Names, KeepWhatIsSafeAndReplaceTheRest) {
  EXPECT_EQ(FileStem(LabelId{7}, "mug"), "7_mug");
  EXPECT_EQ(FileStem(LabelId{7}, "Mug-2_b"), "7_Mug-2_b");
  EXPECT_EQ(FileStem(LabelId{7}, "old mug/../x"), "7_old_mug____x");
  EXPECT_EQ(FileStem(LabelId{7}, "Gl\xC3\xA4ser"), "7_Gl_ser") << "one character, two bytes";
  EXPECT_EQ(FileStem(LabelId{7}, std::string("a\0b", 3)), "7_a_b");
}

TEST(Names, StandInWhereNothingIsLeft) {
  EXPECT_EQ(DisplayName(LabelId{3}, ""), "label_3");
  EXPECT_EQ(DisplayName(LabelId{3}, "\xE7\x8C\xAB"), "\xE7\x8C\xAB");
  EXPECT_EQ(FileStem(LabelId{3}, ""), "3_label_3");
  EXPECT_EQ(FileStem(LabelId{3}, "\xE7\x8C\xAB"), "3_label_3");
  EXPECT_EQ(FileStem(LabelId{3}, ".."), "3_label_3");
}

TEST(Names, AnyBytesGiveASafeShortName) {
  for (int byte = 0; byte < 256; ++byte) {
    const std::string name = std::string(300, static_cast<char>(byte)) + "end";
    const std::string stem = FileStem(LabelId{65535}, name);
    EXPECT_LE(stem.size(), 120u);
    EXPECT_THAT(stem, ::testing::Not(::testing::IsEmpty()));
    EXPECT_EQ(
        stem.find_first_not_of("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-"),
        std::string::npos)
        << "byte " << byte;
  }
}

TEST(NamesOneLine, KeepsTextAndNothingElse) {
  EXPECT_EQ(OneLine("M\xC3\xBCtze \"2\" \\"), "M\xC3\xBCtze \"2\" \\");
  EXPECT_EQ(OneLine("a\nb\tc\x7f"), "a b c ");
  EXPECT_EQ(OneLine("a\xFF"), "a\xEF\xBF\xBD");
  EXPECT_EQ(OneLine(""), "");
}

TEST(NamesLabelColor, FollowsTheFormula) {
  EXPECT_THAT(LabelColor(kNoObject), ::testing::ElementsAre(0, 0, 0));
  // Id 1: hue 0.618 (between cyan and blue), fully saturated.
  EXPECT_THAT(LabelColor(LabelId{1}), ::testing::ElementsAre(0, 74, 255));
  // Even ids have half the saturation, so no channel leaves 64..191.
  for (int id = 2; id < 100; id += 2) {
    for (const int channel : LabelColor(LabelId{id})) {
      EXPECT_GE(channel, 64);
      EXPECT_LE(channel, 191);
    }
  }
}

TEST(NamesLabelColor, TellsTheFirstHundredApart) {
  std::set<std::array<uint8_t, 3>> colors;
  for (int id = 0; id < 100; ++id) colors.insert(LabelColor(LabelId{id}));
  EXPECT_EQ(colors.size(), 100u);
}

}  // namespace
}  // namespace semfoam
