// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/hard_cases/ray_checks.h"

#include "foam/device/cpu_device.h"
#include "foam/device/cuda/gpu_caster.h"
#include "foam/device/cuda/host_machine.h"
#include "foam/device/cuda/segment_pool.h"
#include "foam/device/device_factory.h"
#include "foam/geometry/delaunay.h"
#include "foam/geometry/guard_sites.h"
#include "foam/geometry/voronoi.h"
#include "foam/model/spherical_harmonics.h"
#include "foam/optim/optimizer.h"
#include "foam/render/ray_tracer.h"
#include "foam/render/walk.h"
#include "foam/util/parallel.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace semfoam {
namespace {

constexpr size_t kMaxFailures = 5;       // sentences of one set of rays and one variant
constexpr int kOracleRays = 2;           // of a set, that an independent oracle sees
constexpr double kSmallest = 1e-32;      // below this a float has no bits left
constexpr double kQueriesPerRay = 1e7;   // site distances computed per ray by brute force
constexpr double kGrazingCosine = 1e-5;  // IsGrazing's threshold
constexpr double kCosineRounding = 5e-7;
constexpr double kRenderedBound = 1e-5;  // of colour and opacity, GPU against CPU

// What one variant has made of one ray, widened to double.
struct TracedRay {
  std::vector<uint32_t> cells;  // [segments + 1]: the cell behind the last segment too
  std::vector<double> t_in, t_out;
  std::vector<bool> clamped;
  std::vector<double> density;  // 0 where the segment is not shaded
  std::vector<double> weight;
  RayComposite<double> composite;
  RayGradient<double> gradient;  // of the loss, by the composite of the ray
  double loss = 0;
  std::vector<CellContribution<double>> contributions;
  bool hit_step_limit = false;

  size_t NumSegments() const { return t_out.size(); }
};

template <typename Real>
RayComposite<double> Widen(const RayComposite<Real>& ray) {
  RayComposite<double> out;
  out.tau = ray.tau;
  std::copy_n(ray.color, 3, out.color);
  std::copy_n(ray.identity, kIdentityDim, out.identity);
  std::copy_n(ray.quantile_tau, kNumQuantiles, out.quantile_tau);
  std::copy_n(ray.quantile_depth, kNumQuantiles, out.quantile_depth);
  std::copy_n(ray.quantile_segment, kNumQuantiles, out.quantile_segment);
  return out;
}

template <typename Real>
RayGradient<double> Widen(const RayGradient<Real>& gradient) {
  RayGradient<double> out;
  std::copy_n(gradient.color, 3, out.color);
  out.opacity = gradient.opacity;
  std::copy_n(gradient.quantile_depth, kNumQuantiles, out.quantile_depth);
  std::copy_n(gradient.identity, kIdentityDim, out.identity);
  return out;
}

template <typename Real>
CellContribution<double> Widen(const CellContribution<Real>& c) {
  return {
      c.cell, c.color_mask, c.weight, c.density, c.position.template cast<double>(), c.centroid};
}

// The loss of the ray's composite, in the variant's own arithmetic, and its gradient.
template <typename Real>
RayGradient<Real> LossGradient(const RayComposite<Real>& composite,
                               const RayCase& ray,
                               const FoamParameters<Real>& values,
                               TracedRay* out) {
  std::vector<Real> logits(values.num_classes);
  const ClassifierView<Real> classifier = values.Classifier();
  out->loss = RayLoss(composite, ray.target, classifier, logits.data()).Total(kHardCaseWeights);
  const RayGradient<Real> gradient =
      RayLossGradient(composite, ray.target, classifier, kHardCaseWeights, logits.data());
  out->composite = Widen(composite);
  out->gradient = Widen(gradient);
  return gradient;
}

template <typename Real>
TracedRay TraceScalar(const WalkGeometry<Real>& geometry,
                      const FoamParameters<Real>& values,
                      const std::vector<Real>& density,
                      const RayCase& ray,
                      uint32_t start) {
  const RayRecord<Real> record = TraceCase(geometry, values, density, ray, start);
  TracedRay out;
  out.hit_step_limit = record.hit_step_limit;
  double t = 0;
  for (const RecordedSegment<Real>& segment : record.segments) {
    const ShadedSegment<Real>* shaded =
        segment.shaded >= 0 ? &record.shaded[segment.shaded] : nullptr;
    out.cells.push_back(segment.cell);
    out.t_in.push_back(shaded != nullptr ? double(shaded->t_in) : t);
    out.t_out.push_back(segment.t_out);
    out.clamped.push_back(segment.clamped);
    out.density.push_back(shaded != nullptr ? double(shaded->sigma) : 0.0);
    out.weight.push_back(shaded != nullptr ? double(shaded->weight) : 0.0);
    t = segment.t_out;
  }
  out.cells.push_back(record.segments.empty() ? start : record.segments.back().next);
  const RayGradient<Real> gradient = LossGradient(record.composite, ray, values, &out);
  BackpropagateRay(geometry, record, gradient, [&](const CellContribution<Real>& c) {
    out.contributions.push_back(Widen(c));
  });
  return out;
}

// What the vector code has made of a ray.
TracedRay Widen(const RayScene& scene, const RayCase& ray, const RayTrace& trace) {
  TracedRay out;
  out.hit_step_limit = trace.hit_step_limit;
  std::vector<int> shaded_of_segment;
  int num_shaded = 0;
  for (int k = 0; k < trace.num_segments; ++k) {
    const bool shaded = trace.sites[k].density > 0;
    out.cells.push_back(trace.segments[k].cell);
    out.t_in.push_back(k > 0 ? trace.segments[k - 1].t_out : 0.0);
    out.t_out.push_back(trace.segments[k].t_out);
    out.density.push_back(trace.sites[k].density);
    out.weight.push_back(shaded ? double(trace.weight[k]) : 0.0);
    shaded_of_segment.push_back(num_shaded);
    num_shaded += shaded;
  }
  out.cells.push_back(trace.num_segments > 0 ? trace.segments[trace.num_segments].cell
                                             : trace.start_cell);
  out.clamped.assign(trace.num_segments, false);
  for (const uint32_t k : trace.clamped) out.clamped[k] = true;
  const RayGradient<float> gradient = LossGradient(trace.composite, ray, scene.values, &out);
  for (int& segment : out.composite.quantile_segment) {
    if (segment >= 0) segment = shaded_of_segment[segment];
  }
  std::vector<GradientRecord> records;
  BackpropagateRay(trace, gradient, scene.NumSites(), 0, &records);
  for (const GradientRecord& record : records) {
    out.contributions.push_back(Widen(record.contribution));
  }
  return out;
}

// All rays at once with one instruction set.
std::vector<TracedRay> TraceWith(const std::string& simd_target,
                                 const RayScene& scene,
                                 std::span<const RayCase> rays,
                                 std::span<const uint32_t> starts) {
  std::vector<RayTrace> traces(rays.size());
  for (size_t i = 0; i < rays.size(); ++i) {
    traces[i].origin = rays[i].origin.cast<float>();
    traces[i].direction = rays[i].direction.cast<float>();
    traces[i].start_cell = starts[i];
    for (int k = 0; k < kNumQuantiles; ++k) {
      traces[i].quantile_tau[k] = static_cast<float>(rays[i].quantile_tau[k]);
    }
  }
  const CellShading<float> shading = scene.values.Shading(scene.density);
  UseSimdTarget(simd_target);
  TraceRays(scene.cells.float_geometry, shading, std::numeric_limits<float>::infinity(), traces);
  std::vector<TracedRay> out;
  for (size_t i = 0; i < rays.size(); ++i) out.push_back(Widen(scene, rays[i], traces[i]));
  UseSimdTarget("");
  return out;
}

// As the threads of a GPU do it: with their kind of record, in chunks of a pool.
TracedRay TraceLikeAGpu(const RayScene& scene, const RayCase& ray, uint32_t start) {
  const CellShading<float> shading = scene.values.Shading(scene.density);
  std::vector<Slot> slots;
  std::vector<uint32_t> previous(1);
  uint32_t num_taken = 0;
  while (true) {
    slots.resize(previous.size() * kSlotsPerChunk);
    num_taken = 0;
    const SegmentPool pool{
        slots.data(), previous.data(), &num_taken, static_cast<uint32_t>(previous.size())};
    PooledRecord record(pool);
    record.origin = ray.origin.cast<float>();
    record.direction = ray.direction.cast<float>();
    for (int q = 0; q < kNumQuantiles; ++q) {
      record.composite.quantile_tau[q] = static_cast<float>(ray.quantile_tau[q]);
    }
    TraceRay(scene.cells.float_geometry,
             shading,
             start,
             std::numeric_limits<float>::infinity(),
             &record);
    if (!record.AddRoom()) {
      previous.resize(2 * previous.size());
      continue;
    }
    TracedRay out;
    out.hit_step_limit = record.hit_step_limit;
    RecordedSegment<float> segment;
    ShadedSegment<float> shaded{};
    auto segments = record.FromTheEnd();
    while (segments.Next(&segment, &shaded)) {
      const bool is_shaded = segment.shaded >= 0;
      if (out.cells.empty()) out.cells.push_back(segment.next);
      out.cells.push_back(segment.cell);
      out.t_out.push_back(segment.t_out);
      out.clamped.push_back(segment.clamped);
      out.density.push_back(is_shaded ? shaded.sigma : 0.0);
      out.weight.push_back(is_shaded ? shaded.weight : 0.0);
    }
    if (out.cells.empty()) out.cells.push_back(start);
    std::reverse(out.cells.begin(), out.cells.end());
    std::reverse(out.t_out.begin(), out.t_out.end());
    std::reverse(out.clamped.begin(), out.clamped.end());
    std::reverse(out.density.begin(), out.density.end());
    std::reverse(out.weight.begin(), out.weight.end());
    for (size_t n = 0; n < out.t_out.size(); ++n) out.t_in.push_back(n > 0 ? out.t_out[n - 1] : 0);

    const RayGradient<float> gradient = LossGradient(record.composite, ray, scene.values, &out);
    ContributionWriter writer(pool, record.end());
    BackpropagateRay(
        scene.cells.float_geometry, record, gradient, [&](const CellContribution<float>& c) {
          writer.Write(0, c);
        });
    SlotCursor cursor = record.end();
    for (uint32_t k = 0; k < writer.num_written(); ++k) {
      out.contributions.push_back(Widen(ContributionIn(slots[cursor.Back(pool)])));
    }
    return out;
  }
}

// A way to trace rays. One more is one more entry of Variants().
struct Variant {
  std::string name;
  bool in_double = false;
  std::function<std::vector<TracedRay>(
      const RayScene&, std::span<const RayCase>, std::span<const uint32_t> starts)>
      trace;
};

std::vector<TracedRay> TraceEach(size_t count, const std::function<TracedRay(size_t)>& trace) {
  std::vector<TracedRay> traced(count);
  ParallelForBlocks(count, 1, [&](int64_t begin, int64_t) { traced[begin] = trace(begin); });
  return traced;
}

// The first is the reference of the others.
std::vector<Variant> Variants() {
  std::vector<Variant> variants = {
      {"scalar double",
       true,
       [](const RayScene& scene, std::span<const RayCase> rays, std::span<const uint32_t> starts) {
         return TraceEach(rays.size(), [&](size_t i) {
           return TraceScalar(scene.cells.geometry,
                              scene.values_in_double,
                              scene.density_in_double,
                              rays[i],
                              starts[i]);
         });
       }},
      {"scalar float",
       false,
       [](const RayScene& scene, std::span<const RayCase> rays, std::span<const uint32_t> starts) {
         return TraceEach(rays.size(), [&](size_t i) {
           return TraceScalar(
               scene.cells.float_geometry, scene.values, scene.density, rays[i], starts[i]);
         });
       }},
  };
  variants.push_back(
      {"GPU",
       false,
       [](const RayScene& scene, std::span<const RayCase> rays, std::span<const uint32_t> starts) {
         return TraceEach(rays.size(),
                          [&](size_t i) { return TraceLikeAGpu(scene, rays[i], starts[i]); });
       }});
  for (const std::string& target : SimdTargets()) {
    variants.push_back({target,
                        false,
                        [target](const RayScene& scene,
                                 std::span<const RayCase> rays,
                                 std::span<const uint32_t> starts) {
                          return TraceWith(target, scene, rays, starts);
                        }});
  }
  return variants;
}

bool AllFinite(const TracedRay& ray) {
  bool finite = std::isfinite(ray.composite.tau) && std::isfinite(ray.loss) &&
                std::isfinite(ray.gradient.opacity);
  const auto check = [&](double value) { finite = finite && std::isfinite(value); };
  for (const auto* values : {&ray.t_out, &ray.weight, &ray.density}) {
    for (const double value : *values) check(value);
  }
  for (int c = 0; c < 3; ++c) {
    check(ray.composite.color[c]);
    check(ray.gradient.color[c]);
  }
  for (int c = 0; c < kIdentityDim; ++c) {
    check(ray.composite.identity[c]);
    check(ray.gradient.identity[c]);
  }
  for (int k = 0; k < kNumQuantiles; ++k) {
    check(ray.composite.quantile_depth[k]);
    check(ray.gradient.quantile_depth[k]);
  }
  for (const CellContribution<double>& c : ray.contributions) {
    check(c.weight);
    check(c.density);
    check(c.centroid);
    finite = finite && c.position.allFinite();
  }
  return finite;
}

void CheckSegments(const RayScene& scene,
                   const RayCase& ray,
                   const TracedRay& traced,
                   HardCaseResult* result) {
  const auto along = [&](uint32_t cell) {
    return scene.cells.geometry.positions[cell].dot(ray.direction);
  };
  double t = 0;
  for (size_t n = 0; n < traced.NumSegments(); ++n) {
    result->Expect(traced.t_in[n] == t, "piece ", n, " does not begin where the last one ends");
    result->Expect(traced.t_out[n] >= traced.t_in[n], "t runs backwards in piece ", n);
    t = traced.t_out[n];
    if (traced.t_out[n] > traced.t_in[n]) continue;
    ++result->zero_length_steps;
    result->clamped_steps += traced.clamped[n];
    result->Expect(along(traced.cells[n + 1]) > along(traced.cells[n]),
                   "a step of zero length leads to a site that is not farther along, in piece ",
                   n);
  }
  std::vector<uint32_t> seen = traced.cells;
  std::sort(seen.begin(), seen.end());
  result->Expect(std::adjacent_find(seen.begin(), seen.end()) == seen.end(), "a cell comes twice");
}

// Evenly spread over the ray's segments, as many as the number of sites allows.
double WalkDeviation(const RayScene& scene, const RayCase& ray, const TracedRay& traced) {
  const double budget = std::max(8.0, kQueriesPerRay / scene.cells.positions.size() / 3);
  const size_t stride = std::max<size_t>(1, std::ceil(traced.NumSegments() / budget));
  double deviation = 0;
  for (size_t n = 0; n < traced.NumSegments(); n += stride) {
    for (const double at : {0.1, 0.5, 0.9}) {
      const Eigen::Vector3d point =
          ray.origin + (traced.t_in[n] + at * (traced.t_out[n] - traced.t_in[n])) * ray.direction;
      const double own = (scene.cells.geometry.positions[traced.cells[n]] - point).norm();
      const double reach = std::max({1.0, ray.origin.norm(), point.norm(), own});
      deviation = std::max(deviation, (own - scene.NearestDistance(point)) / reach);
    }
  }
  return deviation;
}

double WeightsDeviation(const TracedRay& traced) {
  double sum = 0;
  for (const double weight : traced.weight) sum += weight;
  return std::abs(sum - traced.composite.Opacity());
}

double ColorDeviation(const TracedRay& traced, const TracedRay& reference) {
  double deviation = std::abs(traced.composite.Opacity() - reference.composite.Opacity());
  for (int c = 0; c < 3; ++c) {
    deviation =
        std::max(deviation, std::abs(traced.composite.color[c] - reference.composite.color[c]));
  }
  return deviation;
}

// The variant's ray in double: the same cells, crossings and densities, everything after that
// computed anew.
RayRecord<double> InDouble(const RayScene& scene, const RayCase& ray, const TracedRay& traced) {
  const FoamParameters<double>& values = scene.values_in_double;
  const int num_coefficients = NumShCoefficients(values.sh_degree);
  RayRecord<double> record;
  record.origin = ray.origin;
  record.direction = ray.direction;
  ShBasis(values.sh_degree, ray.direction, record.sh_basis);
  for (size_t n = 0; n < traced.NumSegments(); ++n) {
    const uint32_t cell = traced.cells[n];
    RecordedSegment<double>& segment = record.segments.emplace_back();
    segment.cell = cell;
    segment.next = traced.cells[n + 1];
    segment.shaded = -1;
    segment.clamped = traced.clamped[n];
    segment.t_out = traced.t_out[n];
    if (!(traced.density[n] > 0)) continue;
    segment.shaded = static_cast<int>(record.shaded.size());
    ShadedSegment<double>& shaded = record.shaded.emplace_back(AddSegment(
        traced.t_in[n], traced.t_out[n], traced.density[n], segment.shaded, &record.composite));
    const double* const sh = &values.sh[size_t(cell) * 3 * num_coefficients];
    if (traced.weight[n] > kNegligibleWeight) {
      const Eigen::Vector3d offset =
          ray.origin + shaded.centroid * ray.direction - values.positions[cell];
      LinearColor(record.sh_basis,
                  num_coefficients,
                  sh,
                  &values.color_gradient[size_t(cell) * kColorGradientDim],
                  offset,
                  ray.direction,
                  shaded.color,
                  shaded.slope);
    } else {
      ShColor(record.sh_basis, 1, sh, shaded.color);
    }
  }
  // Into which segment a quantile falls is a branch: the variant's is followed.
  for (int k = 0; k < kNumQuantiles; ++k) {
    record.composite.quantile_segment[k] = traced.composite.quantile_segment[k];
    record.composite.quantile_depth[k] = traced.composite.quantile_depth[k];
  }
  return record;
}

double GradientDeviation(const RayScene& scene, const RayCase& ray, const TracedRay& traced) {
  const RayRecord<double> record = InDouble(scene, ray, traced);
  const WalkGeometry<double>& geometry = scene.cells.geometry;
  const auto scales = GradientScales(geometry, scene.values_in_double, record, traced.gradient);
  struct Pair {
    CellContribution<double> mine, oracle;
  };
  const CellContribution<double> nothing{0, 0, 0, 0, Eigen::Vector3d::Zero(), 0};
  std::map<uint32_t, Pair> pairs;
  for (const CellContribution<double>& c : traced.contributions) {
    pairs.try_emplace(c.cell, Pair{nothing, nothing}).first->second.mine = c;
  }
  BackpropagateRay(geometry, record, traced.gradient, [&](const CellContribution<double>& c) {
    pairs.try_emplace(c.cell, Pair{nothing, nothing}).first->second.oracle = c;
  });
  double deviation = 0;
  for (const auto& [cell, pair] : pairs) {
    const GradientScale& scale = scales.at(cell);
    const auto include = [&](double difference, double magnitude) {
      deviation = std::max(deviation, std::abs(difference) / (magnitude + kSmallest));
    };
    include(pair.mine.weight - pair.oracle.weight, scale.weight);
    include(pair.mine.density - pair.oracle.density, scale.density);
    // A cell without weight has no centroid that counts.
    include(pair.mine.weight * (pair.mine.centroid - pair.oracle.centroid),
            scale.weight * std::abs(pair.oracle.centroid));
    if (scale.ambiguous) continue;
    include((pair.mine.position - pair.oracle.position).lpNorm<Eigen::Infinity>(), scale.position);
  }
  return deviation;
}

// Where the rendered quantile lies in optical depth, against where it should, over what the
// rounding of its distance makes of it.
double QuantileDeviation(const TracedRay& traced, const RayRecord<double>& record) {
  double deviation = 0;
  for (int k = 0; k < kNumQuantiles; ++k) {
    const int index = traced.composite.quantile_segment[k];
    if (index < 0) continue;
    const ShadedSegment<double>& segment = record.shaded[index];
    const double depth = traced.composite.quantile_depth[k];
    const double tau = segment.tau_in + segment.sigma * (depth - segment.t_in);
    const double wanted = traced.composite.quantile_tau[k];
    deviation = std::max(
        deviation, std::abs(tau - wanted) / (1 + segment.tau_in + wanted + segment.sigma * depth));
  }
  return deviation;
}

// Compares what a GPU renders of the rays with what the CPU renders: its kernels, run on the CPU,
// and `device` where that is a GPU.
void CheckRenderedRays(const RayScene& scene,
                       const std::vector<RayCase>& rays,
                       const std::vector<uint32_t>& starts,
                       const Device& device,
                       HardCaseResult* result) {
  const WalkGeometry<float>& geometry = scene.cells.float_geometry;
  const CellShading<float> shading = scene.values.Shading(scene.density);
  const ClassifierView<float> classifier = scene.values.Classifier();
  std::vector<RayQuery> queries;
  for (size_t i = 0; i < rays.size(); ++i) {
    queries.push_back({rays[i].origin.cast<float>(), rays[i].direction.cast<float>(), starts[i]});
  }
  const std::vector<RenderedRay> expected =
      MakeCpuRayCaster(geometry, shading, classifier)->Render(queries);
  const GpuCaster<HostMachine> kernels(geometry, shading, classifier);
  const auto check = [&](const std::string& name, const RayCaster& caster) {
    const std::vector<RenderedRay> shown = caster.Render(queries);
    Deviations deviations;
    for (size_t i = 0; i < rays.size(); ++i) {
      deviations.color = std::max(
          {deviations.color,
           double((shown[i].color - expected[i].color).norm()) / (1 + expected[i].color.norm()),
           std::abs(double(shown[i].opacity) - expected[i].opacity)});
      result->Expect(shown[i].color.allFinite(), name, ", ray ", i, ": a colour is not finite.");
    }
    result->rays += rays.size();
    result->Expect(deviations.color <= kRenderedBound,
                   name,
                   ": what is shown deviates from what the CPU shows by ",
                   deviations.color,
                   ", more than ",
                   kRenderedBound,
                   ".");
    result->deviations[name].Include(deviations);
  };
  check("GPU", kernels);
  if (device.gpu()) {
    check(device.Description(), *MakeRayCaster(device, geometry, shading, classifier));
  }
}

// All assertions about one ray of one variant.
HardCaseResult CheckRay(const RayScene& scene,
                        const RayCase& ray,
                        const Variant& variant,
                        const TracedRay& traced,
                        const TracedRay& reference,
                        const RayBounds& bounds) {
  HardCaseResult result;
  result.rays = 1;
  result.steps = traced.NumSegments();
  result.step_limit_hits = traced.hit_step_limit;
  result.Expect(!traced.hit_step_limit, "the step limit was hit");
  result.Expect(AllFinite(traced), "something is not finite");
  CheckSegments(scene, ray, traced, &result);
  if (!result.failures.empty()) return result;  // what follows would say the same in other words

  const bool in_double = variant.in_double;
  Deviations& deviations = result.deviations[variant.name];
  const auto expect = [&](double deviation, double bound, const char* what) {
    result.Expect(deviation <= bound, what, " deviates by ", deviation, ", more than ", bound);
  };
  if (!bounds.stale) {
    deviations.walk = WalkDeviation(scene, ray, traced);
    expect(deviations.walk, in_double ? bounds.walk_double : bounds.walk_float, "the walk");
    result.Expect(!bounds.ends_in_guard || traced.cells.back() >= scene.NumSites(),
                  "the walk ends in the bounded cell ",
                  traced.cells.back());
  }
  deviations.weights = WeightsDeviation(traced);
  expect(deviations.weights,
         in_double ? bounds.weights_double : bounds.weights_float,
         "the sum of the weights");
  const double quantile_deviation = QuantileDeviation(traced, InDouble(scene, ray, traced));
  expect(quantile_deviation,
         in_double ? bounds.gradient_double : bounds.gradient_float,
         "a quantile's optical depth");
  if (in_double) return result;
  deviations.gradient = GradientDeviation(scene, ray, traced);
  expect(deviations.gradient, bounds.gradient_float, "the gradient");
  deviations.color = ColorDeviation(traced, reference);
  expect(deviations.color, bounds.color_float, "the colour");
  return result;
}

}  // namespace

void Deviations::Include(const Deviations& other) {
  walk = std::max(walk, other.walk);
  weights = std::max(weights, other.weights);
  gradient = std::max(gradient, other.gradient);
  color = std::max(color, other.color);
}

void HardCaseResult::Add(const HardCaseResult& other) {
  failures.insert(failures.end(), other.failures.begin(), other.failures.end());
  for (const auto& [variant, found] : other.deviations) deviations[variant].Include(found);
  rays += other.rays;
  steps += other.steps;
  zero_length_steps += other.zero_length_steps;
  clamped_steps += other.clamped_steps;
  step_limit_hits += other.step_limit_hits;
}

RayScene::RayScene(const std::vector<Eigen::Vector3f>& sites,
                   uint64_t seed,
                   int sh_degree,
                   int num_classes)
    : cells(sites),
      values(RandomParameters(cells.positions, sites.size(), sh_degree, num_classes, seed)) {
  BoundColorGradients();
  Update();
}

// As training does: cells without an end are of one colour.
void RayScene::BoundColorGradients() {
  const std::vector<float> radii = CellRadii(cells.positions, cells.delaunay);
  constexpr float kNoChange[kColorGradientDim] = {};
  for (uint32_t i = 0; i < NumSites(); ++i) {
    const auto neighbors = cells.delaunay.Neighbors(i);
    const bool is_open = !neighbors.empty() && neighbors.back() >= NumSites();
    StepColorGradient(kNoChange,
                      StepLengthsOf(radii[i], is_open).color_gradient,
                      &values.color_gradient[size_t{i} * kColorGradientDim]);
  }
}

void RayScene::MoveSites(const std::vector<Eigen::Vector3f>& sites) {
  cells.positions = WithGuardSites(sites);
  values.positions = cells.positions;
  Update();
  Refresh(cells.positions, &cells.float_geometry);
  Refresh(values_in_double.positions, &cells.geometry);
}

void RayScene::Update() {
  values_in_double = Cast<double>(values);
  density = values.Densities();
  density_in_double = values_in_double.Densities();
  const auto num_cells = static_cast<Eigen::Index>(cells.positions.size());
  x.resize(num_cells);
  y.resize(num_cells);
  z.resize(num_cells);
  for (Eigen::Index i = 0; i < num_cells; ++i) {
    x[i] = cells.positions[i].x();
    y[i] = cells.positions[i].y();
    z[i] = cells.positions[i].z();
  }
}

double RayScene::NearestDistance(const Eigen::Vector3d& point) const {
  const double px = point.x(), py = point.y(), pz = point.z();
  return std::sqrt(((x - px).square() + (y - py).square() + (z - pz).square()).minCoeff());
}

Eigen::Vector3f ToFloat(const Eigen::Vector3d& x) { return x.cast<float>(); }

HardCaseResult CheckRays(const RayScene& scene,
                         std::vector<RayCase> rays,
                         const RayBounds& bounds,
                         const CheckOptions& options) {
  HardCaseResult result;
  std::vector<uint32_t> starts;
  for (RayCase& ray : rays) {
    ray.origin = ToFloat(ray.origin).cast<double>();
    ray.direction = ToFloat(ray.direction).cast<double>();
    starts.push_back(scene.cells.BruteForceNearest(ray.origin));
    if (bounds.stale) continue;
    const uint32_t descended =
        NearestCell(scene.cells.positions, scene.cells.delaunay, ray.origin, 0);
    result.Expect((scene.cells.geometry.positions[descended] - ray.origin).norm() ==
                      (scene.cells.geometry.positions[starts.back()] - ray.origin).norm(),
                  "the descent to the first cell ends in one that is not the nearest");
  }

  std::vector<TracedRay> reference;
  for (const Variant& variant : Variants()) {
    std::vector<TracedRay> traced = variant.trace(scene, rays, starts);
    if (reference.empty()) reference = traced;
    std::vector<HardCaseResult> checked(rays.size());
    ParallelForBlocks(rays.size(), 1, [&](int64_t i, int64_t) {
      checked[i] = CheckRay(scene, rays[i], variant, traced[i], reference[i], bounds);
    });
    std::vector<std::string> failures;
    for (size_t i = 0; i < rays.size(); ++i) {
      for (const std::string& failure : checked[i].failures) {
        failures.push_back(variant.name + ", ray " + std::to_string(i) + ": " + failure + ".");
      }
      checked[i].failures.clear();
      result.Add(checked[i]);
    }
    if (failures.size() > kMaxFailures) {
      failures[kMaxFailures] =
          variant.name + ": " + std::to_string(failures.size()) + " failures in all.";
      failures.resize(kMaxFailures + 1);
    }
    result.failures.insert(result.failures.end(), failures.begin(), failures.end());
    if (variant.in_double && options.oracle) {
      for (size_t i = 0; i < std::min<size_t>(rays.size(), kOracleRays); ++i) {
        const double deviation = options.oracle(scene, rays[i], starts[i]);
        Deviations& deviations = result.deviations[variant.name];
        deviations.gradient = std::max(deviations.gradient, deviation);
        result.Expect(deviation <= bounds.gradient_double,
                      variant.name,
                      ", ray ",
                      i,
                      ": the gradient deviates by ",
                      deviation,
                      " from the oracle's, more than ",
                      bounds.gradient_double,
                      ".");
      }
    }
  }
  CheckRenderedRays(scene, rays, starts, options.device, &result);
  return result;
}

std::map<uint32_t, GradientScale> GradientScales(const WalkGeometry<double>& geometry,
                                                 const FoamParameters<double>& values,
                                                 const RayRecord<double>& record,
                                                 const RayGradient<double>& gradient) {
  // by_weight <= brightest, for every segment. A colour is a sum too: of terms as large as its
  // gradient times the coordinates that its offset from the site is the difference of.
  double brightest = std::abs(gradient.opacity);
  for (int c = 0; c < 3; ++c) {
    double largest = 0;
    for (const RecordedSegment<double>& segment : record.segments) {
      if (segment.shaded < 0) continue;
      const ShadedSegment<double>& shaded = record.shaded[segment.shaded];
      const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> color_gradient(
          &values.color_gradient[size_t(segment.cell) * kColorGradientDim]);
      const double reach = record.origin.norm() + std::abs(shaded.centroid) +
                           geometry.positions[segment.cell].norm();
      largest = std::max(largest, shaded.color[c] + reach * color_gradient.col(c).norm());
    }
    brightest += std::abs(gradient.color[c]) * largest;
  }
  std::map<uint32_t, GradientScale> scales;
  double behind_quantiles = 0;  // sum over the quantiles behind of |gradient| / sigma
  double by_t_in = 0;           // magnitude of dL/dt of the face at hand, from behind it
  for (size_t n = record.segments.size(); n-- > 0;) {
    const RecordedSegment<double>& segment = record.segments[n];
    const uint32_t behind_cell = segment.next;
    GradientScale& here = scales[segment.cell];
    GradientScale& behind = scales[behind_cell];
    double by_t_out = by_t_in;
    by_t_in = 0;
    if (segment.shaded >= 0) {
      const ShadedSegment<double>& shaded = record.shaded[segment.shaded];
      const double by_depth = brightest * std::exp(-shaded.tau_in) + behind_quantiles;
      const double length = shaded.optical_depth / shaded.sigma;
      here.weight += shaded.weight * (1 + shaded.tau_in);
      here.density += by_depth * length;
      by_t_out += by_depth * shaded.sigma;
      by_t_in += by_depth * shaded.sigma;
      // The gradient of the colour moves with the centroid: by no more than the face itself, and by
      // a twelfth of the squared length for a change of the density.
      double by_centroid = 0;
      for (int c = 0; c < 3; ++c) by_centroid += std::abs(gradient.color[c] * shaded.slope[c]);
      by_centroid *= shaded.weight;
      // What moving the site does to the offset from it.
      for (int k = 0; k < kColorGradientDim; ++k) {
        here.position += std::abs(shaded.weight * gradient.color[k % 3] *
                                  values.color_gradient[segment.cell * kColorGradientDim + k]);
      }
      here.density += by_centroid * length * length / 12;
      by_t_out += by_centroid;
      by_t_in += by_centroid;
      for (int k = 0; k < kNumQuantiles; ++k) {
        if (record.composite.quantile_segment[k] != segment.shaded) continue;
        const double by_quantile = std::abs(gradient.quantile_depth[k]);
        here.density +=
            by_quantile * std::abs(record.composite.quantile_depth[k] - shaded.t_in) / shaded.sigma;
        by_t_in += by_quantile;
        behind_quantiles += by_quantile / shaded.sigma;
      }
    }
    if (segment.clamped) {
      by_t_in += by_t_out;
      continue;
    }
    const Eigen::Vector3d normal =
        geometry.positions[behind_cell] - geometry.positions[segment.cell];
    const double cosine = normal.dot(record.direction) / normal.norm();
    if (std::abs(cosine - kGrazingCosine) < kCosineRounding)
      here.ambiguous = behind.ambiguous = true;
    if (IsGrazing<double>(normal, record.direction)) continue;
    // dt/dp = (x - p) / (n.d): x - p is a sum of terms as long as the ray so far, and n.d is as
    // exact as its ratio to |n|.
    const double reach =
        (record.origin - geometry.positions[segment.cell]).norm() + std::abs(segment.t_out);
    const double scale = by_t_out * reach / (normal.norm() * cosine * std::abs(cosine));
    here.position += std::abs(scale);
    behind.position += std::abs(scale);
  }
  return scales;
}

std::vector<RayCase> RaysFromEverywhere(int count, uint64_t seed) {
  std::vector<RayCase> rays;
  for (int i = 0; i < count; ++i) {
    CounterRandom random(seed, 0x71, i);
    const bool outside = i % 4 == 0;
    const Eigen::Vector3d origin = RandomPoint(&random, outside ? 150 : 1.2);
    const Eigen::Vector3d direction =
        outside ? (RandomPoint(&random, 1) - origin).normalized() : RandomDirection(&random);
    rays.push_back(MakeRay(origin, direction, seed + i));
  }
  return rays;
}

RayCase MakeRay(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, uint64_t seed) {
  CounterRandom random(seed, 0x72, 0);
  RayCase ray;
  ray.origin = origin;
  ray.direction = direction;
  const double u = random.Uniform(), v = random.Uniform();
  ray.quantile_tau[0] = -std::log(1 - std::min(u, v));
  ray.quantile_tau[1] = -std::log(1 - std::max(u, v));
  for (float& c : ray.target.color) c = static_cast<float>(random.Uniform());
  ray.target.class_index = seed % 4 == 3 ? Value(kUnlabelled) : 0;
  return ray;
}

}  // namespace semfoam
