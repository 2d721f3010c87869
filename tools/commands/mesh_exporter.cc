// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/scene/object_selection.h"
#include "tools/commands/commands.h"
#include "tools/controllers/export_choice.h"
#include "tools/controllers/export_objects.h"
#include "tools/controllers/export_record.h"
#include "tools/controllers/export_surfaces.h"
#include "tools/controllers/label_names.h"
#include "tools/options/export_options.h"
#include "tools/support/output_lock.h"

#include <set>
#include <string>
#include <vector>

namespace semfoam {

void RunMeshExporter(int argc, char** argv) {
  std::string foam_path;
  std::string output_path;
  std::string labels_path;
  std::string formats = kMeshFormats;
  LabelChoice choice;
  ComponentOptions components;
  SurfaceExportOptions surface;
  ExportTransformOptions frame;
  OptionManager options(
      "mesh_exporter",
      "Writes the closed surface of every object of a foam, or of the whole scene.");
  options.AddRequiredOption("foam_path", &foam_path, "the model, scene.foam");
  options.AddRequiredOption(
      "output_path",
      &output_path,
      "folder for objects/*.{om,ply,obj,glb}, scene.{glb,usda} and labels.json");
  AddLabelNamesOption(&options, &labels_path);
  AddFormatsOption(&options, &formats);
  AddLabelOptions(&options, &choice);
  AddComponentOptions(&options, &components);
  AddMeshExportOptions(&options, &surface);
  AddMeshCropOption(&options, &surface);
  AddFrameOptions(&options, &frame);
  options.SetFrequentOptions({"labels",
                              "exclude_labels",
                              "formats",
                              "MeshExport.method",
                              "MeshExport.crop",
                              "MeshExport.target_faces",
                              "keep_fragments",
                              "up_axis",
                              "scale",
                              "units"});
  if (!options.Parse(argc, argv)) return;
  RequireValid(surface);
  const std::set<ExportFormat> wanted = ParseFormats(formats, kMeshFormats);
  RequireValid(components);
  const ExportTransform transform = ParseExportTransform(frame);

  const OutputLock lock(output_path);
  // First, as its reader says what is wrong with a file that is no foam.
  const Model model = ReadNamedModel(foam_path, output_path, labels_path);
  surface.source_checksum = ModelChecksum(foam_path);
  RequireSameFoam(output_path, surface.source_checksum);
  const ExportableScene scene = PrepareExport(model, foam_path, transform, components);
  RequireOneFrame(scene.transform, output_path, wanted, surface.source_checksum);
  surface.objects = FilterObjects(scene, choice);
  std::vector<WrittenFile> files;
  if (IsWhole(model)) {
    const ExportableScene whole = PrepareWhole(model, scene.transform, components);
    RequireObjects(whole, foam_path);
    files = WriteWholeMesh(whole, output_path, wanted, surface);
  } else {
    RequireObjects(scene, foam_path);
    files = WriteMeshes(scene, output_path, wanted, surface);
  }
  WriteLabels(scene, output_path, {surface.source_checksum, files});
}

}  // namespace semfoam
