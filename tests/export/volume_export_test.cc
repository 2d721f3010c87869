// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/volume_export.h"

#include "foam/error.h"

#include <csignal>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <map>

#include "tests/export/test_foams.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <openvdb/openvdb.h>
#include <sys/resource.h>

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
    EXPECT_EQ(label->tree().getValue(*ijk), static_cast<float>(scene.label_id[cell]));
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
  EXPECT_EQ(files[1].object_id, 7);

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
    EXPECT_EQ(part.metadata->metaValue<int32_t>("object_id"), object.id);
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
  const VolumeExportOptions options = Coarse();
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
  options.int32_labels = true;
  const auto files = ExportVolumes(scene, folder_, options);
  EXPECT_EQ(files[1].path, "scene_labels_int32.vdb");
  const VdbFile integers = ReadVdb(folder_ / "scene_labels_int32.vdb");
  ASSERT_EQ(integers.names, std::vector<std::string>{"label"});
  const auto label = integers.Get<openvdb::Int32Grid>("label");
  const auto as_float = ReadVdb(folder_ / "scene.vdb").Get<openvdb::FloatGrid>("label");
  EXPECT_EQ(label->activeVoxelCount(), as_float->activeVoxelCount());
  EXPECT_EQ(label->transform(), as_float->transform());
  for (auto it = label->cbeginValueOn(); it; ++it) {
    EXPECT_EQ(static_cast<float>(*it), as_float->tree().getValue(it.getCoord()));
  }
}

TEST_F(VolumeExport, HalfFloatsNeverTouchTheLabels) {
  Model model = TestModel();
  model.labels[0].id = 65535;  // no half float holds it
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

TEST_F(VolumeExport, AVoxelLargerThanTheObjectGivesAValidFile) {
  const ExportableScene scene = MakeExportableScene(TestModel());
  VolumeExportOptions options = Coarse();
  options.voxel_size = 1000;
  const auto files = ExportVolumes(scene, folder_, options);
  for (const WrittenFile& file : files) {
    EXPECT_EQ(ReadVdb(folder_ / file.path).grids.size(), 4u) << file.path;
  }
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
  std::signal(SIGXFSZ, SIG_IGN);
  rlimit before;
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  VolumeExportOptions options = Coarse();
  options.max_resolution = 48;
  const VolumeFrame frame = MakeVolumeFrame(scene, options);
  WriteSceneVolume(folder_ / "scene.vdb", scene, frame, options);
  const auto size = std::filesystem::file_size(folder_ / "scene.vdb");
  std::filesystem::remove(folder_ / "scene.vdb");
  // Cut in the header, in the middle, and a few bytes before the end.
  for (const auto limit : {size / 50, size / 2, size - 5}) {
    rlimit small = before;
    small.rlim_cur = limit;
    ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
    EXPECT_THROW(WriteSceneVolume(folder_ / "scene.vdb", scene, frame, options), UserError)
        << limit << " of " << size << " bytes";
    ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &before), 0);
    EXPECT_TRUE(std::filesystem::is_empty(folder_));
  }
}

TEST_F(VolumeExport, VdbPrintListsTheGrids) {
  if (std::system("command -v vdb_print > /dev/null") != 0) {
    GTEST_SKIP() << "vdb_print (libopenvdb-tools) is not installed";
  }
  const ExportableScene scene = MakeExportableScene(TestModel());
  ExportVolumes(scene, folder_, Coarse());
  for (const char* name : {"scene.vdb", "objects/7_mug.vdb"}) {
    const auto listing = folder_ / "listing.txt";
    const std::string command =
        "vdb_print -l '" + (folder_ / name).string() + "' > '" + listing.string() + "' 2>&1";
    ASSERT_EQ(std::system(command.c_str()), 0);
    std::ifstream in(listing);
    const std::string text{std::istreambuf_iterator<char>(in), {}};
    for (const char* grid : {"density", "color", "label", "confidence"}) {
      EXPECT_THAT(text, HasSubstr(grid));
    }
  }
}

}  // namespace
}  // namespace semfoam
