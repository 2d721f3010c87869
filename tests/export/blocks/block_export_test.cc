// SPDX-License-Identifier: GPL-3.0-or-later
//
// Exports of a foam in blocks, held against those of the whole foam.
#include "export/blocks/block_export.h"

#include "export/blocks/block_objects.h"
#include "export/blocks/block_scene.h"
#include "export/blocks/block_surfaces.h"
#include "export/scene/object_description.h"
#include "export/scene/object_surface.h"
#include "export/scene/surface_topology.h"
#include "foam/geometry/site_tree.h"
#include "foam/util/parallel.h"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <map>
#include <set>
#include <string>
#include <utility>

#include "tests/export/blocks/foam_in_blocks.h"
#include "tests/export/test_foams.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <openvdb/openvdb.h>

namespace semfoam {
namespace {

struct Case {
  std::string name;
  Model model;
};

// A hollow ball, whose air is nobody's, and a crumb of it; and a thing beside it.
Model HollowBall() {
  return MakeModel(RandomSites(6000, 8), 2, [](const Eigen::Vector3f& p) {
    if (p.norm() < 0.75f && p.norm() > 0.5f) return 0;
    if ((p - Eigen::Vector3f(-0.8f, -0.8f, 0)).norm() < 0.2f) return 1;
    return (p - Eigen::Vector3f(0.85f, 0.85f, 0.85f)).norm() < 0.12f ? 0 : kAir;
  });
}

// Two dense clusters far apart and a few sites between them: cells that reach through blocks.
Model FarClusters() {
  std::vector<Eigen::Vector3f> sites;
  for (const Eigen::Vector3f& site : RandomSites(1500, 3)) {
    sites.push_back(0.3f * site + Eigen::Vector3f(site.x() < 0 ? -8.f : 8.f, 0, 0));
  }
  for (const Eigen::Vector3f& site : RandomSites(40, 4)) sites.push_back(12 * site);
  return MakeModel(sites, 2, [](const Eigen::Vector3f& p) {
    return p.x() < -7 ? 0 : p.norm() < 6 ? 1 : kAir;
  });
}

std::vector<Case> Cases() {
  return {{"touching balls", TouchingBalls()},
          {"torus", Torus()},
          {"classes by lot", ClassesByLot(2)},
          {"cube in a grid", CubeInAGrid()},
          {"lots in a grid", LotsInAGrid()},
          {"ball in a near grid", BallInANearGrid()},
          {"hollow ball", HollowBall()},
          {"far clusters", FarClusters()}};
}

// Sorted corners of the tetrahedra around a cell. `id_of` numbers the cells.
template <typename IdOf>
std::vector<std::array<uint32_t, 4>> TetsAround(const ExportableScene& scene,
                                                uint32_t cell,
                                                const IdOf& id_of) {
  std::vector<std::array<uint32_t, 4>> tets;
  for (const uint32_t t : scene.tets_of_cells.Of(cell)) {
    std::array<uint32_t, 4>& tet = tets.emplace_back(scene.delaunay.tets[t]);
    for (uint32_t& corner : tet) corner = id_of(corner);
    std::sort(tet.begin(), tet.end());
  }
  std::sort(tets.begin(), tets.end());
  return tets;
}

TEST(BlockScenes, CellsAreThoseOfTheWholeFoam) {
  for (const auto& [name, model] : Cases()) {
    for (const float halo : {0.f, 0.2f}) {
      SCOPED_TRACE(name + ", halo " + std::to_string(halo));
      const ExportableScene whole = MakeExportableScene(model);
      const FoamInBlocks cut = CutIntoBlocks(model, 2, 2, halo);
      BlockScenes scenes(cut.blocks, {});
      ASSERT_EQ(scenes.NumSites(), model.foam.NumSites());
      for (size_t b = 0; b < scenes.NumBlocks(); ++b) {
        const BlockScene block = scenes.Make(b);
        const auto site_of = [&](uint32_t cell) {
          const uint32_t id = block.ids[cell];
          return id < cut.site_of_id.size() ? cut.site_of_id[id] : id;
        };
        for (uint32_t i = 0; i < block.num_own; ++i) {
          const uint32_t site = site_of(i);
          ASSERT_EQ(block.scene.cell_positions[i], whole.cell_positions[site]);
          ASSERT_EQ(TetsAround(block.scene, i, site_of),
                    TetsAround(whole, site, [](uint32_t cell) { return cell; }))
              << "cell " << site;
          // Sums in another order; corners of slivers are rounded more.
          EXPECT_NEAR(block.scene.volume[i], whole.volume[site], 1e-6 * (1 + whole.volume[site]));
          EXPECT_NEAR(block.scene.radius[i], whole.radius[site], 1e-5f * whole.radius[site]);
          EXPECT_EQ(block.scene.is_matter[i], whole.is_matter[site]);
        }
      }
    }
  }
}

// What no order of the cells changes, but for rounding.
void ExpectSame(const ObjectInfo& object, const ObjectInfo& whole) {
  EXPECT_EQ(object.id, whole.id);
  EXPECT_EQ(object.name, whole.name);
  EXPECT_EQ(object.file_stem, whole.file_stem);
  EXPECT_EQ(object.color, whole.color);
  EXPECT_EQ(object.components, whole.components);
  EXPECT_NEAR(object.volume, whole.volume, 1e-9 * whole.volume);
  EXPECT_NEAR(object.confidence, whole.confidence, 1e-6);
  EXPECT_TRUE(object.bounding_box.isApprox(whole.bounding_box, 1e-6));
  EXPECT_EQ(object.left_out.components, whole.left_out.components);
  EXPECT_EQ(object.left_out.cells, whole.left_out.cells);
  EXPECT_EQ(object.left_out.largest_cells, whole.left_out.largest_cells);
  EXPECT_NEAR(object.left_out.volume, whole.left_out.volume, 1e-9);
}

void ExpectSameObjects(const ExportableScene& objects,
                       const ExportableScene& whole,
                       const FoamInBlocks& cut) {
  ASSERT_EQ(objects.objects.size(), whole.objects.size());
  for (size_t k = 0; k < whole.objects.size(); ++k) {
    ExpectSame(objects.objects[k], whole.objects[k]);
    std::vector<uint32_t> cells;
    for (const uint32_t id : objects.objects[k].cells) cells.push_back(cut.site_of_id[id]);
    std::sort(cells.begin(), cells.end());
    EXPECT_EQ(cells, whole.objects[k].cells);
  }
  ASSERT_EQ(objects.labels_left_out.size(), whole.labels_left_out.size());
  for (size_t k = 0; k < whole.labels_left_out.size(); ++k) {
    EXPECT_EQ(objects.labels_left_out[k].id, whole.labels_left_out[k].id);
    EXPECT_EQ(objects.labels_left_out[k].reason, whole.labels_left_out[k].reason);
    EXPECT_EQ(objects.labels_left_out[k].left_out.cells, whole.labels_left_out[k].left_out.cells);
  }
  EXPECT_EQ(objects.labels_without_cells.size(), whole.labels_without_cells.size());
}

TEST(FindBlockObjects, AreThoseOfTheWholeFoam) {
  for (const auto& [name, model] : Cases()) {
    ExportableSceneOptions few, largest, fragments, hollow;
    few.components.min_cells = 3;
    largest.components.keep_largest = 1;
    fragments.components.keep_fragments = true;
    hollow.fill_hidden_space = false;
    for (const auto& [kind, options] :
         std::vector<std::pair<std::string, ExportableSceneOptions>>{{"default", {}},
                                                                     {"min_cells", few},
                                                                     {"keep_largest", largest},
                                                                     {"keep_fragments", fragments},
                                                                     {"hollow", hollow}}) {
      SCOPED_TRACE(name + ", " + kind);
      const FoamInBlocks cut = CutIntoBlocks(model, 3, 2, 0.1f);
      BlockScenes scenes(cut.blocks, options);
      ExpectSameObjects(FindBlockObjects(&scenes), MakeExportableScene(model, options), cut);
    }
  }
}

TEST(FindBlockObjects, CameraOpensACavity) {
  Model model = HollowBall();
  PhotoRecord photo;
  photo.cam_from_world_translation = Eigen::Vector3d(0.4, 0, 0);
  model.photos = {photo};
  const FoamInBlocks cut = CutIntoBlocks(model, 2, 2, 0.1f);
  BlockScenes scenes(cut.blocks, {});
  const ExportableScene objects = FindBlockObjects(&scenes);
  ExpectSameObjects(objects, MakeExportableScene(model), cut);
  model.photos.clear();
  EXPECT_LT(objects.objects[0].cells.size(), MakeExportableScene(model).objects[0].cells.size());
}

TEST(FindBlockObjects, HaveTheFrameOfTheFiles) {
  Model model = TouchingBalls();
  model.world_from_normalized.scale = 3;
  model.world_from_normalized.translation = {4e5, 5e6, 100};
  ExportableSceneOptions options;
  options.transform.scale = 2;
  options.transform.rotation << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  const FoamInBlocks cut = CutIntoBlocks(model, 2, 1, 0.1f);
  BlockScenes scenes(cut.blocks, options);
  ExpectSameObjects(FindBlockObjects(&scenes), MakeExportableScene(model, options), cut);
}

// Every edge is there once in either direction: closed, oriented, and no edge has four faces.
void ExpectClosed(const ObjectSurface& surface) {
  std::set<std::pair<uint32_t, uint32_t>> edges;
  for (const std::array<uint32_t, 3>& triangle : surface.triangles) {
    for (int k = 0; k < 3; ++k) {
      EXPECT_TRUE(edges.emplace(triangle[k], triangle[(k + 1) % 3]).second);
    }
  }
  for (const auto& [from, to] : edges) EXPECT_EQ(edges.count({to, from}), 1u);
}

// Expects that every vertex of `a` lies on one of `b`, as exactly as rounding lets it.
void ExpectOnVertices(const std::vector<Eigen::Vector3d>& a,
                      const std::vector<Eigen::Vector3d>& b) {
  std::vector<Eigen::Vector3f> floats;
  std::vector<uint32_t> all;
  for (const Eigen::Vector3d& x : b) {
    all.push_back(static_cast<uint32_t>(all.size()));
    floats.push_back(x.cast<float>());
  }
  const SiteTree tree(floats, all);
  for (const Eigen::Vector3d& x : a) {
    const std::vector<uint32_t> near = tree.Nearest(x, 1e-4 * (1 + x.norm()), 1);
    ASSERT_FALSE(near.empty()) << x.transpose();
    EXPECT_LT((b[near[0]] - x).norm(), 1e-6 * (1 + x.norm()));
  }
}

class BlockExport : public TemporaryFolderTest {
 protected:
  // Joins the surfaces of all objects.
  std::vector<JoinedSurface> Join(BlockScenes* scenes, const ExportableScene& objects) {
    for (size_t b = 0; b < scenes->NumBlocks(); ++b) {
      BlockScene block = scenes->Make(b);
      TakeObjects(objects, &block);
      WriteSurfacePieces(block, b, folder_);
    }
    std::vector<JoinedSurface> joined;
    for (size_t k = 0; k < objects.objects.size(); ++k) {
      joined.push_back(JoinSurface(objects, k, scenes->NumBlocks(), folder_));
    }
    for (const auto& file : std::filesystem::directory_iterator(folder_)) {
      std::filesystem::remove(file);
    }
    return joined;
  }
};

TEST_F(BlockExport, SurfacesAreThoseOfTheWholeFoam) {
  for (const auto& [name, model] : Cases()) {
    SCOPED_TRACE(name);
    const ExportableScene whole = MakeExportableScene(model);
    const FoamInBlocks cut = CutIntoBlocks(model, 2, 2, 0.1f);
    BlockScenes scenes(cut.blocks, {});
    ExportableScene objects = FindBlockObjects(&scenes);
    ASSERT_EQ(objects.objects.size(), whole.objects.size());
    const std::vector<JoinedSurface> joined = Join(&scenes, objects);
    for (size_t k = 0; k < joined.size(); ++k) {
      const ObjectSurface& surface = joined[k].surface;
      const ObjectSurface expected = ExtractSurface(whole, whole.objects[k]);
      EXPECT_EQ(surface.vertices.size(), expected.vertices.size());
      EXPECT_EQ(surface.triangles.size(), expected.triangles.size());
      EXPECT_EQ(surface.vertex_color.size(), surface.vertices.size());
      EXPECT_EQ(surface.vertex_confidence.size(), surface.vertices.size());
      EXPECT_EQ(surface.face_color.size(), surface.triangles.size());
      EXPECT_EQ(surface.face_confidence.size(), surface.triangles.size());
      ExpectClosed(surface);
      ExpectOnVertices(surface.vertices, expected.vertices);
      ExpectOnVertices(expected.vertices, surface.vertices);
      DescribeBySurface(surface, &objects.objects[k]);
      const ObjectInfo& object = objects.objects[k];
      EXPECT_EQ(object.genus, whole.objects[k].genus);
      EXPECT_EQ(object.cavities, whole.objects[k].cavities);
      EXPECT_NEAR(object.area, whole.objects[k].area, 1e-6 * object.area);
      EXPECT_TRUE(object.centroid.isApprox(whole.objects[k].centroid, 1e-6));
    }
  }
}

// The vertices of a face are counted by colour, as their order is another one.
TEST_F(BlockExport, SurfacesHaveTheColorsOfTheWholeFoam) {
  const Model model = TouchingBalls();
  const ExportableScene whole = MakeExportableScene(model);
  const FoamInBlocks cut = CutIntoBlocks(model, 2, 2, 0.1f);
  BlockScenes scenes(cut.blocks, {});
  const ExportableScene objects = FindBlockObjects(&scenes);
  const std::vector<JoinedSurface> joined = Join(&scenes, objects);
  for (size_t k = 0; k < joined.size(); ++k) {
    const ObjectSurface expected = ExtractSurface(whole, whole.objects[k]);
    std::map<Color8, int> faces;
    for (const Color8& color : joined[k].surface.face_color) ++faces[color];
    for (const Color8& color : expected.face_color) --faces[color];
    for (const auto& [color, count] : faces) EXPECT_EQ(count, 0);
  }
}

// Returns the grids of a .vdb by their names.
std::map<std::string, openvdb::GridBase::Ptr> ReadGrids(const std::filesystem::path& path) {
  openvdb::io::File file(path.string());
  file.open(/*delayLoad=*/false);
  std::map<std::string, openvdb::GridBase::Ptr> grids;
  const openvdb::GridPtrVecPtr read = file.getGrids();
  for (const openvdb::GridBase::Ptr& grid : *read) grids[grid->getName()] = grid;
  return grids;
}

// Expects the same active voxels with about the same values.
template <typename Grid>
void ExpectSameVoxels(const openvdb::GridBase::Ptr& made, const openvdb::GridBase::Ptr& whole) {
  const auto a = openvdb::gridPtrCast<Grid>(made), b = openvdb::gridPtrCast<Grid>(whole);
  EXPECT_EQ(a->activeVoxelCount(), b->activeVoxelCount());
  EXPECT_EQ(a->transform(), b->transform());
  EXPECT_EQ(a->getGridClass(), b->getGridClass());
  int64_t others = 0;
  for (auto voxel = b->cbeginValueOn(); voxel; ++voxel) {
    openvdb::CoordBBox box;
    voxel.getBoundingBox(box);
    for (auto at = box.begin(); at; ++at) {
      others += !a->tree().isValueOn(*at) ||
                !openvdb::math::isRelOrApproxEqual(a->tree().getValue(*at),
                                                   *voxel,
                                                   typename Grid::ValueType(1e-5f),
                                                   typename Grid::ValueType(1e-4f));
    }
  }
  // On the face between two cells, rounding decides.
  EXPECT_LE(others, static_cast<int64_t>(b->activeVoxelCount()) / 10000);
}

TEST_F(BlockExport, VolumesAreThoseOfTheWholeFoam) {
  for (const auto& [name, model] : Cases()) {
    for (const bool only : {false, true}) {
      SCOPED_TRACE(name + (only ? ", one object" : ""));
      VolumeExportOptions options;
      options.max_resolution = 64;
      options.label_grid_type = LabelGridType::kBoth;
      if (only) options.objects.only = std::set<LabelId>{LabelId{7}};
      const std::filesystem::path expected = folder_ / "whole", output = folder_ / "by block";
      for (const auto& path : {expected, output}) {
        std::filesystem::remove_all(path);
        std::filesystem::create_directories(path / "objects");
      }
      const std::vector<WrittenFile> whole_files =
          ExportVolumes(MakeExportableScene(model), expected, options);
      const FoamInBlocks cut = CutIntoBlocks(model, 2, 2, 0.1f);
      BlockScenes scenes(cut.blocks, {});
      ExportableScene objects = FindBlockObjects(&scenes);
      const std::vector<WrittenFile> files = ExportBlockVolumes(&scenes, &objects, output, options);
      ASSERT_EQ(files.size(), whole_files.size());
      for (size_t k = 0; k < files.size(); ++k) {
        SCOPED_TRACE(files[k].path);
        EXPECT_EQ(files[k].path, whole_files[k].path);
        EXPECT_EQ(files[k].object_id, whole_files[k].object_id);
        EXPECT_EQ(files[k].summary, whole_files[k].summary);
        EXPECT_EQ(files[k].warning, whole_files[k].warning);
        const auto made = ReadGrids(output / files[k].path);
        const auto whole = ReadGrids(expected / files[k].path);
        ASSERT_EQ(made.size(), whole.size());
        for (const auto& [grid, values] : whole) {
          SCOPED_TRACE(grid);
          ASSERT_EQ(made.count(grid), 1u);
          if (values->isType<openvdb::FloatGrid>()) {
            ExpectSameVoxels<openvdb::FloatGrid>(made.at(grid), values);
          } else {
            EXPECT_EQ(made.at(grid)->activeVoxelCount(), values->activeVoxelCount());
          }
        }
      }
    }
  }
}

std::map<std::string, std::string> BytesBelow(const std::filesystem::path& folder) {
  std::map<std::string, std::string> bytes;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (!entry.is_regular_file()) continue;
    std::ifstream file(entry.path(), std::ios::binary);
    bytes[std::filesystem::relative(entry.path(), folder).string()] = {
        std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  }
  return bytes;
}

TEST_F(BlockExport, WritesTheSameBytesOnAnyNumberOfThreadsAndWithAnyHalo) {
  const Model model = TouchingBalls();
  std::map<std::string, std::string> first;
  for (const auto& [threads, halo] :
       std::vector<std::pair<int, float>>{{1, 0.1f}, {2, 0.1f}, {5, 0.1f}, {2, 0.f}, {2, 3.f}}) {
    const std::filesystem::path output =
        folder_ / (std::to_string(threads) + "_" + std::to_string(halo));
    std::filesystem::create_directories(output / "objects");
    const ThreadLimit limit(threads);
    const FoamInBlocks cut = CutIntoBlocks(model, 2, 2, halo);
    BlockScenes scenes(cut.blocks, {});
    ExportableScene objects = FindBlockObjects(&scenes);
    SurfaceExportOptions options;
    options.method = SurfaceMethod::kCells;
    const std::vector<WrittenFile> files = ExportBlockSurfaces(&scenes, &objects, output, options);
    EXPECT_EQ(files.size(), 2 * 5 + 1u);  // of each object om, ply, obj, mtl, glb; scene.usda
    const std::map<std::string, std::string> bytes = BytesBelow(output);
    EXPECT_EQ(bytes.size(), files.size());
    if (first.empty()) first = bytes;
    if (halo == 0.1f) {
      EXPECT_TRUE(bytes == first) << threads << " threads";
    }
    // Other sites around a block only number its tetrahedra otherwise.
    EXPECT_EQ(bytes.at("objects/7_mug.ply").size(), first.at("objects/7_mug.ply").size());
  }
}

}  // namespace
}  // namespace semfoam
