// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask_import/photo_matching.h"

#include "foam/util/error.h"
#include "foam/util/input_file.h"

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <map>
#include <numeric>
#include <optional>
#include <regex>
#include <set>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

// With "/" between folders, whatever system wrote it.
fs::path PathOf(std::string name) {
  std::replace(name.begin(), name.end(), '\\', '/');
  return fs::path(name).lexically_normal();
}

// The file names of photos that a mask's may stand for, with or without extension, the most literal
// first.
std::vector<std::string> SpellingsOf(const fs::path& mask) {
  static const std::regex kRoboflow(R"((.*)_(jpe?g|png|tiff?|bmp|webp)\.rf\.[0-9A-Za-z]+(\..*)?)",
                                    std::regex::icase);
  static const std::regex kLabelStudio(R"([0-9a-f]{8}-(.+))");
  static const std::regex kSuffix(R"((.+)[._-](mask|masks|seg|label|labels))", std::regex::icase);
  std::vector<std::string> spellings;
  const auto add = [&](const std::string& name) {
    if (std::find(spellings.begin(), spellings.end(), name) == spellings.end()) {
      spellings.push_back(name);
    }
  };
  const auto add_all = [&](const std::string& file) {
    add(file);
    const std::string stem = fs::path(file).stem().string();
    add(stem);
    std::smatch match;
    if (std::regex_match(stem, match, kSuffix)) add(match[1]);
    if (stem.starts_with("mask_")) add(stem.substr(5));
  };
  const std::string file = mask.filename().string();
  if (file.size() > 1024) return {file};  // no expression is matched against what is no name
  add_all(file);
  std::smatch match;
  if (std::regex_match(file, match, kRoboflow)) add(match[1]);
  if (std::regex_match(file, match, kLabelStudio)) add_all(match[1]);
  return spellings;
}

// The number of folders that two paths have in common, from the file on.
int CommonFolders(const fs::path& a, const fs::path& b) {
  std::vector<std::string> of_a, of_b;
  for (const fs::path& part : a.parent_path()) of_a.push_back(part.string());
  for (const fs::path& part : b.parent_path()) of_b.push_back(part.string());
  int common = 0;
  while (common < static_cast<int>(std::min(of_a.size(), of_b.size())) &&
         of_a[of_a.size() - 1 - common] == of_b[of_b.size() - 1 - common]) {
    ++common;
  }
  return common;
}

// The last number in the name of a file.
std::optional<int64_t> FrameNumber(const fs::path& path) {
  const std::string stem = path.stem().string();
  constexpr const char* kDigits = "0123456789";
  const size_t last = stem.find_last_of(kDigits);
  if (last == std::string::npos) return std::nullopt;
  const size_t before = stem.find_last_not_of(kDigits, last);
  const size_t first = before == std::string::npos ? 0 : before + 1;
  int64_t number = 0;
  const auto [end, error] = std::from_chars(stem.data() + first, stem.data() + last + 1, number);
  return error == std::errc() ? std::optional(number) : std::nullopt;
}

// Numbers of the frames; nothing unless all have one, and each its own.
std::optional<std::map<int64_t, int>> FrameNumbers(const std::vector<fs::path>& paths) {
  std::map<int64_t, int> numbers;
  for (size_t i = 0; i < paths.size(); ++i) {
    const std::optional<int64_t> number = FrameNumber(paths[i]);
    if (!number || !numbers.emplace(*number, static_cast<int>(i)).second) return std::nullopt;
  }
  return numbers;
}

class Matcher {
 public:
  Matcher(const std::string& source,
          const std::vector<std::string>& names,
          const std::vector<std::string>& photo_names)
      : source_(source), names_(names), photo_names_(photo_names) {
    for (const std::string& name : names) masks_.push_back(PathOf(name));
    for (const std::string& name : photo_names) photos_.push_back(PathOf(name));
    for (size_t i = 0; i < photos_.size(); ++i) {
      photos_of_file_[photos_[i].filename().string()].push_back(static_cast<int>(i));
      photos_of_stem_[photos_[i].stem().string()].push_back(static_cast<int>(i));
    }
  }

  PhotoMatching Match() const {
    PhotoMatching matching{{}, "by name"};
    for (size_t i = 0; i < masks_.size(); ++i) matching.photos.push_back(PhotoOf(i));
    const bool found = std::any_of(
        matching.photos.begin(), matching.photos.end(), [](int photo) { return photo >= 0; });
    if (!found && !masks_.empty()) MatchFrames(&matching);
    RequireOneEach(matching);
    return matching;
  }

 private:
  int PhotoOf(size_t mask) const {
    for (const std::string& spelling : SpellingsOf(masks_[mask])) {
      for (const auto* photos : {&photos_of_file_, &photos_of_stem_}) {
        const auto found = photos->find(spelling);
        if (found != photos->end()) return NearestOf(mask, found->second);
      }
    }
    return -1;
  }

  int NearestOf(size_t mask, const std::vector<int>& candidates) const {
    int best = -1, most = -1;
    bool is_tie = false;
    for (const int photo : candidates) {
      const int common = CommonFolders(masks_[mask], photos_[photo]);
      is_tie = common == most || (is_tie && common < most);
      if (common > most) {
        best = photo;
        most = common;
      }
    }
    if (is_tie) {
      throw UserError(source_,
                      ": the mask ",
                      Shortened(names_[mask]),
                      " may be of ",
                      photo_names_[candidates[0]],
                      " and of ",
                      photo_names_[candidates[1]],
                      "; a name with the folders of its photo would be right.");
    }
    return best;
  }

  void MatchFrames(PhotoMatching* matching) const {
    const auto of_masks = FrameNumbers(masks_), of_photos = FrameNumbers(photos_);
    if (of_masks && of_photos) {
      const bool all_are_there =
          std::all_of(of_masks->begin(), of_masks->end(), [&](const auto& mask) {
            return of_photos->contains(mask.first);
          });
      if (all_are_there) {
        for (const auto& [number, mask] : *of_masks) matching->photos[mask] = of_photos->at(number);
        matching->how = "by frame number";
        return;
      }
      if (of_masks->size() == of_photos->size()) {
        auto photo = of_photos->begin();
        for (const auto& [number, mask] : *of_masks) matching->photos[mask] = (photo++)->second;
        matching->how = "in their order";
        return;
      }
    }
    throw UserError(source_,
                    ": none of the ",
                    names_.size(),
                    " masks has the name or frame number of a photo; ",
                    photos_.empty()
                        ? std::string("there are no photos")
                        : photos_[0].stem().string() + " would be right for " + photo_names_[0] +
                              ", " + Shortened(names_[0]) + " is there",
                    ".");
  }

  void RequireOneEach(const PhotoMatching& matching) const {
    std::map<int, size_t> mask_of_photo;
    for (size_t i = 0; i < matching.photos.size(); ++i) {
      if (matching.photos[i] < 0) continue;
      const auto [other, is_new] = mask_of_photo.emplace(matching.photos[i], i);
      if (is_new) continue;
      throw UserError(source_,
                      ": the masks ",
                      Shortened(names_[other->second]),
                      " and ",
                      Shortened(names_[i]),
                      " are both of ",
                      photo_names_[matching.photos[i]],
                      "; one for each photo, without augmentation, would be right.");
    }
  }

  const std::string& source_;
  const std::vector<std::string>& names_;
  const std::vector<std::string>& photo_names_;
  std::vector<fs::path> masks_;
  std::vector<fs::path> photos_;
  std::map<std::string, std::vector<int>> photos_of_file_;
  std::map<std::string, std::vector<int>> photos_of_stem_;
};

}  // namespace

PhotoMatching MatchPhotos(const std::string& source,
                          const std::vector<std::string>& names,
                          const std::vector<std::string>& photo_names) {
  return Matcher(source, names, photo_names).Match();
}

bool NamesPhotosWithFolders(const std::vector<std::string>& names,
                            const std::vector<std::string>& photo_names) {
  std::set<std::string> photos;
  for (const std::string& name : photo_names) {
    const fs::path path = PathOf(name);
    photos.insert(path.generic_string());
    photos.insert((path.parent_path() / path.stem()).generic_string());
  }
  return std::any_of(names.begin(), names.end(), [&](const std::string& name) {
    const fs::path path = PathOf(name);
    return photos.contains((path.parent_path() / path.stem()).generic_string());
  });
}

}  // namespace semfoam
