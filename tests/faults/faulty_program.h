// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "tests/temp_folder.h"
#include "tests/tools/few_photos.h"
#include "tests/tools/program.h"

// The built program, with faults put into it (fault_injection.cc).
namespace semfoam {

// Whether this is the long run of the label "slow".
inline bool ManyFaults() { return std::getenv("SEMFOAM_MANY_FAULTS") != nullptr; }

// File -> bytes of all below the folder.
inline std::map<std::string, std::string> Snapshot(const std::filesystem::path& folder) {
  std::map<std::string, std::string> files;
  for (const std::string& file : FilesBelow(folder)) files[file] = ReadFile(folder / file);
  return files;
}

// The same without what an unfinished training keeps to go on from.
inline std::map<std::string, std::string> Results(const std::filesystem::path& folder) {
  std::map<std::string, std::string> files = Snapshot(folder);
  std::erase_if(files, [](const auto& file) { return file.first.starts_with("checkpoints/"); });
  return files;
}

// Whether `bytes` is what a whole run writes, as `good` is. Files whose results are seconds differ
// from run to run: of them only that no end is cut off.
inline bool IsGood(const std::string& file, const std::string& bytes, const std::string& good) {
  if (file == "training_log.csv") {
    const auto commas = [](const std::string& line) {
      return std::count(line.begin(), line.end(), ',');
    };
    const std::string header = good.substr(0, good.find('\n') + 1);
    const size_t last = bytes.size() < 2 ? bytes.npos : bytes.rfind('\n', bytes.size() - 2);
    return bytes.starts_with(header) && bytes.ends_with('\n') && last != bytes.npos &&
           commas(bytes.substr(last)) == commas(header);
  }
  if (file == "training_plot.svg") return bytes.ends_with("</svg>\n");
  // The last chunk, with its checksum.
  if (file == "training_plot.png") return bytes.ends_with("IEND\xAE\x42\x60\x82");
  return bytes == good;
}

// Whether it holds the good files and no others.
inline bool AreGood(const std::map<std::string, std::string>& files,
                    const std::map<std::string, std::string>& good) {
  return std::equal(
      files.begin(), files.end(), good.begin(), good.end(), [](const auto& a, const auto& b) {
        return a.first == b.first && IsGood(a.first, a.second, b.second);
      });
}

// The hidden folders and files below `folder`, of which there must be none once the program ended.
inline std::vector<std::string> HiddenBelow(const std::filesystem::path& folder) {
  std::vector<std::string> hidden;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (entry.path().filename().string()[0] == '.') hidden.push_back(entry.path().string());
  }
  return hidden;
}

// Runs `semfoam arguments` with `fault` (fault_injection.cc says how they are spelled; "" is none)
// on the files below `folder`; what it did is counted in `report`, where that is not empty.
inline Outcome RunWithFault(const std::vector<std::string>& arguments,
                            const std::filesystem::path& folder,
                            const std::string& fault,
                            const std::filesystem::path& report = {}) {
  const std::filesystem::path library(SEMFOAM_FAULT_INJECTION);
  std::vector<std::string> line = {
      // The sanitizers want to be loaded first, and need not be.
      "ASAN_OPTIONS=verify_asan_link_order=0",
      // By its name alone: blanks in a path would part it into several.
      "LD_PRELOAD=" + library.filename().string(),
      "LD_LIBRARY_PATH=" + library.parent_path().string(),
      "SEMFOAM_FAULT_FOLDER=" + folder.string(),
      "SEMFOAM_FAULT=" + fault,
  };
  if (!report.empty()) line.push_back("SEMFOAM_FAULT_REPORT=" + report.string());
  line.push_back(SEMFOAM_PROGRAM);
  line.insert(line.end(), arguments.begin(), arguments.end());
  return RunProgram("/usr/bin/env", line);
}

// The workspace that all tests of the process train on, made at the first call: 16 photos and their
// masks.
inline const std::filesystem::path& FewPhotos() {
  static const TempFolder folder;
  static const std::filesystem::path workspace = [] {
    MakeTabletopOfFewPhotos(folder / "few photos");
    return folder / "few photos";
  }();
  return workspace;
}

// A training of a second, or of more with more rays, whose foam is worth nothing but has cells,
// labels and held-out views.
inline std::vector<std::string> TinyTrainingCommand(const std::filesystem::path& scene,
                                                    const std::filesystem::path& output,
                                                    const std::string& num_rays = "60000") {
  return TrainerOn(scene,
                   output,
                   {"--quality",
                    "low",
                    "--test_every",
                    "8",
                    "--FoamTraining.num_rays",
                    num_rays,
                    "--FoamTraining.rays_per_iteration",
                    "512",
                    "--FoamTraining.final_sites",
                    "2000",
                    "--FoamTraining.max_image_size",
                    "80",
                    "--overwrite",  // these tests run it again and again
                    "1"});
}

}  // namespace semfoam
