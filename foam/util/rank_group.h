// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/util/error.h"

#include <cstddef>
#include <cstring>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

namespace semfoam {

// Reports that another process of a RankGroup has ended, or cannot be reached. Its text names the
// rank, where that is known.
class LostRank : public UserError {
 public:
  using UserError::UserError;
};

// The processes, on one or several machines, that train one foam together, as one of them, the
// rank, sees them. All hold the whole state of the training and take the same steps; each casts a
// share of the rays. What depends on time or on files is decided on rank 0. Bytes are exchanged,
// and never summed on the way, so that the result is that of one process.
class RankGroup {
 public:
  virtual ~RankGroup() = default;

  // Number of this process, from 0 on, and of all processes, at least 1.
  virtual int rank() const = 0;
  virtual int num_ranks() const = 0;

  // Sends `own` to all ranks, and returns what each has sent [num_ranks], valid until the next
  // call. All ranks must make the same calls in the same order; lengths may differ. Throws LostRank
  // where a rank has ended or cannot be reached, and from then on.
  virtual std::vector<std::span<const std::byte>> Gather(std::span<const std::byte> own) = 0;

  // Ends the part of this rank, whether its work is done or not; the next Gather of other ranks
  // throws LostRank. On rank 0, allows the others to end; on these, waits for that, because
  // launchers end all processes as soon as one has ended. `has_failed`: this rank has an error of
  // its own to report. Returns whether rank 0 has one: the same as this one, most likely, which is
  // to be printed once.
  virtual bool End(bool has_failed) = 0;
};

// Returns whether this process writes files and prints; `ranks` null: there is no other.
inline bool IsFirstRank(const RankGroup* ranks) { return ranks == nullptr || ranks->rank() == 0; }

// Return the value that rank 0 has passed; with null, `value`.
std::string FromFirstRank(RankGroup* ranks, const std::string& value);
template <typename T>
T FromFirstRank(RankGroup* ranks, const T& value) {
  static_assert(std::is_trivially_copyable_v<T>);
  if (ranks == nullptr) return value;
  const auto all = ranks->Gather(std::as_bytes(std::span(&value, 1)));
  T first;
  std::memcpy(&first, all[0].data(), sizeof(T));
  return first;
}

// Throws UserError, on all ranks, where one has passed another text than rank 0. `what` is what the
// text stands for, and `right` what would be right: "Rank 2 of 4 has other `what` than rank 0;
// `right` would be right." With null, does nothing.
void RequireAgreement(RankGroup* ranks,
                      const std::string& text,
                      const std::string& what,
                      const std::string& right);

}  // namespace semfoam
