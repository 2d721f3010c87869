// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdlib>
#include <filesystem>
#include <string>

#include "tests/plugin/test_util.h"
#include <gtest/gtest.h>

namespace semfoam {

// Runs `colmap arguments`, without a display, and returns what it says; fails the test where it
// fails.
inline std::string RunColmap(const TempFolder& temp, const std::string& arguments) {
  const std::filesystem::path log = temp / "colmap.log";
  const std::string command =
      "QT_QPA_PLATFORM=offscreen colmap " + arguments + " > '" + log.string() + "' 2>&1";
  const int status = std::system(command.c_str());
  std::string output = ReadFile(log);
  EXPECT_EQ(status, 0) << command << "\n" << output;
  return output;
}

// A command from one model to another, whose folder is made, with further options.
inline std::string RunColmap(const TempFolder& temp,
                             const std::string& command,
                             const std::filesystem::path& input,
                             const std::filesystem::path& output,
                             const std::string& options = "") {
  std::filesystem::create_directories(output);
  return RunColmap(temp,
                   command + " --input_path '" + input.string() + "' --output_path '" +
                       output.string() + "' " + options);
}

}  // namespace semfoam
