// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/hard_cases/hard_case_test.h"

namespace semfoam {
namespace {

class ValuesHardCases : public HardCaseTest {};

TEST_P(ValuesHardCases, HasTheStatedOutcome) { ExpectPasses(GetParam()); }

INSTANTIATE_TEST_SUITE_P(All, ValuesHardCases, testing::ValuesIn(ValuesCases()), HardCaseName);

}  // namespace
}  // namespace semfoam
