// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/photometric/track_adjustment.h"

#include "foam/util/median.h"
#include "foam/util/parallel.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include <Eigen/Cholesky>
#include <ceres/ceres.h>
#include <ceres/rotation.h>
#include <glog/logging.h>

namespace semfoam {
namespace {

constexpr size_t kFewestObservations = 3;
// The scale of the noise in pixels is no less.
constexpr double kLeastScale = 0.1;
// Of solutions, each with the scales that the one before has left.
constexpr int kRounds = 3;
// Sizes that the priors expect in the first, in radians and units of the normalised frame.
constexpr double kFirstMotionPrior = 0.02;
constexpr double kFirstPointPrior = 1;
// The sizes are no less, in radians and units of the normalised frame.
constexpr double kLeastMotion = 1e-6;
constexpr int kIterations = 12;
// Up to here, Cholesky's factors of the cameras' matrix are cheap.
constexpr int kMostViewsToFactor = 400;
constexpr int kTriangulationSteps = 10;
constexpr double kErrorCap = 4;

using Point = AdjustableTracks::Point;
using Observation = AdjustableTracks::Observation;

// Pixels between an observation and its point, seen from the moved camera.
struct ObservationError {
  const PixelFrame frame;
  const CameraPlacement placement;

  template <typename T>
  bool operator()(const T* motion, const T* position, T* residual) const {
    const T back[3] = {-motion[0], -motion[1], -motion[2]};
    T from_center[3], turned[3];
    for (int a = 0; a < 3; ++a) {
      from_center[a] = position[a] - motion[3 + a] - placement.center[a];
    }
    ceres::AngleAxisRotatePoint(back, from_center, turned);
    const Eigen::Matrix<T, 3, 1> seen =
        placement.world_from_cam.transpose().cast<T>() * Eigen::Matrix<T, 3, 1>(turned);
    if (!(frame.direction.cast<T>().dot(seen) > T(0))) return false;
    Eigen::Map<Eigen::Matrix<T, 2, 1>> offset(residual);
    offset = frame.OffsetOf(seen);
    return true;
  }
};

// Motions over the size that is expected of them, times the scale of the errors' noise.
struct MotionPrior {
  const double* turn_weight;
  const double* shift_weight;

  template <typename T>
  bool operator()(const T* motion, T* residual) const {
    for (int a = 0; a < 3; ++a) {
      residual[a] = *turn_weight * motion[a];
      residual[3 + a] = *shift_weight * motion[3 + a];
    }
    return true;
  }
};

// Movement of a point over the size that is expected, times the scale of the errors' noise.
struct PointPrior {
  const double* weight;
  const Eigen::Vector3d given;

  template <typename T>
  bool operator()(const T* position, T* residual) const {
    for (int a = 0; a < 3; ++a) residual[a] = *weight * (position[a] - given[a]);
    return true;
  }
};

Eigen::Vector3d SeenFrom(const CameraPlacement& placement, const Eigen::Vector3d& position) {
  return placement.world_from_cam.transpose() * (position - placement.center);
}

bool IsBefore(const Observation& seen,
              const CameraPlacement& placement,
              const Eigen::Vector3d& position) {
  return seen.frame.direction.dot(SeenFrom(placement, position)) > 0;
}

double MedianOrZero(std::vector<double> values) {
  return values.empty() ? 0 : Median(std::move(values));
}

// Appends the errors of a point in pixels.
void AppendErrors(const Point& point,
                  const Eigen::Vector3d& position,
                  const std::vector<CameraPlacement>& placements,
                  std::vector<double>* errors) {
  for (const Observation& seen : point.observations) {
    const Eigen::Vector3d x = SeenFrom(placements[seen.view], position);
    errors->push_back(seen.frame.direction.dot(x) > 0 ? seen.frame.OffsetOf(x).norm() : HUGE_VAL);
  }
}

// Returns the position of least errors (Gauss-Newton under Cauchy's noise of this scale); the
// point's own where it cannot be improved.
Eigen::Vector3d Triangulated(const Point& point,
                             const std::vector<CameraPlacement>& placements,
                             double scale) {
  Eigen::Vector3d position = point.position;
  for (int step = 0; step < kTriangulationSteps; ++step) {
    Eigen::Matrix3d normal = 1e-6 * Eigen::Matrix3d::Identity();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    for (const Observation& seen : point.observations) {
      const CameraPlacement& placement = placements[seen.view];
      if (!IsBefore(seen, placement, position)) return point.position;
      const Eigen::Vector2d error = seen.frame.OffsetOf(SeenFrom(placement, position));
      // A point moves as much as the camera does the other way.
      const Eigen::Matrix<double, 2, 3> slope =
          -OffsetByMotion(seen.frame, placement, position).rightCols<3>();
      const double weight = 1 / (1 + error.squaredNorm() / (scale * scale));
      normal += weight * slope.transpose() * slope;
      right -= weight * slope.transpose() * error;
    }
    position += normal.ldlt().solve(right);
    if (!position.allFinite()) return point.position;
  }
  return position;
}

std::vector<CameraPlacement> PlacementsOf(const std::vector<TrackView>& views) {
  std::vector<CameraPlacement> placements;
  placements.reserve(views.size());
  for (const TrackView& view : views) placements.push_back(view.placement);
  return placements;
}

// Returns the errors of the points [first, first + step, ...) after they are triangulated anew.
std::vector<double> ErrorsOf(const AdjustableTracks& tracks,
                             const std::vector<CameraPlacement>& placements,
                             double scale,
                             int first,
                             int step) {
  std::vector<double> errors;
  for (size_t i = first; i < tracks.points.size(); i += step) {
    const Point& point = tracks.points[i];
    AppendErrors(point, Triangulated(point, placements, scale), placements, &errors);
  }
  return errors;
}

}  // namespace

AdjustableTracks MakeAdjustable(const std::vector<Track>& tracks,
                                const Similarity& world_from_normalized,
                                const std::vector<TrackView>& views) {
  std::vector<Point> points(tracks.size());
  // Rays of distorted lenses take Newton's method.
  ParallelForBlocks(static_cast<int64_t>(tracks.size()), 64, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) {
      Point& point = points[i];
      point.position = world_from_normalized.Invert(tracks[i].position);
      for (const PixelObservation& seen : tracks[i].observations) {
        const TrackView& view = views[seen.view];
        if (view.held_out) continue;
        const auto frame = PixelFrameAt(view.camera, seen.pixel);
        if (!frame) continue;
        const Observation observation = {seen.view, seen.pixel, *frame};
        if (!IsBefore(observation, view.placement, point.position)) continue;
        point.observations.push_back(observation);
      }
    }
  });
  std::erase_if(points,
                [](const Point& point) { return point.observations.size() < kFewestObservations; });
  return {std::move(points)};
}

std::vector<CameraPlacement> AdjustToTracks(const AdjustableTracks& tracks,
                                            const std::vector<TrackView>& views,
                                            int first,
                                            int step) {
  std::vector<CameraPlacement> placements = PlacementsOf(views);
  std::vector<CameraMotion> motions(views.size(), CameraMotion::Zero());
  std::vector<Point> points;
  for (size_t i = first; i < tracks.points.size(); i += step) points.push_back(tracks.points[i]);
  const std::vector<Point> given = points;

  ceres::Problem problem;
  auto* loss = new ceres::LossFunctionWrapper(nullptr, ceres::TAKE_OWNERSHIP);
  auto* point_loss = new ceres::LossFunctionWrapper(nullptr, ceres::TAKE_OWNERSHIP);
  // Of the priors.
  double point_weight = 0, turn_weight = 0, shift_weight = 0;
  ceres::Solver::Options options;
  options.linear_solver_ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  for (Point& point : points) {
    double* const position = point.position.data();
    for (const Observation& seen : point.observations) {
      using Error = ceres::AutoDiffCostFunction<ObservationError, 2, 6, 3>;
      problem.AddResidualBlock(
          new Error(new ObservationError{seen.frame, views[seen.view].placement}),
          loss,
          motions[seen.view].data(),
          position);
    }
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<PointPrior, 3, 3>(
                                 new PointPrior{&point_weight, point.position}),
                             point_loss,
                             position);
    options.linear_solver_ordering->AddElementToGroup(position, 0);
  }
  int num_moved = 0;
  for (CameraMotion& motion : motions) {
    if (!problem.HasParameterBlock(motion.data())) continue;
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<MotionPrior, 6, 6>(
                                 new MotionPrior{&turn_weight, &shift_weight}),
                             nullptr,
                             motion.data());
    options.linear_solver_ordering->AddElementToGroup(motion.data(), 1);
    ++num_moved;
  }
  if (num_moved == 0) return placements;
  options.linear_solver_type = ceres::SPARSE_SCHUR;
  if (std::ssize(views) > kMostViewsToFactor) {
    options.linear_solver_type = ceres::ITERATIVE_SCHUR;
    options.preconditioner_type = ceres::SCHUR_JACOBI;
    options.max_linear_solver_iterations = 100;
  }
  options.sparse_linear_algebra_library_type = ceres::EIGEN_SPARSE;  // knows no threads
  options.num_threads = 1;
  options.max_num_iterations = kIterations;
  options.logging_type = ceres::SILENT;
  for (int round = 0; round < kRounds; ++round) {
    std::vector<CameraPlacement> moved = placements;
    double turns = 0, shifts = 0;
    for (size_t view = 0; view < views.size(); ++view) {
      moved[view] = Moved(placements[view], motions[view]);
      turns += motions[view].head<3>().squaredNorm();
      shifts += motions[view].tail<3>().squaredNorm();
    }
    std::vector<double> errors, movements;
    for (size_t i = 0; i < points.size(); ++i) {
      AppendErrors(points[i], points[i].position, moved, &errors);
      movements.push_back((points[i].position - given[i].position).norm());
    }
    const double scale = std::max(MedianOrZero(std::move(errors)), kLeastScale);
    // All errors have the unit of pixels, and the noise this scale; so do those of the priors.
    const auto weight_of = [&](double first_size, double size) {
      return scale / (round == 0 ? first_size : std::max(size, kLeastMotion));
    };
    point_weight = weight_of(kFirstPointPrior, MedianOrZero(std::move(movements)));
    turn_weight = weight_of(kFirstMotionPrior, std::sqrt(turns / (3 * num_moved)));
    shift_weight = weight_of(kFirstMotionPrior, std::sqrt(shifts / (3 * num_moved)));
    loss->Reset(new ceres::CauchyLoss(scale), ceres::TAKE_OWNERSHIP);
    point_loss->Reset(new ceres::CauchyLoss(scale), ceres::TAKE_OWNERSHIP);
    ceres::Solver::Summary summary;
    // --log_level is about what is done here, not about Ceres' inner life.
    const int verbosity = std::exchange(FLAGS_v, 0);
    ceres::Solve(options, &problem, &summary);
    FLAGS_v = verbosity;
    CHECK(summary.IsSolutionUsable()) << summary.FullReport();
  }
  for (size_t view = 0; view < views.size(); ++view) {
    placements[view] = Moved(placements[view], motions[view]);
  }
  return placements;
}

double TrackGain(const AdjustableTracks& tracks,
                 const std::vector<CameraPlacement>& before,
                 const std::vector<CameraPlacement>& after,
                 int first,
                 int step) {
  std::vector<double> given;
  for (size_t i = first; i < tracks.points.size(); i += step) {
    AppendErrors(tracks.points[i], tracks.points[i].position, before, &given);
  }
  const double scale = std::max(MedianOrZero(std::move(given)), kLeastScale);
  const std::vector<double> errors_before = ErrorsOf(tracks, before, scale, first, step);
  const double cap = kErrorCap * MedianOrZero(errors_before);
  const auto squared = [cap](const std::vector<double>& errors) {
    double sum = 0;
    for (const double error : errors) sum += std::pow(std::min(error, cap), 2);
    return sum;
  };
  const double sum = squared(errors_before);
  return sum > 0 ? 1 - squared(ErrorsOf(tracks, after, scale, first, step)) / sum : 0;
}

}  // namespace semfoam
