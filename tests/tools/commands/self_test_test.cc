// SPDX-License-Identifier: GPL-3.0-or-later
#include <set>
#include <string>

#include "tests/hard_cases/hard_case.h"
#include "tests/tools/program.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

using ::testing::ContainsRegex;
using ::testing::HasSubstr;

TEST(SelfTest, PassesAndShowsEveryFamily) {
  const Outcome run = RunSemfoam({"self_test"});
  EXPECT_EQ(run.exit_code, 0) << run.out << run.err;
  for (const HardCaseFamily& family : HardCaseFamilies()) {
    const std::string cases = std::to_string(family.cases.size());
    EXPECT_THAT(run.out, ContainsRegex(family.name + " +" + cases + " +" + cases + " "));
  }
  EXPECT_THAT(run.out, HasSubstr("scalar float"));
  EXPECT_THAT(run.out, HasSubstr(" 0 rays hit the step limit"));
}

TEST(SelfTestHardCases, HaveNamesOfTheirOwnAndStateTheirOutcome) {
  std::set<std::string> names;
  for (const HardCaseFamily& family : HardCaseFamilies()) {
    EXPECT_FALSE(family.cases.empty()) << family.name;
    for (const HardCase& hard_case : family.cases) {
      EXPECT_TRUE(names.insert(family.name + "/" + hard_case.name).second) << hard_case.name;
      EXPECT_FALSE(hard_case.expected.empty()) << hard_case.name;
    }
  }
}

TEST(SelfTestHardCases, FailWhereTheBoundIsTooTight) {
  const RayScene scene(RandomSites(50, 1), 1);
  RayBounds bounds;
  EXPECT_TRUE(CheckRays(scene, RaysFromEverywhere(8, 1), bounds).failures.empty());
  bounds.gradient_float = 0;
  EXPECT_FALSE(CheckRays(scene, RaysFromEverywhere(8, 1), bounds).failures.empty());
}

}  // namespace
}  // namespace semfoam
