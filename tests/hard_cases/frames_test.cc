// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/hard_cases/hard_case_test.h"

namespace semfoam {
namespace {

class FramesHardCases : public HardCaseTest {};

TEST_P(FramesHardCases, HasTheStatedOutcome) { ExpectPasses(GetParam()); }

INSTANTIATE_TEST_SUITE_P(All, FramesHardCases, testing::ValuesIn(FramesCases()), HardCaseName);

}  // namespace
}  // namespace semfoam
