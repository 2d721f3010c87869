// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace semfoam {

// Returns the parts between the commas, at least one: "a,,b" has three, "" has one.
std::vector<std::string> SplitAtCommas(const std::string& text);

// Joins texts with commas and spaces: "mug (6), knot (10)".
std::string Joined(const std::vector<std::string>& parts);

// Returns the text as one word of a POSIX shell.
std::string ShellQuoted(const std::string& text);

// Convert a value from and to text. ParseValue returns false unless the whole text is one value in
// the type's range; it refuses numbers that are not finite. The text of FormatValue parses to the
// same value.
bool ParseValue(const std::string& text, std::string* value);
bool ParseValue(const std::string& text, bool* value);
bool ParseValue(const std::string& text, int* value);
bool ParseValue(const std::string& text, int64_t* value);
bool ParseValue(const std::string& text, uint64_t* value);
bool ParseValue(const std::string& text, float* value);
bool ParseValue(const std::string& text, double* value);

// Parse a number as people write it, besides the ways of ParseValue: with an exponent ("300e3") or
// one of the suffixes k, M and G for thousands, millions and billions ("20M", "1.5k"; K is k).
// Return false where an integer's value is not whole or not in the type's range, and where
// ParseValue does. Texts and booleans are parsed as by ParseValue.
bool ParseWrittenValue(const std::string& text, std::string* value);
bool ParseWrittenValue(const std::string& text, bool* value);
bool ParseWrittenValue(const std::string& text, int* value);
bool ParseWrittenValue(const std::string& text, int64_t* value);
bool ParseWrittenValue(const std::string& text, uint64_t* value);
bool ParseWrittenValue(const std::string& text, float* value);
bool ParseWrittenValue(const std::string& text, double* value);

std::string FormatValue(const std::string& value);
std::string FormatValue(bool value);
std::string FormatValue(int value);
std::string FormatValue(int64_t value);
std::string FormatValue(uint64_t value);
std::string FormatValue(float value);
std::string FormatValue(double value);

}  // namespace semfoam
