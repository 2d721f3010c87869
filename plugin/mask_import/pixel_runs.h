// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/photo/photo.h"

#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <vector>

namespace semfoam {

// Pixels y * width + x of a picture from `begin` to before `end`.
struct PixelRun {
  int64_t begin = 0;
  int64_t end = 0;

  bool operator==(const PixelRun&) const = default;
};

// A region of a picture: ascending, disjoint runs. They take little memory where bitmaps of every
// region would not fit.
using PixelRuns = std::vector<PixelRun>;

// Returns the number of pixels.
int64_t AreaOf(const PixelRuns& runs);

// Appends pixels that follow those that `runs` has, joined to the last run where they touch it.
void AppendRun(PixelRun run, PixelRuns* runs);

// Returns the pixels that are in at least one of these runs, in any order and overlapping.
PixelRuns UnionOf(PixelRuns runs);

// Returns the runs of a picture's values by value, without that of 0. `rows` calls its argument for
// each row from the top one on, with the row's `width` values.
using RowReceiver = std::function<void(int y, std::span<const uint32_t> values)>;
std::map<uint32_t, PixelRuns> RunsByValue(const std::function<void(const RowReceiver&)>& rows);

// A polygon in pixels; the corner of the picture is (0, 0).
struct PolygonPoint {
  double x = 0;
  double y = 0;
};
using Polygon = std::vector<PolygonPoint>;

// Returns the pixels whose centres, (x + 0.5, y + 0.5), are inside of at least one of the polygons,
// by the even-odd rule for each. Parts outside of the picture are cut off. Coordinates must be
// finite.
PixelRuns FillPolygons(const std::vector<Polygon>& polygons, const PhotoSize& size);

}  // namespace semfoam
