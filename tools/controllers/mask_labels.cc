// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/controllers/mask_labels.h"

#include "export/scene/names.h"
#include "foam/train/hidden_cells.h"
#include "foam/train/training_options.h"
#include "foam/train/training_schedule.h"
#include "foam/util/error.h"
#include "foam/util/number_text.h"
#include "foam/util/scratch_folder.h"
#include "foam/view/cell_statistics.h"
#include "foam/view/view_renderer.h"
#include "plugin/colmap/camera_rays.h"
#include "plugin/dataset/training_scene.h"
#include "plugin/util/plural.h"
#include "tools/controllers/mask_importing.h"
#include "tools/controllers/training_run.h"

#include <algorithm>
#include <map>
#include <string>
#include <utility>

#include <glog/logging.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

// Returns the text of an option of the training; empty where the model does not say.
std::string OptionOf(const Model& model, const char* name) {
  const auto found = model.options.find(name);
  return found == model.options.end() ? std::string() : found->second;
}

// Returns the pose of `photo` in the frame of another model of the same scene: both have the same
// place in their normalised frames.
Pose PoseInFrame(const PhotoRecord& photo, const Similarity& from, const Similarity& to) {
  const Pose pose = PoseOf(photo);
  const Eigen::Vector3d center = to.Apply(from.Invert(pose.Center()));
  const Eigen::Quaterniond rotation = pose.UnitRotation();
  return {rotation, -(rotation * center)};
}

// Moves the cameras of the scene to where the foam has them. Throws UserError where the foam has no
// photo of that name.
void TakePoses(const Model& model, const fs::path& foam_path, TrainingScene* scene) {
  std::map<std::string, const PhotoRecord*> photos;
  for (const PhotoRecord& photo : model.photos) photos[photo.name] = &photo;
  std::vector<Pose> poses;
  for (const PhotoRecord& photo : scene->Photos()) {
    const auto found = photos.find(photo.name);
    if (found == photos.end()) {
      throw UserError(foam_path.string(),
                      ": was not trained on ",
                      photo.name,
                      ", which is in the COLMAP model; the model and the photos of that training "
                      "would be right.");
    }
    poses.push_back(
        PoseInFrame(*found->second, model.world_from_normalized, scene->WorldFromNormalized()));
  }
  scene->SetPoses(poses);
}

void RequireVotingMask(const TrainingScene& scene, const fs::path& foam_path) {
  bool has_mask = false;
  for (int view = 0; view < scene.NumViews(); ++view) {
    has_mask |= scene.HasLabels(view) && !scene.IsHeldOut(view);
  }
  if (scene.NumClasses() > 0 && has_mask) return;
  throw UserError(foam_path.string(),
                  ": cannot be labelled: no photo that it was trained on has a mask; --mask_path "
                  "would name masks of at least one of them.");
}

// Masks of photos that the training held out tell how good labels are, and so cannot make them.
void LogHeldOutMasks(const TrainingScene& scene) {
  int held_out = 0;
  for (int view = 0; view < scene.NumViews(); ++view) {
    held_out += scene.HasLabels(view) && scene.IsHeldOut(view) ? 1 : 0;
  }
  if (held_out == 0) return;
  LOG(INFO) << Plural(held_out, "mask") << (held_out == 1 ? " is of a photo" : " are of photos")
            << " that the training held out, and not used";
}

}  // namespace

void TakeTrainingOptions(const Model& model, SceneOptions* scene) {
  ParseNumber(OptionOf(model, "test_every"), &scene->test_every);
  ParseNumber(OptionOf(model, "random_seed"), &scene->random_seed);
  ParseNumber(OptionOf(model, "max_image_size"), &scene->max_image_size);
  scene->mask_consistency = ParseEnum(kMaskConsistencyNames, OptionOf(model, "mask_consistency"))
                                .value_or(scene->mask_consistency);
}

SpreadingResult LabelByMasks(const fs::path& foam_path,
                             const SceneOptions& options,
                             const Device& device,
                             const fs::path& scratch_parent,
                             Model* model) {
  const ScratchFolder scratch(scratch_parent);
  TrainingRun run;
  run.scene = options;
  ImportMasksOf(&run.scene, scratch.path() / "masks");
  TrainingScene scene = LoadScene(run, run.scene);
  LogWarnings(scene);
  LogMasks(scene, run.scene.mask_consistency);
  LogHeldOutMasks(scene);
  RequireVotingMask(scene, foam_path);
  TakePoses(*model, foam_path, &scene);
  int64_t num_rays = TrainingOptions().num_rays;
  ParseNumber(OptionOf(*model, "num_rays"), &num_rays);
  // As the training looks at it, before unseen cells are filled.
  Foam foam = model->foam;
  foam.assumed_density.clear();
  const ViewRenderer renderer(foam, device);
  CellMeasurements measured =
      MeasureCells(foam, renderer, scene, StatisticsStride(scene, num_rays));
  const std::vector<LabelVote> votes =
      MeasureLabels(foam, renderer, scene, LabelStride(scene, num_rays));
  if (votes.empty()) {
    throw UserError(foam_path.string(),
                    ": shows nothing where the masks have labels; masks of things that photos of "
                    "its training show would be right.");
  }
  foam.num_classes = scene.NumClasses();
  foam.identity.assign(static_cast<size_t>(foam.NumSites()) * kIdentityDim, 0.f);
  foam.classifier_weight.assign(static_cast<size_t>(foam.num_classes) * kIdentityDim, 0.f);
  foam.classifier_bias.assign(foam.num_classes, 0.f);
  SpreadingResult result = SpreadLabels(renderer.delaunay(), measured.statistics, votes, &foam);
  // Of what hidden cells get, their colours are there already.
  CompleteHiddenCells(renderer.delaunay(), &measured, &foam);
  model->foam.num_classes = foam.num_classes;
  model->foam.identity = std::move(foam.identity);
  model->foam.classifier_weight = std::move(foam.classifier_weight);
  model->foam.classifier_bias = std::move(foam.classifier_bias);
  model->labels = scene.Labels();
  WarnOfSmallLabels(result, model->labels);
  return result;
}

void WarnOfSmallLabels(const SpreadingResult& result, const std::vector<Label>& labels) {
  if (result.small_classes.empty()) return;
  std::vector<Label> small;
  for (const ClassIndex c : result.small_classes) small.push_back(labels.at(Value(c)));
  LOG(WARNING) << "The cells are too large for the masks: " << NamesOf(small)
               << (small.size() == 1 ? " has" : " have") << " fewer than " << kFewCells
               << " cells; more sites (final_sites) and rays (num_rays) would be right.";
}

std::string NamesOf(const std::vector<Label>& labels) {
  constexpr size_t kMostNames = 8;
  std::string text;
  for (size_t i = 0; i < std::min(labels.size(), kMostNames); ++i) {
    if (i > 0) text += ", ";
    text += labels[i].name.empty() ? std::to_string(Value(labels[i].id)) : OneLine(labels[i].name);
  }
  if (labels.size() > kMostNames) {
    text += " and " + std::to_string(labels.size() - kMostNames) + " more";
  }
  return text;
}

}  // namespace semfoam
