// SPDX-License-Identifier: GPL-3.0-or-later
//
// Prints a digest of what each stage of a training computes, from the triangulation to a trained
// foam, one a line: `exact` or `rounded`, the digest, the stage. What is exact has the same bytes
// on every machine. What is rounded also depends on the C library's exp, log, pow, sin and cos, or
// on how many lanes the instruction set adds up at once and on whether it fuses a * b + c.
// tests/arm64 compares two machines by it.
#include "foam/render/ray_tracer.h"
#include "foam/train/trainer.h"

#include <cstdio>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "tests/foam/foam_digest.h"
#include "tests/foam/random_cells.h"
#include "tests/foam/render/ray_replay.h"
#include "tests/foam/synthetic_views.h"

namespace semfoam {
namespace {

constexpr int kNumRays = 500;

void Print(const char* kind, const std::string& stage, uint64_t digest) {
  std::printf("%-7s %016llx %s\n", kind, static_cast<unsigned long long>(digest), stage.c_str());
}

// The cells that rays pass and where they leave them, and the weights of the cells.
struct Paths {
  std::vector<uint32_t> cells;
  std::vector<double> exits;
  std::vector<double> weights;
  std::vector<double> colors;

  void PrintDigests(const std::string& variant) const {
    Print("exact", "walk, " + variant, DigestOf(exits, DigestOf(cells, 0)));
    Print("rounded", "weights, " + variant, DigestOf(weights, 0));
    Print("rounded", "colours, " + variant, DigestOf(colors, 0));
  }
};

// From within the box of the sites, rounded to float.
std::vector<RayCase> RandomRays() {
  std::vector<RayCase> rays;
  for (int i = 0; i < kNumRays; ++i) {
    CounterRandom random(2, 0x53, i);
    RayCase ray;
    ray.origin = RandomPoint(&random, 1).cast<float>().cast<double>();
    ray.direction = RandomPoint(&random, 1).normalized().cast<float>().cast<double>();
    rays.push_back(ray);
  }
  return rays;
}

template <typename Real>
Paths TraceByReference(const WalkGeometry<Real>& geometry,
                       const FoamParameters<Real>& values,
                       const std::vector<RayCase>& rays,
                       const std::vector<uint32_t>& starts) {
  const std::vector<Real> density = values.Densities();
  Paths paths;
  for (size_t i = 0; i < rays.size(); ++i) {
    const RayRecord<Real> record = TraceCase(geometry, values, density, rays[i], starts[i]);
    for (const RecordedSegment<Real>& segment : record.segments) {
      paths.cells.push_back(segment.cell);
      paths.exits.push_back(segment.t_out);
    }
    for (const ShadedSegment<Real>& shaded : record.shaded) paths.weights.push_back(shaded.weight);
    for (const Real channel : record.composite.color) paths.colors.push_back(channel);
  }
  return paths;
}

Paths TraceByVectors(const WalkGeometry<float>& geometry,
                     const FoamParameters<float>& values,
                     const std::vector<RayCase>& rays,
                     const std::vector<uint32_t>& starts) {
  const std::vector<float> density = values.Densities();
  Paths paths;
  for (size_t i = 0; i < rays.size(); ++i) {
    RayTrace& trace = ThreadTraces(1).front();
    trace.origin = rays[i].origin.cast<float>();
    trace.direction = rays[i].direction.cast<float>();
    trace.start_cell = starts[i];
    TraceRays(
        geometry, values.Shading(density), std::numeric_limits<float>::infinity(), {&trace, 1});
    for (int k = 0; k < trace.num_segments; ++k) {
      paths.cells.push_back(trace.segments[k].cell);
      paths.exits.push_back(trace.segments[k].t_out);
      paths.weights.push_back(trace.weight[k]);
    }
    for (const float channel : trace.composite.color) paths.colors.push_back(channel);
  }
  return paths;
}

void PrintAll() {
  std::vector<double> normals;
  CounterRandom random(3, 0x54, 0);
  for (int i = 0; i < 10'000; ++i) normals.push_back(random.Normal());
  Print("rounded", "normal numbers", DigestOf(normals, 0));

  const WalkableCells cells(RandomSites(2000, 1));
  Print("exact", "sites and guards", DigestOf(cells.positions, 0));
  Print("exact",
        "triangulation",
        DigestOf(cells.delaunay.tets, DigestOf(cells.delaunay.neighbors, 0)));

  const FoamParameters<float> values =
      RandomParameters(cells.positions, cells.delaunay.num_sites, 2, 5, 1);
  const std::vector<RayCase> rays = RandomRays();
  std::vector<uint32_t> starts;
  for (const RayCase& ray : rays) starts.push_back(cells.BruteForceNearest(ray.origin));
  TraceByReference(cells.geometry, Cast<double>(values), rays, starts)
      .PrintDigests("reference in double");
  TraceByReference(cells.float_geometry, values, rays, starts).PrintDigests("reference in float");
  for (const std::string& target : SimdTargets()) {
    UseSimdTarget(target);
    TraceByVectors(cells.float_geometry, values, rays, starts).PrintDigests(target);
  }

  TrainingOptions options;
  options.num_rays = 50'000;
  options.rays_per_iteration = 1024;
  options.initial_sites = 500;
  options.final_sites = 1000;
  options.sh_degree = 1;
  options.densify_events = 2;
  const SyntheticViews views(8, 32, 24);
  for (const std::string& target : SimdTargets()) {
    UseSimdTarget(target);
    const TrainingSummary summary = TrainFoam(views, views.Seeds(400), 3, options, nullptr);
    Print("rounded", "training, " + target, DigestOf(summary));
    std::fprintf(stderr,
                 "training, %s: %zu cells, %.2f dB held out\n",
                 target.c_str(),
                 size_t(summary.foam.NumSites()),
                 summary.last.held_out_psnr);
  }
}

}  // namespace
}  // namespace semfoam

int main() { semfoam::PrintAll(); }
