// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/exportable_scene.h"
#include "foam/model/model.h"
#include "tools/cli/run_command.h"
#include "tools/commands/commands.h"

#include <algorithm>
#include <map>
#include <sstream>

#include "tests/bad_input/bad_input.h"
#include "tests/export/test_foams.h"

// Bad options of the commands, called as the program calls them: one sentence, and nothing written.
namespace semfoam {

using Run = void (*)(int, char**);

// The command and the options that it cannot do without; IN is the test's folder.
struct Command {
  Run run;
  std::string options;
};

inline const std::map<std::string, Command> kCommands = {
    {"segment",
     {RunAutomaticSegmenter, "automatic_segmenter --workspace_path TABLETOP --output_path IN/out"}},
    {"train",
     {RunFoamTrainer,
      "foam_trainer --quality low --FoamTraining.num_rays 2000 --FoamTraining.final_sites 500 "
      "--image_path TABLETOP/images --input_path TABLETOP/sparse --output_path "
      "IN/out"}},
    {"volumes", {RunVolumeExporter, "volume_exporter --foam_path IN/a.foam --output_path IN/out"}},
    {"meshes", {RunMeshExporter, "mesh_exporter --foam_path IN/a.foam --output_path IN/out"}},
    {"render", {RunFoamRenderer, "foam_renderer --foam_path IN/a.foam --output_path IN/out"}},
    {"convert",
     {RunFoamConverter, "foam_converter --input_path IN/a.foam --output_path IN/out/b.txt"}},
    {"extract",
     {RunObjectExtractor, "object_extractor --foam_path IN/a.foam --output_path IN/out"}},
    {"remove", {RunObjectRemover, "object_remover --foam_path IN/a.foam --output_path IN/out"}},
    {"insert",
     {RunObjectInserter,
      "object_inserter --foam_path IN/a.foam --object_path IN/a.foam --output_path IN/out"}},
    {"film", {RunViewInterpolator, "view_interpolator --foam_path IN/a.foam --output_path IN/out"}},
    {"evaluate",
     {RunFoamEvaluator, "foam_evaluator --foam_path IN/a.foam --image_path TABLETOP/images"}},
    {"effects",
     {RunSceneAnalyzer,
      "scene_analyzer --image_path TABLETOP/images --input_path TABLETOP/sparse --output_path "
      "IN/out"}},
    {"profile",
     {RunAccuracyProfiler, "accuracy_profiler --workspace_path TABLETOP --output_path IN/out"}},
    {"plot", {RunAccuracyProfiler, "accuracy_profiler --run_paths IN/a --output_path IN/out"}},
    {"analyze", {RunMaskAnalyzer, "mask_analyzer --output_path IN/out"}},
    {"label", {RunPointLabeler, "point_labeler --workspace_path TABLETOP --output_path IN/out"}},
};

// Options are separated by '|', for those with blanks in them.
struct BadOptions {
  std::string command;
  std::string options;
  Mistake mistake;
};

inline std::vector<std::string> Split(const std::string& text, char between) {
  std::vector<std::string> parts;
  std::istringstream stream(text);
  for (std::string part; std::getline(stream, part, between);) parts.push_back(part);
  return parts;
}

// What the command says to the user with these options, with IN for the folder.
inline std::string SentenceOf(const BadOptions& bad, const std::string& folder) {
  const Command& command = kCommands.at(bad.command);
  std::vector<std::string> arguments = Split(command.options, ' ');
  // An option given by the case replaces the command's own.
  std::vector<std::string> more = Split(bad.options, '|');
  if (bad.options.ends_with('|')) more.push_back("");
  if (!more.empty()) {
    const auto same = std::find(arguments.begin(), arguments.end(), more.front());
    if (same != arguments.end()) arguments.erase(same, same + 2);
  }
  arguments.insert(arguments.end(), more.begin(), more.end());
  std::vector<char*> argv;
  for (std::string& argument : arguments) {
    argument =
        Replaced(Replaced(argument, "TABLETOP", SEMFOAM_TEST_DATA "/tabletop"), "IN", folder);
    argv.push_back(argument.data());
  }
  try {
    command.run(static_cast<int>(argv.size()), argv.data());
  } catch (const UserError& error) {
    return Replaced(ErrorSentence(error), folder, "IN");
  }
  return "";
}

// Expects of each case one sentence about its mistake, and no file.
inline void ExpectRefused(const std::vector<BadOptions>& cases) {
  const TempFolder temp;
  const std::string folder = temp.path().string();
  WriteModel(temp / "a.foam", TouchingBalls(300));
  WriteFile(temp / "a file", "in the way");
  for (const BadOptions& bad : cases) {
    EXPECT_THAT(SentenceOf(bad, folder), TellsOf(bad.mistake)) << bad.command << " " << bad.options;
    EXPECT_FALSE(std::filesystem::exists(temp / "out")) << bad.command << " " << bad.options;
    std::filesystem::remove_all(temp / "out");
  }
  testing::Test::RecordProperty("cases", static_cast<int>(cases.size()));
}

}  // namespace semfoam
