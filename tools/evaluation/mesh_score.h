// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "tools/evaluation/mesh_distance.h"

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// How near a mesh comes to a reference. All distances are in units of the diagonal of the
// reference's bounding box.
struct MeshScore {
  double diagonal = 0;  // of the reference's box, in its own unit
  // For each tolerance: the share of the mesh that is nearer than that to the reference; the share
  // of the reference that is nearer than that to the mesh; and their harmonic mean, 0 where both
  // are (Knapitsch et al. 2017, Tanks and Temples).
  std::vector<double> precision, recall, f_score;
  // Distance of the mesh from the reference, and of the reference from the mesh.
  double accuracy = 0, accuracy_max = 0;
  double completeness = 0, completeness_max = 0;
};

// What a distance is measured to.
enum class Nearest {
  kSamples,  // 60000 points of the mesh, 120000 of the reference, as benchmarks do it: a distance
             // is a little too long, by half of that between samples at most where it is small
  kSurface,  // the triangles
};

// Surfaces count by area, at samples. `visible`: the part of the reference that counts for recall
// and completeness, as points; empty: all of it. `tolerances` > 0.
MeshScore ScoreMesh(const TriangleMesh& mesh,
                    const TriangleMesh& reference,
                    const std::vector<Eigen::Vector3d>& visible,
                    const std::vector<double>& tolerances,
                    Nearest nearest = Nearest::kSamples);

// A mesh and its reference, by name.
struct MeshPair {
  std::string name;  // the reference's
  std::filesystem::path reference;
  std::filesystem::path mesh;     // empty: there is none of that name
  std::filesystem::path visible;  // empty: none was asked for
};

// Pairs the meshes of two places, each a file or a folder. In a folder, what an export's
// labels.json lists is named after its objects; else files are named by their stems, of which a
// leading "<id>_" may be missing; names are compared as SanitizedName writes them. Of several
// formats of one mesh, the most exact one is taken. Two files are a pair whatever their names.
// `visible_path`, if not empty, is a file or a folder of .ply points, which must have some for
// every pair. By the references' names. Throws UserError when nothing matches.
std::vector<MeshPair> PairMeshes(const std::filesystem::path& mesh_path,
                                 const std::filesystem::path& reference_path,
                                 const std::filesystem::path& visible_path);

}  // namespace semfoam
