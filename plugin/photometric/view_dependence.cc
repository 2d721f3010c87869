// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/photometric/view_dependence.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Cholesky>

namespace semfoam {
namespace {

constexpr int kMaxDegree = 3;
constexpr int kChannels = 3;
constexpr size_t kFewestViews = 3;
constexpr size_t kMostViews = 24;  // of one point; the cost grows with the third power
constexpr size_t kMostSamples = 8000;
constexpr size_t kFewestSamples = 100;

double Legendre(int degree, double x) {
  switch (degree) {
    case 1:
      return x;
    case 2:
      return 1.5 * x * x - 0.5;
    default:
      return (2.5 * x * x - 1.5) * x;
  }
}

// A point, as its photos show it.
struct PointViews {
  Eigen::MatrixX3d residuals;
  Eigen::VectorXd noise;  // 1 / weight
  std::array<Eigen::MatrixXd, kMaxDegree> kernels;
};

// Logarithms of the noise's scale and of rho_1, rho_2 ...
using Scales = std::vector<double>;

// -2 ln of the restricted likelihood, but for a constant.
double Deviance(const std::vector<PointViews>& points, const Scales& scales) {
  double deviance = 0;
  for (const PointViews& point : points) {
    Eigen::MatrixXd covariance = (std::exp(2 * scales[0]) * point.noise).asDiagonal();
    for (size_t degree = 1; degree < scales.size(); ++degree) {
      covariance += std::exp(2 * scales[degree]) * point.kernels[degree - 1];
    }
    const Eigen::LLT<Eigen::MatrixXd> root(covariance);
    const Eigen::VectorXd ones = root.matrixL().solve(Eigen::VectorXd::Ones(point.noise.size()));
    const Eigen::MatrixX3d residuals = root.matrixL().solve(point.residuals);
    const double precision = ones.squaredNorm();
    const double log_determinant = 2 * root.matrixLLT().diagonal().array().log().sum();
    deviance += kChannels * (log_determinant + std::log(precision)) + residuals.squaredNorm() -
                (ones.transpose() * residuals).squaredNorm() / precision;
  }
  return deviance;
}

// Minimises over the scales, one after the other, in steps that shrink.
double Minimize(const std::vector<PointViews>& points, Scales* scales) {
  constexpr double kFirstStep = 1;
  constexpr double kLastStep = 0.05;
  constexpr double kLeast = -9;  // 1e-4: nothing
  constexpr double kMost = 2;
  double best = Deviance(points, *scales);
  for (double step = kFirstStep; step > kLastStep;) {
    bool moved = false;
    for (double& scale : *scales) {
      for (const double sign : {1.0, -1.0}) {
        const double old = scale;
        scale = std::clamp(old + sign * step, kLeast, kMost);
        const double deviance = Deviance(points, *scales);
        if (deviance < best) {
          best = deviance;
          moved = true;
          break;
        }
        scale = old;
      }
    }
    if (!moved) step /= 2;
  }
  return best;
}

std::vector<PointViews> CollectPoints(const std::vector<LightSample>& samples,
                                      const LightFit& fit,
                                      size_t* num_samples) {
  std::vector<PointViews> points;
  *num_samples = 0;
  for (size_t begin = 0, end = 0; begin < samples.size() && *num_samples < kMostSamples;
       begin = end) {
    while (end < samples.size() && samples[end].point == samples[begin].point) ++end;
    const size_t count = std::min(end - begin, kMostViews);
    if (count < kFewestViews) continue;
    const auto n = static_cast<Eigen::Index>(count);
    PointViews point{Eigen::MatrixX3d(n, 3), Eigen::VectorXd(n), {}};
    Eigen::MatrixX3d directions(n, 3);
    for (Eigen::Index i = 0; i < n; ++i) {
      const LightSample& sample = samples[begin + i];
      const Eigen::Vector3d residual = fit.Residual(sample);
      point.residuals.row(i) = residual.transpose();
      point.noise[i] = 1 / fit.Weight(residual);
      directions.row(i) = sample.direction.transpose();
    }
    const Eigen::MatrixXd cosines = directions * directions.transpose();
    for (int degree = 1; degree <= kMaxDegree; ++degree) {
      point.kernels[degree - 1] =
          cosines.unaryExpr([degree](double cosine) { return Legendre(degree, cosine); });
    }
    points.push_back(std::move(point));
    *num_samples += count;
  }
  return points;
}

// Returns the part of a kernel's variance that shows between a point's photos rather than in its
// mean.
double RenderedVariance(const std::vector<PointViews>& points, int degree) {
  double sum = 0;
  for (const PointViews& point : points) {
    const Eigen::MatrixXd& kernel = point.kernels[degree - 1];
    sum += kernel.diagonal().mean() - kernel.mean();
  }
  return sum / static_cast<double>(points.size());
}

}  // namespace

std::vector<ViewDependence> FitViewDependence(const std::vector<LightSample>& samples,
                                              const LightFit& fit) {
  size_t num_samples = 0;
  const std::vector<PointViews> points = CollectPoints(samples, fit, &num_samples);
  if (num_samples < kFewestSamples) return {};
  const double penalty = std::log(kChannels * static_cast<double>(num_samples - points.size()));
  std::vector<ViewDependence> result;
  Scales scales = {std::log(fit.scale)};
  double deviance = Minimize(points, &scales);
  for (int degree = 1; degree <= kMaxDegree; ++degree) {
    scales.push_back(std::log(fit.scale));
    const double with_degree = Minimize(points, &scales);
    const double variance = std::exp(2 * scales.back()) * RenderedVariance(points, degree);
    result.push_back({degree, std::sqrt(variance), deviance - with_degree - penalty});
    deviance = with_degree;
  }
  return result;
}

}  // namespace semfoam
