// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/transfer/label_transfer.h"

#include "export/scene/export_transform.h"
#include "export/scene/exportable_scene.h"
#include "export/scene/names.h"
#include "export/transfer/label_source.h"
#include "foam/util/error.h"
#include "tools/cli/input_protection.h"
#include "tools/cli/option_manager.h"
#include "tools/commands/commands.h"
#include "tools/controllers/export_frame.h"
#include "tools/controllers/export_objects.h"
#include "tools/controllers/export_record.h"
#include "tools/controllers/label_names.h"
#include "tools/controllers/labelled_files.h"
#include "tools/masks/mask_label_source.h"
#include "tools/masks/model_masks.h"
#include "tools/options/export_options.h"
#include "tools/options/frame_options.h"
#include "tools/options/mask_options.h"
#include "tools/support/output_lock.h"

#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

void PrintLabels(const TransferredLabels& transferred) {
  const bool is_mesh = transferred.faces > 0;
  std::printf("  %5s  %-20s %10s", "id", "name", is_mesh ? "vertices" : "points");
  if (is_mesh) std::printf(" %10s %7s", "faces", "area");
  std::printf(" %10s\n", "confidence");
  for (const TransferredLabel& label : transferred.labels) {
    const bool is_object = label.id != kNoObject;
    std::printf("  %5s  %-20s %10lld",
                is_object ? std::to_string(Value(label.id)).c_str() : "",
                is_object ? OneLine(label.name).c_str() : "(no label)",
                static_cast<long long>(label.vertices));
    if (is_mesh) {
      const double share = transferred.area > 0 ? 100 * label.area / transferred.area : 0;
      std::printf(" %10lld %5.1f %%", static_cast<long long>(label.faces), share);
    }
    std::printf(" %10.3f\n", label.confidence);
  }
}

// Options and paths of the command.
struct Paths {
  std::string foam;
  std::string workspace;
  std::string input;
  std::string output;
};

void AddOptions(OptionManager* options,
                Paths* paths,
                MaskOptions* masks,
                LabelTransferOptions* transfer,
                FrameOptions* frame) {
  options->AddDefaultOption(
      "foam_path", &paths->foam, "the model, scene.foam; or give --workspace_path");
  options->AddDefaultOption(
      "workspace_path",
      &paths->workspace,
      "folder with sparse/ and object_mask/: the masks alone tell the labels, "
      "without any training");
  options->AddRequiredOption(
      "input_path",
      &paths->input,
      "the mesh or point cloud, as fused.ply or meshed-poisson.ply of COLMAP: PLY; OBJ, in which "
      "labels become groups and materials stay; OM; glTF, in which labels become meshes; STL, "
      "whose "
      "labelled mesh is a PLY; or LAS, in which labels become classes");
  options->AddRequiredOption("output_path",
                             &paths->output,
                             "folder for the labelled file, which keeps its name, and labels.json");
  options->AddDefaultOption("split",
                            &transfer->split,
                            "of PLY, OBJ and STL: also objects/<id>_<name>, each object as a "
                            "file of its own, with the vertices on borders in each");
  options->AddDefaultOption(
      "cap", &transfer->cap, "with --split 1, of a mesh: closes the boundaries of each object");
  options->AddDefaultOption(
      "labels_path",
      &masks->labels_path,
      "names of the labels, {\"labels\": {\"7\": \"mug\"}}; by default those changed in the "
      "labels.json beside the foam, then the foam's own, or labels.json beside the masks' folder");
  options->AddDefaultOption("mask_path",
                            &masks->mask_path,
                            "folder of the instance masks; by default object_mask/, then "
                            "Annotations/ of the workspace");
  AddMaskReadingOptions(options, masks);
  options->AddDefaultOption("tolerance",
                            &transfer->tolerance,
                            "matter farther away than this, in the file's unit, is another "
                            "thing's; 0 = a fiftieth of the scene's diagonal, or 3 radii of cells");
  options->AddDefaultOption("smoothness",
                            &transfer->smoothness,
                            "meshes: spots of a radius up to about twice this length, in the "
                            "file's unit, are taken for noise; 0 = none, -1 = twice the radius of "
                            "a cell, or 6 pixels of the masks");
  AddFrameOptions(options, frame);
  options->SetFrequentOptions({"foam_path",
                               "workspace_path",
                               "split",
                               "cap",
                               "labels_path",
                               "mask_path",
                               "tolerance",
                               "smoothness",
                               "transform",
                               "level",
                               "up_axis",
                               "scale",
                               "units"});
}

// Throws UserError unless exactly one of the foam and the workspace is given, with options that
// have an effect.
void RequireOneSource(const OptionManager& options, const Paths& paths, bool split) {
  if (paths.foam.empty() == paths.workspace.empty()) {
    throw UserError("Failed to parse options - ",
                    paths.foam.empty() ? "neither '--foam_path' nor" : "both '--foam_path' and",
                    " '--workspace_path' ",
                    paths.foam.empty() ? "is" : "are",
                    " given; one of them must tell the labels.");
  }
  if (!split) options.RequireEffect({"cap"}, "without --split 1; give it, or leave this out");
  if (paths.workspace.empty()) {
    options.RequireEffect({"mask_path", "FoamTraining.label_zero", "Masks.consistency"},
                          "with --foam_path; give --workspace_path instead of that");
  } else {
    options.RequireEffect({"tolerance"}, "with --workspace_path; leave it out");
  }
}

void TransferFromFoam(const Paths& paths,
                      const std::string& labels_path,
                      const LabelTransferOptions& transfer,
                      const FrameChoice& frame) {
  const Model model = ReadNamedModel(paths.foam, {}, labels_path);
  ExportableSceneOptions options;
  options.transform = FindFrame(model, frame);
  const ExportableScene scene = MakeExportableScene(model, options);
  RequireObjects(scene, paths.foam);
  FoamLabels source(scene, transfer.tolerance);
  PrintLabels(
      WriteLabelled(&source, {paths.input, paths.output, transfer}, ModelChecksum(paths.foam)));
}

void TransferFromMasks(const Paths& paths,
                       const MaskOptions& masks,
                       bool labels_are_given,
                       const LabelTransferOptions& transfer,
                       const FrameChoice& frame) {
  const MaskedModelPaths found = FindMaskedModel(paths.workspace, {}, masks, /*needs_model=*/true);
  const Reconstruction model = ReadRegistered(found.model_folder);
  const ExportTransform transform = FindFrame(model, frame);
  const CorrectedPhotos photos =
      ReadModelMasks(model, found.mask_folder, masks.Zero(), masks.Consistency());
  MaskLabels source(
      model, photos, NamedLabelsOf(photos.photos, found.labels_file, labels_are_given), transform);
  PrintLabels(WriteLabelled(&source, {paths.input, paths.output, transfer}, {}));
}

}  // namespace

void RunLabelTransfer(int argc, char** argv) {
  Paths paths;
  MaskOptions masks;
  LabelTransferOptions transfer;
  FrameOptions frame_options;
  OptionManager options(
      "label_transfer",
      "Labels a mesh or a point cloud that another program made of the same photos: each vertex, "
      "face or point gets a label and a confidence, from the foam's matter nearest to it, or from "
      "the masks of the photos that see it. All else in the file stays as it is, byte for byte.");
  AddOptions(&options, &paths, &masks, &transfer, &frame_options);
  if (!options.Parse(argc, argv)) return;
  RequireOneSource(options, paths, transfer.split);
  transfer.RequireValid();
  const FrameChoice frame = ParseFrame(options, frame_options);
  const fs::path input = paths.input, folder = paths.output;
  const LabelledFiles files = {input, folder, transfer};
  const fs::path labelled = LabelledFile(files);  // Before any work, what cannot be read.
  std::vector<fs::path> inputs = {input};
  if (!paths.foam.empty()) inputs.push_back(paths.foam);
  if (!masks.labels_path.empty()) inputs.push_back(masks.labels_path);
  CheckNoInputOverwrite(inputs, {labelled, folder / "labels.json"});
  const OutputLock lock(folder);
  RequireRoomForLabelled(files);
  if (paths.workspace.empty()) {
    TransferFromFoam(paths, masks.labels_path, transfer, frame);
  } else {
    TransferFromMasks(paths, masks, options.IsGiven("labels_path"), transfer, frame);
  }
}

}  // namespace semfoam
