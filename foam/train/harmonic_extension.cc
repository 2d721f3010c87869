// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/train/harmonic_extension.h"

#include "foam/model/foam.h"
#include "foam/util/parallel.h"

#include <glog/logging.h>

namespace semfoam {
namespace {

// Conjugate gradients end where the residual has fallen to this share of the first one, which takes
// 180 to 290 iterations of 80 k cells.
constexpr double kTolerance = 1e-5;
constexpr int kMostIterations = 1000;

// Nodes that a thread takes at a time.
constexpr int64_t kBlock = 1024;

// Returns the sum of body(i) over [0, count): the same on any number of threads.
template <typename Sums, typename Body>
Sums SumOver(int64_t count, Body&& body) {
  std::vector<Sums> blocks((count + kBlock - 1) / kBlock, Sums::Zero());
  ParallelForBlocks(count, kBlock, [&](int64_t begin, int64_t end) {
    Sums sum = Sums::Zero();
    for (int64_t i = begin; i < end; ++i) sum += body(i);
    blocks[begin / kBlock] = sum;
  });
  Sums total = Sums::Zero();
  for (const Sums& sum : blocks) total += sum;
  return total;
}

// The linear system of ExtendHarmonically.
class HarmonicSystem {
 public:
  HarmonicSystem(const ConductanceGraph& graph, const std::vector<float>& hold)
      : graph_(graph), diagonal_(graph.NumNodes(), 0.f), sum_(graph.NumNodes(), 0.f) {
    for (int64_t i = 0; i < graph.NumNodes(); ++i) {
      double sum = 0;
      for (uint32_t k = graph.offsets[i]; k < graph.offsets[i + 1]; ++k) {
        sum += graph.conductance[k];
      }
      sum_[i] = static_cast<float>(sum);
      diagonal_[i] = static_cast<float>(sum * (1 + hold[i]));
    }
  }

  float Diagonal(int64_t i) const { return diagonal_[i]; }
  float Sum(int64_t i) const { return sum_[i]; }

  // Returns row i of the product with x.
  template <typename Vector>
  Vector Row(int64_t i, const std::vector<Vector>& x) const {
    Vector product = diagonal_[i] * x[i];
    for (uint32_t k = graph_.offsets[i]; k < graph_.offsets[i + 1]; ++k) {
      product -= graph_.conductance[k] * x[graph_.neighbors[k]];
    }
    return product;
  }

 private:
  const ConductanceGraph& graph_;
  std::vector<float> diagonal_;
  std::vector<float> sum_;
};

}  // namespace

template <int Dim>
std::vector<Eigen::Matrix<float, Dim, 1>> ExtendHarmonically(
    const ConductanceGraph& graph,
    const std::vector<float>& hold,
    const std::vector<Eigen::Matrix<float, Dim, 1>>& target) {
  using Vector = Eigen::Matrix<float, Dim, 1>;
  using Sums = Eigen::Matrix<double, Dim, 1>;
  const int64_t n = graph.NumNodes();
  CHECK_EQ(n, std::ssize(hold));
  CHECK_EQ(n, std::ssize(target));
  const HarmonicSystem system(graph, hold);
  std::vector<Vector> x(n), residual(n), direction(n), product(n);
  const auto preconditioned = [&](int64_t i) -> Vector {
    // A node without edges has a row of zeros.
    return system.Diagonal(i) > 0 ? Vector(residual[i] / system.Diagonal(i)) : Vector::Zero();
  };
  const auto for_each = [&](auto&& body) {
    ParallelForBlocks(n, kBlock, [&](int64_t begin, int64_t end) {
      for (int64_t i = begin; i < end; ++i) body(i);
    });
  };
  for_each([&](int64_t i) { x[i] = hold[i] > 0 ? target[i] : Vector::Zero(); });
  for_each([&](int64_t i) {
    const Vector pull = hold[i] > 0 ? Vector(hold[i] * system.Sum(i) * target[i]) : Vector::Zero();
    residual[i] = pull - system.Row(i, x);
    direction[i] = preconditioned(i);
  });
  const auto energy = [&] {
    return SumOver<Sums>(n, [&](int64_t i) {
      const Vector scaled = residual[i].cwiseProduct(preconditioned(i));
      return Sums(scaled.template cast<double>());
    });
  };
  Sums now = energy();
  const Sums first = now;
  for (int iteration = 0; iteration < kMostIterations; ++iteration) {
    if ((now.array() <= kTolerance * kTolerance * first.array()).all()) break;
    for_each([&](int64_t i) { product[i] = system.Row(i, direction); });
    const Sums curvature = SumOver<Sums>(n, [&](int64_t i) {
      const Vector bent = direction[i].cwiseProduct(product[i]);
      return Sums(bent.template cast<double>());
    });
    Vector step = Vector::Zero(), keep = Vector::Zero();
    for (int c = 0; c < Dim; ++c) {
      if (curvature[c] > 0) step[c] = static_cast<float>(now[c] / curvature[c]);
    }
    for_each([&](int64_t i) {
      x[i] += step.cwiseProduct(direction[i]);
      residual[i] -= step.cwiseProduct(product[i]);
    });
    const Sums next = energy();
    for (int c = 0; c < Dim; ++c) {
      if (now[c] > 0) keep[c] = static_cast<float>(next[c] / now[c]);
    }
    for_each(
        [&](int64_t i) { direction[i] = preconditioned(i) + keep.cwiseProduct(direction[i]); });
    now = next;
  }
  return x;
}

template std::vector<Eigen::Matrix<float, kIdentityDim, 1>> ExtendHarmonically(
    const ConductanceGraph&,
    const std::vector<float>&,
    const std::vector<Eigen::Matrix<float, kIdentityDim, 1>>&);
template std::vector<Eigen::Vector3f> ExtendHarmonically(const ConductanceGraph&,
                                                         const std::vector<float>&,
                                                         const std::vector<Eigen::Vector3f>&);

}  // namespace semfoam
