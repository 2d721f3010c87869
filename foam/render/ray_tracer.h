// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/render/gradient_sum.h"
#include "foam/render/ray_loss.h"
#include "foam/render/ray_record.h"
#include "foam/util/large_pages.h"

#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

// Traces rays and backpropagates through them as walk.h and ray_record.h do, but with vector
// instructions and several rays in flight. The instruction set is chosen when the program runs
// (Highway). The templates in those two headers are the reference: the walk takes the same steps as
// they do in float, bit for bit, on every instruction set; weights and colours agree to rounding.

namespace semfoam {

// Number of rays walked in turns, one step each: while one waits for its next cell to come from the
// cache, the others compute.
inline constexpr int kRaysInFlight = 8;

// Input and result of tracing one ray. Reused from ray to ray, so that memory is allocated only
// while the arrays still grow. Segment k is the part of the ray inside its k-th cell.
struct RayTrace {
  // Input, in the normalised frame. `direction` has unit length; `start_cell` is the cell nearest
  // to the origin.
  Eigen::Vector3f origin = Eigen::Vector3f::Zero();
  Eigen::Vector3f direction = Eigen::Vector3f::UnitX();
  uint32_t start_cell = 0;
  // Optical depths of the depth quantiles, ascending; infinity: not requested.
  float quantile_tau[kNumQuantiles] = {std::numeric_limits<float>::infinity(),
                                       std::numeric_limits<float>::infinity()};

  // Result.
  RayComposite<float> composite;
  bool hit_step_limit = false;
  int num_segments = 0;
  // The SH basis functions in the ray's direction.
  float sh_basis[kMaxShCoefficients];

  // The site of a segment's cell.
  struct Site {
    float x, y, z;
    // 0 where the cell is transparent or the segment has no length.
    float density;
  };
  struct Segment {
    uint32_t cell;
    // Distance from the origin at which the ray leaves the cell.
    float t_out;
    // Optical depth of all segments before this one.
    float tau_in;
    // Optical depth of this segment.
    float optical_depth;
  };
  // [num_segments + 1]: the last entry is the cell behind the last face. Here and below, vectors
  // may be longer.
  LargePageVector<Site> sites;
  LargePageVector<Segment> segments;
  // Indices of the segments whose t_out is the distance of their entry (see Walk), ascending.
  std::vector<uint32_t> clamped;
  // [num_segments], as is all that follows.
  LargePageVector<float> weight;
  // Transmittance behind the segment.
  LargePageVector<float> transmittance;
  LargePageVector<float> color[3];
  // Of cells with a colour gradient only, as in ShadedSegment; the slope 0 where it does not count.
  bool has_slopes = false;
  LargePageVector<float> centroid;
  LargePageVector<float> slope[3];
};

// Returns `count` traces of the calling thread with default inputs; their arrays keep the capacity
// that earlier rays needed. Valid until the thread's next call.
std::span<RayTrace> ThreadTraces(size_t count);

// Walks and shades rays, each until its optical depth passes `cutoff_tau` or it leaves the foam.
void TraceRays(const WalkGeometry<float>& geometry,
               const CellShading<float>& shading,
               float cutoff_tau,
               std::span<RayTrace> rays);

// Backpropagates through a traced ray: appends a record for every cell on it, guards apart, with a
// non-zero gradient. Stores `ray_index` in the records. `identity` as in the reference: null stops
// gradient.identity at the weights.
void BackpropagateRay(const RayTrace& ray,
                      const RayGradient<float>& gradient,
                      uint32_t num_sites,
                      uint32_t ray_index,
                      std::vector<GradientRecord>* records,
                      const float* identity = nullptr);

// Computes the cross-entropy of many classes with vector instructions. Keeps the classifier
// transposed and padded.
class ClassLoss {
 public:
  explicit ClassLoss(const ClassifierView<float>& classifier);

  // Returns the cross-entropy of a rendered identity [kIdentityDim] against a class, divided by
  // ln(max(K, 2)), as in RayLoss. Adds `weight` times its derivative by the identity to
  // `identity_gradient`, and `scale * weight` times its derivatives by the classifier's parameters
  // to `weight_gradient` [K][kIdentityDim] and `bias_gradient` [K].
  float Add(const float* identity,
            int32_t class_index,
            float weight,
            float scale,
            float* identity_gradient,
            float* weight_gradient,
            float* bias_gradient);

 private:
  ClassifierView<float> classifier_;
  size_t padded_classes_;
  LargePageVector<float> transposed_;  // [kIdentityDim][padded_classes_]
  LargePageVector<float> bias_;        // [padded_classes_], -infinity in the padding
  LargePageVector<float> logits_;      // [padded_classes_], scratch
};

// A ray to be walked without shading, for measuring the walk.
struct WalkQuery {
  Eigen::Vector3f origin;
  Eigen::Vector3f direction;
  uint32_t start_cell;
};
struct WalkResult {
  // Number of cells that the ray left again.
  uint32_t steps;
  // Distance at which it left the last of them.
  float t_exit;
};
// Walks every ray to its end, `rays_in_flight` (1, 2, 4 or 8) at a time.
void WalkRays(const WalkGeometry<float>& geometry,
              std::span<const WalkQuery> rays,
              int rays_in_flight,
              std::span<WalkResult> results);

// Returns the names of the instruction sets for which this program has code and that this CPU has,
// best first: "AVX-512", "AVX2", "SSE4", or Highway's name of another. The first is used.
std::vector<std::string> SimdTargets();

// Selects one of SimdTargets() for all later calls; "": the best. For tests and benchmarks. Must
// not be called while rays are traced.
void UseSimdTarget(const std::string& name);

}  // namespace semfoam
