// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/data/training_views.h"
#include "foam/util/random.h"
#include "foam/view/view_renderer.h"

#include <cmath>
#include <vector>

#include <Eigen/Geometry>

namespace semfoam {

// A room to learn: a red and a blue ball (classes 0 and 1) inside a large chequered sphere (class
// 2), seen by a ring of pinhole cameras. Everything is computed per ray; every fourth view is held
// out. With `gloss`, colours depend on the direction: to a linear function of x, at most this much.
// With `knows_distances`, the rays of every second view know theirs.
class SyntheticViews : public TrainingViews {
 public:
  SyntheticViews(
      int num_views, int width, int height, float gloss = 0, bool knows_distances = false)
      : num_views_(num_views),
        width_(width),
        height_(height),
        gloss_(gloss),
        knows_distances_(knows_distances) {}

  int NumViews() const override { return num_views_; }
  int Width(int) const override { return width_; }
  int Height(int) const override { return height_; }
  bool IsHeldOut(int view) const override { return view % 4 == 0; }

  Eigen::Vector3d Origin(int view) const override {
    const double angle = 6.283185307 * view / num_views_;
    return {std::cos(angle), std::sin(angle), 0.3 + 0.2 * (view % 3)};
  }

  bool Ray(int view, int x, int y, TrainingRay* ray) const override {
    ray->direction = Direction(view, x, y);
    Eigen::Vector3d hit;
    Shade(Origin(view), ray->direction.cast<double>(), &hit, ray);
    ray->color *= 1 + gloss_ * ray->direction.x();
    if (knows_distances_ && view % 2 == 1) {
      ray->distance = static_cast<float>(Distance(view, x, y));
    }
    return true;
  }

  double Distance(int view, int x, int y) const {
    TrainingRay ray;
    Eigen::Vector3d hit;
    Shade(Origin(view), Direction(view, x, y).cast<double>(), &hit, &ray);
    return (hit - Origin(view)).norm();
  }

  Eigen::Vector3f Direction(int view, int x, int y) const {
    const Eigen::Vector3d forward = -Origin(view).normalized();
    const Eigen::Vector3d right = forward.cross(Eigen::Vector3d::UnitZ()).normalized();
    const Eigen::Vector3d down = forward.cross(right);
    const double u = (x + 0.5 - width_ / 2.0) / width_, v = (y + 0.5 - height_ / 2.0) / width_;
    return (forward + 1.2 * u * right + 1.2 * v * down).normalized().cast<float>();
  }

  CameraRays Rays(int view) const {
    CameraRays rays{width_, height_, Origin(view), {}};
    for (int y = 0; y < height_; ++y) {
      for (int x = 0; x < width_; ++x) rays.directions.push_back(Direction(view, x, y));
    }
    return rays;
  }

  // Surface points as structure from motion would give them, with their colours.
  std::vector<SeedPoint> Seeds(int count) const {
    std::vector<SeedPoint> seeds;
    for (int i = 0; i < count; ++i) {
      CounterRandom random(1, 0xa1, i);
      const int view = static_cast<int>(random.Below(num_views_));
      TrainingRay ray;
      Eigen::Vector3d hit;
      // One after the other: the order of arguments is the compiler's.
      const int x = static_cast<int>(random.Below(width_));
      const int y = static_cast<int>(random.Below(height_));
      ray.direction = Direction(view, x, y);
      Shade(Origin(view), ray.direction.cast<double>(), &hit, &ray);
      seeds.push_back({hit.cast<float>(), ray.color});
    }
    return seeds;
  }

 private:
  static void Shade(const Eigen::Vector3d& origin,
                    const Eigen::Vector3d& direction,
                    Eigen::Vector3d* hit,
                    TrainingRay* ray) {
    const Eigen::Vector3d centers[2] = {{0.3, 0, 0}, {-0.3, 0.05, 0.05}};
    double nearest = 1e30;
    for (int k = 0; k < 2; ++k) {
      const Eigen::Vector3d to_center = centers[k] - origin;
      const double along = to_center.dot(direction);
      const double square = 0.2 * 0.2 - (to_center.squaredNorm() - along * along);
      if (square < 0 || along - std::sqrt(square) < 0) continue;
      const double t = along - std::sqrt(square);
      if (t >= nearest) continue;
      nearest = t;
      ray->color = k == 0 ? Eigen::Vector3f(0.9f, 0.1f, 0.1f) : Eigen::Vector3f(0.1f, 0.2f, 0.9f);
      ray->class_index = ClassIndex{k};
    }
    if (nearest > 1e29) {
      const double along = origin.dot(direction);
      nearest = -along + std::sqrt(along * along - origin.squaredNorm() + 9);
      const Eigen::Vector3d x = origin + nearest * direction;
      const bool dark =
          (int(std::floor(x.x())) + int(std::floor(x.y())) + int(std::floor(x.z()))) & 1;
      ray->color = Eigen::Vector3f::Constant(dark ? 0.35f : 0.65f);
      ray->class_index = ClassIndex{2};
    }
    *hit = origin + nearest * direction;
  }

  int num_views_, width_, height_;
  float gloss_;
  bool knows_distances_;
};

}  // namespace semfoam
