// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

// Converts surfaces to OpenMesh meshes. The only header of export/ that includes OpenMesh: for code
// that works on the meshes themselves.

#include "export/scene/object_surface.h"

#include <filesystem>
#include <string>
#include <type_traits>

#include <OpenMesh/Core/IO/MeshIO.hh>
#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>

namespace semfoam {

// Positions in double, colours as 8-bit display values.
struct SemanticMeshTraits : OpenMesh::DefaultTraits {
  using Point = OpenMesh::Vec3d;
  using Normal = OpenMesh::Vec3d;
  using Color = OpenMesh::Vec3uc;
  VertexAttributes(OpenMesh::Attributes::Color);
  FaceAttributes(OpenMesh::Attributes::Color);
};
using SemanticMesh = OpenMesh::TriMesh_ArrayKernelT<SemanticMeshTraits>;

// Names of the properties in an .om file, on vertices and on faces ("label" int, "confidence"
// float) and on the mesh ("object_id" int, "object_name" std::string). Read them with
// mesh.get_property_handle after OpenMesh::IO::read_mesh, whose options must have Custom from
// OpenMesh 11 on.
inline constexpr char kLabelProperty[] = "label";
inline constexpr char kConfidenceProperty[] = "confidence";
inline constexpr char kObjectIdProperty[] = "object_id";
inline constexpr char kObjectNameProperty[] = "object_name";

// Converts a surface to an OpenMesh mesh with those properties, all persistent, and vertex and face
// colours. Vertex and face indices are those of the surface. CHECKs that OpenMesh, which accepts
// manifolds only, takes every face.
SemanticMesh ToSemanticMesh(const ObjectSurface& surface);

// Writes OpenMesh's own binary format, which is lossless. Throws UserError when the file cannot be
// written.
void WriteOm(const std::filesystem::path& path, const ObjectSurface& surface);

}  // namespace semfoam
