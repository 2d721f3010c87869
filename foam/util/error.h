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

// A value of a struct of options is out of range. The text begins with the field's name, as the
// struct has it; a program that spells options otherwise puts its prefix before it.
class FieldError : public UserError {
 public:
  // FieldError("num_rays", " is ", value, "; it must be greater than 0.")
  template <typename... Parts>
  explicit FieldError(const std::string& field, const Parts&... parts)
      : UserError(field, parts...), field_(field) {}

  const std::string& field() const { return field_; }

 private:
  std::string field_;
};

}  // namespace semfoam
