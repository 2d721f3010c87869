// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/texture/chart_packing.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <glog/logging.h>

namespace semfoam {
namespace {

constexpr double kStep = 0.97;
// Below this share of the wanted scale charts are hardly more than margins.
constexpr double kLeastShare = 1e-4;

// The upper outline of what is placed: from x on the height is y.
struct SkylinePiece {
  int x, y;
};

// Places the rectangles; returns whether all fit.
bool Place(const std::vector<Eigen::Vector2d>& sizes,
           const std::vector<uint32_t>& order,
           ChartPacking* packing) {
  std::vector<SkylinePiece> skyline = {{0, 0}};
  for (const uint32_t chart : order) {
    const int width =
        static_cast<int>(std::ceil(sizes[chart].x() * packing->scale)) + 2 * kChartMargin;
    const int height =
        static_cast<int>(std::ceil(sizes[chart].y() * packing->scale)) + 2 * kChartMargin;
    if (width > packing->size) return false;
    int best_x = -1, best_y = packing->size;
    for (size_t i = 0; i < skyline.size() && skyline[i].x + width <= packing->size; ++i) {
      int y = 0;
      for (size_t k = i; k < skyline.size() && skyline[k].x < skyline[i].x + width; ++k) {
        y = std::max(y, skyline[k].y);
      }
      if (y + height <= packing->size && y < best_y) {
        best_x = skyline[i].x;
        best_y = y;
      }
    }
    if (best_x < 0) return false;
    packing->offsets[chart] = Eigen::Vector2d(best_x + kChartMargin, best_y + kChartMargin);
    // Replace what lies below it.
    std::vector<SkylinePiece> raised;
    int behind = 0;
    for (const SkylinePiece& piece : skyline) {
      if (piece.x <= best_x + width) behind = piece.y;
      if (piece.x < best_x) raised.push_back(piece);
    }
    raised.push_back({best_x, best_y + height});
    if (best_x + width < packing->size) raised.push_back({best_x + width, behind});
    for (const SkylinePiece& piece : skyline) {
      if (piece.x > best_x + width) raised.push_back(piece);
    }
    skyline = std::move(raised);
  }
  return true;
}

}  // namespace

ChartPacking PackCharts(const std::vector<Eigen::Vector2d>& sizes,
                        double wanted_scale,
                        int most_size) {
  CHECK(!sizes.empty());
  CHECK_GE(most_size, kLeastTextureSize);
  CHECK_GT(wanted_scale, 0);
  std::vector<uint32_t> order(sizes.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) {
    return sizes[a].y() > sizes[b].y();
  });
  ChartPacking packing;
  packing.offsets.assign(sizes.size(), Eigen::Vector2d::Constant(kChartMargin));
  packing.scale = wanted_scale;
  for (int power = kLeastTextureSize; power < most_size; power *= 2) {
    for (packing.size = power; packing.size < std::min(2 * power, most_size);
         packing.size += power / 2) {
      if (Place(sizes, order, &packing)) return packing;
    }
  }
  packing.size = most_size;
  while (!Place(sizes, order, &packing) && packing.scale > kLeastShare * wanted_scale) {
    packing.scale *= kStep;
  }
  return packing;
}

}  // namespace semfoam
