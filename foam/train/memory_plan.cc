// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/train/memory_plan.h"

#include "foam/data/pixel_range.h"
#include "foam/render/color_variation.h"
#include "foam/render/ray_batch.h"
#include "foam/util/error.h"
#include "foam/util/parallel.h"
#include "foam/view/cell_statistics.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <sstream>

namespace semfoam {
namespace {

// The Delaunay triangulation of a Poisson process has 6.8 tetrahedra a site;
// sites on surfaces have fewer.
constexpr double kTetsPerSite = 6.8;

// Blocks of 16 faces, 272 to 320 bytes each; a cell has 1.4 of them, and its position.
constexpr int64_t kPlaneBytesPerSite = 450 + 12;

// CGAL's own: 72 bytes a tetrahedron, 48 a vertex. Ours while that is read out: twice four indices
// a tetrahedron, and its position as a cell.
constexpr double kTriangulationBytesPerSite = kTetsPerSite * (72 + 32) + 48 + 12;

// While iterations go on, the topology that there is: a neighbour and its weight for each of 15.5
// faces, offset, position when triangulated, step lengths; and the positions to triangulate.
constexpr double kOldTopologyBytesPerSite = 15.5 * 8 + 4 + 12 + 8 + 1 + 12;

// Records of a ray's gradients: 40 bytes each, as they are written (in arrays that double as they
// grow) and in buckets. A ray touches some 100 cells of a foam of a million.
constexpr int64_t kRecordsPerRay = 100;
constexpr int64_t kBytesPerRay = 3 * kRecordsPerRay * int64_t{sizeof(GradientRecord)} +
                                 int64_t{sizeof(BatchRay)} + int64_t{sizeof(RayOutput)};

// Rays that a thread traces together: up to 256 of 10 kB.
constexpr int64_t kTraceBytesPerThread = 256 * 10'000;

// Allocators keep some of what was freed.
constexpr double kAllocatorFactor = 1.1;

// The program and its libraries, and what reading photos leaves behind.
constexpr int64_t kProgramBytes = 150'000'000;

int64_t Sites(const TrainingOptions& options, int64_t num_seeds) {
  const int64_t seed_sites =
      std::min({num_seeds, int64_t{options.initial_sites}, int64_t{options.final_sites}});
  const int64_t initial = seed_sites + ScatteredSites(options) + FarSites(options);
  return std::max(initial, int64_t{options.final_sites});
}

// Two leading digits, rounded down: a number to type.
int64_t RoundedDown(int64_t value) {
  int64_t unit = 1;
  while (value / unit >= 100) unit *= 10;
  return value / unit * unit;
}

}  // namespace

std::string FormatBytes(int64_t bytes) {
  char text[32];
  if (bytes >= 1'000'000'000) {
    std::snprintf(text, sizeof(text), "%.2f GB", bytes / 1e9);
  } else {
    std::snprintf(text, sizeof(text), "%.0f MB", bytes / 1e6);
  }
  return text;
}

int64_t MemoryPlan::Total() const {
  return parameters + planes + triangulation + batch + photos + program;
}

std::string MemoryPlan::Report() const {
  std::ostringstream text;
  text << "up to " << sites << " sites of " << OfSites() / sites << " bytes ("
       << FormatBytes(parameters) << " parameters, " << FormatBytes(planes) << " planes, "
       << FormatBytes(triangulation) << " triangulation), " << FormatBytes(photos)
       << " photos and masks, " << FormatBytes(batch) << " rays: " << FormatBytes(Total())
       << " in all";
  return text.str();
}

MemoryPlan PlanMemory(const TrainingOptions& options,
                      int num_classes,
                      int64_t num_seeds,
                      int64_t photo_bytes) {
  MemoryPlan plan;
  plan.sites = Sites(options, num_seeds);
  const int64_t identity = num_classes > 0 ? kIdentityDim : 0;
  const int64_t parameters = 4 + 3 * NumShCoefficients(options.sh_degree) +
                             (options.HasColorGradients() ? kColorGradientDim : 0) + identity;
  // Every parameter with two moments; the count of its cell's steps, what densification
  // accumulates, the activated density, the step lengths, whether it must stay clear, where it was
  // triangulated.
  const int64_t parameter_bytes = 3 * 4 * parameters + 4 + 8 + 4 + 8 + 1 + 12;
  // The gradient of the total variation, or the colours in its place, stay. The new topology comes
  // when CGAL's triangulation is gone, which is larger.
  const double topology_bytes = kTriangulationBytesPerSite + kOldTopologyBytesPerSite +
                                (options.color_tv_weight > 0 ? 4 * kSurfaceColorDim : 4 * identity);
  const auto of_sites = [&](double bytes) {
    return static_cast<int64_t>(std::ceil(kAllocatorFactor * bytes * plan.sites));
  };
  const int64_t classifier = int64_t{num_classes} * (kIdentityDim + 1);
  plan.parameters = of_sites(parameter_bytes) + 3 * 4 * classifier;
  plan.planes = of_sites(kPlaneBytesPerSite);
  plan.triangulation = of_sites(topology_bytes);
  // When the training is done, the cells' statistics take the place of batch and triangulation, and
  // after them the graph of hidden cells, which is smaller.
  plan.batch = std::max(kBytesPerRay * options.rays_per_iteration + ClassGradientBytes(num_classes),
                        CellStatisticsBytes(plan.sites) - plan.triangulation);
  plan.batch += kTraceBytesPerThread * NumThreads();
  plan.photos = photo_bytes;
  plan.program = kProgramBytes;
  return plan;
}

int64_t ExchangeBytes(const TrainingOptions& options, int num_classes, int num_ranks) {
  if (num_ranks == 1) return 0;
  // What is sent and what is received, each as large as the batch at most.
  constexpr int64_t kExchangedPerRay =
      2 * (kRecordsPerRay * int64_t{sizeof(GradientRecord)} + int64_t{sizeof(RayOutput)});
  return kExchangedPerRay * options.rays_per_iteration +
         int64_t{3} * 64 * num_classes * (kIdentityDim + 1) * int64_t{sizeof(float)};
}

int64_t DrawnPixelBytes(const TrainingOptions& options) {
  constexpr int64_t kBytesOfTile =
      int64_t{sizeof(int64_t)} + kTileRays * int64_t{sizeof(PixelValue)};
  constexpr int64_t kKept = 25'000'000;  // of held-out photos and probes
  const double early = options.late_rays > 0 ? options.densify_until : 1;
  const double rays = early * double(options.num_rays) + double(options.late_rays);
  // While the SH degree may be settled at any time, two draws are kept of each.
  const double twice = options.fixed_sh_degree ? 0 : 0.1 * std::max(0, options.sh_degree - 1);
  return kKept + static_cast<int64_t>((1 + twice) * rays / kTileRays * kBytesOfTile);
}

void RequireMemory(const TrainingOptions& options,
                   int num_classes,
                   int64_t num_seeds,
                   int64_t photo_bytes,
                   int64_t available) {
  const MemoryPlan plan = PlanMemory(options, num_classes, num_seeds, photo_bytes);
  if (plan.Total() <= available) return;
  const std::string problem = "Training " + std::to_string(plan.sites) + " sites on " +
                              FormatBytes(photo_bytes) + " of photos and masks takes " +
                              FormatBytes(plan.Total()) + " of memory, and " +
                              FormatBytes(available) + " are available; ";
  const int64_t of_sites = plan.OfSites();
  const int64_t left = available - (plan.Total() - of_sites);
  TrainingOptions smaller = options;
  smaller.final_sites = static_cast<int>(
      std::max<int64_t>(0, RoundedDown(static_cast<int64_t>(0.99 * left / of_sites * plan.sites))));
  if (smaller.Check().empty() &&
      PlanMemory(smaller, num_classes, num_seeds, photo_bytes).Total() <= available) {
    throw UserError(problem, Field{"final_sites"}, " ", smaller.final_sites, " would fit.");
  }
  throw UserError(problem,
                  "a smaller ",
                  Field{plan.batch > plan.photos ? "rays_per_iteration" : "image_cache_gb"},
                  " would be right.");
}

}  // namespace semfoam
