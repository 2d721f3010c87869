// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/python/values.h"

#include "export/io/surface_export.h"
#include "export/surface/smooth_surface.h"
#include "foam/util/error.h"
#include "plugin/colmap/camera_rays.h"
#include "tools/images/view_images.h"
#include "tools/python/conversions.h"

#include <cstdint>
#include <optional>
#include <utility>

#include <pybind11/eigen.h>
#include <pybind11/numpy.h>
#include <pybind11/stl.h>

namespace py = pybind11;

namespace semfoam::python {
namespace {

using Matrix34 = Eigen::Matrix<double, 3, 4, Eigen::RowMajor>;
using Matrix23 = Eigen::Matrix<double, 2, 3, Eigen::RowMajor>;

// A camera with the attributes of pycolmap.Camera.
struct CameraObject {
  std::string model;
  int width = 0;
  int height = 0;
  std::vector<double> params;
};

py::ssize_t Size(size_t size) { return static_cast<py::ssize_t>(size); }

// Returns an array [N] of the cells that `values` gives.
template <typename Values>
py::array CellView(const py::object& self, const Values& values) {
  const FoamObject& foam = *self.cast<const CellsObject&>().foam;
  const auto& found = WithoutGil([&]() -> const auto& { return values(foam); });
  return View(found.data(), {Size(found.size())}, self);
}

// Returns an array [N][3] likewise.
template <typename Values>
py::array CellVectorView(const py::object& self, const Values& values) {
  const FoamObject& foam = *self.cast<const CellsObject&>().foam;
  const auto& found = WithoutGil([&]() -> const auto& { return values(foam); });
  return View(found.data()->data(), {Size(found.size()), 3}, self);
}

void AddCells(py::module_* module) {
  py::class_<CellsObject>(
      *module,
      "Cells",
      "The N cells of a foam as read-only arrays that share its memory, in the frame and units of "
      "the COLMAP model. The first access to all but len() takes seconds for a million cells.")
      .def("__len__", [](const CellsObject& cells) { return cells.foam->model().foam.NumSites(); })
      .def_property_readonly(
          "positions",
          [](const py::object& self) {
            return CellVectorView(
                self, [](const FoamObject& f) -> const auto& { return f.Cells().positions; });
          },
          "(N, 3) float64: the sites.")
      .def_property_readonly(
          "density",
          [](const py::object& self) {
            return CellView(
                self, [](const FoamObject& f) -> const auto& { return f.Cells().density; });
          },
          "(N,) float32: optical depth per unit of length.")
      .def_property_readonly(
          "volume",
          [](const py::object& self) {
            return CellView(
                self, [](const FoamObject& f) -> const auto& { return f.Cells().volume; });
          },
          "(N,) float64: in cubed units of length.")
      .def_property_readonly(
          "color",
          [](const py::object& self) {
            return CellVectorView(
                self, [](const FoamObject& f) -> const auto& { return f.Scene().display_color; });
          },
          "(N, 3) float32: sRGB values, 0 to 1, as in the photos.")
      .def_property_readonly(
          "label",
          [](const py::object& self) {
            return CellView(
                self, [](const FoamObject& f) -> const auto& { return f.Cells().label; });
          },
          "(N,) int32: ids of the cells' own labels; 0 = none.")
      .def_property_readonly(
          "object",
          [](const py::object& self) {
            return CellView(
                self, [](const FoamObject& f) -> const auto& { return f.Cells().object; });
          },
          "(N,) int32: ids of the objects that the cells are part of; 0 = none.")
      .def_property_readonly(
          "confidence",
          [](const py::object& self) {
            return CellView(
                self,
                [](const FoamObject& f) -> const auto& { return f.Scene().labels.confidence; });
          },
          "(N,) float32, 0 to 1: softmax of the label.")
      .def_property_readonly(
          "solid",
          [](const py::object& self) {
            return CellView(
                self, [](const FoamObject& f) -> const auto& { return f.Scene().labels.solid; });
          },
          "(N,) uint8: 1 = matter, 0 = air.")
      .def_property_readonly(
          "neighbor_offsets",
          [](const py::object& self) {
            const auto& cells = self.cast<const CellsObject&>();
            const Delaunay& delaunay =
                WithoutGil([&]() -> const Delaunay& { return cells.foam->Scene().delaunay; });
            return View(delaunay.offsets.data(), {Size(delaunay.num_sites) + 1}, self);
          },
          "(N + 1,) uint32: the neighbours of cell i are neighbors[neighbor_offsets[i] : "
          "neighbor_offsets[i + 1]].")
      .def_property_readonly(
          "neighbors",
          [](const py::object& self) {
            const auto& cells = self.cast<const CellsObject&>();
            const Delaunay& delaunay =
                WithoutGil([&]() -> const Delaunay& { return cells.foam->Scene().delaunay; });
            return View(
                delaunay.neighbors.data(), {Size(delaunay.offsets[delaunay.num_sites])}, self);
          },
          "uint32: indices of the cells that share a face; those from N on bound the scene.");
}

void AddMesh(py::module_* module) {
  py::class_<Mesh>(*module,
                   "Mesh",
                   "Closed surfaces of objects, in the frame and units of the COLMAP model. Arrays "
                   "are read-only. Objects share no vertices.")
      .def_property_readonly(
          "vertices",
          [](const py::object& self) {
            const auto& mesh = self.cast<const Mesh&>();
            return View(mesh.vertices.data()->data(), {Size(mesh.vertices.size()), 3}, self);
          },
          "(V, 3) float64.")
      .def_property_readonly(
          "faces",
          [](const py::object& self) {
            const auto& mesh = self.cast<const Mesh&>();
            return View(mesh.faces.data()->data(), {Size(mesh.faces.size()), 3}, self);
          },
          "(F, 3) uint32: indices of vertices, counter-clockwise seen from outside.")
      .def_property_readonly(
          "labels",
          [](const py::object& self) {
            const auto& mesh = self.cast<const Mesh&>();
            return View(mesh.labels.data(), {Size(mesh.labels.size())}, self);
          },
          "(F,) int32: ids of the faces' objects.")
      .def_property_readonly(
          "vertex_colors",
          [](const py::object& self) {
            const auto& mesh = self.cast<const Mesh&>();
            return View(
                mesh.vertex_colors.data()->data(), {Size(mesh.vertex_colors.size()), 3}, self);
          },
          "(V, 3) uint8: sRGB values.")
      .def_property_readonly(
          "vertex_confidence",
          [](const py::object& self) {
            const auto& mesh = self.cast<const Mesh&>();
            return View(mesh.vertex_confidence.data(), {Size(mesh.vertex_confidence.size())}, self);
          },
          "(V,) float32, 0 to 1.")
      .def("__repr__", [](const Mesh& mesh) {
        return "<semfoam.Mesh: " + std::to_string(mesh.vertices.size()) + " vertices, " +
               std::to_string(mesh.faces.size()) + " faces>";
      });
}

void AddObject(py::module_* module) {
  py::class_<ObjectHandle>(*module,
                           "Object",
                           "An object of a foam, as the exporters write it: its cells and what "
                           "they measure, in the frame and units of the COLMAP model.")
      .def_property_readonly("id", [](const ObjectHandle& o) { return Value(o.Info().id); })
      .def_property_readonly("name", [](const ObjectHandle& o) { return o.Info().name; })
      .def_property_readonly(
          "volume", [](const ObjectHandle& o) { return o.Info().volume; }, "Of its cells, exact.")
      .def_property_readonly(
          "area", [](const ObjectHandle& o) { return o.Info().area; }, "Of its surface.")
      .def_property_readonly(
          "confidence",
          [](const ObjectHandle& o) { return o.Info().confidence; },
          "Mean of its cells, 0 to 1.")
      .def_property_readonly(
          "components",
          [](const ObjectHandle& o) { return o.Info().components; },
          "Number of its connected pieces.")
      .def_property_readonly(
          "genus", [](const ObjectHandle& o) { return o.Info().genus; }, "Number of tunnels.")
      .def_property_readonly(
          "centroid",
          [](const ObjectHandle& o) -> Eigen::Vector3d { return o.Info().centroid; },
          "(3,) float64: of its volume.")
      .def_property_readonly(
          "bounding_box",
          [](const ObjectHandle& o) {
            Matrix23 box;
            box << o.Info().bounding_box.min().transpose(), o.Info().bounding_box.max().transpose();
            return box;
          },
          "(2, 3) float64: its smallest and its largest corner.")
      .def_property_readonly(
          "cells",
          [](const py::object& self) {
            const auto& cells = self.cast<const ObjectHandle&>().Info().cells;
            return View(cells.data(), {Size(cells.size())}, self);
          },
          "(n,) uint32: indices of its cells, ascending.")
      .def(
          "mesh",
          [](const ObjectHandle& o, const std::string& method) {
            return MakeMesh(o.foam->Scene(), {&o.Info()}, method);
          },
          py::arg("method") = "cells",
          py::call_guard<py::gil_scoped_release>(),
          "Returns its surface: method 'cells' = the faces of its cells, exact; 'smooth' = "
          "smoothed.")
      .def("__repr__", [](const ObjectHandle& o) {
        return "<semfoam.Object " + o.Info().name + " (" + std::to_string(Value(o.Info().id)) +
               ")>";
      });
}

void AddViews(py::module_* module) {
  py::class_<CameraObject>(*module, "Camera", "A camera of COLMAP, as pycolmap.Camera.")
      .def(py::init([](std::string model, int width, int height, std::vector<double> params) {
             return CameraObject{std::move(model), width, height, std::move(params)};
           }),
           py::arg("model"),
           py::arg("width"),
           py::arg("height"),
           py::arg("params"))
      .def_readwrite("model", &CameraObject::model, "'PINHOLE', 'OPENCV' ...")
      .def_readwrite("width", &CameraObject::width, "Pixels.")
      .def_readwrite("height", &CameraObject::height, "Pixels.")
      .def_readwrite("params", &CameraObject::params, "In COLMAP's order, in pixels.")
      .def("__repr__", [](const CameraObject& camera) {
        return "<semfoam.Camera " + camera.model + ", " + std::to_string(camera.width) + " x " +
               std::to_string(camera.height) + ">";
      });

  py::class_<PhotoRecord>(*module, "Photo", "A photo of the training, as pycolmap.Image.")
      .def_readonly("name", &PhotoRecord::name, "Relative to the folder of the photos.")
      .def_property_readonly(
          "camera",
          [](const PhotoRecord& photo) {
            return CameraObject{photo.camera_model, photo.width, photo.height, photo.camera_params};
          },
          "Its camera, of the size in training.")
      .def_property_readonly(
          "cam_from_world",
          [](const PhotoRecord& photo) {
            Matrix34 matrix;
            matrix << photo.cam_from_world_rotation.toRotationMatrix(),
                photo.cam_from_world_translation;
            return matrix;
          },
          "(3, 4) float64: x_camera = R x_world + t, as pycolmap.Rigid3d.matrix().")
      .def_readonly(
          "held_out", &PhotoRecord::held_out, "Whether it was kept from training, for evaluation.")
      .def("__repr__",
           [](const PhotoRecord& photo) { return "<semfoam.Photo " + photo.name + ">"; });

  const auto plane = [](auto member) {
    return [member](const py::object& self) {
      const auto& rendering = self.cast<const Rendering&>();
      return View((rendering.*member).data(), {rendering.height, rendering.width}, self);
    };
  };
  py::class_<Rendering>(
      *module, "Rendering", "A rendered view: read-only arrays of (height, width).")
      .def_property_readonly(
          "color",
          [](const py::object& self) {
            const auto& rendering = self.cast<const Rendering&>();
            return View(rendering.color.data(), {rendering.height, rendering.width, 3}, self);
          },
          "(height, width, 3) float32: sRGB values over white, 0 to 1 but not clipped above.")
      .def_property_readonly("label", plane(&Rendering::label), "int32: ids; 0 = none.")
      .def_property_readonly(
          "depth",
          plane(&Rendering::depth),
          "float32: along the camera's z axis, in units of the COLMAP model, where the "
          "transmittance is 1/2; 0 = nothing.")
      .def_property_readonly("opacity", plane(&Rendering::opacity), "float32, 0 to 1.")
      .def_property_readonly(
          "confidence", plane(&Rendering::confidence), "float32, 0 to 1: softmax of the label.");
}

}  // namespace

Mesh MakeMesh(const ExportableScene& scene,
              const std::vector<const ObjectInfo*>& objects,
              const std::string& method) {
  const std::optional<SurfaceMethod> parsed = ParseEnum(kSurfaceMethodNames, method);
  if (!parsed) throw FieldError("method", " is '", method, "'; it must be cells or smooth.");
  Mesh mesh;
  for (const ObjectInfo* object : objects) {
    ObjectSurface surface = ExtractSurface(scene, *object);
    if (*parsed == SurfaceMethod::kSmooth) {
      surface = ExtractSmoothSurface(scene, *object, surface);
    }
    const auto first = static_cast<uint32_t>(mesh.vertices.size());
    for (const auto& [a, b, c] : surface.triangles) {
      mesh.faces.push_back({first + a, first + b, first + c});
    }
    mesh.labels.insert(mesh.labels.end(), surface.triangles.size(), Value(object->id));
    const auto append = [](const auto& from, auto* to) {
      to->insert(to->end(), from.begin(), from.end());
    };
    append(surface.vertices, &mesh.vertices);
    append(surface.vertex_color, &mesh.vertex_colors);
    append(surface.vertex_confidence, &mesh.vertex_confidence);
  }
  return mesh;
}

Rendering Render(const FoamObject& foam, const Camera& camera, const Pose& pose, int supersample) {
  constexpr int kMostRays = 8;
  if (supersample < 1 || supersample > kMostRays) {
    throw FieldError("supersample", " is ", supersample, "; it must be from 1 to ", kMostRays, ".");
  }
  const Model& model = foam.model();
  const Similarity& frame = model.world_from_normalized;
  RenderedView view = RenderCamera(foam.Renderer(), camera, pose, frame, supersample);
  Rendering rendering;
  rendering.width = view.width;
  rendering.height = view.height;
  for (const Eigen::Vector3f& color : view.color) {
    rendering.color.insert(rendering.color.end(), color.data(), color.data() + 3);
  }
  rendering.depth = DepthImage(view,
                               MakeCameraRays(camera, pose, frame),
                               pose.UnitRotation().conjugate() * Eigen::Vector3d::UnitZ(),
                               frame.scale);
  for (const ClassIndex c : view.class_index) {
    rendering.label.push_back(Value(LabelIdOf(model.labels, c)));
  }
  rendering.opacity = std::move(view.opacity);
  rendering.confidence = std::move(view.confidence);
  return rendering;
}

Camera CameraFrom(const py::object& object) {
  const py::object model = object.attr("model");
  PhotoRecord record;
  // An enumerator of pycolmap.
  record.camera_model =
      py::str(py::hasattr(model, "name") ? py::object(model.attr("name")) : model);
  record.width = object.attr("width").cast<int>();
  record.height = object.attr("height").cast<int>();
  record.camera_params = object.attr("params").cast<std::vector<double>>();
  return CameraOf(record, "camera");
}

Pose PoseFrom(const py::object& object) {
  const py::object matrix =
      py::hasattr(object, "matrix") ? object.attr("matrix")() : py::object(object);
  const auto array = py::array_t<double, py::array::c_style | py::array::forcecast>::ensure(matrix);
  if (!array) {
    PyErr_Clear();
    throw FieldError("cam_from_world", " is no array of numbers; it must be 3 x 4 or 4 x 4.");
  }
  if (array.ndim() != 2 || array.shape(1) != 4 || (array.shape(0) != 3 && array.shape(0) != 4)) {
    throw FieldError("cam_from_world",
                     " has the shape ",
                     std::string(py::str(array.attr("shape"))),
                     "; it must be 3 x 4 or 4 x 4.");
  }
  const Eigen::Map<const Matrix34> values(array.data());
  const Eigen::Matrix3d rotation = values.leftCols<3>();
  if (!(rotation * rotation.transpose()).isIdentity(1e-6) || !(rotation.determinant() > 0) ||
      !values.allFinite()) {
    throw FieldError("cam_from_world",
                     " is no rotation and translation; its columns must be orthonormal, and a "
                     "finite translation.");
  }
  Pose pose;
  pose.rotation = Eigen::Quaterniond(rotation);
  pose.translation = values.col(3);
  return pose;
}

void AddValues(py::module_* module) {
  AddCells(module);
  AddMesh(module);
  AddObject(module);
  AddViews(module);
}

}  // namespace semfoam::python
