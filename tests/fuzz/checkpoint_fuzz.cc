// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/train/checkpoint.h"

#include <string>

#include "tests/fuzz/fuzz_input.h"

#define XXH_INLINE_ALL
#include <xxhash.h>

// Checkpoints. An input is such a file; the checksums of its header and of its one array are made
// right: they would stop nearly every changed file at once.
namespace semfoam {

const double kLargestBlockPerByte = 16;

namespace {

constexpr size_t kPreambleBytes = 24;

uint64_t Number(const std::string& bytes, size_t at) {
  uint64_t value = 0;
  bytes.copy(reinterpret_cast<char*>(&value), sizeof(value), at);
  return value;
}

void Seal(size_t begin, size_t end, std::string* bytes) {
  const uint64_t checksum = XXH64(bytes->data() + begin, end - begin, 0);
  bytes->replace(end, 8, reinterpret_cast<const char*>(&checksum), 8);
}

std::string WithChecksums(std::string bytes) {
  if (bytes.size() < kPreambleBytes + 8 + 16) return bytes;
  const uint64_t header = Number(bytes, 16);
  if (header > bytes.size() - kPreambleBytes - 8 - 16) return bytes;
  Seal(0, kPreambleBytes + header, &bytes);
  const size_t array = kPreambleBytes + header + 8;
  if (bytes.size() >= array + 8 + 16) Seal(array, bytes.size() - 16 - 8, &bytes);
  const uint64_t size = bytes.size();
  return bytes.replace(bytes.size() - 8, 8, reinterpret_cast<const char*>(&size), 8);
}

}  // namespace
}  // namespace semfoam

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static const semfoam::MemoryFile file;
  file.Set(semfoam::WithChecksums({reinterpret_cast<const char*>(data), size}));
  semfoam::ReadsOrRefuses(file.path(), [] {
    const semfoam::Checkpoint checkpoint(file.path());
    for (const char* name : {"one", "positions"}) {
      if (checkpoint.HasArray(name)) checkpoint.Array(name);
      checkpoint.Texts(name);
    }
  });
  return 0;
}
