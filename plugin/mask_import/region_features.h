// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/util/ids.h"

#include <cstddef>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

namespace semfoam {

// Reads and writes what detectors and encoders say about the regions of masks: the class and score
// of a region (Grounded-SAM), and a vector that describes it (CLIP). region_features.json in the
// folder of the masks holds
//   {"version": 1, "masks": {"a/b.png": {
//     "regions": [{"id": 7, "class": "mug", "score": 0.87}, {"id": 9}], "embeddings": "a/b.npy"}}}
// Masks are named relative to that folder, and so are the files of embeddings, each a .npy of real
// numbers [regions][dimension], in the order of "regions". All but "id" may be left out.

// One region: all pixels of one id in one mask.
struct RegionFeatures {
  MaskId id{0};
  // Empty: none.
  std::string class_name;
  // >= 0; nothing: none.
  std::optional<double> score;
};

struct MaskFeatures {
  // Each id once.
  std::vector<RegionFeatures> regions;
  // Relative to the folder of the masks; empty: none.
  std::string embeddings;
};

// By the names of the masks.
using FeaturesOfMasks = std::map<std::string, MaskFeatures>;

// Returns the file in a folder of masks; empty where there is none.
std::filesystem::path FindRegionFeatures(const std::filesystem::path& mask_folder);

// Throws UserError, one sentence naming the file and the place in it, where it has another form.
FeaturesOfMasks ReadRegionFeatures(const std::filesystem::path& file);

// Writes the file into a folder of masks.
void WriteRegionFeatures(const std::filesystem::path& mask_folder, const FeaturesOfMasks& features);

// Returns the names of all classes.
std::set<std::string> ClassesIn(const FeaturesOfMasks& features);

// Rows of float32, one for each region.
struct RegionEmbeddings {
  // >= 1.
  size_t dimension = 0;
  // [regions][dimension] Finite; no row is all 0.
  std::vector<float> values;

  // Returns the row of a region; empty where there are no embeddings.
  std::span<const float> Row(size_t region) const {
    return std::span(values).subspan(region * dimension, dimension);
  }
};

// Reads the embeddings of one mask. Throws UserError, one sentence naming the file, where it is
// missing, damaged, of other elements than real numbers, not [num_regions][dimension], or has a row
// that is all 0 or not finite.
RegionEmbeddings ReadRegionEmbeddings(const std::filesystem::path& file, size_t num_regions);

}  // namespace semfoam
