// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "tests/mistake.h"
#include "tests/temp_folder.h"
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

// The built program as its users meet it: run in a shell, judged by exit code, text and files.
namespace semfoam {

inline const std::filesystem::path kTabletop = SEMFOAM_TEST_DATA "/tabletop";

inline std::string ReadFile(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  EXPECT_TRUE(file.good()) << path;
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

inline void WriteFile(const std::filesystem::path& path, const std::string& bytes) {
  std::ofstream file(path, std::ios::binary);
  file << bytes;
  EXPECT_TRUE(file.good()) << path;
}

// As labels.json and the metadata of volumes name a model: the checksum that ends its file.
inline std::string ChecksumOf(const std::filesystem::path& foam_path) {
  const std::string foam = ReadFile(foam_path);
  uint64_t checksum = 0;
  foam.copy(reinterpret_cast<char*>(&checksum), sizeof(checksum), foam.size() - sizeof(checksum));
  char text[17];
  std::snprintf(text, sizeof(text), "%016llx", static_cast<unsigned long long>(checksum));
  return text;
}

struct Outcome {
  int exit_code = -1;
  std::string out;
  std::string err;

  // The lines of stderr that begin with "ERROR:".
  std::vector<std::string> Errors() const {
    std::vector<std::string> errors;
    std::istringstream lines(err);
    for (std::string line; std::getline(lines, line);) {
      if (line.rfind("ERROR:", 0) == 0) errors.push_back(line);
    }
    return errors;
  }
};

// Expects what every refusal is: exit code 1, and one line of error, which tells of the mistake.
inline void ExpectRefused(const Outcome& outcome, const Mistake& mistake) {
  EXPECT_EQ(outcome.exit_code, 1) << outcome.err;
  EXPECT_THAT(outcome.Errors(), testing::ElementsAre(TellsOf(mistake))) << outcome.err;
}

inline std::string Quoted(const std::string& text) {
  std::string quoted = "'";
  for (const char c : text) {
    if (c == '\'') {
      quoted += "'\\''";
    } else {
      quoted += c;
    }
  }
  return quoted + "'";
}

inline Outcome RunProgram(const std::string& program, const std::vector<std::string>& arguments) {
  const TempFolder folder;
  std::string command = Quoted(program);
  for (const std::string& argument : arguments) command += " " + Quoted(argument);
  command += " >" + Quoted((folder / "out").string()) + " 2>" + Quoted((folder / "err").string());
  const int status = std::system(command.c_str());
  Outcome outcome;
  outcome.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  outcome.out = ReadFile(folder / "out");
  outcome.err = ReadFile(folder / "err");
  return outcome;
}

inline Outcome RunSemfoam(const std::vector<std::string>& arguments) {
  return RunProgram(SEMFOAM_PROGRAM, arguments);
}

// A command line that is refused, and why.
struct BadArguments {
  std::vector<std::string> arguments;
  Mistake mistake;
};

// Expects that `command` refuses each of these arguments behind its own, and leaves no file below
// `output`.
inline void ExpectEachRefused(const std::vector<std::string>& command,
                              const std::vector<BadArguments>& cases,
                              const std::filesystem::path& output) {
  for (const BadArguments& bad : cases) {
    std::vector<std::string> arguments = command;
    arguments.insert(arguments.end(), bad.arguments.begin(), bad.arguments.end());
    ExpectRefused(RunSemfoam(arguments), bad.mistake);
    EXPECT_THAT(FilesBelow(output), testing::IsEmpty()) << bad.mistake.kind;
  }
}

// foam_trainer on the photos, the model and the masks of a workspace, with these options besides.
inline std::vector<std::string> TrainerOn(const std::filesystem::path& workspace,
                                          const std::filesystem::path& output,
                                          const std::vector<std::string>& more = {}) {
  std::vector<std::string> arguments = {"foam_trainer",
                                        "--image_path",
                                        (workspace / "images").string(),
                                        "--input_path",
                                        (workspace / "sparse/0").string(),
                                        "--mask_path",
                                        (workspace / "object_mask").string(),
                                        "--output_path",
                                        output.string()};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return arguments;
}

// With the options of a run that is short and worth nothing but does everything, as far as
// `arguments` do not give them.
inline std::vector<std::string> TinyTraining(std::vector<std::string> arguments) {
  const std::pair<std::string, std::string> tiny[] = {{"--quality", "low"},
                                                      {"--FoamTraining.num_rays", "300000"},
                                                      {"--FoamTraining.rays_per_iteration", "512"},
                                                      {"--FoamTraining.sweep_photos", "0"},
                                                      {"--FoamTraining.final_sites", "4000"}};
  for (const auto& [name, value] : tiny) {
    if (std::find(arguments.begin(), arguments.end(), name) != arguments.end()) continue;
    arguments.push_back(name);
    arguments.push_back(value);
  }
  return arguments;
}

// A copy of the tabletop scene, without what is for scoring alone, to be spoilt by a test.
inline void CopyTabletop(const std::filesystem::path& target) {
  std::filesystem::create_directories(target);
  for (const char* part : {"images", "sparse", "object_mask", "labels.json"}) {
    std::filesystem::copy(
        kTabletop / part, target / part, std::filesystem::copy_options::recursive);
  }
}

}  // namespace semfoam
