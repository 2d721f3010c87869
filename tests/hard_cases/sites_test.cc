// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/hard_cases/hard_case_test.h"

namespace semfoam {
namespace {

TEST_P(HardCaseTest, HasTheStatedOutcome) { ExpectPasses(GetParam()); }

INSTANTIATE_TEST_SUITE_P(Sites, HardCaseTest, testing::ValuesIn(SitesCases()), HardCaseName);

}  // namespace
}  // namespace semfoam
