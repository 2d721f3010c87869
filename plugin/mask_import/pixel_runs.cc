// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask_import/pixel_runs.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <glog/logging.h>

namespace semfoam {
namespace {

// An edge of a polygon that crosses the centre lines of the rows [first_row, end_row).
struct Edge {
  int first_row = 0;
  int end_row = 0;
  PolygonPoint from;
  // Change of x from row to row.
  double slope = 0;

  double At(int row) const { return from.x + (row + 0.5 - from.y) * slope; }
};

// The first pixel of a row, or of a column, whose centre is not before `x`, within [0, size].
int FirstCentreFrom(double x, int size) {
  return static_cast<int>(std::clamp(std::ceil(x - 0.5), 0.0, static_cast<double>(size)));
}

std::vector<Edge> EdgesOf(const Polygon& polygon, int height) {
  std::vector<Edge> edges;
  for (size_t i = 0; i < polygon.size(); ++i) {
    PolygonPoint a = polygon[i];
    PolygonPoint b = polygon[(i + 1) % polygon.size()];
    CHECK(std::isfinite(a.x) && std::isfinite(a.y));
    if (a.y > b.y) std::swap(a, b);
    const int first = FirstCentreFrom(a.y, height);
    const int end = FirstCentreFrom(b.y, height);
    if (first < end) edges.push_back({first, end, a, (b.x - a.x) / (b.y - a.y)});
  }
  std::sort(edges.begin(), edges.end(), [](const Edge& a, const Edge& b) {
    return a.first_row < b.first_row;
  });
  return edges;
}

PixelRuns FillPolygon(const Polygon& polygon, const PhotoSize& size) {
  const std::vector<Edge> edges = EdgesOf(polygon, size.height);
  PixelRuns runs;
  std::vector<Edge> active;
  std::vector<double> crossings;
  size_t next = 0;
  for (int y = edges.empty() ? size.height : edges.front().first_row;
       y < size.height && (next < edges.size() || !active.empty());
       ++y) {
    std::erase_if(active, [y](const Edge& edge) { return edge.end_row <= y; });
    while (next < edges.size() && edges[next].first_row <= y) active.push_back(edges[next++]);
    crossings.clear();
    for (const Edge& edge : active) crossings.push_back(edge.At(y));
    std::sort(crossings.begin(), crossings.end());
    for (size_t i = 0; i + 1 < crossings.size(); i += 2) {
      const int64_t row = static_cast<int64_t>(y) * size.width;
      AppendRun({row + FirstCentreFrom(crossings[i], size.width),
                 row + FirstCentreFrom(crossings[i + 1], size.width)},
                &runs);
    }
  }
  return runs;
}

}  // namespace

int64_t AreaOf(const PixelRuns& runs) {
  int64_t area = 0;
  for (const PixelRun& run : runs) area += run.end - run.begin;
  return area;
}

void AppendRun(PixelRun run, PixelRuns* runs) {
  if (run.begin >= run.end) return;
  if (!runs->empty() && runs->back().end >= run.begin) {
    runs->back().end = std::max(runs->back().end, run.end);
  } else {
    runs->push_back(run);
  }
}

PixelRuns UnionOf(PixelRuns runs) {
  std::sort(runs.begin(), runs.end(), [](const PixelRun& a, const PixelRun& b) {
    return a.begin < b.begin;
  });
  PixelRuns joined;
  for (const PixelRun& run : runs) AppendRun(run, &joined);
  return joined;
}

std::map<uint32_t, PixelRuns> RunsByValue(const std::function<void(const RowReceiver&)>& rows) {
  std::map<uint32_t, PixelRuns> by_value;
  rows([&](int y, std::span<const uint32_t> values) {
    const auto width = static_cast<int64_t>(values.size());
    for (int64_t x = 0; x < width;) {
      const int64_t begin = x;
      const uint32_t value = values[x];
      while (x < width && values[x] == value) ++x;
      if (value != 0) AppendRun({y * width + begin, y * width + x}, &by_value[value]);
    }
  });
  return by_value;
}

PixelRuns FillPolygons(const std::vector<Polygon>& polygons, const PhotoSize& size) {
  if (polygons.size() == 1) return FillPolygon(polygons[0], size);
  PixelRuns all;
  for (const Polygon& polygon : polygons) {
    const PixelRuns runs = FillPolygon(polygon, size);
    all.insert(all.end(), runs.begin(), runs.end());
  }
  return UnionOf(std::move(all));
}

}  // namespace semfoam
