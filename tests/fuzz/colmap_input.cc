// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/fuzz/colmap_input.h"

#include "plugin/colmap/camera_rays.h"
#include "plugin/colmap/seeds.h"
#include "plugin/colmap/tracks.h"

#include <string>
#include <unordered_map>
#include <vector>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

constexpr const char* kStems[] = {"cameras", "images", "points3D", "rigs", "frames"};
constexpr size_t kLeastFiles = 3;
constexpr size_t kMostFiles = 5;

// One folder for each number of files, in it links to the files in memory.
fs::path FolderOf(const fs::path& folder, size_t num_files) {
  return folder / std::to_string(num_files);
}

// What a scene is planned from, whatever numbers the files hold.
void UseModel(const Reconstruction& model) {
  std::unordered_map<uint32_t, const Camera*> cameras;
  for (const Camera& camera : model.cameras) cameras.emplace(camera.id, &camera);
  std::vector<PhotoRecord> photos;
  for (const Image& image : model.images) {
    photos.push_back(MakePhotoRecord(*cameras.at(image.camera_id), image, false));
  }
  if (photos.empty()) return;
  const Similarity frame = NormalizedFrameOf(model);
  Require(frame.scale > 0, "the normalised frame has a scale");
  SampleTracks(model, photos, 1);
  LensOfPhotos(model, photos);
  std::vector<SeedPoint> seeds;
  std::vector<PixelObservations> observations;
  MakeSeeds(model.points,
            frame,
            FindSeenImages(model.images, model.cameras, photos),
            &seeds,
            &observations);
}

}  // namespace

ModelInput::ModelInput(ModelFormat format) {
  std::string name = (fs::temp_directory_path() / "semfoam fuzz XXXXXX").string();
  Require(::mkdtemp(name.data()) != nullptr, "there is a temporary folder");
  folder_ = name;
  for (size_t num_files = kLeastFiles; num_files <= kMostFiles; ++num_files) {
    fs::create_directory(FolderOf(folder_, num_files));
    for (size_t i = 0; i < num_files; ++i) {
      const std::string file =
          std::string(kStems[i]) + (format == ModelFormat::kBinary ? ".bin" : ".txt");
      fs::create_symlink(files_[i].path(), FolderOf(folder_, num_files) / file);
    }
  }
}

ModelInput::~ModelInput() {
  std::error_code ignored;
  fs::remove_all(folder_, ignored);
}

std::optional<Reconstruction> ModelInput::Read(std::string_view input) const {
  const std::vector<std::string_view> parts = Parts(input);
  size_t num_files = kLeastFiles;
  for (size_t i = 0; i < kMostFiles; ++i) {
    files_[i].Set(i < parts.size() ? parts[i] : std::string_view());
    if (i < parts.size()) num_files = std::max(num_files, i + 1);
  }
  const fs::path folder = FolderOf(folder_, num_files);
  std::optional<Reconstruction> model;
  ReadsOrRefuses(folder.string(), [&] {
    model = ReadReconstruction(folder);
    UseModel(*model);
  });
  return model;
}

}  // namespace semfoam
