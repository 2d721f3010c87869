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

// The fast path: what walk.h and ray_record.h do ray by ray, with vector instructions and several
// rays in flight. The instruction set is chosen when the program runs (Highway); the templates in
// those two headers are the reference that this is held against. The walk takes the very same steps
// as the reference in float, bit for bit, on every instruction set; weights and colours agree to
// rounding.

namespace semfoam {

// Number of rays walked in turns, one step each: while one waits for its next cell to come from the
// cache, the others compute.
inline constexpr int kRaysInFlight = 8;

// Input and result of tracing one ray. Reused from ray to ray, so that memory is allocated only
// while the arrays still grow. Segment k is the part of the ray inside its k-th cell.
struct RayTrace {
  // Input. `direction` has unit length; `start_cell` is the cell nearest to the origin.
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
  float sh_basis[kMaxShCoefficients];

  struct Site {
    float x, y, z;
    float density;  // 0 where the cell is transparent or the segment has no length
  };
  struct Segment {
    uint32_t cell;
    float t_out;
    float tau_in;         // optical depth of all segments before this one
    float optical_depth;  // of this one
  };
  // Sites and segments have one more entry than there are segments: the cell behind the last face.
  LargePageVector<Site> sites;
  LargePageVector<Segment> segments;
  std::vector<uint32_t>
      clamped;  // segments whose exit face has no say in t_out (see Walk), ascending
  LargePageVector<float> weight;
  LargePageVector<float> transmittance;  // behind the segment
  LargePageVector<float> color[3];
};

// Returns `count` traces of the calling thread with default inputs; their arrays keep the capacity
// that earlier rays needed. Valid until the thread's next call.
std::span<RayTrace> ThreadTraces(size_t count);

// Walks and shades rays, each until the optical depth passes `cutoff_tau` or the foam ends.
void TraceRays(const WalkGeometry<float>& geometry,
               const CellShading<float>& shading,
               float cutoff_tau,
               std::span<RayTrace> rays);

// Backpropagates through a traced ray: appends a record for every cell on it, guards apart, with a
// non-zero gradient. `ray_index` is stored in the records. `identity` as in the reference: null
// stops gradient.identity at the weights.
void BackpropagateRay(const RayTrace& ray,
                      const RayGradient<float>& gradient,
                      uint32_t num_sites,
                      uint32_t ray_index,
                      std::vector<GradientRecord>* records,
                      const float* identity = nullptr);

// Cross-entropy with the classifier transposed and padded for vector instructions.
class ClassLoss {
 public:
  explicit ClassLoss(const ClassifierView<float>& classifier);

  // The cross-entropy of a rendered identity [kIdentityDim] against a class, divided by
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

// The walk alone, for measuring it.
struct WalkQuery {
  Eigen::Vector3f origin;
  Eigen::Vector3f direction;
  uint32_t start_cell;
};
struct WalkResult {
  uint32_t steps;  // cells left again
  float t_exit;    // distance at which the last of them was left
};
// Walks every ray to its end, `rays_in_flight` (1, 2, 4 or 8) at a time.
void WalkRays(const WalkGeometry<float>& geometry,
              std::span<const WalkQuery> rays,
              int rays_in_flight,
              std::span<WalkResult> results);

// The instruction sets that this program knows and this machine has, best first: "AVX-512", "AVX2",
// "SSE4", or what else Highway calls them. The first is used.
std::vector<std::string> SimdTargets();

// For tests and benchmarks: from now on uses this one of SimdTargets(); "" = the best. Not while
// rays are being traced.
void UseSimdTarget(const std::string& name);

}  // namespace semfoam
