// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/util/rank_group.h"

#include <algorithm>

namespace semfoam {

std::string FromFirstRank(RankGroup* ranks, const std::string& value) {
  if (ranks == nullptr) return value;
  const auto all = ranks->Gather(std::as_bytes(std::span(value)));
  return {reinterpret_cast<const char*>(all[0].data()), all[0].size()};
}

void RequireAgreement(RankGroup* ranks,
                      const std::string& text,
                      const std::string& what,
                      const std::string& right) {
  if (ranks == nullptr) return;
  const auto all = ranks->Gather(std::as_bytes(std::span(text)));
  for (int rank = 1; rank < ranks->num_ranks(); ++rank) {
    if (std::ranges::equal(all[rank], all[0])) continue;
    throw UserError("Rank ",
                    rank,
                    " of ",
                    ranks->num_ranks(),
                    " has other ",
                    what,
                    " than rank 0; ",
                    right,
                    " would be right.");
  }
}

}  // namespace semfoam
