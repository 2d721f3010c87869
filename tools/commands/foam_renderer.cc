// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/scene/exportable_scene.h"
#include "export/scene/object_selection.h"
#include "foam/model/model.h"
#include "foam/util/error.h"
#include "foam/util/input_file.h"
#include "foam/view/view_renderer.h"
#include "plugin/colmap/camera_rays.h"
#include "plugin/colmap/colmap_model.h"
#include "plugin/mask/label_png.h"
#include "plugin/photo/photo.h"
#include "plugin/photo/photo_light.h"
#include "plugin/photometric/expected_light.h"
#include "tools/cli/input_protection.h"
#include "tools/cli/option_manager.h"
#include "tools/commands/commands.h"
#include "tools/controllers/effects_report.h"
#include "tools/controllers/label_names.h"
#include "tools/images/image_files.h"
#include "tools/images/view_images.h"
#include "tools/options/enum_option.h"
#include "tools/options/object_choice.h"
#include "tools/options/pixel_sampling.h"
#include "tools/support/output_lock.h"
#include "tools/views/trajectory.h"

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <glog/logging.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

// A picture to render.
struct View {
  Camera camera;
  Pose cam_from_world;
  fs::path stem;      // of its files: the image's name without its extension, or the frame's number
  std::string photo;  // its name; empty: there is none
  std::optional<PhotoLight> light = {};  // nothing: the reference exposure
};

// The light that views are shown in.
enum class ViewLight { kPhotos, kReference };

constexpr EnumName<ViewLight> kViewLightNames[] = {{ViewLight::kPhotos, "photos"},
                                                   {ViewLight::kReference, "reference"}};

std::vector<std::string> ReadNames(const std::string& path) {
  const std::string bytes =
      ReadFileBytes(path, "what --views takes (all, train, test or a file with one name a line)");
  std::istringstream file{std::string(WithoutByteOrderMark(bytes))};
  std::vector<std::string> names;
  for (std::string line; std::getline(file, line);) {
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (!line.empty()) names.push_back(line);
  }
  return names;
}

// Returns the names of the images to render, sorted.
std::set<std::string> ChosenNames(const std::string& views,
                                  const Model& model,
                                  const std::map<std::string, const Image*>& images) {
  std::set<std::string> names;
  if (views == "all") {
    for (const auto& [name, image] : images) names.insert(name);
  } else if (views == "train" || views == "test") {
    for (const PhotoRecord& photo : model.photos) {
      if (photo.held_out == (views == "test")) names.insert(photo.name);
    }
  } else {
    for (const std::string& name : ReadNames(views)) names.insert(name);
  }
  return names;
}

std::vector<View> ChooseViews(const std::string& views,
                              const std::string& foam_path,
                              const Model& model,
                              const fs::path& model_folder,
                              const Reconstruction& reconstruction) {
  std::map<std::string, const Image*> images;
  for (const Image& image : reconstruction.images) images[image.name] = &image;
  std::map<uint32_t, const Camera*> cameras;
  for (const Camera& camera : reconstruction.cameras) cameras[camera.id] = &camera;

  std::vector<View> chosen;
  std::set<fs::path> stems;
  for (const std::string& name : ChosenNames(views, model, images)) {
    const auto image = images.find(name);
    if (image == images.end()) {
      throw UserError(model_folder.string(),
                      ": has no image ",
                      name,
                      "; --input_path takes the model that the foam was trained on, and a list of "
                      "views holds names of its images.");
    }
    View view;
    view.camera = *cameras.at(image->second->camera_id);
    view.cam_from_world = image->second->cam_from_world;
    view.stem = fs::path(name).lexically_normal().replace_extension();
    view.photo = name;
    if (!stems.insert(view.stem).second) {
      throw UserError(model_folder.string(),
                      ": has two images ",
                      view.stem.string(),
                      ".*, whose renders would have the same name; list one of them for --views.");
    }
    chosen.push_back(std::move(view));
  }
  if (chosen.empty()) {
    throw UserError(foam_path,
                    ": there is no view to render for --views ",
                    views,
                    "; views are held out by training with --test_every 8.");
  }
  return chosen;
}

// Returns the chosen images of the COLMAP model.
std::vector<View> ChooseViews(const std::string& views,
                              const std::string& foam_path,
                              const std::string& input_path,
                              const Model& model) {
  const fs::path folder = FindModelFolder(input_path);
  return ChooseViews(views, foam_path, model, folder, ReadReconstruction(folder));
}

// Gives each view the light of its photo, or the one that is expected there.
void FindLights(const fs::path& foam_path, const Model& model, std::vector<View>* views) {
  const std::optional<ExpectedLights> lights = FindExpectedLights(foam_path, model);
  if (!lights) return;
  std::map<std::string, size_t> photos;
  for (size_t i = 0; i < model.photos.size(); ++i) photos[model.photos[i].name] = i;
  for (View& view : *views) {
    const auto photo = photos.find(view.photo);
    view.light =
        photo != photos.end() ? lights->OfPhoto(photo->second) : lights->At(view.cam_from_world);
  }
}

// Keeps only the objects with the ids or names in `object`, and makes all other cells empty.
// Returns the box of the objects.
Eigen::AlignedBox3d ShowAlone(const std::string& object, Model* model) {
  // Softplus of this is 0 in every float.
  constexpr float kRawAir = -100;
  const ExportableScene scene = MakeExportableScene(*model, EveryObject());
  std::vector<float> density(scene.NumSites(), kRawAir);
  Eigen::AlignedBox3d box;
  for (const ObjectInfo* one : SelectObjects(scene, LabelChoice{object})) {
    box.extend(one->bounding_box);
    for (const uint32_t cell : one->cells) density[cell] = model->foam.raw_density[cell];
  }
  model->foam.raw_density = std::move(density);
  model->foam.assumed_density.clear();
  return box;
}

std::vector<View> FramesOf(const Trajectory& trajectory) {
  std::vector<View> views;
  for (const Pose& pose : trajectory.cam_from_world) {
    char stem[32];
    std::snprintf(stem, sizeof(stem), "frame_%05zu", views.size());
    views.push_back({trajectory.camera, pose, stem, ""});
  }
  return views;
}

// Small enough to be sent around.
Image8 ForAnimation(const Image8& image) {
  constexpr int kMaxWidth = 480;
  if (image.width <= kMaxWidth) return image;
  const int height = std::max(1, image.height * kMaxWidth / image.width);
  return ReducePhoto(image, {kMaxWidth, height});
}

fs::path Target(const fs::path& folder, const char* kind, const fs::path& stem, const char* ext) {
  return folder / kind / (stem.string() + ext);
}

struct Pictures {
  Image8 color;
  Image8 labels;  // in their colours; empty without semantics
};

// Renders a view and writes its files.
Pictures RenderView(const View& view,
                    const Model& model,
                    const ViewRenderer& renderer,
                    int supersample,
                    const fs::path& output_path) {
  RenderedView rendered = RenderCamera(
      renderer, view.camera, view.cam_from_world, model.world_from_normalized, supersample);
  if (view.light) PutInLight(*view.light, &rendered);
  // Of the pixels' centres.
  const CameraRays rays =
      MakeCameraRays(view.camera, view.cam_from_world, model.world_from_normalized);
  const Eigen::Vector3d z_axis =
      view.cam_from_world.UnitRotation().conjugate() * Eigen::Vector3d::UnitZ();
  Pictures pictures;
  pictures.color = ColorImage(rendered);
  WriteDepthExr(Target(output_path, "depth", view.stem, ".exr"),
                rendered.width,
                rendered.height,
                DepthImage(rendered, rays, z_axis, model.world_from_normalized.scale));
  if (model.foam.HasSemantics()) {
    const LabelImage ids = LabelIdImage(rendered, model.labels);
    WriteLabelPng(Target(output_path, "label", view.stem, ".png"), ids);
    pictures.labels = PaletteImage(ids);
  }
  WriteRgbPng(Target(output_path, "rgb", view.stem, ".png"), pictures.color);
  return pictures;
}

// Photos, masks and depths of others may themselves lie in rgb/, label/ and depth/, as data sets
// have them, and would be lost.
void RequireRoomForPictures(const std::vector<View>& views,
                            const fs::path& image_path,
                            bool preview,
                            const fs::path& output_path) {
  std::vector<fs::path> photos;
  std::vector<fs::path> pictures;
  for (const View& view : views) {
    if (!image_path.empty() && !view.photo.empty()) photos.push_back(image_path / view.photo);
    pictures.push_back(Target(output_path, "depth", view.stem, ".exr"));
    for (const char* kind : {"rgb", "label"}) {
      pictures.push_back(Target(output_path, kind, view.stem, ".png"));
    }
    if (preview) pictures.push_back(Target(output_path, "preview", view.stem, ".png"));
  }
  CheckNoInputOverwrite(photos, pictures);
  RequireOwnImages(pictures);
}

// From the frames' files, once all are there: a run that is broken off leaves whole frames and no
// half animation, and no number of frames fills the memory.
void WriteAnimation(const std::vector<View>& frames,
                    const fs::path& output_path,
                    double frames_per_second) {
  GifWriter animation(output_path / "trajectory.gif", frames_per_second);
  for (const View& frame : frames) {
    animation.Add(ForAnimation(ReadPhoto(Target(output_path, "rgb", frame.stem, ".png"))));
  }
  animation.Finish();
}

// Options of the command line.
struct RendererOptions {
  std::string foam_path;
  std::string input_path;
  std::string output_path;
  std::string image_path;
  std::string views = "all";
  std::string object;  // ids or names; empty = everything
  TrajectoryOptions trajectory{/*path=*/""};
  bool preview = false;
  int supersample = kDefaultSupersample;
  ViewLight light = ViewLight::kPhotos;

  bool HasTrajectory() const { return !trajectory.path.empty(); }
};

void AddOptions(OptionManager* options, RendererOptions* renderer) {
  options->AddDeviceOption();
  options->AddRequiredOption("foam_path", &renderer->foam_path, "the model, scene.foam");
  options->AddRequiredOption(
      "output_path",
      &renderer->output_path,
      "folder for rgb/*.png, label/*.png (16 bits, ids) and depth/*.exr (along the camera's z)");
  options->AddDefaultOption("input_path",
                            &renderer->input_path,
                            "the COLMAP model with the views, sparse/0; not for a trajectory");
  options->AddDefaultOption(
      "views", &renderer->views, "{all, train, test} or a file with one image name a line");
  options->AddDefaultOption(
      "preview", &renderer->preview, "also preview/*.png: photo, render and labels");
  options->AddDefaultOption(
      "image_path", &renderer->image_path, "folder of the photos, for --preview 1");
  options->AddDefaultOption("trajectory",
                            &renderer->trajectory.path,
                            "instead of views, frames along {orbit, spiral} or a path.json, and "
                            "trajectory.gif of them");
  AddSupersampleOption(options, &renderer->supersample);
  AddEnumOption(options,
                "light",
                &renderer->light,
                kViewLightNames,
                "colour: photos = exposed as the view's photo, or as is expected from the photos "
                "around it where that was held out; reference = one exposure for all views. "
                "Trajectories have the latter");
  options->AddDefaultOption(
      "object", &renderer->object, "show these objects alone, ids or names, and look at them");
  options->AddDefaultOption("frames",
                            &renderer->trajectory.num_frames,
                            "of the trajectory; 0 = 60, or what path.json says");
  options->AddDefaultOption("width",
                            &renderer->trajectory.width,
                            "of the trajectory's frames; 0 = the photos', or what path.json says");
}

// Throws UserError where options are out of range or do not go together.
void RequireValid(const OptionManager& options, const RendererOptions& renderer) {
  const bool has_trajectory = renderer.HasTrajectory();
  if (!has_trajectory && renderer.input_path.empty()) {
    throw UserError(
        "Failed to parse options - the views are those of a COLMAP model, --input_path; or "
        "--trajectory orbit goes without.");
  }
  if (has_trajectory) {
    options.RequireEffect({"views"}, "with --trajectory; give one of the two");
    options.WarnWithoutEffect({"light"}, "with --trajectory");
    options.WarnWithoutEffect({"input_path"}, "with --trajectory");
  } else {
    options.RequireEffect({"frames", "width"}, "without --trajectory; give both, or neither");
  }
  if (renderer.preview && (renderer.image_path.empty() || has_trajectory)) {
    throw UserError(
        "Failed to parse options - --preview 1 needs the photos' folder, --image_path, and views, "
        "no trajectory.");
  }
  if (!renderer.preview) options.WarnWithoutEffect({"image_path"}, "without --preview 1");
  const TrajectoryOptions& path = renderer.trajectory;
  if (path.num_frames < 0 || path.num_frames > 100'000 || path.width < 0 || path.width > 16'384) {
    throw UserError(
        "Failed to parse options - --frames 0 to 100000 and --width 0 to 16384 would be right.");
  }
}

// Returns the requested trajectory, made or read. `box` is that of the selected objects, if only
// these are shown.
Trajectory FindTrajectory(const RendererOptions& renderer,
                          const Model& model,
                          const std::optional<Eigen::AlignedBox3d>& box) {
  const TrajectoryOptions& options = renderer.trajectory;
  const bool is_made = options.path == "orbit" || options.path == "spiral";
  return is_made ? MakeTrajectory(model, renderer.foam_path, box, options)
                 : ReadTrajectory(options.path, model, options);
}

// Writes the photo and its view's pictures side by side.
void WritePreview(const View& view,
                  const Pictures& pictures,
                  const fs::path& image_path,
                  const fs::path& output_path) {
  const Image8 photo = ReadPhoto(image_path / view.photo);
  std::vector<Image8> images = {ResizeNearest(photo, pictures.color.width, pictures.color.height),
                                pictures.color};
  if (pictures.labels.width > 0) images.push_back(pictures.labels);
  WriteRgbPng(Target(output_path, "preview", view.stem, ".png"), SideBySide(images));
}

}  // namespace

void RunFoamRenderer(int argc, char** argv) {
  RendererOptions renderer;
  OptionManager options(
      "foam_renderer",
      "Renders colour, labels and depth from the views of a COLMAP model, or along "
      "a trajectory.");
  AddOptions(&options, &renderer);
  if (!options.Parse(argc, argv)) return;
  CheckSupersample(renderer.supersample);
  RequireValid(options, renderer);

  const OutputLock lock(renderer.output_path);
  Model model = ReadNamedModel(renderer.foam_path);
  std::optional<Eigen::AlignedBox3d> box;
  if (!renderer.object.empty()) box = ShowAlone(renderer.object, &model);
  std::vector<View> chosen;
  double frames_per_second = 0;
  if (renderer.HasTrajectory()) {
    const Trajectory trajectory = FindTrajectory(renderer, model, box);
    chosen = FramesOf(trajectory);
    frames_per_second = trajectory.frames_per_second;
  } else {
    chosen = ChooseViews(renderer.views, renderer.foam_path, renderer.input_path, model);
    if (renderer.light == ViewLight::kPhotos) FindLights(renderer.foam_path, model, &chosen);
  }
  RequireRoomForPictures(chosen, renderer.image_path, renderer.preview, renderer.output_path);

  const ViewRenderer view_renderer(model.foam, options.device());
  for (const View& view : chosen) {
    const Pictures pictures =
        RenderView(view, model, view_renderer, renderer.supersample, renderer.output_path);
    if (renderer.preview) {
      WritePreview(view, pictures, renderer.image_path, renderer.output_path);
    }
  }
  if (renderer.HasTrajectory()) WriteAnimation(chosen, renderer.output_path, frames_per_second);
  LOG(INFO) << "Rendered " << chosen.size() << (chosen.size() == 1 ? " view" : " views") << " into "
            << renderer.output_path;
  if (!model.foam.HasSemantics()) {
    LOG(INFO) << "The foam was trained without labels, so there is no label/.";
  }
}

}  // namespace semfoam
