// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/view/pixel_reduction.h"

#include "foam/util/parallel.h"

#include <algorithm>
#include <utility>
#include <vector>

#include <glog/logging.h>

namespace semfoam {
namespace {

// The class with the largest sum of confidences, and that sum.
std::pair<ClassIndex, float> LargestClass(std::vector<std::pair<ClassIndex, float>>* classes) {
  std::sort(classes->begin(), classes->end());
  std::pair<ClassIndex, float> largest = {kUnlabelled, -1.f};
  for (size_t begin = 0, end = 0; begin < classes->size(); begin = end) {
    float sum = 0;
    for (; end < classes->size() && (*classes)[end].first == (*classes)[begin].first; ++end) {
      sum += (*classes)[end].second;
    }
    if (sum > largest.second) largest = {(*classes)[begin].first, sum};
  }
  return largest;
}

}  // namespace

void AverageRays(const RenderedView& fine, int samples, RenderedView* centers) {
  RenderedView& view = *centers;
  CHECK_GE(samples, 1);
  CHECK_EQ(fine.width, samples * view.width);
  CHECK_EQ(fine.height, samples * view.height);
  const int num_rays = samples * samples;
  ParallelForBlocks(view.height, 16, [&](int64_t begin, int64_t end) {
    std::vector<std::pair<ClassIndex, float>> classes;
    for (int64_t y = begin; y < end; ++y) {
      for (int x = 0; x < view.width; ++x) {
        classes.clear();
        Eigen::Vector3f color = Eigen::Vector3f::Zero();
        float opacity = 0;
        for (int j = 0; j < samples; ++j) {
          for (int i = 0; i < samples; ++i) {
            const size_t ray = size_t(y * samples + j) * fine.width + x * samples + i;
            color += fine.color[ray];
            opacity += fine.opacity[ray];
            if (fine.class_index[ray] != kUnlabelled) {
              classes.emplace_back(fine.class_index[ray], fine.confidence[ray]);
            }
          }
        }
        const size_t pixel = size_t(y) * view.width + x;
        view.color[pixel] = color / static_cast<float>(num_rays);
        view.opacity[pixel] = opacity / static_cast<float>(num_rays);
        view.class_index[pixel] = kUnlabelled;
        view.confidence[pixel] = 0;
        if (2 * std::ssize(classes) >= num_rays) {
          const auto [class_index, sum] = LargestClass(&classes);
          view.class_index[pixel] = class_index;
          view.confidence[pixel] = sum / static_cast<float>(classes.size());
        }
      }
    }
  });
}

}  // namespace semfoam
