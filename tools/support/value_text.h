// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace semfoam {

// The parts between the commas, at least one: "a,,b" has three, "" has one.
std::vector<std::string> SplitAtCommas(const std::string& text);

// "mug (6), knot (10)": apart by commas and blanks.
std::string Joined(const std::vector<std::string>& parts);

// One value from and to text: the whole text must be the value, in its type's range; numbers that
// are not finite are refused. FormatValue's text reads back as the same value.
bool ParseValue(const std::string& text, std::string* value);
bool ParseValue(const std::string& text, bool* value);
bool ParseValue(const std::string& text, int* value);
bool ParseValue(const std::string& text, int64_t* value);
bool ParseValue(const std::string& text, uint64_t* value);
bool ParseValue(const std::string& text, float* value);
bool ParseValue(const std::string& text, double* value);
std::string FormatValue(const std::string& value);
std::string FormatValue(bool value);
std::string FormatValue(int value);
std::string FormatValue(int64_t value);
std::string FormatValue(uint64_t value);
std::string FormatValue(float value);
std::string FormatValue(double value);

}  // namespace semfoam
