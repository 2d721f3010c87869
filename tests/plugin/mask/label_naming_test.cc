// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask/label_naming.h"

#include <string>
#include <vector>

#include "tests/mistake.h"
#include "tests/plugin/test_util.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

TEST(LabelNaming, AreNamedByTheIdsOfTheMasks) {
  TempFolder temp;
  const fs::path file = temp / "labels.json";
  std::vector<Label> labels = {
      {LabelId{3}, MaskId{3}, ""}, {LabelId{1}, MaskId{0x654321}, ""}, {LabelId{8}, MaskId{8}, ""}};
  WriteFile(file,
            R"({"version": 1, "labels": {"3": "mug", "6636321": "großer Ball", "77": "nobody"},
                "objects": [{"id": 3, "files": {}}]})");
  NameLabels(file, &labels);
  EXPECT_EQ(labels[0].name, "mug");
  EXPECT_EQ(labels[1].name, "großer Ball");
  EXPECT_EQ(labels[2].name, "");
  EXPECT_THAT(UnusedNamesWarning(file, labels),
              NamesMistake(file.string(), {"1 of its 3 names", "77 (nobody)"}, "no mask has"));
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
TEST(LabelNaming, AreNamedThroughTheSourceIdsOfATable) {
  TempFolder temp;
  const fs::path file = temp / "labels.json";
  const std::vector<Label> of_masks = {{LabelId{1}, MaskId{2}, ""},
                                       {LabelId{2}, MaskId{70'000}, ""},
                                       {LabelId{3}, MaskId{0x654321}, ""}};
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
  EXPECT_THAT(
      UnusedNamesWarning(file, of_masks),
      NamesMistake(
          file.string(), {"4 of its 7 names", "4 (a)", "5 (b)", "6 (c\\x0a), ..."}, "no mask has"));

  // A foam with an object inserted from another has two labels of one source id.
  labels = {{LabelId{7}, MaskId{7}, ""}, {LabelId{1}, MaskId{7}, ""}};
  WriteFile(file, R"({"labels": {"1": "cup", "7": "mug"}, "source_ids": {"1": 7}})");
  NameLabels(file, &labels);
  EXPECT_EQ(labels[0].name, "mug");
  EXPECT_EQ(labels[1].name, "cup");
}

}  // namespace
}  // namespace semfoam
