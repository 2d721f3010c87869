// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/scene/scene_cells.h"

#include "export/scene/cell_colors.h"
#include "foam/geometry/guard_sites.h"
#include "foam/geometry/voronoi.h"
#include "foam/model/activation.h"

#include <glog/logging.h>

namespace semfoam {
namespace {

void CheckModel(const Model& model) {
  const Foam& foam = model.foam;
  const size_t n = foam.NumSites();
  CHECK_EQ(foam.raw_density.size(), n);
  CHECK_EQ(foam.sh.size(), n * foam.ShStride());
  if (foam.HasSemantics()) {
    CHECK_EQ(model.labels.size(), static_cast<size_t>(foam.num_classes));
    CHECK_EQ(foam.identity.size(), n * kIdentityDim);
  }
  const CellStatistics& statistics = model.statistics;
  CHECK(statistics.contribution.empty() || statistics.contribution.size() == n);
  CHECK(statistics.mean_color.empty() || statistics.mean_color.size() == n);
  CHECK(statistics.passed.empty() || statistics.passed.size() == n);
  CHECK_EQ(statistics.stopped.size(), statistics.passed.size());
}

// CellStatistics::passed of a cell that photos look through. Behind surfaces it is 0, however many
// rays leak there.
constexpr float kFewestCrossings = 1;

bool IsSeen(const CellStatistics& statistics, uint32_t cell, float fewest_looks) {
  return statistics.passed[cell] + statistics.stopped[cell] >= fewest_looks;
}

// Returns whether each cell is matter: solid, and no haze that nearly all rays pass.
std::vector<uint8_t> FindMatter(const CellStatistics& statistics,
                                float fewest_looks,
                                const ExportableScene& scene) {
  const bool knows_rays = !statistics.passed.empty();
  std::vector<uint8_t> is_matter(scene.NumSites(), 0);
  for (uint32_t i = 0; i < scene.NumSites(); ++i) {
    // A site at the place of another one has no cell.
    if (!scene.labels.solid[i] || scene.delaunay.Neighbors(i).empty()) continue;
    if (knows_rays && IsSeen(statistics, i, fewest_looks) && IsHaze(statistics, i)) continue;
    is_matter[i] = 1;
  }
  return is_matter;
}

}  // namespace

ExportableScene MakeSceneCells(const Model& model, const ExportableSceneOptions& options) {
  CheckModel(model);
  const size_t n = model.foam.NumSites();
  ExportableScene scene;
  scene.transform = options.transform;
  scene.colmap_from_normalized = model.world_from_normalized;
  scene.world_from_normalized = options.transform.Unturned(model.world_from_normalized);
  scene.label_table = model.labels;
  scene.cell_positions = WithGuardSites(model.foam.positions);
  scene.delaunay = Triangulate(scene.cell_positions);
  scene.voronoi_vertices = VoronoiVertices(scene.cell_positions, scene.delaunay);
  scene.tets_of_cells = ListTetsOfCells(scene.delaunay);
  scene.face_areas = FaceAreas(scene.cell_positions, scene.delaunay, scene.voronoi_vertices);
  scene.volume = CellVolumes(scene.cell_positions, scene.delaunay, scene.face_areas);
  scene.radius = CellRadii(scene.cell_positions, scene.delaunay);
  scene.labels = LabelCells(model.foam, scene.delaunay, options.solid_optical_depth);
  scene.display_color = DisplayColors(model);

  scene.density.resize(n);
  scene.label_id.resize(n);
  scene.photographed.assign(n, 1);
  for (size_t i = 0; i < n; ++i) {
    scene.density[i] = Density(model.foam.raw_density[i]);
    scene.label_id[i] = LabelIdOf(model.labels, scene.labels.class_index[i]);
    if (!model.statistics.contribution.empty()) {
      scene.photographed[i] = model.statistics.contribution[i] >= options.photographed_contribution;
    }
  }
  scene.passed = model.statistics.passed;
  scene.stopped = model.statistics.stopped;
  scene.seen.assign(n, 1);
  scene.crossed.assign(n, 0);
  if (!model.statistics.passed.empty()) {
    for (uint32_t i = 0; i < n; ++i) {
      scene.seen[i] = IsSeen(model.statistics, i, options.fewest_looks);
      scene.crossed[i] = model.statistics.passed[i] >= kFewestCrossings;
    }
  }
  scene.color_weight = ColorWeights(model, scene.photographed);
  scene.object_of_cell.assign(n, -1);
  scene.is_matter = FindMatter(model.statistics, options.fewest_looks, scene);
  return scene;
}

std::vector<uint8_t> CellsWithCameras(const Model& model, const ExportableScene& scene) {
  std::vector<uint8_t> has_camera(scene.delaunay.num_cells, 0);
  uint32_t cell = 0;
  for (const PhotoRecord& photo : model.photos) {
    const Eigen::Vector3d center_in_world =
        -(photo.cam_from_world_rotation.inverse() * photo.cam_from_world_translation);
    cell = NearestCell(scene.cell_positions,
                       scene.delaunay,
                       scene.colmap_from_normalized.Invert(center_in_world),
                       cell);
    has_camera[cell] = 1;
  }
  return has_camera;
}

}  // namespace semfoam
