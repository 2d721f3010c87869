// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/dataset/scene_checksums.h"

#include "foam/util/error.h"
#include "plugin/mask_import/region_features.h"
#include "plugin/util/files.h"

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <type_traits>
#include <vector>

#include <glog/logging.h>

#define XXH_INLINE_ALL
#include <xxhash.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

// Collects what is to be summed up.
class Checksum {
 public:
  template <typename T>
  void Add(T value) {
    static_assert(std::is_arithmetic_v<T>);
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof(value));
  }
  void Add(const std::string& text) {
    Add(text.size());
    bytes_ += text;
  }
  template <typename Derived>
  void AddVector(const Eigen::MatrixBase<Derived>& vector) {
    for (Eigen::Index i = 0; i < vector.size(); ++i) Add(vector[i]);
  }
  void AddObservations(const PixelObservations& observations) {
    Add(observations.size());
    for (const PixelObservation& observation : observations) {
      Add(observation.view);
      AddVector(observation.pixel);
    }
  }

  std::string Text() const {
    char text[17];
    std::snprintf(text,
                  sizeof(text),
                  "%016llx",
                  static_cast<unsigned long long>(XXH64(bytes_.data(), bytes_.size(), 0)));
    return text;
  }

 private:
  std::string bytes_;
};

// By pieces, each with the checksum of those before it as its seed.
uint64_t ChecksumOfFile(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::vector<char> piece(size_t{1} << 18);
  uint64_t checksum = 0;
  while (file) {
    file.read(piece.data(), static_cast<std::streamsize>(piece.size()));
    checksum = XXH64(piece.data(), static_cast<size_t>(file.gcount()), checksum);
  }
  if (!file.eof()) {
    throw UserError(path.string(), ": cannot be read; a file that may be read would be right.");
  }
  return checksum;
}

// The files of the masks: first those of the photos.
std::vector<fs::path> FilesOfMasks(const ScenePlan& plan) {
  std::vector<fs::path> files = plan.masks.masks;
  files.push_back(plan.labels_file);
  const auto is_given = [](const fs::path& file) { return !file.empty(); };
  if (std::any_of(plan.ignore_files.begin(), plan.ignore_files.end(), is_given)) {
    files.insert(files.end(), plan.ignore_files.begin(), plan.ignore_files.end());
  }
  if (!plan.features_file.empty()) {
    files.push_back(plan.features_file);
    for (const auto& [name, mask] : ReadRegionFeatures(plan.features_file)) {
      if (!mask.embeddings.empty()) files.push_back(plan.mask_folder / mask.embeddings);
    }
  }
  return files;
}

// Returns the checksum of each file; those of photos that are not drawn are taken from `known`.
std::vector<uint64_t> ReadChecksums(const ScenePlan& plan,
                                    const std::vector<fs::path>& files,
                                    const std::vector<uint64_t>* known) {
  std::vector<uint64_t> values(files.size(), 0);
  const bool is_known = known != nullptr && known->size() == files.size();
  ForEachFile(static_cast<int64_t>(files.size()), [&](int64_t i) {
    const bool is_drawn = i >= std::ssize(plan.photos) || plan.IsDrawn(i);
    if (is_known && !is_drawn) {
      values[i] = (*known)[i];
    } else if (!files[i].empty()) {
      values[i] = ChecksumOfFile(files[i]);
    }
  });
  return values;
}

// Empty paths count as such.
std::string Summary(const std::vector<fs::path>& files, const std::vector<uint64_t>& values) {
  CHECK_EQ(files.size(), values.size());
  Checksum checksum;
  for (size_t i = 0; i < files.size(); ++i) {
    checksum.Add(files[i].empty());
    checksum.Add(values[i]);
  }
  return checksum.Text();
}

void AddSeeds(const std::vector<SeedPoint>& seeds, Checksum* checksum) {
  checksum->Add(seeds.size());
  for (const SeedPoint& seed : seeds) {
    checksum->AddVector(seed.position);
    checksum->AddVector(seed.color);
  }
}

std::string ChecksumOfCloud(const ScenePlan& plan) {
  Checksum checksum;
  AddSeeds(plan.seed_cloud.points, &checksum);
  return checksum.Text();
}

std::string ChecksumOfModel(const ScenePlan& plan) {
  Checksum checksum;
  checksum.Add(plan.photos.size());
  for (const PhotoRecord& photo : plan.photos) {
    checksum.Add(photo.name);
    checksum.Add(photo.camera_model);
    checksum.Add(photo.width);
    checksum.Add(photo.height);
    for (const double parameter : photo.camera_params) checksum.Add(parameter);
    checksum.AddVector(photo.cam_from_world_rotation.coeffs());
    checksum.AddVector(photo.cam_from_world_translation);
    checksum.Add(photo.held_out);
  }
  AddSeeds(plan.seeds, &checksum);
  for (const PixelObservations& observations : plan.seed_tracks)
    checksum.AddObservations(observations);
  checksum.Add(plan.tracks.size());
  for (const Track& track : plan.tracks) {
    checksum.AddVector(track.position);
    checksum.AddObservations(track.observations);
  }
  for (const int lens : plan.lenses) checksum.Add(lens);
  checksum.Add(plan.world_from_normalized.scale);
  checksum.AddVector(plan.world_from_normalized.translation);
  return checksum.Text();
}

}  // namespace

FileChecksums ChecksumsOfFiles(const ScenePlan& plan, const FileChecksums* known) {
  return {ReadChecksums(plan, plan.files, known != nullptr ? &known->photos : nullptr),
          ReadChecksums(plan, FilesOfMasks(plan), known != nullptr ? &known->masks : nullptr)};
}

SceneChecksums ChecksumsOf(const ScenePlan& plan, const FileChecksums& files) {
  return {ChecksumOfModel(plan),
          ChecksumOfCloud(plan),
          Summary(plan.files, files.photos),
          Summary(FilesOfMasks(plan), files.masks)};
}

}  // namespace semfoam
