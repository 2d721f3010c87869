// SPDX-License-Identifier: GPL-3.0-or-later
//
// The program mask_corrupter: damages instance masks as trackers do.
#include "foam/util/error.h"
#include "foam/util/random.h"
#include "plugin/mask/label_png.h"
#include "plugin/mask/mask_folders.h"
#include "plugin/mask/mask_png.h"
#include "plugin/util/files.h"
#include "tools/cli/input_protection.h"
#include "tools/cli/logging.h"
#include "tools/cli/option_manager.h"
#include "tools/cli/run_command.h"
#include "tools/images/image_files.h"
#include "tools/support/output_lock.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <map>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

constexpr uint64_t kCorruptPurpose = 0x3c0, kRenumberPurpose = 0x3c1;
constexpr int32_t kLargestId = 65535;

enum Kind { kMissing, kMerged, kSwitched, kShifted, kNumKinds };
constexpr const char* kKindNames[kNumKinds] = {"missing", "merged", "switched", "shifted"};

struct Corruption {
  double share = 0;
  bool independent = false;
  uint64_t seed = 0;
};

struct Counts {
  int64_t views = 0;  // (photo, object) pairs
  std::array<int64_t, kNumKinds> of_kind = {};
};

LabelImage ReadIds(const fs::path& path) {
  const MaskPng png = ReadMaskPng(path);
  LabelImage mask{png.width, png.height, {}};
  mask.data.reserve(png.values.size());
  for (const uint32_t value : png.values) {
    if (png.is_rgb || value > kLargestId) {
      throw UserError(path.string(),
                      ": has colours or ids above 65535, where a grey or palette mask would be "
                      "right.");
    }
    mask.data.push_back(static_cast<int32_t>(value));
  }
  return mask;
}

std::vector<int32_t> IdsIn(const LabelImage& mask) {
  std::vector<int32_t> ids = mask.data;
  std::sort(ids.begin(), ids.end());
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
  if (!ids.empty() && ids.front() == 0) ids.erase(ids.begin());
  return ids;
}

// The object moves by a tenth of the photo's diagonal; where it was is nothing.
void Shift(int32_t id, double angle, const LabelImage& before, LabelImage* mask) {
  const double distance = 0.1 * std::hypot(before.width, before.height);
  const int dx = static_cast<int>(std::lround(distance * std::cos(angle)));
  const int dy = static_cast<int>(std::lround(distance * std::sin(angle)));
  const auto at = [&](int x, int y) { return static_cast<size_t>(y) * before.width + x; };
  std::replace(mask->data.begin(), mask->data.end(), id, 0);
  for (int y = std::max(0, dy); y < before.height + std::min(0, dy); ++y) {
    for (int x = std::max(0, dx); x < before.width + std::min(0, dx); ++x) {
      if (before.data[at(x - dx, y - dy)] == id) mask->data[at(x, y)] = id;
    }
  }
}

// Each object of the photo is damaged or not by a draw of its own, so that the damage of a small
// share is part of the damage of a larger one.
void Corrupt(const Corruption& corruption, size_t photo, LabelImage* mask, Counts* counts) {
  const LabelImage before = *mask;
  const std::vector<int32_t> ids = IdsIn(before);
  for (const int32_t id : ids) {
    ++counts->views;
    CounterRandom random(corruption.seed, kCorruptPurpose, photo * (uint64_t{kLargestId} + 1) + id);
    if (random.Uniform() >= corruption.share) continue;
    const Kind kind = static_cast<Kind>(random.Below(kNumKinds));
    const int32_t other = ids[random.Below(static_cast<uint32_t>(ids.size()))];
    const double angle = 2 * std::numbers::pi * random.Uniform();
    ++counts->of_kind[kind];
    switch (kind) {
      case kMissing:
        std::replace(mask->data.begin(), mask->data.end(), id, 0);
        break;
      case kMerged:
        std::replace(mask->data.begin(), mask->data.end(), id, other);
        break;
      case kSwitched:
        // The two trade their ids.
        for (size_t i = 0; i < before.data.size(); ++i) {
          if (before.data[i] == id) mask->data[i] = other;
          if (before.data[i] == other) mask->data[i] = id;
        }
        break;
      default:
        Shift(id, angle, before, mask);
    }
  }
}

// New ids 1..n in an order of chance.
void Renumber(const Corruption& corruption, size_t photo, LabelImage* mask) {
  CounterRandom random(corruption.seed, kRenumberPurpose, photo);
  const std::vector<int32_t> ids = IdsIn(*mask);
  std::vector<std::pair<uint64_t, int32_t>> order;
  order.reserve(ids.size());
  for (const int32_t id : ids) order.emplace_back(random.Next(), id);
  std::sort(order.begin(), order.end());
  std::map<int32_t, int32_t> new_id = {{0, 0}};
  for (size_t i = 0; i < order.size(); ++i) {
    new_id[order[i].second] = static_cast<int32_t>(i) + 1;
  }
  for (int32_t& id : mask->data) id = new_id.at(id);
}

void RunMaskCorrupter(int argc, char** argv) {
  std::string mask_path;
  std::string output_path;
  Corruption corruption;
  OptionManager options("mask_corrupter",
                        "Damages instance masks as trackers do, to test what a training makes of "
                        "it: objects go missing, merge, trade their ids, or slip.");
  options.AddRequiredOption("mask_path", &mask_path, "folder of the masks");
  options.AddRequiredOption("output_path", &output_path, "folder for the damaged masks");
  options.AddDefaultOption(
      "share", &corruption.share, "what part of the objects' views to damage, 0 to 1");
  options.AddDefaultOption("independent",
                           &corruption.independent,
                           "also renumber the ids of each mask, in an order of chance");
  if (!options.Parse(argc, argv)) return;
  if (!(corruption.share >= 0 && corruption.share <= 1)) {
    throw UserError(
        "Failed to parse options - --share is ", corruption.share, "; it must be from 0 to 1.");
  }
  if (!fs::is_directory(mask_path)) {
    throw UserError(mask_path, ": there is no such folder; it should hold PNG masks.");
  }
  corruption.seed = options.RandomSeed();
  std::vector<fs::path> masks;
  for (const fs::path& path : ListFiles(mask_path)) {
    if (path.extension() == ".png") masks.push_back(path);
  }
  if (masks.empty()) throw UserError(NoMaskIn(mask_path), ".");
  std::vector<fs::path> targets;
  targets.reserve(masks.size());
  for (const fs::path& mask : masks) {
    targets.push_back(fs::path(output_path) / mask.lexically_relative(mask_path));
  }
  CheckNoInputOverwrite(masks, targets);
  RequireOwnImages(targets);
  const OutputLock lock(output_path);
  std::vector<Counts> counts(masks.size());
  ForEachFile(static_cast<int64_t>(masks.size()), [&](int64_t i) {
    LabelImage mask = ReadIds(masks[i]);
    Corrupt(corruption, i, &mask, &counts[i]);
    if (corruption.independent) Renumber(corruption, i, &mask);
    WriteLabelPng(targets[i], mask);
  });
  Counts sum;
  for (const Counts& one : counts) {
    sum.views += one.views;
    for (int kind = 0; kind < kNumKinds; ++kind) sum.of_kind[kind] += one.of_kind[kind];
  }
  std::printf("%zu masks, %lld views of objects:", masks.size(), static_cast<long long>(sum.views));
  for (int kind = 0; kind < kNumKinds; ++kind) {
    std::printf(" %lld %s%s",
                static_cast<long long>(sum.of_kind[kind]),
                kKindNames[kind],
                kind + 1 < kNumKinds ? "," : "");
  }
  std::printf("%s\n", corruption.independent ? "; ids renumbered in each" : "");
}

}  // namespace
}  // namespace semfoam

int main(int argc, char** argv) {
  semfoam::InitLogging(argv[0]);
  return semfoam::RunCommand(semfoam::RunMaskCorrupter, argc, argv);
}
