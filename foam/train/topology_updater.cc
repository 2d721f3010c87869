// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/train/topology_updater.h"

#include "foam/geometry/guard_sites.h"
#include "foam/train/checkpoint_state.h"
#include "foam/util/elapsed_time.h"
#include "foam/util/parallel.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <future>
#include <span>
#include <utility>

#include <glog/logging.h>

namespace semfoam {
namespace {

// The planes follow the sites every so many iterations: moving all of them costs as much as casting
// a thousand rays, and between two of its own steps a cell waits longer than that.
constexpr int64_t kRefreshInterval = 2;

// A new topology comes when the old one has begun to lead rays astray, which shows in cells that a
// ray leaves before it has entered them, and after so many iterations at the latest. But a stale
// one is only renewed while the sites triangulated so far, those of densifications left out, are no
// more than so many per segment of a ray cast: some 10 % of the time of a run, whatever the scene.
// If densifications counted, a stale topology would stay between them, and held-out PSNR would fall
// by 1.4 dB. Counted in sites and segments, not seconds, so that the machine changes no byte.
constexpr double kStaleShare = 2e-3;
constexpr double kTriangulatedSitesPerSegment = 4e-3;
constexpr int64_t kMinTriangulationInterval = 20;
constexpr int64_t kMaxTriangulationInterval = 1000;

// A triangulation beside the iterations takes no more than this share of those in which sites come,
// however short the run.
constexpr double kMostLagShare = 1.0 / 16;

// The cells are watched for at least this share of the distance between two densifications before
// the next one judges them. Triangulations may make one late; the next, on time, would prune cells
// because no ray has come to them yet: a third of them, and 0.3 dB, in one run of 72 M rays.
constexpr double kLeastWatchedShare = 0.5;

}  // namespace

// A triangulation computed while iterations run.
struct TopologyUpdater::PendingTriangulation {
  // When it was asked for.
  int64_t iteration = 0;
  // Its positions are triangulated. A densification takes effect with the new topology; without an
  // origin the sites stay those that there are.
  Rearrangement plan;
  // Declared last, so that it goes first, and waits for the thread that reads the positions.
  std::future<TrainingTopology> topology;

  template <typename Archive>
  void Serialize(Archive* archive) {
    size_t num_sites = plan.positions.size(), num_origins = plan.origin.size();
    archive->Number("iteration", &iteration);
    archive->Number("sites", &num_sites);
    archive->Number("origins", &num_origins);
    archive->Array("pending_positions", &plan.positions, num_sites);
    archive->Array("pending_origin", &plan.origin, num_origins);
    archive->Array("pending_is_new", &plan.is_new, num_origins);
  }
};

TopologyUpdater::TopologyUpdater(const TrainingViews& views,
                                 const std::vector<SeedPoint>& seeds,
                                 const TrainingOptions& options,
                                 const TrainingSchedule& schedule,
                                 CameraCells* camera_cells,
                                 TrainingState* state,
                                 TrainingDevice* device)
    : options_(options),
      schedule_(schedule),
      free_space_(views, seeds),
      camera_cells_(camera_cells),
      state_(state),
      device_(device) {}

TopologyUpdater::~TopologyUpdater() = default;

void TopologyUpdater::Observe(const BatchTotals& batch) {
  num_segments_ += batch.num_segments;
  batch_segments_ = batch.num_segments;
  batch_clamped_segments_ = batch.clamped_segments;
}

// No other triangulation is started while one is running.
void TopologyUpdater::Update(int64_t iteration) {
  if (pending_ != nullptr) {
    const int lag = TriangulationLag(pending_->plan.positions.size());
    if (iteration >= pending_->iteration + lag) return TakeOver(iteration);
  } else if (DensificationIsDue(iteration)) {
    device_->DownloadSites();
    Rearrangement plan = PlanNextDensification();
    if (TriangulationLag(plan.positions.size()) == 0) {
      CarryOut(plan, iteration);
      plan = {};
      return Triangulate(iteration);
    }
    Begin(iteration, std::move(plan));
  } else if (!is_frozen_ && (!PositionsMove(iteration) || TopologyIsStale(iteration))) {
    is_frozen_ = !PositionsMove(iteration);
    if (TriangulationLag(state_->foam.NumSites()) == 0) {
      triangulated_sites_ += std::ssize(state_->foam.positions);
      return Triangulate(iteration);
    }
    device_->DownloadSites();
    Begin(iteration, {});
  }
  if ((!is_frozen_ || pending_ != nullptr) && iteration % kRefreshInterval == 0) {
    device_->RefreshPlanes();
  }
}

void TopologyUpdater::Abandon() { pending_.reset(); }

void TopologyUpdater::Summarize(TrainingSummary* summary) const {
  summary->segments = num_segments_;
  summary->triangulations = num_triangulations_;
  summary->seconds_triangulating = seconds_triangulating_;
  summary->triangulation_lag = TriangulationLag(state_->foam.NumSites());
}

// Returns how many iterations pass from the begin to the end of a triangulation of so many sites;
// 0: none is ever pending.
int TopologyUpdater::TriangulationLag(size_t num_sites) const {
  const auto most =
      static_cast<int>(std::min(kMostLagShare * double(schedule_.early_iterations()), 1e9));
  return std::clamp(device_->TriangulationLag(num_sites), 0, most);
}

bool TopologyUpdater::TopologyIsStale(int64_t iteration) const {
  const int64_t age = iteration - last_triangulation_;
  const bool affordable = double(triangulated_sites_ + state_->foam.NumSites()) <=
                          kTriangulatedSitesPerSegment * double(num_segments_);
  return age >= kMaxTriangulationInterval ||
         (age >= kMinTriangulationInterval && affordable &&
          batch_clamped_segments_ > kStaleShare * batch_segments_);
}

// Spreads densifications evenly over [densify_from, densify_until].
bool TopologyUpdater::DensificationIsDue(int64_t iteration) const {
  if (num_densifications_ >= options_.densify_events || !PositionsMove(iteration)) return false;
  const double interval =
      (options_.densify_until - options_.densify_from) / std::max(1, options_.densify_events - 1);
  const double now = schedule_.RunFraction(iteration);
  if (now < options_.densify_from + interval * num_densifications_) return false;
  return num_densifications_ == 0 ||
         now - schedule_.RunFraction(watched_since_) >= kLeastWatchedShare * interval;
}

// Multiplies the sites by what is left to reach the final number, so that prunings are made up for.
Rearrangement TopologyUpdater::PlanNextDensification() {
  const double growth = std::pow(double(options_.final_sites) / state_->foam.NumSites(),
                                 1.0 / (options_.densify_events - num_densifications_));
  DensificationOptions densify;
  densify.num_to_add = static_cast<size_t>(std::max(0.0, state_->foam.NumSites() * (growth - 1)));
  return PlanDensification(state_->topology.delaunay(),
                           state_->densification,
                           densify,
                           options_.random_seed,
                           num_densifications_++,
                           state_->foam);
}

void TopologyUpdater::CarryOut(const Rearrangement& densification, int64_t iteration) {
  device_->Rearrange(densification);
  watched_since_ = iteration;
  camera_cells_->Reset();
}

// Begins a triangulation beside the iterations; without a plan of change, of the host's sites.
void TopologyUpdater::Begin(int64_t iteration, Rearrangement plan) {
  pending_ = std::make_unique<PendingTriangulation>();
  pending_->iteration = iteration;
  pending_->plan = std::move(plan);
  if (pending_->plan.positions.empty()) pending_->plan.positions = state_->foam.positions;
  StartThread();
}

void TopologyUpdater::StartThread() {
  const std::vector<Eigen::Vector3f>& sites = pending_->plan.positions;
  const bool with_areas = NeedsAreas();
  // A run that may use one thread alone triangulates when the result is due, with the same bytes.
  const auto policy = NumThreads() > 1 ? std::launch::async : std::launch::deferred;
  pending_->topology = std::async(policy, [this, &sites, with_areas] {
    TrainingTopology topology;
    topology.Triangulate(sites, free_space_, with_areas);
    return topology;
  });
}

void TopologyUpdater::TakeOver(int64_t iteration) {
  const auto begin = std::chrono::steady_clock::now();
  TrainingTopology topology = pending_->topology.get();
  const double waited = SecondsSince(begin);
  if (!pending_->plan.origin.empty()) CarryOut(pending_->plan, iteration);
  state_->topology = std::move(topology);
  HandOver(pending_->iteration);
  if (pending_->plan.origin.empty()) triangulated_sites_ += std::ssize(pending_->plan.positions);
  device_->RefreshPlanes();
  pending_.reset();
  const double seconds = SecondsSince(begin);
  seconds_triangulating_ += seconds;
  VLOG(1) << "Took over the triangulation of " << state_->foam.NumSites() << " sites: waited "
          << waited << " s for it, " << seconds << " s in all";
}

void TopologyUpdater::Triangulate(int64_t iteration) {
  const auto begin = std::chrono::steady_clock::now();
  device_->DownloadSites();
  state_->topology.Triangulate(state_->foam.positions, free_space_, NeedsAreas());
  HandOver(iteration);
  seconds_triangulating_ += SecondsSince(begin);
}

// Uploads the host's new topology, of the sites of an iteration.
void TopologyUpdater::HandOver(int64_t iteration) {
  device_->UploadTopology();
  device_->ClampDensities();
  last_triangulation_ = iteration;
  ++num_triangulations_;
}

void TopologyUpdater::Save(CheckpointContents* contents) const {
  const size_t num_sites = state_->foam.NumSites();
  const std::span planes(state_->topology.geometry().positions.data(), num_sites);
  StateWriter state("state", contents);
  state.Array("triangulated_positions", &state_->topology.triangulated_sites(), num_sites);
  state.Array("plane_positions", &planes, num_sites);
  if (pending_ != nullptr) {
    StateWriter pending("pending", contents);
    pending_->Serialize(&pending);
  }
}

TopologyUpdater::SavedSites TopologyUpdater::Read(const Checkpoint& checkpoint, int64_t iteration) {
  const size_t num_sites = state_->foam.NumSites();
  StateReader state("state", checkpoint);
  SavedSites saved;
  state.Array("triangulated_positions", &saved.triangulated, num_sites);
  state.Array("plane_positions", &saved.planes, num_sites);
  std::vector<const std::vector<Eigen::Vector3f>*> all = {
      &state_->foam.positions, &saved.triangulated, &saved.planes};
  if (!checkpoint.Texts("pending").empty()) {
    pending_ = std::make_unique<PendingTriangulation>();
    StateReader pending("pending", checkpoint);
    pending_->Serialize(&pending);
    const Rearrangement& plan = pending_->plan;
    const size_t num_pending = plan.positions.size();
    if (num_pending != (plan.origin.empty() ? num_sites : plan.origin.size()) ||
        std::any_of(
            plan.origin.begin(), plan.origin.end(), [&](uint32_t i) { return i >= num_sites; })) {
      checkpoint.ThrowDamaged("its next triangulation has other sites");
    }
    if (pending_->iteration < 0 || pending_->iteration > iteration) {
      checkpoint.ThrowDamaged("its next triangulation is of an iteration to come");
    }
    all.push_back(&plan.positions);
  }
  for (const auto* sites : all) {
    for (const Eigen::Vector3f& site : *sites) {
      if (site.norm() > 1.01f * kFarRadius) checkpoint.ThrowDamaged("a site is out of bounds");
    }
  }
  return saved;
}

void TopologyUpdater::Restore(const SavedSites& sites) {
  state_->topology.Triangulate(sites.triangulated, free_space_, NeedsAreas());
  state_->topology.RefreshPlanes(sites.planes);
  device_->Upload();
  device_->UploadTopology();
  if (pending_ != nullptr) StartThread();
}

}  // namespace semfoam
