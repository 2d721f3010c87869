// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/masks/mask_writers.h"

#include "export/scene/names.h"
#include "foam/util/error.h"
#include "foam/util/json_file.h"
#include "foam/util/output_file.h"
#include "plugin/mask/label_png.h"
#include "plugin/mask/mask_pairing.h"
#include "plugin/mask_import/pixel_runs.h"
#include "plugin/mask_import/run_lengths.h"
#include "tools/cli/input_protection.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>

#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

using Json = nlohmann::ordered_json;

constexpr int32_t kLargestPaletteId = 255;
constexpr const char* kCocoFile = "instances.json";
constexpr const char* kLabelsFile = "labels.json";
// The key by which the JSON files of this command are known.
constexpr const char* kRenderedKey = "rendered_from";
constexpr const char* kRenderedFrom = "Semantic Foam";

void RequireOwnJson(const fs::path& file) {
  if (!fs::exists(file)) return;
  bool is_own = false;
  try {
    is_own = ReadJsonFile(file).contains(kRenderedKey);
  } catch (const UserError&) {
    // It is none of ours.
  }
  if (!is_own) {
    throw UserError(file.string(),
                    ": was not written by this command and would be lost; give another ",
                    Field{"output_path"},
                    ".");
  }
}

void WriteLabels(const fs::path& folder, const std::vector<Label>& labels) {
  Json json;
  json["version"] = 1;
  json[kRenderedKey] = kRenderedFrom;
  json["labels"] = Json::object();
  for (const Label& label : labels) {
    if (label.id == kNoObject) continue;
    json["labels"][std::to_string(Value(label.id))] = OneLine(DisplayName(label.id, label.name));
  }
  WriteTextFile(folder / kLabelsFile, json.dump(2) + "\n");
}

// Writes a PNG for each photo.
class PngWriter final : public MaskWriter {
 public:
  PngWriter(MaskOutput output,
            const fs::path& folder,
            const std::vector<std::string>& photos,
            const std::vector<Label>& labels)
      : folder_(folder), labels_(labels) {
    const std::vector<std::string> names = NamesForMasks(photos);
    std::vector<fs::path> files;
    for (size_t i = 0; i < photos.size(); ++i) {
      names_.emplace(photos[i], names[i]);
      files.push_back(folder / names[i]);
    }
    RequireOwnImages(files);
    if (output != MaskOutput::kPalette) return;
    int32_t largest = 0;
    for (const Label& label : labels) largest = std::max(largest, Value(label.id));
    if (largest > kLargestPaletteId) {
      throw UserError("--format palette holds ids up to ",
                      kLargestPaletteId,
                      ", and there is a label with the id ",
                      largest,
                      "; --format png would be right.");
    }
    for (int32_t id = 0; id <= largest; ++id) colors_.push_back(LabelColor(LabelId{id}));
  }

  void Add(const std::string& photo, const LabelImage& ids) override {
    const fs::path file = folder_ / names_.at(photo);
    if (colors_.empty()) {
      WriteLabelPng(file, ids);
    } else {
      WritePalettePng(file, ids, colors_);
    }
  }

  void Finish() override { WriteLabels(folder_, labels_); }

 private:
  const fs::path folder_;
  const std::vector<Label> labels_;
  std::map<std::string, std::string> names_;
  // Of palette PNGs; else empty.
  std::vector<std::array<uint8_t, 3>> colors_;
};

// The pixels of each id.
std::map<uint32_t, PixelRuns> RunsOf(const LabelImage& ids) {
  return RunsByValue([&](const RowReceiver& on_row) {
    std::vector<uint32_t> row(ids.width);
    for (int y = 0; y < ids.height; ++y) {
      std::copy_n(ids.data.begin() + static_cast<int64_t>(y) * ids.width, ids.width, row.begin());
      on_row(y, row);
    }
  });
}

// [x, y, width, height]
std::array<int64_t, 4> BoxOf(const PixelRuns& runs, int64_t width) {
  int64_t left = width, right = 0;
  for (const PixelRun& run : runs) {
    const bool is_one_row = run.begin / width == (run.end - 1) / width;
    left = std::min(left, is_one_row ? run.begin % width : 0);
    right = std::max(right, is_one_row ? (run.end - 1) % width + 1 : width);
  }
  const int64_t top = runs.front().begin / width;
  return {left, top, right - left, (runs.back().end - 1) / width + 1 - top};
}

// Writes all into one file.
class CocoWriter final : public MaskWriter {
 public:
  CocoWriter(const fs::path& folder, const std::vector<Label>& labels)
      : folder_(folder), labels_(labels) {
    RequireOwnJson(folder / kCocoFile);
    json_["info"] = {{"description", "masks rendered from a foam"}};
    json_[kRenderedKey] = kRenderedFrom;
    for (const char* list : {"images", "categories", "annotations"}) json_[list] = Json::array();
    for (const Label& label : labels) {
      if (label.id == kNoObject) continue;
      json_["categories"].push_back(
          {{"id", Value(label.id)}, {"name", OneLine(DisplayName(label.id, label.name))}});
    }
  }

  void Add(const std::string& photo, const LabelImage& ids) override {
    const auto image_id = static_cast<int64_t>(json_["images"].size()) + 1;
    json_["images"].push_back(
        {{"id", image_id}, {"file_name", photo}, {"width", ids.width}, {"height", ids.height}});
    for (const auto& [id, runs] : RunsOf(ids)) {
      Json annotation;
      annotation["id"] = static_cast<int64_t>(json_["annotations"].size()) + 1;
      annotation["image_id"] = image_id;
      annotation["category_id"] = id;
      annotation["track_id"] = id;
      annotation["iscrowd"] = 0;
      annotation["area"] = AreaOf(runs);
      annotation["bbox"] = BoxOf(runs, ids.width);
      annotation["segmentation"] = {
          {"size", {ids.height, ids.width}},
          {"counts", EncodeRunLengths(LengthsOfRuns(runs, {ids.width, ids.height}))}};
      json_["annotations"].push_back(std::move(annotation));
    }
  }

  void Finish() override {
    WriteTextFile(folder_ / kCocoFile, json_.dump() + "\n");
    WriteLabels(folder_, labels_);
  }

 private:
  const fs::path folder_;
  const std::vector<Label> labels_;
  Json json_;
};

}  // namespace

std::unique_ptr<MaskWriter> MakeMaskWriter(MaskOutput output,
                                           const fs::path& folder,
                                           const std::vector<std::string>& photos,
                                           const std::vector<Label>& labels) {
  RequireOwnJson(folder / kLabelsFile);
  if (output == MaskOutput::kCoco) return std::make_unique<CocoWriter>(folder, labels);
  return std::make_unique<PngWriter>(output, folder, photos, labels);
}

}  // namespace semfoam
