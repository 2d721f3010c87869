// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/stereo/far_regions.h"

#include "foam/util/parallel.h"
#include "plugin/stereo/plain_regions.h"
#include "plugin/stereo/reduced_view.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

#include <Eigen/Core>
#include <glog/logging.h>

namespace semfoam {
namespace {

// Photos are reduced by this factor: the noise falls by as much.
constexpr int kReduction = 4;
// Root of the largest squared difference that a pixel counts with, and of the largest mean of a
// region at infinity.
constexpr float kMostError = 0.03f, kMostMeanError = 0.02f;
constexpr double kMostRatio = 0.8;
// Reduced pixels in the view that moves most, from infinity to the first plane; and the ratio of
// the planes' inverse depths.
constexpr double kLeastParallax = 4, kPlaneRatio = 1.3;
constexpr size_t kFewestPlanes = 4;
constexpr double kLeastShare = 0.01;
// Number of views that show a pixel, in the mean over the region: at infinity, and on a plane.
constexpr double kLeastSeen = 1, kLeastSeenOnPlane = 0.3;
constexpr size_t kMostPartners = 16;
// Share of a view's directions that a partner must see, too.
constexpr double kLeastOverlap = 0.2;

// Returns the share of a view's directions that another one sees, too.
double SharedDirections(const StereoView& view, const StereoView& other) {
  constexpr int kSteps = 8;
  int count = 0;
  for (int y = 0; y < kSteps; ++y) {
    for (int x = 0; x < kSteps; ++x) {
      const Eigen::Vector2d at((x + 0.5) * view.width / kSteps, (y + 0.5) * view.height / kSteps);
      Eigen::Vector2d pixel;
      double depth = 0;
      count += other.Project(other.origin + view.RayThrough(at), &pixel, &depth) &&
               other.Contains(pixel);
    }
  }
  return static_cast<double>(count) / (kSteps * kSteps);
}

// Returns the views that see most of a view's directions from the farthest away, the farthest
// first.
std::vector<int> FarthestPartners(const std::vector<ReducedView>& reduced, size_t i) {
  std::vector<std::pair<double, int>> order;
  for (size_t j = 0; j < reduced.size(); ++j) {
    if (j == i || reduced[j].is_unknown.empty()) continue;
    if (SharedDirections(reduced[i].view, reduced[j].view) < kLeastOverlap) continue;
    order.emplace_back(-(reduced[i].view.origin - reduced[j].view.origin).norm(),
                       static_cast<int>(j));
  }
  std::sort(order.begin(), order.end());
  order.resize(std::min(order.size(), kMostPartners));
  std::vector<int> partners;
  for (const auto& [distance, j] : order) partners.push_back(j);
  return partners;
}

// How well other views agree with a region on a plane.
struct Agreement {
  double squared_error = 0;
  int num_seen = 0;

  // Returns infinity where fewer than `least_seen` views show a pixel of a region of `size` pixels.
  double Mean(double least_seen, int size) const {
    return num_seen > 0 && num_seen >= least_seen * size ? squared_error / num_seen
                                                         : std::numeric_limits<double>::infinity();
  }
};

// Returns [regions] their agreement with the partners on the plane of this inverse depth.
std::vector<Agreement> AgreementsAt(double inverse_depth,
                                    const std::vector<ReducedView>& reduced,
                                    size_t i,
                                    const std::vector<int>& partners,
                                    const PlainRegions& regions) {
  const StereoView& view = reduced[i].view;
  std::vector<Agreement> agreements(regions.sizes.size());
  for (size_t at = 0; at < regions.of_pixel.size(); ++at) {
    if (regions.of_pixel[at] < 0) continue;
    Agreement& agreement = agreements[regions.of_pixel[at]];
    const Eigen::Vector3d ray = view.RayThrough(view.CenterOf(at));
    for (const int j : partners) {
      Eigen::Vector3f color;
      const Eigen::Vector3d offset = ray + inverse_depth * (view.origin - reduced[j].view.origin);
      if (!SampleUnknown(reduced[j], offset, &color)) continue;
      agreement.squared_error +=
          std::min(kMostError * kMostError, (color - view.color[at]).squaredNorm() / 3);
      ++agreement.num_seen;
    }
  }
  return agreements;
}

// Returns [regions] whether each is far.
std::vector<uint8_t> AreFar(const std::vector<ReducedView>& reduced,
                            size_t i,
                            double nearest,
                            const PlainRegions& regions) {
  std::vector<uint8_t> are_far(regions.sizes.size(), 0);
  const std::vector<int> partners = FarthestPartners(reduced, i);
  if (partners.empty()) return are_far;
  const StereoView& view = reduced[i].view;
  const double widest = view.focal.x() * (reduced[partners[0]].view.origin - view.origin).norm();
  std::vector<double> planes;
  for (double parallax = kLeastParallax; parallax < widest * nearest; parallax *= kPlaneRatio) {
    planes.push_back(parallax / widest);
  }
  if (planes.size() < kFewestPlanes) return are_far;
  const std::vector<Agreement> at_infinity = AgreementsAt(0, reduced, i, partners, regions);
  std::vector<double> least(are_far.size(), std::numeric_limits<double>::infinity());
  for (const double plane : planes) {
    const std::vector<Agreement> on_plane = AgreementsAt(plane, reduced, i, partners, regions);
    for (size_t r = 0; r < least.size(); ++r) {
      least[r] = std::min(least[r], on_plane[r].Mean(kLeastSeenOnPlane, regions.sizes[r]));
    }
  }
  for (size_t r = 0; r < are_far.size(); ++r) {
    const int size = regions.sizes[r];
    const double error = at_infinity[r].Mean(kLeastSeen, size);
    are_far[r] = size >= kLeastShare * static_cast<double>(regions.of_pixel.size()) &&
                 error <= kMostMeanError * kMostMeanError && std::isfinite(least[r]) &&
                 error <= kMostRatio * least[r];
  }
  return are_far;
}

}  // namespace

std::vector<std::vector<uint8_t>> FindFarRegions(const std::vector<StereoView>& views,
                                                 const std::vector<RegionInput>& inputs) {
  CHECK_EQ(views.size(), inputs.size());
  std::vector<ReducedView> reduced(views.size());
  std::vector<std::vector<uint8_t>> far(views.size());
  const auto for_each_view = [&](auto&& body) {
    ParallelForBlocks(static_cast<int64_t>(views.size()), 1, [&](int64_t begin, int64_t end) {
      for (int64_t i = begin; i < end; ++i) {
        if (!inputs[i].is_known.empty()) body(static_cast<size_t>(i));
      }
    });
  };
  for_each_view([&](size_t i) { reduced[i] = Reduce(views[i], inputs[i].is_known, kReduction); });
  for_each_view([&](size_t i) {
    const PlainRegions regions = FindPlainRegions(reduced[i]);
    const std::vector<uint8_t> are_far = AreFar(reduced, i, inputs[i].nearest, regions);
    far[i].assign(views[i].NumPixels(), 0);
    const int width = reduced[i].view.width, height = reduced[i].view.height;
    for (int y = 0; y < kReduction * height; ++y) {
      for (int x = 0; x < kReduction * width; ++x) {
        const int region =
            regions.of_pixel[static_cast<size_t>(y / kReduction) * width + x / kReduction];
        const size_t at = static_cast<size_t>(y) * views[i].width + x;
        far[i][at] = region >= 0 && are_far[region] != 0 && inputs[i].is_known[at] == 0;
      }
    }
  });
  return far;
}

uint64_t FarRegionBytes(int64_t num_views) {
  constexpr double kBytesOfReducedPixel = sizeof(Eigen::Vector3f) + sizeof(float) + 1;
  return static_cast<uint64_t>(kBytesOfReducedPixel * kStereoPixels / (kReduction * kReduction) *
                               1.02 * static_cast<double>(num_views));
}

}  // namespace semfoam
