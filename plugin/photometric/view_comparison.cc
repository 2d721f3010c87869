// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/photometric/view_comparison.h"

#include "foam/train/training_rays.h"

#include <algorithm>
#include <cmath>
#include <memory>

namespace semfoam {
namespace {

constexpr int64_t kFewestPixels = 300;
constexpr int64_t kMostPixels = 4800;

// Returns the number of multiples of `stride`, each plus stride / 2, below `size`.
int GridSize(int size, int stride) { return (size - stride / 2 + stride - 1) / stride; }

}  // namespace

int64_t FewestComparedRays(const TrainingScene& scene) {
  return kFewestPixels * std::ssize(SelectViews(scene, false));
}

std::vector<ComparedView> CompareViews(const TrainingScene& scene,
                                       int64_t num_rays,
                                       const TrainingHooks::RenderPixels& render) {
  std::vector<ComparedView> result;
  for (const int view : SelectViews(scene, false)) {
    ComparedView compared;
    compared.view = view;
    result.push_back(std::move(compared));
  }
  if (result.empty()) return result;
  const int64_t share =
      std::clamp(num_rays / static_cast<int64_t>(result.size()), kFewestPixels, kMostPixels);
  for (ComparedView& compared : result) {
    const int view = compared.view, width = scene.Width(view), height = scene.Height(view);
    const double pixels = static_cast<double>(width) * height;
    compared.stride = std::max(1, static_cast<int>(std::sqrt(pixels / static_cast<double>(share))));
    compared.columns = GridSize(width, compared.stride);
    compared.rows = GridSize(height, compared.stride);
    const size_t count = static_cast<size_t>(compared.columns) * compared.rows;
    std::vector<ViewPixel> grid;
    grid.reserve(count);
    for (size_t i = 0; i < count; ++i) grid.push_back({view, compared.X(i), compared.Y(i)});
    compared.rendered = render(grid);
    const std::unique_ptr<ViewPixels> photo = scene.OpenView(view);
    compared.photo.reserve(count);
    for (const ViewPixel& pixel : grid) {
      const PixelValue value = photo->At(pixel.x, pixel.y);
      compared.photo.push_back(Eigen::Vector3f(value.color[0], value.color[1], value.color[2]) /
                               255.0f);
    }
  }
  return result;
}

}  // namespace semfoam
