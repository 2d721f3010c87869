// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask/mask_tables.h"

#include "tests/fuzz/fuzz_input.h"

// labels.json: the names of the masks' ids.
namespace semfoam {

const double kLargestBlockPerByte = 32;

}  // namespace semfoam

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static const semfoam::MemoryFile file;
  file.Set({reinterpret_cast<const char*>(data), size});
  semfoam::ReadsOrRefuses(file.path(), [] { semfoam::ReadLabelNames(file.path()); });
  return 0;
}
