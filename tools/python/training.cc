// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/python/training.h"

#include "foam/util/error.h"
#include "foam/util/interruption.h"
#include "plugin/mask/mask_pairing.h"
#include "tools/cli/input_protection.h"
#include "tools/controllers/export_objects.h"
#include "tools/controllers/export_record.h"
#include "tools/controllers/label_names.h"
#include "tools/controllers/scene_segmenter.h"
#include "tools/controllers/training_folder.h"
#include "tools/controllers/training_run.h"
#include "tools/masks/mask_writers.h"
#include "tools/python/conversions.h"
#include "tools/python/foam_object.h"
#include "tools/support/output_lock.h"

#include <cmath>
#include <exception>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

namespace py = pybind11;

namespace semfoam::python {
namespace {

namespace fs = std::filesystem;

// Fields of TrainingOptions that arguments set, or that are for the library alone.
const std::set<std::string> kNoOptions = {
    "fixed_sh_degree", "random_seed", "seconds", "sh_degree_interval"};

// Sets options by name, as Serialize describes them.
class OptionSetter {
 public:
  explicit OptionSetter(const py::dict& values) {
    for (const auto& [name, value] : values) {
      values_[py::str(name)] = py::reinterpret_borrow<py::object>(value);
    }
  }

  template <typename T>
  void Number(const std::string& name, T* value) {
    const auto found = values_.find(name);
    if (found == values_.end() || kNoOptions.count(name) != 0) return;
    try {
      *value = found->second.cast<T>();
    } catch (const py::cast_error&) {
      throw FieldError(name,
                       " is ",
                       std::string(py::str(found->second)),
                       "; it must be ",
                       std::is_integral_v<T> ? "an integer." : "a number.");
    }
    values_.erase(found);
  }

  // Throws where a name is left that no option has.
  void RequireAllSet() const {
    if (values_.empty()) return;
    throw UserError(
        "options has no '", values_.begin()->first, "'; help(semfoam.train) lists them.");
  }

 private:
  std::map<std::string, py::object> values_;
};

// The arguments that train and segment have in common.
struct TrainingArguments {
  py::object image_path = py::none(), input_path = py::none(), workspace_path = py::none();
  py::object output_path = py::none();
  py::object mask_path = py::none(), ignore_path = py::none(), labels_path = py::none();
  py::object seed_path = py::none();
  std::string mask_consistency = "auto";
  std::string quality = "medium";
  int test_every = 0;
  uint64_t random_seed = 0;
  double time_budget = 0;
  py::dict options;
  py::object progress = py::none();
  double preview_every = 0;
  bool resume = false;
  bool overwrite = false;
};

fs::path PathOf(const py::object& path) {
  if (path.is_none()) return {};
  return std::string(py::str(py::module_::import("os").attr("fspath")(path)));
}

MaskConsistency ConsistencyOf(const std::string& name) {
  const std::optional<MaskConsistency> found = ParseEnum(kMaskConsistencyNames, name);
  if (found) return *found;
  throw FieldError(
      "mask_consistency", " is '", name, "'; it must be auto, off, tracks or independent.");
}

TrainingRun MakeRun(const TrainingArguments& arguments) {
  if (!arguments.progress.is_none() && PyCallable_Check(arguments.progress.ptr()) == 0) {
    throw py::type_error("progress is no function; one that takes a Progress would be right");
  }
  TrainingRun run;
  const std::optional<Quality> quality = ParseEnum(kQualityNames, arguments.quality);
  if (!quality) {
    throw FieldError(
        "quality", " is '", arguments.quality, "'; it must be low, medium, high or extreme.");
  }
  run.quality = *quality;
  run.training = OptionsForQuality(*quality);
  run.training.random_seed = arguments.random_seed;
  run.time_budget = arguments.time_budget;
  run.scene.image_path = PathOf(arguments.image_path);
  run.scene.input_path = PathOf(arguments.input_path);
  run.scene.mask_path = PathOf(arguments.mask_path);
  run.scene.ignore_path = PathOf(arguments.ignore_path);
  run.scene.mask_consistency = ConsistencyOf(arguments.mask_consistency);
  run.scene.labels_path = PathOf(arguments.labels_path);
  run.scene.seed_path = PathOf(arguments.seed_path);
  run.scene.test_every = arguments.test_every;
  OptionSetter setter(arguments.options);
  run.training.Serialize(&setter);
  setter.Number("max_image_size", &run.scene.max_image_size);
  setter.Number("sweep_photos", &run.sweep_photos);
  setter.Number("image_cache_gb", &run.image_cache_gb);
  setter.RequireAllSet();
  for (const char* name : {"num_rays", "late_rays"}) {
    if (arguments.time_budget > 0 && arguments.options.contains(name)) {
      throw UserError(name,
                      " and time_budget both say how long to train; one of them would be right.");
    }
  }
  for (const auto& [name, value] : arguments.options) run.kept_options.insert(py::str(name));
  if (!arguments.workspace_path.is_none()) {
    CompleteFromWorkspace(PathOf(arguments.workspace_path), &run);
  } else if (arguments.image_path.is_none() || arguments.input_path.is_none()) {
    throw UserError("neither workspace_path nor both image_path and input_path are given.");
  }
  CompleteTrainingRun(&run);
  return run;
}

// What a training would read, as Python holds it.
struct Workspace {
  std::vector<PhotoRecord> photos;
  // [photos] Empty: none.
  std::vector<std::string> masks;
  std::vector<Eigen::Vector3d> points;
  // [points]
  std::vector<Eigen::Vector3f> point_colors;
  std::vector<std::string> warnings;
};

std::unique_ptr<Workspace> LoadWorkspace(const TrainingArguments& arguments) {
  const TrainingRun run = MakeRun(arguments);
  return WithoutGil([&] {
    ScenePlan plan = PlanScene(run.scene);
    auto workspace = std::make_unique<Workspace>();
    workspace->photos = std::move(plan.photos);
    for (const fs::path& mask : plan.masks.masks) {
      workspace->masks.push_back(mask.string());
    }
    workspace->masks.resize(workspace->photos.size());
    for (const SeedPoint& seed : plan.seeds) {
      workspace->points.push_back(plan.world_from_normalized.Apply(seed.position.cast<double>()));
      workspace->point_colors.push_back(seed.color);
    }
    workspace->warnings = std::move(plan.warnings);
    return workspace;
  });
}

// Calls a Python function with the progress of a training that runs without the GIL. An exception
// of the function, or of a signal (KeyboardInterrupt), stops the training with a checkpoint.
class ProgressCaller {
 public:
  explicit ProgressCaller(py::object function) : function_(std::move(function)) {}

  bool operator()(const TrainingProgress& progress) {
    const py::gil_scoped_acquire gil;
    try {
      if (PyErr_CheckSignals() != 0) throw py::error_already_set();
      if (function_.is_none()) return true;
      const py::object goes_on = function_(progress);
      return goes_on.is_none() || goes_on.cast<bool>();
    } catch (...) {
      exception_ = std::current_exception();
      return false;
    }
  }

  void Rethrow() const {
    if (exception_) std::rethrow_exception(exception_);
  }

 private:
  const py::object function_;
  std::exception_ptr exception_;
};

// Runs `work` without the GIL, with the progress of `run` sent to the Python function.
template <typename Work>
void RunWithProgress(const py::object& function, TrainingRun* run, const Work& work) {
  ProgressCaller caller(function);
  run->when_reported = [&](const TrainingProgress& progress) { return caller(progress); };
  try {
    const py::gil_scoped_release released;
    work();
  } catch (const Interruption&) {
    caller.Rethrow();
    throw;
  }
  // The last report comes after the last iteration.
  caller.Rethrow();
}

CheckpointOptions Checkpoints(const TrainingArguments& arguments) {
  CheckpointOptions checkpoints;
  checkpoints.preview_every = arguments.preview_every;
  checkpoints.resume = arguments.resume;
  checkpoints.overwrite = arguments.overwrite;
  return checkpoints;
}

constexpr char kResume[] = "the same call with resume=True";

std::shared_ptr<FoamObject> Train(const TrainingArguments& arguments) {
  TrainingRun run = MakeRun(arguments);
  const fs::path output_path = PathOf(arguments.output_path);
  const CheckpointOptions checkpoints = Checkpoints(arguments);
  RunWithProgress(arguments.progress, &run, [&] {
    TrainingFolder folder(output_path, checkpoints, kResume);
    if (folder.IsFinished()) return;
    folder.RequireReplaceable();
    const fs::path foam_path = folder.path() / "scene.foam";
    Model model = TrainAndWrite(&folder, &run);
    TakeLabelNames(foam_path, {}, {}, &model);
    WriteLabels(PrepareExport(model, foam_path),
                output_path,
                {ModelChecksum(foam_path), {}, /*is_new_foam=*/true});
    folder.Finish();
  });
  return WithoutGil([&] { return FoamObject::Load(output_path / "scene.foam"); });
}

std::shared_ptr<FoamObject> Segment(const TrainingArguments& arguments) {
  SceneSegmenterOptions options;
  options.run = MakeRun(arguments);
  options.output_path = PathOf(arguments.output_path);
  options.checkpoints = Checkpoints(arguments);
  options.resume_command = kResume;
  RunWithProgress(arguments.progress, &options.run, [&] { SegmentScene(options); });
  return WithoutGil([&] { return FoamObject::Load(options.output_path / "scene.foam"); });
}

std::unique_ptr<Workspace> CallLoadWorkspace(py::object workspace_path,
                                             py::object image_path,
                                             py::object input_path,
                                             py::object mask_path,
                                             py::object ignore_path,
                                             py::object labels_path,
                                             int test_every) {
  TrainingArguments arguments;
  arguments.workspace_path = std::move(workspace_path);
  arguments.image_path = std::move(image_path);
  arguments.input_path = std::move(input_path);
  arguments.mask_path = std::move(mask_path);
  arguments.ignore_path = std::move(ignore_path);
  arguments.labels_path = std::move(labels_path);
  arguments.test_every = test_every;
  return LoadWorkspace(arguments);
}

py::dict CorrectMasks(const fs::path& output_path,
                      py::object workspace_path,
                      py::object image_path,
                      py::object input_path,
                      py::object mask_path,
                      py::object labels_path,
                      std::string mask_consistency,
                      int test_every,
                      const std::string& format) {
  const std::optional<MaskOutput> output = ParseEnum(kMaskOutputNames, format);
  if (!output) throw FieldError("format", " is '", format, "'; it must be png, palette or coco.");
  TrainingArguments arguments;
  arguments.workspace_path = std::move(workspace_path);
  arguments.image_path = std::move(image_path);
  arguments.input_path = std::move(input_path);
  arguments.mask_path = std::move(mask_path);
  arguments.labels_path = std::move(labels_path);
  arguments.mask_consistency = std::move(mask_consistency);
  arguments.test_every = test_every;
  const TrainingRun run = MakeRun(arguments);
  const MaskConsistencyReport report = WithoutGil([&] {
    const TrainingScene scene = LoadScene(run, run.scene);
    std::vector<int> views;
    std::vector<std::string> photos;
    for (int view = 0; view < scene.NumViews(); ++view) {
      if (!scene.HasMask(view)) continue;
      views.push_back(view);
      photos.push_back(scene.Photos()[view].name);
    }
    if (scene.NumClasses() == 0) {
      throw UserError(run.scene.image_path.string(),
                      ": no label was found in masks of these photos; a mask_path with masks of "
                      "them would be right.");
    }
    std::vector<fs::path> written = {output_path / "labels.json"};
    for (const std::string& name : NamesForMasks(photos)) written.push_back(output_path / name);
    std::vector<fs::path> read = scene.Plan().masks.masks;
    read.push_back(run.scene.labels_path);
    CheckNoInputOverwrite(read, written);
    const OutputLock lock(output_path);
    const std::unique_ptr<MaskWriter> writer =
        MakeMaskWriter(*output, output_path, photos, scene.Labels());
    for (size_t i = 0; i < views.size(); ++i) writer->Add(photos[i], scene.LabelIds(views[i]));
    writer->Finish();
    return scene.Consistency();
  });
  py::dict result;
  result["used"] = NameOf(kMaskConsistencyNames, report.used);
  result["regions"] = report.num_regions;
  result["renamed"] = report.num_renamed;
  result["split"] = report.num_split;
  result["dropped"] = report.num_dropped;
  result["labels_before"] = report.labels_before;
  result["labels_after"] = report.labels_after;
  result["agreement_before"] = report.agreement_before;
  result["agreement_after"] = report.agreement_after;
  return result;
}

template <std::shared_ptr<FoamObject> (*kRun)(const TrainingArguments&)>
std::shared_ptr<FoamObject> Call(py::object output_path,
                                 py::object workspace_path,
                                 py::object image_path,
                                 py::object input_path,
                                 py::object mask_path,
                                 py::object ignore_path,
                                 py::object labels_path,
                                 py::object seed_path,
                                 std::string mask_consistency,
                                 std::string quality,
                                 int test_every,
                                 uint64_t random_seed,
                                 double time_budget,
                                 py::dict options,
                                 py::object progress,
                                 double preview_every,
                                 bool resume,
                                 bool overwrite) {
  return kRun({std::move(image_path),
               std::move(input_path),
               std::move(workspace_path),
               std::move(output_path),
               std::move(mask_path),
               std::move(ignore_path),
               std::move(labels_path),
               std::move(seed_path),
               std::move(mask_consistency),
               std::move(quality),
               test_every,
               random_seed,
               time_budget,
               std::move(options),
               std::move(progress),
               preview_every,
               resume,
               overwrite});
}

template <std::shared_ptr<FoamObject> (*kRun)(const TrainingArguments&)>
void Add(py::module_* module, const char* name, const std::string& doc) {
  module->def(name,
              &Call<kRun>,
              py::arg("output_path"),
              py::kw_only(),
              py::arg("workspace_path") = py::none(),
              py::arg("image_path") = py::none(),
              py::arg("input_path") = py::none(),
              py::arg("mask_path") = py::none(),
              py::arg("ignore_path") = py::none(),
              py::arg("labels_path") = py::none(),
              py::arg("seed_path") = py::none(),
              py::arg("mask_consistency") = "auto",
              py::arg("quality") = "medium",
              py::arg("test_every") = 0,
              py::arg("random_seed") = 0,
              py::arg("time_budget") = 0.0,
              py::arg("options") = py::dict(),
              py::arg("progress") = py::none(),
              py::arg("preview_every") = 0.0,
              py::arg("resume") = false,
              py::arg("overwrite") = false,
              doc.c_str());
}

// Names of the training's options, for the docstring.
struct NameList {
  std::string text;
  template <typename T>
  void Number(const std::string& name, T*) {
    if (kNoOptions.count(name) == 0) text += (text.empty() ? "" : ", ") + name;
  }
};

void AddWorkspace(py::module_* module) {
  py::class_<Workspace>(*module, "Workspace", "What a training would read, without its pixels.")
      .def_readonly("photos",
                    &Workspace::photos,
                    "The registered photos, by name; held_out says which a training leaves out.")
      .def_readonly("masks", &Workspace::masks, "Files of the photos' masks; '' = none.")
      .def_property_readonly(
          "points",
          [](const py::object& self) {
            const auto& points = self.cast<const Workspace&>().points;
            return View(points.data()->data(), {py::ssize_t(points.size()), 3}, self);
          },
          "(M, 3) float64: the SfM points that a training begins from, in the frame of the COLMAP "
          "model.")
      .def_property_readonly(
          "point_colors",
          [](const py::object& self) {
            const auto& colors = self.cast<const Workspace&>().point_colors;
            return View(colors.data()->data(), {py::ssize_t(colors.size()), 3}, self);
          },
          "(M, 3) float32: sRGB values, 0 to 1.")
      .def_readonly("warnings", &Workspace::warnings, "Sentences on what looks wrong.");
  module->def("load_workspace",
              &CallLoadWorkspace,
              py::arg("workspace_path") = py::none(),
              py::kw_only(),
              py::arg("image_path") = py::none(),
              py::arg("input_path") = py::none(),
              py::arg("mask_path") = py::none(),
              py::arg("ignore_path") = py::none(),
              py::arg("labels_path") = py::none(),
              py::arg("test_every") = 0,
              "Reads the COLMAP model and the headers of photos and masks, which train would read "
              "with the same arguments, and pairs them. Raises Error for what train would refuse "
              "then.");
  module->def(
      "correct_masks",
      &CorrectMasks,
      py::arg("output_path"),
      py::kw_only(),
      py::arg("workspace_path") = py::none(),
      py::arg("image_path") = py::none(),
      py::arg("input_path") = py::none(),
      py::arg("mask_path") = py::none(),
      py::arg("labels_path") = py::none(),
      py::arg("mask_consistency") = "auto",
      py::arg("test_every") = 0,
      py::arg("format") = "png",
      "Writes the masks of the photos into the folder output_path, which is made if missing, "
      "as train learns from them: corrected by the SfM tracks, of the size of the photos, "
      "with labels.json. format: 'png' = 16-bit PNGs of ids, 'palette' = 8-bit palette PNGs, "
      "'coco' = instances.json. Returns a dict: used (the way of the correction), regions, "
      "renamed, split, dropped (numbers of regions of masks), labels_before, labels_after "
      "(numbers), agreement_before, agreement_after (how much more often two photos agree on "
      "a point than by chance, at most 1; NaN where not known). Runs without the GIL. Raises "
      "Error.");
}

}  // namespace

void AddTraining(py::module_* module) {
  py::class_<TrainingProgress>(*module, "Progress", "What a progress function is called with.")
      .def_readonly("photos_read",
                    &TrainingProgress::photos_read,
                    "Photos read, while those that do not fit into memory are read; else 0.")
      .def_readonly("photos_to_read", &TrainingProgress::photos_to_read, "All of these.")
      .def_readonly("iteration", &TrainingProgress::iteration, "Iterations done.")
      .def_readonly("num_iterations", &TrainingProgress::num_iterations, "All iterations.")
      .def_readonly("rays", &TrainingProgress::rays, "Rays cast so far.")
      .def_readonly("num_cells", &TrainingProgress::sites, "Cells of the foam.")
      .def_readonly("seconds", &TrainingProgress::seconds, "Seconds since the training began.")
      .def_readonly("seconds_left", &TrainingProgress::seconds_left, "Estimate, in seconds.")
      .def_readonly("color_loss", &TrainingProgress::color_loss, "Mean since the last report.")
      .def_readonly("identity_loss", &TrainingProgress::identity_loss, "NaN without masks.")
      .def_readonly("distance_loss",
                    &TrainingProgress::distance_loss,
                    "0 where no plane sweep told distances.")
      .def_readonly("held_out_psnr",
                    &TrainingProgress::held_out_psnr,
                    "dB on held-out photos at the last evaluation; NaN before the first.")
      .def_readonly("held_out_miou", &TrainingProgress::held_out_miou, "The same of the labels.");

  AddWorkspace(module);
  NameList names;
  TrainingOptions().Serialize(&names);
  const std::string arguments =
      "Either workspace_path (with images/, sparse/ and object_mask/) or image_path and input_path "
      "(a COLMAP model, sparse/0) name the photos. options sets fields of the training by name: " +
      names.text +
      ", max_image_size, sweep_photos, image_cache_gb. progress is called about once a second with "
      "a Progress; if it returns False, or raises, the training ends with a checkpoint (Stopped, "
      "or "
      "what it raised). preview_every > 0 writes pictures of the foam in training every so many "
      "seconds, with a page that reloads itself: previews/index.html. The GIL is released "
      "meanwhile. Same input, arguments and seed: the same "
      "bytes as of the program. Raises Error.";
  Add<&Train>(module,
              "train",
              "Trains a foam, as `semfoam foam_trainer` does, into output_path (scene.foam, "
              "labels.json, effects.json, training_log.csv), and returns it. " +
                  arguments);
  Add<&Segment>(module,
                "segment",
                "Trains a foam and writes every object as volume and surface, as `semfoam "
                "automatic_segmenter` does without the report, and returns it. " +
                    arguments);
}

}  // namespace semfoam::python
