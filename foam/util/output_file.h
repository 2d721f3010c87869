// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/util/scratch_folder.h"

#include <filesystem>
#include <string_view>

namespace semfoam {

// Writes one output file in a hidden folder beside its target and renames it into place, so that no
// reader sees a partial file and an older file survives a failed write.
//
//   OutputFile file("out/scene.vdb");
//   WriteSomehow(file.temporary_path());   // an empty file, named as the target
//   file.Commit();                         // fsync, rename
//
// Without Commit, for example after an exception or a signal, the file is removed.
class OutputFile {
 public:
  // Creates the parent folders if they are missing. Throws UserError where a folder or the file
  // cannot be created.
  explicit OutputFile(std::filesystem::path target);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  const std::filesystem::path& temporary_path() const { return temporary_; }

  // Writes the data to the disk and renames the file to its target. Throws UserError where that
  // fails (disk full).
  void Commit();

 private:
  std::filesystem::path target_;
  ScratchFolder folder_;
  std::filesystem::path temporary_;
  int descriptor_ = -1;
};

// Creates `folder` and its parents if missing, and checks that a file can be created in it. Throws
// UserError naming the folder where it cannot.
void RequireWritableFolder(const std::filesystem::path& folder);

// Writes `text` as a file, by means of OutputFile.
void WriteTextFile(const std::filesystem::path& target, std::string_view text);

}  // namespace semfoam
