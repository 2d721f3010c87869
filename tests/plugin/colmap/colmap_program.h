// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/geometry/sim3.h"

#include <cstdlib>
#include <filesystem>
#include <sstream>
#include <string>

#include "tests/plugin/test_util.h"
#include <Eigen/Geometry>
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

// Whether it is like COLMAP 3.10 (else like 3.8) in the names of options and in transforms.
inline bool ColmapIsNew(const TempFolder& temp) {
  return RunColmap(temp, "model_aligner -h").find(" --alignment_max_error") != std::string::npos;
}

// The option of `colmap model_aligner` for the largest error of a position.
inline std::string MaxErrorOption(const TempFolder& temp) {
  return ColmapIsNew(temp) ? "--alignment_max_error" : "--robust_alignment_max_error";
}

// Writes a file for `colmap model_transformer --transform_path`: a matrix, or, as 3.10
// reads it, the scale, the quaternion (w first) and the translation.
inline void WriteColmapTransform(const TempFolder& temp,
                                 const Sim3& transform,
                                 const std::filesystem::path& path) {
  std::ostringstream text;
  text.precision(17);
  if (ColmapIsNew(temp)) {
    const Eigen::Quaterniond q(transform.rotation);
    text << transform.scale << " " << q.w() << " " << q.x() << " " << q.y() << " " << q.z() << " "
         << transform.translation.transpose() << "\n";
  } else {
    for (int row = 0; row < 3; ++row) {
      text << transform.scale * transform.rotation.row(row) << " " << transform.translation[row]
           << "\n";
    }
    text << "0 0 0 1\n";
  }
  WriteFile(path, text.str());
}

}  // namespace semfoam
