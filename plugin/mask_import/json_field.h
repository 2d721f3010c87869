// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/util/error.h"

#include <cstdint>
#include <filesystem>
#include <string>

#include <nlohmann/json.hpp>

namespace semfoam {

// A value in a JSON file with its place, so that errors can tell both. All functions throw
// UserError, one sentence: "masks.json: annotations[3].image_id is 7.5, where a whole number from 0
// to 9 would be right." Neither the file's name nor the value is copied; both must outlive it.
class JsonField {
 public:
  JsonField(const std::filesystem::path& file, const nlohmann::json& value, std::string place = "")
      : file_(&file), value_(&value), place_(std::move(place)) {}

  const nlohmann::json& value() const { return *value_; }

  // Whether it is an object with this member, other than null.
  bool Has(const char* key) const;
  // The member of an object, and the element of a list.
  JsonField operator[](const char* key) const;
  JsonField operator[](size_t index) const;

  // The number of elements of a list.
  size_t Size() const;
  bool IsText() const { return value_->is_string(); }
  bool IsList() const { return value_->is_array(); }
  bool IsObject() const { return value_->is_object(); }
  std::string Text() const;
  // A whole number, written as 7 or 7.0.
  int64_t Integer(int64_t low, int64_t high) const;
  // A finite number.
  double Number() const;

  // Throws the sentence "FILE: PLACE is VALUE, where `right` would be right."
  [[noreturn]] void Fail(const std::string& right) const;
  // Throws the sentence "FILE: PLACE `what`."
  [[noreturn]] void FailBecause(const std::string& what) const;

 private:
  // The place, for the beginning of a sentence.
  std::string Place() const { return place_.empty() ? "the file" : place_; }

  const std::filesystem::path* file_;
  const nlohmann::json* value_;
  std::string place_;
};

// Sides of pictures that annotations may claim.
inline constexpr int kLargestSide = 65535;

}  // namespace semfoam
