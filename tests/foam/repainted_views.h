// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/data/training_views.h"

#include <functional>
#include <utility>

#include "tests/foam/synthetic_views.h"

namespace semfoam {

// The synthetic room with its pixels' colours replaced.
class RepaintedViews final : public TrainingViews {
 public:
  using Repaint = std::function<void(int view, int x, int y, Eigen::Vector3f* color)>;
  explicit RepaintedViews(Repaint repaint, const SyntheticViews& room = {16, 64, 48})
      : room_(room), repaint_(std::move(repaint)) {}

  int NumViews() const override { return room_.NumViews(); }
  int Width(int view) const override { return room_.Width(view); }
  int Height(int view) const override { return room_.Height(view); }
  bool IsHeldOut(int view) const override { return room_.IsHeldOut(view); }
  Eigen::Vector3d Origin(int view) const override { return room_.Origin(view); }
  bool Ray(int view, int x, int y, TrainingRay* ray) const override {
    if (!room_.Ray(view, x, y, ray)) return false;
    repaint_(view, x, y, &ray->color);
    return true;
  }
  const SyntheticViews& room() const { return room_; }

 private:
  const SyntheticViews room_;
  Repaint repaint_;
};

}  // namespace semfoam
