// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/util/suggestion.h"

#include <gtest/gtest.h>

namespace semfoam {
namespace {

TEST(Suggestion, FindsTheNameThatIsMeant) {
  const std::vector<std::string> names = {
      "output_path", "input_path", "quality", "FoamTraining.num_rays", "test_every", "up"};
  const std::pair<const char*, const char*> meant[] = {
      {"outptu_path", "output_path"},  // a swap
      {"outputpath", "output_path"},   // left out
      {"input_paths", "input_path"},   // inserted
      {"qualify", "quality"},          // replaced
      {"Output-Path", "output_path"},
      {"foamtraining.numrays", "FoamTraining.num_rays"},
      {"output", "output_path"},  // a beginning
      {"imput_phat", "input_path"},
      {"us", "up"},
  };
  for (const auto& [misspelt, name] : meant) EXPECT_EQ(NearestName(misspelt, names), name);
}

TEST(Suggestion, FindsNoneWhereNoneIsNear) {
  const std::vector<std::string> names = {"output_path", "quality", "up"};
  for (const std::string far : {"", "x", "qual1f1ed", "path", "ou", "nonsense"}) {
    EXPECT_EQ(NearestName(far, names), "") << far;
  }
  EXPECT_EQ(NearestName(std::string(100'000, 'q'), names), "");
}

TEST(Suggestion, OfEquallyNearNamesTheFirstIsTaken) {
  EXPECT_EQ(NearestName("bat", {"cat", "rat"}), "cat");
  EXPECT_EQ(NearestName("rat", {"cat", "rat"}), "rat");
}

}  // namespace
}  // namespace semfoam
