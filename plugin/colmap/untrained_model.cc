// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/colmap/untrained_model.h"

#include "foam/optim/initialization.h"
#include "foam/util/error.h"
#include "plugin/colmap/camera_rays.h"
#include "plugin/colmap/seeds.h"

#include <algorithm>
#include <map>
#include <utility>
#include <vector>

namespace semfoam {

Model UntrainedModel(const Reconstruction& reconstruction,
                     const std::filesystem::path& model_folder,
                     uint64_t random_seed) {
  if (reconstruction.images.empty()) {
    throw UserError(model_folder.string(),
                    ": has no registered image, so nothing says from where its points are seen.");
  }
  std::map<uint32_t, const Camera*> cameras;
  for (const Camera& camera : reconstruction.cameras) cameras[camera.id] = &camera;

  Model model;
  model.world_from_normalized = NormalizedFrameOf(reconstruction);
  std::vector<Eigen::Vector3d> centers;
  for (const Image& image : reconstruction.images) {
    const Camera& camera = *cameras.at(image.camera_id);
    model.photos.push_back(MakePhotoRecord(camera, image, /*held_out=*/false));
    centers.push_back(model.world_from_normalized.Invert(image.cam_from_world.Center()));
  }
  std::sort(model.photos.begin(), model.photos.end(), [](const auto& a, const auto& b) {
    return a.name < b.name;
  });

  std::vector<SeedPoint> seeds;
  std::vector<PixelObservations> observations;
  MakeSeeds(reconstruction.points, model.world_from_normalized, {}, &seeds, &observations);
  InitializationOptions options;
  options.max_seed_sites = seeds.size();
  options.sh_degree = 0;
  options.seed = random_seed;
  model.foam = InitialFoam(seeds, centers, options);
  return model;
}

}  // namespace semfoam
