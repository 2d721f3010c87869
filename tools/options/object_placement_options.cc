// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/options/object_placement_options.h"

#include "foam/util/error.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <Eigen/Geometry>
#include <glog/logging.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

// Three numbers, apart by commas or blanks.
Eigen::Vector3d ParseVector(const std::string& option, const std::string& text) {
  std::vector<std::string> parts;
  for (size_t at = 0; (at = text.find_first_not_of(", ", at)) != std::string::npos;) {
    const size_t end = std::min(text.find_first_of(", ", at), text.size());
    parts.push_back(text.substr(at, end - at));
    at = end;
  }
  Eigen::Vector3d vector;
  bool valid = parts.size() == 3;
  for (int axis = 0; valid && axis < 3; ++axis) valid = ParseValue(parts[axis], &vector[axis]);
  if (!valid) {
    throw UserError("Failed to parse options - the argument ('",
                    text,
                    "') for option '--",
                    option,
                    "' is invalid; it takes three numbers, x,y,z.");
  }
  return vector;
}

// A turn about an axis of the frame; by multiples of 90 degrees it is exact.
Eigen::Matrix3d Turn(int axis, double degrees) {
  Eigen::Matrix3d turn =
      Eigen::AngleAxisd(degrees * std::numbers::pi / 180, Eigen::Vector3d::Unit(axis))
          .toRotationMatrix();
  if (std::fmod(degrees, 90) == 0) turn = turn.array().round().matrix();
  return turn;
}

// Returns the sites of the objects, in the COLMAP frame.
std::vector<Eigen::Vector3d> ObjectSites(const ExtractedObjects& objects) {
  std::vector<Eigen::Vector3d> sites;
  for (size_t i = 0; i < objects.object_of_site.size(); ++i) {
    if (objects.object_of_site[i] < 0) continue;
    sites.push_back(
        objects.model.world_from_normalized.Apply(objects.model.foam.positions[i].cast<double>()));
  }
  CHECK(!sites.empty());
  return sites;
}

Eigen::Vector3d Middle(const std::vector<Eigen::Vector3d>& sites) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& x : sites) box.extend(x);
  return box.center();
}

// Returns the mean of the photos' upward directions, unit length.
Eigen::Vector3d Up(const Model& model, const fs::path& object_path) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const PhotoRecord& photo : model.photos) {
    sum -= photo.cam_from_world_rotation.conjugate() * Eigen::Vector3d::UnitY();
  }
  if (!(sum.norm() > 0.1 * static_cast<double>(model.photos.size()))) {
    throw UserError(object_path.string(),
                    ": its photos do not tell what is up, so --align_to cannot stand it on a "
                    "surface; place it by --translation and --rotation.");
  }
  return sum.normalized();
}

// An object stands on its lowest cells but for this share of them: strays below do not count.
constexpr double kLowestShare = 0.005;

}  // namespace

void AddPlacementOptions(OptionManager* options, PlacementOptions* placement) {
  options->AddDefaultOption("translation",
                            &placement->translation,
                            "x,y,z: move by this, in units of the scene's COLMAP model");
  options->AddDefaultOption("rotation",
                            &placement->rotation,
                            "x,y,z: turn by so many degrees about the x, then the y, then the z "
                            "axis, through the object's middle");
  options->AddDefaultOption(
      "scale", &placement->scale, "make it so many times as large, about its middle");
  options->AddDefaultOption("align_to",
                            &placement->align_to,
                            "\"IMAGE,x,y\": stand it, after its rotation, on the surface that the "
                            "scene shows at this pixel, and move it from there");
}

ParsedPlacement ParsePlacement(const PlacementOptions& options) {
  ParsedPlacement parsed;
  parsed.translation = ParseVector("translation", options.translation);
  const Eigen::Vector3d degrees = ParseVector("rotation", options.rotation);
  parsed.rotation = Turn(2, degrees.z()) * Turn(1, degrees.y()) * Turn(0, degrees.x());
  if (!(options.scale >= 1e-6 && options.scale <= 1e6)) {
    throw UserError(
        "Failed to parse options - --scale is ", options.scale, "; it must be from 1e-6 to 1e6.");
  }
  parsed.scale = options.scale;
  if (!options.align_to.empty()) ParsePhotoPixel("align_to", options.align_to);
  return parsed;
}

ObjectPlacement PlaceAboutMiddle(const ExtractedObjects& objects, const ParsedPlacement& parsed) {
  const Eigen::Vector3d middle = Middle(ObjectSites(objects));
  ObjectPlacement placement{parsed.scale, parsed.rotation, Eigen::Vector3d::Zero()};
  placement.translation = (middle - placement.Apply(middle)) + parsed.translation;
  return placement;
}

ObjectPlacement PlaceOnSurface(const ExtractedObjects& objects,
                               const ParsedPlacement& parsed,
                               const SeenSurface& surface,
                               const fs::path& object_path) {
  const Eigen::Vector3d up = Up(objects.model, object_path);
  const std::vector<Eigen::Vector3d> sites = ObjectSites(objects);
  ObjectPlacement placement;
  placement.scale = parsed.scale;
  placement.rotation =
      Eigen::Quaterniond::FromTwoVectors(up, surface.normal).toRotationMatrix() * parsed.rotation;
  std::vector<double> heights;
  heights.reserve(sites.size());
  for (const Eigen::Vector3d& x : sites) {
    heights.push_back(surface.normal.dot(placement.Apply(x)));
  }
  const auto lowest = heights.begin() + static_cast<ptrdiff_t>(kLowestShare * heights.size());
  std::nth_element(heights.begin(), lowest, heights.end());
  const Eigen::Vector3d middle = placement.Apply(Middle(sites));
  const Eigen::Vector3d foot = middle - (surface.normal.dot(middle) - *lowest) * surface.normal;
  placement.translation = surface.point - foot + parsed.translation;
  return placement;
}

}  // namespace semfoam
