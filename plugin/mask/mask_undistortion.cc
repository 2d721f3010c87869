// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask/mask_undistortion.h"

#include "foam/image/image.h"
#include "foam/model/model.h"
#include "foam/util/error.h"
#include "foam/util/ids.h"
#include "plugin/colmap/camera_rays.h"
#include "plugin/mask/class_image.h"
#include "plugin/mask/ignored_pixels.h"
#include "plugin/mask/label_naming.h"
#include "plugin/mask/mask_classes.h"
#include "plugin/mask/mask_consistency.h"
#include "plugin/mask/mask_folder_writer.h"
#include "plugin/mask/mask_pairing.h"
#include "plugin/mask/mask_png.h"
#include "plugin/mask/mask_tables.h"
#include "plugin/mask/masked_photos.h"
#include "plugin/photo/size_text.h"
#include "plugin/util/files.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>
#include <numeric>
#include <system_error>
#include <utility>

#include <glog/logging.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

constexpr MaskOrigin kUndistortion = {"undistorted_from", "an undistortion of masks"};
// Poses are copied, by text models to some digits: a tenth of a pixel at a focal length of 1000.
constexpr double kMostTurn = 1e-4;  // radians
// Of ignored pixels; white, in programs that show 16 bits.
constexpr int32_t kKept = 65535;

PhotoSize SizeOf(const Camera& camera) {
  return {static_cast<int>(camera.width), static_cast<int>(camera.height)};
}

// Throws UserError where the two cameras of a photo are not those before and after
// image_undistorter.
void RequireUndistorted(const PhotoRecord& original,
                        const fs::path& original_folder,
                        const PhotoRecord& undistorted,
                        const fs::path& undistorted_folder) {
  if (IsDistorted(CameraOf(undistorted, undistorted_folder))) {
    throw UserError(undistorted_folder.string(),
                    ": the camera of ",
                    undistorted.name,
                    " has distortion (",
                    undistorted.camera_model,
                    "); the model that image_undistorter wrote, with PINHOLE cameras, would be "
                    "right.");
  }
  const double turn =
      original.cam_from_world_rotation.angularDistance(undistorted.cam_from_world_rotation);
  if (turn <= kMostTurn) return;
  throw UserError(undistorted_folder.string(),
                  ": the camera of ",
                  undistorted.name,
                  " is turned by ",
                  turn * 180 / std::numbers::pi,
                  " degrees from where ",
                  original_folder.string(),
                  " has it, whereas image_undistorter keeps poses; the model that it was given, "
                  "and the one that it wrote, would be right.");
}

// Throws UserError where a mask cannot be of the photo before it was undistorted.
void RequireOriginalMask(const fs::path& path, const UndistortedPhoto& photo) {
  const PhotoSize size = ReadMaskHeader(path).size;
  const PhotoSize original = SizeOf(photo.original);
  const bool same_aspect = SameAspect(size, original);
  const bool is_undistorted = size == SizeOf(photo.undistorted) && size != original &&
                              (!same_aspect || DifferAsByUndistortion(size, original));
  if (same_aspect && !is_undistorted) return;
  throw UserError(path.string(),
                  ": is ",
                  SizeText(size),
                  is_undistorted ? " pixels, as the undistorted photo, and the original photo "
                                 : " pixels and the original photo ",
                  SizeText(original),
                  "; a mask of the original photo would be right.");
}

void RequireOtherFolder(const fs::path& mask_folder, const fs::path& output_path) {
  std::error_code error;
  if (!fs::equivalent(mask_folder, output_path, error)) return;
  throw UserError(output_path.string(),
                  ": is the folder of the masks themselves, which would be lost; another one would "
                  "be right.");
}

// The masks of the photos that have one.
struct TakenMasks {
  // Indices into UndistortedPhotos::photos.
  std::vector<size_t> photos;
  // [photos] Relative to the folder of the results.
  std::vector<std::string> names;
};

// Takes the masks of photos that both models have, by their `files` [OriginalNames()], and checks
// their sizes. `name_masks` returns the names of the results for those of all undistorted photos.
TakenMasks TakeMasks(
    const UndistortedPhotos& photos,
    const fs::path& mask_folder,
    const std::vector<fs::path>& files,
    const std::function<std::vector<std::string>(const std::vector<std::string>& photo_names)>&
        name_masks,
    MaskUndistortion* result) {
  TakenMasks taken;
  std::vector<std::string> photo_names;
  for (const UndistortedPhoto& photo : photos.photos) photo_names.push_back(photo.name);
  photo_names.insert(
      photo_names.end(), photos.only_undistorted.begin(), photos.only_undistorted.end());
  const std::vector<std::string> names = name_masks(photo_names);
  for (size_t i = 0; i < files.size(); ++i) {
    if (files[i].empty()) continue;
    if (i < photos.photos.size()) {
      taken.photos.push_back(i);
      taken.names.push_back(names[i]);
    } else {
      result->without_photo.push_back(files[i].lexically_relative(mask_folder).generic_string());
    }
  }
  if (taken.photos.empty()) {
    throw UserError(mask_folder.string(),
                    ": no mask is of a photo that the undistorted model has; masks of ",
                    photos.photos.front().name,
                    " and others of its photos would be right.");
  }
  ForEachFile(static_cast<int64_t>(taken.photos.size()), [&](int64_t k) {
    RequireOriginalMask(files[taken.photos[k]], photos.photos[taken.photos[k]]);
  });
  return taken;
}

// Writes all masks of `taken`, in parallel, and `table`. `value_of(k)` reads the k-th mask and
// returns the function that tells the value of each of its pixels; `size_of(k)` is the size at
// which it does.
void WriteUndistorted(
    const UndistortedPhotos& photos,
    const TakenMasks& taken,
    const MaskFolderWriter& writer,
    const MaskTable& table,
    const std::function<PhotoSize(size_t k)>& size_of,
    const std::function<std::function<int32_t(int64_t pixel)>(size_t k)>& value_of,
    MaskUndistortion* result) {
  std::vector<int64_t> outside(taken.photos.size()), pixels(taken.photos.size());
  ForEachFile(static_cast<int64_t>(taken.photos.size()), [&](int64_t k) {
    const UndistortedPhoto& photo = photos.photos[taken.photos[k]];
    const PhotoSize original_size = size_of(k);
    const PhotoSize size = SizeOf(photo.undistorted);
    const std::function<int32_t(int64_t pixel)> value = value_of(k);
    LabelImage image{size.width, size.height, {}};
    image.data.reserve(static_cast<size_t>(size.width) * static_cast<size_t>(size.height));
    for (int y = 0; y < size.height; ++y) {
      for (int x = 0; x < size.width; ++x) {
        const int64_t source = SourcePixel(photo, original_size, x, y);
        outside[k] += source == kOutsideOfPhoto;
        image.data.push_back(source == kOutsideOfPhoto ? 0 : value(source));
      }
    }
    pixels[k] = static_cast<int64_t>(image.data.size());
    writer.Write(k, image);
  });
  writer.Finish(table);
  result->num_masks = static_cast<int>(taken.photos.size());
  result->share_outside =
      static_cast<double>(std::accumulate(outside.begin(), outside.end(), int64_t{0})) /
      static_cast<double>(std::accumulate(pixels.begin(), pixels.end(), int64_t{0}));
}

// Returns the names of the new masks' ids, and the ids that the masks had before.
MaskTable TableOf(const fs::path& labels_file, const MaskClasses& classes) {
  MaskTable table;
  table.made_from = "masks of the photos before image_undistorter";
  table.zero_is_unlabelled = !classes.class_of_id.contains(kZeroMaskId);
  for (const Label& label : classes.labels) {
    if (Value(label.id) == static_cast<int64_t>(Value(label.source_id))) continue;
    table.original_ids.emplace(Value(label.id), Value(label.source_id));
  }
  if (labels_file.empty()) return table;
  std::vector<Label> labels = classes.labels;
  NameLabels(labels_file, &labels);
  for (const Label& label : labels) {
    if (!label.name.empty()) table.labels.emplace(Value(label.id), label.name);
  }
  // Names of ids that no mask has are kept as they are, such as that of an unlabelled 0.
  if (!table.original_ids.empty()) return table;
  for (const LabelName& name : ReadLabelNames(labels_file)) {
    if (Value(name.source_id) > kMaxMaskClasses) continue;
    table.labels.emplace(static_cast<int32_t>(Value(name.source_id)), name.name);
  }
  return table;
}

}  // namespace

std::vector<std::string> UndistortedPhotos::OriginalNames() const {
  std::vector<std::string> names;
  for (const UndistortedPhoto& photo : photos) names.push_back(photo.name);
  names.insert(names.end(), only_original.begin(), only_original.end());
  return names;
}

UndistortedPhotos PairUndistorted(const Reconstruction& original,
                                  const fs::path& original_folder,
                                  const Reconstruction& undistorted,
                                  const fs::path& undistorted_folder) {
  UndistortedPhotos result;
  std::map<std::string, PhotoRecord> originals;
  for (PhotoRecord& photo : RegisteredPhotos(original)) {
    originals.emplace(photo.name, std::move(photo));
  }
  for (const PhotoRecord& photo : RegisteredPhotos(undistorted)) {
    const auto found = originals.find(photo.name);
    if (found == originals.end()) {
      result.only_undistorted.push_back(photo.name);
      continue;
    }
    RequireUndistorted(found->second, original_folder, photo, undistorted_folder);
    result.photos.push_back({photo.name,
                             CameraOf(found->second, original_folder),
                             CameraOf(photo, undistorted_folder)});
    originals.erase(found);
  }
  if (result.photos.empty()) {
    throw UserError(undistorted_folder.string(),
                    ": has no photo of ",
                    original_folder.string(),
                    " by its name; the model that image_undistorter wrote when it was given that "
                    "one would be right.");
  }
  for (const auto& [name, photo] : originals) result.only_original.push_back(name);
  return result;
}

int64_t SourcePixel(const UndistortedPhoto& photo, const PhotoSize& original_size, int x, int y) {
  const auto ray = Unproject(photo.undistorted, {x + 0.5, y + 0.5});
  const auto place = ray ? Project(photo.original, *ray) : std::nullopt;
  if (!place) return kOutsideOfPhoto;
  // Centres of pixels of a photo that was halved lie on such borders.
  constexpr double kRounding = 1e-9;
  const double column = std::floor(
      place->x() * original_size.width / static_cast<double>(photo.original.width) + kRounding);
  const double row = std::floor(
      place->y() * original_size.height / static_cast<double>(photo.original.height) + kRounding);
  if (!(column >= 0 && row >= 0 && column < original_size.width && row < original_size.height)) {
    return kOutsideOfPhoto;
  }
  return static_cast<int64_t>(row) * original_size.width + static_cast<int64_t>(column);
}

MaskUndistortion UndistortMasks(const UndistortedPhotos& photos,
                                const fs::path& mask_folder,
                                const fs::path& labels_file,
                                const fs::path& output_path) {
  RequireOtherFolder(mask_folder, output_path);
  MaskPairing pairing = PairMasks(mask_folder, photos.OriginalNames());
  RequireMasks(pairing, mask_folder);
  MaskUndistortion result;
  for (const fs::path& mask : pairing.unused) {
    result.without_photo.push_back(mask.lexically_relative(mask_folder).generic_string());
  }
  const TakenMasks taken = TakeMasks(photos, mask_folder, pairing.masks, NamesForMasks, &result);
  const MaskFolderWriter writer(output_path, kUndistortion, taken.names);

  std::vector<PhotoRecord> records;
  MaskPairing taken_pairing;
  for (const size_t i : taken.photos) {
    PhotoRecord& record = records.emplace_back();
    record.name = photos.photos[i].name;
    record.width = static_cast<int>(photos.photos[i].original.width);
    record.height = static_cast<int>(photos.photos[i].original.height);
    taken_pairing.masks.push_back(pairing.masks[i]);
  }
  const MaskedPhotos masks = LoadMaskedPhotos(/*model=*/nullptr,
                                              std::move(records),
                                              taken_pairing,
                                              mask_folder,
                                              LabelZero::kAuto,
                                              MaskConsistency::kOff);
  const MaskTable table = TableOf(labels_file, masks.given);
  result.zero_is_class = !table.zero_is_unlabelled;
  result.num_renumbered = static_cast<int>(table.original_ids.size());
  const auto size_of = [&](size_t k) {
    return PhotoSize{masks.photos[k].width, masks.photos[k].height};
  };
  const auto value_of = [&](size_t k) {
    return
        [&labels = masks.given.labels, mask = masks.GivenMask(static_cast<int>(k))](int64_t pixel) {
          const ClassIndex index = mask[pixel];
          return index == kUnlabelled ? 0 : Value(labels[Value(index)].id);
        };
  };
  WriteUndistorted(photos, taken, writer, table, size_of, value_of, &result);
  return result;
}

MaskUndistortion UndistortIgnoredPixels(const UndistortedPhotos& photos,
                                        const fs::path& ignore_folder,
                                        const std::vector<fs::path>& files,
                                        bool inverted,
                                        const fs::path& output_path) {
  CHECK_EQ(files.size(), photos.photos.size() + photos.only_original.size());
  RequireOtherFolder(ignore_folder, output_path);
  MaskUndistortion result;
  const auto colmap_names = [](std::vector<std::string> names) {
    for (std::string& name : names) name += ".png";
    return names;
  };
  const TakenMasks taken = TakeMasks(photos, ignore_folder, files, colmap_names, &result);
  const MaskFolderWriter writer(output_path, kUndistortion, taken.names);
  const auto size_of = [&](size_t k) { return SizeOf(photos.photos[taken.photos[k]].original); };
  const auto value_of = [&](size_t k) {
    const PhotoSize size = size_of(k);
    return [width = size.width,
            pixels = ReadIgnoredPixels(files[taken.photos[k]], size, inverted)](int64_t pixel) {
      const bool ignored =
          pixels.Contains(static_cast<int>(pixel % width), static_cast<int>(pixel / width));
      return ignored ? 0 : kKept;
    };
  };
  MaskTable table;
  table.made_from = "binary masks of the photos before image_undistorter";
  WriteUndistorted(photos, taken, writer, table, size_of, value_of, &result);
  return result;
}

}  // namespace semfoam
