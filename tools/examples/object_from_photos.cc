// SPDX-License-Identifier: GPL-3.0-or-later
//
// object_from_photos WORKSPACE OUTPUT NAME: trains a foam on a COLMAP workspace with masks, takes
// one object out, and writes it as a volume and as surfaces.
#include "export/io/surface_export.h"
#include "export/io/volume_export.h"
#include "export/scene/object_selection.h"
#include "foam/edit/object_editing.h"
#include "foam/train/trainer.h"
#include "foam/util/error.h"
#include "plugin/dataset/scene.h"

#include <iostream>

using namespace semfoam;

int main(int argc, char** argv) try {
  if (argc != 4) throw UserError("object_from_photos WORKSPACE OUTPUT NAME");
  const std::filesystem::path workspace = argv[1], output = argv[2];
  SceneOptions input;
  input.image_path = workspace / "images";
  input.input_path = workspace / "sparse";
  const TrainingScene photos(PlanScene(input));

  TrainingOptions training;
  training.num_rays = 1'000'000;  // a quick look; 20 million and more for good
  training.final_sites = 10'000;
  TrainingSummary trained = TrainFoam(
      photos, photos.Seeds(), photos.NumClasses(), training, [](const TrainingProgress& progress) {
        std::cerr << "\r" << 100 * progress.iteration / progress.num_iterations << " %";
      });
  const Model scene = {trained.foam,
                       trained.statistics,
                       photos.WorldFromNormalized(),
                       photos.Labels(),
                       photos.Photos(),
                       {}};

  const ExportableScene cells = MakeExportableScene(scene);
  const ObjectInfo& object = *SelectObjects(cells, LabelChoice{argv[3]}).at(0);
  int32_t class_index = 0;
  while (scene.labels[class_index].id != object.id) ++class_index;
  const Model alone = ExtractObjects(scene, cells.delaunay, {{class_index, object.cells}}).model;
  WriteModel(output / "scene.foam", alone);

  const ExportableScene assets = MakeExportableScene(alone);
  ExportVolumes(assets, output, {});
  for (const WrittenFile& file : ExportSurfaces(assets, output)) {
    std::cout << file.path << ": " << file.summary << "\n";
  }
} catch (const UserError& error) {
  std::cerr << "\nERROR: " << error.what() << "\n";
  return 1;
}
