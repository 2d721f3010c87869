// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/masks/uncertain_cells.h"

#include "export/scene/exportable_scene.h"
#include "foam/model/classifier.h"
#include "foam/util/parallel.h"
#include "plugin/colmap/camera_rays.h"
#include "tools/controllers/coarse_views.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>

namespace semfoam {
namespace {

constexpr double kSamplesAlongEdge = 320;
// Cells that a thread takes at a time.
constexpr int64_t kBlock = 1024;

// Returns the entropy of the softmax of `logits` as a share of the largest one, 0..1. Replaces the
// logits.
float RelativeEntropy(std::vector<float>* logits) {
  if (logits->size() < 2) return 0;
  const float largest = *std::max_element(logits->begin(), logits->end());
  float sum = 0, weighted = 0;
  for (float& logit : *logits) {
    logit -= largest;
    sum += std::exp(logit);
    weighted += std::exp(logit) * logit;
  }
  return (std::log(sum) - weighted / sum) / std::log(static_cast<float>(logits->size()));
}

std::vector<float> Uncertainties(const Foam& foam) {
  std::vector<float> weight(foam.NumSites(), 1.f);
  if (!foam.HasSemantics()) return weight;
  ParallelForBlocks(std::ssize(weight), kBlock, [&](int64_t begin, int64_t end) {
    std::vector<float> logits(foam.num_classes);
    for (int64_t i = begin; i < end; ++i) {
      ClassLogits(foam, &foam.identity[i * kIdentityDim], logits.data());
      weight[i] = kLeastUncertainty + (1 - kLeastUncertainty) * RelativeEntropy(&logits);
    }
  });
  return weight;
}

}  // namespace

UncertainCells FindUncertainCells(const Model& model, const std::filesystem::path& foam_path) {
  UncertainCells cells;
  cells.weight = Uncertainties(model.foam);
  const ExportableScene scene = MakeExportableScene(model);
  const CoarseViews views(model.foam, scene);
  for (const PhotoRecord& photo : model.photos) {
    const CameraRays rays = MakeCameraRays(CoarseCamera(photo, kSamplesAlongEdge, foam_path),
                                           PoseOf(photo),
                                           model.world_from_normalized);
    std::map<uint32_t, int> num_rays;
    for (const CoarseViews::Stop& stop : views.Look(rays)) {
      if (stop.cell != kNoCell) ++num_rays[stop.cell];
    }
    std::vector<ShownPart>& shown = cells.shown_by.emplace_back();
    for (const auto& [cell, count] : num_rays) {
      shown.push_back({static_cast<int32_t>(cell), 1 - std::exp2(-static_cast<float>(count))});
    }
  }
  return cells;
}

}  // namespace semfoam
