// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/model.h"
#include "foam/output_file.h"
#include "tools/commands.h"
#include "tools/exports.h"

#include <string>

namespace semfoam {

void RunMeshExporter(int argc, char** argv) {
  std::string foam_path;
  std::string output_path;
  SurfaceExportOptions surface;
  OptionManager options("mesh_exporter", "Writes the closed surface of every object of a foam.");
  options.AddRequiredOption("foam_path", &foam_path, "the model, scene.foam");
  options.AddRequiredOption(
      "output_path", &output_path, "folder for objects/*.{om,ply,obj} and labels.json");
  AddMeshExportOptions(&options, &surface);
  if (!options.Parse(argc, argv)) return;

  RequireWritableFolder(output_path);
  const ExportableScene scene = PrepareExport(ReadModel(foam_path));
  WriteMeshes(scene, output_path, surface);
  WriteLabels(scene, output_path);
}

}  // namespace semfoam
