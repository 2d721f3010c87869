// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/hard_cases/hard_case_test.h"

namespace semfoam {
namespace {

class SitesHardCases : public HardCaseTest {};

TEST_P(SitesHardCases, HasTheStatedOutcome) { ExpectPasses(GetParam()); }

INSTANTIATE_TEST_SUITE_P(All, SitesHardCases, testing::ValuesIn(SitesCases()), HardCaseName);

}  // namespace
}  // namespace semfoam
