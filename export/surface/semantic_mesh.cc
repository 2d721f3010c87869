// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/surface/semantic_mesh.h"

#include "foam/util/error.h"
#include "foam/util/output_file.h"

#include <fstream>
#include <sstream>

#include <glog/logging.h>

namespace semfoam {
namespace {

// OpenMesh writes `unsigned int` and `bool` properties wrongly or not at all into some formats, so
// a property that is to last is an int, a float or a string.
template <typename T>
inline constexpr bool kPersistsEverywhere =
    std::is_same_v<T, int> || std::is_same_v<T, float> || std::is_same_v<T, std::string>;

template <typename T, template <typename> class Handle>
Handle<T> AddPersistent(SemanticMesh* mesh, const char* name) {
  static_assert(kPersistsEverywhere<T>);
  Handle<T> handle;
  mesh->add_property(handle, name);
  if constexpr (std::is_same_v<Handle<T>, OpenMesh::MPropHandleT<T>>) {
    mesh->mproperty(handle).set_persistent(true);
  } else {
    mesh->property(handle).set_persistent(true);
  }
  return handle;
}

OpenMesh::Vec3uc ToVec3uc(const Color8& color) { return {color[0], color[1], color[2]}; }

}  // namespace

SemanticMesh ToSemanticMesh(const ObjectSurface& surface) {
  SemanticMesh mesh;
  const auto vertex_label = AddPersistent<int, OpenMesh::VPropHandleT>(&mesh, kLabelProperty);
  const auto vertex_confidence =
      AddPersistent<float, OpenMesh::VPropHandleT>(&mesh, kConfidenceProperty);
  const auto face_label = AddPersistent<int, OpenMesh::FPropHandleT>(&mesh, kLabelProperty);
  const auto face_confidence =
      AddPersistent<float, OpenMesh::FPropHandleT>(&mesh, kConfidenceProperty);
  const auto object_id = AddPersistent<int, OpenMesh::MPropHandleT>(&mesh, kObjectIdProperty);
  const auto object_name =
      AddPersistent<std::string, OpenMesh::MPropHandleT>(&mesh, kObjectNameProperty);
  mesh.property(object_id) = Value(surface.object_id);
  mesh.property(object_name) = surface.object_name;

  mesh.reserve(surface.vertices.size(), surface.triangles.size() * 3 / 2, surface.triangles.size());
  for (size_t v = 0; v < surface.vertices.size(); ++v) {
    const Eigen::Vector3d& x = surface.vertices[v];
    const auto vertex = mesh.add_vertex({x.x(), x.y(), x.z()});
    mesh.set_color(vertex, ToVec3uc(surface.vertex_color[v]));
    mesh.property(vertex_label, vertex) = Value(surface.object_id);
    mesh.property(vertex_confidence, vertex) = surface.vertex_confidence[v];
  }
  for (size_t f = 0; f < surface.triangles.size(); ++f) {
    const auto& corners = surface.triangles[f];
    const auto face = mesh.add_face(SemanticMesh::VertexHandle(static_cast<int>(corners[0])),
                                    SemanticMesh::VertexHandle(static_cast<int>(corners[1])),
                                    SemanticMesh::VertexHandle(static_cast<int>(corners[2])));
    CHECK(face.is_valid()) << "a face between cells is not manifold";
    mesh.set_color(face, ToVec3uc(surface.face_color[f]));
    mesh.property(face_label, face) = Value(surface.object_id);
    mesh.property(face_confidence, face) = surface.face_confidence[f];
  }
  return mesh;
}

void WriteOm(const std::filesystem::path& path, const ObjectSurface& surface) {
  const SemanticMesh mesh = ToSemanticMesh(surface);
  // Writes into memory first, because OpenMesh fails an assertion on a full disk. Disables its log
  // messages about every file.
  std::ostringstream bytes;
  // OpenMesh 9 writes properties of ours (Custom) always, 11 where that is asked for.
  OpenMesh::IO::Options options = OpenMesh::IO::Options::VertexColor;
  options += OpenMesh::IO::Options::FaceColor;
  options += OpenMesh::IO::Options::Custom;
  const bool was_talking = omlog().is_enabled();
  omlog().disable();
  const bool written = OpenMesh::IO::write_mesh(mesh, bytes, ".om", options);
  if (was_talking) omlog().enable();
  CHECK(written);

  OutputFile file(path);
  {
    std::ofstream out(file.temporary_path(), std::ios::binary);
    out << bytes.view();
    out.close();
    if (out.fail()) {
      throw UserError(path.string(), ": cannot be written completely; is the disk full?");
    }
  }
  file.Commit();
}

}  // namespace semfoam
