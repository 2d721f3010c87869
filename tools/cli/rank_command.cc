// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/cli/rank_command.h"

#include "foam/util/error.h"
#include "foam/util/interruption.h"
#include "tools/cli/logging.h"
#include "tools/cli/run_command.h"
#include "tools/support/progress.h"

#include <string>

namespace semfoam {

void RunOnRanks(RankGroup* ranks, const std::function<void()>& run) {
  if (ranks == nullptr) return run();
  const bool is_first = IsFirstRank(ranks);
  if (!is_first) {
    LogErrorsOnly();
    SetProgressStyle(ProgressStyle::kNone);
  }
  try {
    run();
    ranks->End(/*has_failed=*/false);
  } catch (const Interruption&) {
    ranks->End(/*has_failed=*/false);
    throw;
  } catch (const LostRank&) {
    ranks->End(/*has_failed=*/false);
    if (is_first) throw;
    throw PrintedElsewhere();
  } catch (const UserError& error) {
    const bool first_has_failed = ranks->End(/*has_failed=*/true);
    if (is_first) throw;
    if (!first_has_failed) {
      PrintError("Rank " + std::to_string(ranks->rank()) + " of " +
                 std::to_string(ranks->num_ranks()) + ": " + ErrorSentence(error));
    }
    throw PrintedElsewhere();
  } catch (...) {
    if (ranks->End(/*has_failed=*/true) && !is_first) throw PrintedElsewhere();
    throw;
  }
}

}  // namespace semfoam
