// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/data/pixel_range.h"
#include "foam/data/training_views.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace semfoam {

// The parts of the photos that a run draws its rays from, in squares of kSide x kSide pixels,
// narrower ones at the right and the lower border. The default is all pixels of any views.
class DrawnSquares {
 public:
  static constexpr int kSide = 8;

  DrawnSquares() = default;

  // Starts with no square of these views.
  explicit DrawnSquares(const TrainingViews& views) { Lay(views); }

  // Returns the number of squares in x, and in y.
  static int Across(const TrainingViews& views, int view) {
    return (views.Width(view) + kSide - 1) / kSide;
  }
  static int Down(const TrainingViews& views, int view) {
    return (views.Height(view) + kSide - 1) / kSide;
  }

  bool IsAll() const { return is_drawn_.empty(); }

  // Returns whether rays are drawn from the square with this pixel.
  bool Contains(const ViewPixel& pixel) const {
    return IsAll() || is_drawn_[At(pixel.view, pixel.x / kSide, pixel.y / kSide)] != 0;
  }

  // Returns whether rays are drawn from any square of this view.
  bool ContainsAnyOf(int view) const {
    return IsAll() || std::any_of(is_drawn_.begin() + begins_[view],
                                  is_drawn_.begin() + begins_[view + 1],
                                  [](uint8_t is_drawn) { return is_drawn != 0; });
  }

  // Adds the square (x, y) of a view, counted in squares.
  void Add(int view, int x, int y) { is_drawn_[At(view, x, y)] = 1; }

  // Describes the squares (checkpoint_state.h) of a run that draws from some of them.
  template <typename Archive>
  void Serialize(const TrainingViews& views, Archive* archive) {
    Lay(views);
    archive->Array("drawn_squares", &is_drawn_, begins_.back());
  }

 private:
  size_t At(int view, int x, int y) const {
    return begins_[view] + static_cast<size_t>(y) * across_[view] + x;
  }

  void Lay(const TrainingViews& views) {
    begins_.assign(1, 0);
    across_.clear();
    for (int view = 0; view < views.NumViews(); ++view) {
      across_.push_back(Across(views, view));
      begins_.push_back(begins_.back() + static_cast<size_t>(across_[view]) * Down(views, view));
    }
    is_drawn_.resize(begins_.back());
  }

  // [views + 1] The first square of each view in is_drawn_.
  std::vector<size_t> begins_;
  // [views]
  std::vector<int> across_;
  // 1: rays are drawn there. Empty: everywhere.
  std::vector<uint8_t> is_drawn_;
};

}  // namespace semfoam
