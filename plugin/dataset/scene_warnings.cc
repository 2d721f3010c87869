// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/dataset/scene_warnings.h"

#include "plugin/util/plural.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <limits>
#include <optional>
#include <stdexcept>
#include <system_error>
#include <unordered_map>
#include <utility>
#include <vector>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

constexpr double kFewUnregistered = 0.2;  // of all photos
constexpr size_t kFewestObservations = 50;
constexpr size_t kObservations = 100'000;
constexpr double kLargestError = 4, kSmallestLimit = 2;  // pixels
constexpr double kLargestErrorOfSide = 0.01;
constexpr size_t kMostModels = 8;  // that are named

// Returns the number of a model that the mapper wrote; none where the folder has another name.
std::optional<int> NumberOf(const fs::path& folder) {
  const std::string name = folder.filename().string();
  int number = 0;
  const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), number);
  if (error != std::errc() || end != name.data() + name.size()) return std::nullopt;
  return number;
}

fs::path WithoutSlash(const fs::path& path) {
  const fs::path normal = path.lexically_normal();
  return normal.has_filename() ? normal : normal.parent_path();
}

}  // namespace

std::vector<std::string> NonEmpty(std::vector<std::string> sentences) {
  std::erase_if(sentences, [](const std::string& sentence) { return sentence.empty(); });
  return sentences;
}

std::string OtherModelsWarning(const fs::path& input_path,
                               const fs::path& model_folder,
                               int64_t num_images) {
  const fs::path folder = WithoutSlash(fs::absolute(model_folder));
  const std::optional<int> own_number = NumberOf(folder);
  const bool is_named = folder == WithoutSlash(fs::absolute(input_path));
  if (!own_number || (is_named && *own_number != 0)) return "";
  std::vector<std::pair<int, int64_t>> others;  // number, photos
  int64_t most = 0;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder.parent_path(), error)) {
    const std::optional<int> number = NumberOf(entry.path());
    if (!number || entry.path().filename() == folder.filename()) continue;
    try {
      const int64_t count = CountImages(entry.path());
      if (count == 0 || (is_named && count < num_images)) continue;
      others.emplace_back(*number, count);
      most = std::max(most, count);
    } catch (const std::runtime_error&) {
      // No model, a damaged one, or one that may not be read.
    }
  }
  if (others.empty()) return "";
  std::sort(others.begin(), others.end());
  std::string list;
  for (size_t i = 0; i < others.size(); ++i) {
    if (i > 0) list += i + 1 == others.size() ? " and " : ", ";
    if (i == kMostModels) {
      list += std::to_string(others.size() - i) + " more";
      break;
    }
    list += std::to_string(others[i].first) + " (" + Plural(others[i].second, "photo") + ")";
  }
  const fs::path largest =
      model_folder.parent_path() /
      std::to_string(
          std::max_element(others.begin(), others.end(), [](const auto& a, const auto& b) {
            return a.second < b.second;
          })->first);
  std::string text =
      model_folder.string() +
      ": of several models that the mapper did not connect this one alone is used, with " +
      Plural(num_images, "photo") + "; beside it " + (others.size() == 1 ? "is " : "are ") + list +
      ", and input_path ";
  if (most >= num_images) {
    text += largest.string() + " would take one with " + (most > num_images ? "more" : "as many") +
            " photos.";
  } else {
    text += "would take another.";
  }
  return text;
}

std::string UnregisteredWarning(const fs::path& image_path,
                                int64_t num_unregistered,
                                int64_t num_registered) {
  const int64_t all = num_unregistered + num_registered;
  if (static_cast<double>(num_unregistered) <= kFewUnregistered * static_cast<double>(all)) {
    return "";
  }
  return image_path.string() + ": " + std::to_string(num_unregistered) + " of its " +
         Plural(all, "photo") +
         " are not in the model and show nothing to the training; a model of all photos would be "
         "right, from other matches or from another number in sparse/.";
}

std::string ReprojectionWarning(const fs::path& model_folder, const Reconstruction& model) {
  std::unordered_map<uint32_t, const Camera*> cameras;
  for (const Camera& camera : model.cameras) cameras.emplace(camera.id, &camera);
  std::unordered_map<uint32_t, const Image*> images;
  for (const Image& image : model.images) images.emplace(image.id, &image);
  size_t observations = 0;
  for (const Point3D& point : model.points) observations += point.track.size();
  const size_t stride = std::max<size_t>(1, observations / kObservations);
  struct Error {
    double of_limit, pixels, side;
  };
  std::vector<Error> errors;
  for (size_t i = 0; i < model.points.size(); i += stride) {
    const Point3D& point = model.points[i];
    if (!point.position.allFinite()) continue;
    for (const TrackElement& element : point.track) {
      const auto found = images.find(element.image_id);
      if (found == images.end() || element.point2d_index >= found->second->points.size()) continue;
      const Image& image = *found->second;
      const Camera& camera = *cameras.at(image.camera_id);
      const Point2D& seen = image.points[element.point2d_index];
      if (!std::isfinite(seen.x) || !std::isfinite(seen.y)) continue;
      const Pose& pose = image.cam_from_world;
      const auto pixel = Project(camera, pose.UnitRotation() * point.position + pose.translation);
      const double pixels = pixel ? (*pixel - Eigen::Vector2d(seen.x, seen.y)).norm()
                                  : std::numeric_limits<double>::infinity();
      const auto side = static_cast<double>(std::max(camera.width, camera.height));
      const double limit = std::clamp(kLargestErrorOfSide * side, kSmallestLimit, kLargestError);
      errors.push_back({pixels / limit, pixels, side});
    }
  }
  if (errors.size() < kFewestObservations) return "";
  const auto median = errors.begin() + static_cast<std::ptrdiff_t>(errors.size() / 2);
  std::nth_element(errors.begin(), median, errors.end(), [](const Error& a, const Error& b) {
    return a.of_limit < b.of_limit;
  });
  if (!(median->of_limit > 1)) return "";
  char text[64] = "far";
  if (std::isfinite(median->pixels)) {
    std::snprintf(text,
                  sizeof(text),
                  "more than %.1f pixels (%.1f %% of the photo)",
                  median->pixels,
                  100 * median->pixels / median->side);
  }
  return model_folder.string() + ": its poses do not fit its points: half of these are seen " +
         text +
         " from where the poses put them, while COLMAP leaves about 1 and at most 4; a model as "
         "colmap mapper or bundle_adjuster wrote it would be right.";
}

}  // namespace semfoam
