// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/hard_cases/hard_case_test.h"

namespace semfoam {
namespace {

class RaysHardCases : public HardCaseTest {};

TEST_P(RaysHardCases, HasTheStatedOutcome) { ExpectPasses(GetParam()); }

INSTANTIATE_TEST_SUITE_P(All, RaysHardCases, testing::ValuesIn(RaysCases()), HardCaseName);

}  // namespace
}  // namespace semfoam
