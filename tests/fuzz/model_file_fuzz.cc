// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/model/model.h"
#include "plugin/colmap/camera_rays.h"

#include <string>

#include "tests/fuzz/fuzz_input.h"

#define XXH_INLINE_ALL
#include <xxhash.h>

// scene.foam. An input is such a file without its checksum, which is made right: it would stop
// nearly every changed file at once.
namespace semfoam {

const double kLargestBlockPerByte = 16;

namespace {

void Read(const MemoryFile& file) {
  const Model model = ReadModel(file.path());
  const Foam& foam = model.foam;
  const size_t n = foam.NumSites();
  Require(foam.raw_density.size() == n && foam.sh.size() == n * foam.ShStride(),
          "every site has its density and colour");
  Require(!foam.HasSemantics() || foam.identity.size() == n * kIdentityDim,
          "every site has its identity");
  Require(model.labels.size() == static_cast<size_t>(foam.num_classes), "every class has a label");
  for (const PhotoRecord& photo : model.photos) {
    CameraOf(photo, file.path());
    Require(PoseOf(photo).UnitRotation().coeffs().allFinite(), "a photo has a pose");
  }
}

}  // namespace
}  // namespace semfoam

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static const semfoam::MemoryFile file;
  std::string bytes(reinterpret_cast<const char*>(data), size);
  const uint64_t checksum = XXH64(data, size, 0);
  bytes.append(reinterpret_cast<const char*>(&checksum), sizeof(checksum));
  file.Set(bytes);
  semfoam::ReadsOrRefuses(file.path(), [] { semfoam::Read(file); });
  return 0;
}
