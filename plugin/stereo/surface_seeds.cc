// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/stereo/surface_seeds.h"

#include "foam/geometry/guard_sites.h"
#include "foam/optim/point_thinning.h"
#include "foam/util/elapsed_time.h"
#include "foam/util/parallel.h"
#include "plugin/stereo/depth_filling.h"
#include "plugin/stereo/far_regions.h"
#include "plugin/stereo/ground_plane.h"
#include "plugin/stereo/level_plane.h"
#include "plugin/stereo/plane_filling.h"
#include "plugin/stereo/plane_sweep.h"
#include "plugin/stereo/stereo_view.h"
#include "plugin/stereo/support_plane.h"
#include "plugin/stereo/view_overlap.h"
#include "plugin/util/files.h"
#include "plugin/util/plural.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <optional>

namespace semfoam {
namespace {

constexpr size_t kMatchedPartners = 4;
constexpr int kLeastAgreeing = 2;
// Of display values.
constexpr float kColorTolerance = 0.15f;
// Of depths, as a share.
constexpr double kTolerance = 0.015;
constexpr double kSeenThrough = 2 * kTolerance;
// Plain surfaces need fewer cells than textured ones.
constexpr size_t kMeasuredPerPlainSeed = 8, kLeastPlainSeeds = 8;
// SolidGround::thickness, as a share of the cameras' mean height.
constexpr double kGroundThickness = 0.05;
// Share of kSkyRadius from which on a ray's distance counts as infinite. The cells of sky begin
// half-way between it and the farthest other sites.
constexpr double kInfiniteShare = 0.7;
// Sizes are rounded to pixels, so a view may have a little more than kStereoPixels.
constexpr double kPixels = 1.02 * kStereoPixels;

std::vector<int> ChooseViews(const TrainingScene& scene, int most, int* num_training) {
  std::vector<int> training;
  for (int view = 0; view < scene.NumViews(); ++view) {
    if (!scene.IsHeldOut(view)) training.push_back(view);
  }
  *num_training = static_cast<int>(training.size());
  const size_t count = std::min(training.size(), static_cast<size_t>(std::max(0, most)));
  std::vector<int> chosen;
  for (size_t i = 0; i < count; ++i) chosen.push_back(training[i * training.size() / count]);
  return chosen;
}

std::vector<StereoView> MakeViews(const TrainingScene& scene, const std::vector<int>& chosen) {
  std::vector<StereoView> views(chosen.size());
  ForEachFile(static_cast<int64_t>(chosen.size()), scene.MostOpenViews(), [&](int64_t i) {
    views[i] = MakeStereoView(scene, chosen[i]);
  });
  return views;
}

std::vector<Track> NormalizedTracks(const TrainingScene& scene) {
  std::vector<Track> tracks = scene.Plan().tracks;
  for (Track& track : tracks) track.position = scene.WorldFromNormalized().Invert(track.position);
  return tracks;
}

// Returns the views that a view is matched with.
std::vector<const StereoView*> MatchedPartners(const std::vector<StereoView>& views,
                                               const ViewOverlap& overlap) {
  std::vector<const StereoView*> partners;
  for (const int j : overlap.partners) {
    if (partners.size() < kMatchedPartners) partners.push_back(&views[j]);
  }
  return partners;
}

std::vector<DepthMap> SweepAll(const std::vector<StereoView>& views,
                               const std::vector<ViewOverlap>& overlaps) {
  std::vector<DepthMap> maps(views.size());
  ParallelForBlocks(static_cast<int64_t>(views.size()), 1, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) {
      const std::vector<const StereoView*> partners = MatchedPartners(views, overlaps[i]);
      if (partners.empty()) continue;
      maps[i] = SweepPlanes(views[i], partners, overlaps[i].depths);
    }
  });
  return maps;
}

// What other views say of a point.
struct Agreement {
  // Of the depths that agree, as multiples of the point's, and of its own.
  double sum = 1;
  int num_agreeing = 0;
  // Of the views that see something behind it, or another colour at its depth.
  int num_contradicting = 0;

  // Returns the mean depth as a multiple of the point's own; 0 where fewer than kLeastAgreeing
  // agree, or as many contradict.
  double MeanDepth() const {
    if (num_agreeing < kLeastAgreeing || num_contradicting >= num_agreeing) return 0;
    return sum / (1 + num_agreeing);
  }
};

Agreement AgreementOn(const std::vector<StereoView>& views,
                      const std::vector<DepthMap>& maps,
                      const std::vector<int>& partners,
                      const Eigen::Vector3d& point,
                      const Eigen::Vector3f& color) {
  Agreement agreement;
  for (const int j : partners) {
    Eigen::Vector2d pixel;
    double depth = 0;
    if (maps[j].inverse.empty() || !views[j].Project(point, &pixel, &depth) ||
        !views[j].Contains(pixel)) {
      continue;
    }
    const size_t at =
        static_cast<size_t>(pixel.y()) * views[j].width + static_cast<size_t>(pixel.x());
    if (!(maps[j].inverse[at] > 0)) continue;
    const double ratio = 1 / (depth * maps[j].inverse[at]);
    const bool is_same_depth = std::abs(ratio - 1) <= kTolerance;
    const bool is_same_color =
        (views[j].color[at] - color).cwiseAbs().maxCoeff() <= kColorTolerance;
    if (is_same_depth && is_same_color) {
      agreement.sum += ratio;
      ++agreement.num_agreeing;
    } else if (is_same_depth || ratio > 1 + kSeenThrough) {
      ++agreement.num_contradicting;
    }
  }
  return agreement;
}

// Calls body(i) for each of the views, on all threads.
template <typename Body>
void ForEachView(const std::vector<StereoView>& views, Body&& body) {
  ParallelForBlocks(static_cast<int64_t>(views.size()), 1, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) body(i);
  });
}

// Returns the depths of each map that those of other views agree on (Agreement).
std::vector<DepthMap> AgreedDepths(const std::vector<StereoView>& views,
                                   const std::vector<ViewOverlap>& overlaps,
                                   const std::vector<DepthMap>& maps) {
  std::vector<DepthMap> agreed(views.size());
  ForEachView(views, [&](int64_t i) {
    const StereoView& view = views[i];
    agreed[i].inverse.assign(maps[i].inverse.size(), 0.f);
    for (size_t at = 0; at < maps[i].inverse.size(); ++at) {
      const float inverse = maps[i].inverse[at];
      if (!(inverse > 0)) continue;
      const Eigen::Vector3d point = view.PointAt(view.CenterOf(at), 1.0 / inverse);
      const double factor =
          AgreementOn(views, maps, overlaps[i].partners, point, view.color[at]).MeanDepth();
      if (factor > 0) agreed[i].inverse[at] = static_cast<float>(inverse / factor);
    }
  });
  return agreed;
}

// Returns the depths of the filled maps that are unknown in `known` and that those of other views
// agree on, or that are on the ground and that none contradicts: of the ground before a camera,
// other views often show nothing.
std::vector<DepthMap> AgreedFillings(const std::vector<StereoView>& views,
                                     const std::vector<ViewOverlap>& overlaps,
                                     const std::vector<DepthMap>& known,
                                     const std::vector<DepthMap>& filled,
                                     const std::optional<LevelPlane>& ground) {
  std::vector<DepthMap> agreed(views.size());
  ForEachView(views, [&](int64_t i) {
    const StereoView& view = views[i];
    const Eigen::Vector3d in_image = ground ? ground->InImage(view) : Eigen::Vector3d::Zero();
    agreed[i].inverse.assign(filled[i].inverse.size(), 0.f);
    for (size_t at = 0; at < filled[i].inverse.size(); ++at) {
      const float inverse = filled[i].inverse[at];
      if (!(inverse > 0) || known[i].inverse[at] > 0) continue;
      const Eigen::Vector2d pixel = view.CenterOf(at);
      const Agreement agreement = AgreementOn(
          views, filled, overlaps[i].partners, view.PointAt(pixel, 1.0 / inverse), view.color[at]);
      const double factor = agreement.MeanDepth();
      if (factor > 0) {
        agreed[i].inverse[at] = static_cast<float>(inverse / factor);
      } else if (ground && agreement.num_contradicting == 0) {
        const double on_ground = in_image.dot(pixel.homogeneous());
        if (std::abs(on_ground - inverse) <= kTolerance * inverse) {
          agreed[i].inverse[at] = static_cast<float>(on_ground);
        }
      }
    }
  });
  return agreed;
}

// Fills each of the maps, where it is not empty.
std::vector<DepthMap> FillAll(const std::vector<StereoView>& views, std::vector<DepthMap> maps) {
  ForEachView(views, [&](int64_t i) {
    if (maps[i].inverse.empty()) return;
    maps[i] = FillPlanes(views[i], FillDepths(views[i], maps[i]));
  });
  return maps;
}

std::vector<Eigen::Vector3f> PositionsOf(const std::vector<SeedPoint>& seeds) {
  std::vector<Eigen::Vector3f> positions;
  for (const SeedPoint& seed : seeds) positions.push_back(seed.position);
  return positions;
}

// Returns the points at the known depths, merged to at most `most`.
std::vector<SeedPoint> MergedPoints(const std::vector<StereoView>& views,
                                    const std::vector<DepthMap>& maps,
                                    size_t most) {
  PointMerger merger(most);
  for (size_t i = 0; i < views.size(); ++i) {
    for (size_t at = 0; at < maps[i].inverse.size(); ++at) {
      const float inverse = maps[i].inverse[at];
      if (!(inverse > 0)) continue;
      const Eigen::Vector3d point = views[i].PointAt(views[i].CenterOf(at), 1.0 / inverse);
      if (point.norm() <= kFarRadius) merger.Add(point, views[i].color[at]);
    }
  }
  return merger.Take();
}

// Returns the part of the plane that the seeds on it span; nothing where there are none.
std::optional<SolidGround> GroundOf(const LevelPlane& plane,
                                    const std::vector<StereoView>& views,
                                    const std::vector<SeedPoint>& seeds) {
  double camera_height = 0;
  for (const StereoView& view : views) camera_height += plane.HeightOf(view.origin);
  camera_height /= static_cast<double>(views.size());
  SolidGround ground;
  ground.up = plane.up.cast<float>();
  ground.level = static_cast<float>(plane.level);
  ground.thickness = static_cast<float>(kGroundThickness * camera_height);
  std::vector<Eigen::Vector3f> on_plane;
  for (const SeedPoint& seed : seeds) {
    if (std::abs(plane.HeightOf(seed.position.cast<double>())) > ground.thickness) continue;
    on_plane.push_back(seed.position);
    ground.middle += seed.position;
  }
  if (on_plane.empty()) return std::nullopt;
  ground.middle /= static_cast<float>(on_plane.size());
  for (const Eigen::Vector3f& x : on_plane) {
    ground.radius = std::max(ground.radius, (x - ground.middle).norm());
  }
  return ground;
}

// Returns [views][pixels] 1 for what is infinitely far, of what neither map knows the depth of.
std::vector<std::vector<uint8_t>> FarPixels(const std::vector<StereoView>& views,
                                            const std::vector<ViewOverlap>& overlaps,
                                            const std::vector<DepthMap>& measured,
                                            const std::vector<DepthMap>& filled) {
  std::vector<RegionInput> inputs(views.size());
  for (size_t i = 0; i < views.size(); ++i) {
    inputs[i].nearest = overlaps[i].depths.near;
    for (size_t at = 0; at < measured[i].inverse.size(); ++at) {
      inputs[i].is_known.push_back(measured[i].inverse[at] > 0 || filled[i].inverse[at] > 0);
    }
  }
  return FindFarRegions(views, inputs);
}

// Returns at most kMostSkySeeds points at kSkyRadius in the directions of the pixels that are far.
std::vector<SeedPoint> SkySeeds(const std::vector<StereoView>& views,
                                const std::vector<std::vector<uint8_t>>& far) {
  PointMerger merger(kMostSkySeeds);
  for (size_t i = 0; i < views.size(); ++i) {
    for (size_t at = 0; at < far[i].size(); ++at) {
      if (far[i][at] != 0)
        merger.Add(kSkyRadius * views[i].RayThrough(views[i].CenterOf(at)).normalized(),
                   views[i].color[at]);
    }
  }
  std::vector<SeedPoint> seeds = merger.Take();
  for (SeedPoint& seed : seeds) seed.position *= kSkyRadius / seed.position.norm();
  return seeds;
}

// Returns the depths of a view that one of two maps has, and those of what is far.
PhotoDepths JoinDepths(const StereoView& view,
                       DepthMap measured,
                       const DepthMap& filled,
                       const std::vector<uint8_t>& far) {
  PhotoDepths depths;
  depths.width = view.width;
  depths.height = view.height;
  depths.focal = view.focal.cast<float>();
  depths.center = view.center.cast<float>();
  depths.inverse = std::move(measured.inverse);
  for (size_t at = 0; at < filled.inverse.size(); ++at) {
    if (filled.inverse[at] > 0) depths.inverse[at] = filled.inverse[at];
    if (far.empty() || far[at] == 0) continue;
    const double share_of_z =
        (view.cam_from_world * view.RayThrough(view.CenterOf(at)).normalized()).z();
    depths.inverse[at] = static_cast<float>(1 / (kInfiniteShare * kSkyRadius * share_of_z));
  }
  return depths;
}

}  // namespace

std::string SurfaceSeeds::Report() const {
  char text[32];
  std::snprintf(text, sizeof(text), "%.1f s", seconds);
  std::string report = "Plane sweep: " + Plural(static_cast<int64_t>(points.size()), "seed") +
                       " from " + Plural(num_swept, "photo");
  if (num_swept < num_training) report += " of " + std::to_string(num_training);
  report += std::string(" in ") + text;
  if (far_share > 0) {
    std::snprintf(text, sizeof(text), "%.1f %%", 100 * far_share);
    report += std::string("; ") + text + " of their pixels show sky, or what is as far";
  }
  if (has_ground) report += "; the ground before the cameras is a plane";
  if (has_support) report += "; what things stand on is a plain plane";
  return report;
}

SurfaceSeeds FindSurfaceSeeds(const TrainingScene& scene, int most_photos, bool find_sky) {
  const auto begin = std::chrono::steady_clock::now();
  SurfaceSeeds found;
  const std::vector<StereoView> views =
      MakeViews(scene, ChooseViews(scene, most_photos, &found.num_training));
  found.num_swept = static_cast<int>(views.size());
  const std::vector<ViewOverlap> overlaps =
      FindOverlaps(views, NormalizedTracks(scene), scene.Plan().seeds);
  std::vector<DepthMap> measured = AgreedDepths(views, overlaps, SweepAll(views, overlaps));
  found.points = MergedPoints(views, measured, kMostSurfaceSeeds);
  std::vector<DepthMap> on_planes = measured;
  std::optional<LevelPlane> plane = FindGroundPlane(views, overlaps, measured);
  found.has_ground = plane.has_value();
  if (plane) {
    on_planes = AddGround(views, overlaps, *plane, measured);
  } else {
    const std::vector<Eigen::Vector3f> points = PositionsOf(found.points);
    plane = FindSupportPlane(views, points, measured);
    found.has_support = plane.has_value();
    if (plane) on_planes = AddSupport(views, overlaps, *plane, points, measured);
  }
  const std::vector<DepthMap> filled =
      AgreedFillings(views, overlaps, measured, FillAll(views, std::move(on_planes)), plane);
  const std::vector<SeedPoint> plain = MergedPoints(
      views, filled, std::max(kLeastPlainSeeds, found.points.size() / kMeasuredPerPlainSeed));
  if (plane) found.solid_ground = GroundOf(*plane, views, plain);
  found.points.insert(found.points.end(), plain.begin(), plain.end());
  std::vector<std::vector<uint8_t>> far(views.size());
  if (find_sky) far = FarPixels(views, overlaps, measured, filled);
  const std::vector<SeedPoint> sky = SkySeeds(views, far);
  found.points.insert(found.points.end(), sky.begin(), sky.end());
  found.depths.resize(scene.NumViews());
  int64_t num_far_pixels = 0, num_pixels = 0;
  for (size_t i = 0; i < views.size(); ++i) {
    const int64_t num_far = std::count(far[i].begin(), far[i].end(), 1);
    num_far_pixels += num_far;
    found.num_far += num_far > 0;
    num_pixels += static_cast<int64_t>(views[i].NumPixels());
    found.depths[views[i].view] = JoinDepths(views[i], std::move(measured[i]), filled[i], far[i]);
  }
  if (num_far_pixels > 0) {
    found.far_share = static_cast<double>(num_far_pixels) / static_cast<double>(num_pixels);
  }
  found.seconds = SecondsSince(begin);
  return found;
}

uint64_t PhotoDepthBytes(int64_t num_photos) {
  return static_cast<uint64_t>(kPixels * sizeof(float) * static_cast<double>(num_photos));
}

uint64_t SurfaceSeedBytes(int64_t num_photos) {
  // A view has grey and colour; two depth maps of it are in memory at a time, and a third while the
  // filled ones are compared.
  constexpr double kBytesOfPixel = sizeof(float) + sizeof(Eigen::Vector3f) + 3 * sizeof(float) +
                                   2;  // and whether known, and far
  const double pixels = kPixels * static_cast<double>(num_photos);
  // Merged points wait in an array of twice their number, and are copied as it grows.
  constexpr double kBytesOfMerging = 3 * 64;
  const double merged = std::min<double>(pixels, kMostSurfaceSeeds);
  const int64_t of_thread = std::max({SweepPlanesBytes(), FillDepthsBytes(), FillPlanesBytes()});
  return static_cast<uint64_t>(kBytesOfPixel * pixels + kBytesOfMerging * merged +
                               static_cast<double>(of_thread) * NumThreads()) +
         FarRegionBytes(num_photos) + GroundPlaneBytes(num_photos) + SupportPlaneBytes(num_photos);
}

}  // namespace semfoam
