// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/cli/option_manager.h"

#include <cmath>
#include <iostream>
#include <sstream>
#include <string>
#include <vector>

#include "tests/fuzz/fuzz_input.h"

// Options: the first part of an input is the .ini file that --project_path names, each line of the
// second an argument of the command line.
namespace semfoam {

const double kLargestBlockPerByte = 64;

namespace {

void Read(const MemoryFile& project, std::string_view command_line) {
  std::string path;
  std::string quality = "medium";
  bool preview = false;
  int test_every = 8;
  int64_t num_rays = 1;
  uint64_t checksum = 0;
  float share = 0;
  double voxel_size = 0;
  OptionManager options("fuzz", "takes every type of option");
  options.AddRequiredOption("path", &path, "a path");
  options.AddChoiceOption("quality", &quality, {"low", "medium"}, "a choice");
  options.AddDefaultOption("preview", &preview, "a switch");
  options.AddDefaultOption("test_every", &test_every, "an int");
  options.AddDefaultOption("FoamTraining.num_rays", &num_rays, "64 bits");
  options.AddDefaultOption("checksum", &checksum, "64 bits without a sign");
  options.AddDefaultOption("share", &share, "a float");
  options.AddDefaultOption("Export.voxel_size", &voxel_size, "a double");
  options.AddShortName("voxel_size", "Export.voxel_size");

  std::vector<std::string> arguments = {"fuzz", "--project_path", project.path().string()};
  std::istringstream lines{std::string(command_line)};
  for (std::string line; std::getline(lines, line);) arguments.push_back(line);
  std::vector<const char*> argv;
  for (const std::string& argument : arguments) argv.push_back(argument.c_str());
  if (!options.Parse(static_cast<int>(argv.size()), argv.data())) return;
  Require(!path.empty(), "what is required is there");
  Require(quality == "low" || quality == "medium", "a choice is one of those offered");
  Require(std::isfinite(share) && std::isfinite(voxel_size), "numbers are finite");
}

}  // namespace
}  // namespace semfoam

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static const semfoam::MemoryFile project;
  static std::ostringstream help;  // -h is an argument like any other
  static std::streambuf* const previous = std::cout.rdbuf(help.rdbuf());
  (void)previous;
  help.str("");
  const auto parts = semfoam::Parts({reinterpret_cast<const char*>(data), size});
  project.Set(parts[0]);
  semfoam::ReadsOrRefuses(
      "", [&] { semfoam::Read(project, parts.size() > 1 ? parts[1] : std::string_view()); });
  return 0;
}
