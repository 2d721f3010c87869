// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/views/trajectory.h"

#include "tests/fuzz/fuzz_input.h"

// Paths of one's own for foam_renderer --trajectory; the first byte says whether the foam has a
// photo that tells what the path leaves out.
namespace semfoam {

// Poses are as many as "frames" says, at most 100000.
const double kLargestBlockPerByte = 1e6;

namespace {

Model WithPhoto() {
  Model model;
  PhotoRecord photo;
  photo.name = "a.jpg";
  photo.camera_model = "SIMPLE_RADIAL";
  photo.width = 640;
  photo.height = 480;
  photo.camera_params = {500, 320, 240, -0.1};
  model.photos.push_back(photo);
  return model;
}

}  // namespace
}  // namespace semfoam

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static const semfoam::MemoryFile file;
  static const semfoam::Model with_photo = semfoam::WithPhoto();
  static const semfoam::Model without;
  if (size == 0) return 0;
  file.Set({reinterpret_cast<const char*>(data) + 1, size - 1});
  semfoam::ReadsOrRefuses(file.path(), [&] {
    const semfoam::Trajectory trajectory =
        semfoam::ReadTrajectory(file.path(), data[0] == 'p' ? with_photo : without, {});
    for (const semfoam::Pose& pose : trajectory.cam_from_world) {
      semfoam::Require(pose.rotation.coeffs().allFinite() && pose.translation.allFinite(),
                       "a frame has a pose");
    }
  });
  return 0;
}
