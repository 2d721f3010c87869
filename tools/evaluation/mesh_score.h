// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/enum_names.h"
#include "tools/evaluation/mesh_distance.h"

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// The score of a mesh against a reference. All distances are in units of the diagonal of the
// reference's bounding box.
struct MeshScore {
  // Diagonal of the reference's box, in its own unit.
  double diagonal = 0;
  // For each tolerance: the share of the mesh that is nearer than that to the reference; the share
  // of the reference that is nearer than that to the mesh; and their harmonic mean, 0 where both
  // are (Knapitsch et al. 2017, Tanks and Temples).
  std::vector<double> precision, recall, f_score;
  // Distance of the mesh from the reference, and of the reference from the mesh.
  double accuracy = 0, accuracy_max = 0;
  double completeness = 0, completeness_max = 0;
};

// The target of the distances.
enum class Nearest {
  // Samples, 60000 points of the mesh and 120000 of the reference, as in benchmarks: distances are
  // slightly too long, small ones by up to half the distance between samples.
  kSamples,
  // The triangles.
  kSurface,
};
inline constexpr EnumName<Nearest> kNearestNames[] = {{Nearest::kSamples, "samples"},
                                                      {Nearest::kSurface, "surface"}};

// Scores a mesh, with both surfaces sampled evenly by area. `visible` are points of the part of the
// reference that counts for recall and completeness; empty: all of it. `tolerances` > 0.
MeshScore ScoreMesh(const TriangleMesh& mesh,
                    const TriangleMesh& reference,
                    const std::vector<Eigen::Vector3d>& visible,
                    const std::vector<double>& tolerances,
                    Nearest nearest = Nearest::kSamples);

// A mesh and its reference, by name.
struct MeshPair {
  // Name of the reference.
  std::string name;
  std::filesystem::path reference;
  // Empty: there is none of that name.
  std::filesystem::path mesh;
  // Empty: not requested.
  std::filesystem::path visible;
};

// Pairs the meshes of two places, each a file or a folder. In a folder, files that an export's
// labels.json lists have the names of their objects; other files have their stems as names, of
// which a leading "<id>_" may be missing. Names are compared after SanitizedName. Of several
// formats of one mesh, uses the most exact one. Two files are always a pair. `visible_path`, if not
// empty, is a file or a folder of .ply points, which must have some for every pair. Returns the
// pairs by the references' names. Throws UserError when nothing matches.
std::vector<MeshPair> PairMeshes(const std::filesystem::path& mesh_path,
                                 const std::filesystem::path& reference_path,
                                 const std::filesystem::path& visible_path);

}  // namespace semfoam
