// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/stereo/plane_filling.h"

#include "foam/geometry/plane_fit.h"
#include "plugin/stereo/image_paths.h"
#include "plugin/stereo/pixel_spread.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <glog/logging.h>

namespace semfoam {
namespace {

constexpr int kMostPlanes = 7;
// Fewest known pixels of a plane, as a share of the photo's.
constexpr double kLeastShare = 0.005;
// A pixel lies within a plane's known part if those this far to all four sides are on it, too.
// Outlines of things have a border of the thing's depth, and that of a ball lies on a plane.
constexpr int kSolid = 3;
// Most pixels that a plane is fitted to.
constexpr size_t kMostSamples = 4000;
// Number of them that choose among planes (SurfaceSamples).
constexpr size_t kJudges = 400;
// Share of the inverse depth up to which a pixel is on a plane: as planes are found, and as pixels
// vote.
constexpr double kTolerance = 0.007, kVoteTolerance = 0.03;
// Planes whose inverse depth changes faster are seen edge-on.
constexpr double kLeastSlant = 0.05;
// Largest Mahalanobis distance from the voters, squared. Beside the edge of a thing before a plain
// background, the windows of matching give a line of pixels of the background the thing's depth: a
// line of voters tells nothing of what lies off it.
constexpr double kMostSquaredDistance = 64;
// Of ImagePaths: in pixels, and in display values.
constexpr double kReach = 128, kColorReach = 0.02;
constexpr float kLeastVotes = 2;
constexpr float kLeastShareOfVotes = 0.5f;

// Votes for each plane, then the number of voters: pixels where planes meet vote for each of them.
using Votes = Eigen::Array<float, kMostPlanes + 1, 1>;
constexpr int kVoters = kMostPlanes;

// Inverse depth as a linear function of the pixel.
struct ImagePlane {
  Eigen::Vector3d coefficients;  // of x, y and 1

  double InverseDepthAt(double x, double y) const {
    return coefficients.dot(Eigen::Vector3d(x, y, 1));
  }
};

struct KnownPixel {
  double x = 0, y = 0, inverse = 0;
};

// Returns the known pixel of this index.
KnownPixel PixelAt(const StereoView& view, const DepthMap& known, size_t i) {
  return {
      static_cast<double>(i % view.width), static_cast<double>(i / view.width), known.inverse[i]};
}

bool IsOn(const ImagePlane& plane, const KnownPixel& pixel, double tolerance) {
  return std::abs(plane.InverseDepthAt(pixel.x, pixel.y) - pixel.inverse) <=
         tolerance * pixel.inverse;
}

// Returns how many of the pixels have others kSolid to the left, to the right, above and below.
size_t CountSolid(const StereoView& view, const std::vector<KnownPixel>& pixels) {
  std::vector<uint8_t> is_in(view.NumPixels());
  const auto index = [&](const KnownPixel& p) {
    return static_cast<size_t>(p.y) * view.width + static_cast<size_t>(p.x);
  };
  for (const KnownPixel& p : pixels) is_in[index(p)] = 1;
  return std::count_if(pixels.begin(), pixels.end(), [&](const KnownPixel& p) {
    if (p.x < kSolid || p.y < kSolid || p.x >= view.width - kSolid || p.y >= view.height - kSolid) {
      return false;
    }
    const size_t i = index(p), rows = static_cast<size_t>(kSolid) * view.width;
    return is_in[i - kSolid] + is_in[i + kSolid] + is_in[i - rows] + is_in[i + rows] == 4;
  });
}

// A plane and the known pixels that are on it and that are not.
struct FoundPlane {
  ImagePlane plane;
  std::vector<KnownPixel> inliers, rest;
};

// Finds the plane that most of the pixels are on. `scale` is a typical inverse depth.
std::optional<FoundPlane> FindPlane(const StereoView& view,
                                    double scale,
                                    const std::vector<KnownPixel>& pixels) {
  SurfaceSamples samples;
  samples.tolerance = kTolerance;
  samples.num_judges = kJudges;
  const double width = view.width;
  const size_t step = 1 + pixels.size() / kMostSamples;
  for (size_t i = 0; i < pixels.size(); i += step) {
    const KnownPixel& p = pixels[i];
    samples.points.emplace_back(p.x / width, p.y / width, p.inverse / scale);
    samples.weights.push_back(1);
  }
  const std::optional<PlaneFit> fit = FitPlane(samples);
  if (!fit || !(std::abs(fit->normal.z()) >= kLeastSlant)) return {};
  FoundPlane found;
  ImagePlane& plane = found.plane;
  const Eigen::Vector3d n = fit->normal / fit->normal.z();
  plane.coefficients = scale * Eigen::Vector3d(-n.x() / width, -n.y() / width, n.dot(fit->point));
  for (const KnownPixel& p : pixels) {
    (IsOn(plane, p, kTolerance) ? found.inliers : found.rest).push_back(p);
  }
  return found;
}

std::vector<ImagePlane> FindPlanes(const StereoView& view, const DepthMap& known) {
  std::vector<KnownPixel> pixels;
  double sum = 0;
  for (size_t i = 0; i < known.inverse.size(); ++i) {
    if (!(known.inverse[i] > 0)) continue;
    pixels.push_back(PixelAt(view, known, i));
    sum += known.inverse[i];
  }
  const double scale = sum / static_cast<double>(std::max<size_t>(1, pixels.size()));
  const auto least = static_cast<size_t>(kLeastShare * static_cast<double>(view.NumPixels()));
  std::vector<ImagePlane> planes;
  for (int k = 0; k < kMostPlanes && pixels.size() > least; ++k) {
    std::optional<FoundPlane> found = FindPlane(view, scale, pixels);
    if (!found || found->inliers.size() <= least) break;
    if (CountSolid(view, found->inliers) > least) planes.push_back(found->plane);
    pixels = std::move(found->rest);
  }
  return planes;
}

// Returns the votes of each known pixel.
std::vector<Votes> OwnVotes(const StereoView& view,
                            const DepthMap& known,
                            const std::vector<ImagePlane>& planes) {
  std::vector<Votes> own(known.inverse.size(), Votes::Zero());
  for (size_t i = 0; i < own.size(); ++i) {
    if (!(known.inverse[i] > 0)) continue;
    const KnownPixel pixel = PixelAt(view, known, i);
    for (size_t p = 0; p < planes.size(); ++p) {
      if (IsOn(planes[p], pixel, kVoteTolerance)) own[i][static_cast<int>(p)] = 1;
    }
    own[i][kVoters] = 1;
  }
  return own;
}

// Returns the plane that the votes around each pixel choose; -1: none, or its depth is known.
std::vector<int> ChosenPlanes(const StereoView& view,
                              const DepthMap& known,
                              const std::vector<Votes>& votes) {
  std::vector<int> chosen(votes.size(), -1);
  for (size_t i = 0; i < votes.size(); ++i) {
    if (known.inverse[i] > 0 || std::isnan(view.grey[i])) continue;
    Eigen::Index best = 0;
    const float most = votes[i].head<kMostPlanes>().maxCoeff(&best);
    if (most >= std::max(kLeastVotes, kLeastShareOfVotes * votes[i][kVoters])) {
      chosen[i] = static_cast<int>(best);
    }
  }
  return chosen;
}

// Returns the sums of each pixel alone; zeros where it does not vote for the plane.
std::vector<PixelSums> OwnSums(const StereoView& view, const std::vector<Votes>& own, int plane) {
  std::vector<PixelSums> sums(own.size(), PixelSums::Zero());
  for (size_t i = 0; i < own.size(); ++i) {
    if (!(own[i][plane] > 0)) continue;
    sums[i] = PixelSumsAt(static_cast<double>(i % view.width), static_cast<double>(i / view.width));
  }
  return sums;
}

}  // namespace

DepthMap FillPlanes(const StereoView& view, const DepthMap& known) {
  CHECK_EQ(known.inverse.size(), view.NumPixels());
  const std::vector<ImagePlane> planes = FindPlanes(view, known);
  if (planes.empty()) return known;
  const ImagePaths paths(view, kColorReach, PhotoNoise(view));
  const std::vector<Votes> own = OwnVotes(view, known, planes);
  const std::vector<int> chosen = ChosenPlanes(view, known, paths.SumsAround(own, kReach));
  DepthMap filled = known;
  for (int p = 0; p < static_cast<int>(planes.size()); ++p) {
    if (std::find(chosen.begin(), chosen.end(), p) == chosen.end()) continue;
    const std::vector<PixelSums> voters = paths.SumsAround(OwnSums(view, own, p), kReach);
    for (size_t i = 0; i < chosen.size(); ++i) {
      if (chosen[i] != p) continue;
      const auto x = static_cast<double>(i % view.width), y = static_cast<double>(i / view.width);
      if (!(PixelSpread(voters[i]).SquaredDistance(x, y) <= kMostSquaredDistance)) continue;
      filled.inverse[i] = static_cast<float>(std::max(0.0, planes[p].InverseDepthAt(x, y)));
    }
  }
  return filled;
}

int64_t FillPlanesBytes() {
  constexpr int64_t kBytesOfPixel = 3 * sizeof(Votes) + 3 * sizeof(PixelSums) + 2 * sizeof(float) +
                                    sizeof(int) + 2 * sizeof(KnownPixel) +
                                    2 * sizeof(Eigen::Vector3d) + sizeof(double);
  return kBytesOfPixel * kStereoPixels * 102 / 100;
}

}  // namespace semfoam
