// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/options/object_choice.h"

#include "export/scene/names.h"
#include "export/scene/object_selection.h"
#include "foam/util/error.h"
#include "plugin/colmap/camera_rays.h"
#include "tools/cli/input_protection.h"
#include "tools/options/export_options.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <Eigen/Eigenvalues>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

const PhotoRecord& FindPhoto(const Model& model,
                             const std::string& name,
                             const fs::path& foam_path) {
  const auto photo = std::find_if(model.photos.begin(),
                                  model.photos.end(),
                                  [&](const PhotoRecord& record) { return record.name == name; });
  if (photo == model.photos.end()) {
    throw UserError(foam_path.string(),
                    ": has no photo ",
                    name,
                    model.photos.empty() ? "; it has none at all."
                                         : "; one of its photos is " + model.photos[0].name + ".");
  }
  return *photo;
}

const PhotoRecord& FindPhoto(const Model& model,
                             const PhotoPixel& pixel,
                             const fs::path& foam_path) {
  const PhotoRecord& photo = FindPhoto(model, pixel.image, foam_path);
  if (pixel.x < 0 || pixel.y < 0 || pixel.x >= photo.width || pixel.y >= photo.height) {
    throw UserError(foam_path.string(),
                    ": the photo ",
                    pixel.image,
                    " has ",
                    photo.width,
                    "x",
                    photo.height,
                    " pixels, and none at ",
                    pixel.x,
                    ",",
                    pixel.y,
                    ".");
  }
  return photo;
}

// Takes the number off the end of a text, and the separators before it; returns whether there was
// one, with something before it.
template <typename T>
bool TakeNumber(std::string* text, T* number) {
  const std::string separators = ", ";
  const size_t last = text->find_last_not_of(separators);
  text->resize(last == std::string::npos ? 0 : last + 1);
  const size_t before = text->find_last_of(separators);
  if (before == std::string::npos || !ParseValue(text->substr(before + 1), number)) return false;
  text->resize(text->find_last_not_of(separators, before) + 1);
  return true;
}

// Returns the normal of the plane through points, unit length, of either sign: the direction in
// which they spread least. The third that lies farthest off the plane through all of them is left
// out.
Eigen::Vector3d PlaneNormal(std::vector<Eigen::Vector3d> points) {
  const auto fit = [&](Eigen::Vector3d* mean) {
    *mean = Eigen::Vector3d::Zero();
    for (const Eigen::Vector3d& p : points) *mean += p / static_cast<double>(points.size());
    Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
    for (const Eigen::Vector3d& p : points) spread += (p - *mean) * (p - *mean).transpose();
    return Eigen::Vector3d(
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvectors().col(0));
  };
  Eigen::Vector3d mean;
  const Eigen::Vector3d normal = fit(&mean);
  std::stable_sort(points.begin(), points.end(), [&](const auto& a, const auto& b) {
    return std::abs(normal.dot(a - mean)) < std::abs(normal.dot(b - mean));
  });
  points.resize(std::max<size_t>(3, points.size() * 2 / 3));
  return fit(&mean);
}

}  // namespace

PhotoPixel ParsePhotoPixel(const std::string& option, const std::string& text) {
  PhotoPixel pixel;
  pixel.image = text;
  const bool valid = TakeNumber(&pixel.image, &pixel.y) && TakeNumber(&pixel.image, &pixel.x);
  if (!valid || pixel.image.empty()) {
    throw UserError("Failed to parse options - the argument ('",
                    text,
                    "') for option '--",
                    option,
                    "' is invalid; it takes a photo's name and a pixel, IMAGE,x,y.");
  }
  return pixel;
}

bool PhotoOutline::Contains(const Eigen::Vector2d& point) const {
  bool inside = false;
  for (size_t i = 0; i < corners.size(); ++i) {
    const Eigen::Vector2d& a = corners[i];
    const Eigen::Vector2d& b = corners[(i + 1) % corners.size()];
    if ((a.y() > point.y()) == (b.y() > point.y())) continue;
    const double share = (point.y() - a.y()) / (b.y() - a.y());
    if (point.x() < a.x() + share * (b.x() - a.x())) inside = !inside;
  }
  return inside;
}

PhotoOutline ParsePhotoOutline(const std::string& option, const std::string& text) {
  PhotoOutline outline;
  outline.image = text;
  std::vector<double> numbers;
  double number = 0;
  for (std::string rest = text; TakeNumber(&rest, &number);) {
    numbers.push_back(number);
    // An odd number belongs to the photo's name.
    if (numbers.size() % 2 == 0) outline.image = rest;
  }
  for (size_t i = 0; i + 1 < numbers.size(); i += 2) {
    outline.corners.emplace_back(numbers[i + 1], numbers[i]);
  }
  if (outline.corners.size() < 3 || outline.image.empty()) {
    throw UserError("Failed to parse options - the argument ('",
                    text,
                    "') for option '--",
                    option,
                    "' is invalid; it takes a photo's name and three corners or more, "
                    "IMAGE,x,y,x,y,x,y.");
  }
  return outline;
}

const PhotoRecord& FindPhoto(const Model& model,
                             const PhotoOutline& outline,
                             const fs::path& foam_path) {
  return FindPhoto(model, outline.image, foam_path);
}

SeenSurface SurfaceAt(const Model& model,
                      const ViewRenderer& renderer,
                      const PhotoPixel& pixel,
                      const fs::path& foam_path) {
  const PhotoRecord& photo = FindPhoto(model, pixel, foam_path);
  const CameraRays all = MakeCameraRays(photo, model.world_from_normalized, foam_path);
  const int reach = std::max(2, photo.width / 30);
  const int x0 = std::max(0, pixel.x - reach), x1 = std::min(photo.width - 1, pixel.x + reach);
  const int y0 = std::max(0, pixel.y - reach), y1 = std::min(photo.height - 1, pixel.y + reach);
  CameraRays window{x1 - x0 + 1, y1 - y0 + 1, all.origin, {}};
  for (int y = y0; y <= y1; ++y) {
    for (int x = x0; x <= x1; ++x) {
      window.directions.push_back(all.directions[static_cast<size_t>(y) * photo.width + x]);
    }
  }
  const RenderedView view = renderer.Render(window);
  const size_t middle = static_cast<size_t>(pixel.y - y0) * window.width + (pixel.x - x0);
  if (!(view.distance[middle] > 0)) {
    throw UserError(foam_path.string(),
                    ": there is nothing at ",
                    pixel.x,
                    ",",
                    pixel.y,
                    " of ",
                    pixel.image,
                    "; choose a pixel that shows something.");
  }
  const auto point = [&](size_t i) {
    return model.world_from_normalized.Apply(
        window.origin + double(view.distance[i]) * window.directions[i].cast<double>());
  };
  SeenSurface seen;
  const ClassIndex class_index = view.class_index[middle];
  seen.label_id = LabelIdOf(model.labels, class_index);
  seen.point = point(middle);
  std::vector<Eigen::Vector3d> points;
  for (size_t i = 0; i < view.distance.size(); ++i) {
    if (view.distance[i] > 0 && view.class_index[i] == class_index) points.push_back(point(i));
  }
  const Eigen::Vector3d to_camera = -window.directions[middle].cast<double>();
  if (points.size() < 3) {
    seen.normal = to_camera;
  } else {
    seen.normal = PlaneNormal(std::move(points));
    if (seen.normal.dot(to_camera) < 0) seen.normal = -seen.normal;
  }
  return seen;
}

void AddSelectionOptions(OptionManager* options, ObjectSelection* selection) {
  AddLabelOptions(options, &selection->choice);
  options->AddDefaultOption("pick",
                            &selection->pick,
                            "or the object seen at a pixel, \"IMAGE,x,y\": a photo of the foam, "
                            "column and row from its upper left corner, at the size it was trained "
                            "with");
}

void RequireValid(const ObjectSelection& selection) {
  const LabelChoice& choice = selection.choice;
  if (choice.IsAll() == selection.pick.empty()) {
    throw UserError("Failed to parse options - ",
                    choice.IsAll()          ? "no object is named"
                    : choice.labels.empty() ? "both --exclude_labels and --pick"
                                            : "both --labels and --pick",
                    "; give either --labels (as mug,7) or --pick (IMAGE,x,y).");
  }
  if (!selection.pick.empty()) ParsePhotoPixel("pick", selection.pick);
}

ChosenObjects ChooseObjects(const Model& model,
                            const ObjectSelection& selection,
                            const fs::path& foam_path,
                            const Device& device) {
  if (selection.pick.empty()) return ChooseObjects(model, selection.choice, foam_path);
  const PhotoPixel pixel = ParsePhotoPixel("pick", selection.pick);
  const SeenSurface seen = SurfaceAt(model, ViewRenderer(model.foam, device), pixel, foam_path);
  if (seen.label_id == kNoObject) {
    throw UserError(foam_path.string(),
                    ": what is seen at ",
                    pixel.x,
                    ",",
                    pixel.y,
                    " of ",
                    pixel.image,
                    " has no label; choose a pixel of an object.");
  }
  ExportableScene scene = SceneWithObjects(model, foam_path);
  LabelFilter picked;
  picked.only.emplace({seen.label_id});
  if (SelectObjects(scene, picked).empty()) {
    throw UserError(foam_path.string(),
                    ": what is seen at ",
                    pixel.x,
                    ",",
                    pixel.y,
                    " of ",
                    pixel.image,
                    " has label ",
                    seen.label_id,
                    ", of which there is no object; choose a pixel of an object.");
  }
  return TakeObjects(model, picked, std::move(scene));
}

fs::path EditedFoamPath(const fs::path& output_path, const std::vector<fs::path>& inputs) {
  fs::path target = output_path / "scene.foam";
  CheckNoInputOverwrite(inputs, {target});
  if (fs::exists(target) && fs::exists(output_path / "training_log.csv")) {
    throw UserError(target.string(),
                    ": holds a trained foam, which would be lost; choose another --output_path.");
  }
  return target;
}

}  // namespace semfoam
