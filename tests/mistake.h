// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cctype>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

// What tests of error messages and warnings assert: which file is at fault, which of its fields or
// values, and what is wrong with them. The wording of whole messages is under test in
// tests/bad_input/golden_sentences_test.cc alone.

namespace semfoam {

struct Mistake {
  // The file or folder at fault, with which the message begins ("FILE: ..."), as a whole or from a
  // "/" on. Empty if no file is at fault.
  std::string file;
  // Fields, records and values that the message names, each at least once and not as a part of a
  // longer word or number. Options without their leading dashes.
  std::vector<std::string> named;
  // Key phrase of the kind of mistake, such as "is missing" or "no valid JSON".
  std::string kind;
};

// Whether `phrase` stands in `text`, not as a part of a longer word or number.
inline bool HoldsPhrase(const std::string& text, const std::string& phrase) {
  const auto is_digit = [&](size_t i) {
    return i < text.size() && std::isdigit(static_cast<unsigned char>(text[i])) != 0;
  };
  const auto is_word = [&](size_t i) {
    return i < text.size() &&
           (std::isalnum(static_cast<unsigned char>(text[i])) != 0 || text[i] == '_');
  };
  // Whether the characters before and from `i` on belong to one word, or to one decimal number.
  const auto joined = [&](size_t i) {
    if (i == 0) return false;
    if (is_word(i - 1) && is_word(i)) return true;
    const auto is_point = [&](size_t k) {
      return k > 0 && k < text.size() && text[k] == '.' && is_digit(k - 1) && is_digit(k + 1);
    };
    return is_point(i) || is_point(i - 1);
  };
  if (phrase.empty()) return false;
  for (size_t at = 0; (at = text.find(phrase, at)) != std::string::npos; ++at) {
    if (!joined(at) && !joined(at + phrase.size())) return true;
  }
  return false;
}

// Why `message` is not as every message of the program is: one line that ends as a sentence and
// tells nothing of the program's inside. Empty if it is.
inline std::string FaultOfSentence(const std::string& message) {
  if (message.empty()) return "there is no message";
  if (message.find('\n') != std::string::npos) return "it has more than one line";
  if (message.back() != '.' && message.back() != '?') return "it does not end as a sentence";
  for (const char* inside : {"terminate called", "what():", "std::", "Check failed", "json.exc"}) {
    if (message.find(inside) != std::string::npos) {
      return "it holds '" + std::string(inside) + "'";
    }
  }
  return "";
}

// Why `message` is not one sentence about the mistake. Empty if it is.
inline std::string FaultOfMessage(std::string message, const Mistake& mistake) {
  std::string fault = FaultOfSentence(message);
  if (!fault.empty()) return fault;
  for (const std::string prefix : {"ERROR: ", "WARNING: "}) {
    if (message.starts_with(prefix)) message.erase(0, prefix.size());
  }
  const std::string& file = mistake.file;
  if (!file.empty()) {
    const size_t at = message.find(file + ": ");
    const bool from_slash = at != std::string::npos && at > 0 && message[at - 1] == '/' &&
                            message.find(": ") == at + file.size();
    if (at != 0 && !from_slash) return "it does not begin with '" + file + ": '";
    message.erase(0, at + file.size() + 2);
  }
  for (const std::string& name : mistake.named) {
    if (!HoldsPhrase(message, name)) return "it does not name '" + name + "'";
  }
  if (!HoldsPhrase(message, mistake.kind)) return "it does not say '" + mistake.kind + "'";
  return "";
}

MATCHER(IsOneSentence, "is one sentence for a user") {
  const std::string fault = FaultOfSentence(arg);
  *result_listener << fault;
  return fault.empty();
}

MATCHER_P(TellsOf, mistake, "is one sentence that tells of the mistake") {
  const std::string fault = FaultOfMessage(arg, mistake);
  *result_listener << fault;
  return fault.empty();
}

// Matches one sentence that names the file, the fields or values and the kind of a mistake.
inline auto NamesMistake(std::string file, std::vector<std::string> named, std::string kind) {
  return TellsOf(Mistake{std::move(file), std::move(named), std::move(kind)});
}

}  // namespace semfoam
