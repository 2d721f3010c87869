// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/report/report_content.h"

#include "export/scene/names.h"
#include "foam/render/compositing.h"
#include "foam/render/ray_caster.h"
#include "foam/util/json_file.h"
#include "plugin/colmap/camera_rays.h"
#include "plugin/photo/photo.h"
#include "tools/controllers/training_log.h"
#include "tools/images/image_files.h"
#include "tools/report/page_text.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <map>

#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using nlohmann::ordered_json;

constexpr int kThumbnailWidth = 256;
constexpr int kThumbnailQuality = 78;

ordered_json ToJson(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

ordered_json NumberOrNull(double value) {
  return std::isfinite(value) ? ordered_json(value) : ordered_json(nullptr);
}

// The day on which the file was last written, in UTC.
std::string DateOf(const fs::path& file) {
  const auto time = std::chrono::file_clock::to_sys(fs::last_write_time(file));
  const std::time_t seconds =
      std::chrono::system_clock::to_time_t(std::chrono::floor<std::chrono::seconds>(time));
  std::tm parts = {};
  gmtime_r(&seconds, &parts);
  char text[32];
  return {text, std::strftime(text, sizeof(text), "%Y-%m-%d", &parts)};
}

// The name of the folder that most likely names the scene: that above the photos', if these lie in
// one of the usual names.
std::string SceneName(const fs::path& foam_path, const fs::path& image_path) {
  fs::path folder = fs::weakly_canonical(image_path);
  if (!folder.has_filename()) folder = folder.parent_path();
  const std::string name = folder.filename().string();
  if (name == "images" || name == "photos" || name == "input") folder = folder.parent_path();
  const std::string scene = folder.filename().string();
  return scene.empty() ? foam_path.stem().string() : scene;
}

ordered_json CurveOf(const fs::path& log_path, ordered_json* seconds) {
  ordered_json curve = ordered_json::array();
  *seconds = nullptr;
  if (!fs::exists(log_path)) return curve;
  const std::vector<TrainingProgress> reports = ReadTrainingLog(log_path);
  if (!reports.empty()) *seconds = reports.back().seconds;
  for (const TrainingProgress& report : reports) {
    if (!std::isfinite(report.held_out_psnr)) continue;
    curve.push_back({report.seconds, report.held_out_psnr, NumberOrNull(report.held_out_miou)});
  }
  return curve;
}

ordered_json EffectsOf(const fs::path& effects_path) {
  ordered_json effects = ordered_json::array();
  if (!fs::exists(effects_path)) return effects;
  const json file = ReadJsonFile(effects_path);
  if (!file.is_object() || !file.contains("effects") || !file["effects"].is_array()) return effects;
  for (const json& effect : file["effects"]) {
    if (!effect.is_object() || !effect.value("on", json()).is_boolean()) continue;
    const json name = effect.value("effect", json()), evidence = effect.value("evidence", json());
    if (!name.is_string() || !evidence.is_string()) continue;
    effects.push_back({{"effect", name}, {"on", effect["on"]}, {"evidence", evidence}});
  }
  return effects;
}

// The files of each object's id, from the labels.json of an export of this folder.
std::map<int64_t, ordered_json> FilesOfObjects(const fs::path& labels_path) {
  std::map<int64_t, ordered_json> files;
  if (!fs::exists(labels_path)) return files;
  const json file = ReadJsonFile(labels_path);
  if (!file.is_object() || !file.contains("objects") || !file["objects"].is_array()) return files;
  for (const json& object : file["objects"]) {
    if (!object.is_object() || !object.contains("id") || !object.contains("files")) continue;
    const auto id = JsonInteger(object["id"], 0, 65535);
    if (!id.has_value() || !object["files"].is_object()) continue;
    for (const auto& [format, path] : object["files"].items()) {
      if (path.is_string()) files[*id].push_back(path.get<std::string>());
    }
  }
  return files;
}

std::string Thumbnail(const fs::path& photo_path) {
  const Image8 photo = ReadPhoto(photo_path);
  return DataUrl(
      "image/jpeg",
      EncodeJpeg(ReducePhoto(photo, ReducedSize({photo.width, photo.height}, kThumbnailWidth)),
                 kThumbnailQuality));
}

// All photos as pinhole cameras of the normalised frame.
ordered_json CamerasOf(const Model& model, const ReportInput& input) {
  ordered_json cameras = ordered_json::array();
  const size_t count = model.photos.size();
  const size_t thumbnails = std::min<size_t>(count, std::max(0, input.max_thumbnails));
  for (size_t i = 0; i < count; ++i) {
    const PhotoRecord& photo = model.photos[i];
    const Camera camera = WithoutDistortion(CameraOf(photo, input.foam_path));
    const Pose pose = PoseOf(photo);
    const Eigen::Matrix3d rotation = pose.UnitRotation().toRotationMatrix();
    ordered_json rows = ordered_json::array();
    for (int k = 0; k < 9; ++k) rows.push_back(rotation(k / 3, k % 3));
    ordered_json one = {{"name", photo.name},
                        {"width", photo.width},
                        {"height", photo.height},
                        {"fx", camera.params[0]},
                        {"fy", camera.params[1]},
                        {"cx", camera.params[2]},
                        {"cy", camera.params[3]},
                        {"cam_from_world", rows},
                        {"center", ToJson(model.world_from_normalized.Invert(pose.Center()))},
                        {"held_out", photo.held_out}};
    // The i-th is one of `thumbnails` spread evenly over `count`.
    const bool has_thumbnail = (i + 1) * thumbnails / count > i * thumbnails / count;
    if (has_thumbnail && fs::exists(input.image_path / photo.name)) {
      one["thumbnail"] = Thumbnail(input.image_path / photo.name);
    }
    cameras.push_back(std::move(one));
  }
  return cameras;
}

ordered_json LabelsOf(const Model& model) {
  ordered_json labels = ordered_json::array();
  for (const Label& label : model.labels) {
    labels.push_back({{"id", Value(label.id)},
                      {"source_id", Value(label.source_id)},
                      {"name", label.name},
                      {"color", LabelColor(label.id)}});
  }
  return labels;
}

ordered_json ObjectsOf(const Model& model, const ExportableScene& scene, const fs::path& folder) {
  const std::map<int64_t, ordered_json> files = FilesOfObjects(folder / "labels.json");
  ordered_json objects = ordered_json::array();
  for (const ObjectInfo& object : scene.objects) {
    size_t label = 0;
    while (label < model.labels.size() && model.labels[label].id != object.id) ++label;
    Eigen::AlignedBox3d box;  // of the sites, in the normalised frame
    for (const uint32_t cell : object.cells) box.extend(scene.cell_positions[cell].cast<double>());
    const auto file = files.find(Value(object.id));
    objects.push_back({{"label", label},
                       {"id", Value(object.id)},
                       {"name", object.name},
                       {"cells", object.cells.size()},
                       {"volume", object.volume},
                       {"area", object.area},
                       {"size", ToJson(object.bounding_box.sizes())},
                       {"confidence", object.confidence},
                       {"components", object.components},
                       {"photos", object.photos.size()},
                       {"files", file == files.end() ? ordered_json::array() : file->second},
                       {"center", ToJson(box.center())},
                       {"radius", box.diagonal().norm() / 2}});
  }
  return objects;
}

// What lengths are measured in.
std::string UnitsOf(const ExportTransform& transform) {
  if (transform.unit != LengthUnit::kUnknown) return NameOf(kLengthUnitNames, transform.unit);
  return transform.scale == 1 ? "units of the COLMAP model" : "units of the exported files";
}

std::string NameOf(const Label& label) {
  return label.name.empty() ? "label_" + std::to_string(Value(label.id)) : label.name;
}

// What a reader should know before trusting the figures.
ordered_json WarningsOf(const Model& model,
                        const ExportableScene& scene,
                        const ReportInput& input,
                        const ordered_json& effects) {
  ordered_json warnings = ordered_json::array();
  if (!input.views_are_held_out) {
    warnings.push_back(
        "No photo was held out of the training, so the scores are those of photos that it has "
        "seen, which says little about new views; train with --test_every 8.");
  }
  for (const LeftOutLabel& label : scene.labels_left_out) {
    warnings.push_back(label.name + ": no object was made of this label (" + label.reason + ").");
  }
  for (const Label& label : scene.labels_without_cells) {
    warnings.push_back(NameOf(label) + ": no cell of the foam has this label.");
  }
  int64_t left_out = 0;
  constexpr double kLowConfidence = 0.7;
  for (const ObjectInfo& object : scene.objects) {
    if (object.confidence < kLowConfidence) {
      warnings.push_back(object.name + ": the labels of its cells are uncertain (mean confidence " +
                         std::to_string(std::lround(100 * object.confidence)) +
                         " %); do its masks agree from photo to photo?");
    }
    if (object.photos.size() < 3) {
      warnings.push_back(object.name + ": seen in " + std::to_string(object.photos.size()) +
                         (object.photos.size() == 1 ? " photo" : " photos") +
                         " only; its back is a guess.");
    }
    left_out += object.left_out.components;
  }
  if (left_out > 0) {
    warnings.push_back(std::to_string(left_out) +
                       (left_out == 1 ? " small piece" : " small pieces") +
                       " apart from the objects left out of their files; --keep_largest and "
                       "--min_cells of the exporters decide.");
  }
  const ViewScore mean = MeanOf(input.scores.views);
  constexpr double kMuchWorse = 4;  // dB
  for (const ViewScore& view : input.scores.views) {
    if (view.psnr < mean.psnr - kMuchWorse) {
      warnings.push_back(view.name + ": rendered much worse than the other views (" +
                         std::to_string(std::lround(view.psnr)) + " dB, the mean is " +
                         std::to_string(std::lround(mean.psnr)) + " dB).");
    }
  }
  for (const std::string& sentence : input.scores.unscored) warnings.push_back(sentence);
  for (const ordered_json& effect : effects) {
    if (effect["on"] == true && effect["effect"] != "sh_degree" &&
        effect["effect"] != "semantics") {
      warnings.push_back("The scene called for the effect " + effect["effect"].get<std::string>() +
                         ": " + effect["evidence"].get<std::string>() + ".");
    }
  }
  if (!model.foam.HasSemantics()) {
    warnings.push_back("The foam was trained without masks, so it has no objects.");
  }
  return warnings;
}

ordered_json ViewsOf(const Model& model, const ReportInput& input) {
  ordered_json views = ordered_json::array();
  for (size_t i = 0; i < input.views.size(); ++i) {
    const ReportView& view = input.views[i];
    size_t camera = 0;
    while (camera < model.photos.size() && model.photos[camera].name != view.photo) ++camera;
    ordered_json one = {{"camera", camera},
                        {"name", view.photo},
                        {"photo", view.photo_url},
                        {"render", view.render_url},
                        {"error", view.error_url}};
    if (!view.labels_url.empty()) one["labels"] = view.labels_url;
    for (size_t k = 0; k < input.scores.views.size(); ++k) {
      if (input.scores.views[k].name != view.photo) continue;
      one["psnr"] = NumberOrNull(input.scores.views[k].psnr);
      one["ssim"] = input.scores.views[k].ssim;
      if (const auto labels = MeanOfView(input.scores.objects, k)) one["miou"] = labels->iou;
    }
    views.push_back(std::move(one));
  }
  return views;
}

}  // namespace

ordered_json ReportContent(const Model& model,
                           const ExportableScene& scene,
                           const ReportInput& input) {
  const fs::path folder = input.foam_path.parent_path();
  const auto option = [&](const char* name) {
    const auto found = model.options.find(name);
    return found == model.options.end() ? std::string() : found->second;
  };
  ordered_json content;
  content["scene"] = SceneName(input.foam_path, input.image_path);
  content["date"] = DateOf(input.foam_path);
  content["program"] = "semfoam " SEMFOAM_VERSION;
  content["quality"] = option("quality");
  content["cells"] = model.foam.NumSites();
  content["photos"] = model.photos.size();
  content["held_out"] = std::count_if(
      model.photos.begin(), model.photos.end(), [](const auto& photo) { return photo.held_out; });
  content["views_are_held_out"] = input.views_are_held_out;
  ordered_json seconds;
  content["curve"] = CurveOf(folder / "training_log.csv", &seconds);
  content["seconds"] = seconds;
  if (!input.scores.views.empty()) {
    const ViewScore mean = MeanOf(input.scores.views);
    content["scores"] = {{"views", input.scores.views.size()},
                         {"psnr", NumberOrNull(mean.psnr)},
                         {"ssim", mean.ssim}};
    if (const auto labels = MeanOf(input.scores.objects, /*direct=*/false)) {
      content["scores"]["miou"] = labels->iou;
    }
  }
  content["effects"] = EffectsOf(folder / "effects.json");
  content["warnings"] = WarningsOf(model, scene, input, content["effects"]);
  content["views"] = ViewsOf(model, input);
  content["cameras"] = CamerasOf(model, input);
  content["labels"] = LabelsOf(model);
  content["objects"] = ObjectsOf(model, scene, folder);
  content["units"] = UnitsOf(scene.transform);
  content["world_units_per_unit"] = scene.world_from_normalized.scale;
  content["negligible_weight"] = kNegligibleWeight;
  content["transmittance_cutoff"] = kTransmittanceCutoff;
  return content;
}

}  // namespace semfoam
