// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask_import/region_features.h"

#include "foam/util/error.h"
#include "foam/util/input_file.h"
#include "foam/util/json_file.h"
#include "foam/util/output_file.h"
#include "foam/util/photo_name.h"
#include "plugin/mask_import/json_field.h"
#include "plugin/mask_import/npy_file.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

constexpr const char* kFileName = "region_features.json";
constexpr int kVersion = 1;
// Vectors of known encoders have 512 to 4096 numbers.
constexpr int64_t kLargestDimension = 65536;

RegionFeatures ReadRegion(const JsonField& field) {
  RegionFeatures region;
  region.id =
      MaskId{static_cast<uint32_t>(field["id"].Integer(0, std::numeric_limits<uint32_t>::max()))};
  if (field.Has("class")) region.class_name = field["class"].Text();
  if (field.Has("score")) {
    region.score = field["score"].Number();
    if (!(*region.score >= 0)) field["score"].Fail("a number from 0 on");
  }
  return region;
}

MaskFeatures ReadMask(const JsonField& field) {
  MaskFeatures mask;
  std::set<MaskId> ids;
  const JsonField regions = field["regions"];
  for (size_t i = 0; i < regions.Size(); ++i) {
    const RegionFeatures region = ReadRegion(regions[i]);
    if (!ids.insert(region.id).second) {
      regions[i]["id"].FailBecause(
          "is the id of another region of this mask, too; one region for each id would be right");
    }
    mask.regions.push_back(region);
  }
  if (field.Has("embeddings")) {
    mask.embeddings = field["embeddings"].Text();
    if (!StaysBelowFolder(mask.embeddings)) {
      field["embeddings"].Fail("a .npy below the folder of the masks");
    }
  }
  return mask;
}

std::string ShapeText(const std::vector<int64_t>& shape) {
  std::string text;
  for (const int64_t side : shape) text += (text.empty() ? "" : " x ") + std::to_string(side);
  return text.empty() ? "a single number" : text;
}

}  // namespace

fs::path FindRegionFeatures(const fs::path& mask_folder) {
  if (mask_folder.empty()) return {};
  const fs::path file = mask_folder / kFileName;
  return fs::is_regular_file(file) ? file : fs::path();
}

FeaturesOfMasks ReadRegionFeatures(const fs::path& file) {
  const nlohmann::json json = ReadJsonFile(file);
  const JsonField root(file, json);
  if (root.Has("version")) root["version"].Integer(kVersion, kVersion);
  const JsonField masks = root["masks"];
  if (!masks.IsObject()) masks.Fail(R"(an object, {"a.png": {"regions": [{"id": 7}]}},)");
  FeaturesOfMasks features;
  for (const auto& [name, value] : masks.value().items()) {
    features.emplace(name, ReadMask(masks[name.c_str()]));
  }
  return features;
}

void WriteRegionFeatures(const fs::path& mask_folder, const FeaturesOfMasks& features) {
  nlohmann::ordered_json masks = nlohmann::ordered_json::object();
  for (const auto& [name, mask] : features) {
    nlohmann::ordered_json regions = nlohmann::ordered_json::array();
    for (const RegionFeatures& region : mask.regions) {
      nlohmann::ordered_json& entry = regions.emplace_back();
      entry["id"] = Value(region.id);
      if (!region.class_name.empty()) entry["class"] = region.class_name;
      if (region.score) entry["score"] = *region.score;
    }
    masks[name]["regions"] = regions;
    if (!mask.embeddings.empty()) masks[name]["embeddings"] = mask.embeddings;
  }
  const nlohmann::ordered_json json = {{"version", kVersion}, {"masks", masks}};
  WriteTextFile(mask_folder / kFileName,
                json.dump(1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n");
}

std::set<std::string> ClassesIn(const FeaturesOfMasks& features) {
  std::set<std::string> classes;
  for (const auto& [name, mask] : features) {
    for (const RegionFeatures& region : mask.regions) {
      if (!region.class_name.empty()) classes.insert(region.class_name);
    }
  }
  return classes;
}

RegionEmbeddings ReadRegionEmbeddings(const fs::path& file, size_t num_regions) {
  const NpyArray array = ParseNpy(
      file, ReadFileBytes(file, "a .npy of the regions' embeddings"), NpyElements::kRealNumbers);
  const std::vector<int64_t>& shape = array.shape;
  const auto rows = static_cast<int64_t>(num_regions);
  if (shape.size() != 2 || shape[0] != rows || shape[1] < 1 || shape[1] > kLargestDimension) {
    throw UserError(file.string(),
                    ": its array is of ",
                    ShapeText(shape),
                    ", where ",
                    rows,
                    " x dimension, a row for each region that region_features.json lists, would "
                    "be right.");
  }
  RegionEmbeddings embeddings;
  embeddings.dimension = static_cast<size_t>(shape[1]);
  embeddings.values.reserve(num_regions * embeddings.dimension);
  for (int64_t row = 0; row < rows; ++row) {
    float largest = 0;
    for (int64_t i = 0; i < shape[1]; ++i) {
      const double value = array.RealAt(array.fortran_order ? row + rows * i : row * shape[1] + i);
      if (!(std::abs(value) <= double{std::numeric_limits<float>::max()})) {
        throw UserError(file.string(),
                        ": row ",
                        row,
                        " of its array holds a number that is not finite in float32; finite "
                        "ones would be right.");
      }
      embeddings.values.push_back(static_cast<float>(value));
      largest = std::max(largest, std::abs(embeddings.values.back()));
    }
    if (!(largest > 0)) {
      throw UserError(file.string(),
                      ": row ",
                      row,
                      " of its array is all 0, which has no direction; leave out regions without "
                      "an embedding.");
    }
  }
  return embeddings;
}

}  // namespace semfoam
