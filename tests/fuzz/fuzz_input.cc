// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/fuzz/fuzz_input.h"

#include "foam/util/error.h"

#include <cstdio>
#include <cstdlib>

#include <sys/mman.h>
#include <unistd.h>

namespace semfoam {

MemoryFile::MemoryFile() : descriptor_(::memfd_create("fuzz", MFD_CLOEXEC)) {
  Require(descriptor_ >= 0, "there is a file in memory");
}

MemoryFile::~MemoryFile() { ::close(descriptor_); }

void MemoryFile::Set(std::string_view bytes) const {
  Require(::ftruncate(descriptor_, 0) == 0, "the file can be emptied");
  while (!bytes.empty()) {
    const off_t at = ::lseek(descriptor_, 0, SEEK_END);
    const ssize_t written = ::pwrite(descriptor_, bytes.data(), bytes.size(), at);
    Require(written > 0, "the file can be written");
    bytes.remove_prefix(static_cast<size_t>(written));
  }
}

std::filesystem::path MemoryFile::path() const {
  return "/proc/self/fd/" + std::to_string(descriptor_);
}

std::vector<std::string_view> Parts(std::string_view input) {
  constexpr std::string_view kBetween = "--8<--\n";
  std::vector<std::string_view> parts;
  for (;;) {
    const size_t end = input.find(kBetween);
    parts.push_back(input.substr(0, end));
    if (end == std::string_view::npos) return parts;
    input.remove_prefix(end + kBetween.size());
  }
}

void ReadsOrRefuses(const std::string& file, const std::function<void()>& read) {
  try {
    read();
  } catch (const UserError& error) {
    const std::string_view sentence = error.what();
    if (!sentence.starts_with(file) || !(sentence.ends_with('.') || sentence.ends_with('?'))) {
      std::fprintf(stderr, "\"%s\"\n", error.what());
      Require(false, "the sentence begins with the file and has an end");
    }
  }
}

void Require(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "Does not hold: %s\n", what);
  std::abort();
}

}  // namespace semfoam
