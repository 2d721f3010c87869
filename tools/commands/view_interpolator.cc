// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/model/model.h"
#include "foam/util/error.h"
#include "foam/util/input_file.h"
#include "foam/util/json_file.h"
#include "foam/util/output_file.h"
#include "foam/util/photo_name.h"
#include "foam/view/view_renderer.h"
#include "plugin/colmap/camera_rays.h"
#include "plugin/mask/mask_pairing.h"
#include "plugin/photo/photo.h"
#include "plugin/util/files.h"
#include "tools/cli/input_protection.h"
#include "tools/cli/option_manager.h"
#include "tools/commands/commands.h"
#include "tools/images/image_files.h"
#include "tools/images/view_images.h"
#include "tools/options/enum_option.h"
#include "tools/support/output_lock.h"
#include "tools/views/capture_path.h"

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include <glog/logging.h>
#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

constexpr char kManifest[] = "manifest.json";
// What is copied when masks are brought back, in error sentences.
constexpr char kCopied[] = "a mask or pred.json";

std::string FrameName(size_t frame) {
  char name[32];
  std::snprintf(name, sizeof(name), "%06zu.png", frame);
  return name;
}

struct ManifestFrame {
  std::string file;
  std::string photo;  // empty: a render between photos
};

std::vector<ManifestFrame> ReadManifest(const fs::path& path) {
  const nlohmann::json json = ReadJsonFile(path);
  const auto is_text = [](const nlohmann::json& value, const char* key) {
    return value.contains(key) && value[key].is_string();
  };
  if (!json.is_object() || !json.contains("version") || json["version"] != 1 ||
      !json.contains("frames") || !json["frames"].is_array()) {
    throw UserError(
        path.string(),
        ": is no manifest that view_interpolator wrote; the manifest.json beside its frames "
        "would be right.");
  }
  std::vector<ManifestFrame> frames;
  std::set<std::string> photos;
  for (const auto& frame : json["frames"]) {
    if (!frame.is_object() || !is_text(frame, "file")) {
      throw UserError(path.string(),
                      ": has a frame without its file, such as \"000000.png\"; is it damaged?");
    }
    ManifestFrame& one = frames.emplace_back();
    one.file = frame["file"].get<std::string>();
    if (!frame.contains("photo")) continue;
    if (!is_text(frame, "photo")) {
      throw UserError(path.string(), ": has a photo whose name is no text; is it damaged?");
    }
    one.photo = frame["photo"].get<std::string>();
    const bool leaves = !StaysBelowFolder(one.photo);
    if (leaves || !StaysBelowFolder(one.file) ||
        fs::path(one.file) != fs::path(one.file).filename()) {
      throw UserError(path.string(),
                      ": names a file outside of its folder, ",
                      Shortened(leaves ? one.photo : one.file),
                      "; a name as view_interpolator wrote it would be right.");
    }
    if (!photos.insert(one.photo).second) {
      throw UserError(path.string(),
                      ": has the photo ",
                      Shortened(one.photo),
                      " twice, where each is one frame; is it damaged?");
    }
  }
  return frames;
}

bool IsManifest(const fs::path& path) {
  try {
    ReadManifest(path);
    return true;
  } catch (const UserError&) {
    return false;
  }
}

// Returns whether a picture in frames/ is one that a film of this program left there.
bool IsFrame(const fs::path& path) {
  const std::string stem = path.stem();
  return path.extension() == ".png" && stem.size() >= 6 &&
         std::all_of(stem.begin(), stem.end(), [](char c) { return c >= '0' && c <= '9'; }) &&
         IsOwnImage(path);
}

// Returns the frames of an earlier film that this one of `num_frames` does not replace. Throws
// UserError where the folder holds a manifest or pictures of others: they would be lost, or
// tracked.
std::vector<fs::path> FindStaleFrames(const fs::path& output_path, size_t num_frames) {
  const fs::path manifest = output_path / kManifest;
  if (fs::exists(manifest) && !IsManifest(manifest)) {
    throw UserError(manifest.string(),
                    ": was not written by view_interpolator and would be lost; give another "
                    "--output_path.");
  }
  const fs::path folder = output_path / "frames";
  std::vector<fs::path> stale;
  if (!fs::is_directory(folder)) return stale;
  std::set<fs::path> written;
  for (size_t i = 0; i < num_frames; ++i) written.insert(folder / FrameName(i));
  for (const fs::path& picture : ListPhotos(folder)) {
    if (IsFrame(picture)) {
      if (!written.contains(picture)) stale.push_back(picture);
      continue;
    }
    throw UserError(picture.string(),
                    ": is no frame that view_interpolator wrote, and would be ",
                    written.contains(picture) ? "lost" : "taken for one by a tracker",
                    "; give another --output_path.");
  }
  return stale;
}

// Writes the film's pictures and, last, the manifest. What an earlier film left in the folder goes:
// its manifest before the first picture, so that none is there that is not true of the frames.
void WriteFilm(const Model& model,
               const std::string& foam_path,
               const std::string& image_path,
               const std::vector<FilmFrame>& film,
               const Device& device,
               const fs::path& output_path) {
  std::vector<fs::path> photos;
  std::vector<fs::path> pictures;
  ordered_json frames = ordered_json::array();
  for (const FilmFrame& frame : film) {
    const PhotoRecord& photo = model.photos[frame.photo];
    const std::string file = FrameName(frames.size());
    if (!image_path.empty()) photos.push_back(fs::path(image_path) / photo.name);
    pictures.push_back(output_path / "frames" / file);
    if (frame.photo == frame.next) {
      frames.push_back({{"file", file}, {"photo", photo.name}});
    } else {
      frames.push_back({{"file", file},
                        {"between", {photo.name, model.photos[frame.next].name}},
                        {"share", frame.share}});
    }
  }
  const ordered_json manifest = {{"version", 1}, {"frames", frames}};
  const std::string manifest_text = manifest.dump(1) + "\n";

  CheckNoInputOverwrite(photos, pictures);
  const std::vector<fs::path> stale = FindStaleFrames(output_path, film.size());
  const fs::path manifest_path = output_path / kManifest;
  if (fs::exists(manifest_path) &&
      ReadFileBytes(manifest_path, "a film's manifest") != manifest_text) {
    fs::remove(manifest_path);
  }
  const ViewRenderer renderer(model.foam, device);
  for (size_t i = 0; i < film.size(); ++i) {
    const FilmFrame& frame = film[i];
    const PhotoRecord& photo = model.photos[frame.photo];
    Image8 picture;
    if (frame.photo == frame.next && !image_path.empty()) {
      picture = ReadPhoto(fs::path(image_path) / photo.name);
      const PhotoSize trained = {photo.width, photo.height};
      if (picture.width > trained.width && SameAspect({picture.width, picture.height}, trained)) {
        picture = ReducePhoto(picture, trained);
      }
    } else {
      const Camera camera = CameraOf(photo, foam_path);
      picture = ColorImage(RenderCamera(renderer,
                                        camera,
                                        frame.cam_from_world,
                                        model.world_from_normalized,
                                        kDefaultSupersample));
    }
    WriteRgbPng(pictures[i], picture);
  }
  for (const fs::path& picture : stale) fs::remove(picture);
  if (!stale.empty()) {
    LOG(INFO) << "Removed " << stale.size() << " frames of the film that was here before";
  }
  WriteTextFile(manifest_path, manifest_text);
}

// Throws UserError where one of `targets` is there with other bytes than its source has.
void RequireNothingLost(const std::vector<fs::path>& sources,
                        const std::vector<fs::path>& targets) {
  for (size_t i = 0; i < sources.size(); ++i) {
    if (!fs::is_regular_file(targets[i])) continue;
    if (ReadFileBytes(sources[i], kCopied) == ReadFileBytes(targets[i], kCopied)) continue;
    throw UserError(targets[i].string(),
                    ": is not the same as ",
                    sources[i].string(),
                    " and would be lost; remove it, or give another --output_path.");
  }
}

// Brings the tracker's masks of the frames that are photos to the photos' names.
void CollectMasks(const fs::path& manifest_path,
                  const fs::path& mask_path,
                  const fs::path& output_path) {
  std::vector<std::string> files;
  std::vector<std::string> photos;
  for (const ManifestFrame& frame : ReadManifest(manifest_path)) {
    if (frame.photo.empty()) continue;
    files.push_back(frame.file);
    photos.push_back(frame.photo);
  }
  if (!fs::is_directory(mask_path)) {
    throw UserError(
        mask_path.string(),
        ": there is no such folder; the tracker's masks, 000000.png and so on, should be in it.");
  }
  const std::vector<std::string> names = NamesForMasks(photos);
  int missing = 0;
  std::string first_missing;
  std::vector<fs::path> sources;
  std::vector<fs::path> targets;
  for (size_t i = 0; i < photos.size(); ++i) {
    const fs::path mask = mask_path / files[i];
    if (!fs::is_regular_file(mask)) {
      if (missing++ == 0) first_missing = mask.string();
      continue;
    }
    sources.push_back(mask);
    targets.push_back(output_path / names[i]);
  }
  if (missing == static_cast<int>(photos.size())) {
    throw UserError(
        mask_path.string(), ": has no mask of a photo's frame, like ", first_missing, ".");
  }
  // DEVA's list of ids stands in the masks' folder or beside it.
  for (const fs::path& list :
       {mask_path / "pred.json",
        fs::absolute(mask_path / "").parent_path().parent_path() / "pred.json"}) {
    if (!fs::is_regular_file(list)) continue;
    sources.push_back(list);
    targets.push_back(output_path / "pred.json");
    break;
  }
  CheckNoInputOverwrite(sources, targets);
  RequireNothingLost(sources, targets);
  for (size_t i = 0; i < sources.size(); ++i) {
    WriteTextFile(targets[i], ReadFileBytes(sources[i], kCopied));
  }
  LOG(INFO) << "Masks of " << photos.size() - missing << " of " << photos.size()
            << " photos are in " << output_path.string();
  if (missing > 0)
    LOG(WARNING) << missing << " photos have no mask; the first that is missing: " << first_missing;
}

// Options of the command line.
struct InterpolatorOptions {
  std::string foam_path;
  std::string image_path;
  std::string output_path;
  FilmOrder order = FilmOrder::kAuto;
  std::string manifest_path;
  std::string mask_path;
  int between = 3;
};

void AddOptions(OptionManager* options, InterpolatorOptions* interpolator) {
  options->AddDeviceOption();
  options->AddRequiredOption(
      "output_path",
      &interpolator->output_path,
      "folder for frames/*.png and manifest.json; or, with --manifest_path, for the photos' masks");
  options->AddDefaultOption(
      "foam_path", &interpolator->foam_path, "the model, scene.foam; its photos are the film's");
  options->AddDefaultOption("image_path",
                            &interpolator->image_path,
                            "folder of the photos; without, they are rendered as well");
  options->AddDefaultOption("between",
                            &interpolator->between,
                            "renders between two photos, 0 to 100; more where these are far apart");
  AddEnumOption(options,
                "order",
                &interpolator->order,
                kFilmOrderNames,
                "name: as the photos are called; path: a short way past all of them; auto: by "
                "name where that is hardly longer");
  options->AddDefaultOption("manifest_path",
                            &interpolator->manifest_path,
                            "the film's manifest.json, to bring masks back");
  options->AddDefaultOption("mask_path",
                            &interpolator->mask_path,
                            "the tracker's masks of the film's frames, with --manifest_path");
}

// Throws UserError where options are out of range or do not go together.
void RequireValid(const OptionManager& options, const InterpolatorOptions& interpolator) {
  const bool brings_masks_back = !interpolator.manifest_path.empty();
  if (brings_masks_back != interpolator.foam_path.empty() ||
      brings_masks_back == interpolator.mask_path.empty()) {
    throw UserError(
        "Failed to parse options - give --foam_path to make a film, or --manifest_path and "
        "--mask_path "
        "to bring a tracker's masks back.");
  }
  if (interpolator.between < 0 || interpolator.between > 100) {
    throw UserError(
        "Failed to parse options - --between ", interpolator.between, ": 0 to 100 would be right.");
  }
  if (brings_masks_back) {
    options.RequireEffect({"between", "order", "image_path"},
                          "on a film that is made; give it with --foam_path, or leave it out");
  }
}

}  // namespace

void RunViewInterpolator(int argc, char** argv) {
  InterpolatorOptions interpolator;
  OptionManager options(
      "view_interpolator",
      "Makes a film of the photos for a video tracker: in an order it can follow, "
      "with renders between them; and brings its masks back to the photos.");
  AddOptions(&options, &interpolator);
  if (!options.Parse(argc, argv)) return;
  RequireValid(options, interpolator);
  const fs::path output_path = interpolator.output_path;
  const OutputLock lock(output_path);
  if (!interpolator.manifest_path.empty()) {
    CollectMasks(interpolator.manifest_path, interpolator.mask_path, output_path);
    return;
  }

  const std::string& foam_path = interpolator.foam_path;
  const Model model = ReadModel(foam_path);
  if (model.photos.empty()) {
    throw UserError(foam_path, ": has no photos, so there is nothing to make a film of.");
  }
  // The frame's unit is about the cameras' distance from what they look at.
  const double depth = model.world_from_normalized.scale;
  const std::vector<FilmFrame> film =
      MakeFilm(model.photos,
               CaptureOrder(model.photos, depth, interpolator.order),
               depth,
               interpolator.between);
  WriteFilm(model, foam_path, interpolator.image_path, film, options.device(), output_path);
  LOG(INFO) << film.size() << " frames, " << model.photos.size() << " of them photos, are in "
            << (output_path / "frames").string();
}

}  // namespace semfoam
