// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <sstream>
#include <stdexcept>
#include <string>

namespace semfoam {

// Reports an error that the user can correct: a missing folder, a damaged file, an option out of
// range. Its text is one sentence that names the file, what is wrong and what would be right; the
// program prints it and exits with 1. Errors of the program itself are CHECKs.
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

// Reports a value of an options struct that is out of range. The text begins with the name of the
// struct's field; a program that spells its options differently puts its prefix before it.
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
