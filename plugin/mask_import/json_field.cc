// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask_import/json_field.h"

#include "foam/util/input_file.h"
#include "foam/util/json_file.h"

#include <cmath>
#include <optional>

namespace semfoam {

bool JsonField::Has(const char* key) const {
  if (!value_->is_object()) return false;
  const auto found = value_->find(key);
  return found != value_->end() && !found->is_null();
}

JsonField JsonField::operator[](const char* key) const {
  if (!value_->is_object()) Fail("an object with \"" + std::string(key) + "\"");
  const auto found = value_->find(key);
  if (found == value_->end()) FailBecause("has no \"" + std::string(key) + "\"");
  return {*file_, *found, place_.empty() ? key : place_ + "." + key};
}

JsonField JsonField::operator[](size_t index) const {
  return {*file_, value_->at(index), place_ + "[" + std::to_string(index) + "]"};
}

size_t JsonField::Size() const {
  if (!value_->is_array()) Fail("a list");
  return value_->size();
}

std::string JsonField::Text() const {
  if (!value_->is_string()) Fail("a text");
  return value_->get<std::string>();
}

int64_t JsonField::Integer(int64_t low, int64_t high) const {
  std::optional<int64_t> integer = JsonInteger(*value_, low, high);
  if (!integer && value_->is_number_float()) {
    const auto number = value_->get<double>();
    if (number == std::floor(number) && number >= static_cast<double>(low) &&
        number <= static_cast<double>(high)) {
      integer = static_cast<int64_t>(number);
    }
  }
  if (!integer) {
    Fail("a whole number from " + std::to_string(low) + " to " + std::to_string(high));
  }
  return *integer;
}

double JsonField::Number() const {
  if (!value_->is_number()) Fail("a number");
  return value_->get<double>();
}

void JsonField::Fail(const std::string& right) const {
  const std::string text =
      value_->is_array() ? "a list"
      : value_->is_object()
          ? "an object"
          : Shortened(value_->dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
  throw UserError(
      file_->string(), ": ", Place(), " is ", text, ", where ", right, " would be right.");
}

void JsonField::FailBecause(const std::string& what) const {
  throw UserError(file_->string(), ": ", Place(), " ", what, ".");
}

}  // namespace semfoam
