// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/scene/export_transform.h"
#include "export/scene/names.h"
#include "foam/util/error.h"
#include "foam/util/output_file.h"
#include "foam/util/photo_name.h"
#include "tools/cli/input_protection.h"
#include "tools/cli/option_manager.h"
#include "tools/commands/commands.h"
#include "tools/evaluation/mesh_score.h"
#include "tools/options/enum_option.h"
#include "tools/options/json_option.h"

#include <charconv>
#include <cmath>
#include <cstdio>
#include <sstream>
#include <string>
#include <vector>

#include <glog/logging.h>
#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

using nlohmann::ordered_json;

std::vector<double> ParseTolerances(const std::string& text) {
  std::vector<double> tolerances;
  std::istringstream parts(text);
  for (std::string part; std::getline(parts, part, ',');) {
    double value = 0;
    const char* const end = part.data() + part.size();
    const auto [at, code] = std::from_chars(part.data(), end, value);
    if (code != std::errc() || at != end || !(value > 0) || !std::isfinite(value)) {
      tolerances.clear();
      break;
    }
    tolerances.push_back(value);
  }
  if (tolerances.empty() || text.back() == ',') {
    throw UserError("Failed to parse options - the argument ('",
                    text,
                    "') for option '--tolerances' is invalid; it takes positive numbers, apart by "
                    "commas: 0.01,0.02.");
  }
  return tolerances;
}

struct ScoredPair {
  MeshPair files;
  MeshScore score;  // zeros where there is no mesh

  bool HasMesh() const { return !files.mesh.empty(); }
};

// A reference without a mesh counts with nothing found; it has no distances.
MeshScore MeanOf(const std::vector<ScoredPair>& pairs, size_t num_tolerances) {
  MeshScore mean;
  double with_mesh = 0;
  mean.precision.assign(num_tolerances, 0);
  mean.recall = mean.f_score = mean.precision;
  for (const ScoredPair& pair : pairs) {
    for (size_t k = 0; k < num_tolerances; ++k) {
      mean.precision[k] += pair.score.precision[k] / static_cast<double>(pairs.size());
      mean.recall[k] += pair.score.recall[k] / static_cast<double>(pairs.size());
      mean.f_score[k] += pair.score.f_score[k] / static_cast<double>(pairs.size());
    }
    with_mesh += pair.HasMesh() ? 1 : 0;
  }
  for (const ScoredPair& pair : pairs) {
    mean.accuracy += pair.score.accuracy / with_mesh;
    mean.accuracy_max = std::max(mean.accuracy_max, pair.score.accuracy_max);
    mean.completeness += pair.score.completeness / with_mesh;
    mean.completeness_max = std::max(mean.completeness_max, pair.score.completeness_max);
  }
  return mean;
}

void PrintRow(const std::string& name, const MeshScore& score, bool has_mesh) {
  std::printf("%-20s", OneLine(name).c_str());
  for (size_t k = 0; k < score.precision.size(); ++k) {
    std::printf("  %6.3f %6.3f %6.3f", score.precision[k], score.recall[k], score.f_score[k]);
  }
  if (has_mesh) {
    std::printf("  %8.5f %8.5f  %8.5f %8.5f\n",
                score.accuracy,
                score.accuracy_max,
                score.completeness,
                score.completeness_max);
  } else {
    std::printf("  no mesh of that name\n");
  }
}

void Print(const std::vector<ScoredPair>& pairs, const std::vector<double>& tolerances) {
  std::printf("%-20s", "");
  for (const double tolerance : tolerances) std::printf("  within %-13.6g", tolerance);
  std::printf("  %-17s  %-17s\n", "mesh to reference", "reference to mesh");
  std::printf("%-20s", "object");
  for (size_t k = 0; k < tolerances.size(); ++k) {
    std::printf("  %6s %6s %6s", "prec.", "recall", "F");
  }
  std::printf("  %8s %8s  %8s %8s\n", "mean", "max", "mean", "max");
  for (const ScoredPair& pair : pairs) PrintRow(pair.files.name, pair.score, pair.HasMesh());
  PrintRow("mean", MeanOf(pairs, tolerances.size()), true);
}

ordered_json ToJson(const MeshScore& score) {
  return {{"precision", score.precision},
          {"recall", score.recall},
          {"f_score", score.f_score},
          {"accuracy", score.accuracy},
          {"accuracy_max", score.accuracy_max},
          {"completeness", score.completeness},
          {"completeness_max", score.completeness_max}};
}

ordered_json ToJson(const std::vector<ScoredPair>& pairs, const std::vector<double>& tolerances) {
  ordered_json json = {{"tolerances", tolerances},
                       {"mean", ToJson(MeanOf(pairs, tolerances.size()))}};
  for (const ScoredPair& pair : pairs) {
    ordered_json object = ToJson(pair.score);
    object["diagonal"] = pair.score.diagonal;
    if (!pair.HasMesh())
      object = {{"f_score", pair.score.f_score}, {"why", "no mesh of that name"}};
    json["objects"][pair.files.name] = object;
  }
  return json;
}

// A file system takes names that JSON does not; and no mesh is written over.
void RequireRoomForJson(const std::string& json_path, const std::vector<MeshPair>& meshes) {
  for (const MeshPair& files : meshes) {
    CheckNoInputOverwrite({files.mesh, files.reference, files.visible}, {json_path}, "json_path");
    if (IsUtf8(files.name)) continue;
    throw UserError(files.reference.string(),
                    ": its name is not UTF-8 and cannot stand in a JSON file; rename it, or leave "
                    "--json_path out.");
  }
}

// Options of the command line.
struct EvaluatorOptions {
  std::string mesh_path;
  std::string reference_path;
  std::string visible_path;
  std::string tolerances = "0.01,0.02";
  Nearest nearest = Nearest::kSamples;
  // "0", "1" or a path.
  std::string json = "0";
  std::string json_path;
  ExportTransformOptions frame;
};

void AddOptions(OptionManager* options, EvaluatorOptions* evaluator) {
  options->AddRequiredOption("mesh_path",
                             &evaluator->mesh_path,
                             "a mesh (.obj, .ply, .off, .stl, .om), or a folder of them: what "
                             "mesh_exporter has written, or its objects/");
  options->AddRequiredOption("reference_path",
                             &evaluator->reference_path,
                             "the true mesh, or a folder of them, named as the objects: mug.obj");
  options->AddDefaultOption("visible_path",
                            &evaluator->visible_path,
                            "points (.ply), or a folder of them: the part of the reference that "
                            "photos show, which alone counts for recall; by default all of it");
  options->AddDefaultOption("tolerances",
                            &evaluator->tolerances,
                            "what counts as near, apart by commas, as shares of the diagonal");
  AddEnumOption(options,
                "nearest",
                &evaluator->nearest,
                kNearestNames,
                "distances to the nearest of 60000 points of the mesh and 120000 of the "
                "reference, as benchmarks do it, or exactly to the triangles");
  options->AddDefaultOption("transform",
                            &evaluator->frame.transform,
                            "a similarity from the frame of the meshes to that of the references: "
                            "the 12 or 16 numbers of its matrix, row by row");
  options->AddDefaultOption(
      "json_path", &evaluator->json_path, "also write the scores to this file");
  options->AddDefaultOption("json",
                            &evaluator->json,
                            "1 = print the scores as JSON, not as a table; a path: the same as "
                            "--json_path");
}

// Scores one pair of files; zeros where there is no mesh. `transform` leads from the frame of the
// mesh to that of the reference.
ScoredPair ScorePair(const MeshPair& files,
                     const ExportTransform& transform,
                     const std::vector<double>& tolerances,
                     Nearest nearest) {
  ScoredPair pair{files, {}};
  if (!pair.HasMesh()) {
    pair.score.precision.assign(tolerances.size(), 0);
    pair.score.recall = pair.score.f_score = pair.score.precision;
    return pair;
  }
  LOG(INFO) << files.name << ": " << files.mesh.string() << " against " << files.reference.string();
  TriangleMesh mesh = ReadTriangleMesh(files.mesh);
  for (Eigen::Vector3d& x : mesh.vertices) {
    x = transform.scale * (transform.rotation * x) + transform.translation;
  }
  std::vector<Eigen::Vector3d> visible;
  if (!files.visible.empty()) visible = ReadPlyPoints(files.visible);
  pair.score = ScoreMesh(mesh, ReadTriangleMesh(files.reference), visible, tolerances, nearest);
  return pair;
}

}  // namespace

void RunMeshEvaluator(int argc, char** argv) {
  EvaluatorOptions evaluator;
  OptionManager options(
      "mesh_evaluator",
      "Scores meshes against reference meshes: precision (how much of the mesh is near the "
      "reference), recall (how much of the reference is near the mesh), their harmonic mean F, and "
      "the distances, as shares of the diagonal of the reference's bounding box.");
  AddOptions(&options, &evaluator);
  if (!options.Parse(argc, argv)) return;
  const std::vector<double> tolerances = ParseTolerances(evaluator.tolerances);
  const ExportTransform transform = ParseExportTransform(evaluator.frame);

  bool prints_json = false;
  if (!ParseValue(evaluator.json, &prints_json)) {
    if (!evaluator.json_path.empty()) {
      throw UserError(
          "Failed to parse options - the option '--json_path' is given more than once; "
          "give it once.");
    }
    evaluator.json_path = evaluator.json;
  }

  const std::vector<MeshPair> meshes =
      PairMeshes(evaluator.mesh_path, evaluator.reference_path, evaluator.visible_path);
  if (!evaluator.json_path.empty()) RequireRoomForJson(evaluator.json_path, meshes);
  std::vector<ScoredPair> pairs;
  for (const MeshPair& files : meshes) {
    pairs.push_back(ScorePair(files, transform, tolerances, evaluator.nearest));
  }
  if (prints_json) {
    PrintJson(ToJson(pairs, tolerances));
  } else {
    Print(pairs, tolerances);
  }
  if (!evaluator.json_path.empty()) {
    WriteTextFile(evaluator.json_path, ToJson(pairs, tolerances).dump(1) + "\n");
  }
}

}  // namespace semfoam
