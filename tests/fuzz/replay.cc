// SPDX-License-Identifier: GPL-3.0-or-later
//
// Feeds every file of the folders given, and every cut and some changes of it, to a fuzz target
// built without libFuzzer, and watches what its readers allocate.
#include <algorithm>
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <new>
#include <string>
#include <vector>

#include "tests/fuzz/fuzz_input.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size);

namespace {

// What any reader may take, however small its file: buffers of streams, of TBB.
constexpr double kAlwaysAllowed = 1 << 20;

std::atomic<size_t> allowed_block = SIZE_MAX;

}  // namespace

#ifndef __SANITIZE_ADDRESS__
// A reader that believes a count asks for what it says in one block.
void* operator new(size_t size) {
  if (size > allowed_block) {
    std::fprintf(stderr, "One block of %zu bytes, %zu are allowed\n", size, allowed_block.load());
    std::abort();
  }
  if (void* block = std::malloc(size)) return block;
  throw std::bad_alloc();
}
void operator delete(void* block) noexcept { std::free(block); }
void operator delete(void* block, size_t) noexcept { std::free(block); }
#endif

namespace {

void Run(const std::string& input) {
  allowed_block = static_cast<size_t>(kAlwaysAllowed + semfoam::kLargestBlockPerByte *
                                                           static_cast<double>(input.size()));
  LLVMFuzzerTestOneInput(reinterpret_cast<const uint8_t*>(input.data()), input.size());
  allowed_block = SIZE_MAX;
}

// The file, some 300 cuts of it, and as many with one byte changed.
int RunAround(const std::string& input) {
  const size_t step = std::max<size_t>(1, input.size() / 300);
  Run(input);
  int count = 1;
  for (size_t at = 0; at < input.size(); at += step) {
    Run(input.substr(0, at));
    std::string changed = input;
    changed[at] = static_cast<char>(changed[at] ^ (at % 2 == 0 ? 0x80 : 0x01));
    Run(changed);
    count += 2;
  }
  return count;
}

}  // namespace

int main(int argc, char** argv) {
  namespace fs = std::filesystem;
  int files = 0, inputs = 0;
  for (int i = 1; i < argc; ++i) {
    std::vector<fs::path> paths;
    for (const auto& entry : fs::directory_iterator(argv[i])) paths.push_back(entry.path());
    std::sort(paths.begin(), paths.end());
    for (const fs::path& path : paths) {
      std::ifstream file(path, std::ios::binary);
      std::printf("%s\n", path.filename().c_str());
      std::fflush(stdout);
      inputs += RunAround({std::istreambuf_iterator<char>(file), {}});
      ++files;
    }
  }
  std::printf("%d files, %d inputs\n", files, inputs);
  return files > 0 ? EXIT_SUCCESS : EXIT_FAILURE;
}
