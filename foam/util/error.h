// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <functional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace semfoam {

// Names a field of a struct of options within a message: UserError(path, ": exists; ",
// Field{"overwrite"}, " 1 would be right."). A program whose users know the field by another name,
// such as an option of the command line, spells it so (UserError::Spelled).
struct Field {
  std::string name;
};

// Reports an error that the user can correct: a missing folder, a damaged file, an option out of
// range. Its text is one sentence that names the file, what is wrong and what would be right; the
// program prints it and exits with 1. Errors of the program itself are CHECKs.
class UserError : public std::runtime_error {
 public:
  // Streams all arguments into one sentence: UserError(path, ": ends at byte ", n, "; is the copy
  // complete?").
  template <typename... Parts>
  explicit UserError(const Parts&... parts) : UserError(FromMessage{}, Join(parts...)) {}

  // The sentence, with the name of each Field replaced by spell(name); what() has the names.
  std::string Spelled(const std::function<std::string(const std::string& field)>& spell) const;

 private:
  struct FromMessage {};
  struct Place {
    size_t begin = 0, end = 0;
  };
  struct Message {
    std::string text;
    std::vector<Place> fields;  // where in the text, in order
  };

  UserError(FromMessage, Message message)
      : std::runtime_error(message.text), fields_(std::move(message.fields)) {}

  template <typename... Parts>
  static Message Join(const Parts&... parts) {
    std::ostringstream text;
    std::vector<Place> fields;
    const auto append = [&](const auto& part) {
      if constexpr (std::is_same_v<std::decay_t<decltype(part)>, Field>) {
        const auto begin = static_cast<size_t>(text.tellp());
        fields.push_back({begin, begin + part.name.size()});
        text << part.name;
      } else {
        text << part;
      }
    };
    (append(parts), ...);
    return {text.str(), std::move(fields)};
  }

  std::vector<Place> fields_;
};

// Reports a value of an options struct that is out of range. The text begins with the name of the
// struct's field.
class FieldError : public UserError {
 public:
  // FieldError("num_rays", " is ", value, "; it must be greater than 0.")
  template <typename... Parts>
  explicit FieldError(const std::string& field, const Parts&... parts)
      : UserError(Field{field}, parts...), field_(field) {}

  const std::string& field() const { return field_; }

 private:
  std::string field_;
};

}  // namespace semfoam
