// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/stereo/ground_plane.h"

#include "foam/geometry/upward.h"
#include "foam/util/parallel.h"
#include "plugin/stereo/plane_warp.h"
#include "plugin/stereo/reduced_view.h"
#include "plugin/stereo/window_correlation.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <utility>

#include <Eigen/Geometry>
#include <glog/logging.h>

namespace semfoam {
namespace {

constexpr int kCoarse = 4, kFine = 2;
constexpr size_t kFewestViews = 3, kMostViews = 8, kPartners = 2;
// Partners of a view that its ground is compared with.
constexpr size_t kPartnersOnGround = 4;
// Sine of the angle by which cameras look up or down at most.
constexpr double kMostPitch = 0.5;
// Share of the lowest pixels whose depth may be known.
constexpr double kMostKnown = 0.25;
// Shares of the pixels that must be nearer than the planes of a sweep, and that must have texture
// on the ground and be seen by a partner.
constexpr double kLeastNearer = 0.02, kLeastCompared = 0.005;
constexpr double kDegree = std::numbers::pi / 180;
// Tilts are tried to either side in steps: sideways, and forwards, where the cameras' pitch is not
// known more of them.
constexpr int kTilts = 3, kTiltsOfPitch = 8;
constexpr double kTiltStep = 2 * kDegree;
constexpr double kLowest = 0.015, kHighest = 1.5, kHeightRatio = 1.125;
constexpr size_t kRefined = 8;
constexpr float kCorrelated = 0.7f;
// Correlations above which a window speaks for a plane, and of windows that have nothing in common.
constexpr float kHalf = 0.5f, kChance = 0.25f;
// Standard deviation from which on a window counts in full, in display values.
constexpr float kFullTexture = 0.08f;
constexpr double kLeastAgreement = 0.45, kLeastLead = 0.15;
constexpr double kBeside = 1.4;
// Share of the known points that may lie below the plane, by more than this share of their
// distance.
constexpr double kMostBelow = 0.02, kBelow = 0.02;

// A level plane below the cameras, tilted a little: tangents, and of the cameras' mean height above
// it.
struct Tilt {
  double sideways = 0, forwards = 0;
  double log_height = 0;
};

// A view and another one to compare it with.
struct ComparedPair {
  size_t view, partner;
  PlaneWarp warp;
};

// How well pairs of views agree on a plane. Windows count by their texture.
struct PlaneScore {
  // Sum of what the correlations are above kHalf, or below it: windows that are not on the plane
  // speak against it, but no more than by chance.
  double evidence = 0;
  double sum = 0;
  double num_windows = 0;

  double Mean() const { return num_windows > 0 ? sum / num_windows : -1; }
};

std::vector<uint8_t> IsKnown(const DepthMap& map) {
  std::vector<uint8_t> is_known(map.inverse.size());
  for (size_t i = 0; i < is_known.size(); ++i) is_known[i] = map.inverse[i] > 0;
  return is_known;
}

// Returns whether a view looks ahead, and hardly any depth is known of what it shows lowest: of the
// sixth of its pixels that look down most.
bool StandsBeforeUnknown(const StereoView& view, const DepthMap& known, const Eigen::Vector3d& up) {
  const Eigen::Vector3d up_in_view = view.cam_from_world * up;
  if (std::abs(up_in_view.z()) > kMostPitch) return false;
  const Eigen::Vector3d plane = LevelPlane{up, up.dot(view.origin) - 1}.InImage(view);
  std::vector<std::pair<double, size_t>> order;
  order.reserve(known.inverse.size());
  for (size_t i = 0; i < known.inverse.size(); ++i)
    order.emplace_back(-plane.dot(view.CenterOf(i).homogeneous()), i);
  const auto lowest = order.begin() + static_cast<ptrdiff_t>(order.size() / 6);
  std::nth_element(order.begin(), lowest, order.end());
  if (lowest == order.begin() || !(lowest->first < 0)) return false;
  const auto num_known = std::count_if(
      order.begin(), lowest, [&](const auto& pixel) { return known.inverse[pixel.second] > 0; });
  return static_cast<double>(num_known) <= kMostKnown * static_cast<double>(lowest - order.begin());
}

// Returns the share of a view's pixels without a depth that see the plane nearer than `nearest`, an
// inverse depth.
double ShareNearer(const StereoView& view,
                   const DepthMap& known,
                   const LevelPlane& ground,
                   double nearest) {
  if (ground.up.dot(view.origin) <= ground.level) return 0;
  const Eigen::Vector3d plane = ground.InImage(view);
  size_t count = 0;
  for (size_t i = 0; i < known.inverse.size(); ++i) {
    count += !(known.inverse[i] > 0) && plane.dot(view.CenterOf(i).homogeneous()) > nearest;
  }
  return static_cast<double>(count) /
         static_cast<double>(std::max<size_t>(1, known.inverse.size()));
}

// Compares views, reduced by one factor, on planes.
class GroundComparison {
 public:
  GroundComparison(const std::vector<StereoView>& views,
                   const std::vector<ViewOverlap>& overlaps,
                   const std::vector<DepthMap>& known,
                   const std::vector<size_t>& chosen,
                   int reduction)
      : reduced_(views.size()), windows_(views.size()), farthest_(views.size()) {
    for (const size_t i : chosen) {
      size_t count = 0;
      for (const int partner : overlaps[i].partners) {
        const auto j = static_cast<size_t>(partner);
        if (known[j].inverse.empty() || count == kPartners) continue;
        ++count;
        for (const size_t k : {i, j}) {
          if (reduced_[k].view.NumPixels() > 0) continue;
          reduced_[k] = Reduce(views[k], IsKnown(known[k]), reduction);
          farthest_[k] = overlaps[k].depths.far;
        }
        pairs_.push_back({i, j, PlaneWarp(reduced_[i].view, reduced_[j].view)});
      }
      const StereoView& view = reduced_[i].view;
      if (std::min(view.width, view.height) > 2 * kWindowRadius) windows_[i].emplace(view);
    }
  }

  size_t NumPixels() const {
    size_t count = 0;
    for (const ComparedPair& pair : pairs_) count += reduced_[pair.view].view.NumPixels();
    return count;
  }

  // Compares every `step`-th pair on `plane`, in pixels that see `nearby` before all else that is
  // known: what is farther moves little, so that it agrees on planes of any height. Of planes that
  // are compared with each other `nearby` should be the same, or that with more pixels is better.
  PlaneScore Score(const LevelPlane& plane, const LevelPlane& nearby, size_t step) const {
    PlaneScore score;
    Buffers buffers;
    for (size_t k = 0; k < pairs_.size(); k += step) {
      AddPair(plane, nearby, pairs_[k], &buffers, &score);
    }
    return score;
  }

 private:
  // What pairs are compared in.
  struct Buffers {
    // What the partner shows of the plane, and how it correlates with the view.
    ImageValues warped, scores;
    WindowCorrelation::Buffers windows;
  };

  void AddPair(const LevelPlane& plane,
               const LevelPlane& nearby,
               const ComparedPair& pair,
               Buffers* buffers,
               PlaneScore* score) const {
    if (!windows_[pair.view]) return;
    const WindowCorrelation& windows = *windows_[pair.view];
    const ReducedView& reduced = reduced_[pair.view];
    const StereoView& view = reduced.view;
    const StereoView& partner = reduced_[pair.partner].view;
    if (plane.up.dot(view.origin) <= plane.level || plane.up.dot(partner.origin) <= plane.level) {
      return;
    }
    const Eigen::Vector3d in_image = plane.InImage(view), nearby_in_image = nearby.InImage(view);
    ImageValues& warped = buffers->warped;
    ImageValues& scores = buffers->scores;
    warped.resize(view.NumPixels());
    scores.resize(view.NumPixels());
    pair.warp.Warp(in_image.cast<float>(), view.width, view.height, partner, &warped);
    windows.Correlate(warped, &buffers->windows, &scores);
    for (size_t i = 0; i < scores.size(); ++i) {
      if (reduced.is_unknown[i] == 0 || !(scores[i] > kNoCorrelation)) continue;
      if (!(nearby_in_image.dot(view.CenterOf(i).homogeneous()) > farthest_[pair.view])) continue;
      const double weight = std::min(1.f, windows.Deviation(i) / kFullTexture);
      score->evidence += weight * (std::max(kChance, scores[i]) - kHalf);
      score->sum += weight * scores[i];
      score->num_windows += weight;
    }
  }

  std::vector<ReducedView> reduced_;
  // [views] Of those that are compared with partners and are larger than a window.
  std::vector<std::optional<WindowCorrelation>> windows_;
  // [views] Inverse depths.
  std::vector<double> farthest_;
  std::vector<ComparedPair> pairs_;
};

// The planes among which the ground is looked for.
struct Candidates {
  Eigen::Vector3d up, right, forward;
  // Mean of the cameras, and the distance from them of the sweep's nearest plane.
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  double distance = 0;
  int num_forwards = kTilts;  // to either side

  LevelPlane PlaneOf(const Tilt& tilt) const {
    LevelPlane plane;
    plane.up = (up + tilt.sideways * right + tilt.forwards * forward).normalized();
    plane.level = plane.up.dot(center) - std::exp(tilt.log_height);
    return plane;
  }

  // Returns whether the tilt lies within half a step around the grid.
  bool IsNear(const Tilt& tilt) const {
    return std::abs(tilt.sideways) <= (kTilts + 0.5) * kTiltStep &&
           std::abs(tilt.forwards) <= (num_forwards + 0.5) * kTiltStep;
  }

  std::vector<Tilt> Grid() const {
    std::vector<Tilt> tilts;
    for (int a = -kTilts; a <= kTilts; ++a) {
      for (int b = -num_forwards; b <= num_forwards; ++b) {
        for (double height = kLowest; height <= kHighest; height *= kHeightRatio) {
          tilts.push_back({a * kTiltStep, b * kTiltStep, std::log(height * distance)});
        }
      }
    }
    return tilts;
  }
};

// Climbs from a tilt to the most evidence by pattern search (Hooke and Jeeves, J. ACM 1961): a tilt
// and a height that belong together are a ridge, which no single coordinate follows.
class TiltSearch {
 public:
  TiltSearch(const GroundComparison& comparison, const Candidates& candidates, const Tilt& start)
      : comparison_(comparison),
        candidates_(candidates),
        start_(start),
        start_plane_(candidates.PlaneOf(start)) {}

  // `step` is that of the tilts to begin with.
  Tilt Climb(double step) const {
    constexpr int kHalvings = 4;
    Scored at = {start_, EvidenceOf(start_)};
    for (int halvings = 0; halvings < kHalvings;) {
      Scored next = Explore(at, step);
      if (next.evidence <= at.evidence) {
        step /= 2;
        ++halvings;
        continue;
      }
      while (next.evidence > at.evidence) {
        const Tilt ahead = {2 * next.tilt.sideways - at.tilt.sideways,
                            2 * next.tilt.forwards - at.tilt.forwards,
                            2 * next.tilt.log_height - at.tilt.log_height};
        at = next;
        next = Explore({ahead, EvidenceOf(ahead)}, step);
      }
    }
    return at.tilt;
  }

 private:
  struct Scored {
    Tilt tilt;
    double evidence;
  };

  double EvidenceOf(const Tilt& tilt) const {
    if (!candidates_.IsNear(tilt)) return -std::numeric_limits<double>::infinity();
    return comparison_.Score(candidates_.PlaneOf(tilt), start_plane_, 1).evidence;
  }

  // Takes the better of two steps along each coordinate, if it is better than none.
  Scored Explore(Scored at, double step) const {
    for (double Tilt::*const coordinate : {&Tilt::sideways, &Tilt::forwards, &Tilt::log_height}) {
      // A change of the height by a tenth does about as much as a tilt by a degree.
      const double size = coordinate == &Tilt::log_height ? 4 * step : step;
      const Scored from = at;
      for (const double by : {size, -size}) {
        Scored moved = from;
        moved.tilt.*coordinate += by;
        moved.evidence = EvidenceOf(moved.tilt);
        if (moved.evidence > at.evidence) at = moved;
      }
    }
    return at;
  }

  const GroundComparison& comparison_;
  const Candidates& candidates_;
  Tilt start_;
  LevelPlane start_plane_;
};

// Returns the share of the known points that lie below the plane.
double ShareBelow(const std::vector<StereoView>& views,
                  const std::vector<DepthMap>& known,
                  const LevelPlane& plane) {
  int64_t below = 0, count = 0;
  for (size_t k = 0; k < views.size(); ++k) {
    const StereoView& view = views[k];
    constexpr size_t kEvery = 16;
    for (size_t i = 0; i < known[k].inverse.size(); i += kEvery) {
      if (!(known[k].inverse[i] > 0)) continue;
      const double depth = 1.0 / known[k].inverse[i];
      below += plane.up.dot(view.PointAt(view.CenterOf(i), depth)) < plane.level - kBelow * depth;
      ++count;
    }
  }
  return count > 0 ? static_cast<double>(below) / static_cast<double>(count) : 0;
}

// Returns the views that stand before ground of unknown depth.
std::vector<size_t> ViewsBeforeUnknown(const std::vector<StereoView>& views,
                                       const std::vector<DepthMap>& known,
                                       const Eigen::Vector3d& up) {
  std::vector<size_t> found;
  for (size_t i = 0; i < views.size(); ++i) {
    if (!known[i].inverse.empty() && StandsBeforeUnknown(views[i], known[i], up)) {
      found.push_back(i);
    }
  }
  return found;
}

// Returns the planes to look for the ground among, for these views.
Candidates CandidatesFor(const std::vector<StereoView>& views,
                         const std::vector<ViewOverlap>& overlaps,
                         const std::vector<size_t>& showing,
                         const CameraUp& up) {
  Candidates candidates;
  candidates.up = up.up;
  candidates.num_forwards = up.by_horizon ? kTilts : kTiltsOfPitch;
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  std::vector<double> nearest;
  for (const size_t i : showing) {
    right += views[i].cam_from_world.row(0).transpose();
    candidates.center += views[i].origin / static_cast<double>(showing.size());
    nearest.push_back(1 / overlaps[i].depths.near);
  }
  const auto median = nearest.begin() + static_cast<ptrdiff_t>(nearest.size() / 2);
  std::nth_element(nearest.begin(), median, nearest.end());
  candidates.distance = *median;
  // Where the cameras look all around, any horizontal direction will do.
  const Eigen::Vector3d forward = right.cross(up.up);
  candidates.forward = forward.norm() > 0 ? Eigen::Vector3d(forward.normalized())
                                          : Eigen::Vector3d(up.up.unitOrthogonal());
  candidates.right = candidates.forward.cross(up.up);
  return candidates;
}

// Returns the tilts of the grid with the most evidence, at most kRefined, the best first.
std::vector<Tilt> BestOfGrid(const GroundComparison& comparison, const Candidates& candidates) {
  const std::vector<Tilt> tilts = candidates.Grid();
  std::vector<std::pair<double, size_t>> order(tilts.size());
  ParallelForBlocks(static_cast<int64_t>(tilts.size()), 16, [&](int64_t begin, int64_t end) {
    for (auto i = static_cast<size_t>(begin); i < static_cast<size_t>(end); ++i) {
      const LevelPlane plane = candidates.PlaneOf(tilts[i]);
      order[i] = {-comparison.Score(plane, plane, 2).evidence, i};
    }
  });
  const size_t count = std::min(kRefined, order.size());
  std::partial_sort(order.begin(), order.begin() + static_cast<ptrdiff_t>(count), order.end());
  std::vector<Tilt> best;
  for (size_t k = 0; k < count; ++k) best.push_back(tilts[order[k].second]);
  return best;
}

// Climbs from each of the tilts in coarse photos, and returns the one that is best in fine ones.
Tilt BestRefined(const GroundComparison& coarse,
                 const GroundComparison& fine,
                 const Candidates& candidates,
                 const std::vector<Tilt>& tilts) {
  std::vector<Tilt> refined(tilts.size());
  std::vector<double> evidence(tilts.size());
  ParallelForBlocks(static_cast<int64_t>(tilts.size()), 1, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) {
      refined[i] = TiltSearch(coarse, candidates, tilts[i]).Climb(kTiltStep / 2);
      const LevelPlane plane = candidates.PlaneOf(refined[i]);
      evidence[i] = fine.Score(plane, plane, 1).evidence;
    }
  });
  return refined[std::max_element(evidence.begin(), evidence.end()) - evidence.begin()];
}

// Returns the views, reduced by kFine, without their colours; also of those that take no part,
// because other views may be compared with them.
std::vector<ReducedView> ReduceAll(const std::vector<StereoView>& views,
                                   const std::vector<DepthMap>& known) {
  std::vector<ReducedView> reduced(views.size());
  ParallelForBlocks(static_cast<int64_t>(views.size()), 1, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) {
      reduced[i] = Reduce(views[i],
                          known[i].inverse.empty() ? std::vector<uint8_t>(views[i].NumPixels(), 0)
                                                   : IsKnown(known[i]),
                          kFine);
      reduced[i].view.color = std::vector<Eigen::Vector3f>();
    }
  });
  return reduced;
}

// Returns [pixels of the i-th reduced view] 1 where the depth is unknown, and one of the first
// partners agrees that it is the plane's.
std::vector<uint8_t> OnGround(const std::vector<ReducedView>& reduced,
                              size_t i,
                              const std::vector<int>& partners,
                              const LevelPlane& ground) {
  const StereoView& view = reduced[i].view;
  std::vector<uint8_t> is_on_ground(view.NumPixels(), 0);
  if (std::min(view.width, view.height) <= 2 * kWindowRadius) return is_on_ground;
  const WindowCorrelation windows(view);
  WindowCorrelation::Buffers buffers;
  const Eigen::Vector3f in_image = ground.InImage(view).cast<float>();
  ImageValues warped(view.NumPixels()), scores(view.NumPixels());
  for (size_t k = 0; k < std::min(partners.size(), kPartnersOnGround); ++k) {
    const StereoView& partner = reduced[partners[k]].view;
    if (ground.up.dot(partner.origin) <= ground.level) continue;
    PlaneWarp(view, partner).Warp(in_image, view.width, view.height, partner, &warped);
    windows.Correlate(warped, &buffers, &scores);
    for (size_t at = 0; at < scores.size(); ++at) {
      if (reduced[i].is_unknown[at] != 0 && scores[at] >= kCorrelated) is_on_ground[at] = 1;
    }
  }
  return is_on_ground;
}

}  // namespace

std::optional<GroundPlane> FindGroundPlane(const std::vector<StereoView>& views,
                                           const std::vector<ViewOverlap>& overlaps,
                                           const std::vector<DepthMap>& known) {
  CHECK_EQ(views.size(), overlaps.size());
  CHECK_EQ(views.size(), known.size());
  std::vector<Eigen::Quaterniond> rotations;
  for (const StereoView& view : views) rotations.emplace_back(view.cam_from_world);
  const std::optional<CameraUp> up = UpOfCameras(rotations);
  if (!up) return {};
  const std::vector<size_t> showing = ViewsBeforeUnknown(views, known, up->up);
  if (showing.size() < kFewestViews) return {};
  const size_t count = std::min(showing.size(), kMostViews);
  std::vector<size_t> chosen;
  for (size_t k = 0; k < count; ++k) chosen.push_back(showing[k * showing.size() / count]);
  const Candidates candidates = CandidatesFor(views, overlaps, showing, *up);

  const GroundComparison coarse(views, overlaps, known, chosen, kCoarse);
  const GroundComparison fine(views, overlaps, known, chosen, kFine);
  Tilt tilt = BestRefined(coarse, fine, candidates, BestOfGrid(coarse, candidates));
  tilt = TiltSearch(fine, candidates, tilt).Climb(kTiltStep / 4);
  // A ridge is flat, and only full photos tell where on it the top is.
  const GroundComparison full(views, overlaps, known, chosen, 1);
  tilt = TiltSearch(full, candidates, tilt).Climb(kTiltStep / 8);

  GroundPlane ground{candidates.PlaneOf(tilt)};
  const PlaneScore score = fine.Score(ground, ground, 1);
  ground.agreement = score.Mean();
  for (const double factor : {1 / kBeside, kBeside}) {
    Tilt beside = tilt;
    beside.log_height += std::log(factor);
    ground.agreement_beside =
        std::max(ground.agreement_beside, fine.Score(candidates.PlaneOf(beside), ground, 1).Mean());
  }
  double nearer = 0;
  for (const size_t i : showing) {
    nearer += ShareNearer(views[i], known[i], ground, overlaps[i].depths.near) /
              static_cast<double>(showing.size());
  }
  const bool stands_out = ground.agreement >= kLeastAgreement &&
                          ground.agreement - ground.agreement_beside >= kLeastLead;
  const bool is_compared =
      score.num_windows >= kLeastCompared * static_cast<double>(fine.NumPixels());
  if (!stands_out || !is_compared || nearer < kLeastNearer ||
      ShareBelow(views, known, ground) > kMostBelow) {
    return {};
  }
  return ground;
}

std::vector<DepthMap> AddGround(const std::vector<StereoView>& views,
                                const std::vector<ViewOverlap>& overlaps,
                                const LevelPlane& ground,
                                const std::vector<DepthMap>& known) {
  CHECK_EQ(views.size(), overlaps.size());
  CHECK_EQ(views.size(), known.size());
  const std::vector<ReducedView> reduced = ReduceAll(views, known);
  std::vector<DepthMap> maps = known;
  ParallelForBlocks(static_cast<int64_t>(views.size()), 1, [&](int64_t begin, int64_t end) {
    for (auto i = static_cast<size_t>(begin); i < static_cast<size_t>(end); ++i) {
      if (known[i].inverse.empty() || ground.up.dot(views[i].origin) <= ground.level) continue;
      SetOnPlane(
          OnGround(reduced, i, overlaps[i].partners, ground), kFine, views[i], ground, &maps[i]);
    }
  });
  return maps;
}

uint64_t GroundPlaneBytes(int64_t num_views) {
  constexpr double kBytesOfReducedPixel = sizeof(Eigen::Vector3f) + sizeof(float) + 1;
  constexpr double kReductions = 1 + 1.0 / (kFine * kFine) + 1.0 / (kCoarse * kCoarse);
  constexpr double kMostReduced = kMostViews * (1 + kPartners);
  // Mean and deviation of the windows of a view.
  constexpr double kBytesOfWindow = 2 * sizeof(float);
  constexpr double kBytesOfOrder = sizeof(std::pair<double, size_t>);
  constexpr double kBytesOfSearch =
      (kMostReduced * kBytesOfReducedPixel + kMostViews * kBytesOfWindow) * kReductions +
      kBytesOfOrder;
  // Of each view that gets depths.
  constexpr double kBytesOfGround = (sizeof(float) + 1.0) / (kFine * kFine);
  // Of each thread a picture as the plane shows it, its scores, and the sums of windows.
  constexpr double kBytesOfThread = 7 * sizeof(float);
  return static_cast<uint64_t>(
      1.02 * kStereoPixels *
      (std::max(kBytesOfSearch, kBytesOfGround * static_cast<double>(num_views)) +
       kBytesOfThread * NumThreads()));
}

}  // namespace semfoam
