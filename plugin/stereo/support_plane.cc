// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/stereo/support_plane.h"

#include "foam/geometry/upward.h"
#include "foam/util/median.h"
#include "foam/util/parallel.h"
#include "plugin/stereo/plain_regions.h"
#include "plugin/stereo/reduced_view.h"
#include "plugin/stereo/things_on_plane.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>

#include <Eigen/Geometry>
#include <glog/logging.h>

namespace semfoam {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr size_t kFewestPoints = 200, kMostPoints = 20'000;
// Largest tilt, and the step of tilts that are tried first.
constexpr double kMostTilt = 30 * kDegree, kTiltStep = 2.5 * kDegree;
constexpr int kHalvings = 4;
// Half the thickness of the plane, by the points' spread.
constexpr double kThickness = 0.01;
constexpr double kMostBelow = 0.03;
// How much a point just below the plane counts against one on it.
constexpr double kAgainst = 4;
constexpr int kFewestOnPlane = 50;
constexpr int kSectors = 16;
// Share of the points on the plane that a sector must hold.
constexpr double kLeastOfSector = 0.02;
// Median distance of the points on the plane from the middle, by that of all.
constexpr double kLeastWidth = 0.5;
constexpr double kMostCameras = 0.95;
// Share of the pixels that see the plane whose depth may be known.
constexpr double kMostKnown = 0.1;
constexpr size_t kEveryPixel = 16;
// Share of the cameras by whose distance from the middle the plane ends.
constexpr double kCamerasAround = 0.9;

constexpr int kReduction = 4;
constexpr float kCutOff = 0.98f;
constexpr float kColorTolerance = 0.06f;
constexpr float kMostGain = 2, kDarkest = 0.02f;
constexpr int kFewestPartners = 2;
constexpr double kLeastOfRegion = 0.6;

// The points at the height of a plane.
struct Contact {
  double level = 0;
  int num_on = 0, num_below = 0;

  double Score() const { return num_on - kAgainst * num_below; }
};

// Returns the plane of this direction on which the points stand. `heights` are overwritten.
Contact ContactOf(const Eigen::Vector3d& up,
                  const std::vector<Eigen::Vector3d>& points,
                  double thickness,
                  std::vector<double>* heights) {
  for (size_t i = 0; i < points.size(); ++i) (*heights)[i] = up.dot(points[i]);
  // Above the lowest, as many as may be on the plane.
  const size_t num_low = points.size() / 5;
  const auto most_below = static_cast<size_t>(kMostBelow * static_cast<double>(points.size()));
  std::nth_element(
      heights->begin(), heights->begin() + static_cast<ptrdiff_t>(num_low), heights->end());
  std::sort(heights->begin(), heights->begin() + static_cast<ptrdiff_t>(num_low));
  Contact best;
  size_t end = 0, below = 0;
  for (size_t first = 0; first <= most_below && first < num_low; ++first) {
    const double lowest = (*heights)[first];
    while (end < num_low && (*heights)[end] <= lowest + 2 * thickness) ++end;
    while ((*heights)[below] < lowest - 2 * thickness) ++below;
    const Contact contact = {
        lowest + thickness, static_cast<int>(end - first), static_cast<int>(first - below)};
    if (best.num_on == 0 || contact.Score() > best.Score()) best = contact;
  }
  return best;
}

// Returns whether the points on the plane lie on all sides of the middle of all points, in no half
// of the sectors around it hardly any, and as far out as others do.
bool StandStably(const LevelPlane& plane,
                 const PointSpread& spread,
                 const std::vector<Eigen::Vector3d>& points) {
  const Eigen::Vector3d x_axis = plane.up.unitOrthogonal(), y_axis = plane.up.cross(x_axis);
  std::vector<int> counts(kSectors);
  std::vector<double> radii, radii_on;
  for (const Eigen::Vector3d& point : points) {
    const Eigen::Vector3d offset = point - spread.middle;
    const double x = x_axis.dot(offset), y = y_axis.dot(offset);
    radii.push_back(std::hypot(x, y));
    if (std::abs(plane.HeightOf(point)) > kThickness * spread.radius) continue;
    radii_on.push_back(radii.back());
    const double turns = std::atan2(y, x) / (2 * std::numbers::pi) + 0.5;
    ++counts[std::min(kSectors - 1, static_cast<int>(turns * kSectors))];
  }
  const double least = std::max(2.0, kLeastOfSector * static_cast<double>(radii_on.size()));
  int empty = 0, widest = 0;
  for (int k = 0; k < 2 * kSectors; ++k) {
    empty = counts[k % kSectors] >= least ? 0 : empty + 1;
    widest = std::max(widest, empty);
  }
  return widest < kSectors / 2 &&
         Median(std::move(radii_on)) >= kLeastWidth * Median(std::move(radii));
}

// What of a plane is looked at: not under things, nor farther out than cameras are.
class VisiblePlane {
 public:
  VisiblePlane(const LevelPlane& plane,
               const std::vector<StereoView>& views,
               const std::vector<Eigen::Vector3f>& points)
      : plane_(plane), things_(plane, points) {
    std::vector<double> distances;
    for (const StereoView& view : views) {
      distances.push_back(things_.DistanceFromMiddle(view.origin));
    }
    const auto at = distances.begin() +
                    static_cast<ptrdiff_t>(kCamerasAround * static_cast<double>(views.size() - 1));
    std::nth_element(distances.begin(), at, distances.end());
    radius_ = *at;
  }

  // Computes the point that a view sees at a pixel. Returns false where it is not looked at.
  bool PointAt(const StereoView& view,
               const Eigen::Vector3d& in_image,
               const Eigen::Vector2d& pixel,
               Eigen::Vector3d* point) const {
    const double inverse = in_image.dot(pixel.homogeneous());
    if (!(inverse > 0)) return false;
    *point = view.PointAt(pixel, 1 / inverse);
    return things_.DistanceFromMiddle(*point) <= radius_ && !things_.IsUnderThing(*point);
  }

  const LevelPlane& plane() const { return plane_; }

 private:
  LevelPlane plane_;
  ThingsOnPlane things_;
  double radius_ = 0;
};

// Returns the share of the pixels that see the plane whose depth is known.
double ShareKnown(const VisiblePlane& visible,
                  const std::vector<StereoView>& views,
                  const std::vector<DepthMap>& known) {
  int64_t num_known = 0, count = 0;
  for (size_t k = 0; k < views.size(); ++k) {
    if (visible.plane().HeightOf(views[k].origin) <= 0) continue;
    const Eigen::Vector3d in_image = visible.plane().InImage(views[k]);
    for (size_t i = 0; i < known[k].inverse.size(); i += kEveryPixel) {
      Eigen::Vector3d point;
      if (!visible.PointAt(views[k], in_image, views[k].CenterOf(i), &point)) continue;
      num_known += known[k].inverse[i] > 0;
      ++count;
    }
  }
  return count > 0 ? static_cast<double>(num_known) / static_cast<double>(count) : 1;
}

// A pixel of a region, and what another view shows in its place of the plane.
struct Match {
  size_t pixel;
  Eigen::Vector3f color;
};

// Returns the gains that take the view's colours to those of the matches: medians, of the table
// rather than of what stands on it. There must be a match.
Eigen::Array3f GainsOf(const ReducedView& reduced, const std::vector<Match>& matches) {
  Eigen::Array3f gains;
  for (int c = 0; c < 3; ++c) {
    std::vector<float> ratios;
    for (const Match& match : matches) {
      ratios.push_back(match.color[c] / std::max(reduced.view.color[match.pixel][c], kDarkest));
    }
    gains[c] = std::clamp(Median(std::move(ratios)), 1 / kMostGain, kMostGain);
  }
  return gains;
}

// Returns [pixels of the i-th reduced view] 1 where the view shows the plane.
std::vector<uint8_t> OnSupport(const std::vector<ReducedView>& reduced,
                               size_t i,
                               const std::vector<int>& partners,
                               const VisiblePlane& visible) {
  const StereoView& view = reduced[i].view;
  const PlainRegions regions = FindPlainRegions(reduced[i]);
  const Eigen::Vector3d in_image = visible.plane().InImage(view);
  std::vector<std::pair<size_t, Eigen::Vector3d>> candidates;
  for (size_t at = 0; at < regions.of_pixel.size(); ++at) {
    if (regions.of_pixel[at] < 0 || view.color[at].minCoeff() >= kCutOff) continue;
    Eigen::Vector3d point;
    if (visible.PointAt(view, in_image, view.CenterOf(at), &point)) {
      candidates.emplace_back(at, point);
    }
  }
  std::vector<int> num_compared(view.NumPixels()), num_agreeing(view.NumPixels());
  for (const int j : partners) {
    const StereoView& other = reduced[j].view;
    if (other.NumPixels() == 0 || visible.plane().HeightOf(other.origin) <= 0) continue;
    std::vector<Match> matches;
    for (const auto& [at, point] : candidates) {
      Match match = {at, {}};
      if (SampleUnknown(reduced[j], point - other.origin, &match.color)) matches.push_back(match);
    }
    if (matches.empty()) continue;
    const Eigen::Array3f gains = GainsOf(reduced[i], matches);
    for (const Match& match : matches) {
      const Eigen::Array3f expected = gains * view.color[match.pixel].array();
      ++num_compared[match.pixel];
      num_agreeing[match.pixel] +=
          (match.color.array() - expected).abs().maxCoeff() <= kColorTolerance;
    }
  }
  std::vector<uint8_t> is_on_plane(view.NumPixels(), 0);
  std::vector<int> num_on(regions.sizes.size());
  for (const auto& [at, point] : candidates) {
    is_on_plane[at] =
        num_compared[at] >= kFewestPartners && 2 * num_agreeing[at] >= num_compared[at];
    num_on[regions.of_pixel[at]] += is_on_plane[at];
  }
  std::vector<int> num_candidates(regions.sizes.size());
  for (const auto& [at, point] : candidates) ++num_candidates[regions.of_pixel[at]];
  for (const auto& [at, point] : candidates) {
    const int region = regions.of_pixel[at];
    if (num_on[region] < kLeastOfRegion * num_candidates[region]) is_on_plane[at] = 0;
  }
  return is_on_plane;
}

}  // namespace

std::optional<LevelPlane> FindSupportPlane(const std::vector<StereoView>& views,
                                           const std::vector<Eigen::Vector3f>& points,
                                           const std::vector<DepthMap>& known) {
  CHECK_EQ(views.size(), known.size());
  if (points.size() < kFewestPoints) return {};
  std::vector<Eigen::Quaterniond> rotations;
  for (const StereoView& view : views) rotations.emplace_back(view.cam_from_world);
  const std::optional<CameraUp> up = UpOfCameras(rotations);
  if (!up) return {};
  const PointSpread spread = SpreadOf(points);
  const double thickness = kThickness * spread.radius;
  const size_t count = std::min(points.size(), kMostPoints);
  std::vector<Eigen::Vector3d> judges;
  for (size_t i = 0; i < count; ++i) {
    judges.push_back(points[i * points.size() / count].cast<double>() - spread.middle);
  }
  const Eigen::Vector3d right = up->up.unitOrthogonal(), forward = up->up.cross(right);
  const auto direction_of = [&](const Eigen::Vector2d& tilt) -> Eigen::Vector3d {
    return (up->up + std::tan(tilt.x()) * right + std::tan(tilt.y()) * forward).normalized();
  };
  struct Scored {
    Eigen::Vector2d tilt = Eigen::Vector2d::Zero();
    Contact contact;
  };
  // The best of the tilts around one, itself among them; on a tie the first.
  const auto best_around = [&](const Eigen::Vector2d& middle, int radius, double step) {
    const int side = 2 * radius + 1;
    std::vector<Scored> all(static_cast<size_t>(side) * side);
    ParallelForBlocks(static_cast<int64_t>(all.size()), 8, [&](int64_t begin, int64_t end) {
      std::vector<double> heights(judges.size());
      for (int64_t k = begin; k < end; ++k) {
        all[k].tilt = middle + step * Eigen::Vector2d(static_cast<double>(k % side - radius),
                                                      static_cast<double>(k / side - radius));
        if (all[k].tilt.norm() > kMostTilt) continue;
        all[k].contact = ContactOf(direction_of(all[k].tilt), judges, thickness, &heights);
      }
    });
    return *std::max_element(all.begin(), all.end(), [](const Scored& a, const Scored& b) {
      return a.contact.Score() < b.contact.Score();
    });
  };
  Scored best = best_around(
      Eigen::Vector2d::Zero(), static_cast<int>(std::lround(kMostTilt / kTiltStep)), kTiltStep);
  double step = kTiltStep;
  for (int k = 0; k < kHalvings; ++k) best = best_around(best.tilt, 2, step /= 2);

  LevelPlane plane;
  plane.up = direction_of(best.tilt);
  plane.level = best.contact.level + plane.up.dot(spread.middle);
  const double scale = static_cast<double>(points.size()) / static_cast<double>(count);
  const auto num_above = std::count_if(views.begin(), views.end(), [&](const StereoView& view) {
    return plane.HeightOf(view.origin) > thickness;
  });
  for (Eigen::Vector3d& judge : judges) judge += spread.middle;
  if (best.contact.num_on * scale < kFewestOnPlane || best.contact.Score() <= 0 ||
      static_cast<double>(num_above) < kMostCameras * static_cast<double>(views.size()) ||
      !StandStably(plane, spread, judges) ||
      ShareKnown(VisiblePlane(plane, views, points), views, known) > kMostKnown) {
    return {};
  }
  return plane;
}

std::vector<DepthMap> AddSupport(const std::vector<StereoView>& views,
                                 const std::vector<ViewOverlap>& overlaps,
                                 const LevelPlane& plane,
                                 const std::vector<Eigen::Vector3f>& points,
                                 const std::vector<DepthMap>& known) {
  CHECK_EQ(views.size(), overlaps.size());
  CHECK_EQ(views.size(), known.size());
  const VisiblePlane visible(plane, views, points);
  const auto for_each_view = [&](auto&& body) {
    ParallelForBlocks(static_cast<int64_t>(views.size()), 1, [&](int64_t begin, int64_t end) {
      for (int64_t i = begin; i < end; ++i) {
        if (!known[i].inverse.empty()) body(static_cast<size_t>(i));
      }
    });
  };
  std::vector<ReducedView> reduced(views.size());
  for_each_view([&](size_t i) {
    std::vector<uint8_t> is_known(known[i].inverse.size());
    for (size_t at = 0; at < is_known.size(); ++at) is_known[at] = known[i].inverse[at] > 0;
    reduced[i] = Reduce(views[i], is_known, kReduction);
  });
  std::vector<DepthMap> maps = known;
  for_each_view([&](size_t i) {
    if (plane.HeightOf(views[i].origin) <= 0) return;
    SetOnPlane(OnSupport(reduced, i, overlaps[i].partners, visible),
               kReduction,
               views[i],
               plane,
               &maps[i]);
  });
  return maps;
}

uint64_t SupportPlaneBytes(int64_t num_views) {
  constexpr double kBytesOfReducedPixel = sizeof(Eigen::Vector3f) + sizeof(float) + 1;
  // Of each thread: regions, points on the plane, matches, and what they are counted in.
  constexpr double kBytesOfThread =
      3 * sizeof(int) + sizeof(std::pair<size_t, Eigen::Vector3d>) + sizeof(Match) + 1;
  return static_cast<uint64_t>(
      1.02 * kStereoPixels / (kReduction * kReduction) *
      (kBytesOfReducedPixel * static_cast<double>(num_views) + kBytesOfThread * NumThreads()));
}

}  // namespace semfoam
