// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask_import/mask_import.h"

#include "foam/util/error.h"
#include "plugin/mask/mask_folder_writer.h"
#include "plugin/mask/mask_pairing.h"
#include "plugin/mask_import/photo_matching.h"
#include "plugin/mask_import/region_features.h"
#include "plugin/mask_import/stroke_growing.h"
#include "plugin/photo/size_text.h"
#include "plugin/util/files.h"
#include "plugin/util/plural.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

constexpr MaskOrigin kImport = {"imported_from", "an import of masks"};
// A mask may be of a larger photo than the one that is trained on, but no picture is believed to be
// of any size that a number can say.
constexpr int kMostEnlarged = 16;

// Returns the size that a picture is drawn in. Throws UserError where it is none of this photo.
PhotoSize SizeOfMask(const ImportedPicture& picture, const fs::path& photo) {
  const PhotoSize photo_size = ReadPhotoSize(photo);
  const PhotoSize size = picture.size == PhotoSize{} ? photo_size : picture.size;
  if (!SameAspect(size, photo_size)) {
    throw UserError(picture.file.string(),
                    ": the mask of ",
                    photo.filename().string(),
                    " has ",
                    SizeText(size),
                    " pixels, the photo ",
                    SizeText(photo_size),
                    "; the same shape, not stretched and not cropped, would be right.");
  }
  if (size.width > kMostEnlarged * photo_size.width) {
    throw UserError(picture.file.string(),
                    ": the mask of ",
                    photo.filename().string(),
                    " claims ",
                    SizeText(size),
                    " pixels, more than ",
                    kMostEnlarged,
                    " times those of the photo along each side; is it damaged?");
  }
  const uint64_t pixels = static_cast<uint64_t>(size.width) * static_cast<uint64_t>(size.height);
  RequireDecodingMemory(picture.file, size, sizeof(int32_t) * pixels);
  return size;
}

LabelImage Draw(const ImportedPicture& picture,
                const std::vector<int32_t>& ids,
                const PhotoSize& size) {
  if (picture.regions.empty()) return PaintRegions(size, {}, {});
  return PaintRegions(size, picture.draw(size), ids);
}

// Returns what the format tells of the regions of a picture, by ids, in the order of the regions:
// only of `shown` ids. The score of several regions of one id and class is their mean, as they have
// become one; where their classes differ, the first has the word.
MaskFeatures FeaturesOf(const ImportedPicture& picture,
                        const std::vector<int32_t>& ids,
                        const std::vector<std::string>& names,
                        const std::set<int32_t>& shown) {
  MaskFeatures features;
  std::map<int32_t, size_t> place;
  std::vector<int> num_scores;
  for (size_t r = 0; r < picture.regions.size(); ++r) {
    if (!shown.contains(ids[r])) continue;
    const ImportedRegion& region = picture.regions[r];
    const std::string name = region.name < 0 ? "" : names[region.name];
    const auto [found, is_new] = place.emplace(ids[r], features.regions.size());
    if (is_new) {
      features.regions.push_back({MaskId{static_cast<uint32_t>(ids[r])}, name, region.score});
      num_scores.push_back(region.score ? 1 : 0);
      continue;
    }
    RegionFeatures& same = features.regions[found->second];
    int& count = num_scores[found->second];
    if (!region.score || name != same.class_name) continue;
    same.score = (same.score.value_or(0) * count + *region.score) / (count + 1);
    ++count;
  }
  return features;
}

// Writes the regions' classes and scores into the folder where they tell more than the names of the
// labels do; else removes those of an import before.
void WriteFeatures(const fs::path& folder,
                   const std::map<int32_t, std::string>& label_names,
                   const FeaturesOfMasks& features) {
  bool tell_more = false;
  for (const auto& [mask, of_mask] : features) {
    for (const RegionFeatures& region : of_mask.regions) {
      const std::string& label = label_names.at(static_cast<int32_t>(Value(region.id)));
      tell_more |= region.score || (!region.class_name.empty() && region.class_name != label);
    }
  }
  if (tell_more) {
    WriteRegionFeatures(folder, features);
  } else if (const fs::path older = FindRegionFeatures(folder); !older.empty()) {
    fs::remove(older);
  }
}

// What the mask of a picture with strokes is grown from: these, and its areas, in the size of the
// result, so that those of many photos take little memory.
MarkedPhoto MarksOf(const ImportedPicture& picture,
                    const std::vector<int32_t>& ids,
                    const fs::path& photo) {
  MarkedPhoto marked{photo, SizeOfMask(picture, photo), {}, {}};
  for (const Stroke& stroke : picture.strokes) {
    marked.marks.push_back({ids[stroke.region], stroke.points, stroke.is_box});
  }
  const std::vector<PixelRuns> runs = picture.draw(marked.size);
  if (std::any_of(runs.begin(), runs.end(), [](const PixelRuns& area) { return !area.empty(); })) {
    marked.known =
        ResizeLabels(PaintRegions(marked.size, runs, ids), ReducedSize(marked.size, kGrownSide));
  }
  return marked;
}

// The share of the pixels that have a label.
double ShareOfLabels(const std::vector<LabelImage>& masks) {
  double labelled = 0, pixels = 0;
  for (const LabelImage& mask : masks) {
    labelled += static_cast<double>(mask.data.size()) -
                static_cast<double>(std::count(mask.data.begin(), mask.data.end(), 0));
    pixels += static_cast<double>(mask.data.size());
  }
  return pixels > 0 ? labelled / pixels : 0;
}

MaskTable TableOf(const MaskImport& import, const NumberedRegions& numbered) {
  MaskTable table;
  table.made_from = import.format;
  // What no stroke claims may be anything, a background too.
  table.zero_is_unlabelled = import.num_grown > 0;
  for (const ImportedLabel& label : import.labels) {
    table.labels.emplace(label.id, label.name);
    const auto original = numbered.original_ids.find(label.id);
    if (original != numbered.original_ids.end()) table.original_ids.insert(*original);
  }
  return table;
}

}  // namespace

std::vector<std::string> PhotoNames(const fs::path& image_path) {
  if (!fs::is_directory(image_path)) {
    throw UserError(image_path.string(),
                    ": there is no such folder; it should hold the photos of the masks.");
  }
  std::vector<std::string> names;
  for (const fs::path& photo : ListPhotos(image_path)) {
    names.push_back(photo.lexically_relative(image_path).generic_string());
  }
  if (names.empty()) {
    throw UserError(image_path.string(), ": holds no photos, to which the masks could belong.");
  }
  return names;
}

MaskImport ImportMasks(const RecognizedMasks& recognized,
                       const fs::path& image_path,
                       const std::vector<std::string>& photo_names,
                       SameName same_name,
                       const fs::path& output_path) {
  const ImportedMasks masks = ReadMasks(recognized);
  const std::string source =
      recognized.files.size() == 1 ? recognized.files[0].string() : recognized.folder.string();
  std::vector<std::string> names;
  for (const ImportedPicture& picture : masks.pictures) names.push_back(picture.name);
  const PhotoMatching matching = MatchPhotos(source, names, photo_names);
  const NumberedRegions numbered = NumberRegions(source, masks, same_name);

  MaskImport import;
  import.format = masks.format;
  import.num_photos = static_cast<int>(photo_names.size());
  import.matched_how = matching.how;
  import.are_independent = numbered.are_independent;
  import.left_out = masks.left_out;
  std::vector<size_t> taken;
  for (size_t i = 0; i < names.size(); ++i) {
    if (matching.photos[i] >= 0) {
      taken.push_back(i);
    } else {
      import.without_photo.push_back(names[i]);
    }
  }
  import.num_masks = static_cast<int>(taken.size());
  const std::vector<std::string> all_mask_names = NamesForMasks(photo_names);
  std::vector<std::string> mask_names;
  for (const size_t i : taken) mask_names.push_back(all_mask_names[matching.photos[i]]);
  const MaskFolderWriter writer(output_path, kImport, mask_names);

  std::vector<size_t> with_strokes, grown_of(taken.size());
  for (size_t k = 0; k < taken.size(); ++k) {
    if (masks.pictures[taken[k]].strokes.empty()) continue;
    grown_of[k] = with_strokes.size();
    with_strokes.push_back(taken[k]);
  }
  std::vector<MarkedPhoto> marked(with_strokes.size());
  ForEachFile(static_cast<int64_t>(marked.size()), [&](int64_t k) {
    const size_t i = with_strokes[k];
    marked[k] =
        MarksOf(masks.pictures[i], numbered.ids[i], image_path / photo_names[matching.photos[i]]);
  });
  const std::vector<LabelImage> grown = GrowMarks(marked);
  import.num_grown = static_cast<int>(grown.size());
  import.grown_share = ShareOfLabels(grown);

  std::vector<std::set<int32_t>> shown(taken.size());
  std::vector<MaskFeatures> features(taken.size());
  ForEachFile(static_cast<int64_t>(taken.size()), [&](int64_t k) {
    const size_t i = taken[k];
    const ImportedPicture& picture = masks.pictures[i];
    const fs::path photo = image_path / photo_names[matching.photos[i]];
    const LabelImage image = picture.strokes.empty()
                                 ? Draw(picture, numbered.ids[i], SizeOfMask(picture, photo))
                                 : grown[grown_of[k]];
    int32_t last = 0;
    for (const int32_t id : image.data) {
      if (id != last && id != 0) shown[k].insert(id);
      last = id;
    }
    features[k] = FeaturesOf(picture, numbered.ids[i], masks.names, shown[k]);
    writer.Write(k, image);
  });
  std::map<int32_t, int> num_photos;
  for (const std::set<int32_t>& ids : shown) {
    for (const int32_t id : ids) ++num_photos[id];
  }
  std::vector<std::string> hidden;
  for (const auto& [id, name] : numbered.names) {
    if (num_photos.contains(id)) {
      import.labels.push_back({id, name, num_photos[id]});
    } else {
      hidden.push_back(name);
    }
  }
  if (!hidden.empty()) {
    import.warnings.push_back("No pixel is left of " + FirstNames(hidden) +
                              ": without a photo, or under other regions.");
  }
  if (!numbered.numbered.empty()) {
    import.warnings.push_back(
        "Some photos have several regions of " + FirstNames(numbered.numbered) +
        ", which are numbered photo by photo: a training corrects that by the SfM tracks as far as "
        "it can; an export with track ids would be right, or same_name one where they are parts "
        "of one object.");
  }
  FeaturesOfMasks features_of_masks;
  for (size_t k = 0; k < taken.size(); ++k) {
    features_of_masks.emplace(mask_names[k], std::move(features[k]));
  }
  WriteFeatures(output_path, numbered.names, features_of_masks);
  writer.Finish(TableOf(import, numbered));
  return import;
}

std::vector<std::string> DescribeImport(const MaskImport& import) {
  std::vector<std::string> lines;
  lines.push_back(import.format + ": masks of " + std::to_string(import.num_masks) + " of " +
                  Plural(import.num_photos, "photo") + ", matched " + import.matched_how + "; " +
                  Plural(static_cast<int64_t>(import.labels.size()), "label"));
  if (import.num_grown > 0) {
    lines.push_back("Masks of " + Plural(import.num_grown, "photo") + " are grown from strokes: " +
                    std::to_string(std::lround(100 * import.grown_share)) +
                    " % of their pixels are clear; the others stay unlabelled");
  }
  std::vector<std::string> left_out = import.left_out;
  if (!import.without_photo.empty()) {
    left_out.push_back(Plural(static_cast<int64_t>(import.without_photo.size()), "mask") +
                       " without a photo (" + FirstNames(import.without_photo) + ")");
  }
  std::string text;
  for (const std::string& part : left_out) text += (text.empty() ? "" : "; ") + part;
  if (!text.empty()) lines.push_back("Left out: " + text);
  if (import.are_independent) {
    lines.push_back(
        "Ids mean nothing from photo to photo; a training matches them by the SfM tracks");
  }
  return lines;
}

}  // namespace semfoam
