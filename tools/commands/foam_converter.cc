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

// Options of the command line.
struct ConverterOptions {
  std::string input_path;
  std::string output_path;
  std::string output_type = "auto";
  LabelChoice choice;
  double splat_scale = 1.1;
};

void AddOptions(OptionManager* options, ConverterOptions* converter) {
  options->AddRequiredOption("input_path",
                             &converter->input_path,
                             "scene.foam, a Radiant Foam .ply, or the folder of a COLMAP model");
  options->AddRequiredOption("output_path", &converter->output_path, "the file to write");
  options->AddChoiceOption(
      "output_type",
      &converter->output_type,
      {"auto", "foam", "radiant_foam", "splats", "points", "text"},
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

// "auto": what the file's name says.
std::string TypeOf(const std::string& output_type, const std::string& output_path) {
  if (output_type != "auto") return output_type;
  const std::string extension = fs::path(output_path).extension().string();
  if (extension == ".foam") return "foam";
  if (extension == ".txt") return "text";
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
                    const std::string& type) {
  const bool is_of_cells = type == "splats" || type == "points";
  if (!is_of_cells) {
    for (const auto& [name, text] :
         {std::pair("labels", converter.choice.labels),
          std::pair("exclude_labels", converter.choice.exclude_labels)}) {
      if (text.empty()) continue;
      throw UserError("Failed to parse options - --",
                      name,
                      " chooses splats and points; ",
                      type,
                      " takes the whole foam.");
    }
  }
  if (type != "splats") {
    options.RequireEffect({"splat_scale"}, "on " + type + "; leave it out, or write splats");
  }
}

// Writes the visible cells as splats or points.
void WriteCells(const ConverterOptions& converter,
                const std::string& type,
                const Model& model,
                const ExportableScene& scene) {
  const std::string& path = converter.output_path;
  const std::vector<uint32_t> cells = VisibleCells(scene, FilterObjects(scene, converter.choice));
  if (cells.empty()) {
    LOG(WARNING) << path << ": no cell is solid and seen by a photo; the file is empty";
  }
  if (type == "splats") {
    WriteSplats(path, model, scene, cells, converter.splat_scale);
  } else {
    WriteCellPoints(path, scene, cells);
  }
  LOG(INFO) << path << ": " << cells.size() << " " << type << " of " << model.foam.NumSites()
            << " cells";
}

// Writes the model as this type of file, and says what it holds.
void WriteOutput(const ConverterOptions& converter, const std::string& type, const Model& model) {
  const std::string& path = converter.output_path;
  if (type == "foam") {
    WriteModel(path, model);
    LOG(INFO) << path << ": " << model.foam.NumSites() << " sites";
    return;
  }
  const ExportableScene scene = MakeExportableScene(model);
  if (type == "radiant_foam") {
    WriteRadiantFoamPly(path, model, scene);
    LOG(INFO) << path << ": " << model.foam.NumSites()
              << " sites; Radiant Foam's format has no labels";
  } else if (type == "text") {
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
  const std::string type = TypeOf(converter.output_type, converter.output_path);
  RequireEffects(options, converter, type);
  CheckNoInputOverwrite(FilesOf(converter.input_path), {converter.output_path});
  WriteOutput(converter, type, ReadInput(converter.input_path, options.RandomSeed()));
}

}  // namespace semfoam
