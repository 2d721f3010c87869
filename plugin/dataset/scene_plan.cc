// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/dataset/scene_plan.h"

#include "foam/util/error.h"
#include "plugin/colmap/colmap_model.h"
#include "plugin/colmap/seeds.h"
#include "plugin/dataset/mask_choice.h"
#include "plugin/dataset/photo_choice.h"
#include "plugin/dataset/ray_tables.h"
#include "plugin/dataset/scene_warnings.h"
#include "plugin/mask/mask_folders.h"

#include <algorithm>
#include <utility>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

fs::path ImagesFile(const fs::path& model_folder) {
  const bool is_binary = FindModelFormat(model_folder) == ModelFormat::kBinary;
  return model_folder / (is_binary ? "images.bin" : "images.txt");
}

std::vector<std::string> WarningsOf(const SceneOptions& options,
                                    const fs::path& model_folder,
                                    const Reconstruction& model,
                                    const ScenePlan& plan) {
  const auto num_views = static_cast<int64_t>(plan.photos.size());
  return NonEmpty({OtherModelsWarning(options.input_path, model_folder, num_views),
                   UnregisteredWarning(options.image_path, plan.num_unregistered, num_views),
                   ReprojectionWarning(model_folder, model),
                   options.use_masks && plan.masks.NumPaired() == 0
                       ? NoMasksWarning(plan.mask_folder, WorkspacesOf(options))
                       : ""});
}

// Image i of the model belongs to photo i of the plan.
void PlanSeeds(Reconstruction model, ScenePlan* plan) {
  plan->num_points = static_cast<int64_t>(model.points.size());
  SeenImages seen;
  if (plan->masks.NumPaired() > 0 && plan->mask_consistency != MaskConsistency::kOff) {
    seen = FindSeenImages(model.images, model.cameras, plan->photos);
  }
  MakeSeeds(
      std::move(model.points), plan->world_from_normalized, seen, &plan->seeds, &plan->seed_tracks);
}

}  // namespace

ScenePlan PlanScene(const SceneOptions& options) {
  const fs::path model_folder = FindModelFolder(options.input_path);
  Reconstruction model = ReadReconstruction(model_folder);
  std::sort(model.images.begin(), model.images.end(), [](const Image& a, const Image& b) {
    return a.name < b.name;
  });
  ScenePlan plan;
  plan.label_zero = options.label_zero;
  plan.mask_consistency = options.mask_consistency;
  ChoosePhotos(options, model, ImagesFile(model_folder), &plan);
  ChooseMasks(options, &plan);
  ChooseIgnoredPixels(options, &plan);
  plan.warnings = WarningsOf(options, model_folder, model, plan);
  plan.world_from_normalized = NormalizedFrameOf(model);
  plan.tracks = SampleTracks(model, plan.photos, options.random_seed);
  plan.lenses = LensOfPhotos(model, plan.photos);
  plan.has_rigs = model.rigs && std::any_of(model.rigs->begin(),
                                            model.rigs->end(),
                                            [](const Rig& rig) { return !rig.others.empty(); });
  PlanSeeds(std::move(model), &plan);
  if (!options.seed_path.empty()) {
    plan.seed_cloud = ReadSeedCloud(options.seed_path, plan.world_from_normalized);
  }
  plan.table_views = ChooseTables(plan.photos);
  return plan;
}

}  // namespace semfoam
