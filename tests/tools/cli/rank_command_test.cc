// SPDX-License-Identifier: GPL-3.0-or-later
//
// Of the errors of several ranks, each is printed once.
#include "tools/cli/rank_command.h"

#include "foam/util/error.h"

#include <exception>
#include <string>
#include <vector>

#include "tests/foam/rank_threads.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

struct Result {
  // What each rank has thrown, and what was printed.
  std::vector<std::exception_ptr> thrown;
  std::string printed;
};

Result RunOn(int num_ranks, const std::function<void(RankGroup*)>& run) {
  RankThreads ranks(num_ranks);
  testing::internal::CaptureStderr();
  Result result;
  result.thrown = ranks.Run([&](RankGroup* rank) { RunOnRanks(rank, [&] { run(rank); }); });
  result.printed = testing::internal::GetCapturedStderr();
  return result;
}

// Calls Gather until it throws.
[[noreturn]] void TrainForEver(RankGroup* rank) {
  while (true) rank->Gather({});
}

TEST(RankCommand, RunsToTheEnd) {
  const Result result = RunOn(3, [](RankGroup* rank) { rank->Gather({}); });
  for (const auto& thrown : result.thrown) EXPECT_EQ(thrown, nullptr);
  EXPECT_EQ(result.printed, "");
  int calls = 0;
  RunOnRanks(nullptr, [&] { ++calls; });
  EXPECT_EQ(calls, 1);
}

TEST(RankCommand, LetsRankZeroReportAnErrorOfAll) {
  const Result result = RunOn(3, [](RankGroup*) { throw UserError("there is no photo."); });
  EXPECT_THROW(std::rethrow_exception(result.thrown[0]), UserError);
  EXPECT_THROW(std::rethrow_exception(result.thrown[1]), PrintedElsewhere);
  EXPECT_THROW(std::rethrow_exception(result.thrown[2]), PrintedElsewhere);
  EXPECT_EQ(result.printed, "");
}

TEST(RankCommand, NamesTheRankOfAnErrorOfItsOwn) {
  const Result result = RunOn(3, [](RankGroup* rank) {
    if (rank->rank() == 2) throw UserError("there is no photo.");
    TrainForEver(rank);
  });
  EXPECT_THROW(std::rethrow_exception(result.thrown[0]), LostRank);
  EXPECT_THROW(std::rethrow_exception(result.thrown[1]), PrintedElsewhere);
  EXPECT_THROW(std::rethrow_exception(result.thrown[2]), PrintedElsewhere);
  EXPECT_EQ(result.printed, "ERROR: Rank 2 of 3: there is no photo.\n");
}

}  // namespace
}  // namespace semfoam
