// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/object_surface.h"
#include "plugin/colmap/colmap_model.h"
#include "tools/python/foam_object.h"

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include <pybind11/pybind11.h>

namespace semfoam::python {

// What a foam is made of and what it returns, as Python sees it.

// The cells of a foam, which it keeps alive.
struct CellsObject {
  std::shared_ptr<const FoamObject> foam;
};

// An object of a foam, which it keeps alive.
struct ObjectHandle {
  std::shared_ptr<const FoamObject> foam;
  // In ExportableScene::objects.
  size_t index = 0;

  const ObjectInfo& Info() const { return foam->Scene().objects[index]; }
};

// The surfaces of one or several objects.
struct Mesh {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<std::array<uint32_t, 3>> faces;
  // [faces] Id of the object.
  std::vector<int32_t> labels;
  // [vertices]
  std::vector<Color8> vertex_colors;
  std::vector<float> vertex_confidence;
};

// Returns the surfaces of objects of a scene. `method` is a name of kSurfaceMethodNames. Throws
// FieldError for another one.
Mesh MakeMesh(const ExportableScene& scene,
              const std::vector<const ObjectInfo*>& objects,
              const std::string& method);

// A rendered view, [height][width] each.
struct Rendering {
  int width = 0;
  int height = 0;
  // Three values a pixel.
  std::vector<float> color;
  std::vector<float> depth, opacity, confidence;
  std::vector<int32_t> label;
};

// Renders a view. Throws FieldError where `supersample` is out of range.
Rendering Render(const FoamObject& foam, const Camera& camera, const Pose& pose, int supersample);

// Returns the camera that an object with the attributes of pycolmap.Camera describes. Throws
// UserError where it is no valid camera of COLMAP.
Camera CameraFrom(const pybind11::object& object);

// Returns the pose of a 3x4 or 4x4 matrix, or of an object whose matrix() is one, as
// pycolmap.Rigid3d. Throws FieldError for others, and for what is no rotation.
Pose PoseFrom(const pybind11::object& object);

// Adds Camera, Cells, Mesh, Object, Photo and Rendering.
void AddValues(pybind11::module_* module);

}  // namespace semfoam::python
