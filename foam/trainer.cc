// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/trainer.h"

#include "foam/activation.h"
#include "foam/cell_statistics.h"
#include "foam/classifier.h"
#include "foam/delaunay.h"
#include "foam/densification.h"
#include "foam/error.h"
#include "foam/free_space.h"
#include "foam/guard_sites.h"
#include "foam/initialization.h"
#include "foam/metrics.h"
#include "foam/optimizer.h"
#include "foam/parallel.h"
#include "foam/pixel_cache.h"
#include "foam/pixel_range.h"
#include "foam/random.h"
#include "foam/ray_batch.h"
#include "foam/ray_tracer.h"
#include "foam/schedule.h"
#include "foam/sh_degree.h"
#include "foam/total_variation.h"
#include "foam/training_guard.h"
#include "foam/view_renderer.h"
#include "foam/voronoi.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <iomanip>
#include <numeric>
#include <optional>
#include <sstream>

#include <glog/logging.h>

namespace semfoam {
namespace {

constexpr uint64_t kQuantilePurpose = 0x4a2, kShProbePurpose = 0x4a3;

// The regulariser touches every cell, the rays only some: it takes one step in so many, with so
// many times the weight.
constexpr int64_t kTvInterval = 4;

// The planes follow the sites every so many iterations: moving all of them costs as much as casting
// a thousand rays, and between two of its own steps a cell waits longer than that.
constexpr int64_t kRefreshInterval = 2;

// A new topology comes when the old one has begun to lead rays astray, which shows in cells that a
// ray leaves before it has entered them, and after so many iterations at the latest. But a stale
// one is only renewed while the sites triangulated so far are no more than so many per piece of a
// ray cast: some 9 % of the time of a run, whatever the scene. Counted in sites and pieces, not
// seconds, so that the machine changes no byte.
constexpr double kStaleShare = 2e-3;
constexpr double kTriangulatedSitesPerPiece = 1.5e-3;
constexpr int64_t kMinTriangulationInterval = 20;
constexpr int64_t kMaxTriangulationInterval = 1000;

// Sites move in proportion to their cell's radius within these bounds, so that a small thing seen
// from afar trains like a large one from near, and the large cells of a background find their
// places too.
constexpr float kSmallestRadius = 5e-4f, kLargestRadius = 0.1f;

// Fractions of the run. Colours settle before matter forms, and the mean colour before its change
// with direction.
constexpr double kDensityWarmUp = 0.1;
constexpr double kShWarmUp = 0.2;
// When the colour of a cell may begin to change with direction in one degree more: degree d at d
// times kShRaise. One such time later the degree must have paid, or it is taken out again and the
// question is settled: without it, the colour's squared error must be greater by kShWorthwhile, on
// pixels of photos that training has not seen until then (every kProbeViews-th; there it can only
// be right, and not learned by heart).
constexpr double kShRaise = 0.1;
constexpr double kShWorthwhile = 0.01;
constexpr int kShProbeRays = 16384;
constexpr int kProbeViews = 16;
constexpr int kFewestViewsToProbe = 8;

constexpr int kNumEvaluations = 20;  // of the held-out views, over the run
// Pixels between two that are looked at: the least, and what follows from looking at so many rays
// at the most. Large photos have more pixels than a foam has to show.
constexpr int kLeastEvaluationStride = 4, kLeastStatisticsStride = 2;
constexpr int64_t kMostEvaluationRays = int64_t{1} << 20, kMostStatisticsRays = int64_t{1} << 24;
// The time of a ray that is only looked at, in that of one that is learned from (README.md, Speed).
constexpr double kLookedAtShare = 0.3;

double SecondsSince(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

// Of the views that are held out or of the others, every so many pixels in either direction.
int64_t GridRays(const TrainingViews& views, bool held_out, int stride) {
  int64_t rays = 0;
  for (int view = 0; view < views.NumViews(); ++view) {
    if (views.IsHeldOut(view) != held_out) continue;
    rays += int64_t{(views.Width(view) + stride - 1) / stride} *
            ((views.Height(view) + stride - 1) / stride);
  }
  return rays;
}

// The least stride from `stride` on with no more than `most` rays, but one a view.
int GridStride(const TrainingViews& views, bool held_out, int stride, int64_t most) {
  most = std::max<int64_t>(most, views.NumViews());
  while (GridRays(views, held_out, stride) > most) ++stride;
  return stride;
}

int EvaluationStride(const TrainingViews& views) {
  return GridStride(views, /*held_out=*/true, kLeastEvaluationStride, kMostEvaluationRays);
}

int StatisticsStride(const TrainingViews& views) {
  return GridStride(views, /*held_out=*/false, kLeastStatisticsStride, kMostStatisticsRays);
}

std::vector<int> ViewsToTrainOn(const TrainingViews& views) {
  std::vector<int> result;
  for (int view = 0; view < views.NumViews(); ++view) {
    if (!views.IsHeldOut(view)) result.push_back(view);
  }
  return result;
}

// One training run: the foam, all that hangs on its topology, and the optimiser.
class Trainer {
 public:
  Trainer(const TrainingViews& views,
          const std::vector<SeedPoint>& seeds,
          int num_classes,
          const TrainingOptions& options)
      : views_(views), options_(options), free_space_(views, seeds) {
    ChooseViews();
    if (pixels_.size() == 0) {
      throw UserError(
          "There is no photo to train on: all are held out or missing; hold out fewer "
          "(--test_every).");
    }
    InitializationOptions initialization;
    initialization.max_seed_sites = std::min(options.initial_sites, options.final_sites);
    initialization.num_scattered = ScatteredSites(options);
    initialization.num_far = FarSites(options);
    initialization.sh_degree = 0;  // raised later
    initialization.num_classes = num_classes;
    initialization.seed = options.random_seed;
    std::vector<Eigen::Vector3d> centers;
    for (int view = 0; view < views.NumViews(); ++view) centers.push_back(views.Origin(view));
    foam_ = InitialFoam(seeds, centers, initialization);
    optimizer_ = std::make_unique<FoamOptimizer>(foam_);
    densification_.Reset(foam_.NumSites());
    start_cells_.assign(views.NumViews(), 0);
    const auto iterations = [&](int64_t rays) {
      return (rays + options.rays_per_iteration - 1) / options.rays_per_iteration;
    };
    planned_iterations_ = iterations(options.num_rays);
    early_iterations_ =
        static_cast<int64_t>(std::ceil(options.densify_until * double(planned_iterations_)));
    progress_.num_iterations = options.late_rays > 0
                                   ? early_iterations_ + iterations(options.late_rays)
                                   : planned_iterations_;
    summary_.late_rays = options.late_rays;
    if (!views.HoldsPixels()) MakeCache();
  }

  TrainingSummary Run(const std::function<void(const TrainingProgress&)>& report);

 private:
  void Retriangulate();
  void FollowSites();
  void ChooseViews();
  uint32_t StartCell(int view) const;
  void DrawRays();
  void Iterate();
  bool DensifyIfDue();
  void ChooseShDegreeIfDue();
  void SetShDegree(int degree);
  void SettleShDegree(int degree);
  bool ShDegreePays() const;
  bool TopologyIsStale() const;
  bool RayOfPixel(const ViewPixel& pixel, const PixelValue* value, TrainingRay* ray) const {
    return value == nullptr ? views_.Ray(pixel.view, pixel.x, pixel.y, ray)
                            : views_.RayOf(pixel.view, pixel.x, pixel.y, *value, ray);
  }
  std::optional<BatchRay> PixelAsRay(const ViewPixel& pixel,
                                     uint32_t start_cell,
                                     size_t kept_index) const;
  double SquaredError(const CellShading<float>& shading,
                      const std::vector<BatchRay>& rays,
                      std::vector<int32_t>* shown_classes) const;
  int NumTiles() const { return (options_.rays_per_iteration + kTileRays - 1) / kTileRays; }
  // In PixelCache: 1, all views; 0, those but the probes.
  int RangeInCache() const { return probe_pixels_.size() > 0 ? 0 : 1; }
  void MakeCache();
  std::vector<ViewPixel> ProbePixels() const;
  std::vector<ViewPixel> EvaluationPixels() const;
  void EvaluateHeldOut();
  void FitToSecondsIfDue();
  void Report(const std::function<void(const TrainingProgress&)>& report);

  double RunFraction() const { return RunFractionAt(progress_.iteration); }
  double RunFractionAt(int64_t iteration) const {
    if (iteration <= early_iterations_ || progress_.num_iterations == planned_iterations_) {
      return double(iteration) / double(planned_iterations_);
    }
    const double early = double(early_iterations_) / double(planned_iterations_);
    return early + (1 - early) * double(iteration - early_iterations_) /
                       double(progress_.num_iterations - early_iterations_);
  }
  bool PositionsMove() const { return RunFraction() < options_.freeze_positions; }
  LearningRates Rates() const;
  CellShading<float> Shading() const {
    return {foam_.sh_degree,
            density_.data(),
            foam_.sh.data(),
            foam_.HasSemantics() ? foam_.identity.data() : nullptr};
  }

  const TrainingViews& views_;
  const TrainingOptions& options_;
  PixelRange pixels_;                  // to train on
  PixelRange probe_pixels_;            // to settle the SH degree on; empty when that is done
  std::unique_ptr<PixelCache> cache_;  // of views that do not fit into memory
  size_t num_probes_kept_ = 0;         // the first of the pixels that it keeps
  const FreeSpace free_space_;

  Foam foam_;
  std::unique_ptr<FoamOptimizer> optimizer_;
  DensificationStatistics densification_;
  int densifications_ = 0;

  Delaunay delaunay_;
  WalkGeometry<float> geometry_;
  std::vector<uint8_t> is_clear_;  // [N] in free space: the cell stays transparent
  std::vector<float> radius_;      // [N] of the cells, bounded (kSmallestRadius)
  std::vector<float> density_;     // [num_cells]
  std::vector<float> tv_weights_;  // per directed edge
  std::vector<float>
      tv_gradient_;  // [N][kIdentityDim]; empty in iterations without the regulariser
  std::vector<uint32_t> start_cells_;  // per view
  int64_t last_triangulation_ = 0;     // iteration
  int64_t triangulated_sites_ = 0;     // after the first triangulation
  bool frozen_ = false;
  bool sh_degree_is_settled_ = false;
  int64_t planned_iterations_ = 0;  // by num_rays
  int64_t early_iterations_ = 0;    // of these, up to densify_until; late_rays may replace the rest
  double pace_begin_ = 0;           // seconds of learning before the pace was measured
  double seconds_evaluating_ = 0;
  double seconds_reading_ = 0;  // before the first iteration

  std::vector<BatchRay> rays_;
  BatchResult batch_;
  TrainingGuard guard_;

  TrainingSummary summary_;
  TrainingProgress progress_;
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
  RayLossTerms<double> loss_sum_;
  double tv_sum_ = 0;
  int64_t loss_count_ = 0, tv_count_ = 0;
};

LearningRates Trainer::Rates() const {
  const TrainingOptions& o = options_;
  const double at = RunFraction();
  const auto cosine = [&](double initial, double warm_up, double end) {
    return static_cast<float>(CosineSchedule{initial, initial * o.final_rate, warm_up, end}.At(at));
  };
  LearningRates rates;
  rates.position = PositionsMove() ? cosine(o.position_rate, 0, o.freeze_positions) : 0.f;
  rates.density = cosine(o.density_rate, kDensityWarmUp, 1);
  rates.sh_dc = cosine(o.color_rate, 0, 1);
  rates.sh_rest = cosine(o.color_rate * o.sh_factor, kShWarmUp, 1);
  rates.identity = cosine(o.identity_rate, 0, 1);
  rates.classifier = static_cast<float>(o.classifier_rate);
  return rates;
}

void Trainer::Retriangulate() {
  const auto begin = std::chrono::steady_clock::now();
  const std::vector<Eigen::Vector3f> cells = WithGuardSites(foam_.positions);
  // The old topology goes before the new one comes, and tetrahedra are only needed for areas.
  delaunay_ = {};
  tv_weights_ = {};
  delaunay_ = Triangulate(cells);
  if (foam_.HasSemantics()) {
    tv_weights_ = TotalVariationWeights(
        delaunay_, FaceAreas(cells, delaunay_, VoronoiVertices(cells, delaunay_)));
  }
  radius_ = CellRadii(cells, delaunay_);
  for (float& radius : radius_) radius = std::clamp(radius, kSmallestRadius, kLargestRadius);
  delaunay_.tets = {};
  delaunay_.tet_neighbors = {};
  SetTopology(delaunay_, &geometry_);
  is_clear_.assign(foam_.NumSites(), 0);
  ParallelForBlocks(foam_.NumSites(), 1024, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) {
      is_clear_[i] = free_space_.Contains(foam_.positions[i]);
      float& raw = foam_.raw_density[i];
      raw = is_clear_[i] ? kTransparentRawDensity : std::max(raw, kLowestRawDensity);
    }
  });
  density_ = CellDensities(foam_);
  FollowSites();
  last_triangulation_ = progress_.iteration;
  if (summary_.triangulations > 0) triangulated_sites_ += foam_.NumSites();
  ++summary_.triangulations;
  summary_.seconds_triangulating += SecondsSince(begin);
}

// Brings the planes up to date with the sites.
void Trainer::FollowSites() { Refresh(WithGuardSites(foam_.positions), &geometry_); }

// The cell that the view's camera is in, found from where it was last.
uint32_t Trainer::StartCell(int view) const {
  return NearestCell(geometry_.positions,
                     delaunay_,
                     views_.Origin(view),
                     std::min(start_cells_[view], delaunay_.num_cells - 1));
}

void Trainer::DrawRays() {
  // Rays come in tiles of neighbouring pixels, which walk through the same cells and find them in
  // the cache, and tiles in the order of the photos.
  const int num_tiles = NumTiles();
  const std::vector<int64_t> tiles =
      DrawTiles(options_.random_seed, progress_.iteration, num_tiles, pixels_.size());
  const PixelValue* values =
      cache_ ? cache_->Drawn(progress_.iteration, RangeInCache(), progress_.num_iterations)
             : nullptr;
  const int batch = num_tiles * kTileRays;
  rays_.resize(batch);

  for (int view = 0; view < views_.NumViews(); ++view) {
    if (views_.IsHeldOut(view)) continue;
    start_cells_[view] = StartCell(view);
  }
  std::vector<uint8_t> valid(batch);
  std::atomic<int64_t> nonfinite_pixels = 0;
  ParallelForBlocks(batch, 256, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) {
      const ViewPixel corner = pixels_.At(tiles[i / kTileRays]);
      const ViewPixel pixel = TilePixel(corner,
                                        static_cast<int>(i % kTileRays),
                                        views_.Width(corner.view),
                                        views_.Height(corner.view));
      TrainingRay ray;
      valid[i] = RayOfPixel(pixel, values == nullptr ? nullptr : &values[i], &ray);
      if (!valid[i]) continue;
      if (!ray.color.allFinite()) {
        valid[i] = false;
        ++nonfinite_pixels;
        continue;
      }
      BatchRay& out = rays_[i];
      out.origin = views_.Origin(pixel.view).cast<float>();
      out.direction = ray.direction;
      out.start_cell = start_cells_[pixel.view];
      CounterRandom random(
          options_.random_seed, kQuantilePurpose, uint64_t(progress_.iteration) * batch + i);
      const double tau0 = -std::log(1 - random.Uniform()), tau1 = -std::log(1 - random.Uniform());
      out.quantile_tau[0] = static_cast<float>(std::min(tau0, tau1));
      out.quantile_tau[1] = static_cast<float>(std::max(tau0, tau1));
      for (int c = 0; c < 3; ++c) out.target.color[c] = ray.color[c];
      out.target.class_index = ray.class_index;
    }
  });
  summary_.nonfinite_pixels += nonfinite_pixels;
  // Pixels without a ray (a lens that cannot be inverted there, a colour that is not finite) drop
  // out of the batch.
  size_t kept = 0;
  for (int i = 0; i < batch; ++i) {
    if (valid[i]) rays_[kept++] = rays_[i];
  }
  rays_.resize(kept);
}

void Trainer::Iterate() {
  DrawRays();
  if (rays_.empty()) return;
  const RayLossWeights weights{1,
                               options_.opacity_weight,
                               options_.quantile_weight * std::min(2 * RunFraction(), 1.0),
                               options_.identity_weight,
                               options_.cell_identity_weight,
                               options_.identity_to_density};
  CastBatch(geometry_,
            Shading(),
            {foam_.num_classes, foam_.classifier_weight.data(), foam_.classifier_bias.data()},
            weights,
            static_cast<float>(-std::log(options_.transmittance_cutoff)),
            rays_,
            &batch_);
  tv_gradient_.clear();
  double tv_loss = 0;
  if (foam_.HasSemantics() && options_.tv_weight > 0 && progress_.iteration % kTvInterval == 0) {
    tv_loss = TotalVariation(delaunay_,
                             tv_weights_,
                             foam_.identity,
                             static_cast<float>(options_.tv_weight * kTvInterval),
                             &tv_gradient_);
    tv_sum_ += tv_loss;
    ++tv_count_;
  }
  const int64_t skipped = optimizer_->Step(
      &batch_, tv_gradient_, is_clear_, radius_, Rates(), &foam_, &density_, &densification_);
  guard_.Watch(progress_.iteration, rays_, batch_, tv_loss, skipped);
  summary_.nonfinite_gradients += skipped;
  summary_.step_limit_hits += batch_.step_limit_hits;
  summary_.pieces += batch_.num_pieces;
  loss_sum_.color += batch_.mean_loss.color;
  loss_sum_.opacity += batch_.mean_loss.opacity;
  loss_sum_.quantile += batch_.mean_loss.quantile;
  loss_sum_.identity += batch_.mean_loss.identity;
  ++loss_count_;
}

// Densification events are spread evenly over [densify_from, densify_until]; each multiplies the
// sites by what is left to reach the final number, so that prunings are made up for.
bool Trainer::DensifyIfDue() {
  if (densifications_ >= options_.densify_events) return false;
  const double due = options_.densify_from + (options_.densify_until - options_.densify_from) *
                                                 densifications_ /
                                                 std::max(1, options_.densify_events - 1);
  if (RunFraction() < due || !PositionsMove()) return false;
  const double growth = std::pow(double(options_.final_sites) / foam_.NumSites(),
                                 1.0 / (options_.densify_events - densifications_));
  DensificationOptions densify;
  densify.num_to_add = static_cast<size_t>(std::max(0.0, foam_.NumSites() * (growth - 1)));
  const Rearrangement rearrangement =
      Densify(delaunay_, densification_, densify, options_.random_seed, densifications_, &foam_);
  optimizer_->Rearrange(rearrangement.origin, rearrangement.is_new);
  densification_.Reset(foam_.NumSites());
  ++densifications_;
  start_cells_.assign(views_.NumViews(), 0);
  return true;
}

bool Trainer::TopologyIsStale() const {
  const int64_t age = progress_.iteration - last_triangulation_;
  const bool affordable = double(triangulated_sites_ + foam_.NumSites()) <=
                          kTriangulatedSitesPerPiece * double(summary_.pieces);
  return age >= kMaxTriangulationInterval ||
         (age >= kMinTriangulationInterval && affordable &&
          batch_.clamped_pieces > kStaleShare * batch_.num_pieces);
}

// Sets the photos apart on which the SH degree is settled, if there is anything to settle and
// there are photos to spare.
void Trainer::ChooseViews() {
  std::vector<int> train = ViewsToTrainOn(views_), probe;
  if (options_.sh_degree > 0 && !options_.fixed_sh_degree && train.size() >= kFewestViewsToProbe) {
    for (size_t k = 0; k < train.size(); ++k) {
      if (k % kProbeViews == kFewestViewsToProbe / 2) probe.push_back(train[k]);
    }
    std::erase_if(train, [&](int view) { return std::count(probe.begin(), probe.end(), view); });
  }
  pixels_ = PixelRange(views_, train);
  probe_pixels_ = PixelRange(views_, probe);
}

// The pixels on which the SH degree is settled.
std::vector<ViewPixel> Trainer::ProbePixels() const {
  std::vector<ViewPixel> pixels;
  if (probe_pixels_.size() == 0) return pixels;
  for (int i = 0; i < kShProbeRays; ++i) {
    CounterRandom random(options_.random_seed, kShProbePurpose, i);
    pixels.push_back(
        probe_pixels_.At(static_cast<int64_t>(random.Uniform() * probe_pixels_.size())));
  }
  return pixels;
}

// A grid over the held-out views, view by view.
std::vector<ViewPixel> Trainer::EvaluationPixels() const {
  const int stride = EvaluationStride(views_);
  std::vector<ViewPixel> pixels;
  for (int view = 0; view < views_.NumViews(); ++view) {
    if (!views_.IsHeldOut(view)) continue;
    for (int y = 0; y < views_.Height(view); y += stride) {
      for (int x = 0; x < views_.Width(view); x += stride) pixels.push_back({view, x, y});
    }
  }
  return pixels;
}

// The SH degree is settled in the course of the run, and then the probes are trained on as well: in
// between, an iteration may draw from either range.
void Trainer::MakeCache() {
  DrawingPlan plan;
  plan.seed = options_.random_seed;
  plan.num_tiles = NumTiles();
  plan.ranges = {pixels_, PixelRange(views_, ViewsToTrainOn(views_))};
  plan.first_iteration = progress_.iteration;
  plan.may_grow = options_.seconds > 0;
  plan.kept = ProbePixels();
  num_probes_kept_ = plan.kept.size();
  const std::vector<ViewPixel> held_out = EvaluationPixels();
  plan.kept.insert(plan.kept.end(), held_out.begin(), held_out.end());
  // Degree d can be found not to pay from d times kShRaise on, and the last is settled after it has
  // been tried; each iteration takes one of these steps at the most.
  const bool may_settle = probe_pixels_.size() > 0;
  const int degrees = options_.sh_degree;
  plan.ranges_at = [this, may_settle, degrees](int64_t iteration) -> std::vector<int> {
    if (!may_settle) return {1};
    // What late_rays makes of later iterations is not known where seconds decide.
    const bool unknown = options_.seconds > 0 && iteration > early_iterations_;
    const int64_t known = unknown ? early_iterations_ : iteration;
    if (RunFractionAt(known - degrees) >= kShRaise * (degrees + 1)) return {1};
    if (!unknown && RunFractionAt(iteration) < 2 * kShRaise) return {0};
    return {0, 1};
  };
  cache_ = std::make_unique<PixelCache>(views_, std::move(plan));
}

void Trainer::SettleShDegree(int degree) {
  SetShDegree(degree);
  sh_degree_is_settled_ = true;
  if (probe_pixels_.size() == 0) return;
  pixels_ = PixelRange(views_, ViewsToTrainOn(views_));
  probe_pixels_ = {};
}

void Trainer::SetShDegree(int degree) {
  if (degree == foam_.sh_degree) return;
  ChangeShDegree(degree, &foam_);
  optimizer_->ChangeShDegree(degree);
}

// The pixel's ray and colour; nothing where it has no ray or its colour is not finite. The index is
// its place in PixelsToKeep.
std::optional<BatchRay> Trainer::PixelAsRay(const ViewPixel& pixel,
                                            uint32_t start_cell,
                                            size_t kept_index) const {
  TrainingRay ray;
  const PixelValue* value = cache_ ? &cache_->Kept(kept_index) : nullptr;
  if (!RayOfPixel(pixel, value, &ray) || !ray.color.allFinite()) return {};
  BatchRay out;
  out.origin = views_.Origin(pixel.view).cast<float>();
  out.direction = ray.direction;
  out.start_cell = start_cell;
  std::copy_n(ray.color.data(), 3, out.target.color);
  out.target.class_index = ray.class_index;
  return out;
}

// Whether the highest degree makes enough of a difference to photos not seen.
bool Trainer::ShDegreePays() const {
  std::vector<BatchRay> rays;
  const std::vector<ViewPixel> pixels = ProbePixels();
  for (size_t i = 0; i < pixels.size(); ++i) {
    if (const auto ray = PixelAsRay(pixels[i], StartCell(pixels[i].view), i)) rays.push_back(*ray);
  }
  const LargePageVector<float> lower_sh = ShOfDegree(foam_, foam_.sh_degree - 1);
  CellShading<float> lower = Shading();
  lower.sh_degree = foam_.sh_degree - 1;
  lower.sh = lower_sh.data();
  const double without = SquaredError(lower, rays, nullptr),
               with = SquaredError(Shading(), rays, nullptr);
  VLOG(1) << "SH degree " << foam_.sh_degree
          << ": without it, the squared error on photos not seen is " << without / with
          << " times as large";
  return without >= (1 + kShWorthwhile) * with;
}

void Trainer::ChooseShDegreeIfDue() {
  const int degree = foam_.sh_degree;
  if (sh_degree_is_settled_ || RunFraction() < kShRaise * (degree + 1)) return;
  const bool can_probe = probe_pixels_.size() > 0;
  if (degree > 0 && can_probe && !ShDegreePays()) {
    SettleShDegree(degree - 1);
  } else if (degree < options_.sh_degree) {
    SetShDegree(degree + 1);
  } else {
    SettleShDegree(degree);
  }
}

// Sum over the rays of the squared difference between the colour over white and the target's. With
// `shown_classes`, also which class each ray shows, as ViewRenderer reads it.
double Trainer::SquaredError(const CellShading<float>& shading,
                             const std::vector<BatchRay>& rays,
                             std::vector<int32_t>* shown_classes) const {
  constexpr int64_t kBlock = 256;
  std::vector<double> errors((rays.size() + kBlock - 1) / kBlock, 0.0);
  if (shown_classes != nullptr) shown_classes->assign(rays.size(), kUnlabelled);
  ParallelForBlocks(rays.size(), kBlock, [&](int64_t begin, int64_t end) {
    const std::span<RayTrace> traces = ThreadTraces(end - begin);
    for (int64_t i = begin; i < end; ++i) {
      traces[i - begin].origin = rays[i].origin;
      traces[i - begin].direction = rays[i].direction;
      traces[i - begin].start_cell = rays[i].start_cell;
    }
    TraceRays(geometry_, shading, static_cast<float>(-std::log(kTransmittanceCutoff)), traces);
    std::vector<float> logits(foam_.num_classes);
    for (int64_t i = begin; i < end; ++i) {
      const RayComposite<float>& composite = traces[i - begin].composite;
      for (int c = 0; c < 3; ++c) {
        const double shown = std::min(composite.color[c] + composite.Transmittance(), 1.f);
        const double difference = shown - rays[i].target.color[c];
        errors[begin / kBlock] += difference * difference;
      }
      if (shown_classes == nullptr || !foam_.HasSemantics() || composite.Opacity() < 0.5f) continue;
      ClassLogits(foam_, composite.identity, logits.data());
      (*shown_classes)[i] = ArgmaxSoftmax(logits).class_index;
    }
  });
  return std::accumulate(errors.begin(), errors.end(), 0.0);
}

// Where densification ends, the sites are all there and an iteration costs what it will cost to the
// end: what time is left decides how many more there are.
void Trainer::FitToSecondsIfDue() {
  const int64_t measured = early_iterations_ / 4;
  if (options_.seconds <= 0 || measured == 0) return;
  const double now = SecondsSince(begin_);
  if (progress_.iteration == early_iterations_ - measured) pace_begin_ = now - seconds_evaluating_;
  if (progress_.iteration != early_iterations_) return;
  const double planned = double(planned_iterations_ - early_iterations_);
  const double pace =
      std::max(now - seconds_evaluating_ - pace_begin_, 1e-9) / double(measured);  // an iteration
  // Looking at rays costs less than learning from them; evaluations have shown how much.
  const double looked_at = double(EvaluationRays(views_)) * RunFraction();
  const double look = looked_at > 0 ? seconds_evaluating_ / looked_at
                                    : kLookedAtShare * pace / options_.rays_per_iteration;
  const double to_look_at = double(EvaluationRays(views_) + StatisticsRays(views_)) - looked_at;
  const double affordable = (options_.seconds - now - look * to_look_at) / pace;
  // Some end there must be, to settle in; and a pace mistaken by far must not last for ever.
  const auto late = static_cast<int64_t>(std::clamp(affordable, 0.1 * planned, 10 * planned));
  if (late == 0) return;
  progress_.num_iterations = early_iterations_ + late;
  summary_.late_rays = late * options_.rays_per_iteration;
}

void Trainer::EvaluateHeldOut() {
  double sum = 0;
  int count = 0;
  LabelAgreement agreement;
  const std::vector<ViewPixel> pixels = EvaluationPixels();
  for (size_t k = 0; k < pixels.size();) {
    const int view = pixels[k].view;
    const uint32_t start = StartCell(view);
    std::vector<BatchRay> rays;
    for (; k < pixels.size() && pixels[k].view == view; ++k) {
      if (const auto ray = PixelAsRay(pixels[k], start, num_probes_kept_ + k)) rays.push_back(*ray);
    }
    if (rays.empty()) continue;
    std::vector<int32_t> shown;
    const double error = SquaredError(Shading(), rays, &shown) / (3.0 * rays.size());
    sum += -10 * std::log10(std::max(error, 1e-12));
    ++count;
    if (!foam_.HasSemantics()) continue;
    for (size_t i = 0; i < rays.size(); ++i) agreement.Add(rays[i].target.class_index, shown[i]);
  }
  progress_.held_out_psnr = count > 0 ? sum / count : NAN;
  progress_.held_out_miou = agreement.MeanIou();
}

void Trainer::Report(const std::function<void(const TrainingProgress&)>& report) {
  progress_.sites = foam_.NumSites();
  progress_.seconds = SecondsSince(begin_);
  const double done = RunFraction();
  const double learning = progress_.seconds - seconds_reading_;
  progress_.seconds_left = done > 0 ? learning * (1 - done) / done : NAN;
  if (loss_count_ > 0) {
    progress_.color_loss = loss_sum_.color / loss_count_;
    progress_.opacity_loss = loss_sum_.opacity / loss_count_;
    progress_.quantile_loss = loss_sum_.quantile / loss_count_;
    progress_.identity_loss = foam_.HasSemantics() ? loss_sum_.identity / loss_count_ : NAN;
    loss_sum_ = {};
    loss_count_ = 0;
  }
  if (tv_count_ > 0) {
    progress_.tv_loss = tv_sum_ / tv_count_;
    tv_sum_ = 0;
    tv_count_ = 0;
  }
  if (report) report(progress_);
}

TrainingSummary Trainer::Run(const std::function<void(const TrainingProgress&)>& report) {
  double last_report = 0;
  int evaluations = 0;
  if (cache_ && report) {
    cache_->SetReport([&](int done, int total) {
      TrainingProgress reading = progress_;
      reading.photos_read = done;
      reading.photos_to_read = total;
      reading.seconds = SecondsSince(begin_);
      report(reading);
    });
  }
  if (cache_) {
    // Not counted in what an iteration takes.
    const double begin = SecondsSince(begin_);
    cache_->Drawn(progress_.iteration, RangeInCache(), progress_.num_iterations);
    seconds_reading_ = SecondsSince(begin_) - begin;
  }
  Retriangulate();
  while (progress_.iteration < progress_.num_iterations) {
    Iterate();
    ++progress_.iteration;
    progress_.rays += rays_.size();
    ChooseShDegreeIfDue();
    const bool densified = DensifyIfDue();
    if (!frozen_) {
      frozen_ = !PositionsMove();
      if (densified || frozen_ || TopologyIsStale()) {
        Retriangulate();
      } else if (progress_.iteration % kRefreshInterval == 0) {
        FollowSites();
      }
    }
    FitToSecondsIfDue();
    if (RunFraction() * kNumEvaluations >= evaluations + 1) {
      ++evaluations;
      const double begin = SecondsSince(begin_);
      EvaluateHeldOut();
      seconds_evaluating_ += SecondsSince(begin_) - begin;
    }
    if (SecondsSince(begin_) - last_report > 1 && progress_.iteration < progress_.num_iterations) {
      last_report = SecondsSince(begin_);
      Report(report);
    }
  }
  Report(report);
  if (progress_.rays == 0) {
    throw UserError(
        "There is nothing to train on: no pixel that was drawn has a ray and a finite colour.");
  }
  guard_.Finish(progress_.iteration);
  summary_.unstable_iterations = guard_.unstable_iterations();
  summary_.explained_contrast = guard_.explained_contrast();
  summary_.foam = std::move(foam_);
  // The renderer makes its own topology.
  optimizer_.reset();
  delaunay_ = {};
  geometry_ = {};
  batch_ = {};
  summary_.statistics =
      MeasureCells(summary_.foam, ViewRenderer(summary_.foam), views_, StatisticsStride(views_));
  summary_.last = progress_;
  return std::move(summary_);
}

}  // namespace

std::string TrainingOptions::Check() const {
  std::ostringstream reason;
  const auto require = [&](bool ok, const char* name, const char* range, auto value) {
    if (!ok && reason.str().empty()) {
      reason << "--FoamTraining." << name << " is " << value << "; it must be " << range << ".";
    }
  };
  const auto positive = [&](const char* name, double value) {
    require(value > 0 && std::isfinite(value), name, "greater than 0", value);
  };
  const auto not_negative = [&](const char* name, double value) {
    require(value >= 0 && std::isfinite(value), name, "0 or more", value);
  };
  // Beyond this, products of parameters leave the range of floats.
  const auto bounded = [&](const char* name, double value) {
    require(value >= 0 && value <= 1e6, name, "from 0 to 1000000", value);
  };
  const auto fraction = [&](const char* name, double value) {
    require(value >= 0 && value <= 1, name, "from 0 to 1", value);
  };
  positive("num_rays", num_rays);
  not_negative("late_rays", late_rays);
  require(rays_per_iteration >= 1 && rays_per_iteration <= 1 << 24,
          "rays_per_iteration",
          "from 1 to 16777216",
          rays_per_iteration);
  not_negative("initial_sites", initial_sites);
  require(final_sites >= 64 && final_sites <= 1 << 28,
          "final_sites",
          "from 64 to 268435456",
          final_sites);
  require(sh_degree >= 0 && sh_degree <= 3, "sh_degree", "from 0 to 3", sh_degree);
  require(transmittance_cutoff > 0 && transmittance_cutoff < 1,
          "transmittance_cutoff",
          "greater than 0 and less than 1",
          transmittance_cutoff);
  bounded("opacity_weight", opacity_weight);
  bounded("quantile_weight", quantile_weight);
  bounded("identity_weight", identity_weight);
  bounded("cell_identity_weight", cell_identity_weight);
  fraction("identity_to_density", identity_to_density);
  bounded("tv_weight", tv_weight);
  bounded("position_rate", position_rate);
  bounded("density_rate", density_rate);
  bounded("color_rate", color_rate);
  bounded("sh_factor", sh_factor);
  bounded("identity_rate", identity_rate);
  bounded("classifier_rate", classifier_rate);
  fraction("final_rate", final_rate);
  fraction("densify_from", densify_from);
  fraction("densify_until", densify_until);
  not_negative("densify_events", densify_events);
  fraction("freeze_positions", freeze_positions);
  return reason.str();
}

std::string TrainingSummary::BriefReport() const {
  std::ostringstream text;
  text << std::fixed << std::setprecision(1) << "Trained " << foam.NumSites() << " cells in "
       << last.seconds << " s with " << last.rays / 1e6 << " M rays ("
       << last.rays / std::max(last.seconds, 1e-9) / 1e3 << " k rays/s, "
       << double(pieces) / std::max<int64_t>(last.rays, 1) << " cells a ray); " << triangulations
       << " triangulations took " << seconds_triangulating << " s; " << step_limit_hits
       << " rays hit the step limit, " << nonfinite_gradients << " updates skipped";
  if (std::isfinite(last.held_out_psnr)) {
    text << "; held-out PSNR " << std::setprecision(2) << last.held_out_psnr << " dB";
  }
  if (std::isfinite(last.held_out_miou)) {
    text << ", mIoU " << std::setprecision(3) << last.held_out_miou << " against the masks";
  }
  text << ".";
  return text.str();
}

int64_t EvaluationRays(const TrainingViews& views) {
  return kNumEvaluations * GridRays(views, /*held_out=*/true, EvaluationStride(views));
}

int64_t StatisticsRays(const TrainingViews& views) {
  return GridRays(views, /*held_out=*/false, StatisticsStride(views));
}

TrainingSummary TrainFoam(const TrainingViews& views,
                          const std::vector<SeedPoint>& seeds,
                          int num_classes,
                          const TrainingOptions& options,
                          const std::function<void(const TrainingProgress&)>& report) {
  if (const std::string reason = options.Check(); !reason.empty()) throw UserError(reason);
  return Trainer(views, seeds, num_classes, options).Run(report);
}

}  // namespace semfoam
