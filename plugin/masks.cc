// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/masks.h"

#include "foam/error.h"
#include "foam/input_file.h"
#include "plugin/files.h"
#include "plugin/mask_png.h"
#include "plugin/mask_tables.h"

#include <algorithm>
#include <cstdlib>
#include <map>
#include <set>
#include <unordered_map>

#include <glog/logging.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

constexpr size_t kMaxClasses = 65535;

bool IsGrey(uint32_t rgb) { return (rgb & 0xff) == (rgb >> 8 & 0xff) && (rgb & 0xff) == rgb >> 16; }

DecodedMask Decode(const fs::path& path) {
  const MaskPng png = ReadMaskPng(path);
  DecodedMask mask;
  mask.size = {png.width, png.height};
  mask.is_rgb = png.is_rgb;
  mask.pixels.reserve(png.values.size());
  std::unordered_map<uint32_t, uint16_t> index_of;
  // Masks are runs of one value: most pixels need no look-up.
  uint32_t last_value = 0;
  uint16_t last_index = 0;
  for (const uint32_t value : png.values) {
    if (mask.ids.empty() || value != last_value) {
      const auto [entry, is_new] =
          index_of.try_emplace(value, static_cast<uint16_t>(mask.ids.size()));
      if (is_new) {
        if (mask.ids.size() == kMaxClasses) {
          throw UserError(path.string(),
                          ": has more than ",
                          kMaxClasses,
                          " ids, where one for each object would be right; is it a photo, or a "
                          "resampled mask?");
        }
        mask.ids.push_back(value);
      }
      last_value = value;
      last_index = entry->second;
    }
    mask.pixels.push_back(last_index);
  }
  return mask;
}

// Long ids and nothing between them: interpolated colours are no ids.
void CheckPredictedIds(const fs::path& mask_folder,
                       const std::vector<fs::path>& paths,
                       const std::vector<MaskContents>& masks) {
  const fs::path file = FindPredictions(mask_folder);
  if (file.empty()) return;
  const std::set<uint32_t> predicted = ReadPredictedIds(file);
  for (size_t i = 0; i < masks.size(); ++i) {
    if (!masks[i].is_rgb) continue;
    const auto unknown = std::count_if(masks[i].ids.begin(), masks[i].ids.end(), [&](uint32_t id) {
      return id != 0 && !predicted.contains(id);
    });
    if (unknown == 0) continue;
    throw UserError(paths[i].string(),
                    ": has ",
                    unknown,
                    unknown == 1 ? " colour that is no id" : " colours that are no ids",
                    " in pred.json; a mask as DEVA wrote it, not resampled or recompressed, would "
                    "be right.");
  }
}

void CheckAspect(const fs::path& path, const PhotoSize& mask, const PhotoSize& photo) {
  if (SameAspect(mask, photo)) return;
  throw UserError(path.string(),
                  ": is ",
                  mask.width,
                  " x ",
                  mask.height,
                  " pixels and its photo ",
                  photo.width,
                  " x ",
                  photo.height,
                  "; a mask of the photo's aspect would be right, made of the undistorted photo if "
                  "COLMAP undistorted it.");
}

// The names that a photo's mask may have, the most specific first.
std::vector<std::string> MaskNames(const std::string& photo_name) {
  const fs::path photo = fs::path(photo_name).lexically_normal();
  const std::string folder =
      photo.has_parent_path() ? photo.parent_path().generic_string() + "/" : "";
  const std::string file = photo.filename().string();
  std::vector<std::string> names = {folder + file + ".png",
                                    folder + photo.stem().string() + ".png"};
  const size_t first_dot = file.find('.', 1);
  if (first_dot != std::string::npos) names.push_back(folder + file.substr(0, first_dot) + ".png");
  if (file.size() > 4) names.push_back(folder + file.substr(0, file.size() - 4) + ".png");
  return names;
}

// From this share of their pixels on, id 0 is what the masks say, not what they leave out.
constexpr double kBackgroundShare = 0.2;

// Undistorted photos differ from what the camera saw by less than this share of their sides, masks
// that were reduced on purpose by more.
constexpr double kUndistortedShare = 0.1;

bool SeemsDistorted(const PhotoSize& mask, const PhotoSize& photo) {
  const auto is_near = [](int a, int b) { return std::abs(a - b) < kUndistortedShare * b; };
  return mask != photo && is_near(mask.width, photo.width) && is_near(mask.height, photo.height);
}

// The share of all masks' pixels that are 0.
double ShareOfZero(const std::vector<MaskContents>& masks) {
  double zeros = 0, pixels = 0;
  for (const MaskContents& mask : masks) {
    zeros += static_cast<double>(mask.num_zero);
    pixels += static_cast<double>(mask.size.width) * mask.size.height;
  }
  return pixels > 0 ? zeros / pixels : 0;
}

}  // namespace

fs::path FindLabelsFile(const fs::path& labels_path, const fs::path& mask_folder) {
  if (labels_path.empty()) {
    const fs::path file = ParentFolder(mask_folder) / "labels.json";
    return !mask_folder.empty() && fs::is_regular_file(file) ? file : fs::path();
  }
  if (fs::is_regular_file(labels_path)) return labels_path;
  throw UserError(labels_path.string(),
                  ": there is no such file; {\"labels\": {\"7\": \"mug\"}} should be in it.");
}

fs::path FindPredictions(const fs::path& mask_folder) {
  for (const fs::path& file : {mask_folder / "pred.json",
                               fs::absolute(mask_folder).lexically_normal() / ".." / "pred.json"}) {
    if (fs::exists(file)) return file;
  }
  return {};
}

int MaskPairing::NumPaired() const {
  return static_cast<int>(std::count_if(
      masks.begin(), masks.end(), [](const fs::path& mask) { return !mask.empty(); }));
}

void RequireMasks(const MaskPairing& pairing, const fs::path& mask_folder) {
  if (pairing.NumPaired() == 0) throw UserError(NoMaskIn(mask_folder), ".");
}

MaskPairing PairMasks(const fs::path& mask_folder, const std::vector<std::string>& photo_names) {
  if (!fs::is_directory(mask_folder)) {
    throw UserError(mask_folder.string(),
                    ": there is no such folder; it should hold a PNG mask for each photo.");
  }
  const std::map<std::string, fs::path> all = ListMasks(mask_folder);
  std::map<std::string, std::string> photo_of_mask;
  MaskPairing pairing;
  for (const std::string& photo : photo_names) {
    fs::path& mask = pairing.masks.emplace_back();
    for (const std::string& name : MaskNames(photo)) {
      const auto found = all.find(name);
      if (found == all.end()) continue;
      const auto [other, is_free] = photo_of_mask.emplace(name, photo);
      if (!is_free) {
        throw UserError(found->second.string(),
                        ": is by its name the mask of both ",
                        other->second,
                        " and ",
                        photo,
                        "; masks named like ",
                        fs::path(photo).filename().string(),
                        ".png would be right.");
      }
      mask = found->second;
      break;
    }
  }
  for (const auto& [name, path] : all) {
    if (!photo_of_mask.contains(name)) pairing.unused.push_back(path);
  }
  if (photo_of_mask.empty() && !all.empty() && !photo_names.empty()) {
    throw UserError(mask_folder.string(),
                    ": none of the ",
                    all.size(),
                    " masks has the name of a photo; ",
                    MaskNames(photo_names.front())[1],
                    " would be right for ",
                    photo_names.front(),
                    ".");
  }
  return pairing;
}

ClassImage::ClassImage(PhotoSize size, int num_classes) {
  const size_t pixels = static_cast<size_t>(size.width) * size.height;
  if (BytesPerPixel(num_classes) == 1) {
    narrow_.assign(pixels, kNarrowNone);
  } else {
    wide_.assign(pixels, kWideNone);
  }
}

void ClassImage::Set(size_t pixel, int32_t class_index) {
  if (!narrow_.empty()) {
    narrow_[pixel] = class_index < 0 ? kNarrowNone : static_cast<uint8_t>(class_index);
  } else {
    wide_[pixel] = class_index < 0 ? kWideNone : static_cast<uint16_t>(class_index);
  }
}

DecodedMask DecodeMask(const fs::path& path, const PhotoSize& photo_size) {
  DecodedMask mask = Decode(path);
  CheckAspect(path, mask.size, photo_size);
  return mask;
}

ClassImage ClassesOf(const DecodedMask& mask,
                     const std::vector<int32_t>& classes,
                     const PhotoSize& photo_size,
                     int num_classes) {
  ClassImage image(photo_size, num_classes);
  std::vector<int64_t> columns(photo_size.width);
  for (int64_t x = 0; x < photo_size.width; ++x) {
    columns[x] = (2 * x + 1) * mask.size.width / (2 * photo_size.width);
  }
  size_t pixel = 0;
  for (int64_t y = 0; y < photo_size.height; ++y) {
    // The mask's pixel in which the centre of the photo's pixel falls: floor((y + 1/2) h' / h).
    const int64_t mask_y = (2 * y + 1) * mask.size.height / (2 * photo_size.height);
    const uint16_t* row = mask.pixels.data() + mask_y * mask.size.width;
    for (const int64_t x : columns) image.Set(pixel++, classes[row[x]]);
  }
  return image;
}

MaskContents ContentsOf(const DecodedMask& mask) {
  MaskContents contents;
  contents.is_rgb = mask.is_rgb;
  contents.ids = mask.ids;
  contents.size = mask.size;
  const auto zero = std::find(mask.ids.begin(), mask.ids.end(), 0u);
  if (zero != mask.ids.end()) {
    const auto index = static_cast<uint16_t>(zero - mask.ids.begin());
    contents.num_zero = std::count(mask.pixels.begin(), mask.pixels.end(), index);
  }
  return contents;
}

DecodedMask DecodeMaskAgain(const fs::path& path,
                            const PhotoSize& photo_size,
                            const MaskContents& contents) {
  DecodedMask mask = DecodeMask(path, photo_size);
  if (mask.ids == contents.ids) return mask;
  throw UserError(path.string(),
                  ": has changed its ids since it was first looked at; masks that stay as they are "
                  "would be right.");
}

std::string MaskSizeWarning(const MaskPairing& pairing,
                            const std::vector<PhotoSize>& mask_sizes,
                            const std::vector<PhotoSize>& photo_sizes) {
  CHECK_EQ(pairing.masks.size(), mask_sizes.size());
  CHECK_EQ(pairing.masks.size(), photo_sizes.size());
  int count = 0;
  size_t first = 0;
  for (size_t i = pairing.masks.size(); i-- > 0;) {
    if (pairing.masks[i].empty() || !SeemsDistorted(mask_sizes[i], photo_sizes[i])) continue;
    ++count;
    first = i;
  }
  if (count == 0) return "";
  const auto text = [](const PhotoSize& size) {
    return std::to_string(size.width) + " x " + std::to_string(size.height);
  };
  return std::to_string(count) + " of " + std::to_string(pairing.NumPaired()) +
         " masks seem to be of photos that were not yet undistorted, the first of them " +
         pairing.masks[first].string() + ", " + text(mask_sizes[first]) +
         " pixels for a photo of " + text(photo_sizes[first]) +
         "; masks made of the undistorted photos would be right.";
}

namespace {

std::vector<int32_t> ClassesOfIds(const MaskClasses& classes,
                                  bool is_rgb,
                                  const std::vector<uint32_t>& ids) {
  std::vector<int32_t> of_ids;
  for (const uint32_t id : ids) {
    const auto found = classes.class_of_id.find(is_rgb && classes.colors_are_grey ? id & 0xff : id);
    of_ids.push_back(found == classes.class_of_id.end() ? kUnlabelled : found->second);
  }
  return of_ids;
}

}  // namespace

std::vector<int32_t> MaskClasses::Of(const DecodedMask& mask) const {
  return ClassesOfIds(*this, mask.is_rgb, mask.ids);
}

std::vector<int32_t> MaskClasses::Of(const MaskContents& mask) const {
  return ClassesOfIds(*this, mask.is_rgb, mask.ids);
}

MaskClasses NumberMasks(const std::vector<MaskContents>& contents,
                        const MaskPairing& pairing,
                        const fs::path& mask_folder,
                        LabelZero label_zero) {
  CHECK_EQ(contents.size(), pairing.masks.size());
  MaskClasses result;
  const bool long_ids = std::any_of(contents.begin(), contents.end(), [](const MaskContents& mask) {
    return mask.is_rgb && !std::all_of(mask.ids.begin(), mask.ids.end(), IsGrey);
  });
  if (long_ids) CheckPredictedIds(mask_folder, pairing.masks, contents);
  result.colors_are_grey = !long_ids;
  std::set<uint32_t> ids;
  for (const MaskContents& mask : contents) {
    for (const uint32_t id : mask.ids) ids.insert(mask.is_rgb && !long_ids ? id & 0xff : id);
  }
  if (label_zero == LabelZero::kIgnore ||
      (label_zero == LabelZero::kAuto && ShareOfZero(contents) < kBackgroundShare)) {
    ids.erase(0);
  }
  if (ids.size() > kMaxClasses) {
    throw UserError(mask_folder.string(),
                    ": the masks have ",
                    ids.size(),
                    " ids, where at most ",
                    kMaxClasses,
                    " are possible; are they resampled, or photos?");
  }
  const bool keep_ids = ids.empty() || *ids.rbegin() <= kMaxClasses;
  int32_t next_id = 1;
  for (const uint32_t id : ids) {
    result.class_of_id.emplace(id, static_cast<int32_t>(result.labels.size()));
    Label label;
    label.source_id = id;
    label.id = keep_ids || id == 0 ? static_cast<int32_t>(id) : next_id++;
    result.labels.push_back(label);
  }
  return result;
}

void NameLabels(const fs::path& labels_file, std::vector<Label>* labels) {
  std::multimap<uint32_t, LabelName> names;  // by the masks' ids
  for (LabelName& name : ReadLabelNames(labels_file)) names.emplace(name.source_id, name);
  for (Label& label : *labels) {
    const auto [begin, end] = names.equal_range(label.source_id);
    if (begin == end) continue;
    const auto same_id = std::find_if(begin, end, [&](const auto& entry) {
      return entry.second.id == static_cast<uint32_t>(label.id);
    });
    label.name = (same_id != end ? same_id : begin)->second.name;
  }
}

std::string UnusedNamesWarning(const fs::path& labels_file, const std::vector<Label>& labels) {
  constexpr size_t kMostNamed = 3;
  std::set<uint32_t> ids = {0};
  for (const Label& label : labels) ids.insert(label.source_id);
  const std::vector<LabelName> names = ReadLabelNames(labels_file);
  size_t unused = 0;
  std::string first;
  for (const LabelName& name : names) {
    if (ids.contains(name.source_id)) continue;
    if (++unused > kMostNamed) continue;
    first += (unused == 1 ? "" : ", ") + std::to_string(name.source_id) + " (" +
             Shortened(name.name) + ")";
  }
  if (unused == 0) return "";
  return labels_file.string() + ": " + std::to_string(unused) + " of its " +
         std::to_string(names.size()) + " names are of ids that no mask has: " + first +
         (unused > kMostNamed ? ", ..." : "") + "; names of the masks' own ids would be right.";
}

}  // namespace semfoam
