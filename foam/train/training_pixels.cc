// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/train/training_pixels.h"

#include "foam/train/training_rays.h"
#include "foam/train/training_schedule.h"
#include "foam/util/random.h"

#include <algorithm>
#include <utility>

namespace semfoam {
namespace {

constexpr uint64_t kProbePurpose = 0x4a3;

// The SH degree is settled on so many pixels of every kProbeViews-th photo, if there are enough
// photos: training has not seen these until then, so colours there can only be right, and not
// learned by heart.
constexpr int kProbeRays = 16384;
constexpr int kProbeViews = 16;
constexpr int kFewestViewsToProbe = 8;

}  // namespace

TrainingPixels::TrainingPixels(const TrainingViews& views, const TrainingOptions& options)
    : views_(views), options_(options), training_views_(SelectViews(views, /*held_out=*/false)) {
  std::vector<int> train = training_views_, probe;
  if (options_.sh_degree > 0 && !options_.fixed_sh_degree && train.size() >= kFewestViewsToProbe) {
    for (size_t k = 0; k < train.size(); ++k) {
      if (k % kProbeViews == kFewestViewsToProbe / 2) probe.push_back(train[k]);
    }
    std::erase_if(train, [&](int view) { return std::count(probe.begin(), probe.end(), view); });
  }
  drawn_ = PixelRange(views_, train);
  probes_ = PixelRange(views_, probe);
}

void TrainingPixels::ReleaseProbes() {
  if (!HasProbes()) return;
  drawn_ = PixelRange(views_, training_views_);
  probes_ = {};
}

void TrainingPixels::OpenCache(int64_t first_iteration,
                               std::function<ProbeUse(int64_t iteration)> probe_use) {
  if (views_.HoldsPixels()) return;
  DrawingPlan plan;
  plan.seed = options_.random_seed;
  plan.num_tiles = NumTiles(options_.rays_per_iteration);
  plan.ranges.resize(2);
  plan.ranges[kAllButProbes] = drawn_;
  plan.ranges[kAllViews] = PixelRange(views_, training_views_);
  plan.first_iteration = first_iteration;
  plan.may_grow = options_.seconds > 0;
  plan.kept = ProbePixels();
  num_probes_kept_ = plan.kept.size();
  if (squares_.IsAll()) {
    const std::vector<ViewPixel> held_out = HeldOutPixels();
    plan.kept.insert(plan.kept.end(), held_out.begin(), held_out.end());
  } else {
    // A block is not held against held-out views.
    plan.is_used = [this](int view) { return squares_.ContainsAnyOf(view); };
  }
  if (HasProbes()) {
    plan.ranges_at = [probe_use = std::move(probe_use)](int64_t iteration) {
      switch (probe_use(iteration)) {
        case ProbeUse::kSetApart:
          return std::vector<int>{kAllButProbes};
        case ProbeUse::kTrainedOn:
          return std::vector<int>{kAllViews};
        case ProbeUse::kUnknown:
          break;
      }
      return std::vector<int>{kAllButProbes, kAllViews};
    };
  } else {
    plan.ranges_at = [](int64_t) { return std::vector<int>{kAllViews}; };
  }
  cache_ = std::make_unique<PixelCache>(views_, std::move(plan));
}

void TrainingPixels::Read(int64_t first_iteration,
                          int64_t num_iterations,
                          PixelCache::Report report) {
  if (!cache_) return;
  if (report) cache_->SetReport(std::move(report));
  cache_->Drawn(first_iteration, DrawnRange(), num_iterations);
}

int64_t TrainingPixels::Draw(int64_t iteration,
                             int64_t num_iterations,
                             const std::vector<uint32_t>& start_cells,
                             std::vector<BatchRay>* rays) {
  const PixelValue* const values =
      cache_ ? cache_->Drawn(iteration, DrawnRange(), num_iterations) : nullptr;
  return DrawRays(views_,
                  drawn_,
                  values,
                  start_cells,
                  options_.rays_per_iteration,
                  options_.random_seed,
                  iteration,
                  squares_,
                  rays);
}

std::vector<ViewPixel> TrainingPixels::ProbePixels() const {
  std::vector<ViewPixel> pixels;
  if (!HasProbes()) return pixels;
  for (int i = 0; i < kProbeRays; ++i) {
    CounterRandom random(options_.random_seed, kProbePurpose, i);
    pixels.push_back(probes_.At(static_cast<int64_t>(random.Uniform() * probes_.size())));
  }
  return pixels;
}

std::vector<BatchRay> TrainingPixels::ProbeRays(const std::vector<uint32_t>& start_cells) const {
  std::vector<BatchRay> rays;
  const std::vector<ViewPixel> pixels = ProbePixels();
  for (size_t i = 0; i < pixels.size(); ++i) {
    const PixelValue* const value = cache_ ? &cache_->Kept(i) : nullptr;
    const uint32_t start = start_cells[pixels[i].view];
    if (const auto ray = PixelAsRay(views_, pixels[i], value, start)) rays.push_back(*ray);
  }
  return rays;
}

std::vector<ViewPixel> TrainingPixels::HeldOutPixels() const {
  const int stride = EvaluationStride(views_, options_.num_rays);
  std::vector<ViewPixel> pixels;
  for (const int view : SelectViews(views_, /*held_out=*/true)) {
    for (int y = 0; y < views_.Height(view); y += stride) {
      for (int x = 0; x < views_.Width(view); x += stride) pixels.push_back({view, x, y});
    }
  }
  return pixels;
}

const PixelValue* TrainingPixels::HeldOutValue(size_t k) const {
  return cache_ ? &cache_->Kept(num_probes_kept_ + k) : nullptr;
}

}  // namespace semfoam
