// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/dataset/scene.h"

#include "foam/util/error.h"
#include "plugin/colmap/colmap_model.h"
#include "plugin/colmap/seeds.h"
#include "plugin/dataset/scene_warnings.h"
#include "plugin/mask/mask_evidence.h"
#include "plugin/mask/mask_folders.h"
#include "plugin/mask/mask_png.h"
#include "plugin/mask/mask_tables.h"
#include "plugin/util/files.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <sstream>
#include <unordered_map>

#include <glog/logging.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

constexpr uint64_t kMaxTableBytes = uint64_t{1} << 30;

// Where masks are looked for that the user did not name.
std::vector<fs::path> WorkspacesOf(const SceneOptions& options) {
  std::vector<fs::path> workspaces;
  if (!options.workspace_path.empty()) workspaces.push_back(options.workspace_path);
  workspaces.push_back(ParentFolder(options.image_path));
  return workspaces;
}

fs::path MaskFolderOf(const SceneOptions& options) {
  if (!options.use_masks) return {};
  if (!options.mask_path.empty()) return options.mask_path;
  for (const fs::path& workspace : WorkspacesOf(options)) {
    if (const fs::path folder = FindMaskFolder(workspace); !folder.empty()) return folder;
  }
  return {};
}

// Photos that the model does not have: those that the mapper did not register. Normal, and counted.
int CountUnregistered(const fs::path& image_path, const std::vector<PhotoRecord>& photos) {
  std::set<std::string> registered;
  for (const PhotoRecord& photo : photos) {
    registered.insert(fs::path(photo.name).lexically_normal().generic_string());
  }
  int count = 0;
  for (const fs::path& path : ListPhotos(image_path)) {
    if (!registered.contains(path.lexically_relative(image_path).generic_string())) ++count;
  }
  return count;
}

void CheckTestEvery(int test_every, size_t num_photos) {
  if (test_every < 0) {
    throw UserError(
        "--test_every ", test_every, ": 0 (train on all photos) or more would be right.");
  }
  if (test_every == 1 || (test_every > 0 && num_photos < 2)) {
    throw UserError("--test_every ",
                    test_every,
                    ": holds out all of the ",
                    num_photos,
                    " photos and leaves none to train on; 0 would train on all.");
  }
}

Camera CameraOfView(const PhotoRecord& photo) { return CameraOf(photo, "the scene"); }

// Views whose rays are the same have the same key.
using CameraKey = std::tuple<std::string, int, int, std::vector<double>>;
CameraKey KeyOf(const PhotoRecord& photo) {
  return {photo.camera_model, photo.width, photo.height, photo.camera_params};
}

// The cameras worth a table: those of the most photos first, while there is room.
std::vector<int> ChooseTables(const std::vector<PhotoRecord>& photos) {
  std::map<CameraKey, std::pair<int, int>> uses;  // first view, number of views
  for (int view = 0; view < static_cast<int>(photos.size()); ++view) {
    ++uses.try_emplace(KeyOf(photos[view]), view, 0).first->second.second;
  }
  std::vector<std::pair<int, int>> order;
  order.reserve(uses.size());
  for (const auto& [key, use] : uses) order.push_back(use);
  std::sort(order.begin(), order.end(), [](const auto& a, const auto& b) {
    return a.second != b.second ? a.second > b.second : a.first < b.first;
  });
  std::vector<int> views;
  uint64_t total = 0;
  for (const auto& [first_view, count] : order) {
    const uint64_t bytes = PixelRays::TableBytes(CameraOfView(photos[first_view]));
    if (bytes == 0 || total + bytes > kMaxTableBytes) continue;
    total += bytes;
    views.push_back(first_view);
  }
  return views;
}

// The camera as it is simulated: without a distortion that is off.
Camera SimulatedCamera(const Camera& camera, EffectSwitch distortion) {
  if (distortion == EffectSwitch::kOn || !IsDistorted(camera)) return camera;
  const bool off =
      distortion == EffectSwitch::kOff || DistortionAtCorners(camera) < kLeastDistortion;
  return off ? WithoutDistortion(camera) : camera;
}

// Those that say something.
void AppendWarnings(std::vector<std::string> sentences, std::vector<std::string>* warnings) {
  for (std::string& sentence : sentences) {
    if (!sentence.empty()) warnings->push_back(std::move(sentence));
  }
}

std::string Plural(int64_t count, const char* noun) {
  return std::to_string(count) + " " + noun + (count == 1 ? "" : "s");
}

}  // namespace

uint64_t ScenePlan::MemoryBytes() const {
  uint64_t bytes = 0;
  for (size_t i = 0; i < photos.size(); ++i) {
    const uint64_t pixels =
        static_cast<uint64_t>(photos[i].width) * static_cast<uint64_t>(photos[i].height);
    bytes += 3 * pixels;
    // Until all ids are known, and afterwards at the most.
    if (!masks.masks[i].empty()) bytes += 2 * pixels;
  }
  return bytes + TableBytes();
}

uint64_t ScenePlan::TableBytes() const {
  uint64_t bytes = 0;
  for (const int view : table_views) bytes += PixelRays::TableBytes(CameraOfView(photos[view]));
  return bytes;
}

namespace {

// What decoding one photo and its mask takes, in bytes.
struct ViewBytes {
  uint64_t photo = 0;    // the decoded photo at its peak, reducing included
  uint64_t mask = 0;     // decoding the mask at its peak, the indices included
  uint64_t held = 0;     // of the photo while it is held
  uint64_t classes = 0;  // of the mask while they are held; one image of a photo's size
};

ViewBytes BytesOf(const ScenePlan& plan, size_t view) {
  const PhotoRecord& photo = plan.photos[view];
  const uint64_t pixels = static_cast<uint64_t>(photo.width) * static_cast<uint64_t>(photo.height);
  const bool is_reduced = PhotoSize{photo.width, photo.height} != plan.file_sizes[view];
  ViewBytes bytes;
  bytes.held = 3 * pixels;
  bytes.photo = plan.photo_decoding[view] + (is_reduced ? bytes.held : 0);
  if (plan.masks.masks[view].empty()) return bytes;
  bytes.classes = 2 * pixels;
  bytes.mask = plan.mask_decoding[view] + bytes.classes;
  return bytes;
}

}  // namespace

uint64_t ScenePlan::LoadingBytes() const {
  uint64_t most = 0;
  for (size_t i = 0; i < photos.size(); ++i) {
    const ViewBytes bytes = BytesOf(*this, i);
    const uint64_t held = bytes.held + bytes.classes;
    // The photo is decoded first, then the mask; when all are, one more image of classes is made.
    most = std::max({most,
                     std::max(bytes.photo, held) - held,
                     std::max(bytes.mask, bytes.classes) - bytes.classes,
                     bytes.classes});
  }
  return most;
}

uint64_t ScenePlan::OpeningBytes() const {
  uint64_t most = 0;
  for (size_t i = 0; i < photos.size(); ++i) {
    const ViewBytes bytes = BytesOf(*this, i);
    // The mask's indices, classes and corrected classes; then the photo.
    most = std::max({most, bytes.mask, 2 * bytes.classes, bytes.classes + bytes.photo});
  }
  return most;
}

uint64_t ScenePlan::CorrectionBytes() const {
  // Each point is triangulated (memory_plan.cc has what that takes) and keeps its neighbours; each
  // observation becomes an observation, of which its region keeps a list.
  constexpr uint64_t kBytesOfPoint = 1000;
  constexpr uint64_t kBytesOfObservation =
      sizeof(PixelObservation) + sizeof(Observation) + sizeof(uint32_t);
  uint64_t bytes = 0;
  for (const PixelObservations& track : seed_tracks) {
    if (!track.empty()) bytes += kBytesOfPoint + kBytesOfObservation * track.size();
  }
  return bytes;
}

ScenePlan PlanScene(const SceneOptions& options) {
  const fs::path model_folder = FindModelFolder(options.input_path);
  Reconstruction model = ReadReconstruction(model_folder);
  const char* extension = FindModelFormat(model_folder) == ModelFormat::kBinary ? ".bin" : ".txt";
  const fs::path images_file = model_folder / (std::string("images") + extension);
  if (model.images.empty()) {
    throw UserError(images_file.string(),
                    ": has no registered image, where at least one would be right; did the "
                    "reconstruction fail?");
  }
  if (!fs::is_directory(options.image_path)) {
    throw UserError(options.image_path.string(),
                    ": there is no such folder; it should hold the photos of the model.");
  }
  CheckTestEvery(options.test_every, model.images.size());
  std::sort(model.images.begin(), model.images.end(), [](const Image& a, const Image& b) {
    return a.name < b.name;
  });
  std::unordered_map<uint32_t, const Camera*> cameras;
  for (const Camera& camera : model.cameras) cameras.emplace(camera.id, &camera);

  ScenePlan plan;
  plan.label_zero = options.label_zero;
  plan.mask_consistency = options.mask_consistency;
  plan.labels_are_given = !options.labels_path.empty();
  const size_t num_views = model.images.size();
  plan.photos.resize(num_views);
  plan.file_sizes.resize(num_views);
  plan.photo_decoding.resize(num_views);
  plan.mask_decoding.resize(num_views, 0);
  for (const Image& image : model.images) {
    plan.distortion = std::max(plan.distortion, DistortionAtCorners(*cameras.at(image.camera_id)));
    plan.files.push_back(options.image_path / image.name);
  }
  std::vector<char> rescaled(num_views, 0);
  ForEachFile(static_cast<int64_t>(num_views), [&](int64_t i) {
    const Image& image = model.images[i];
    const fs::path& file = plan.files[i];
    if (!fs::is_regular_file(file)) {
      throw UserError(file.string(),
                      ": is missing, while ",
                      images_file.string(),
                      " has this image; is --image_path the folder that was given to COLMAP?");
    }
    const PhotoHeader header = ReadPhotoHeader(file);
    const PhotoSize size = header.size;
    plan.photo_decoding[i] = header.decoding_bytes;
    const Camera& camera = *cameras.at(image.camera_id);
    const PhotoSize camera_size = {static_cast<int>(camera.width), static_cast<int>(camera.height)};
    if (!SameAspect(size, camera_size)) {
      throw UserError(file.string(),
                      ": is ",
                      size.width,
                      " x ",
                      size.height,
                      " pixels, while its camera (",
                      camera.id,
                      ") has ",
                      camera_size.width,
                      " x ",
                      camera_size.height,
                      "; the photo that COLMAP saw, or a smaller copy of it, neither turned nor "
                      "cropped, would be right.");
    }
    rescaled[i] = size != camera_size;
    plan.file_sizes[i] = size;
    const PhotoSize reduced = ReducedSize(size, options.max_image_size);
    const bool held_out = options.test_every > 0 && i % options.test_every == 0;
    const Camera simulated = SimulatedCamera(camera, options.distortion);
    plan.photos[i] = MakePhotoRecord(reduced != camera_size
                                         ? RescaledCamera(simulated, reduced.width, reduced.height)
                                         : simulated,
                                     image,
                                     held_out);
  });
  for (size_t i = 0; i < num_views; ++i) {
    plan.num_reduced += plan.photos[i].width < plan.file_sizes[i].width;
  }
  plan.num_rescaled = static_cast<int>(std::count(rescaled.begin(), rescaled.end(), 1));
  plan.num_unregistered = CountUnregistered(options.image_path, plan.photos);

  std::vector<std::string> names;
  names.reserve(plan.photos.size());
  for (const PhotoRecord& photo : plan.photos) names.push_back(photo.name);
  plan.mask_folder = MaskFolderOf(options);
  if (plan.mask_folder.empty()) {
    plan.masks.masks.resize(num_views);
  } else {
    plan.masks = PairMasks(plan.mask_folder, names);
    ForEachFile(static_cast<int64_t>(num_views), [&](int64_t i) {
      const fs::path& mask = plan.masks.masks[i];
      if (!mask.empty()) plan.mask_decoding[i] = ReadMaskHeader(mask).decoding_bytes;
    });
  }
  plan.masks_are_given = options.use_masks && !options.mask_path.empty();
  if (plan.masks_are_given) RequireMasks(plan.masks, plan.mask_folder);
  plan.labels_file = FindLabelsFile(options.labels_path, plan.mask_folder);
  if (options.use_masks && plan.masks.NumPaired() == 0 && plan.labels_are_given) {
    throw UserError(options.labels_path.string(),
                    ": names labels, while there are no masks: ",
                    plan.mask_folder.empty() ? "neither object_mask/ nor Annotations/ is beside "
                                               "the photos; --mask_path would name their folder"
                                             : NoMaskIn(plan.mask_folder),
                    ".");
  }
  AppendWarnings(
      {OtherModelsWarning(options.input_path, model_folder, static_cast<int64_t>(num_views)),
       UnregisteredWarning(
           options.image_path, plan.num_unregistered, static_cast<int64_t>(num_views)),
       ReprojectionWarning(model_folder, model),
       options.use_masks && plan.masks.NumPaired() == 0
           ? NoMasksWarning(plan.mask_folder, WorkspacesOf(options))
           : ""},
      &plan.warnings);
  plan.world_from_normalized = NormalizedFrameOf(model);
  plan.tracks = SampleTracks(model, plan.photos, options.random_seed);
  plan.lenses = LensOfPhotos(model, plan.photos);
  plan.num_points = static_cast<int64_t>(model.points.size());
  SeenImages seen;
  if (plan.masks.NumPaired() > 0 && plan.mask_consistency != MaskConsistency::kOff) {
    seen = FindSeenImages(model.images, model.cameras, plan.photos);
  }
  MakeSeeds(
      std::move(model.points), plan.world_from_normalized, seen, &plan.seeds, &plan.seed_tracks);
  plan.table_views = ChooseTables(plan.photos);
  return plan;
}

void TrainingScene::PlaceCameras() {
  std::map<CameraKey, std::shared_ptr<const PixelRays>> rays;
  for (const int view : plan_.table_views) {
    const PhotoRecord& photo = plan_.photos[view];
    rays[KeyOf(photo)] = std::make_shared<PixelRays>(CameraOfView(photo), /*tabulate=*/true);
  }
  for (int view = 0; view < NumViews(); ++view) {
    const PhotoRecord& photo = plan_.photos[view];
    std::shared_ptr<const PixelRays>& shared = rays[KeyOf(photo)];
    if (!shared) shared = std::make_shared<PixelRays>(CameraOfView(photo), /*tabulate=*/false);
    const Pose pose = PoseOf(photo);
    views_[view].rays = shared;
    views_[view].origin = plan_.world_from_normalized.Invert(pose.Center());
    views_[view].world_from_cam = pose.UnitRotation().toRotationMatrix().transpose();
  }
}

std::string TrainingScene::MaskReport() const {
  const int paired = plan_.masks.NumPaired();
  if (paired == 0) return "no masks: colour and geometry only, without labels";
  const auto objects = std::count_if(
      labels_.begin(), labels_.end(), [](const Label& label) { return label.id != 0; });
  std::ostringstream text;
  text << paired << " of " << views_.size() << (views_.size() == 1 ? " photo" : " photos")
       << (paired == 1 && views_.size() == 1 ? " has" : " have") << " a mask, "
       << Plural(objects, "label") << ", " << Plural(plan_.masks.unused.size(), "mask")
       << " unused";
  return text.str();
}

std::string TrainingScene::NoIdsSentence() const {
  const std::vector<Label>& labels = mask_classes_.labels;
  const bool has_ids = std::any_of(
      labels.begin(), labels.end(), [](const Label& label) { return label.source_id != 0; });
  const int paired = plan_.masks.NumPaired();
  if (has_ids || paired == 0) return "";
  return plan_.mask_folder.string() + ": its " + Plural(paired, "mask") +
         (paired == 1 ? " has" : " have") +
         " no id but 0, which is no object; an id for each object would be right.";
}

std::vector<std::string> TrainingScene::Warnings() const {
  std::vector<PhotoSize> mask_sizes;
  mask_sizes.reserve(mask_contents_.size());
  for (const MaskContents& mask : mask_contents_) mask_sizes.push_back(mask.size);
  std::vector<std::string> warnings;
  AppendWarnings(
      {NoIdsSentence(), MaskSizeWarning(plan_.masks, mask_sizes, plan_.file_sizes), names_warning_},
      &warnings);
  return warnings;
}

std::string TrainingScene::PhotoReport() const {
  const auto held_out = std::count_if(plan_.photos.begin(),
                                      plan_.photos.end(),
                                      [](const PhotoRecord& photo) { return photo.held_out; });
  std::ostringstream text;
  text << Plural(NumViews(), "photo");
  if (held_out > 0) text << ", " << held_out << " held out";
  if (plan_.num_unregistered > 0) text << ", " << plan_.num_unregistered << " more not registered";
  if (plan_.num_rescaled > 0) text << ", " << plan_.num_rescaled << " rescaled";
  if (plan_.num_reduced > 0) text << ", " << plan_.num_reduced << " reduced";
  text << "; " << plan_.seeds.size() << " of " << plan_.num_points << " SfM points";
  return text.str();
}

}  // namespace semfoam
