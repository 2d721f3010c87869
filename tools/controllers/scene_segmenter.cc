// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/controllers/scene_segmenter.h"

#include "export/scene/object_selection.h"
#include "tools/controllers/export_choice.h"
#include "tools/controllers/export_objects.h"
#include "tools/controllers/export_record.h"
#include "tools/controllers/export_surfaces.h"
#include "tools/controllers/export_volumes.h"
#include "tools/controllers/label_names.h"

#include <memory>
#include <utility>
#include <vector>

#include <glog/logging.h>

namespace semfoam {

void SegmentScene(SceneSegmenterOptions options) {
  const std::filesystem::path& output_path = options.output_path;
  TrainingRun& run = options.run;
  CompleteTrainingRun(&run);
  run.when_planned = [&](const ScenePlan& plan) {
    RequirePossible(
        PlannedExport{options.choice, options.volume, options.frame, options.formats, output_path},
        plan);
  };
  run.when_labels_are_known = [&](const std::vector<Label>& labels) {
    RequirePossible(options.choice, options.frame, labels);
  };

  TrainingFolder folder(output_path, options.checkpoints, options.resume_command);
  if (folder.IsFinished()) {
    WarnOfOtherNames(output_path, run.scene.labels_path.string());
    return;
  }
  folder.RequireReplaceable();
  const std::filesystem::path foam_path = folder.path() / "scene.foam";
  Model model = TrainAndWrite(&folder, &run);
  TakeLabelNames(foam_path, {}, {}, &model);
  const ExportableScene scene = PrepareExport(model, foam_path, options.frame, options.components);
  std::vector<std::string> without_object;
  VolumeExportOptions volume = options.volume;
  SurfaceExportOptions surface = options.surface;
  volume.objects = surface.objects = FilterObjects(scene, options.choice, &without_object);
  FinishedExport finished{ModelChecksum(foam_path), {}, /*is_new_foam=*/true};
  volume.source_checksum = surface.source_checksum = finished.foam_checksum;
  if (options.formats.count(ExportFormat::kVdb) != 0) {
    finished.files = WriteVolumes(scene, output_path, volume);
  }
  if (options.formats != std::set<ExportFormat>{ExportFormat::kVdb}) {
    surface.crop = volume.crop;
    std::unique_ptr<TexturePhotos> photos;
    if (options.has_textures && TakesTextures(options.formats)) {
      photos = MakeTextureSource(model, scene, foam_path, run.scene, options.texture_format);
      surface.photos = photos.get();
    }
    const std::vector<WrittenFile> meshes =
        IsWhole(model) ? WriteWholeMesh(PrepareWhole(model, scene.transform, options.components),
                                        output_path,
                                        options.formats,
                                        surface)
                       : WriteMeshes(scene, output_path, options.formats, surface);
    finished.files.insert(finished.files.end(), meshes.begin(), meshes.end());
  }
  WriteLabels(scene, output_path, finished);
  if (options.when_exported) options.when_exported(model, scene);
  folder.Finish();
  for (const std::string& label : without_object) {
    LOG(WARNING) << "No files for " << label << ", which labels names: the training made no object "
                 << "of it; labels.json and the lines above say why.";
  }
  const size_t num_objects = SelectObjects(scene, volume.objects).size();
  const std::string what =
      IsWhole(model) ? "No labels, so the scene is whole"
                     : std::to_string(num_objects) + (num_objects == 1 ? " object" : " objects");
  LOG(INFO) << what << ", everything is in " << output_path.string();
}

}  // namespace semfoam
