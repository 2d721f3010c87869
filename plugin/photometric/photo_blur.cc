// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/photometric/photo_blur.h"

#include "foam/util/median.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

namespace semfoam {
namespace {

// Added to contrasts, so that plain patches, all noise, are alike.
constexpr double kNoiseContrast = 1e-5;
// The report names so many photos.
constexpr size_t kMostNamed = 8;

// Returns the median of the logarithms but for one of them.
double MedianOfOthers(const std::vector<std::pair<int, double>>& seen, size_t but) {
  std::vector<double> others;
  for (size_t i = 0; i < seen.size(); ++i) {
    if (i != but) others.push_back(seen[i].second);
  }
  return Median(std::move(others));
}

}  // namespace

PhotoBlur FindBlurredPhotos(const TrainingScene& scene) {
  const int num_views = scene.NumViews();
  std::vector<size_t> next_place(num_views, 0);
  std::vector<std::vector<double>> log_ratios(num_views);
  std::vector<std::pair<int, double>> seen;  // views of a track with the logarithms of contrasts
  for (const Track& track : scene.Plan().tracks) {
    seen.clear();
    for (const PixelObservation& observation : track.observations) {
      const int view = observation.view;
      const std::optional<float> contrast = scene.Survey(view).contrasts.at(next_place[view]++);
      if (!contrast || scene.IsHeldOut(view)) continue;
      seen.emplace_back(view, std::log(*contrast + kNoiseContrast));
    }
    if (std::ssize(seen) < kFewestPhotosOfPlace) continue;
    for (size_t i = 0; i < seen.size(); ++i) {
      log_ratios[seen[i].first].push_back(seen[i].second - MedianOfOthers(seen, i));
    }
  }
  PhotoBlur result;
  int num_training = 0;
  for (int view = 0; view < num_views; ++view) {
    num_training += !scene.IsHeldOut(view);
    std::optional<double>& contrast = result.contrasts.emplace_back();
    if (std::ssize(log_ratios[view]) < kFewestPlacesOfPhoto) continue;
    contrast = std::exp(Median(std::move(log_ratios[view])));
    if (*contrast < kBlurredContrast) result.blurred.push_back(view);
  }
  if (std::ssize(result.blurred) > kMostBlurred * num_training) {
    result.num_soft = static_cast<int>(result.blurred.size());
    result.blurred.clear();
  }
  return result;
}

std::vector<int> PhotoBlur::PassesPerDraw() const {
  if (blurred.empty()) return {};
  std::vector<int> passes(contrasts.size(), 1);
  for (const int view : blurred) passes[view] = kPassesOfBlurred;
  return passes;
}

std::string PhotoBlur::Report(const TrainingScene& scene) const {
  std::vector<double> known;
  for (const std::optional<double>& contrast : contrasts) {
    if (contrast) known.push_back(*contrast);
  }
  if (known.empty()) return "too few tracks to tell";
  char text[128];
  if (num_soft > 0) {
    std::snprintf(text,
                  sizeof(text),
                  "%d of %zu photos have less than %.1f of the contrast of others, too many to be "
                  "blurred",
                  num_soft,
                  known.size(),
                  kBlurredContrast);
    return text;
  }
  if (blurred.empty()) {
    std::snprintf(text,
                  sizeof(text),
                  "no photo; the softest has %.2f of the contrast of others",
                  *std::min_element(known.begin(), known.end()));
    return text;
  }
  std::vector<int> order = blurred;
  std::stable_sort(
      order.begin(), order.end(), [&](int a, int b) { return *contrasts[a] < *contrasts[b]; });
  const double least = *contrasts[order.front()], most = *contrasts[order.back()];
  const char* const format =
      order.size() == 1 ? "%zu of %zu photos has %.2f of the contrast of others: "
                        : "%zu of %zu photos have %.2f to %.2f of the contrast of others: ";
  std::snprintf(text, sizeof(text), format, order.size(), known.size(), least, most);
  std::string report = text;
  for (size_t i = 0; i < std::min(order.size(), kMostNamed); ++i) {
    report += (i > 0 ? ", " : "") + scene.Photos()[order[i]].name;
  }
  return report + (order.size() > kMostNamed ? ", ..." : "");
}

}  // namespace semfoam
