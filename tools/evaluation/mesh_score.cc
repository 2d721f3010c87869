// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/evaluation/mesh_score.h"

#include "export/scene/names.h"
#include "foam/util/error.h"
#include "foam/util/json_file.h"

#include <algorithm>
#include <cctype>
#include <map>
#include <numeric>

#include <Eigen/Geometry>
#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

constexpr int64_t kMeshSamples = 60'000;
constexpr int64_t kReferenceSamples = 120'000;
// The most exact first.
constexpr const char* kMeshFormats[] = {"om", "ply", "off", "obj", "stl"};

double Mean(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

double ShareBelow(const std::vector<double>& values, double limit) {
  const auto count =
      std::count_if(values.begin(), values.end(), [&](double value) { return value < limit; });
  return static_cast<double>(count) / static_cast<double>(values.size());
}

// A file and all that it may be called.
struct NamedFile {
  fs::path path;
  std::string name;
  std::vector<std::string> keys;
};

bool ShareAKey(const NamedFile& a, const NamedFile& b) {
  return std::any_of(a.keys.begin(), a.keys.end(), [&](const std::string& key) {
    return std::find(b.keys.begin(), b.keys.end(), key) != b.keys.end();
  });
}

NamedFile NamedByStem(const fs::path& path) {
  const std::string stem = path.stem().string();
  NamedFile file = {path, stem, {SanitizedName(kNoObject, stem)}};
  const size_t digits = stem.find_first_not_of("0123456789");
  if (digits != 0 && digits != std::string::npos && stem[digits] == '_' &&
      digits + 1 < stem.size()) {
    file.keys.push_back(SanitizedName(kNoObject, stem.substr(digits + 1)));
  }
  return file;
}

// Returns the meshes that an export's labels.json lists; none where there is no such file.
std::vector<NamedFile> FilesOfExport(const fs::path& folder) {
  std::vector<NamedFile> files;
  if (!fs::exists(folder / "labels.json")) return files;
  const nlohmann::json labels = ReadJsonFile(folder / "labels.json");
  if (!labels.is_object() || !labels.value("objects", nlohmann::json()).is_array()) return files;
  for (const nlohmann::json& object : labels["objects"]) {
    if (!object.is_object() || !object.value("name", nlohmann::json()).is_string()) continue;
    const nlohmann::json paths = object.value("files", nlohmann::json());
    for (const char* format : kMeshFormats) {
      if (!paths.is_object() || !paths.value(format, nlohmann::json()).is_string()) continue;
      const fs::path path = folder / paths[format].get<std::string>();
      if (!fs::exists(path)) continue;
      NamedFile named = NamedByStem(path);
      named.name = object["name"];
      named.keys.push_back(SanitizedName(kNoObject, named.name));
      files.push_back(named);
      break;
    }
  }
  return files;
}

// Returns the files of these formats at a path, one for each stem, by name.
std::vector<NamedFile> ListFiles(const fs::path& path,
                                 const std::vector<std::string>& formats,
                                 const char* option) {
  if (!fs::exists(path)) {
    throw UserError(path.string(), ": there is no such file or folder for ", option, ".");
  }
  if (!fs::is_directory(path)) return {NamedByStem(path)};
  std::vector<NamedFile> files = FilesOfExport(path);
  if (files.empty()) {
    std::map<std::string, std::pair<size_t, fs::path>> best;  // of each stem
    for (const auto& entry : fs::directory_iterator(path)) {
      std::string extension = entry.path().extension().string();
      for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
      const auto format =
          std::find(formats.begin(), formats.end(), extension.empty() ? "" : extension.substr(1));
      if (format == formats.end() || !entry.is_regular_file()) continue;
      const auto rank = static_cast<size_t>(format - formats.begin());
      const auto [at, is_new] = best.try_emplace(entry.path().stem().string(), rank, entry.path());
      if (!is_new && rank < at->second.first) at->second = {rank, entry.path()};
    }
    for (const auto& [stem, file] : best) files.push_back(NamedByStem(file.second));
  }
  if (files.empty()) {
    throw UserError(
        path.string(),
        ": has no files for ",
        option,
        "; it takes ",
        [&] {
          std::string list;
          for (const std::string& format : formats) list += (list.empty() ? "." : ", .") + format;
          return list;
        }(),
        ".");
  }
  return files;
}

std::string NamesOf(const std::vector<NamedFile>& files) {
  std::string names;
  for (const NamedFile& file : files) names += (names.empty() ? "" : ", ") + file.name;
  return names;
}

}  // namespace

MeshScore ScoreMesh(const TriangleMesh& mesh,
                    const TriangleMesh& reference,
                    const std::vector<Eigen::Vector3d>& visible,
                    const std::vector<double>& tolerances,
                    Nearest nearest) {
  Eigen::AlignedBox3d box;
  for (const auto& triangle : reference.triangles) {
    for (const uint32_t vertex : triangle) box.extend(reference.vertices[vertex]);
  }
  MeshScore score;
  score.diagonal = box.diagonal().norm();
  const std::vector<Eigen::Vector3d> of_mesh = SampleSurface(mesh, kMeshSamples);
  const std::vector<Eigen::Vector3d> of_reference = SampleSurface(reference, kReferenceSamples);
  const std::vector<Eigen::Vector3d>& counted = visible.empty() ? of_reference : visible;
  const bool exact = nearest == Nearest::kSurface;
  std::vector<double> from_mesh =
      exact ? DistancesToSurface(reference, of_mesh) : DistancesToPoints(of_reference, of_mesh);
  std::vector<double> from_reference =
      exact ? DistancesToSurface(mesh, counted) : DistancesToPoints(of_mesh, counted);
  for (double& distance : from_mesh) distance /= score.diagonal;
  for (double& distance : from_reference) distance /= score.diagonal;
  for (const double tolerance : tolerances) {
    const double precision = ShareBelow(from_mesh, tolerance);
    const double recall = ShareBelow(from_reference, tolerance);
    const double sum = precision + recall;
    score.precision.push_back(precision);
    score.recall.push_back(recall);
    score.f_score.push_back(sum > 0 ? 2 * precision * recall / sum : 0);
  }
  score.accuracy = Mean(from_mesh);
  score.accuracy_max = *std::max_element(from_mesh.begin(), from_mesh.end());
  score.completeness = Mean(from_reference);
  score.completeness_max = *std::max_element(from_reference.begin(), from_reference.end());
  return score;
}

std::vector<MeshPair> PairMeshes(const fs::path& mesh_path,
                                 const fs::path& reference_path,
                                 const fs::path& visible_path) {
  const std::vector<std::string> formats(std::begin(kMeshFormats), std::end(kMeshFormats));
  const std::vector<NamedFile> meshes = ListFiles(mesh_path, formats, "mesh_path");
  const std::vector<NamedFile> references = ListFiles(reference_path, formats, "reference_path");
  std::vector<NamedFile> visibles;
  if (!visible_path.empty()) visibles = ListFiles(visible_path, {"ply"}, "visible_path");
  // Of a file alone there is no doubt what it belongs to.
  const bool are_two_files = !fs::is_directory(mesh_path) && !fs::is_directory(reference_path);

  std::vector<MeshPair> pairs;
  bool any = false;
  for (const NamedFile& reference : references) {
    MeshPair pair = {reference.name, reference.path, {}, {}};
    const auto mesh = std::find_if(meshes.begin(), meshes.end(), [&](const NamedFile& file) {
      return are_two_files || ShareAKey(file, reference);
    });
    if (mesh != meshes.end()) {
      any = true;
      pair.mesh = mesh->path;
      const auto visible =
          std::find_if(visibles.begin(), visibles.end(), [&](const NamedFile& file) {
            return (are_two_files && visibles.size() == 1) || ShareAKey(file, reference);
          });
      if (visible != visibles.end()) {
        pair.visible = visible->path;
      } else if (!visible_path.empty()) {
        throw UserError(visible_path.string(),
                        ": has no points for the reference '",
                        reference.name,
                        "'; it has some for ",
                        NamesOf(visibles),
                        ".");
      }
    }
    pairs.push_back(pair);
  }
  if (!any) {
    throw UserError(mesh_path.string(),
                    ": has no mesh that is named as a reference; it has ",
                    NamesOf(meshes),
                    ", and reference_path has ",
                    NamesOf(references),
                    ".");
  }
  return pairs;
}

}  // namespace semfoam
