// SPDX-License-Identifier: GPL-3.0-or-later
//
// The features of a TrainingScene's labels.
#include "foam/util/error.h"
#include "plugin/dataset/label_features.h"
#include "plugin/dataset/training_scene.h"
#include "plugin/mask_import/region_features.h"
#include "plugin/util/files.h"
#include "plugin/util/plural.h"

#include <algorithm>
#include <map>
#include <span>
#include <utility>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

// The number of pixels by the class that a mask gives them, and that of the corrected mask.
using PixelsByClasses = std::map<std::pair<ClassIndex, ClassIndex>, int64_t>;

// Of two masks of the same size; pixels that are unlabelled in either are left out.
PixelsByClasses CountPixels(const ClassImage& given, const ClassImage& corrected, size_t pixels) {
  PixelsByClasses counts;
  for (size_t i = 0; i < pixels; ++i) {
    if (given[i] == kUnlabelled || corrected[i] == kUnlabelled) continue;
    ++counts[{given[i], corrected[i]}];
  }
  return counts;
}

// Returns a sentence about entries that say nothing; empty where there is none.
std::string UnusedFeaturesWarning(const fs::path& file,
                                  const std::vector<std::string>& masks_without_photo,
                                  int64_t regions_without_pixels) {
  if (masks_without_photo.empty() && regions_without_pixels == 0) return "";
  std::string text = file.string() + ": ";
  if (!masks_without_photo.empty()) {
    text += Plural(static_cast<int64_t>(masks_without_photo.size()), "mask") +
            " that it tells of " + (masks_without_photo.size() == 1 ? "is" : "are") +
            " of no photo (" + FirstNames(masks_without_photo) + ")";
  }
  if (regions_without_pixels > 0) {
    text += (masks_without_photo.empty() ? "" : ", and ") +
            Plural(regions_without_pixels, "region") +
            (regions_without_pixels == 1 ? " has" : " have") + " no pixel in the masks";
  }
  return text + "; names and ids of the masks beside it would be right.";
}

// Reads the embeddings of one mask after another, which all must have the same length.
class EmbeddingReader {
 public:
  // `folder` is that of the masks.
  explicit EmbeddingReader(const fs::path& folder) : folder_(folder) {}

  // Returns those of one mask, none where it has none. Throws UserError as ReadRegionEmbeddings
  // does, and where their length is another one than before.
  RegionEmbeddings Read(const MaskFeatures& mask) {
    if (mask.embeddings.empty()) return {};
    const fs::path file = folder_ / mask.embeddings;
    RegionEmbeddings embeddings = ReadRegionEmbeddings(file, mask.regions.size());
    if (dimension_ == 0) {
      dimension_ = embeddings.dimension;
      first_file_ = file;
    }
    if (dimension_ != embeddings.dimension) {
      throw UserError(file.string(),
                      ": its embeddings have ",
                      embeddings.dimension,
                      embeddings.dimension == 1 ? " number" : " numbers",
                      " each, those of ",
                      first_file_.string(),
                      " ",
                      dimension_,
                      "; embeddings by one encoder for all masks would be right.");
    }
    return embeddings;
  }

 private:
  const fs::path& folder_;
  size_t dimension_ = 0;
  fs::path first_file_;
};

}  // namespace

void TrainingScene::AverageRegionFeatures() {
  if (plan_.features_file.empty() || labels_.empty()) return;
  FeaturesOfMasks features = ReadRegionFeatures(plan_.features_file);
  // [views] Those of masks that training uses.
  std::vector<MaskFeatures> of_view(views_.size());
  for (int view = 0; view < NumViews(); ++view) {
    if (!HasMask(view)) continue;
    const fs::path name = plan_.masks.masks[view].lexically_relative(plan_.mask_folder);
    auto entry = features.extract(name.generic_string());
    if (entry && !IsHeldOut(view)) of_view[view] = std::move(entry.mapped());
  }
  std::vector<std::string> without_photo;
  for (const auto& [mask, entry] : features) without_photo.push_back(mask);

  std::vector<PixelsByClasses> pixels(views_.size());
  ForEachFile(NumViews(), most_open_views_, [&](int64_t i) {
    if (of_view[i].regions.empty()) return;
    const auto view = static_cast<int>(i);
    const PhotoSize size = {Width(view), Height(view)};
    IdImage indices = DecodeMaskAgain(plan_.masks.masks[view], size, mask_contents_[view]).indices;
    const ClassImage given = ClassesOf(indices,
                                       mask_classes_.Of(mask_contents_[view]),
                                       static_cast<int>(mask_classes_.labels.size()));
    pixels[i] = CountPixels(given,
                            ClassesOfMask(view, std::move(indices)),
                            static_cast<size_t>(size.width) * static_cast<size_t>(size.height));
  });

  // In the order of the photos and their regions, so that sums do not depend on threads.
  std::vector<LabelFeatureMean> means(labels_.size());
  EmbeddingReader reader(plan_.mask_folder);
  int64_t without_pixels = 0;
  for (int view = 0; view < NumViews(); ++view) {
    const RegionEmbeddings embeddings = reader.Read(of_view[view]);
    const std::vector<ClassIndex> classes = mask_classes_.Of(mask_contents_[view]);
    for (size_t r = 0; r < of_view[view].regions.size(); ++r) {
      const RegionFeatures& region = of_view[view].regions[r];
      const auto given = mask_classes_.class_of_id.find(region.id);
      if (given == mask_classes_.class_of_id.end() ||
          std::find(classes.begin(), classes.end(), given->second) == classes.end()) {
        ++without_pixels;
        continue;
      }
      for (auto count = pixels[view].lower_bound({given->second, ClassIndex{0}});
           count != pixels[view].end() && count->first.first == given->second;
           ++count) {
        means[Value(count->first.second)].Add(count->second, region, embeddings.Row(r));
      }
    }
  }
  for (size_t k = 0; k < labels_.size(); ++k) labels_[k].features = means[k].Mean();
  features_warning_ = UnusedFeaturesWarning(plan_.features_file, without_photo, without_pixels);
}

}  // namespace semfoam
