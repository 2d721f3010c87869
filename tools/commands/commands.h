// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <span>
#include <string>

namespace semfoam {

// A command of the program: its name, what it does in a few words for the list of `semfoam help`,
// and the function that runs it.
struct CommandEntry {
  const char* name;
  const char* summary;
  void (*run)(int argc, char** argv);
};

// Returns all commands, in the order of `semfoam help`.
std::span<const CommandEntry> Commands();

// Returns the command of that name; null where there is none.
const CommandEntry* FindCommand(const std::string& name);

// The commands of the program, each in commands/<name>.cc. argv[0] is the command's name. They
// throw UserError for errors that the user can correct.
void RunAccuracyProfiler(int argc, char** argv);
void RunAutomaticSegmenter(int argc, char** argv);
void RunFoamAnalyzer(int argc, char** argv);
void RunFoamConverter(int argc, char** argv);
void RunFoamEvaluator(int argc, char** argv);
void RunFoamLabeler(int argc, char** argv);
void RunFoamMerger(int argc, char** argv);
void RunFoamRenderer(int argc, char** argv);
void RunFoamTrainer(int argc, char** argv);
void RunLabelEditor(int argc, char** argv);
void RunLabelTransfer(int argc, char** argv);
void RunMaskAnalyzer(int argc, char** argv);
void RunMaskImporter(int argc, char** argv);
void RunMaskRenderer(int argc, char** argv);
void RunMaskUndistorter(int argc, char** argv);
void RunMeshEvaluator(int argc, char** argv);
void RunMeshExporter(int argc, char** argv);
void RunModelAligner(int argc, char** argv);
void RunObjectExtractor(int argc, char** argv);
void RunObjectInserter(int argc, char** argv);
void RunObjectRemover(int argc, char** argv);
void RunPointLabeler(int argc, char** argv);
void RunReportWriter(int argc, char** argv);
void RunSceneAnalyzer(int argc, char** argv);
void RunSceneSegmenter(int argc, char** argv);
void RunSceneSplitter(int argc, char** argv);
void RunSelfTest(int argc, char** argv);
void RunViewInterpolator(int argc, char** argv);
void RunVolumeExporter(int argc, char** argv);

}  // namespace semfoam
