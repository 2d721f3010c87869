// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/scene/object_selection.h"
#include "foam/util/error.h"
#include "foam/util/number_text.h"
#include "tools/commands/commands.h"
#include "tools/controllers/block_export.h"
#include "tools/controllers/export_choice.h"
#include "tools/controllers/export_objects.h"
#include "tools/controllers/export_record.h"
#include "tools/controllers/export_surfaces.h"
#include "tools/controllers/label_names.h"
#include "tools/controllers/mask_importing.h"
#include "tools/controllers/mask_labels.h"
#include "tools/controllers/texture_source.h"
#include "tools/controllers/training_run.h"
#include "tools/options/block_export_options.h"
#include "tools/options/export_options.h"
#include "tools/options/frame_options.h"
#include "tools/options/mask_options.h"
#include "tools/support/output_lock.h"

#include <filesystem>
#include <memory>
#include <set>
#include <string>
#include <vector>

namespace semfoam {
namespace {

// The folders of the photos that textures are baked from.
struct WorkspaceChoice {
  std::string workspace_path;
  std::string image_path;
  std::string input_path;
  std::string mask_path;
};

void AddWorkspaceOptions(OptionManager* options, WorkspaceChoice* workspace) {
  options->AddDefaultOption("workspace_path",
                            &workspace->workspace_path,
                            "folder with images/, sparse/ and object_mask/ that the foam was "
                            "trained on, for textures");
  options->AddDefaultOption(
      "image_path", &workspace->image_path, "folder of the photos; by default images/");
  options->AddDefaultOption(
      "input_path", &workspace->input_path, "the COLMAP model; by default sparse/0/, then sparse/");
  options->AddDefaultOption("mask_path",
                            &workspace->mask_path,
                            "folder of the instance masks; by default object_mask/, then "
                            "Annotations/ of the workspace");
}

// Returns whether to bake textures. Throws UserError for options without an effect.
bool RequireTextures(const OptionManager& options,
                     const WorkspaceChoice& workspace,
                     const TextureChoice& texture,
                     const std::set<ExportFormat>& formats) {
  if (workspace.workspace_path.empty()) {
    options.RequireEffect(
        {"image_path", "input_path", "mask_path", "texture_size", "texture_format"},
        "without --workspace_path; give it, or leave this out");
    if (options.IsGiven("texture") && texture.is_wanted) {
      throw UserError(
          "Failed to parse options - --texture 1 needs the photos, --workspace_path; give it, or "
          "leave this out.");
    }
    return false;
  }
  RequireWorkspace(workspace.workspace_path);
  if (!TakesTextures(formats)) {
    options.RequireEffect(
        {"texture_size", "texture_format"},
        "without obj, glb or usda among the --formats; add one, or leave this out");
  }
  return texture.is_wanted && TakesTextures(formats);
}

// Reads masks as the training of the model did.
SceneOptions PhotosOf(const WorkspaceChoice& workspace,
                      const Model& model,
                      const std::string& output_path) {
  TrainingRun run;
  run.scene.image_path = workspace.image_path;
  run.scene.input_path = workspace.input_path;
  run.scene.mask_path = workspace.mask_path;
  CompleteFromWorkspace(workspace.workspace_path, &run);
  run.scene.use_masks = !IsWhole(model);
  TakeTrainingOptions(model, &run.scene);
  run.scene.max_image_size = -1;
  ImportMasksOf(&run.scene, std::filesystem::path(output_path) / "imported_masks");
  return run.scene;
}

// Throws UserError for options that need more than one block at a time.
void RequireOneBlockAtATime(const OptionManager& options, const SurfaceExportOptions& surface) {
  RequireByBlock(options, {"formats", "MeshExport.method"});
  if (!options.IsGiven("MeshExport.method") || surface.method == SurfaceMethod::kCells) return;
  throw UserError(
      "Failed to parse options - --MeshExport.method smooth has no effect with --blocks_path, as "
      "smooth surfaces need the whole foam; cells, or merging the blocks (foam_merger), would be "
      "right.");
}

}  // namespace

void RunMeshExporter(int argc, char** argv) {
  std::string foam_path;
  std::string blocks_path;
  std::string output_path;
  std::string labels_path;
  std::string formats = kMeshFormats;
  LabelChoice choice;
  ComponentOptions components;
  SurfaceExportOptions surface;
  FrameOptions frame_options;
  WorkspaceChoice workspace;
  TextureChoice texture;
  OptionManager options(
      "mesh_exporter",
      "Writes the closed surface of every object of a foam, or of the whole scene.");
  options.AddRequiredOption("foam_path", &foam_path, "the model, scene.foam");
  options.AddRequiredOption(
      "output_path",
      &output_path,
      "folder for objects/*.{om,ply,obj,glb}, scene.{glb,usda} and labels.json");
  AddBlocksPathOption(&options, &blocks_path);
  AddLabelNamesOption(&options, &labels_path);
  AddFormatsOption(&options, &formats);
  AddLabelOptions(&options, &choice);
  AddComponentOptions(&options, &components);
  AddMeshExportOptions(&options, &surface);
  AddMeshCropOption(&options, &surface);
  AddWorkspaceOptions(&options, &workspace);
  AddTextureOptions(&options, &texture, &surface);
  AddFrameOptions(&options, &frame_options);
  options.SetFrequentOptions({"labels",
                              "exclude_labels",
                              "formats",
                              "workspace_path",
                              "texture",
                              "MeshExport.method",
                              "MeshExport.crop",
                              "MeshExport.target_faces",
                              "keep_fragments",
                              "level",
                              "up_axis",
                              "scale",
                              "units"});
  if (!options.Parse(argc, argv)) return;
  const bool is_by_block = options.IsGiven("blocks_path");
  if (is_by_block) RequireOneBlockAtATime(options, surface);
  RequireValid(surface);
  const std::set<ExportFormat> wanted = ParseFormats(formats, kMeshFormats);
  RequireValid(components);
  const bool has_textures = RequireTextures(options, workspace, texture, wanted);
  const FrameChoice frame = ParseFrame(options, frame_options);

  const OutputLock lock(output_path);
  if (is_by_block) {
    return ExportBlockMeshes(
        {blocks_path, labels_path, output_path, choice, frame, components}, wanted, surface);
  }
  // First, as its reader says what is wrong with a file that is no foam.
  const Model model = ReadNamedModel(foam_path, output_path, labels_path);
  surface.source_checksum = ModelChecksum(foam_path);
  RequireSameFoam(output_path, surface.source_checksum);
  const ExportableScene scene = PrepareExport(model, foam_path, frame, components);
  RequireOneFrame(scene.transform, output_path, wanted, surface.source_checksum);
  surface.objects = FilterObjects(scene, choice);
  std::unique_ptr<TexturePhotos> photos;
  if (has_textures) {
    photos = MakeTextureSource(
        model, scene, foam_path, PhotosOf(workspace, model, output_path), texture.format);
    surface.photos = photos.get();
  }
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
