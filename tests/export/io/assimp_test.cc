// SPDX-License-Identifier: GPL-3.0-or-later
//
// A reader that is not ours, and that many programs are built on, finds in our files what we put
// in.
#include "export/io/surface_export.h"
#include "export/scene/names.h"
#include "export/scene/object_surface.h"

#include <array>
#include <map>
#include <set>

#include "tests/export/test_foams.h"
#include <assimp/Importer.hpp>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

class AssimpReads : public TemporaryFolderTest {
 protected:
  void SetUp() override {
    TemporaryFolderTest::SetUp();
    Model model = TouchingBalls(1500);
    model.labels[1].name = "M\xC3\xBCtze 2";
    scene_ = MakeExportableScene(model);
    SurfaceExportOptions options;
    options.method = SurfaceMethod::kCells;
    ExportSurfaces(scene_, folder_, options);
    for (const ObjectInfo& object : scene_.objects) {
      surfaces_.push_back(ExtractSurface(scene_, object));
    }
  }

  std::string Path(const std::string& name) const { return (folder_ / name).string(); }

  ExportableScene scene_;
  std::vector<ObjectSurface> surfaces_;
};

// The nodes with meshes, by name, below a node; what they hold in z-up coordinates of the file.
void CollectNodes(const aiNode* node,
                  const aiMatrix4x4& above,
                  std::map<std::string, std::pair<const aiNode*, aiMatrix4x4>>* found) {
  const aiMatrix4x4 here = above * node->mTransformation;
  if (node->mNumMeshes > 0) (*found)[node->mName.C_Str()] = {node, here};
  for (unsigned k = 0; k < node->mNumChildren; ++k) CollectNodes(node->mChildren[k], here, found);
}

using Vertex = std::array<int64_t, 6>;  // position in 1e-4, display colour

Vertex MakeVertex(const Eigen::Vector3d& x, const std::array<double, 3>& display) {
  Vertex vertex;
  for (int a = 0; a < 3; ++a) vertex[a] = std::lround(1e4 * x[a]);
  for (int c = 0; c < 3; ++c) vertex[3 + c] = std::lround(255 * display[c]);
  return vertex;
}

// Corner by corner, in the order of the faces: readers may number vertices anew.
std::vector<Vertex> Corners(const ObjectSurface& surface) {
  std::vector<Vertex> corners;
  for (const auto& triangle : surface.triangles) {
    for (const uint32_t v : triangle) {
      std::array<double, 3> color;
      for (int c = 0; c < 3; ++c) color[c] = surface.vertex_color[v][c] / 255.0;
      corners.push_back(MakeVertex(surface.vertices[v], color));
    }
  }
  return corners;
}

std::vector<Vertex> Corners(const aiMesh* mesh, const aiMatrix4x4& transform, bool linear) {
  std::vector<Vertex> corners;
  EXPECT_TRUE(mesh->HasVertexColors(0));
  if (!mesh->HasVertexColors(0)) return corners;
  for (unsigned f = 0; f < mesh->mNumFaces; ++f) {
    EXPECT_EQ(mesh->mFaces[f].mNumIndices, 3u);
    for (unsigned k = 0; k < mesh->mFaces[f].mNumIndices; ++k) {
      const unsigned v = mesh->mFaces[f].mIndices[k];
      const aiVector3D x = transform * mesh->mVertices[v];
      const aiColor4D& c = mesh->mColors[0][v];
      std::array<double, 3> color = {c.r, c.g, c.b};
      for (double& light : color) {
        if (!linear) break;
        light = light <= 0.0031308 ? 12.92 * light : 1.055 * std::pow(light, 1 / 2.4) - 0.055;
      }
      corners.push_back(MakeVertex({x.x, x.y, x.z}, color));
    }
  }
  return corners;
}

void ExpectSame(const std::vector<Vertex>& read, const std::vector<Vertex>& expected) {
  ASSERT_EQ(read.size(), expected.size());
  int64_t different = 0;
  for (size_t k = 0; k < read.size(); ++k) {
    for (int i = 0; i < 6; ++i) {
      // A position may round the other way in float.
      if (std::abs(read[k][i] - expected[k][i]) > (i < 3 ? 1 : 0)) ++different;
    }
  }
  EXPECT_EQ(different, 0);
}

// From glTF's y-up frame to that of a program that is z-up.
aiMatrix4x4 ZUpFromGltf() { return {1, 0, 0, 0, 0, 0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 1}; }

TEST_F(AssimpReads, Ply) {
  for (size_t k = 0; k < surfaces_.size(); ++k) {
    Assimp::Importer importer;
    const aiScene* read =
        importer.ReadFile(Path("objects/" + scene_.objects[k].file_stem + ".ply"), 0);
    ASSERT_NE(read, nullptr) << importer.GetErrorString();
    ASSERT_EQ(read->mNumMeshes, 1u);
    EXPECT_EQ(read->mMeshes[0]->mNumVertices, surfaces_[k].vertices.size());
    EXPECT_EQ(read->mMeshes[0]->mNumFaces, surfaces_[k].triangles.size());
    ExpectSame(Corners(read->mMeshes[0], aiMatrix4x4(), false), Corners(surfaces_[k]));
  }
}

TEST_F(AssimpReads, Obj) {
  for (size_t k = 0; k < surfaces_.size(); ++k) {
    const std::string stem = scene_.objects[k].file_stem;
    Assimp::Importer importer;
    const aiScene* read = importer.ReadFile(Path("objects/" + stem + ".obj"), 0);
    ASSERT_NE(read, nullptr) << importer.GetErrorString();
    ASSERT_EQ(read->mNumMeshes, 1u);
    EXPECT_EQ(read->mMeshes[0]->mNumFaces, surfaces_[k].triangles.size());
    EXPECT_STREQ(read->mMeshes[0]->mName.C_Str(), stem.c_str());
    ExpectSame(Corners(read->mMeshes[0], aiMatrix4x4(), false), Corners(surfaces_[k]));

    // The material, found beside it.
    const aiMaterial* material = read->mMaterials[read->mMeshes[0]->mMaterialIndex];
    EXPECT_STREQ(material->GetName().C_Str(), stem.c_str());
    aiColor3D diffuse;
    ASSERT_EQ(material->Get(AI_MATKEY_COLOR_DIFFUSE, diffuse), aiReturn_SUCCESS);
    double mean[3] = {};
    for (const Color8& color : surfaces_[k].vertex_color) {
      for (int c = 0; c < 3; ++c) {
        mean[c] += color[c] / 255.0 / static_cast<double>(surfaces_[k].vertex_color.size());
      }
    }
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(diffuse[c], mean[c], 1e-4);
  }
}

TEST_F(AssimpReads, Glb) {
  const auto expect_objects = [&](const std::string& path, const std::vector<size_t>& objects) {
    SCOPED_TRACE(path);
    Assimp::Importer importer;
    const aiScene* read = importer.ReadFile(Path(path), 0);
    ASSERT_NE(read, nullptr) << importer.GetErrorString();
    std::map<std::string, std::pair<const aiNode*, aiMatrix4x4>> nodes;
    CollectNodes(read->mRootNode, ZUpFromGltf(), &nodes);
    ASSERT_EQ(nodes.size(), objects.size());
    for (const size_t k : objects) {
      const ObjectInfo& object = scene_.objects[k];
      ASSERT_EQ(nodes.count(object.name), 1u) << object.name;
      const auto& [node, transform] = nodes[object.name];
      ASSERT_EQ(node->mNumMeshes, 1u);
      const aiMesh* mesh = read->mMeshes[node->mMeshes[0]];
      EXPECT_EQ(mesh->mNumVertices, surfaces_[k].vertices.size());
      EXPECT_EQ(mesh->mNumFaces, surfaces_[k].triangles.size());
      EXPECT_TRUE(mesh->HasNormals());
      ExpectSame(Corners(mesh, transform, true), Corners(surfaces_[k]));
      ASSERT_NE(node->mMetaData, nullptr);
      aiString name;
      EXPECT_TRUE(node->mMetaData->Get("name", name));
      EXPECT_STREQ(name.C_Str(), object.name.c_str());
    }
  };
  expect_objects("objects/" + scene_.objects[0].file_stem + ".glb", {0});
  expect_objects("objects/" + scene_.objects[1].file_stem + ".glb", {1});
  expect_objects("scene.glb", {0, 1});
}

}  // namespace
}  // namespace semfoam
