// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/photometric/light_fit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <utility>

#include <ceres/ceres.h>
#include <ceres/normal_prior.h>
#include <glog/logging.h>

namespace semfoam {
namespace {

constexpr double kCore = 2;  // of the noise, in scales
constexpr int kChannels = 3;
constexpr int kMostRounds = 20;    // of solving and of estimating the noise, in turn
constexpr double kSettled = 1e-4;  // relative change of the noise at which they end
constexpr double kFirstScale = 0.1;
// Gains and slopes of photos with no or hardly any samples stay near 0; and of all gains that fit
// equally well (a factor can be moved from photos to points), those with the mean 0 are found.
constexpr double kPriorWeight = 0.02;
// Photos that share points with many others make a matrix that is hardly sparse, whose factors take
// minutes for a thousand photos. With more than so many, its equations are solved by conjugate
// gradients, to this share of the right-hand side.
constexpr size_t kMostViewsToFactor = 400;
constexpr double kLinearTolerance = 1e-3;

// A photo's gain as one for all channels, and what red and green have beyond that; blue has less
// what they have more. So the grey model is the colour model with two numbers held.
using Gain = std::array<double, 3>;

Eigen::Vector3d ChannelGains(const double* gain) {
  return {gain[0] + gain[1], gain[0] + gain[2], gain[0] - gain[1] - gain[2]};
}

// y - point - gain - falloff - plane: linear, so its derivatives are constants.
class LightResidual final : public ceres::SizedCostFunction<3, 3, 3, 2, 6> {
 public:
  LightResidual(const LightSample& sample, const Eigen::Vector2d& center)
      : log_light_(sample.log_light),
        squared_radius_(sample.squared_radius),
        place_(sample.place - center) {}

  bool Evaluate(double const* const* parameters,
                double* residuals,
                double** jacobians) const override {
    const double* point = parameters[0];
    const Eigen::Vector3d gain = ChannelGains(parameters[1]);
    const double r2 = squared_radius_;
    const double falloff = r2 * (parameters[2][0] + r2 * parameters[2][1]);
    const double* plane = parameters[3];
    for (int c = 0; c < kChannels; ++c) {
      residuals[c] = log_light_[c] - point[c] - gain[c] - falloff - plane[2 * c] * place_.x() -
                     plane[2 * c + 1] * place_.y();
    }
    if (jacobians == nullptr) return true;
    if (jacobians[0] != nullptr) Map<3>(jacobians[0]) = -Eigen::Matrix3d::Identity();
    if (jacobians[1] != nullptr) {
      Map<3>(jacobians[1]) << -1, -1, 0, -1, 0, -1, -1, 1, 1;
    }
    if (jacobians[2] != nullptr) {
      Map<2>(jacobians[2]).rowwise() = Eigen::RowVector2d(-r2, -r2 * r2);
    }
    if (jacobians[3] != nullptr) {
      auto jacobian = Map<6>(jacobians[3]);
      jacobian.setZero();
      for (int c = 0; c < kChannels; ++c) jacobian.block<1, 2>(c, 2 * c) = -place_.transpose();
    }
    return true;
  }

 private:
  template <int kColumns>
  static Eigen::Map<Eigen::Matrix<double, 3, kColumns, Eigen::RowMajor>> Map(double* data) {
    return Eigen::Map<Eigen::Matrix<double, 3, kColumns, Eigen::RowMajor>>(data);
  }

  Eigen::Vector3d log_light_;
  double squared_radius_;
  Eigen::Vector2d place_;
};

// The numbers that Ceres moves.
struct Parameters {
  std::vector<Eigen::Vector3d> points;
  std::vector<Gain> gains;
  std::vector<Eigen::Vector2d> falloff;
  std::vector<std::array<double, 6>> planes;
};

// The problem for Ceres. The noise is Huber's: its density over the three channels is normal within
// kCore scales and falls exponentially beyond. Its deviance is convex, so that there is one fit; a
// loss that forgets outliers altogether has a fit for each way to call one of two observations of
// a point the outlier.
class Solver {
 public:
  // `parameters` and `fit`, of which it takes what is not fitted, outlive it.
  Solver(const std::vector<LightSample>& samples, const LightFit& fit, Parameters* parameters);

  // Moves the parameters towards the greatest likelihood under noise of this scale.
  void Solve(double scale);

 private:
  void AddTerm(bool fitted, double* block, int size);

  ceres::LossFunctionWrapper* loss_;
  ceres::Problem problem_;
  ceres::Solver::Options options_;
};

Solver::Solver(const std::vector<LightSample>& samples, const LightFit& fit, Parameters* parameters)
    : loss_(new ceres::LossFunctionWrapper(nullptr, ceres::TAKE_OWNERSHIP)) {
  for (const LightSample& sample : samples) {
    problem_.AddResidualBlock(new LightResidual(sample, fit.centers[sample.view]),
                              loss_,
                              parameters->points[sample.point].data(),
                              parameters->gains[sample.view].data(),
                              parameters->falloff[sample.lens].data(),
                              parameters->planes[sample.view].data());
  }
  options_.linear_solver_ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  for (Eigen::Vector3d& point : parameters->points) {
    options_.linear_solver_ordering->AddElementToGroup(point.data(), 0);
  }
  for (size_t view = 0; view < parameters->gains.size(); ++view) {
    if (!fit.is_seen[view]) continue;
    double* gain = parameters->gains[view].data();
    AddTerm(fit.model.gains > 0, gain, 3);
    if (fit.model.gains == 1) problem_.SetManifold(gain, new ceres::SubsetManifold(3, {1, 2}));
    AddTerm(fit.model.planes, parameters->planes[view].data(), 6);
  }
  for (Eigen::Vector2d& falloff : parameters->falloff) {
    if (problem_.HasParameterBlock(falloff.data())) AddTerm(fit.model.falloff, falloff.data(), 2);
  }
  if (parameters->gains.size() > kMostViewsToFactor) {
    options_.linear_solver_type = ceres::ITERATIVE_SCHUR;
    options_.preconditioner_type = ceres::SCHUR_JACOBI;
    options_.max_linear_solver_iterations = 200;
    options_.eta = kLinearTolerance;
  } else {
    options_.linear_solver_type = ceres::SPARSE_SCHUR;
  }
  options_.sparse_linear_algebra_library_type = ceres::EIGEN_SPARSE;  // knows no threads
  options_.num_threads = 1;
  options_.max_num_iterations = 4;             // the scale changes anyway
  options_.initial_trust_region_radius = 1e8;  // near to linear
  options_.logging_type = ceres::SILENT;
}

void Solver::AddTerm(bool fitted, double* block, int size) {
  options_.linear_solver_ordering->AddElementToGroup(block, 1);
  if (!fitted) {
    problem_.SetParameterBlockConstant(block);
    return;
  }
  const Eigen::MatrixXd weight = kPriorWeight * Eigen::MatrixXd::Identity(size, size);
  problem_.AddResidualBlock(
      new ceres::NormalPrior(weight, Eigen::VectorXd::Zero(size)), nullptr, block);
}

void Solver::Solve(double scale) {
  loss_->Reset(new ceres::HuberLoss(kCore * scale), ceres::TAKE_OWNERSHIP);
  ceres::Solver::Summary summary;
  // --log_level is about what is done here, not about Ceres' inner life.
  const int verbosity = std::exchange(FLAGS_v, 0);
  ceres::Solve(options_, &problem_, &summary);
  FLAGS_v = verbosity;
  CHECK(summary.IsSolutionUsable()) << summary.FullReport();
}

// Returns the noise's scale of greatest likelihood, the model held: a fixed point.
double NoiseScale(const std::vector<LightSample>& samples, const LightFit& fit, double scale) {
  constexpr int kSteps = 10;
  constexpr double kLeastScale = 1e-5;  // photos without any noise
  for (int step = 0; step < kSteps; ++step) {
    double sum = 0;
    for (const LightSample& sample : samples) {
      const double norm = fit.Residual(sample).norm();
      sum += norm * std::min(norm, kCore * scale);
    }
    scale = std::sqrt(sum / (kChannels * static_cast<double>(samples.size())));
    if (!(scale > kLeastScale)) return kLeastScale;
  }
  return scale;
}

// Rounds to millionths (of a logarithm of light). The solver's sums depend in their last bits on
// where its memory happens to lie, and a probe is to find the same each time.
void Round(Parameters* parameters) {
  constexpr double kStep = 0x1p-20;
  const auto round = [](auto* values) {
    for (double& value : *values) value = kStep * std::round(value / kStep);
  };
  for (Eigen::Vector3d& point : parameters->points) round(&point);
  for (auto& gain : parameters->gains) round(&gain);
  for (auto& plane : parameters->planes) round(&plane);
  for (Eigen::Vector2d& falloff : parameters->falloff) round(&falloff);
}

void TakeOver(const Parameters& parameters, LightFit* fit) {
  fit->points = parameters.points;
  fit->falloff = parameters.falloff;
  for (size_t view = 0; view < parameters.gains.size(); ++view) {
    fit->gains[view] = ChannelGains(parameters.gains[view].data());
    fit->planes[view] = Eigen::Map<const Eigen::Matrix<double, 3, 2, Eigen::RowMajor>>(
        parameters.planes[view].data());
  }
}

// Moves the mean of the gains to the points, which changes no residual: the prior is so weak that
// conjugate gradients leave some of it.
void CenterGains(LightFit* fit) {
  if (fit->model.gains == 0) return;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (size_t view = 0; view < fit->gains.size(); ++view) {
    if (fit->is_seen[view]) mean += fit->gains[view];
  }
  mean /= std::max<double>(1, std::count(fit->is_seen.begin(), fit->is_seen.end(), 1));
  for (size_t view = 0; view < fit->gains.size(); ++view) {
    if (fit->is_seen[view]) fit->gains[view] -= mean;
  }
  for (Eigen::Vector3d& point : fit->points) point += mean;
}

Parameters Begin(const std::vector<LightSample>& samples,
                 const LightFit& fit,
                 const LightFit* simpler) {
  Parameters parameters;
  const size_t num_views = fit.gains.size();
  parameters.gains.assign(num_views, {});
  parameters.planes.assign(num_views, {});
  parameters.falloff = fit.falloff;
  parameters.points = fit.points;
  if (simpler == nullptr) {
    std::vector<int> counts(fit.points.size(), 0);
    for (const LightSample& sample : samples) {
      parameters.points[sample.point] += sample.log_light;
      ++counts[sample.point];
    }
    for (size_t i = 0; i < counts.size(); ++i) parameters.points[i] /= std::max(counts[i], 1);
    return parameters;
  }
  parameters.points = simpler->points;
  parameters.falloff = simpler->falloff;
  for (size_t view = 0; view < num_views; ++view) {
    const Eigen::Vector3d& gain = simpler->gains[view];
    const double grey = gain.mean();
    parameters.gains[view] = {grey, gain[0] - grey, gain[1] - grey};
  }
  return parameters;
}

int NumParameters(const LightFit& fit) {
  const auto num_views = std::count(fit.is_seen.begin(), fit.is_seen.end(), 1);
  int count = 0;
  if (fit.model.gains > 0) count += (fit.model.gains == 2 ? kChannels : 1) * (num_views - 1);
  if (fit.model.falloff) count += 2 * static_cast<int>(fit.falloff.size());
  if (fit.model.planes) count += 2 * kChannels * num_views;
  return count;
}

// Each point takes up one observation: of three observations of a point, two carry information
// about the photos. So the deviance and the number of observations are those of the remaining ones.
double Bic(const std::vector<LightSample>& samples, const LightFit& fit) {
  double deviance = 0;
  for (const LightSample& sample : samples) {
    const double norm = fit.Residual(sample).norm() / fit.scale;
    deviance += norm < kCore ? norm * norm : kCore * (2 * norm - kCore);
    deviance += 2 * kChannels * std::log(fit.scale);
  }
  const auto observations = static_cast<double>(samples.size());
  const double remaining = observations - static_cast<double>(fit.points.size());
  return deviance * remaining / observations + NumParameters(fit) * std::log(kChannels * remaining);
}

// Returns the root of the mean of `square(view)` over the views with samples.
template <typename Square>
double RootMeanSquare(const LightFit& fit, Square square) {
  double sum = 0;
  int count = 0;
  for (size_t view = 0; view < fit.gains.size(); ++view) {
    if (!fit.is_seen[view]) continue;
    sum += square(fit.gains[view]);
    ++count;
  }
  return count == 0 ? 0 : std::sqrt(sum / count);
}

double LogFalloff(const LightFit& fit, const LightSample& sample) {
  const Eigen::Vector2d& falloff = fit.falloff[sample.lens];
  return sample.squared_radius * (falloff[0] + sample.squared_radius * falloff[1]);
}

Eigen::Vector3d Plane(const LightFit& fit, const LightSample& sample) {
  return fit.planes[sample.view] * (sample.place - fit.centers[sample.view]);
}

}  // namespace

Eigen::Vector3d LightFit::Residual(const LightSample& sample) const {
  Eigen::Vector3d residual = sample.log_light - points[sample.point] - gains[sample.view];
  residual.array() -= LogFalloff(*this, sample);
  return residual - Plane(*this, sample);
}

double LightFit::Weight(const Eigen::Vector3d& residual) const {
  const double norm = residual.norm();
  return norm < kCore * scale ? 1 : kCore * scale / norm;
}

double LightFit::GainSpread() const {
  return RootMeanSquare(*this,
                        [](const Eigen::Vector3d& gain) { return gain.squaredNorm() / kChannels; });
}

double LightFit::ColorSpread() const {
  return RootMeanSquare(*this, [](const Eigen::Vector3d& gain) {
    return (gain.array() - gain.mean()).square().mean();
  });
}

double LightFit::CornerLight() const {
  double sum = 0;
  for (const Eigen::Vector2d& f : falloff) sum += std::exp(f.sum());
  return sum / static_cast<double>(falloff.size());
}

double LightFit::FalloffSpread(const std::vector<LightSample>& samples) const {
  double sum = 0;
  double squares = 0;
  for (const LightSample& sample : samples) {
    const double value = LogFalloff(*this, sample);
    sum += value;
    squares += value * value;
  }
  const auto count = static_cast<double>(samples.size());
  return std::sqrt(std::max(0.0, squares / count - sum * sum / (count * count)));
}

double LightFit::PlaneSpread(const std::vector<LightSample>& samples) const {
  double squares = 0;
  for (const LightSample& sample : samples) squares += Plane(*this, sample).squaredNorm();
  return std::sqrt(squares / (kChannels * static_cast<double>(samples.size())));
}

std::vector<PhotoLight> LightFit::Lights(const std::vector<int>& lenses,
                                         const std::vector<LightSample>& others) const {
  constexpr int kSteps = 10;
  const size_t num_views = gains.size();
  LightFit all = *this;
  if (model.gains > 0) {
    for (int step = 0; step < kSteps; ++step) {
      std::vector<Eigen::Vector3d> sums(num_views, Eigen::Vector3d::Zero());
      std::vector<double> weights(num_views, 0);
      for (const LightSample& sample : others) {
        const Eigen::Vector3d residual = all.Residual(sample);
        const double weight = all.Weight(residual);
        weights[sample.view] += weight;
        sums[sample.view] += weight * residual;
      }
      for (size_t view = 0; view < num_views; ++view) {
        if (weights[view] == 0) continue;
        const Eigen::Vector3d change = sums[view] / weights[view];
        all.gains[view] += model.gains == 2 ? change : Eigen::Vector3d::Constant(change.mean());
      }
    }
  }
  std::vector<PhotoLight> lights(num_views);
  for (size_t view = 0; view < num_views; ++view) {
    lights[view].gain = all.gains[view].array().exp();
    lights[view].falloff = falloff[lenses[view]];
  }
  return lights;
}

LightFit FitLight(const LightSamples& samples, const LightModel& model, const LightFit* simpler) {
  LightFit fit;
  fit.model = model;
  fit.points.assign(samples.num_points, Eigen::Vector3d::Zero());
  fit.gains.assign(samples.num_views, Eigen::Vector3d::Zero());
  fit.planes.assign(samples.num_views, Eigen::Matrix<double, 3, 2>::Zero());
  fit.centers.assign(samples.num_views, Eigen::Vector2d::Zero());
  fit.is_seen.assign(samples.num_views, 0);
  fit.falloff.assign(samples.num_lenses, Eigen::Vector2d::Zero());
  std::vector<int> counts(samples.num_views, 0);
  for (const LightSample& sample : samples.all) {
    fit.is_seen[sample.view] = 1;
    fit.centers[sample.view] += sample.place;
    ++counts[sample.view];
  }
  for (int view = 0; view < samples.num_views; ++view)
    fit.centers[view] /= std::max(counts[view], 1);

  Parameters parameters = Begin(samples.all, fit, simpler);
  TakeOver(parameters, &fit);
  fit.scale = NoiseScale(samples.all, fit, simpler != nullptr ? simpler->scale : kFirstScale);
  Solver solver(samples.all, fit, &parameters);
  for (int round = 0; round < kMostRounds; ++round) {
    const double old_scale = fit.scale;
    solver.Solve(fit.scale);
    Round(&parameters);
    TakeOver(parameters, &fit);
    fit.scale = NoiseScale(samples.all, fit, fit.scale);
    if (std::abs(fit.scale - old_scale) < kSettled * fit.scale) break;
  }
  if (fit.gains.size() > kMostViewsToFactor) CenterGains(&fit);
  fit.bic = Bic(samples.all, fit);
  return fit;
}

}  // namespace semfoam
