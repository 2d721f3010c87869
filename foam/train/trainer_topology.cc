// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/optim/densification.h"
#include "foam/train/trainer_internal.h"
#include "foam/util/elapsed_time.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <future>
#include <memory>
#include <utility>
#include <vector>

#include <glog/logging.h>

namespace semfoam {
namespace {

// The planes follow the sites every so many iterations: moving all of them costs as much as casting
// a thousand rays, and between two of its own steps a cell waits longer than that.
constexpr int64_t kRefreshInterval = 2;

// A new topology comes when the old one has begun to lead rays astray, which shows in cells that a
// ray leaves before it has entered them, and after so many iterations at the latest. But a stale
// one is only renewed while the sites triangulated so far are no more than so many per segment of a
// ray cast: some 9 % of the time of a run, whatever the scene. Counted in sites and segments, not
// seconds, so that the machine changes no byte.
constexpr double kStaleShare = 2e-3;
constexpr double kTriangulatedSitesPerSegment = 1.5e-3;
constexpr int64_t kMinTriangulationInterval = 20;
constexpr int64_t kMaxTriangulationInterval = 1000;

// A triangulation beside the iterations takes no more than this share of those in which sites come,
// however short the run.
constexpr double kMostLagShare = 1.0 / 16;

}  // namespace

// From the begin to the end of a triangulation of so many sites, in iterations; 0: none is ever
// pending.
int Trainer::TriangulationLag(size_t num_sites) const {
  const auto most =
      static_cast<int>(std::min(kMostLagShare * double(schedule_.early_iterations()), 1e9));
  return std::clamp(device_->TriangulationLag(num_sites), 0, most);
}

bool Trainer::TopologyIsStale() const {
  const int64_t age = progress_.iteration - last_triangulation_;
  const bool affordable = double(triangulated_sites_ + state_.foam.NumSites()) <=
                          kTriangulatedSitesPerSegment * double(summary_.segments);
  return age >= kMaxTriangulationInterval ||
         (age >= kMinTriangulationInterval && affordable &&
          batch_.clamped_segments > kStaleShare * batch_.num_segments);
}

// Densification events are spread evenly over [densify_from, densify_until].
bool Trainer::DensificationIsDue() const {
  if (densifications_ >= options_.densify_events) return false;
  const double due = options_.densify_from + (options_.densify_until - options_.densify_from) *
                                                 densifications_ /
                                                 std::max(1, options_.densify_events - 1);
  return RunFraction() >= due && PositionsMove();
}

// Each multiplies the sites by what is left to reach the final number, so that prunings are made up
// for.
Rearrangement Trainer::PlanNextDensification() {
  const double growth = std::pow(double(options_.final_sites) / state_.foam.NumSites(),
                                 1.0 / (options_.densify_events - densifications_));
  DensificationOptions densify;
  densify.num_to_add = static_cast<size_t>(std::max(0.0, state_.foam.NumSites() * (growth - 1)));
  return PlanDensification(state_.topology.delaunay(),
                           state_.densification,
                           densify,
                           options_.random_seed,
                           densifications_++,
                           state_.foam);
}

void Trainer::CarryOut(const Rearrangement& densification) {
  device_->Rearrange(densification);
  start_cells_.assign(views_.NumViews(), 0);
}

// Without a plan of change: of the sites that there are.
void Trainer::BeginTriangulation(Rearrangement plan) {
  pending_ = std::make_unique<PendingTriangulation>();
  pending_->iteration = progress_.iteration;
  pending_->plan = std::move(plan);
  if (pending_->plan.positions.empty()) pending_->plan.positions = state_.foam.positions;
  StartTriangulating();
}

void Trainer::StartTriangulating() {
  const std::vector<Eigen::Vector3f>& sites = pending_->plan.positions;
  const bool with_areas = state_.foam.HasSemantics();
  pending_->topology = std::async(std::launch::async, [this, &sites, with_areas] {
    TrainingTopology topology;
    topology.Triangulate(sites, free_space_, with_areas);
    return topology;
  });
}

void Trainer::TakeOverTriangulation() {
  const auto begin = std::chrono::steady_clock::now();
  TrainingTopology topology = pending_->topology.get();
  const double waited = SecondsSince(begin);
  if (!pending_->plan.origin.empty()) CarryOut(pending_->plan);
  state_.topology = std::move(topology);
  HandOverTopology(pending_->iteration);
  device_->FollowSites();
  pending_.reset();
  const double seconds = SecondsSince(begin);
  summary_.seconds_triangulating += seconds;
  VLOG(1) << "Took over the triangulation of " << state_.foam.NumSites() << " sites: waited "
          << waited << " s for it, " << seconds << " s in all";
}

// At once, of the device's sites.
void Trainer::Retriangulate() {
  const auto begin = std::chrono::steady_clock::now();
  device_->DownloadSites();
  state_.topology.Triangulate(state_.foam.positions, free_space_, state_.foam.HasSemantics());
  HandOverTopology(progress_.iteration);
  summary_.seconds_triangulating += SecondsSince(begin);
}

// The host's new topology, of the sites of an iteration.
void Trainer::HandOverTopology(int64_t iteration) {
  device_->UploadTopology();
  device_->HoldDensities();
  last_triangulation_ = iteration;
  if (summary_.triangulations > 0) triangulated_sites_ += state_.foam.NumSites();
  ++summary_.triangulations;
}

// After every iteration. While a triangulation is under way nothing asks for another one.
void Trainer::UpdateTopology() {
  if (pending_ != nullptr) {
    const int lag = TriangulationLag(pending_->plan.positions.size());
    if (progress_.iteration >= pending_->iteration + lag) return TakeOverTriangulation();
  } else if (DensificationIsDue()) {
    device_->DownloadSites();
    Rearrangement plan = PlanNextDensification();
    if (TriangulationLag(plan.positions.size()) == 0) {
      CarryOut(plan);
      plan = {};
      return Retriangulate();
    }
    BeginTriangulation(std::move(plan));
  } else if (!frozen_ && (!PositionsMove() || TopologyIsStale())) {
    frozen_ = !PositionsMove();
    if (TriangulationLag(state_.foam.NumSites()) == 0) return Retriangulate();
    device_->DownloadSites();
    BeginTriangulation({});
  }
  if ((!frozen_ || pending_ != nullptr) && progress_.iteration % kRefreshInterval == 0) {
    device_->FollowSites();
  }
}

}  // namespace semfoam
