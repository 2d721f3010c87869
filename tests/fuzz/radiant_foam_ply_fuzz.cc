// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/io/radiant_foam_ply.h"

#include "tests/fuzz/fuzz_input.h"

// PLY files of points, as foam_converter takes them from Radiant Foam.
namespace semfoam {

const double kLargestBlockPerByte = 64;

}  // namespace semfoam

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static const semfoam::MemoryFile file;
  file.Set({reinterpret_cast<const char*>(data), size});
  semfoam::ReadsOrRefuses(file.path(), [] {
    const semfoam::Model model = semfoam::ReadRadiantFoamPly(file.path());
    for (const Eigen::Vector3f& site : model.foam.positions) {
      semfoam::Require(site.allFinite(), "a site lies somewhere");
    }
  });
  return 0;
}
