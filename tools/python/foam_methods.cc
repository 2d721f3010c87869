// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/python/foam_methods.h"

#include "export/scene/object_selection.h"
#include "export/transfer/label_source.h"
#include "foam/edit/object_insertion.h"
#include "foam/util/error.h"
#include "foam/util/ply_reader.h"
#include "plugin/colmap/camera_rays.h"
#include "tools/cli/input_protection.h"
#include "tools/controllers/chosen_objects.h"
#include "tools/controllers/effects_report.h"
#include "tools/controllers/export_format.h"
#include "tools/controllers/export_objects.h"
#include "tools/controllers/export_record.h"
#include "tools/controllers/export_surfaces.h"
#include "tools/controllers/export_volumes.h"
#include "tools/controllers/labelled_files.h"
#include "tools/controllers/mask_labels.h"
#include "tools/controllers/shape_labels.h"
#include "tools/evaluation/evaluation.h"
#include "tools/masks/rendered_masks.h"
#include "tools/python/conversions.h"
#include "tools/python/foam_object.h"
#include "tools/python/values.h"
#include "tools/support/output_lock.h"

#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <pybind11/eigen.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

namespace py = pybind11;

namespace semfoam::python {
namespace {

namespace fs = std::filesystem;

PhotoRecord PhotoNamed(const FoamObject& foam, const std::string& name) {
  for (const PhotoRecord& photo : foam.model().photos) {
    if (photo.name == name) return photo;
  }
  throw UserError(foam.Name().string(), ": has no photo ", name, "; its photos would be right.");
}

Rendering RenderView(const FoamObject& foam,
                     const py::object& camera,
                     const py::object& cam_from_world,
                     int supersample) {
  if (!py::isinstance<py::str>(camera)) {
    const Camera any = CameraFrom(camera);
    const Pose pose = PoseFrom(cam_from_world);
    return WithoutGil([&] { return Render(foam, any, pose, supersample); });
  }
  const PhotoRecord photo = PhotoNamed(foam, camera.cast<std::string>());
  if (!cam_from_world.is_none()) {
    throw UserError(
        "cam_from_world is given with a photo, which has a pose; a camera of a photo "
        "would be right.");
  }
  return WithoutGil(
      [&] { return Render(foam, CameraOf(photo, foam.Name()), PoseOf(photo), supersample); });
}

py::dict Dict(const LabelScore& score) {
  py::dict dict;
  dict["iou"] = score.iou;
  dict["recall"] = score.recall;
  dict["boundary_iou"] = score.boundary_iou;
  return dict;
}

py::dict Evaluate(const FoamObject& foam,
                  const fs::path& image_path,
                  const std::optional<fs::path>& truth_path,
                  int supersample) {
  const Scores scores = WithoutGil([&] {
    const fs::path truth = FindTruth(truth_path.value_or(fs::path()), image_path);
    std::optional<ExpectedLights> lights;
    if (fs::exists(foam.Name())) lights = FindExpectedLights(foam.Name(), foam.model());
    return ScoreModel(foam.model(),
                      foam.Name(),
                      {image_path,
                       truth,
                       AdaptsLight(foam.model()),
                       supersample,
                       Device(),
                       /*photos=*/{},
                       lights ? &*lights : nullptr});
  });
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
    if (score.direct) objects[py::str(name)] = Dict(*score.direct);
  }
  result["objects"] = objects;
  return result;
}

std::shared_ptr<FoamObject> Edited(Model model) {
  return std::make_shared<FoamObject>(std::move(model), fs::path());
}

std::shared_ptr<FoamObject> Extract(const FoamObject& foam, const std::string& labels) {
  const ChosenObjects chosen = ChooseObjects(foam.model(), LabelChoice{labels}, foam.Name());
  return Edited(ExtractObjects(foam.model(), chosen.delaunay, chosen.objects).model);
}

std::shared_ptr<FoamObject> Remove(const FoamObject& foam, const std::string& labels) {
  const ChosenObjects chosen = ChooseObjects(foam.model(), LabelChoice{labels}, foam.Name());
  return Edited(RemoveObjects(
      foam.model(), chosen.delaunay, chosen.cell_labels, chosen.is_in_object, chosen.objects));
}

std::shared_ptr<FoamObject> Insert(const FoamObject& scene,
                                   const FoamObject& source,
                                   const std::string& labels,
                                   const ObjectPlacement& placement) {
  if (!(placement.scale > 0)) {
    throw FieldError("scale", " is ", placement.scale, "; it must be greater than 0.");
  }
  const Eigen::Matrix3d& rotation = placement.rotation;
  if (!(rotation * rotation.transpose()).isIdentity(1e-6) || !(rotation.determinant() > 0)) {
    throw FieldError("rotation", " is no rotation; its columns must be orthonormal.");
  }
  const ChosenObjects chosen = ChooseObjects(source.model(), LabelChoice{labels}, source.Name());
  const ExtractedObjects objects = ExtractObjects(source.model(), chosen.delaunay, chosen.objects);
  return Edited(InsertObjects(scene.model(),
                              scene.Renderer().delaunay(),
                              PlaceObjects(objects, placement, scene.model()))
                    .model);
}

std::shared_ptr<FoamObject> LabelledByShape(const FoamObject& foam, double granularity) {
  Model model = foam.model();
  LabelByShape(granularity, foam.Name(), &model);
  return Edited(std::move(model));
}

std::shared_ptr<FoamObject> LabelledByMasks(const FoamObject& foam,
                                            const fs::path& image_path,
                                            const fs::path& input_path,
                                            const fs::path& mask_path,
                                            const std::optional<fs::path>& labels_path) {
  SceneOptions options;
  options.image_path = image_path;
  options.input_path = input_path;
  options.mask_path = mask_path;
  options.labels_path = labels_path.value_or("");
  TakeTrainingOptions(foam.model(), &options);
  options.mask_consistency = MaskConsistency::kAuto;  // Of these masks, not of the training's.
  Model model = foam.model();
  LabelByMasks(foam.Name(), options, {}, fs::temp_directory_path(), &model);
  return Edited(std::move(model));
}

// Calls `write`, which writes files of these formats into `output_path`, as the commands of the
// program do: one writer at a time, files of one foam, and labels.json, which lists them. Returns
// the paths of the files.
template <typename Write>
std::vector<std::string> Export(const FoamObject& foam,
                                const fs::path& output_path,
                                const std::set<ExportFormat>& formats,
                                const Write& write) {
  const OutputLock lock(output_path);
  RequireSameFoam(output_path, foam.Checksum());
  const ExportableScene& scene = foam.Scene();
  RequireOneFrame(scene.transform, output_path, formats, foam.Checksum());
  const std::vector<WrittenFile> files = write(scene);
  WriteLabels(scene, output_path, {foam.Checksum(), files});
  std::vector<std::string> paths;
  for (const WrittenFile& file : files) paths.push_back(file.path);
  return paths;
}

std::vector<std::string> ExportMeshes(const FoamObject& foam,
                                      const fs::path& output_path,
                                      const std::vector<std::string>& formats,
                                      const std::string& labels,
                                      const std::string& method) {
  const std::optional<SurfaceMethod> parsed = ParseEnum(kSurfaceMethodNames, method);
  if (!parsed) throw FieldError("method", " is '", method, "'; it must be cells or smooth.");
  std::set<ExportFormat> wanted;
  for (const std::string& format : formats) {
    const std::optional<ExportFormat> value = ParseEnum(kExportFormatNames, format);
    if (!value || *value == ExportFormat::kVdb) {
      throw FieldError(
          "formats", " holds '", format, "'; it must hold any of om, ply, obj, glb and usda.");
    }
    wanted.insert(*value);
  }
  return Export(foam, output_path, wanted, [&](const ExportableScene& scene) {
    RequireObjects(scene, foam.Name());
    SurfaceExportOptions options;
    options.method = *parsed;
    options.source_checksum = foam.Checksum();
    options.objects = FilterObjects(scene, LabelChoice{labels});
    return WriteMeshes(scene, output_path, wanted, options);
  });
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
  return Export(foam, output_path, {ExportFormat::kVdb}, [&](const ExportableScene& scene) {
    options.source_checksum = foam.Checksum();
    options.objects = FilterObjects(scene, LabelChoice{labels});
    return WriteVolumes(scene, output_path, options);
  });
}

py::list TransferLabelsTo(const FoamObject& foam, const LabelledFiles& files) {
  const TransferredLabels transferred = WithoutGil([&] {
    files.options.RequireValid();
    // Before any work, what cannot be labelled.
    CheckNoInputOverwrite({files.input}, {LabelledFile(files), files.output_path / "labels.json"});
    const OutputLock lock(files.output_path);
    RequireRoomForLabelled(files);
    const ExportableScene& scene = foam.Scene();
    RequireObjects(scene, foam.Name());
    FoamLabels source(scene, files.options.tolerance);
    return WriteLabelled(&source, files, foam.Checksum());
  });
  py::list labels;
  for (const TransferredLabel& label : transferred.labels) {
    py::dict one;
    one["id"] = Value(label.id);
    one["name"] = label.name;
    one["vertices"] = label.vertices;
    one["faces"] = label.faces;
    one["area"] = label.area;
    one["confidence"] = label.confidence;
    labels.append(one);
  }
  return labels;
}

void RenderMasks(const FoamObject& foam, const fs::path& output_path, const std::string& format) {
  const std::optional<MaskOutput> output = ParseEnum(kMaskOutputNames, format);
  if (!output) throw FieldError("format", " is '", format, "'; it must be png, palette or coco.");
  RequireMaskedPhotos(foam.model(), foam.Name());
  const OutputLock lock(output_path);
  WriteRenderedMasks(foam.model(), foam.Name(), foam.Renderer(), *output, output_path);
}

void AddProperties(py::class_<FoamObject, std::shared_ptr<FoamObject>>* foam) {
  foam->def_property_readonly(
          "num_cells",
          [](const FoamObject& f) { return f.model().foam.NumSites(); },
          "Number of cells.")
      .def_property_readonly(
          "sh_degree",
          [](const FoamObject& f) { return f.model().foam.sh_degree; },
          "Degree of the view-dependent colour, 0 to 3.")
      .def_property_readonly(
          "labels",
          [](const FoamObject& f) {
            py::dict labels;
            for (const Label& label : f.model().labels) {
              labels[py::int_(Value(label.id))] = label.name;
            }
            return labels;
          },
          "Names by id; '' = no name.")
      .def_property_readonly(
          "options",
          [](const FoamObject& f) { return f.model().options; },
          "What the training was asked for, as texts by name.")
      .def_property_readonly(
          "photos",
          [](const FoamObject& f) { return f.model().photos; },
          "The photos of the training, by name.")
      .def_property_readonly(
          "cells",
          [](const std::shared_ptr<FoamObject>& f) { return CellsObject{f}; },
          "The cells, as arrays.")
      .def_property_readonly(
          "objects",
          [](const std::shared_ptr<FoamObject>& f) {
            const size_t count = WithoutGil([&] { return f->Scene().objects.size(); });
            std::vector<ObjectHandle> objects;
            for (size_t i = 0; i < count; ++i) objects.push_back({f, i});
            return objects;
          },
          "The objects, by ascending id. The first access takes seconds for a million cells.")
      .def("__repr__", [](const FoamObject& f) {
        return "<semfoam.Foam of " + std::to_string(f.model().foam.NumSites()) + " cells>";
      });
}

void AddViewing(py::class_<FoamObject, std::shared_ptr<FoamObject>>* foam) {
  foam->def(
          "render",
          &RenderView,
          py::arg("camera"),
          py::arg("cam_from_world") = py::none(),
          py::arg("supersample") = kDefaultSupersample,
          "Renders a view: of a photo, by its name; or of any camera with model, width, height "
          "and params (a Camera, pycolmap.Camera) at a pose, a 3x4 matrix or what has matrix() "
          "(pycolmap.Rigid3d). supersample x supersample rays a pixel, 1 to 8. Colours are in the "
          "reference exposure. Runs without the GIL. Raises Error.")
      .def("evaluate",
           &Evaluate,
           py::arg("image_path"),
           py::arg("truth_path") = py::none(),
           py::arg("supersample") = kDefaultSupersample,
           "Scores the foam on its held-out photos in image_path, without the GIL. Returns a dict: "
           "psnr (dB), ssim, views (the same by photo) and, with exact masks "
           "(truth_path/<object>/<photo>.png, by default segmentation_labels/masks/ beside the "
           "photos), miou and objects (iou, recall, boundary_iou by name). Raises Error.")
      .def(
          "mesh",
          [](const FoamObject& f, const py::object& labels, const std::string& method) {
            const std::string text = LabelText(labels, f.model());
            return WithoutGil([&] {
              const ExportableScene& scene = f.Scene();
              return MakeMesh(scene, SelectObjects(scene, LabelChoice{text}), method);
            });
          },
          py::arg("labels") = py::none(),
          py::arg("method") = "cells",
          "Returns the surfaces of objects (ids or names; None = all) as one Mesh with a label for "
          "each face. method 'cells' = the faces of the cells, exact; 'smooth' = smoothed. Runs "
          "without the GIL. Raises Error.");
}

void AddEdits(py::class_<FoamObject, std::shared_ptr<FoamObject>>* foam) {
  foam->def(
          "extract",
          [](const FoamObject& f, const py::object& labels) {
            const std::string text = LabelText(labels, f.model());
            return WithoutGil([&] { return Extract(f, text); });
          },
          py::arg("labels"),
          "Returns a foam of these objects (ids or names) alone. Raises Error.")
      .def(
          "remove",
          [](const FoamObject& f, const py::object& labels) {
            const std::string text = LabelText(labels, f.model());
            return WithoutGil([&] { return Remove(f, text); });
          },
          py::arg("labels"),
          "Returns the foam without these objects (ids or names). Raises Error.")
      .def(
          "insert",
          [](const FoamObject& f,
             const FoamObject& other,
             const py::object& labels,
             double scale,
             const Eigen::Matrix3d& rotation,
             const Eigen::Vector3d& translation) {
            const std::string text = LabelText(labels, other.model());
            return WithoutGil([&] {
              return Insert(f, other, text, {scale, rotation, translation});
            });
          },
          py::arg("other"),
          py::arg("labels") = py::none(),
          py::arg("scale") = 1.0,
          py::arg("rotation") = Eigen::Matrix3d::Identity().eval(),
          py::arg("translation") = Eigen::Vector3d::Zero().eval(),
          "Returns the foam with objects (ids or names; None = all) of another: x = scale * "
          "rotation @ x_other + translation in the frames of the COLMAP models. Raises Error.")
      .def("label_by_shape",
           &LabelledByShape,
           py::arg("granularity") = 0.5,
           py::call_guard<py::gil_scoped_release>(),
           "Returns the foam, trained without masks, with labels by the shape of its surfaces, as "
           "`semfoam scene_segmenter` does: plane_1, plane_2, ... such as table tops, floors and "
           "walls, then thing_1, thing_2, ..., by what photos show of them, with the ids 1, 2, ... "
           "Labels that are there are replaced. granularity, 0 to 1: how finely to cut. "
           "Experimental. Runs without the GIL. Raises Error.")
      .def("label_by_masks",
           &LabelledByMasks,
           py::arg("image_path"),
           py::arg("input_path"),
           py::arg("mask_path"),
           py::arg("labels_path") = py::none(),
           py::call_guard<py::gil_scoped_release>(),
           "Returns the foam with the labels of masks of some of its photos, as `semfoam "
           "foam_labeler` does, without training again. image_path and input_path: the photos and "
           "the COLMAP model that it was trained on; mask_path: masks in any format that "
           "mask_importer reads, clicks too; labels_path: their names (None: labels.json beside "
           "the masks). Labels that are there are replaced; masks of held-out photos are not used. "
           "Runs without the GIL. Raises Error.");
}

void AddFiles(py::class_<FoamObject, std::shared_ptr<FoamObject>>* foam) {
  foam->def(
          "save",
          [](const FoamObject& f, const fs::path& path) { WriteModel(path, f.model()); },
          py::arg("path"),
          py::call_guard<py::gil_scoped_release>(),
          "Writes a scene.foam. A file that is there is replaced. Raises Error.")
      .def(
          "label_transfer",
          [](const FoamObject& f,
             const fs::path& input_path,
             const fs::path& output_path,
             bool split,
             double tolerance,
             double smoothness,
             bool cap) {
            return TransferLabelsTo(f,
                                    {input_path, output_path, {tolerance, smoothness, split, cap}});
          },
          py::arg("input_path"),
          py::arg("output_path"),
          py::arg("split") = false,
          py::arg("tolerance") = LabelTransferOptions().tolerance,
          py::arg("smoothness") = LabelTransferOptions().smoothness,
          py::arg("cap") = false,
          "Labels a mesh or point cloud that another program made of the same photos, as "
          "`semfoam label_transfer` does: writes it, with its name, and labels.json into the "
          "folder output_path, with split also each object as a file of its own in objects/, with "
          "its boundaries closed by cap. "
          "tolerance, in units of the file: matter farther away does not count; 0 = by the scene. "
          "smoothness, in units of the file, of borders on meshes; -1 = by the cells. Returns a "
          "list of dicts: id (0 = no label), name, vertices, faces, area, confidence. Runs "
          "without the GIL. Raises Error.")
      .def(
          "render_masks",
          &RenderMasks,
          py::arg("output_path"),
          py::arg("format") = "png",
          py::call_guard<py::gil_scoped_release>(),
          "Renders the masks of all photos of the training, corrected, with the same ids in all of "
          "them, and writes them into the folder output_path, which is made if missing, as "
          "`semfoam mask_renderer` does: format 'png' = 16-bit PNGs of ids, 'palette' = 8-bit "
          "palette PNGs, 'coco' = instances.json. Raises Error.")
      .def(
          "export_meshes",
          [](const FoamObject& f,
             const fs::path& output_path,
             const std::vector<std::string>& formats,
             const py::object& labels,
             const std::string& method) {
            const std::string text = LabelText(labels, f.model());
            return WithoutGil([&] { return ExportMeshes(f, output_path, formats, text, method); });
          },
          py::arg("output_path"),
          py::arg("formats") = std::vector<std::string>{"om", "ply", "obj", "glb", "usda"},
          py::arg("labels") = py::none(),
          py::arg("method") = "cells",
          "Writes the surfaces of objects (ids or names; None = all) and labels.json into the "
          "folder output_path, which is made if missing, as `semfoam mesh_exporter` does. Returns "
          "the surfaces' files, relative to it. Raises Error.")
      .def(
          "export_volumes",
          [](const FoamObject& f,
             const fs::path& output_path,
             const py::object& labels,
             double voxel_size,
             int max_resolution) {
            const std::string text = LabelText(labels, f.model());
            return WithoutGil(
                [&] { return ExportVolumes(f, output_path, text, voxel_size, max_resolution); });
          },
          py::arg("output_path"),
          py::arg("labels") = py::none(),
          py::arg("voxel_size") = VolumeExportOptions().voxel_size,
          py::arg("max_resolution") = VolumeExportOptions().max_resolution,
          "Writes scene.vdb, the volumes of objects (ids or names; None = all) and labels.json "
          "into the folder output_path, which is made if missing, as `semfoam volume_exporter` "
          "does. Returns the volumes' files, relative to it. "
          "voxel_size is in units of the COLMAP model; 0 = the longest edge / 256. Raises Error.");
}

}  // namespace

void AddFoam(py::module_* module) {
  py::class_<FoamObject, std::shared_ptr<FoamObject>> foam(
      *module, "Foam", "A foam, the content of a scene.foam. Immutable: edits return new ones.");
  AddProperties(&foam);
  AddViewing(&foam);
  AddEdits(&foam);
  AddFiles(&foam);
  module->def("load",
              &FoamObject::Load,
              py::arg("path"),
              py::call_guard<py::gil_scoped_release>(),
              "Reads a scene.foam, with the names in the labels.json beside it. Raises Error.");
}

}  // namespace semfoam::python
