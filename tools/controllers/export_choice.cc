// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/controllers/export_choice.h"

#include "export/scene/object_selection.h"
#include "export/volume/volume_forecast.h"
#include "foam/util/error.h"
#include "plugin/mask/mask_tables.h"
#include "plugin/mask_import/region_features.h"

#include <set>
#include <string>
#include <vector>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

// The choice of the labels to level by; all: there are none.
LabelChoice LevelLabels(const FrameChoice& frame) {
  if (!NeedsSurface(frame) || frame.level.by != LevelBy::kLabels) return {};
  return {frame.level.labels};
}

void RequireLabels(const LabelChoice& choice, const ScenePlan& plan) {
  if (choice.IsAll()) return;
  if (plan.masks.NumPaired() == 0) {
    throw FieldError(choice.labels.empty() ? "exclude_labels" : "labels",
                     " chooses objects, and without masks there will be none; leave it out, or "
                     "give the masks with ",
                     Field{"mask_path"},
                     ".");
  }
  std::vector<NamedLabel> names;
  if (!plan.labels_file.empty()) {
    for (const LabelName& label : ReadLabelNames(plan.labels_file)) {
      names.push_back({label.id, label.name});
    }
  }
  RequirePossible(choice,
                  names,
                  plan.features_file.empty() ? std::set<std::string>()
                                             : ClassesIn(ReadRegionFeatures(plan.features_file)),
                  plan.labels_file.empty()
                      ? "a table of labels (no labels.json is beside the masks)"
                      : plan.labels_file.string());
}

// A file is renamed into its place at the end of its making, and then it is too late.
void RequireFreePlaces(const fs::path& output_path, const std::set<ExportFormat>& formats) {
  const fs::path objects = output_path / "objects";
  if (fs::exists(objects) && !fs::is_directory(objects)) {
    throw UserError(objects.string(),
                    ": is a file, in the way of the folder of that name; choose another ",
                    Field{"output_path"},
                    ".");
  }
  for (const ExportFormat format : {ExportFormat::kVdb, ExportFormat::kGlb, ExportFormat::kUsda}) {
    const fs::path scene =
        output_path / std::string("scene.").append(NameOf(kExportFormatNames, format));
    if (formats.count(format) == 0 || !fs::is_directory(scene)) continue;
    throw UserError(scene.string(),
                    ": is a folder, in the way of the file of that name; choose another ",
                    Field{"output_path"},
                    ".");
  }
}

void RequireVoxels(const PlannedExport& planned, double scale, const ScenePlan& plan) {
  if (planned.formats.count(ExportFormat::kVdb) == 0) return;
  std::vector<Eigen::Vector3d> points;
  points.reserve(plan.seeds.size());
  for (const SeedPoint& seed : plan.seeds) {
    points.push_back(plan.world_from_normalized.Apply(seed.position.cast<double>()));
  }
  VolumeExportOptions volume = planned.volume;
  // Which ones does not matter yet.
  if (!planned.choice.labels.empty()) volume.objects.only.emplace();
  const std::string wrong = VoxelsThatCannotFit(points, scale, volume);
  if (!wrong.empty()) throw UserError(wrong);
}

}  // namespace

void RequirePossible(const PlannedExport& planned, const ScenePlan& plan) {
  RequireLabels(planned.choice, plan);
  NamingLevel([&] { RequireLabels(LevelLabels(planned.frame), plan); });
  const CompletedFrame frame = CompleteByPhotos(planned.frame, plan.photos);
  RequireFreePlaces(planned.output_path, planned.formats);
  RequireVoxels(planned, frame.transform.scale, plan);
}

void RequirePossible(const LabelChoice& choice,
                     const FrameChoice& frame,
                     const std::vector<Label>& labels) {
  if (!choice.IsAll()) ChooseLabels(choice, NamedLabels(labels));
  const LabelChoice level = LevelLabels(frame);
  if (level.IsAll()) return;
  NamingLevel([&] { ChooseLabels(level, NamedLabels(labels)); });
}

}  // namespace semfoam
