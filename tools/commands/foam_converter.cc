// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/io/cell_points.h"
#include "export/io/radiant_foam_ply.h"
#include "export/scene/exportable_scene.h"
#include "export/scene/object_selection.h"
#include "foam/model/model.h"
#include "foam/util/error.h"
#include "plugin/colmap/colmap_model.h"
#include "plugin/colmap/untrained_model.h"
#include "plugin/util/files.h"
#include "tools/cli/input_protection.h"
#include "tools/cli/option_manager.h"
#include "tools/commands/commands.h"
#include "tools/controllers/export_choice.h"
#include "tools/controllers/label_names.h"
#include "tools/options/enum_option.h"
#include "tools/options/export_options.h"

#include <cmath>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include <glog/logging.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

Model ReadInput(const std::string& input_path, uint64_t random_seed) {
  if (fs::is_directory(input_path)) {
    const fs::path folder = FindModelFolder(input_path);
    return UntrainedModel(ReadReconstruction(folder), folder, random_seed);
  }
  if (fs::path(input_path).extension() == ".ply") return ReadRadiantFoamPly(input_path);
  return ReadNamedModel(input_path);
}

enum class OutputType { kAuto, kFoam, kRadiantFoam, kSplats, kPoints, kText };
constexpr EnumName<OutputType> kOutputTypeNames[] = {{OutputType::kAuto, "auto"},
                                                     {OutputType::kFoam, "foam"},
                                                     {OutputType::kRadiantFoam, "radiant_foam"},
                                                     {OutputType::kSplats, "splats"},
                                                     {OutputType::kPoints, "points"},
                                                     {OutputType::kText, "text"}};

// Options of the command line.
struct ConverterOptions {
  std::string input_path;
  std::string output_path;
  OutputType output_type = OutputType::kAuto;
  LabelChoice choice;
  double splat_scale = 1.1;
};

void AddOptions(OptionManager* options, ConverterOptions* converter) {
  options->AddRequiredOption("input_path",
                             &converter->input_path,
                             "scene.foam, a Radiant Foam .ply, or the folder of a COLMAP model");
  options->AddRequiredOption("output_path", &converter->output_path, "the file to write");
  AddEnumOption(
      options,
      "output_type",
      &converter->output_type,
      kOutputTypeNames,
      "foam: scene.foam; radiant_foam: its PLY, every cell; splats: a Gaussian per visible cell, "
      "for splat viewers; points: a coloured, labelled point per visible cell; text: everything, "
      "to "
      "read; auto: by the name, .foam or .txt");
  AddLabelOptions(options, &converter->choice);
  options->AddDefaultOption("splat_scale",
                            &converter->splat_scale,
                            "splats: standard deviation in those of the cell, 0.1 to 10; smaller "
                            "leaves gaps, larger blurs");
}

// Returns the type to write: kAuto is decided by the file's name.
OutputType TypeOf(OutputType output_type, const std::string& output_path) {
  if (output_type != OutputType::kAuto) return output_type;
  const std::string extension = fs::path(output_path).extension().string();
  if (extension == ".foam") return OutputType::kFoam;
  if (extension == ".txt") return OutputType::kText;
  throw UserError(output_path,
                  ": its name does not say what to write; --output_type radiant_foam, splats or "
                  "points for a .ply, or a name that ends in .foam or .txt.");
}

// Returns a file, or all of a folder with a model.
std::vector<fs::path> FilesOf(const std::string& input_path) {
  if (!fs::is_directory(input_path)) return {input_path};
  return ListFiles(FindModelFolder(input_path));
}

// Throws UserError where the user gave an option that has no effect on this type of file.
void RequireEffects(const OptionManager& options,
                    const ConverterOptions& converter,
                    OutputType type) {
  const bool is_of_cells = type == OutputType::kSplats || type == OutputType::kPoints;
  if (!is_of_cells) {
    for (const auto& [name, text] :
         {std::pair("labels", converter.choice.labels),
          std::pair("exclude_labels", converter.choice.exclude_labels)}) {
      if (text.empty()) continue;
      throw UserError("Failed to parse options - --",
                      name,
                      " chooses splats and points; ",
                      NameOf(kOutputTypeNames, type),
                      " takes the whole foam.");
    }
  }
  if (type != OutputType::kSplats) {
    options.RequireEffect(
        {"splat_scale"},
        "on " + NameOf(kOutputTypeNames, type) + "; leave it out, or write splats");
  }
}

// Writes the visible cells as splats or points.
void WriteCells(const ConverterOptions& converter,
                OutputType type,
                const Model& model,
                const ExportableScene& scene) {
  const std::string& path = converter.output_path;
  const std::vector<uint32_t> cells = VisibleCells(scene, FilterObjects(scene, converter.choice));
  if (cells.empty()) {
    LOG(WARNING) << path << ": no cell is solid and seen by a photo; the file is empty";
  }
  if (type == OutputType::kSplats) {
    WriteSplats(path, model, scene, cells, converter.splat_scale);
  } else {
    WriteCellPoints(path, scene, cells);
  }
  LOG(INFO) << path << ": " << cells.size() << " " << NameOf(kOutputTypeNames, type) << " of "
            << model.foam.NumSites() << " cells";
}

// Writes the model as this type of file, and says what it holds.
void WriteOutput(const ConverterOptions& converter, OutputType type, const Model& model) {
  const std::string& path = converter.output_path;
  if (type == OutputType::kFoam) {
    WriteModel(path, model);
    LOG(INFO) << path << ": " << model.foam.NumSites() << " sites";
    return;
  }
  const ExportableScene scene = MakeExportableScene(model);
  if (type == OutputType::kRadiantFoam) {
    WriteRadiantFoamPly(path, model, scene);
    LOG(INFO) << path << ": " << model.foam.NumSites()
              << " sites; Radiant Foam's format has no labels"
              << (model.foam.HasColorGradients() ? ", and one colour a cell" : "");
  } else if (type == OutputType::kText) {
    WriteFoamText(path, model, scene);
    LOG(INFO) << path << ": " << model.foam.NumSites() << " sites";
  } else {
    WriteCells(converter, type, model, scene);
  }
}

}  // namespace

void RunFoamConverter(int argc, char** argv) {
  ConverterOptions converter;
  OptionManager options("foam_converter",
                        "Brings foams in from other formats and out to them: Radiant Foam's PLY, "
                        "splats, points, text, and a COLMAP model as an untrained foam.");
  AddOptions(&options, &converter);
  if (!options.Parse(argc, argv)) return;
  if (!(converter.splat_scale >= 0.1 && converter.splat_scale <= 10)) {
    throw UserError("Failed to parse options - --splat_scale ",
                    converter.splat_scale,
                    ": 0.1 to 10 would be right.");
  }
  const OutputType type = TypeOf(converter.output_type, converter.output_path);
  RequireEffects(options, converter, type);
  CheckNoInputOverwrite(FilesOf(converter.input_path), {converter.output_path});
  WriteOutput(converter, type, ReadInput(converter.input_path, options.RandomSeed()));
}

}  // namespace semfoam
