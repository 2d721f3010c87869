// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/commands/commands.h"

#include <algorithm>

namespace semfoam {
namespace {

constexpr CommandEntry kCommands[] = {
    {"automatic_segmenter", "a COLMAP workspace in, everything out", RunAutomaticSegmenter},
    {"scene_analyzer", "says which effects a scene calls for", RunSceneAnalyzer},
    {"foam_trainer", "trains a foam from a COLMAP model, photos and masks", RunFoamTrainer},
    {"scene_splitter", "cuts a training into blocks for several machines", RunSceneSplitter},
    {"foam_merger", "makes one foam of trained blocks", RunFoamMerger},
    {"foam_renderer", "renders a foam from the views of a COLMAP model", RunFoamRenderer},
    {"foam_evaluator", "scores a foam on its held-out photos", RunFoamEvaluator},
    {"foam_analyzer", "says what is in a foam", RunFoamAnalyzer},
    {"foam_converter", "Radiant Foam, splats, points and text, in and out", RunFoamConverter},
    {"volume_exporter", "writes the scene and every object as OpenVDB volumes", RunVolumeExporter},
    {"mesh_exporter",
     "writes every object's closed surface: OpenMesh, PLY, OBJ, glTF, USD",
     RunMeshExporter},
    {"model_aligner", "levels, scales and turns a foam and its COLMAP model", RunModelAligner},
    {"foam_labeler", "labels a trained foam by masks or clicks, without training", RunFoamLabeler},
    {"scene_segmenter",
     "finds the things of a foam trained without masks (experimental)",
     RunSceneSegmenter},
    {"label_editor", "renames, merges, splits and assigns the labels of a foam", RunLabelEditor},
    {"label_transfer", "labels meshes and point clouds of other programs", RunLabelTransfer},
    {"object_extractor", "makes a foam of its own of objects", RunObjectExtractor},
    {"object_remover", "takes objects out of a foam", RunObjectRemover},
    {"object_inserter", "puts objects into another foam", RunObjectInserter},
    {"mesh_evaluator", "scores meshes against reference meshes", RunMeshEvaluator},
    {"point_labeler", "labels SfM points by their tracks in the masks", RunPointLabeler},
    {"mask_analyzer", "says what is in the masks, and which look wrong", RunMaskAnalyzer},
    {"mask_importer", "converts masks of other programs", RunMaskImporter},
    {"mask_undistorter",
     "makes masks for the photos of COLMAP's image_undistorter",
     RunMaskUndistorter},
    {"mask_renderer", "renders clean masks of all photos from a foam", RunMaskRenderer},
    {"view_interpolator",
     "makes a film of the photos for a mask tracker, with views between",
     RunViewInterpolator},
    {"report_writer", "shows a foam in a browser, in one page that can be sent", RunReportWriter},
    {"accuracy_profiler", "shows what accuracy costs in time", RunAccuracyProfiler},
    {"self_test", "runs the numerically hard cases on this machine", RunSelfTest},
};

}  // namespace

std::span<const CommandEntry> Commands() { return kCommands; }

const CommandEntry* FindCommand(const std::string& name) {
  const auto* const found = std::find_if(std::begin(kCommands),
                                         std::end(kCommands),
                                         [&](const CommandEntry& c) { return name == c.name; });
  return found == std::end(kCommands) ? nullptr : found;
}

}  // namespace semfoam
