// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/util/scratch_folder.h"

#include <filesystem>
#include <string_view>

namespace semfoam {

// One output file, written in a hidden folder beside its target and renamed into place, so that a
// reader never meets half a file and an older good file survives a failed write.
//
//   OutputFile file("out/scene.vdb");
//   WriteSomehow(file.temporary_path());   // an empty file, named as the target
//   file.Commit();                         // fsync, rename
//
// Without Commit (an exception or a signal on the way, say) nothing is left of it.
class OutputFile {
 public:
  // Makes the parent folders if they are missing. Throws UserError where that, or creating a file
  // there, is not possible.
  explicit OutputFile(std::filesystem::path target);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  const std::filesystem::path& temporary_path() const { return temporary_; }

  // Throws UserError when the data cannot be made durable (disk full) or the rename fails.
  void Commit();

 private:
  std::filesystem::path target_;
  ScratchFolder folder_;
  std::filesystem::path temporary_;
  int descriptor_ = -1;
};

// Makes `folder` (and its parents) if missing and proves that a file can be made in it. Throws
// UserError naming the folder.
void RequireWritableFolder(const std::filesystem::path& folder);

// The whole text as a file, by OutputFile's rules.
void WriteTextFile(const std::filesystem::path& target, std::string_view text);

}  // namespace semfoam
