// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

// What the fuzz targets share. Each target is one file with libFuzzer's entry point,
// LLVMFuzzerTestOneInput; without libFuzzer, replay.cc feeds it the corpora.
namespace semfoam {

// A file in memory with a path, which readers that take paths can open: nothing is written to a
// disk. The path has no extension.
class MemoryFile {
 public:
  MemoryFile();
  ~MemoryFile();
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

  void Set(std::string_view bytes) const;
  std::filesystem::path path() const;

 private:
  int descriptor_;
};

// The parts of an input that stands for several files, apart by lines of "--8<--".
std::vector<std::string_view> Parts(std::string_view input);

// Calls `read`, which may throw UserError and nothing else. Aborts where its sentence does not
// begin with `file`, or does not end as one does.
void ReadsOrRefuses(const std::string& file, const std::function<void()>& read);

// Aborts, with a text, where a property that must hold does not.
void Require(bool holds, const char* what);

// Each target says how large a block its readers may take at once, as a multiple of the input's
// bytes; replay.cc holds them to it. A count in a header is no reason to take more.
extern const double kLargestBlockPerByte;

}  // namespace semfoam
