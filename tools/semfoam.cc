// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/scene/names.h"
#include "foam/util/error.h"
#include "foam/util/interruption.h"
#include "foam/util/scratch_folder.h"
#include "tools/cli/logging.h"
#include "tools/cli/memory_task.h"
#include "tools/commands/commands.h"

#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <new>
#include <string>

#include <poll.h>
#include <unistd.h>

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
    {"mesh_evaluator", "scores meshes against reference meshes", RunMeshEvaluator},
    {"point_labeler", "labels SfM points by their tracks in the masks", RunPointLabeler},
    {"mask_analyzer", "says what is in the masks, and which look wrong", RunMaskAnalyzer},
    {"view_interpolator",
     "makes a film of the photos for a mask tracker, with views between",
     RunViewInterpolator},
    {"mask_corrupter", "damages masks as trackers do, for tests", RunMaskCorrupter},
    {"accuracy_profiler", "shows what accuracy costs in time", RunAccuracyProfiler},
    {"training_plotter", "draws the quality of several trainings over time", RunTrainingPlotter},
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

// One line, whatever names of files and of things in files are in the sentence: no control
// character reaches the terminal.
int Fail(const std::string& sentence) {
  WaitIfExiting();
  std::fprintf(stderr,
               "%sERROR: %s\n",
               ::isatty(STDERR_FILENO) != 0 ? "\r\x1b[K" : "",
               OneLine(sentence).c_str());
  return EXIT_FAILURE;
}

// What a command prints is its result too. A reader that had enough (`| head`) is no error.
void RequireWrittenOutput() {
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return;
  pollfd reader{STDOUT_FILENO, 0, 0};
  if (::poll(&reader, 1, 0) == 1 && (reader.revents & POLLERR) != 0) return;
  throw UserError("The standard output cannot be written completely; is the disk full?");
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
    if (name != command.name) continue;
    try {
      HandleInterruptions();
      command.run(argc - 1, argv + 1);
      RequireWrittenOutput();
      return EXIT_SUCCESS;
    } catch (const Interruption& interruption) {
      return interruption.ExitCode();
    } catch (const UserError& error) {
      return Fail(error.what());
    } catch (const std::filesystem::filesystem_error& error) {
      return Fail(error.path1().string() + ": cannot be reached (" + error.code().message() +
                  "); may you read and enter its folders?");
    } catch (const std::bad_alloc&) {
      return Fail(MemoryUsedUp());
    } catch (const std::exception& error) {
      return Fail(std::string("something unexpected went wrong (") + error.what() + ").");
    }
  }
  return Fail("Command `" + name +
              "` not recognized. To list the available commands, run `semfoam help`.");
}

}  // namespace
}  // namespace semfoam

int main(int argc, char** argv) {
  semfoam::InitLogging(argv[0]);
  return semfoam::Main(argc, argv);
}
