// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/io/volume_export.h"

#include "export/scene/object_selection.h"
#include "foam/image/srgb.h"
#include "foam/util/error.h"
#include "foam/util/parallel.h"

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <map>
#include <set>
#include <tuple>

#include "tests/export/test_foams.h"
#include "tests/process_state.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nanovdb/util/IO.h>
#include <nlohmann/json.hpp>
#include <openvdb/openvdb.h>
#include <openvdb/points/PointCount.h>
#include <openvdb/points/PointDataGrid.h>

namespace semfoam {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

struct VdbFile {
  std::vector<std::string> names;  // in the order of the file
  std::map<std::string, openvdb::GridBase::Ptr> grids;
  openvdb::MetaMap::Ptr metadata;

  template <typename Grid>
  typename Grid::Ptr Get(const std::string& name) const {
    const auto grid = openvdb::gridPtrCast<Grid>(grids.at(name));
    EXPECT_TRUE(grid) << name << " has another type";
    return grid;
  }
};

VdbFile ReadVdb(const std::filesystem::path& path) {
  openvdb::initialize();
  openvdb::io::File file(path.string());
  file.open(false);
  VdbFile result;
  for (auto name = file.beginName(); name != file.endName(); ++name) {
    result.names.push_back(name.gridName());
    result.grids[name.gridName()] = file.readGrid(name.gridName());
  }
  result.metadata = file.getMetadata();
  return result;
}

uint32_t NearestSite(const ExportableScene& scene, const Eigen::Vector3d& world) {
  const Eigen::Vector3d x = scene.world_from_normalized.Invert(world);
  uint32_t nearest = 0;
  double best = INFINITY;
  for (uint32_t cell = 0; cell < scene.delaunay.num_cells; ++cell) {
    const double d = (scene.cell_positions[cell].cast<double>() - x).squaredNorm();
    if (d < best) {
      best = d;
      nearest = cell;
    }
  }
  return nearest;
}

Eigen::Vector3d ToEigen(const openvdb::Vec3d& v) { return {v.x(), v.y(), v.z()}; }

class VolumeExport : public TemporaryFolderTest {};

Model TestModel() {
  Model model = TouchingBalls(1200);
  model.world_from_normalized = {2.5, {10, 20, 30}};
  return model;
}

uint32_t CellNearest(const Model& model, const Eigen::Vector3f& x) {
  const std::vector<Eigen::Vector3f>& sites = model.foam.positions;
  return static_cast<uint32_t>(
      std::min_element(sites.begin(),
                       sites.end(),
                       [&](const Eigen::Vector3f& a, const Eigen::Vector3f& b) {
                         return (a - x).norm() < (b - x).norm();
                       }) -
      sites.begin());
}

VolumeExportOptions Coarse() {
  VolumeExportOptions options;
  options.max_resolution = 24;
  options.creator = "semfoam test";
  return options;
}

// Every active voxel of the four grids against the cell of the nearest site.
void ExpectCells(const ExportableScene& scene, const VdbFile& file, const ObjectInfo* object) {
  const auto density = file.Get<openvdb::FloatGrid>("density");
  const auto color = file.Get<openvdb::Vec3SGrid>("color");
  const auto label = file.Get<openvdb::FloatGrid>("label");
  const auto confidence = file.Get<openvdb::FloatGrid>("confidence");
  ASSERT_GT(density->activeVoxelCount(), 50u);
  EXPECT_EQ(density->activeVoxelCount(), color->activeVoxelCount());
  EXPECT_EQ(density->activeVoxelCount(), label->activeVoxelCount());
  EXPECT_EQ(density->activeVoxelCount(), confidence->activeVoxelCount());
  const auto bounds = density->evalActiveVoxelBoundingBox();
  for (auto ijk = bounds.begin(); ijk != bounds.end(); ++ijk) {
    if (!density->tree().isValueOn(*ijk)) continue;
    const Eigen::Vector3d x = ToEigen(density->indexToWorld(*ijk));
    const uint32_t cell = NearestSite(scene, x);
    ASSERT_LT(cell, scene.NumSites());
    if (object != nullptr) {
      EXPECT_EQ(scene.object_of_cell[cell], object - scene.objects.data());
    } else {
      EXPECT_GT(scene.density[cell], 1);
    }
    EXPECT_EQ(label->tree().getValue(*ijk), static_cast<float>(Value(scene.label_id[cell])));
    EXPECT_EQ(confidence->tree().getValue(*ijk), scene.labels.confidence[cell]);
    EXPECT_FLOAT_EQ(density->tree().getValue(*ijk),
                    static_cast<float>(scene.density[cell] / scene.world_from_normalized.scale));
    for (int c = 0; c < 3; ++c) {
      const double display = scene.display_color[cell][c];
      const double linear =
          display <= 0.04045 ? display / 12.92 : std::pow((display + 0.055) / 1.055, 2.4);
      EXPECT_NEAR(color->tree().getValue(*ijk)[c], linear, 1e-6);
    }
  }
}

TEST_F(VolumeExport, SceneAndObjectsHoldTheirCells) {
  const ExportableScene scene = MakeExportableScene(TestModel());
  std::vector<std::string> seen;
  const std::vector<WrittenFile> files = ExportVolumes(
      scene, folder_, Coarse(), [&](const WrittenFile& file) { seen.push_back(file.path); });
  EXPECT_THAT(seen, ElementsAre("scene.vdb", "objects/7_mug.vdb", "objects/8_label_8.vdb"));
  ASSERT_EQ(files.size(), 3u);
  EXPECT_EQ(files[1].object_id, LabelId{7});

  const VdbFile whole = ReadVdb(folder_ / "scene.vdb");
  ExpectCells(scene, whole, nullptr);
  EXPECT_THAT(files[0].summary,
              std::to_string(whole.grids.at("label")->activeVoxelCount()) + " active voxels");
  const openvdb::math::Transform& of_scene = whole.grids.at("label")->transform();
  const double scene_voxel = of_scene.voxelSize().x();
  double volume_in_objects = 0;
  for (const ObjectInfo& object : scene.objects) {
    const VdbFile part = ReadVdb(folder_ / "objects" / (object.file_stem + ".vdb"));
    ExpectCells(scene, part, &object);
    EXPECT_FLOAT_EQ(part.Get<openvdb::FloatGrid>("surface")->background(),
                    static_cast<float>(3 * part.grids.at("label")->voxelSize().x()));
    EXPECT_EQ(part.metadata->metaValue<int32_t>("object_id"), Value(object.id));
    EXPECT_EQ(part.metadata->metaValue<std::string>("object_name"), object.name);
    const openvdb::math::Transform& of_object = part.grids.at("label")->transform();
    const double voxel = of_object.voxelSize().x();
    volume_in_objects +=
        static_cast<double>(part.grids.at("label")->activeVoxelCount()) * std::pow(voxel, 3);

    // Fine enough for the object, and nested: a whole number of its voxels fills one of the scene.
    const double length = object.bounding_box.sizes().maxCoeff();
    EXPECT_GT(length / voxel, 0.5 * Coarse().max_resolution);
    const double halvings = std::log2(scene_voxel / voxel);
    EXPECT_NEAR(halvings, std::round(halvings), 1e-9);
    EXPECT_GE(halvings, 0);
    // The corner of a voxel of the scene is a corner of the object's voxels.
    const openvdb::Vec3d corner =
        of_object.worldToIndex(of_scene.indexToWorld(openvdb::Vec3d(-0.5)));
    for (int c = 0; c < 3; ++c) {
      const double from_corner = corner[c] + 0.5;
      EXPECT_NEAR(from_corner, std::round(from_corner), 1e-6);
    }
  }
  const double scene_volume =
      static_cast<double>(whole.grids.at("label")->activeVoxelCount()) * std::pow(scene_voxel, 3);
  EXPECT_GE(volume_in_objects, 0.98 * scene_volume);
}

TEST_F(VolumeExport, GridsHaveTheirTypesClassesAndMetadata) {
  const ExportableScene scene = MakeExportableScene(TestModel());
  VolumeExportOptions options = Coarse();
  options.source_checksum = "0123456789abcdef";
  const VolumeFrame frame = MakeVolumeFrame(scene, options);
  WriteSceneVolume(folder_ / "scene.vdb", scene, frame, options);
  const VdbFile file = ReadVdb(folder_ / "scene.vdb");
  EXPECT_THAT(file.names,
              ::testing::UnorderedElementsAre("density", "color", "label", "confidence"));
  EXPECT_EQ(file.grids.at("density")->getGridClass(), openvdb::GRID_FOG_VOLUME);
  EXPECT_EQ(file.grids.at("label")->getGridClass(), openvdb::GRID_UNKNOWN);
  EXPECT_EQ(file.grids.at("color")->valueType(), "vec3s");
  for (const char* name : {"density", "label", "confidence"}) {
    EXPECT_EQ(file.grids.at(name)->valueType(), "float");
  }
  std::vector<const openvdb::MetaMap*> all = {file.metadata.get()};
  for (const auto& [name, grid] : file.grids) {
    all.push_back(grid.get());
    EXPECT_EQ(grid->transform(), file.grids.at("density")->transform());
    EXPECT_TRUE(grid->hasUniformVoxels());
    EXPECT_FALSE(grid->saveFloatAsHalf());
  }
  for (const openvdb::MetaMap* metadata : all) {
    const auto table = nlohmann::json::parse(metadata->metaValue<std::string>("labels"));
    EXPECT_EQ(table["labels"]["7"], "mug");
    EXPECT_EQ(metadata->metaValue<std::string>("creator"), "semfoam test");
    EXPECT_EQ(metadata->metaValue<std::string>("frame"), "COLMAP");
    EXPECT_EQ(metadata->metaValue<std::string>("transform"), ExportTransformJson({}));
    EXPECT_EQ(metadata->metaValue<std::string>("source_model_xxh64"), "0123456789abcdef");
    EXPECT_EQ(metadata->metaValue<double>("world_from_normalized_scale"), 2.5);
    EXPECT_EQ(metadata->metaValue<openvdb::Vec3d>("world_from_normalized_translation"),
              openvdb::Vec3d(10, 20, 30));
    EXPECT_DOUBLE_EQ(metadata->metaValue<double>("voxel_size"),
                     file.grids.at("density")->voxelSize().x());
  }
}

TEST_F(VolumeExport, TheVoxelSizeIsTheUsersOrFollowsTheResolution) {
  const ExportableScene scene = MakeExportableScene(TestModel());
  VolumeExportOptions options = Coarse();
  const VolumeFrame by_resolution = MakeVolumeFrame(scene, options);
  EXPECT_NEAR(by_resolution.box.sizes().maxCoeff() / by_resolution.lattice.voxel_size, 24, 1e-9);
  options.voxel_size = 0.2;
  EXPECT_NEAR(MakeVolumeFrame(scene, options).lattice.voxel_size * 2.5, 0.2, 1e-12);
  WriteSceneVolume(folder_ / "scene.vdb", scene, MakeVolumeFrame(scene, options), options);
  EXPECT_NEAR(ReadVdb(folder_ / "scene.vdb").grids.at("label")->voxelSize().x(), 0.2, 1e-12);
}

TEST_F(VolumeExport, AFewFarCellsDoNotDecideTheBox) {
  Model model = TouchingBalls(6000);
  const VolumeFrame before = MakeVolumeFrame(MakeExportableScene(model), Coarse());
  Foam& foam = model.foam;
  foam.positions.emplace_back(25.f, 3.f, -20.f);
  foam.raw_density.push_back(static_cast<float>(RawDensity(1e4)));
  foam.sh.insert(foam.sh.end(), 3, 0.f);
  foam.identity.insert(foam.identity.end(), foam.identity.begin(), foam.identity.begin() + 16);
  const VolumeFrame after = MakeVolumeFrame(MakeExportableScene(model), Coarse());
  EXPECT_LT(after.lattice.voxel_size, 1.3 * before.lattice.voxel_size);
}

TEST_F(VolumeExport, AnObjectsFarCellsDoNotFillTheWorld) {
  // One class: a ball in the middle and a wide cloud of cells far outside of everything else, of
  // which there are as many.
  Model model = MakeModel(RandomSites(3000, 1), 2, [](const Eigen::Vector3f& p) {
    return p.norm() < 0.25f ? 0 : p.norm() < 0.9f ? 1 : kAir;
  });
  for (int k = 0; k < 20; ++k) {
    const float angle = static_cast<float>(k);
    model.foam.positions.emplace_back(20 * std::cos(angle), 20 * std::sin(angle), angle - 10);
    model.foam.raw_density.push_back(static_cast<float>(RawDensity(1e4)));
    model.foam.sh.insert(model.foam.sh.end(), 3, 0.f);
    for (int d = 0; d < kIdentityDim; ++d) model.foam.identity.push_back(d == 0 ? 3.f : 0.f);
  }
  const ExportableScene scene = MakeExportableScene(model);
  const VolumeExportOptions options = Coarse();
  const VolumeFrame frame = MakeVolumeFrame(scene, options);
  WriteObjectVolume(folder_ / "mug.vdb", scene, scene.objects[0], frame, options);
  const auto bounds = ReadVdb(folder_ / "mug.vdb").grids.at("label")->evalActiveVoxelBoundingBox();
  EXPECT_LE(bounds.dim().x(), 30);
  EXPECT_LE(bounds.dim().y(), 30);
  EXPECT_LE(bounds.dim().z(), 30);
}

TEST_F(VolumeExport, GeoreferencedScenesAreTheSameToTheMillimetre) {
  Model model = TestModel();
  model.world_from_normalized = {50, {0, 0, 0}};
  const VolumeExportOptions options = Coarse();
  const ExportableScene near = MakeExportableScene(model);
  WriteSceneVolume(folder_ / "near.vdb", near, MakeVolumeFrame(near, options), options);
  const Eigen::Vector3d offset(5e5, 4.5e6, 250);
  model.world_from_normalized.translation = offset;
  const ExportableScene far = MakeExportableScene(model);
  WriteSceneVolume(folder_ / "far.vdb", far, MakeVolumeFrame(far, options), options);

  const auto a = ReadVdb(folder_ / "near.vdb").Get<openvdb::FloatGrid>("label");
  const auto b = ReadVdb(folder_ / "far.vdb").Get<openvdb::FloatGrid>("label");
  EXPECT_EQ(a->activeVoxelCount(), b->activeVoxelCount());
  EXPECT_EQ(a->evalActiveVoxelBoundingBox(), b->evalActiveVoxelBoundingBox());
  for (auto it = a->cbeginValueOn(); it; ++it) {
    EXPECT_EQ(b->tree().getValue(it.getCoord()), *it);
    const Eigen::Vector3d shift =
        ToEigen(b->indexToWorld(it.getCoord()) - a->indexToWorld(it.getCoord())) - offset;
    EXPECT_LT(shift.norm(), 1e-6);
  }
}

TEST_F(VolumeExport, ATransformTurnsTheVoxelsAndKeepsTheOpticalDepth) {
  const VolumeExportOptions options = Coarse();
  const ExportableScene plain = MakeExportableScene(TestModel());
  WriteSceneVolume(folder_ / "plain.vdb", plain, MakeVolumeFrame(plain, options), options);
  ExportTransformOptions frame;
  frame.transform = "1.2 -1.6 0 7  1.6 1.2 0 8  0 0 2 9";  // about z by 53 degrees, twice as large
  ExportableSceneOptions scene_options;
  scene_options.transform = ParseExportTransform(frame);
  const ExportableScene moved = MakeExportableScene(TestModel(), scene_options);
  WriteSceneVolume(folder_ / "moved.vdb", moved, MakeVolumeFrame(moved, options), options);

  const VdbFile from = ReadVdb(folder_ / "plain.vdb");
  const VdbFile to = ReadVdb(folder_ / "moved.vdb");
  const auto a = from.Get<openvdb::FloatGrid>("density");
  const auto b = to.Get<openvdb::FloatGrid>("density");
  EXPECT_EQ(a->activeVoxelCount(), b->activeVoxelCount());
  EXPECT_TRUE(b->hasUniformVoxels());
  EXPECT_NEAR(b->voxelSize().x(), 2 * a->voxelSize().x(), 1e-12);
  for (auto it = a->cbeginValueOn(); it; ++it) {
    const Eigen::Vector3d x = ToEigen(a->indexToWorld(it.getCoord()));
    const Eigen::Vector3d expected(
        1.2 * x.x() - 1.6 * x.y() + 7, 1.6 * x.x() + 1.2 * x.y() + 8, 2 * x.z() + 9);
    ASSERT_LT((ToEigen(b->indexToWorld(it.getCoord())) - expected).norm(), 1e-11);
    ASSERT_FLOAT_EQ(b->tree().getValue(it.getCoord()), *it / 2);
  }
  EXPECT_EQ(to.metadata->metaValue<std::string>("frame"), "transformed");
  EXPECT_EQ(to.metadata->metaValue<std::string>("transform"),
            ExportTransformJson(scene_options.transform));
  EXPECT_NEAR(to.metadata->metaValue<double>("voxel_size"), b->voxelSize().x(), 1e-12);
  EXPECT_EQ(to.metadata->metaValue<double>("world_from_normalized_scale"), 2.5);

  VolumeExportOptions sized = options;
  sized.voxel_size = 0.7;  // of the files' units
  WriteSceneVolume(folder_ / "sized.vdb", moved, MakeVolumeFrame(moved, sized), sized);
  EXPECT_NEAR(
      ReadVdb(folder_ / "sized.vdb").Get<openvdb::FloatGrid>("label")->voxelSize().x(), 0.7, 1e-12);
}

TEST_F(VolumeExport, Int32LabelsStandInAFileOfTheirOwn) {
  const ExportableScene scene = MakeExportableScene(TestModel());
  VolumeExportOptions options = Coarse();
  options.label_grid_type = LabelGridType::kBoth;
  const auto files = ExportVolumes(scene, folder_, options);
  EXPECT_EQ(files[1].path, "scene_labels_int32.vdb");
  const VdbFile integers = ReadVdb(folder_ / "scene_labels_int32.vdb");
  ASSERT_EQ(integers.names, std::vector<std::string>{"label"});
  EXPECT_EQ(integers.metadata->metaValue<std::string>("frame"), "COLMAP");
  const auto label = integers.Get<openvdb::Int32Grid>("label");
  const auto as_float = ReadVdb(folder_ / "scene.vdb").Get<openvdb::FloatGrid>("label");
  EXPECT_EQ(label->activeVoxelCount(), as_float->activeVoxelCount());
  EXPECT_EQ(label->transform(), as_float->transform());
  for (auto it = label->cbeginValueOn(); it; ++it) {
    EXPECT_EQ(static_cast<float>(*it), as_float->tree().getValue(it.getCoord()));
  }

  options.label_grid_type = LabelGridType::kInt32;
  ExportVolumes(scene, folder_, options);
  EXPECT_EQ(ReadVdb(folder_ / "scene.vdb").grids.count("label"), 0u);
  EXPECT_EQ(ReadVdb(folder_ / "objects/7_mug.vdb").grids.count("label"), 0u);
  const auto alone = ReadVdb(folder_ / "scene_labels_int32.vdb").Get<openvdb::Int32Grid>("label");
  EXPECT_EQ(alone->activeVoxelCount(), label->activeVoxelCount());
}

TEST_F(VolumeExport, LabelsTakeTheseObjectsAlone) {
  Model model = TouchingBalls(6000);
  // A hidden pocket in the second ball, whose own class is the first one's.
  const uint32_t pocket = CellNearest(model, {0.3f, 0, 0});
  model.foam.raw_density[pocket] = -10;
  for (int d = 0; d < kIdentityDim; ++d) {
    model.foam.identity[pocket * kIdentityDim + d] = d == 0 ? 3.f : 0.f;
  }
  const ExportableScene scene = MakeExportableScene(model);
  ASSERT_EQ(scene.object_of_cell[pocket], 1);
  ASSERT_EQ(scene.label_id[pocket], LabelId{7});
  VolumeExportOptions options = Coarse();
  ExportVolumes(scene, folder_ / "all", options);
  for (const char* spelling : {"label_8", "8", " 8 ,8"}) {
    options.objects = FilterObjects(scene, {spelling});
    const auto files = ExportVolumes(scene, folder_ / spelling, options);
    ASSERT_EQ(files.size(), 2u);
    EXPECT_EQ(files[1].path, "objects/8_label_8.vdb");
    const auto all = ReadVdb(folder_ / "all/scene.vdb").Get<openvdb::FloatGrid>("label");
    const auto one = ReadVdb(folder_ / spelling / "scene.vdb").Get<openvdb::FloatGrid>("label");
    EXPECT_EQ(one->transform(), all->transform());
    // The object's voxels, all of them and no others; hidden cells inside of it are its own.
    uint64_t of_object = 0;
    for (auto it = one->cbeginValueOn(); it; ++it) EXPECT_EQ(*it, 8);
    for (auto it = all->cbeginValueOn(); it; ++it) {
      if (*it != 8) continue;
      EXPECT_TRUE(one->tree().isValueOn(it.getCoord()));
      ++of_object;
    }
    EXPECT_GT(of_object, 50u);
    EXPECT_GT(one->activeVoxelCount(), of_object);
    EXPECT_LT(one->activeVoxelCount(), 1.2 * static_cast<double>(of_object));
  }

  // All but one: what is no object stays, what is that one's goes.
  options.objects = FilterObjects(scene, {"", "mug"});
  const auto files = ExportVolumes(scene, folder_ / "without", options);
  ASSERT_EQ(files.size(), 2u);
  EXPECT_EQ(files[1].path, "objects/8_label_8.vdb");
  const auto all = ReadVdb(folder_ / "all/scene.vdb").Get<openvdb::FloatGrid>("label");
  const auto rest = ReadVdb(folder_ / "without/scene.vdb").Get<openvdb::FloatGrid>("label");
  for (auto it = all->cbeginValueOn(); it; ++it) {
    EXPECT_EQ(rest->tree().isValueOn(it.getCoord()), *it != 7);
  }
}

// An object's points are the same, whether it is asked for or looked up among all.
TEST_F(VolumeExport, PointsSayWhichObjectTheyAreOf) {
  const ExportableScene scene = MakeExportableScene(TestModel());
  const auto places_of = [&](const std::string& folder, bool all) {
    const auto grid = ReadVdb(folder_ / folder / "scene_points.vdb")
                          .Get<openvdb::points::PointDataGrid>("points");
    std::set<std::tuple<double, double, double>> places;
    for (auto leaf = grid->tree().cbeginLeaf(); leaf; ++leaf) {
      const openvdb::points::AttributeHandle<openvdb::Vec3f> position(
          leaf->constAttributeArray("P"));
      const openvdb::points::AttributeHandle<int32_t> object(leaf->constAttributeArray("object"));
      for (auto it = leaf->beginIndexOn(); it; ++it) {
        if (!all && object.get(*it) != 7) continue;
        EXPECT_TRUE(!all || object.get(*it) == 7);
        const openvdb::Vec3d x = grid->indexToWorld(position.get(*it) + it.getCoord().asVec3d());
        places.emplace(x.x(), x.y(), x.z());
      }
    }
    return places;
  };
  VolumeExportOptions options = Coarse();
  options.points = true;
  ExportVolumes(scene, folder_ / "all", options);
  options.objects = FilterObjects(scene, {"mug"});
  ExportVolumes(scene, folder_ / "mug", options);
  EXPECT_GT(places_of("mug", true).size(), 10u);
  EXPECT_EQ(places_of("mug", true), places_of("all", false));
}

TEST_F(VolumeExport, ACropCutsAndMovesNothing) {
  const ExportableScene scene = MakeExportableScene(TestModel());
  VolumeExportOptions options = Coarse();
  options.voxel_size = 0.1;
  options.points = true;
  ExportVolumes(scene, folder_ / "all", options);
  // World frame: the balls lie around (10, 20, 30) -+ (0.75, 0, 0), with a radius of 0.75.
  options.crop = "9.5,19,29.5,10.25,20.5,31";
  const openvdb::BBoxd crop({9.5, 19, 29.5}, {10.25, 20.5, 31});
  ExportVolumes(scene, folder_ / "crop", options);
  for (const char* name : {"scene.vdb", "objects/7_mug.vdb", "objects/8_label_8.vdb"}) {
    const VdbFile all = ReadVdb(folder_ / "all" / name);
    const VdbFile cut = ReadVdb(folder_ / "crop" / name);
    const auto whole = all.Get<openvdb::FloatGrid>("density");
    const auto part = cut.Get<openvdb::FloatGrid>("density");
    EXPECT_EQ(whole->transform(), part->transform()) << name;
    uint64_t inside = 0;
    for (auto it = whole->cbeginValueOn(); it; ++it) {
      if (!crop.isInside(whole->indexToWorld(it.getCoord()))) continue;
      EXPECT_EQ(part->tree().getValue(it.getCoord()), *it);
      ++inside;
    }
    EXPECT_GT(inside, 10u);
    EXPECT_EQ(part->activeVoxelCount(), inside) << name;
    if (cut.grids.count("surface") == 0) continue;
    // The surface is closed along the cut: inside exactly where the other grids are.
    const auto surface = cut.Get<openvdb::FloatGrid>("surface");
    uint64_t negative = 0;
    const auto bounds = surface->evalActiveVoxelBoundingBox();
    for (auto ijk = bounds.begin(); ijk != bounds.end(); ++ijk) {
      const bool in_cells = part->tree().isValueOn(*ijk);
      negative += surface->tree().getValue(*ijk) < 0;
      EXPECT_EQ(surface->tree().getValue(*ijk) <= 0, in_cells) << name << *ijk;
    }
    EXPECT_GT(negative, 10u);
  }
  const auto points =
      ReadVdb(folder_ / "crop/scene_points.vdb").Get<openvdb::points::PointDataGrid>("points");
  uint64_t solid = 0;
  for (uint32_t i = 0; i < scene.NumSites(); ++i) {
    const Eigen::Vector3d x =
        scene.world_from_normalized.Apply(scene.cell_positions[i].cast<double>());
    solid += scene.labels.solid[i] && crop.isInside(openvdb::Vec3d(x.x(), x.y(), x.z()));
  }
  EXPECT_GT(solid, 5u);
  EXPECT_EQ(openvdb::points::pointCount(points->tree()), solid);

  // The resolution follows the crop.
  options.voxel_size = 0;
  EXPECT_NEAR(MakeVolumeFrame(scene, options).lattice.voxel_size * 2.5, 1.5 / 24, 0.02);
  options.crop = "100,100,100,101,101,101";
  for (const WrittenFile& file : ExportVolumes(scene, folder_ / "nothing", options)) {
    const VdbFile empty = ReadVdb(folder_ / "nothing" / file.path);
    for (const auto& [name, grid] : empty.grids) EXPECT_EQ(grid->activeVoxelCount(), 0u) << name;
    if (file.path == "scene_points.vdb") continue;
    EXPECT_THAT(file.warning, HasSubstr("crop"));
  }
}

// What a voxel should hold, by a search for each of its samples through all sites.
TEST_F(VolumeExport, MoreSamplesAreCoverageAndNeverMixLabels) {
  Model model = TestModel();
  // Densities that differ, so that a mean is no constant.
  for (size_t i = 0; i < model.foam.NumSites(); ++i) {
    if (model.foam.raw_density[i] > 0) {
      model.foam.raw_density[i] =
          static_cast<float>(RawDensity(5e3 * (1.5 + std::sin(static_cast<double>(i)))));
    }
  }
  const ExportableScene scene = MakeExportableScene(model);
  VolumeExportOptions options = Coarse();
  options.max_resolution = 14;
  constexpr int kSamples = 3;
  options.supersample = kSamples;
  // Through the balls: the voxels at the cut are whole.
  options.crop = "9,19,29,10.6,20.31,31";
  const Eigen::AlignedBox3d crop(Eigen::Vector3d(9, 19, 29), Eigen::Vector3d(10.6, 20.31, 31));
  const VolumeFrame frame = MakeVolumeFrame(scene, options);
  WriteSceneVolume(folder_ / "scene.vdb", scene, frame, options);
  WriteObjectVolume(folder_ / "mug.vdb", scene, scene.objects[0], frame, options);
  int mixed = 0, partial = 0;
  for (const bool is_object : {false, true}) {
    const VdbFile file = ReadVdb(folder_ / (is_object ? "mug.vdb" : "scene.vdb"));
    const auto density = file.Get<openvdb::FloatGrid>("density");
    const auto color = file.Get<openvdb::Vec3SGrid>("color");
    const auto label = file.Get<openvdb::FloatGrid>("label");
    const auto confidence = file.Get<openvdb::FloatGrid>("confidence");
    const Eigen::AlignedBox3d box(scene.world_from_normalized.Apply(frame.box.min()),
                                  scene.world_from_normalized.Apply(frame.box.max()));
    auto bounds = density->evalActiveVoxelBoundingBox();
    ASSERT_FALSE(bounds.empty());
    bounds.expand(1);
    int compared = 0;
    for (auto ijk = bounds.begin(); ijk != bounds.end(); ++ijk) {
      if (is_object && compared > 400) break;  // the search takes its time
      double mean_density = 0;
      std::map<LabelId, std::vector<uint32_t>> by_label;
      for (int k = 0; k < kSamples * kSamples * kSamples; ++k) {
        const openvdb::Vec3d offset(k / 9 - 1, k / 3 % 3 - 1, k % 3 - 1);
        const Eigen::Vector3d x =
            ToEigen(density->indexToWorld((*ijk).asVec3d() + offset / kSamples));
        const uint32_t cell = NearestSite(scene, x);
        if (cell >= scene.NumSites()) continue;
        if (is_object ? scene.object_of_cell[cell] != 0 : scene.density[cell] < 1) continue;
        mean_density += scene.density[cell] / 2.5 / 27;
        by_label[is_object ? LabelId{7} : scene.label_id[cell]].push_back(cell);
      }
      const Eigen::Vector3d center = ToEigen(density->indexToWorld(*ijk));
      const bool in_box = is_object ? crop.contains(center) : box.contains(center);
      ASSERT_EQ(density->tree().isValueOn(*ijk), in_box && !by_label.empty()) << *ijk;
      if (!in_box) continue;
      if (by_label.empty()) continue;
      ++compared;
      const std::vector<uint32_t>* most = nullptr;
      size_t covered = 0;
      for (const auto& [id, cells] : by_label) {
        if (most == nullptr || cells.size() > most->size()) most = &cells;
        covered += cells.size();
      }
      mixed += by_label.size() > 1;
      partial += covered < 27;
      double mean_confidence = 0;
      Eigen::Vector3d mean_color = Eigen::Vector3d::Zero();
      for (const uint32_t cell : *most) {
        mean_confidence += scene.labels.confidence[cell] / static_cast<double>(most->size());
        for (int c = 0; c < 3; ++c) {
          mean_color[c] += LinearFromDisplay(static_cast<double>(scene.display_color[cell][c])) /
                           static_cast<double>(most->size());
        }
      }
      EXPECT_EQ(label->tree().getValue(*ijk),
                is_object ? 7 : static_cast<float>(Value(scene.label_id[most->front()])));
      EXPECT_NEAR(density->tree().getValue(*ijk), mean_density, 1e-5 * mean_density);
      EXPECT_NEAR(confidence->tree().getValue(*ijk), mean_confidence, 1e-5);
      for (int c = 0; c < 3; ++c) {
        EXPECT_NEAR(color->tree().getValue(*ijk)[c], mean_color[c], 1e-5);
      }
    }
    EXPECT_GT(compared, 100);
  }
  EXPECT_GT(mixed, 5);
  EXPECT_GT(partial, 50);
}

TEST_F(VolumeExport, GridsAreCalledAsTheUserLikes) {
  const ExportableScene scene = MakeExportableScene(TestModel());
  VolumeExportOptions options = Coarse();
  options.grid_names = {"smoke", "Cd", "id", "sureness", "sdf"};
  ExportVolumes(scene, folder_, options);
  const VdbFile file = ReadVdb(folder_ / "objects/7_mug.vdb");
  EXPECT_THAT(file.names, ::testing::UnorderedElementsAre("smoke", "Cd", "id", "sureness", "sdf"));
  EXPECT_EQ(file.grids.at("Cd")->valueType(), "vec3s");
  EXPECT_EQ(file.grids.at("smoke")->getGridClass(), openvdb::GRID_FOG_VOLUME);
  EXPECT_EQ(file.grids.at("sdf")->getGridClass(), openvdb::GRID_LEVEL_SET);
  EXPECT_EQ(file.Get<openvdb::FloatGrid>("id")->cbeginValueOn().getValue(), 7);
  EXPECT_LE(file.Get<openvdb::FloatGrid>("sureness")->cbeginValueOn().getValue(), 1);
}

// Every active voxel of the grids against the same in NanoVDB.
TEST_F(VolumeExport, NanoVdbFilesHoldTheSameVoxels) {
  Model model = TestModel();
  model.world_from_normalized.translation = {5e5, 4.5e6, 250};
  const ExportableScene scene = MakeExportableScene(model);
  VolumeExportOptions options = Coarse();
  options.label_grid_type = LabelGridType::kBoth;
  options.nvdb = true;
  const auto files = ExportVolumes(scene, folder_, options);
  ASSERT_EQ(files.size(), 8u);
  for (const WrittenFile& written : files) {
    if (written.format != "nvdb") continue;
    const VdbFile vdb = ReadVdb((folder_ / written.path).replace_extension(".vdb"));
    const auto handles = nanovdb::io::readGrids((folder_ / written.path).string());
    ASSERT_EQ(handles.size(), vdb.grids.size()) << written.path;
    for (const auto& handle : handles) {
      const std::string name = handle.gridMetaData()->shortGridName();
      const openvdb::GridBase::Ptr base = vdb.grids.at(name);
      EXPECT_EQ(handle.gridMetaData()->activeVoxelCount(), base->activeVoxelCount()) << name;
      EXPECT_EQ(handle.gridMetaData()->isLevelSet(), name == "surface");
      EXPECT_EQ(handle.gridMetaData()->isFogVolume(), name == "density");
      const auto same = [&](const auto& grid, const auto* nano, const auto& equal) {
        ASSERT_NE(nano, nullptr) << name;
        auto values = nano->getAccessor();
        for (auto it = grid->cbeginValueOn(); it; ++it) {
          const openvdb::Coord ijk = it.getCoord();
          const nanovdb::Coord at(ijk.x(), ijk.y(), ijk.z());
          ASSERT_TRUE(values.isActive(at));
          ASSERT_TRUE(equal(values.getValue(at), it.getValue())) << name;
          const auto world = nano->indexToWorld(nanovdb::Vec3d(ijk.x(), ijk.y(), ijk.z()));
          ASSERT_LT(
              (openvdb::Vec3d(world[0], world[1], world[2]) - grid->indexToWorld(ijk)).length(),
              1e-6);
        }
      };
      const auto plain = [](const auto& a, const auto& b) { return a == b; };
      if (base->valueType() == "float") {
        same(openvdb::gridPtrCast<openvdb::FloatGrid>(base), handle.grid<float>(), plain);
      } else if (base->valueType() == "int32") {
        same(openvdb::gridPtrCast<openvdb::Int32Grid>(base), handle.grid<int32_t>(), plain);
      } else {
        same(openvdb::gridPtrCast<openvdb::Vec3SGrid>(base),
             handle.grid<nanovdb::Vec3f>(),
             [](const auto& a, const auto& b) {
               return a[0] == b[0] && a[1] == b[1] && a[2] == b[2];
             });
      }
    }
  }
}

TEST_F(VolumeExport, PointsAreTheSolidCells) {
  Model model = TestModel();
  model.world_from_normalized.translation = {5e5, 4.5e6, 250};
  const ExportableScene scene = MakeExportableScene(model);
  VolumeExportOptions options = Coarse();
  options.points = true;
  const auto files = ExportVolumes(scene, folder_, options);
  EXPECT_EQ(files[1].path, "scene_points.vdb");
  const VdbFile file = ReadVdb(folder_ / "scene_points.vdb");
  EXPECT_EQ(file.metadata->metaValue<std::string>("frame"), "COLMAP");
  const auto grid = file.Get<openvdb::points::PointDataGrid>("points");
  std::map<uint32_t, int> seen;
  for (auto leaf = grid->tree().cbeginLeaf(); leaf; ++leaf) {
    const openvdb::points::AttributeHandle<openvdb::Vec3f> position(leaf->constAttributeArray("P"));
    const auto number = [&](const char* name, openvdb::Index index) {
      return openvdb::points::AttributeHandle<float>(leaf->constAttributeArray(name)).get(index);
    };
    for (auto it = leaf->beginIndexOn(); it; ++it) {
      const openvdb::Vec3d index = position.get(*it) + it.getCoord().asVec3d();
      const Eigen::Vector3d x = ToEigen(grid->indexToWorld(index));
      const uint32_t cell = NearestSite(scene, x);
      ASSERT_LT(cell, scene.NumSites());
      ++seen[cell];
      const Eigen::Vector3d site =
          scene.world_from_normalized.Apply(scene.cell_positions[cell].cast<double>());
      EXPECT_LT((x - site).norm(), 1e-6);
      EXPECT_FLOAT_EQ(number("density", *it), scene.density[cell] / 2.5f);
      EXPECT_FLOAT_EQ(number("confidence", *it), scene.labels.confidence[cell]);
      EXPECT_FLOAT_EQ(number("radius", *it), scene.radius[cell] * 2.5f);
      EXPECT_EQ(
          openvdb::points::AttributeHandle<int32_t>(leaf->constAttributeArray("label")).get(*it),
          Value(scene.label_id[cell]));
      const openvdb::Vec3f color =
          openvdb::points::AttributeHandle<openvdb::Vec3f>(leaf->constAttributeArray("color"))
              .get(*it);
      for (int c = 0; c < 3; ++c) {
        EXPECT_FLOAT_EQ(color[c], LinearFromDisplay(scene.display_color[cell][c]));
      }
    }
  }
  size_t solid = 0;
  for (uint32_t i = 0; i < scene.NumSites(); ++i) {
    solid += scene.labels.solid[i];
    EXPECT_EQ(seen.count(i), scene.labels.solid[i] ? 1u : 0u);
  }
  EXPECT_EQ(seen.size(), solid);
  EXPECT_EQ(files[1].summary, std::to_string(solid) + " points");
}

TEST_F(VolumeExport, TheSameBytesOnAnyNumberOfThreads) {
  const ExportableScene scene = MakeExportableScene(TestModel());
  VolumeExportOptions options = Coarse();
  options.max_resolution = 60;
  options.label_grid_type = LabelGridType::kBoth;
  options.nvdb = options.points = true;
  std::vector<WrittenFile> files;
  for (const int threads : {1, 5}) {
    const ThreadLimit limit(threads);
    files = ExportVolumes(scene, folder_ / std::to_string(threads), options);
  }
  ASSERT_EQ(files.size(), 9u);
  for (const WrittenFile& file : files) {
    std::string bytes[2];
    for (const int k : {0, 1}) {
      std::ifstream in(folder_ / (k == 0 ? "1" : "5") / file.path, std::ios::binary);
      bytes[k].assign(std::istreambuf_iterator<char>(in), {});
    }
    EXPECT_GT(bytes[0].size(), 100u);
    EXPECT_TRUE(bytes[0] == bytes[1]) << file.path;
  }
}

TEST_F(VolumeExport, ProgressGoesFromNothingToAll) {
  const ExportableScene scene = MakeExportableScene(TestModel());
  std::vector<VolumeProgress> reports;
  const auto files = ExportVolumes(
      scene, folder_, Coarse(), nullptr, [&](const VolumeProgress& p) { reports.push_back(p); });
  ASSERT_GE(reports.size(), files.size());
  EXPECT_EQ(reports.front().path, "scene.vdb");
  EXPECT_EQ(reports.front().file, 1);
  EXPECT_EQ(reports.back().path, "objects/8_label_8.vdb");
  EXPECT_EQ(reports.back().file, 3);
  EXPECT_EQ(reports.back().num_files, 3);
  EXPECT_EQ(reports.back().share, 1);
  for (size_t k = 1; k < reports.size(); ++k) {
    EXPECT_LT(reports[k - 1].file + reports[k - 1].share, reports[k].file + reports[k].share);
  }
}

TEST_F(VolumeExport, HalfFloatsNeverTouchTheLabels) {
  Model model = TestModel();
  model.labels[0].id = LabelId{65535};  // no half float holds it
  const ExportableScene scene = MakeExportableScene(model);
  VolumeExportOptions options = Coarse();
  options.half_float = true;
  WriteSceneVolume(folder_ / "scene.vdb", scene, MakeVolumeFrame(scene, options), options);
  const VdbFile file = ReadVdb(folder_ / "scene.vdb");
  EXPECT_TRUE(file.grids.at("density")->saveFloatAsHalf());
  EXPECT_FALSE(file.grids.at("label")->saveFloatAsHalf());
  bool found = false;
  for (auto it = file.Get<openvdb::FloatGrid>("label")->cbeginValueOn(); it; ++it) {
    found |= *it == 65535;
  }
  EXPECT_TRUE(found);
}

TEST_F(VolumeExport, AVoxelLargerThanTheObjectGivesAWarningAndAValidFile) {
  const ExportableScene scene = MakeExportableScene(TestModel());
  VolumeExportOptions options = Coarse();
  options.voxel_size = 1000;
  const auto files = ExportVolumes(scene, folder_, options);
  ASSERT_EQ(files.size(), 3u);
  for (const WrittenFile& file : files) {
    const VdbFile vdb = ReadVdb(folder_ / file.path);
    EXPECT_EQ(vdb.grids.size(), file.object_id == kNoObject ? 4u : 5u) << file.path;
    EXPECT_EQ(vdb.grids.at("density")->activeVoxelCount(), 0u);
    EXPECT_THAT(file.warning, HasSubstr("no voxel"));
  }
  EXPECT_THAT(files[1].warning, HasSubstr("voxels of 1000"));
  // The size that the warning names is one that serves.
  options.voxel_size = std::atof(std::strstr(files[1].warning.c_str(), "voxel_size of ") + 14);
  EXPECT_EQ(ExportVolumes(scene, folder_, options)[1].warning, "");
}

TEST_F(VolumeExport, AnObjectOfOneVoxelGivesAWarningAndAValidFile) {
  const ExportableScene scene = MakeExportableScene(TestModel());
  VolumeExportOptions options = Coarse();
  int with_one = 0;
  for (const double size : {1.2, 1.4, 1.6, 1.7, 1.8, 1.9, 2.0}) {
    options.voxel_size = size;
    for (const WrittenFile& file : ExportVolumes(scene, folder_, options)) {
      if (file.object_id == kNoObject) continue;
      const VdbFile vdb = ReadVdb(folder_ / file.path);
      const auto voxels = vdb.grids.at("density")->activeVoxelCount();
      const double length =
          scene.objects[Value(file.object_id) - 7].bounding_box.sizes().maxCoeff();
      if (voxels == 1) {
        ++with_one;
        EXPECT_THAT(file.warning, HasSubstr("one voxel"));
        const auto label = vdb.Get<openvdb::FloatGrid>("label");
        EXPECT_EQ(label->cbeginValueOn().getValue(), static_cast<float>(Value(file.object_id)));
      } else if (voxels > 1 && size <= length) {
        EXPECT_EQ(file.warning, "");
      }
      // A level set is one even where no centre lies inside.
      EXPECT_EQ(vdb.grids.at("surface")->getGridClass(), openvdb::GRID_LEVEL_SET);
      EXPECT_GT(vdb.grids.at("surface")->activeVoxelCount(), 20u);
    }
  }
  EXPECT_GT(with_one, 0);
}

TEST_F(VolumeExport, AnObjectOfOneCellIsSeen) {
  Model model = TestModel();
  model.labels.push_back({LabelId{9}, MaskId{9}, "bead"});
  Foam& foam = model.foam;
  foam.num_classes = 3;
  foam.classifier_bias.push_back(0);
  foam.classifier_weight.resize(3 * kIdentityDim, 0.f);
  foam.classifier_weight[2 * kIdentityDim + 2] = 1;
  const uint32_t bead = CellNearest(model, {-0.3f, 0, 0});
  for (int d = 0; d < kIdentityDim; ++d) {
    foam.identity[bead * kIdentityDim + d] = d == 2 ? 5.f : 0.f;
  }
  const ExportableScene scene = MakeExportableScene(model);
  ASSERT_EQ(scene.objects.size(), 3u);
  ASSERT_EQ(scene.objects[2].cells, std::vector<uint32_t>{bead});
  const auto files = ExportVolumes(scene, folder_, Coarse());
  EXPECT_EQ(files[3].warning, "");
  EXPECT_GT(ReadVdb(folder_ / files[3].path).grids.at("density")->activeVoxelCount(), 100u);
}

TEST_F(VolumeExport, ASceneOfAirOrOfNothingGivesAValidFile) {
  for (const int sites : {0, 1, 300}) {
    const ExportableScene scene =
        MakeExportableScene(MakeModel(RandomSites(sites, 1), 1, [](const auto&) { return kAir; }));
    const auto files = ExportVolumes(scene, folder_, Coarse());
    ASSERT_EQ(files.size(), 1u);
    const VdbFile file = ReadVdb(folder_ / "scene.vdb");
    EXPECT_EQ(file.grids.size(), 4u);
    EXPECT_EQ(file.grids.at("density")->activeVoxelCount(), 0u);
  }
}

TEST_F(VolumeExport, TooManyVoxelsAreRefusedWithAWayOut) {
  const ExportableScene scene = MakeExportableScene(TestModel());
  VolumeExportOptions options = Coarse();
  options.voxel_size = 1e-5;
  try {
    ExportVolumes(scene, folder_, options);
    FAIL() << "1e15 voxels were made";
  } catch (const UserError& error) {
    EXPECT_THAT(error.what(), HasSubstr("scene.vdb: "));
    EXPECT_THAT(error.what(), HasSubstr("choose a voxel size of "));
    options.voxel_size = std::atof(std::strstr(error.what(), "size of ") + 8);
  }
  EXPECT_TRUE(std::filesystem::is_empty(folder_));
  // The size that the sentence names is accepted; tried with a limit that keeps the test short.
  options.max_voxels = 20'000;
  try {
    ExportVolumes(scene, folder_, options);
    FAIL();
  } catch (const UserError& error) {
    options.voxel_size = std::atof(std::strstr(error.what(), "size of ") + 8);
  }
  EXPECT_EQ(ExportVolumes(scene, folder_, options).size(), 3u);
  EXPECT_LT(ReadVdb(folder_ / "scene.vdb").grids.at("label")->activeVoxelCount(), 25'000u);
}

TEST_F(VolumeExport, OptionsOutOfRangeAreNamed) {
  VolumeExportOptions options;
  EXPECT_EQ(options.Check(), "");
  for (const char* crop : {"1,2,3",
                           "0,0,0,1,1,1,1",
                           "0,0,0,1,1,0",
                           "0,0,0,1,1,x",
                           "0 0 0 1 1 1",
                           "0,0,0,1,1,nan",
                           "0,0,0,1,1,1 m"}) {
    options.crop = crop;
    EXPECT_THAT(options.Check(), HasSubstr(crop));
  }
  options.crop = "-1, -2.5e-1,0, 1,1,1";
  EXPECT_EQ(options.Check(), "");
  for (const int samples : {0, -1, 9}) {
    options.supersample = samples;
    EXPECT_THAT(options.Check(), HasSubstr("supersample must be 1..8"));
  }
  options = {};
  for (const char* name : {"", "a b", "c/d"}) {
    options.grid_names.color = name;
    EXPECT_THAT(options.Check(), HasSubstr(std::string("'") + name + "'"));
  }
  options.grid_names.color = "density";
  EXPECT_THAT(options.Check(), HasSubstr("two are called 'density'"));
  options = {};
  options.voxel_size = -1;
  EXPECT_THAT(options.Check(), HasSubstr("voxel_size"));
  options = {};
  options.max_resolution = 0;
  EXPECT_THAT(options.Check(), HasSubstr("max_resolution"));
  options = {};
  options.voxel_size = NAN;
  EXPECT_THAT(options.Check(), HasSubstr("voxel_size"));
}

TEST_F(VolumeExport, AFullDiskIsAUserErrorAndLeavesNothing) {
  const ExportableScene scene = MakeExportableScene(TestModel());
  VolumeExportOptions options = Coarse();
  options.max_resolution = 48;
  const VolumeFrame frame = MakeVolumeFrame(scene, options);
  WriteSceneVolume(folder_ / "scene.vdb", scene, frame, options);
  const auto size = std::filesystem::file_size(folder_ / "scene.vdb");
  std::filesystem::remove(folder_ / "scene.vdb");
  // Cut in the header, in the middle, and a few bytes before the end.
  for (const auto limit : {size / 50, size / 2, size - 5}) {
    {
      const FileSizeLimit smaller(limit);
      EXPECT_THROW(WriteSceneVolume(folder_ / "scene.vdb", scene, frame, options), UserError)
          << limit << " of " << size << " bytes";
    }
    EXPECT_TRUE(std::filesystem::is_empty(folder_));
  }
}

// What a command says, its exit code checked.
std::string OutputOf(const std::string& command, const std::filesystem::path& folder) {
  const auto output = folder / "output.txt";
  EXPECT_EQ(std::system((command + " > '" + output.string() + "' 2>&1").c_str()), 0) << command;
  std::ifstream in(output);
  return {std::istreambuf_iterator<char>(in), {}};
}

TEST_F(VolumeExport, VdbPrintShowsGridsAndMetadata) {
  if (std::system("command -v vdb_print > /dev/null") != 0) {
    GTEST_SKIP() << "vdb_print (libopenvdb-tools) is not installed";
  }
  const ExportableScene scene = MakeExportableScene(TestModel());
  VolumeExportOptions options = Coarse();
  options.source_checksum = "0123456789abcdef";
  ExportVolumes(scene, folder_, options);
  for (const char* name : {"scene.vdb", "objects/7_mug.vdb"}) {
    const std::string path = "'" + (folder_ / name).string() + "'";
    const std::string listing = OutputOf("vdb_print -l " + path, folder_);
    for (const char* grid : {"density", "color", "label", "confidence"}) {
      EXPECT_THAT(listing, HasSubstr(grid));
    }
    const std::string metadata = OutputOf("vdb_print -m " + path, folder_);
    for (const char* text : {"semfoam test",
                             "0123456789abcdef",
                             "\"7\":\"mug\"",
                             "COLMAP",
                             "world_from_normalized_scale: 2.5",
                             "[10, 20, 30]"}) {
      EXPECT_THAT(metadata, HasSubstr(text));
    }
  }
  EXPECT_THAT(OutputOf("vdb_print -l '" + (folder_ / "objects/7_mug.vdb").string() + "'", folder_),
              HasSubstr("surface"));
}

// Debian's module is the one of Debian's Python.
TEST_F(VolumeExport, PythonReadsEveryDefaultFile) {
  if (std::system("/usr/bin/python3 -c 'import pyopenvdb' 2> /dev/null") != 0) {
    GTEST_SKIP() << "pyopenvdb (python3-openvdb) is not installed";
  }
  const ExportableScene scene = MakeExportableScene(TestModel());
  for (const WrittenFile& file : ExportVolumes(scene, folder_, Coarse())) {
    const std::string path = (folder_ / file.path).string();
    const std::string script =
        "import pyopenvdb, sys\n"
        "grids, metadata = pyopenvdb.readAll(sys.argv[1])\n"
        "print(metadata[\"frame\"], *sorted(g.name for g in grids))\n"
        "print(*sorted(g.activeVoxelCount() for g in grids if g.name == \"label\"))";
    const std::string said =
        OutputOf("/usr/bin/python3 -c '" + script + "' '" + path + "'", folder_);
    const VdbFile vdb = ReadVdb(path);
    EXPECT_EQ(said,
              std::string("COLMAP color confidence density label") +
                  (file.object_id != kNoObject ? " surface\n" : "\n") +
                  std::to_string(vdb.grids.at("label")->activeVoxelCount()) + "\n");
  }
}

}  // namespace
}  // namespace semfoam
