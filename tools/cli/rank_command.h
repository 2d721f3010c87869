// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/util/rank_group.h"

#include <functional>

namespace semfoam {

// Ends a command with the exit code of an error that another rank prints.
struct PrintedElsewhere {};

// Runs the work of a command as one of `ranks`, and ends the rank (RankGroup::End). Ranks other
// than the first log nothing but errors and display no progress. An error of one of these alone is
// printed with the number of its rank; one that rank 0 has too, and the loss of another rank, are
// thrown on rank 0, and elsewhere become PrintedElsewhere. With null, only runs the work.
void RunOnRanks(RankGroup* ranks, const std::function<void()>& run);

}  // namespace semfoam
