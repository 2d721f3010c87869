// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/scene/object_selection.h"
#include "tools/commands/commands.h"
#include "tools/controllers/block_export.h"
#include "tools/controllers/export_choice.h"
#include "tools/controllers/export_objects.h"
#include "tools/controllers/export_record.h"
#include "tools/controllers/export_volumes.h"
#include "tools/controllers/label_names.h"
#include "tools/options/block_export_options.h"
#include "tools/options/export_options.h"
#include "tools/options/frame_options.h"
#include "tools/options/progress_option.h"
#include "tools/support/output_lock.h"

#include <string>
#include <vector>

namespace semfoam {

namespace {

// Throws UserError for options that need more than one block at a time.
void RequireOneBlockAtATime(const OptionManager& options) {
  // Without points, and without more than one sample in a voxel, which may lie in several blocks.
  RequireByBlock(options,
                 {"VolumeExport.voxel_size",
                  "VolumeExport.max_resolution",
                  "VolumeExport.crop",
                  "VolumeExport.min_optical_depth",
                  "VolumeExport.density_grid_name",
                  "VolumeExport.color_grid_name",
                  "VolumeExport.label_grid_name",
                  "VolumeExport.confidence_grid_name",
                  "VolumeExport.surface_grid_name",
                  "VolumeExport.label_grid_type",
                  "VolumeExport.half_float",
                  "VolumeExport.nvdb",
                  "VolumeExport.max_voxels"});
}

}  // namespace

void RunVolumeExporter(int argc, char** argv) {
  std::string foam_path;
  std::string blocks_path;
  std::string output_path;
  std::string labels_path;
  VolumeExportOptions volume;
  LabelChoice choice;
  ComponentOptions components;
  FrameOptions frame_options;
  OptionManager options("volume_exporter",
                        "Writes the scene and every object of a foam as OpenVDB volumes.");
  options.AddRequiredOption("foam_path", &foam_path, "the model, scene.foam");
  options.AddRequiredOption(
      "output_path", &output_path, "folder for scene*.vdb, objects/*.vdb and labels.json");
  AddBlocksPathOption(&options, &blocks_path);
  AddLabelOptions(&options, &choice);
  AddVolumeLabelsName(&options);
  AddLabelNamesOption(&options, &labels_path);
  AddVolumeExportOptions(&options, &volume);
  AddComponentOptions(&options, &components);
  AddFrameOptions(&options, &frame_options);
  AddProgressOption(&options);
  options.SetFrequentOptions({"blocks_path",
                              "labels",
                              "exclude_labels",
                              "VolumeExport.voxel_size",
                              "VolumeExport.max_resolution",
                              "VolumeExport.crop",
                              "VolumeExport.supersample",
                              "VolumeExport.half_float",
                              "VolumeExport.nvdb",
                              "VolumeExport.points",
                              "level",
                              "up_axis",
                              "scale"});
  if (!options.Parse(argc, argv)) return;
  const bool is_by_block = options.IsGiven("blocks_path");
  if (is_by_block) RequireOneBlockAtATime(options);
  RequireValid(volume);
  RequireValid(components);
  RequireEffects(options, volume, choice, {ExportFormat::kVdb});
  const FrameChoice frame = ParseFrame(options, frame_options);

  const OutputLock lock(output_path);
  if (is_by_block) {
    return ExportBlockVolumeFiles(
        {blocks_path, labels_path, output_path, choice, frame, components}, volume);
  }
  // First, as its reader says what is wrong with a file that is no foam.
  const Model model = ReadNamedModel(foam_path, output_path, labels_path);
  volume.source_checksum = ModelChecksum(foam_path);
  RequireSameFoam(output_path, volume.source_checksum);
  const ExportableScene scene = PrepareExport(model, foam_path, frame, components);
  RequireOneFrame(scene.transform, output_path, {ExportFormat::kVdb}, volume.source_checksum);
  volume.objects = FilterObjects(scene, choice);
  const std::vector<WrittenFile> files = WriteVolumes(scene, output_path, volume);
  WriteLabels(scene, output_path, {volume.source_checksum, files});
}

}  // namespace semfoam
