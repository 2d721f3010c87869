// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/error.h"
#include "foam/model.h"
#include "foam/output_file.h"
#include "foam/view_renderer.h"
#include "plugin/camera_rays.h"
#include "plugin/colmap_model.h"
#include "plugin/photo.h"
#include "tools/commands.h"
#include "tools/image_files.h"
#include "tools/option_manager.h"
#include "tools/view_images.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <string>
#include <vector>

#include <glog/logging.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

struct View {
  const Image* image = nullptr;
  const Camera* camera = nullptr;
  fs::path stem;  // the image's name without its extension
};

std::vector<std::string> ReadNames(const std::string& path) {
  std::ifstream file(path);
  if (!file || fs::is_directory(path)) {
    throw UserError(path,
                    ": is no list of image names that can be read; --views takes all, train, test "
                    "or a file with one name a line.");
  }
  std::vector<std::string> names;
  for (std::string line; std::getline(file, line);) {
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (!line.empty()) names.push_back(line);
  }
  return names;
}

// The names of the images to render, sorted.
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
    view.image = image->second;
    view.camera = cameras.at(view.image->camera_id);
    view.stem = fs::path(name).replace_extension();
    RequireRays(*view.camera, model_folder);
    if (!stems.insert(view.stem).second) {
      throw UserError(model_folder.string(),
                      ": has two images ",
                      view.stem.string(),
                      ".*, whose renders would have the same name; list one of them for --views.");
    }
    chosen.push_back(view);
  }
  if (chosen.empty()) {
    throw UserError(foam_path,
                    ": there is no view to render for --views ",
                    views,
                    "; views are held out by training with --test_every 8.");
  }
  return chosen;
}

fs::path Target(const fs::path& folder, const char* kind, const fs::path& stem, const char* ext) {
  return folder / kind / (stem.string() + ext);
}

}  // namespace

void RunFoamRenderer(int argc, char** argv) {
  std::string foam_path;
  std::string input_path;
  std::string output_path;
  std::string image_path;
  std::string views = "all";
  bool preview = false;
  OptionManager options("foam_renderer",
                        "Renders colour, labels and depth from the views of a COLMAP model.");
  options.AddRequiredOption("foam_path", &foam_path, "the model, scene.foam");
  options.AddRequiredOption("input_path", &input_path, "the COLMAP model with the views, sparse/0");
  options.AddRequiredOption(
      "output_path",
      &output_path,
      "folder for rgb/*.png, label/*.png (16 bits, ids) and depth/*.exr (along the camera's z)");
  options.AddDefaultOption(
      "views", &views, "{all, train, test} or a file with one image name a line");
  options.AddDefaultOption("preview", &preview, "also preview/*.png: photo, render and labels");
  options.AddDefaultOption("image_path", &image_path, "folder of the photos, for --preview 1");
  if (!options.Parse(argc, argv)) return;
  if (preview && image_path.empty()) {
    throw UserError(
        "Failed to parse options - --preview 1 needs the photos' folder, --image_path.");
  }

  RequireWritableFolder(output_path);
  const Model model = ReadModel(foam_path);
  const fs::path model_folder = FindModelFolder(input_path);
  const Reconstruction reconstruction = ReadReconstruction(model_folder);
  const std::vector<View> chosen =
      ChooseViews(views, foam_path, model, model_folder, reconstruction);

  const ViewRenderer renderer(model.foam);
  for (const View& view : chosen) {
    const CameraRays rays =
        MakeCameraRays(*view.camera, view.image->cam_from_world, model.world_from_normalized);
    const RenderedView rendered = renderer.Render(rays);
    const Eigen::Vector3d z_axis =
        view.image->cam_from_world.UnitRotation().conjugate() * Eigen::Vector3d::UnitZ();
    const Image8 color = ColorImage(rendered);
    const LabelImage ids = IdImage(rendered, model.labels);
    WriteRgbPng(Target(output_path, "rgb", view.stem, ".png"), color);
    WriteDepthExr(Target(output_path, "depth", view.stem, ".exr"),
                  rendered.width,
                  rendered.height,
                  DepthImage(rendered, rays, z_axis, model.world_from_normalized.scale));
    if (model.foam.HasSemantics()) {
      WriteLabelPng(Target(output_path, "label", view.stem, ".png"), ids);
    }
    if (preview) {
      const Image8 photo = ReadPhoto(fs::path(image_path) / view.image->name);
      WriteRgbPng(
          Target(output_path, "preview", view.stem, ".png"),
          SideBySide({ResizeNearest(photo, color.width, color.height), color, PaletteImage(ids)}));
    }
  }
  LOG(INFO) << "Rendered " << chosen.size() << (chosen.size() == 1 ? " view" : " views") << " into "
            << output_path;
  if (!model.foam.HasSemantics()) {
    LOG(INFO) << "The foam was trained without labels, so there is no label/.";
  }
}

}  // namespace semfoam
