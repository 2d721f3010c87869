// SPDX-License-Identifier: GPL-3.0-or-later
//
// A scene at UTM coordinates is the same scene: its photos give the same rays, and what is exported
// of it agrees with the unshifted scene's files to the millimetre, in every format.
#include "export/io/surface_export.h"
#include "export/io/volume_export.h"
#include "export/scene/exportable_scene.h"
#include "export/surface/semantic_mesh.h"
#include "plugin/colmap/colmap_model.h"
#include "plugin/dataset/scene_plan.h"
#include "plugin/dataset/training_scene.h"

#include <cstring>
#include <sstream>

#include "tests/export/io/read_glb.h"
#include "tests/export/io/read_usda.h"
#include "tests/export/test_foams.h"
#include "tests/tools/commands/read_obj.h"
#include "tests/tools/program.h"
#include <gtest/gtest.h>
#include <openvdb/openvdb.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

const Eigen::Vector3d kShift(5e5, 4.5e6, 300);
constexpr double kMillimetre = 1e-3;

SceneOptions TabletopAt(const fs::path& model_folder) {
  SceneOptions options;
  options.image_path = kTabletop / "images";
  options.input_path = model_folder;
  return options;
}

class UtmRoundTripTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TempFolder;
    Reconstruction model = ReadReconstruction(kTabletop / "sparse" / "0");
    for (Point3D& point : model.points) point.position += kShift;
    for (Image& image : model.images) {
      Pose& pose = image.cam_from_world;
      pose.translation -= pose.UnitRotation() * kShift;
    }
    fs::create_directories(*folder_ / "sparse");
    WriteReconstruction(*folder_ / "sparse", model, ModelFormat::kBinary);
    near_ = new ScenePlan(PlanScene(TabletopAt(kTabletop / "sparse" / "0")));
    far_ = new ScenePlan(PlanScene(TabletopAt(*folder_ / "sparse")));
  }
  static void TearDownTestSuite() {
    delete far_;
    delete near_;
    delete folder_;
  }

  // All that the exporters write of one small foam in that frame.
  static fs::path Export(const std::string& name, const Similarity& world_from_normalized) {
    const fs::path out = *folder_ / name;
    Model model = TouchingBalls(1500);
    model.world_from_normalized = world_from_normalized;
    const ExportableScene scene = MakeExportableScene(model);
    VolumeExportOptions volume;
    volume.max_resolution = 64;
    ExportVolumes(scene, out, volume);
    ExportSurfaces(scene, out);
    return out;
  }

  static TempFolder* folder_;
  static ScenePlan* near_;
  static ScenePlan* far_;
};
TempFolder* UtmRoundTripTest::folder_ = nullptr;
ScenePlan* UtmRoundTripTest::near_ = nullptr;
ScenePlan* UtmRoundTripTest::far_ = nullptr;

std::vector<Eigen::Vector3d> PlyVertices(const fs::path& path) {
  const std::string bytes = ReadFile(path);
  const size_t count_at = bytes.find("element vertex ");
  const std::string end = "end_header\n";
  size_t at = bytes.find(end);
  EXPECT_NE(count_at, std::string::npos);
  EXPECT_NE(at, std::string::npos);
  at += end.size();
  // double x y z, uchar red green blue, int label, float confidence (mesh_files.h)
  constexpr size_t kStride = 3 * 8 + 3 + 4 + 4;
  std::vector<Eigen::Vector3d> vertices(std::stoul(bytes.substr(count_at + 15)));
  EXPECT_LE(at + vertices.size() * kStride, bytes.size());
  for (Eigen::Vector3d& vertex : vertices) {
    std::memcpy(vertex.data(), bytes.data() + at, 3 * sizeof(double));
    at += kStride;
  }
  return vertices;
}

std::vector<Eigen::Vector3d> OmVertices(const fs::path& path) {
  SemanticMesh mesh;
  EXPECT_TRUE(OpenMesh::IO::read_mesh(mesh, path.string()));
  std::vector<Eigen::Vector3d> vertices;
  for (const auto vertex : mesh.vertices()) {
    const auto& p = mesh.point(vertex);
    vertices.emplace_back(p[0], p[1], p[2]);
  }
  return vertices;
}

std::vector<Eigen::Vector3d> GlbVertices(const fs::path& path) {
  return ImportedVertices(ReadGlb(path));
}

std::vector<Eigen::Vector3d> UsdaVertices(const fs::path& path) {
  const nlohmann::json stage = UsdaReader::Read(path);
  std::vector<Eigen::Vector3d> vertices;
  for (const auto& [name, object] : stage["children"]["scene"]["children"].items()) {
    const nlohmann::json& mesh = object["children"]["surface"]["properties"];
    const nlohmann::json& t = mesh["xformOp:translate"]["value"];
    for (const nlohmann::json& p : mesh["points"]["value"]) {
      vertices.emplace_back(p[0], p[1], p[2]);
      vertices.back() += Eigen::Vector3d(t[0], t[1], t[2]);
    }
  }
  return vertices;
}

// The centres of a grid's active voxels in the world, and their values.
struct Voxels {
  std::vector<Eigen::Vector3d> centers;
  std::vector<float> values;
};
Voxels ReadVoxels(const fs::path& path, const std::string& grid_name) {
  openvdb::initialize();
  openvdb::io::File file(path.string());
  file.open(false);
  const auto grid = openvdb::gridPtrCast<openvdb::FloatGrid>(file.readGrid(grid_name));
  Voxels voxels;
  for (auto voxel = grid->cbeginValueOn(); voxel; ++voxel) {
    const openvdb::Vec3d center = grid->indexToWorld(voxel.getCoord());
    voxels.centers.emplace_back(center.x(), center.y(), center.z());
    voxels.values.push_back(*voxel);
  }
  return voxels;
}

void ExpectShifted(const std::vector<Eigen::Vector3d>& unshifted,
                   const std::vector<Eigen::Vector3d>& shifted,
                   const std::string& what) {
  ASSERT_FALSE(unshifted.empty()) << what;
  ASSERT_EQ(unshifted.size(), shifted.size()) << what;
  double farthest = 0;
  for (size_t i = 0; i < unshifted.size(); ++i) {
    farthest = std::max(farthest, (shifted[i] - kShift - unshifted[i]).norm());
  }
  EXPECT_LT(farthest, kMillimetre) << what;
}

TEST_F(UtmRoundTripTest, TheNormalisedFrameMovesWithTheModel) {
  const Similarity& near = near_->world_from_normalized;
  const Similarity& far = far_->world_from_normalized;
  EXPECT_LT((far.translation - kShift - near.translation).norm(), 1e-6);
  EXPECT_NEAR(far.scale / near.scale, 1, 1e-8);
}

TEST_F(UtmRoundTripTest, SeedsAndRaysAreTheSameToFloatPrecision) {
  ASSERT_EQ(near_->seeds.size(), far_->seeds.size());
  for (size_t i = 0; i < near_->seeds.size(); ++i) {
    const Eigen::Vector3f& p = near_->seeds[i].position;
    ASSERT_LT((far_->seeds[i].position - p).norm(), 4e-7f * (1 + p.norm())) << i;
    ASSERT_EQ(far_->seeds[i].color, near_->seeds[i].color);
  }
  const TrainingScene near(*near_), far(*far_);
  ASSERT_EQ(near.NumViews(), far.NumViews());
  for (int view = 0; view < near.NumViews(); ++view) {
    EXPECT_LT((far.Origin(view) - near.Origin(view)).norm(), 1e-7) << view;
    for (const auto& [x, y] : {std::pair(0, 0), {160, 120}, {319, 239}}) {
      TrainingRay a, b;
      ASSERT_TRUE(near.Ray(view, x, y, &a));
      ASSERT_TRUE(far.Ray(view, x, y, &b));
      EXPECT_EQ(a.direction, b.direction);
      EXPECT_EQ(a.color, b.color);
      EXPECT_EQ(a.class_index, b.class_index);
    }
  }
}

TEST_F(UtmRoundTripTest, ExportedFilesAgreeToTheMillimetre) {
  const fs::path near = Export("near", near_->world_from_normalized);
  const fs::path far = Export("far", far_->world_from_normalized);
  const std::vector<std::string> files = FilesBelow(near);
  EXPECT_EQ(files.size(), 3 + 2 * 6u) << "the scene in three formats, two objects in six";
  for (const std::string& file : files) {
    const std::string extension = fs::path(file).extension().string();
    if (extension == ".ply") ExpectShifted(PlyVertices(near / file), PlyVertices(far / file), file);
    if (extension == ".obj") ExpectShifted(ObjVertices(near / file), ObjVertices(far / file), file);
    if (extension == ".om") ExpectShifted(OmVertices(near / file), OmVertices(far / file), file);
    if (extension == ".glb") ExpectShifted(GlbVertices(near / file), GlbVertices(far / file), file);
    if (extension == ".usda") {
      ExpectShifted(UsdaVertices(near / file), UsdaVertices(far / file), file);
    }
    if (extension != ".vdb") continue;
    for (const std::string grid : {"density", "label", "confidence"}) {
      const Voxels a = ReadVoxels(near / file, grid), b = ReadVoxels(far / file, grid);
      ExpectShifted(a.centers, b.centers, file + " " + grid);
      ASSERT_EQ(a.values.size(), b.values.size());
      for (size_t i = 0; i < a.values.size(); ++i) {
        ASSERT_NEAR(a.values[i], b.values[i], 1e-5f * std::abs(a.values[i])) << file << " " << grid;
      }
    }
  }
}

}  // namespace
}  // namespace semfoam
