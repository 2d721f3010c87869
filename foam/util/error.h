// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <sstream>
#include <stdexcept>
#include <string>

namespace semfoam {

// A mistake of the user's, not of ours: a missing folder, a damaged file, an option out of range.
// Its text is one sentence that says which file, what is wrong and what would be right; the program
// prints it and exits with 1. Our own mistakes are CHECKs.
class UserError : public std::runtime_error {
 public:
  // Streams all arguments into one sentence: UserError(path, ": ends at byte ", n, "; is the copy
  // complete?").
  template <typename... Parts>
  explicit UserError(const Parts&... parts) : std::runtime_error(Join(parts...)) {}

 private:
  template <typename... Parts>
  static std::string Join(const Parts&... parts) {
    std::ostringstream text;
    (text << ... << parts);
    return text.str();
  }
};

}  // namespace semfoam
