// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/io/volume_export.h"
#include "foam/model/model.h"
#include "foam/util/parallel.h"
#include "tools/benchmark/case.h"
#include "tools/benchmark/cases.h"
#include "tools/benchmark/peak_memory.h"
#include "tools/benchmark/scenes.h"

#include <functional>
#include <memory>
#include <string>

namespace semfoam {
namespace {

// What a voxel holds: density, colour, label and confidence.
constexpr double kVoxelBytes = 6 * sizeof(float);

using ModelSource = std::function<Model()>;

// The scene that was asked for last: the library runs a case several times, and finding the objects
// takes longer than the voxels do.
std::shared_ptr<const ExportableScene> Kept(const std::string& key, const ModelSource& make_model) {
  static std::string kept_key;
  static std::shared_ptr<const ExportableScene> kept;
  if (key != kept_key) {
    kept.reset();
    kept_key.clear();
    kept = std::make_shared<ExportableScene>(MakeExportableScene(make_model()));
    kept_key = key;
  }
  return kept;
}

// The four grids of scene.vdb at the default resolution, from a scene that is ready for export;
// voxels are the active ones. Writing the file is not part of it.
void RunVoxelize(benchmark::State& state, const ExportableScene& scene, int num_threads) {
  const VolumeExportOptions options;
  const VolumeFrame frame = MakeVolumeFrame(scene, options);
  const ThreadLimit limit(num_threads);
  Stopwatch watch;
  int64_t voxels = 0, voxels_of_one = 0;
  const PeakMemory peak;
  for ([[maybe_unused]] auto iteration : state) {
    const Stopwatch::Lap lap(&watch);
    voxels_of_one = NumVoxels(*MakeSceneGrids(scene, frame, options));
    voxels += voxels_of_one;
  }
  const double peak_bytes = static_cast<double>(peak.BytesAbove());
  state.counters["voxels_per_second"] = Rate(voxels, watch);
  state.counters["voxels"] = Same(voxels_of_one);
  state.counters["bytes_per_site"] = Same(kVoxelBytes * voxels_of_one / scene.NumSites());
  state.counters["touched_per_voxel"] = Same(kVoxelBytes);
  if (peak_bytes > 0) state.counters["peak_bytes"] = Same(peak_bytes);
}

void RegisterOn(const std::string& scene_name, const ModelSource& make_model) {
  RegisterParallelCase("voxelize/" + scene_name,
                       [scene_name, make_model](benchmark::State& state, int num_threads) {
                         RunVoxelize(state, *Kept(scene_name, make_model), num_threads);
                       });
}

}  // namespace

void RegisterVoxelizeCases(int64_t num_sites) {
  RegisterOn(std::to_string(num_sites), [num_sites] {
    Model model;
    model.foam = ShellScene(num_sites)->foam;
    // Classes that no label names: a volume asks for the labels' ids.
    for (int k = 0; k < model.foam.num_classes; ++k) {
      model.labels.push_back({static_cast<LabelId>(k), static_cast<MaskId>(k), ""});
    }
    return model;
  });
}

void RegisterVoxelizeCases(const std::filesystem::path& foam_file) {
  RegisterOn("foam", [foam_file] { return ReadModel(foam_file); });
}

}  // namespace semfoam
