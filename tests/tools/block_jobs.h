// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdlib>
#include <filesystem>
#include <sstream>
#include <string>
#include <vector>

#include "tests/tools/program.h"

// Trainings in blocks by the program itself.
namespace semfoam {

// scene_splitter on the tabletop or a copy of it: a run that is short and worth nothing.
// `blocks`: of --blocks; empty: not given.
inline std::vector<std::string> Splitter(const std::filesystem::path& output,
                                         const std::string& blocks,
                                         const std::vector<std::string>& more = {},
                                         const std::filesystem::path& workspace = kTabletop) {
  std::vector<std::string> arguments = {"scene_splitter",
                                        "--workspace_path",
                                        workspace.string(),
                                        "--output_path",
                                        output.string(),
                                        "--test_every",
                                        "8"};
  if (!blocks.empty()) arguments.insert(arguments.end(), {"--blocks", blocks});
  arguments.insert(arguments.end(), more.begin(), more.end());
  return TinyTraining(arguments);
}

inline Outcome Merge(const std::filesystem::path& blocks, const std::filesystem::path& output) {
  return RunSemfoam(
      {"foam_merger", "--blocks_path", blocks.string(), "--output_path", output.string()});
}

// The lines of jobs.txt.
inline std::vector<std::string> JobsOf(const std::filesystem::path& blocks) {
  std::vector<std::string> jobs;
  std::istringstream lines(ReadFile(blocks / "jobs.txt"));
  for (std::string line; std::getline(lines, line);) jobs.push_back(line);
  return jobs;
}

// The beginning of a shell command that finds `semfoam` on the path.
inline std::string WithPath() {
  return "PATH=" + Quoted(std::filesystem::path(SEMFOAM_PROGRAM).parent_path().string()) +
         ":$PATH; export PATH; ";
}

// Runs a job as a scheduler does, in a shell.
inline int RunJob(const std::string& job) {
  return std::system((WithPath() + job + " 2>/dev/null").c_str());
}

}  // namespace semfoam
