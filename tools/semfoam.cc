// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/cli/logging.h"
#include "tools/cli/run_command.h"
#include "tools/commands/commands.h"

#include <cstdio>
#include <cstdlib>
#include <string>

namespace semfoam {
namespace {

struct Command {
  const char* name;
  const char* summary;
  void (*run)(int argc, char** argv);
};

constexpr Command kCommands[] = {
    {"automatic_segmenter", "a COLMAP workspace in, everything out", RunAutomaticSegmenter},
    {"scene_analyzer", "says which effects a scene calls for", RunSceneAnalyzer},
    {"foam_trainer", "trains a foam from a COLMAP model, photos and masks", RunFoamTrainer},
    {"foam_renderer", "renders a foam from the views of a COLMAP model", RunFoamRenderer},
    {"foam_evaluator", "scores a foam on its held-out photos", RunFoamEvaluator},
    {"foam_analyzer", "says what is in a foam", RunFoamAnalyzer},
    {"foam_converter", "Radiant Foam, splats, points and text, in and out", RunFoamConverter},
    {"volume_exporter", "writes the scene and every object as OpenVDB volumes", RunVolumeExporter},
    {"mesh_exporter",
     "writes every object's closed surface: OpenMesh, PLY, OBJ, glTF, USD",
     RunMeshExporter},
    {"object_extractor", "makes a foam of its own of objects", RunObjectExtractor},
    {"object_remover", "takes objects out of a foam", RunObjectRemover},
    {"object_inserter", "puts objects into another foam", RunObjectInserter},
    {"label_editor", "renames, merges, splits, drops and assigns labels", RunLabelEditor},
    {"mesh_evaluator", "scores meshes against reference meshes", RunMeshEvaluator},
    {"point_labeler", "labels SfM points by their tracks in the masks", RunPointLabeler},
    {"mask_analyzer", "says what is in the masks, and which look wrong", RunMaskAnalyzer},
    {"mask_importer", "converts masks of other programs", RunMaskImporter},
    {"mask_renderer", "renders clean masks of all photos from a foam", RunMaskRenderer},
    {"view_interpolator",
     "makes a film of the photos for a mask tracker, with views between",
     RunViewInterpolator},
    {"report_writer", "shows a foam in a browser, in one page that can be sent", RunReportWriter},
    {"accuracy_profiler", "shows what accuracy costs in time", RunAccuracyProfiler},
    {"self_test", "runs the numerically hard cases on this machine", RunSelfTest},
};

void PrintHelp() {
  std::printf("semfoam " SEMFOAM_VERSION
              ": Semantic Foam for COLMAP, from a COLMAP model, photos and instance masks\n"
              "to labelled volumes and meshes.\n\n"
              "Usage:\n"
              "  semfoam automatic_segmenter --workspace_path WORKSPACE --output_path OUTPUT\n"
              "  semfoam COMMAND -h\n"
              "  semfoam COMMAND [options]\n\n"
              "Commands:\n");
  for (const Command& command : kCommands) {
    std::printf("  %-20s %s\n", command.name, command.summary);
  }
  std::printf("  %-20s %s\n", "help", "lists the commands");
  std::printf("  %-20s %s\n", "version", "says which version this is");
}

int Main(int argc, char** argv) {
  const std::string name = argc < 2 ? "help" : argv[1];
  if (name == "help" || name == "-h" || name == "--help") {
    PrintHelp();
    return EXIT_SUCCESS;
  }
  if (name == "version" || name == "-v" || name == "--version") {
    std::printf("semfoam " SEMFOAM_VERSION "\n");
    return EXIT_SUCCESS;
  }
  for (const Command& command : kCommands) {
    if (name == command.name) return RunCommand(command.run, argc - 1, argv + 1);
  }
  return PrintError("Command `" + name +
                    "` not recognized. To list the available commands, run `semfoam help`.");
}

}  // namespace
}  // namespace semfoam

int main(int argc, char** argv) {
  semfoam::InitLogging(argv[0]);
  return semfoam::Main(argc, argv);
}
