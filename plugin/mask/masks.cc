// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask/masks.h"

#include "foam/util/error.h"
#include "foam/util/input_file.h"
#include "plugin/mask/mask_png.h"
#include "plugin/mask/mask_tables.h"
#include "plugin/util/files.h"

#include <algorithm>
#include <cstdlib>
#include <map>
#include <set>
#include <span>
#include <unordered_map>

#include <glog/logging.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

constexpr size_t kMaxClasses = 65535;

bool IsGrey(uint32_t rgb) { return (rgb & 0xff) == (rgb >> 8 & 0xff) && (rgb & 0xff) == rgb >> 16; }

// Finds the place of each value in the order of their first occurrence.
class IdTable {
 public:
  IdTable(const fs::path& path, MaskContents* contents) : path_(path), contents_(*contents) {}

  uint16_t IndexOf(uint32_t value) {
    // Masks are runs of one value: most pixels need no look-up.
    if (contents_.ids.empty() || value != last_value_) {
      const auto [entry, is_new] =
          index_of_.try_emplace(value, static_cast<uint16_t>(contents_.ids.size()));
      if (is_new) Add(value);
      last_value_ = value;
      last_index_ = entry->second;
    }
    return last_index_;
  }

 private:
  void Add(uint32_t value) {
    if (contents_.ids.size() == kMaxClasses) {
      throw UserError(path_.string(),
                      ": has more than ",
                      kMaxClasses,
                      " ids, where one for each object would be right; is it a photo, or a "
                      "resampled mask?");
    }
    contents_.ids.push_back(value);
  }

  const fs::path& path_;
  MaskContents& contents_;
  std::unordered_map<uint32_t, uint16_t> index_of_;
  uint32_t last_value_ = 0;
  uint16_t last_index_ = 0;
};

// The pixel of a mask in which the centre of a photo's pixel falls, along one axis:
// floor((i + 1/2) mask / photo).
int64_t MaskPixel(int64_t i, int mask, int photo) { return (2 * i + 1) * mask / (2 * photo); }

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

std::vector<std::string> NamesForMasks(const std::vector<std::string>& photo_names) {
  std::vector<std::string> short_names, whole_names;
  for (const std::string& photo : photo_names) {
    const std::vector<std::string> names = MaskNames(photo);
    whole_names.push_back(names[0]);
    short_names.push_back(names[1]);
  }
  const std::set<std::string> all(short_names.begin(), short_names.end());
  bool are_their_own = all.size() == photo_names.size();
  for (size_t i = 0; i < photo_names.size(); ++i) {
    const std::vector<std::string> names = MaskNames(photo_names[i]);
    const auto found = std::find_if(
        names.begin(), names.end(), [&](const std::string& name) { return all.contains(name); });
    are_their_own &= *found == short_names[i];
  }
  return are_their_own ? short_names : whole_names;
}

ClassImage::ClassImage(size_t num_pixels, int num_classes) {
  if (BytesPerPixel(num_classes) == 1) {
    narrow_.assign(num_pixels, kNarrowNone);
  } else {
    wide_.assign(num_pixels, kWideNone);
  }
}

void ClassImage::Widen(int num_classes) {
  if (narrow_.empty() || BytesPerPixel(num_classes) == 1) return;
  wide_.reserve(narrow_.size());
  for (const uint8_t c : narrow_) wide_.push_back(c == kNarrowNone ? kWideNone : c);
  narrow_ = {};
}

void ClassImage::Set(size_t pixel, int32_t class_index) {
  if (!narrow_.empty()) {
    narrow_[pixel] = class_index < 0 ? kNarrowNone : static_cast<uint8_t>(class_index);
  } else {
    wide_[pixel] = class_index < 0 ? kWideNone : static_cast<uint16_t>(class_index);
  }
}

DecodedMask DecodeMask(const fs::path& path, const PhotoSize& photo_size) {
  DecodedMask mask;
  mask.indices = ClassImage(photo_size, /*num_classes=*/1);
  IdTable table(path, &mask.contents);
  std::vector<int64_t> columns(photo_size.width);
  std::vector<uint16_t> row;
  int64_t photo_y = 0;
  size_t pixel = 0;
  const MaskHeader header =
      ReadMaskRows(path, [&](const MaskHeader& header, int y, std::span<const uint32_t> values) {
        if (y == 0) {
          row.resize(values.size());
          for (int x = 0; x < photo_size.width; ++x) {
            columns[x] = MaskPixel(x, header.size.width, photo_size.width);
          }
        }
        for (size_t x = 0; x < values.size(); ++x) {
          row[x] = table.IndexOf(values[x]);
          mask.contents.num_zero += values[x] == 0;
        }
        mask.indices.Widen(static_cast<int>(mask.contents.ids.size()));
        for (; photo_y < photo_size.height &&
               MaskPixel(photo_y, header.size.height, photo_size.height) == y;
             ++photo_y) {
          for (const int64_t x : columns) mask.indices.Set(pixel++, row[x]);
        }
      });
  mask.contents.size = header.size;
  mask.contents.is_rgb = header.is_rgb;
  CheckAspect(path, header.size, photo_size);
  return mask;
}

ClassImage ClassesOf(const ClassImage& indices,
                     const std::vector<int32_t>& classes,
                     int num_classes) {
  ClassImage image(indices.NumPixels(), num_classes);
  for (size_t i = 0; i < indices.NumPixels(); ++i) image.Set(i, classes[indices[i]]);
  return image;
}

DecodedMask DecodeMaskAgain(const fs::path& path,
                            const PhotoSize& photo_size,
                            const MaskContents& contents) {
  DecodedMask mask = DecodeMask(path, photo_size);
  if (mask.contents.ids == contents.ids) return mask;
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

std::vector<int32_t> MaskClasses::Of(const MaskContents& mask) const {
  std::vector<int32_t> of_ids;
  for (const uint32_t id : mask.ids) {
    const auto found = class_of_id.find(mask.is_rgb && colors_are_grey ? id & 0xff : id);
    of_ids.push_back(found == class_of_id.end() ? kUnlabelled : found->second);
  }
  return of_ids;
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
