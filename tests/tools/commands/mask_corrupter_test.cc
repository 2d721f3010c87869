// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/tools/mask_corrupter.h"

#include "plugin/mask/mask_png.h"

#include <map>
#include <set>

#include "tests/tools/program.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

const fs::path kMasks = kTabletop / "object_mask";

Outcome Corrupt(const fs::path& output, std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(),
                   {"--mask_path", kMasks.string(), "--output_path", output.string()});
  return RunMaskCorrupter(arguments);
}

// The photos' objects whose pixels are not what they were, "0003 7".
std::set<std::string> Damaged(const fs::path& folder) {
  std::set<std::string> damaged;
  for (const std::string& name : FilesBelow(kMasks)) {
    const MaskPng before = ReadMaskPng(kMasks / name);
    const MaskPng after = ReadMaskPng(folder / name);
    EXPECT_EQ(after.values.size(), before.values.size());
    for (size_t i = 0; i < before.values.size(); ++i) {
      if (before.values[i] != after.values[i] && before.values[i] != 0) {
        damaged.insert(name.substr(0, 5) + std::to_string(before.values[i]));
      }
    }
  }
  return damaged;
}

TEST(MaskCorrupter, DamagesTheShareThatIsAskedFor) {
  const TempFolder folder;
  const Outcome none = Corrupt(folder / "none", {"--share", "0"});
  ASSERT_EQ(none.exit_code, 0) << none.err;
  EXPECT_THAT(none.out, HasSubstr("64 masks, "));
  EXPECT_THAT(none.out, HasSubstr(": 0 missing, 0 merged, 0 switched, 0 shifted"));
  EXPECT_TRUE(Damaged(folder / "none").empty());

  ASSERT_EQ(Corrupt(folder / "few", {"--share", "0.1"}).exit_code, 0);
  ASSERT_EQ(Corrupt(folder / "again", {"--share", "0.1"}).exit_code, 0);
  ASSERT_EQ(Corrupt(folder / "other", {"--share", "0.1", "--random_seed", "1"}).exit_code, 0);
  ASSERT_EQ(Corrupt(folder / "all", {"--share", "1"}).exit_code, 0);
  const std::set<std::string> few = Damaged(folder / "few");
  EXPECT_GT(few.size(), 40u);  // of 743, and who is traded with is damaged too
  EXPECT_LT(few.size(), 150u);
  EXPECT_GT(Damaged(folder / "all").size(), 500u);
  EXPECT_NE(Damaged(folder / "other"), few);
  for (const std::string& name : FilesBelow(folder / "few")) {
    EXPECT_EQ(ReadFile(folder / "few" / name), ReadFile(folder / "again" / name));
  }
}

TEST(MaskCorrupter, IndependentIdsAreThoseOfOnePhotoAlone) {
  const TempFolder folder;
  ASSERT_EQ(Corrupt(folder / "out", {"--independent", "1"}).exit_code, 0);
  std::map<uint32_t, std::set<uint32_t>> ids_of;  // over all photos
  for (const std::string& name : FilesBelow(kMasks)) {
    const MaskPng before = ReadMaskPng(kMasks / name);
    const MaskPng after = ReadMaskPng(folder / "out" / name);
    std::map<uint32_t, uint32_t> new_id;
    for (size_t i = 0; i < before.values.size(); ++i) {
      const auto [entry, is_new] = new_id.try_emplace(before.values[i], after.values[i]);
      ASSERT_EQ(entry->second, after.values[i]);
    }
    EXPECT_EQ(new_id[0], 0u);
    std::set<uint32_t> distinct;
    for (const auto& [old_id, id] : new_id) {
      distinct.insert(id);
      ids_of[old_id].insert(id);
    }
    EXPECT_EQ(distinct.size(), new_id.size());
    EXPECT_EQ(*distinct.rbegin(), new_id.size() - 1);  // 1..n
  }
  EXPECT_GT(ids_of[6].size(), 5u);  // the mug
}

TEST(MaskCorrupter, SaysWhatIsWrong) {
  const TempFolder folder;
  const Outcome share = Corrupt(folder / "out", {"--share", "1.5"});
  EXPECT_EQ(share.exit_code, 1);
  ASSERT_THAT(share.Errors(), testing::SizeIs(1));
  EXPECT_THAT(share.Errors().front(), HasSubstr("share is 1.5; it must be from 0 to 1"));
  const Outcome missing = RunMaskCorrupter(
      {"--mask_path", (folder / "nowhere").string(), "--output_path", (folder / "out").string()});
  EXPECT_EQ(missing.exit_code, 1);
  EXPECT_THAT(missing.err, HasSubstr("nowhere: there is no such folder"));
  const Outcome photos = RunMaskCorrupter(
      {"--mask_path", (kTabletop / "images").string(), "--output_path", (folder / "out").string()});
  EXPECT_EQ(photos.exit_code, 1);
  EXPECT_THAT(photos.err,
              HasSubstr("images: holds no mask but 64 .jpg files, where a PNG for each"));
  EXPECT_FALSE(fs::exists(folder / "out"));
}

}  // namespace
}  // namespace semfoam
