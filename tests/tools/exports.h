// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "tests/tools/program.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

// The exporters on a foam, and what labels.json says of the files that they leave.
namespace semfoam {

inline Outcome RunExporter(const std::string& command,
                           const std::filesystem::path& foam,
                           const std::filesystem::path& output,
                           const std::vector<std::string>& options) {
  std::vector<std::string> arguments = {
      command, "--foam_path", foam.string(), "--output_path", output.string()};
  arguments.insert(arguments.end(), options.begin(), options.end());
  return RunSemfoam(arguments);
}

inline nlohmann::json LabelsIn(const std::filesystem::path& output) {
  return nlohmann::json::parse(ReadFile(output / "labels.json"));
}

// The files that labels.json lists.
inline std::set<std::string> ListedIn(const std::filesystem::path& output) {
  std::set<std::string> listed;
  const nlohmann::json labels = LabelsIn(output);
  for (const auto& [format, path] : labels["files"].items()) listed.insert(path);
  for (const nlohmann::json& object : labels["objects"]) {
    for (const auto& [format, path] : object["files"].items()) listed.insert(path);
  }
  return listed;
}

// Expects that labels.json lists every file of the folder but itself and `others`.
inline void ExpectAllListed(const std::filesystem::path& output,
                            const std::set<std::string>& others = {}) {
  std::set<std::string> expected = ListedIn(output);
  expected.insert("labels.json");
  expected.insert(others.begin(), others.end());
  EXPECT_THAT(FilesBelow(output), testing::UnorderedElementsAreArray(expected));
}

}  // namespace semfoam
