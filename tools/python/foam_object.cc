// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/python/foam_object.h"

#include "export/scene/object_selection.h"
#include "export/scene/object_surface.h"
#include "export/surface/smooth_surface.h"
#include "foam/edit/object_insertion.h"
#include "foam/util/error.h"
#include "plugin/colmap/camera_rays.h"
#include "tools/controllers/chosen_objects.h"
#include "tools/controllers/export_objects.h"
#include "tools/controllers/export_surfaces.h"
#include "tools/controllers/export_volumes.h"
#include "tools/controllers/label_names.h"
#include "tools/evaluation/evaluation.h"
#include "tools/images/view_images.h"
#include "tools/support/value_text.h"

#include <set>
#include <utility>

#include <pybind11/eigen.h>
#include <pybind11/numpy.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

namespace py = pybind11;

namespace semfoam::python {
namespace {

namespace fs = std::filesystem;

// Returns a read-only array that refers to `data`, which `owner` keeps.
template <typename T>
py::array View(const T* data, std::vector<py::ssize_t> shape, const py::object& owner) {
  py::array_t<T> array(std::move(shape), data, owner);
  array.attr("setflags")(py::arg("write") = false);
  return array;
}

// Returns an array that owns the values.
template <typename T>
py::array Owned(std::vector<T> values, std::vector<py::ssize_t> shape) {
  auto* const kept = new std::vector<T>(std::move(values));
  const py::capsule owner(kept, [](void* memory) { delete static_cast<std::vector<T>*>(memory); });
  return py::array_t<T>(std::move(shape), kept->data(), owner);
}

// Labels as a text of the command line, or a list of ids and names.
std::string LabelText(const py::object& labels) {
  if (labels.is_none()) return "";
  if (py::isinstance<py::str>(labels) || py::isinstance<py::int_>(labels)) return py::str(labels);
  std::string text;
  for (const py::handle label : labels) {
    text += (text.empty() ? "" : ",") + std::string(py::str(label));
  }
  return text;
}

// Cells of a foam, which it keeps alive.
struct CellsObject {
  std::shared_ptr<FoamObject> foam;
};

struct ObjectHandle {
  std::shared_ptr<FoamObject> foam;
  size_t index = 0;

  const ObjectInfo& Info() const { return foam->Scene().objects[index]; }
};

struct Rendering {
  int width = 0;
  int height = 0;
  std::vector<float> color, depth, opacity, confidence;
  std::vector<int32_t> label;
};

// A camera as COLMAP has it, from ours or from pycolmap's.
Camera CameraFrom(const py::object& object) {
  const py::object model = object.attr("model");
  const std::string name =
      py::hasattr(model, "name") ? py::str(model.attr("name")) : py::str(model);
  PhotoRecord record;
  record.camera_model = name;
  record.width = object.attr("width").cast<int>();
  record.height = object.attr("height").cast<int>();
  record.camera_params = object.attr("params").cast<std::vector<double>>();
  return CameraOf(record, "camera");
}

// A pose from a 3x4 or 4x4 matrix, or from pycolmap's Rigid3d.
Pose PoseFrom(const py::object& object) {
  const py::object matrix = py::hasattr(object, "matrix") ? object.attr("matrix")() : object;
  const auto values = matrix.cast<Eigen::MatrixXd>();
  if (values.cols() != 4 || (values.rows() != 3 && values.rows() != 4)) {
    throw FieldError("cam_from_world",
                     " has the shape ",
                     values.rows(),
                     " x ",
                     values.cols(),
                     "; it must be 3 x 4 or 4 x 4.");
  }
  const Eigen::Matrix3d rotation = values.topLeftCorner<3, 3>();
  if (!(rotation * rotation.transpose()).isIdentity(1e-6) || rotation.determinant() < 0) {
    throw FieldError("cam_from_world", " is no rotation and translation.");
  }
  Pose pose;
  pose.rotation = Eigen::Quaterniond(rotation);
  pose.translation = values.topRightCorner<3, 1>();
  return pose;
}

Rendering Render(const FoamObject& foam, const Camera& camera, const Pose& pose, int supersample) {
  constexpr int kMostRays = 8;
  if (supersample < 1 || supersample > kMostRays) {
    throw FieldError("supersample", " is ", supersample, "; it must be from 1 to ", kMostRays, ".");
  }
  const Similarity& frame = foam.model().world_from_normalized;
  const RenderedView view = RenderCamera(foam.Renderer(), camera, pose, frame, supersample);
  Rendering rendering{view.width, view.height, {}, {}, view.opacity, view.confidence, {}};
  for (const Eigen::Vector3f& color : view.color) {
    rendering.color.insert(rendering.color.end(), color.data(), color.data() + 3);
  }
  rendering.depth = DepthImage(view,
                               MakeCameraRays(camera, pose, frame),
                               pose.UnitRotation().conjugate() * Eigen::Vector3d::UnitZ(),
                               frame.scale);
  for (const ClassIndex c : view.class_index) {
    rendering.label.push_back(Value(LabelIdOf(foam.model().labels, c)));
  }
  return rendering;
}

const PhotoRecord& PhotoNamed(const FoamObject& foam, const std::string& name) {
  for (const PhotoRecord& photo : foam.model().photos) {
    if (photo.name == name) return photo;
  }
  throw UserError(foam.Name().string(), ": has no photo ", name, "; photos lists them.");
}

py::object Named(const LabelScore& score) {
  py::dict dict;
  dict["iou"] = score.iou;
  dict["recall"] = score.recall;
  dict["boundary_iou"] = score.boundary_iou;
  return dict;
}

py::dict Evaluate(const FoamObject& foam,
                  const fs::path& image_path,
                  const fs::path& truth_path,
                  int supersample) {
  Scores scores;
  {
    const py::gil_scoped_release released;
    const fs::path truth = FindTruth(truth_path, image_path);
    const bool fits_exposure = foam.model().options.contains("exposure");
    scores = ScoreModel(
        foam.model(), foam.Name(), {image_path, truth, fits_exposure, supersample, Device(), {}});
  }
  if (scores.views.empty()) {
    throw UserError(foam.Name().string(),
                    ": no photo was held out of this training, so there is nothing to score it on; "
                    "train with test_every=8.");
  }
  const ViewScore mean = MeanOf(scores.views);
  py::dict result;
  result["psnr"] = mean.psnr;
  result["ssim"] = mean.ssim;
  if (const std::optional<LabelScore> labels = MeanOf(scores.objects, /*direct=*/true)) {
    result["miou"] = labels->iou;
  }
  py::dict views;
  for (const ViewScore& view : scores.views) {
    py::dict one;
    one["psnr"] = view.psnr;
    one["ssim"] = view.ssim;
    views[py::str(view.name)] = one;
  }
  result["views"] = views;
  py::dict objects;
  for (const auto& [name, score] : scores.objects) {
    if (score.direct) objects[py::str(name)] = Named(*score.direct);
  }
  result["objects"] = objects;
  return result;
}

std::shared_ptr<FoamObject> Extract(const FoamObject& foam, const std::string& labels) {
  const ChosenObjects chosen = ChooseObjects(foam.model(), {labels, ""}, foam.Name());
  return std::make_shared<FoamObject>(
      ExtractObjects(foam.model(), chosen.delaunay, chosen.objects).model, fs::path());
}

std::shared_ptr<FoamObject> Remove(const FoamObject& foam, const std::string& labels) {
  const ChosenObjects chosen = ChooseObjects(foam.model(), {labels, ""}, foam.Name());
  return std::make_shared<FoamObject>(
      RemoveObjects(
          foam.model(), chosen.delaunay, chosen.cell_labels, chosen.is_in_object, chosen.objects),
      fs::path());
}

std::shared_ptr<FoamObject> Insert(const FoamObject& scene,
                                   const FoamObject& source,
                                   const std::string& labels,
                                   double scale,
                                   const Eigen::Matrix3d& rotation,
                                   const Eigen::Vector3d& translation) {
  if (!(scale > 0)) throw FieldError("scale", " is ", scale, "; it must be greater than 0.");
  if (!(rotation * rotation.transpose()).isIdentity(1e-6) || rotation.determinant() < 0) {
    throw FieldError("rotation", " is no rotation; it must be orthonormal.");
  }
  const ChosenObjects chosen = ChooseObjects(source.model(), {labels, ""}, source.Name());
  const ExtractedObjects objects = ExtractObjects(source.model(), chosen.delaunay, chosen.objects);
  return std::make_shared<FoamObject>(
      InsertObjects(scene.model(),
                    scene.Renderer().delaunay(),
                    PlaceObjects(objects, {scale, rotation, translation}, scene.model()))
          .model,
      fs::path());
}

ObjectSurface MakeMesh(const ObjectHandle& object, const std::string& method) {
  const std::optional<SurfaceMethod> parsed = ParseEnum(kSurfaceMethodNames, method);
  if (!parsed) throw FieldError("method", " is '", method, "'; it must be cells or smooth.");
  const ExportableScene& scene = object.foam->Scene();
  ObjectSurface cells = ExtractSurface(scene, object.Info());
  if (*parsed == SurfaceMethod::kCells) return cells;
  return ExtractSmoothSurface(scene, object.Info(), cells);
}

std::vector<std::string> Paths(const std::vector<WrittenFile>& files) {
  std::vector<std::string> paths;
  for (const WrittenFile& file : files) paths.push_back(file.path);
  return paths;
}

std::vector<std::string> ExportMeshes(const FoamObject& foam,
                                      const fs::path& output_path,
                                      const std::set<std::string>& formats,
                                      const std::string& labels,
                                      const std::string& method) {
  const std::optional<SurfaceMethod> parsed = ParseEnum(kSurfaceMethodNames, method);
  if (!parsed) throw FieldError("method", " is '", method, "'; it must be cells or smooth.");
  std::set<ExportFormat> wanted;
  for (const std::string& format : formats) {
    const std::optional<ExportFormat> value = ParseEnum(kExportFormatNames, format);
    if (!value || *value == ExportFormat::kVdb) {
      throw FieldError(
          "formats", " holds '", format, "'; it takes any of om, ply, obj, glb and usda.");
    }
    wanted.insert(*value);
  }
  SurfaceExportOptions options;
  options.method = *parsed;
  options.objects = FilterObjects(foam.Scene(), {labels, ""});
  return Paths(WriteMeshes(foam.Scene(), output_path, wanted, options));
}

std::vector<std::string> ExportVolumes(const FoamObject& foam,
                                       const fs::path& output_path,
                                       const std::string& labels,
                                       double voxel_size,
                                       int max_resolution) {
  VolumeExportOptions options;
  options.voxel_size = voxel_size;
  options.max_resolution = max_resolution;
  if (const std::string wrong = options.Check(); !wrong.empty()) throw UserError(wrong);
  options.objects = FilterObjects(foam.Scene(), {labels, ""});
  return Paths(WriteVolumes(foam.Scene(), output_path, options));
}

}  // namespace

FoamObject::FoamObject(Model model, fs::path path)
    : model_(std::move(model)), path_(std::move(path)) {}

std::shared_ptr<FoamObject> FoamObject::Load(const std::string& path) {
  const py::gil_scoped_release released;
  return std::make_shared<FoamObject>(ReadNamedModel(path), path);
}

fs::path FoamObject::Name() const { return path_.empty() ? "the foam" : path_; }

const ExportableScene& FoamObject::Scene() const {
  std::call_once(scene_is_made_, [this] {
    scene_ = std::make_unique<const ExportableScene>(PrepareExport(model_, Name()));
  });
  return *scene_;
}

const ViewRenderer& FoamObject::Renderer() const {
  std::call_once(renderer_is_made_,
                 [this] { renderer_ = std::make_unique<const ViewRenderer>(model_.foam); });
  return *renderer_;
}

const CellArrays& FoamObject::Cells() const {
  std::call_once(cells_are_made_, [this] {
    const ExportableScene& scene = Scene();
    const Similarity& frame = model_.world_from_normalized;
    auto cells = std::make_unique<CellArrays>();
    for (uint32_t i = 0; i < scene.NumSites(); ++i) {
      cells->positions.push_back(frame.Apply(model_.foam.positions[i].cast<double>()));
      cells->density.push_back(static_cast<float>(scene.density[i] / frame.scale));
      cells->volume.push_back(scene.volume[i] * frame.scale * frame.scale * frame.scale);
      cells->label.push_back(Value(scene.label_id[i]));
      cells->object.push_back(Value(scene.ObjectId(i)));
    }
    cells_ = std::move(cells);
  });
  return *cells_;
}

void AddFoam(py::module_* module) {
  py::class_<FoamObject, std::shared_ptr<FoamObject>> foam(
      *module, "Foam", "A foam: an immutable scene.foam. Edits return new ones.");
  py::class_<CellsObject>(
      *module,
      "Cells",
      "The N cells of a foam as read-only arrays that share its memory; lengths "
      "in units of the COLMAP model, in its frame.")
      .def("__len__", [](const CellsObject& c) { return c.foam->model().foam.NumSites(); })
      .def_property_readonly(
          "positions",
          [](const py::object& self) {
            const auto& cells = self.cast<const CellsObject&>().foam->Cells().positions;
            return View(cells.data()->data(), {py::ssize_t(cells.size()), 3}, self);
          },
          "(N, 3) float64, the sites.")
      .def_property_readonly(
          "density",
          [](const py::object& self) {
            const auto& cells = self.cast<const CellsObject&>().foam->Cells().density;
            return View(cells.data(), {py::ssize_t(cells.size())}, self);
          },
          "(N,) float32, per unit of length.")
      .def_property_readonly(
          "volume",
          [](const py::object& self) {
            const auto& cells = self.cast<const CellsObject&>().foam->Cells().volume;
            return View(cells.data(), {py::ssize_t(cells.size())}, self);
          },
          "(N,) float64.")
      .def_property_readonly(
          "label",
          [](const py::object& self) {
            const auto& cells = self.cast<const CellsObject&>().foam->Cells().label;
            return View(cells.data(), {py::ssize_t(cells.size())}, self);
          },
          "(N,) int32, ids of the cells' own labels; 0 = none.")
      .def_property_readonly(
          "object",
          [](const py::object& self) {
            const auto& cells = self.cast<const CellsObject&>().foam->Cells().object;
            return View(cells.data(), {py::ssize_t(cells.size())}, self);
          },
          "(N,) int32, ids of the objects that the cells are part of; 0 = none.")
      .def_property_readonly(
          "confidence",
          [](const py::object& self) {
            const auto& cells = self.cast<const CellsObject&>().foam->Scene().labels.confidence;
            return View(cells.data(), {py::ssize_t(cells.size())}, self);
          },
          "(N,) float32, 0 to 1: softmax of the label.")
      .def_property_readonly(
          "color",
          [](const py::object& self) {
            const auto& cells = self.cast<const CellsObject&>().foam->Scene().display_color;
            return View(cells.data()->data(), {py::ssize_t(cells.size()), 3}, self);
          },
          "(N, 3) float32, 0 to 1: colours in the photos (sRGB).")
      .def_property_readonly(
          "solid",
          [](const py::object& self) {
            const auto& cells = self.cast<const CellsObject&>().foam->Scene().labels.solid;
            return View(cells.data(), {py::ssize_t(cells.size())}, self);
          },
          "(N,) uint8, 1 = matter, 0 = air.")
      .def_property_readonly(
          "neighbor_offsets",
          [](const py::object& self) {
            const auto& c = self.cast<const CellsObject&>();
            const auto& offsets = c.foam->Scene().delaunay.offsets;
            return View(offsets.data(), {py::ssize_t(c.foam->model().foam.NumSites()) + 1}, self);
          },
          "(N + 1,) uint32: the neighbours of cell i are neighbors[offsets[i]:offsets[i + 1]].")
      .def_property_readonly(
          "neighbors",
          [](const py::object& self) {
            const auto& c = self.cast<const CellsObject&>();
            const Delaunay& delaunay = c.foam->Scene().delaunay;
            return View(delaunay.neighbors.data(),
                        {py::ssize_t(delaunay.offsets[c.foam->model().foam.NumSites()])},
                        self);
          },
          "uint32, indices of cells; those from N on are guards around the scene.");

  py::class_<ObjectSurface>(*module, "Mesh", "A closed surface in the frame of the COLMAP model.")
      .def_property_readonly("label", [](const ObjectSurface& m) { return Value(m.object_id); })
      .def_readonly("name", &ObjectSurface::object_name)
      .def_property_readonly(
          "vertices",
          [](const py::object& self) {
            const auto& m = self.cast<const ObjectSurface&>();
            return View(m.vertices.data()->data(), {py::ssize_t(m.vertices.size()), 3}, self);
          },
          "(V, 3) float64.")
      .def_property_readonly(
          "faces",
          [](const py::object& self) {
            const auto& m = self.cast<const ObjectSurface&>();
            return View(m.triangles.data()->data(), {py::ssize_t(m.triangles.size()), 3}, self);
          },
          "(F, 3) uint32, counter-clockwise seen from outside.")
      .def_property_readonly(
          "vertex_colors",
          [](const py::object& self) {
            const auto& m = self.cast<const ObjectSurface&>();
            return View(
                m.vertex_color.data()->data(), {py::ssize_t(m.vertex_color.size()), 3}, self);
          },
          "(V, 3) uint8, display values.")
      .def_property_readonly(
          "vertex_confidence",
          [](const py::object& self) {
            const auto& m = self.cast<const ObjectSurface&>();
            return View(
                m.vertex_confidence.data(), {py::ssize_t(m.vertex_confidence.size())}, self);
          },
          "(V,) float32, 0 to 1.");

  py::class_<ObjectHandle>(*module, "Object", "An object of a foam, as the exporters write it.")
      .def_property_readonly("id", [](const ObjectHandle& o) { return Value(o.Info().id); })
      .def_property_readonly("name", [](const ObjectHandle& o) { return o.Info().name; })
      .def_property_readonly("volume", [](const ObjectHandle& o) { return o.Info().volume; })
      .def_property_readonly("area", [](const ObjectHandle& o) { return o.Info().area; })
      .def_property_readonly("confidence",
                             [](const ObjectHandle& o) { return o.Info().confidence; })
      .def_property_readonly("genus", [](const ObjectHandle& o) { return o.Info().genus; })
      .def_property_readonly(
          "centroid", [](const ObjectHandle& o) -> Eigen::Vector3d { return o.Info().centroid; })
      .def_property_readonly(
          "bounding_box",
          [](const ObjectHandle& o) -> Eigen::Matrix<double, 2, 3, Eigen::RowMajor> {
            Eigen::Matrix<double, 2, 3, Eigen::RowMajor> box;
            box << o.Info().bounding_box.min().transpose(), o.Info().bounding_box.max().transpose();
            return box;
          },
          "(2, 3) float64: the smallest and the largest corner.")
      .def_property_readonly(
          "cells",
          [](const py::object& self) {
            const auto& cells = self.cast<const ObjectHandle&>().Info().cells;
            return View(cells.data(), {py::ssize_t(cells.size())}, self);
          },
          "(n,) uint32, indices of its cells, ascending.")
      .def("mesh",
           &MakeMesh,
           py::arg("method") = "cells",
           py::call_guard<py::gil_scoped_release>(),
           "Returns its surface: method 'cells' = the exact faces of the cells, 'smooth' = "
           "smoothed.")
      .def("__repr__", [](const ObjectHandle& o) {
        return "<semfoam.Object " + o.Info().name + " (" + std::to_string(Value(o.Info().id)) +
               ")>";
      });

  py::class_<PhotoRecord>(*module, "Photo", "A photo of the training and its camera, as in COLMAP.")
      .def_readonly("name", &PhotoRecord::name)
      .def_readonly("model", &PhotoRecord::camera_model, "COLMAP's camera model, 'PINHOLE'.")
      .def_readonly("width", &PhotoRecord::width)
      .def_readonly("height", &PhotoRecord::height)
      .def_readonly("params", &PhotoRecord::camera_params)
      .def_readonly("held_out", &PhotoRecord::held_out)
      .def_property_readonly(
          "cam_from_world",
          [](const PhotoRecord& photo) {
            Eigen::Matrix<double, 3, 4, Eigen::RowMajor> matrix;
            matrix << photo.cam_from_world_rotation.toRotationMatrix(),
                photo.cam_from_world_translation;
            return matrix;
          },
          "(3, 4) float64: x_cam = R x_world + t.");

  py::class_<Rendering>(*module, "Rendering", "A rendered view; arrays are (height, width).")
      .def_property_readonly(
          "color",
          [](const py::object& self) {
            const auto& r = self.cast<const Rendering&>();
            return View(r.color.data(), {r.height, r.width, 3}, self);
          },
          "(height, width, 3) float32, display values over white, 0 to 1 but not clipped.")
      .def_property_readonly(
          "label",
          [](const py::object& self) {
            const auto& r = self.cast<const Rendering&>();
            return View(r.label.data(), {r.height, r.width}, self);
          },
          "int32, ids; 0 = none.")
      .def_property_readonly(
          "depth",
          [](const py::object& self) {
            const auto& r = self.cast<const Rendering&>();
            return View(r.depth.data(), {r.height, r.width}, self);
          },
          "float32, along the camera's z in units of the COLMAP model, where the transmittance is "
          "1/2; 0 = nothing.")
      .def_property_readonly(
          "opacity",
          [](const py::object& self) {
            const auto& r = self.cast<const Rendering&>();
            return View(r.opacity.data(), {r.height, r.width}, self);
          },
          "float32, 0 to 1.")
      .def_property_readonly(
          "confidence",
          [](const py::object& self) {
            const auto& r = self.cast<const Rendering&>();
            return View(r.confidence.data(), {r.height, r.width}, self);
          },
          "float32, 0 to 1: softmax of the label.");

  foam.def_property_readonly("num_cells",
                             [](const FoamObject& f) { return f.model().foam.NumSites(); })
      .def_property_readonly("sh_degree",
                             [](const FoamObject& f) { return f.model().foam.sh_degree; })
      .def_property_readonly(
          "labels",
          [](const FoamObject& f) {
            py::dict labels;
            for (const Label& label : f.model().labels) {
              labels[py::int_(Value(label.id))] = label.name;
            }
            return labels;
          },
          "Names by id.")
      .def_property_readonly("options", [](const FoamObject& f) { return f.model().options; })
      .def_property_readonly("photos", [](const FoamObject& f) { return f.model().photos; })
      .def_property_readonly("cells", [](std::shared_ptr<FoamObject> f) { return CellsObject{f}; })
      .def_property_readonly(
          "objects",
          [](std::shared_ptr<FoamObject> f) {
            size_t count = 0;
            {
              const py::gil_scoped_release released;
              count = f->Scene().objects.size();
            }
            std::vector<ObjectHandle> objects;
            for (size_t i = 0; i < count; ++i) objects.push_back({f, i});
            return objects;
          },
          "The objects, by ascending id.")
      .def(
          "save",
          [](const FoamObject& f, const fs::path& path) { WriteModel(path, f.model()); },
          py::arg("path"),
          py::call_guard<py::gil_scoped_release>(),
          "Writes the foam; a file that is there is replaced.")
      .def(
          "render",
          [](const FoamObject& f,
             const py::object& camera,
             const py::object& cam_from_world,
             int supersample) {
            Camera parsed;
            Pose pose;
            if (py::isinstance<py::str>(camera)) {
              const PhotoRecord& photo = PhotoNamed(f, camera.cast<std::string>());
              parsed = CameraOf(photo, f.Name());
              pose = PoseOf(photo);
            } else {
              parsed = CameraFrom(camera);
              pose = PoseFrom(cam_from_world);
            }
            const py::gil_scoped_release released;
            return Render(f, parsed, pose, supersample);
          },
          py::arg("camera"),
          py::arg("cam_from_world") = py::none(),
          py::arg("supersample") = kDefaultSupersample,
          "Renders a view: of a photo, by its name; or of any camera with model, width, height and "
          "params (a Photo, pycolmap.Camera) at a pose, a 3x4 matrix or pycolmap.Rigid3d. "
          "supersample x supersample rays a pixel.")
      .def("evaluate",
           &Evaluate,
           py::arg("image_path"),
           py::arg("truth_path") = fs::path(),
           py::arg("supersample") = kDefaultSupersample,
           "Scores the foam on held-out photos: a dict of psnr (dB), ssim, views and, with exact "
           "masks, miou and objects.")
      .def(
          "extract",
          [](const FoamObject& f, const py::object& labels) {
            const std::string text = LabelText(labels);
            const py::gil_scoped_release released;
            return Extract(f, text);
          },
          py::arg("labels"),
          "Returns a foam of these objects alone: ids or names.")
      .def(
          "remove",
          [](const FoamObject& f, const py::object& labels) {
            const std::string text = LabelText(labels);
            const py::gil_scoped_release released;
            return Remove(f, text);
          },
          py::arg("labels"),
          "Returns the foam without these objects.")
      .def(
          "insert",
          [](const FoamObject& f,
             const FoamObject& other,
             const py::object& labels,
             double scale,
             const Eigen::Matrix3d& rotation,
             const Eigen::Vector3d& translation) {
            const std::string text = LabelText(labels);
            const py::gil_scoped_release released;
            return Insert(f, other, text, scale, rotation, translation);
          },
          py::arg("other"),
          py::arg("labels") = py::none(),
          py::arg("scale") = 1.0,
          py::arg("rotation") = Eigen::Matrix3d::Identity().eval(),
          py::arg("translation") = Eigen::Vector3d::Zero().eval(),
          "Returns the foam with objects of another: x = scale * rotation @ x_other + translation "
          "in the COLMAP frames.")
      .def(
          "export_meshes",
          [](const FoamObject& f,
             const fs::path& output_path,
             const std::set<std::string>& formats,
             const py::object& labels,
             const std::string& method) {
            const std::string text = LabelText(labels);
            const py::gil_scoped_release released;
            return ExportMeshes(f, output_path, formats, text, method);
          },
          py::arg("output_path"),
          py::arg("formats") = std::set<std::string>{"om", "ply", "obj", "glb", "usda"},
          py::arg("labels") = py::none(),
          py::arg("method") = "cells",
          "Writes the objects' surfaces and returns the files, relative to output_path.")
      .def(
          "export_volumes",
          [](const FoamObject& f,
             const fs::path& output_path,
             const py::object& labels,
             double voxel_size,
             int max_resolution) {
            const std::string text = LabelText(labels);
            const py::gil_scoped_release released;
            return ExportVolumes(f, output_path, text, voxel_size, max_resolution);
          },
          py::arg("output_path"),
          py::arg("labels") = py::none(),
          py::arg("voxel_size") = 0.0,
          py::arg("max_resolution") = VolumeExportOptions().max_resolution,
          "Writes scene.vdb and the objects' volumes and returns the files.")
      .def("__repr__", [](const FoamObject& f) {
        return "<semfoam.Foam of " + std::to_string(f.model().foam.NumSites()) + " cells>";
      });

  module->def(
      "load",
      [](const fs::path& path) { return FoamObject::Load(path.string()); },
      py::arg("path"),
      "Reads a scene.foam. Raises Error.");
}

}  // namespace semfoam::python
