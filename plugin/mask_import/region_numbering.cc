// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask_import/region_numbering.h"

#include "foam/util/error.h"

#include <algorithm>
#include <set>
#include <utility>

namespace semfoam {
namespace {

constexpr int64_t kLargestId = 65535;

// What makes a region the same object as another one. Ordered by it, objects are numbered.
struct ObjectKey {
  // -1 = not tracked.
  int64_t track = -1;
  // Index of the name; -1 = none.
  int32_t name = -1;
  // Among the regions of the picture with the same name.
  int32_t rank = 0;

  auto operator<=>(const ObjectKey&) const = default;
};

std::vector<std::vector<ObjectKey>> KeysOf(const ImportedMasks& masks, SameName same_name) {
  std::vector<std::vector<ObjectKey>> keys;
  for (const ImportedPicture& picture : masks.pictures) {
    std::vector<ObjectKey>& of_picture = keys.emplace_back();
    std::map<int32_t, int32_t> count;
    for (const ImportedRegion& region : picture.regions) {
      if (region.track >= 0) {
        of_picture.push_back({region.track, -1, 0});
      } else if (region.name >= 0 && same_name == SameName::kOne) {
        of_picture.push_back({-1, region.name, 0});
      } else {
        of_picture.push_back({-1, region.name, count[region.name]++});
      }
    }
  }
  return keys;
}

// The id that the format itself gives an object; 0 where it gives none.
int64_t OwnId(const ObjectKey& key, const ImportedMasks& masks, bool all_are_single) {
  if (key.track >= 0) return key.track;
  if (key.name < 0) return int64_t{key.rank} + 1;
  if (!all_are_single) return 0;
  return masks.name_ids.empty() ? int64_t{key.name} + 1 : masks.name_ids[key.name];
}

}  // namespace

NumberedRegions NumberRegions(const std::string& source,
                              const ImportedMasks& masks,
                              SameName same_name) {
  const std::vector<std::vector<ObjectKey>> keys = KeysOf(masks, same_name);
  std::set<ObjectKey> objects;
  // The names of tracked objects, by how often they occur.
  std::map<int64_t, std::map<int32_t, int>> names_of_track;
  std::set<int32_t> names_of_several;
  for (size_t p = 0; p < keys.size(); ++p) {
    for (size_t r = 0; r < keys[p].size(); ++r) {
      objects.insert(keys[p][r]);
      const ImportedRegion& region = masks.pictures[p].regions[r];
      if (region.track >= 0 && region.name >= 0) ++names_of_track[region.track][region.name];
      if (keys[p][r].name >= 0 && keys[p][r].rank > 0) names_of_several.insert(keys[p][r].name);
    }
  }
  if (static_cast<int64_t>(objects.size()) > kLargestId) {
    throw UserError(source,
                    ": has ",
                    objects.size(),
                    " objects, where at most ",
                    kLargestId,
                    " would be right.");
  }
  std::map<ObjectKey, int32_t> ids;
  std::set<int64_t> used;
  bool keeps_ids = true;
  for (const ObjectKey& key : objects) {
    const int64_t id = OwnId(key, masks, names_of_several.empty());
    keeps_ids &= 1 <= id && id <= kLargestId && used.insert(id).second;
    ids.emplace(key, static_cast<int32_t>(keeps_ids ? id : 0));
  }
  if (!keeps_ids) {
    int32_t next = 1;
    for (auto& [key, id] : ids) id = next++;
  }
  NumberedRegions numbered;
  numbered.are_independent = !objects.empty();
  for (const auto& [key, id] : ids) {
    int32_t name = key.name;
    if (const auto found = names_of_track.find(key.track); found != names_of_track.end()) {
      name = std::max_element(found->second.begin(), found->second.end(), [](auto& a, auto& b) {
               return a.second < b.second;
             })->first;
    }
    std::string text = name < 0 ? "label_" : masks.names[name];
    if (name < 0) text += std::to_string(id);
    if (names_of_several.contains(key.name)) text.append("_").append(std::to_string(key.rank + 1));
    numbered.names.emplace(id, std::move(text));
    if (key.track >= 0 && key.track != id) numbered.original_ids.emplace(id, key.track);
    numbered.are_independent &= key.track < 0 && key.name < 0;
  }
  for (const std::vector<ObjectKey>& of_picture : keys) {
    std::vector<int32_t>& of_regions = numbered.ids.emplace_back();
    for (const ObjectKey& key : of_picture) of_regions.push_back(ids.at(key));
  }
  for (const int32_t name : names_of_several) numbered.numbered.push_back(masks.names[name]);
  return numbered;
}

}  // namespace semfoam
