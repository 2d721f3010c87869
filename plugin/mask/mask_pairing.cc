// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask/mask_pairing.h"

#include "foam/util/error.h"
#include "plugin/mask/mask_folders.h"
#include "plugin/photo/size_text.h"

#include <algorithm>
#include <cstdlib>
#include <map>
#include <set>

#include <glog/logging.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

// Returns the names that a photo's mask may have, the most specific first.
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

// Undistorted photos differ from what the camera saw by less than this share of their sides, masks
// that were reduced on purpose by more.
constexpr double kUndistortedShare = 0.1;

}  // namespace

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

bool HavePhotos(const fs::path& mask_folder, const std::vector<std::string>& photo_names) {
  const std::map<std::string, fs::path> all = ListMasks(mask_folder);
  return std::any_of(photo_names.begin(), photo_names.end(), [&](const std::string& photo) {
    const std::vector<std::string> names = MaskNames(photo);
    return std::any_of(
        names.begin(), names.end(), [&](const std::string& name) { return all.contains(name); });
  });
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

bool DifferAsByUndistortion(const PhotoSize& a, const PhotoSize& b) {
  const auto is_near = [](int x, int y) { return std::abs(x - y) < kUndistortedShare * y; };
  return a != b && is_near(a.width, b.width) && is_near(a.height, b.height);
}

std::string MaskSizeWarning(const MaskPairing& pairing,
                            const std::vector<PhotoSize>& mask_sizes,
                            const std::vector<PhotoSize>& photo_sizes) {
  CHECK_EQ(pairing.masks.size(), mask_sizes.size());
  CHECK_EQ(pairing.masks.size(), photo_sizes.size());
  int count = 0;
  size_t first = 0;
  for (size_t i = pairing.masks.size(); i-- > 0;) {
    if (pairing.masks[i].empty() || !DifferAsByUndistortion(mask_sizes[i], photo_sizes[i])) {
      continue;
    }
    ++count;
    first = i;
  }
  if (count == 0) return "";
  return std::to_string(count) + " of " + std::to_string(pairing.NumPaired()) +
         " masks seem to be of photos that were not yet undistorted, the first of them " +
         pairing.masks[first].string() + ", " + SizeText(mask_sizes[first]) +
         " pixels for a photo of " + SizeText(photo_sizes[first]) +
         "; masks made of the undistorted photos, or by mask_undistorter, would be right.";
}

}  // namespace semfoam
