// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/geometry/guard_sites.h"
#include "plugin/colmap/seed_cloud.h"

#include "tests/fuzz/fuzz_input.h"

// Dense point clouds, as --seed_path takes them.
namespace semfoam {

const double kLargestBlockPerByte = 256;

}  // namespace semfoam

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static const semfoam::MemoryFile file;
  file.Set({reinterpret_cast<const char*>(data), size});
  semfoam::ReadsOrRefuses(file.path(), [] {
    const semfoam::SeedCloud cloud = semfoam::ReadSeedCloud(file.path(), {}, /*most=*/8);
    semfoam::Require(!cloud.points.empty() && cloud.points.size() <= 8, "there are 1 to 8 points");
    for (const semfoam::SeedPoint& point : cloud.points) {
      semfoam::Require(point.position.norm() <= 1.0001f * semfoam::kFarRadius,
                       "a point lies in the scene");
      semfoam::Require(point.color.minCoeff() >= 0 && point.color.maxCoeff() <= 1,
                       "a colour can be shown");
    }
  });
  return 0;
}
