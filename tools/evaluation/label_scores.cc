// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/evaluation/label_scores.h"

#include <algorithm>
#include <cmath>
#include <map>

#include <glog/logging.h>

namespace semfoam {
namespace {

bool IsEmpty(const LabelImage& mask) {
  return std::all_of(mask.data.begin(), mask.data.end(), [](int32_t value) { return value == 0; });
}

std::vector<LabelId> PromptLabels(const LabelImage& rendered, const LabelImage& mask) {
  struct Pixels {
    int64_t inside = 0;
    int64_t all = 0;
  };
  std::map<LabelId, Pixels> of_label;
  for (size_t i = 0; i < mask.data.size(); ++i) {
    Pixels& pixels = of_label[LabelId{rendered.data[i]}];
    ++pixels.all;
    pixels.inside += mask.data[i] != 0;
  }
  std::vector<LabelId> labels;
  for (const auto& [label, pixels] : of_label) {
    if (2 * pixels.inside > pixels.all) labels.push_back(label);
  }
  if (!labels.empty()) return labels;
  const auto most = std::max_element(of_label.begin(), of_label.end(), [](auto& a, auto& b) {
    return a.second.inside < b.second.inside;
  });
  return {most->first};
}

// The labels' pixels as a mask, 1 or 0.
LabelImage MaskOf(const LabelImage& rendered, const std::vector<LabelId>& labels) {
  LabelImage mask{rendered.width, rendered.height, {}};
  mask.data.reserve(rendered.data.size());
  for (const int32_t id : rendered.data) {
    mask.data.push_back(std::find(labels.begin(), labels.end(), LabelId{id}) != labels.end());
  }
  return mask;
}

struct Overlap {
  int64_t both = 0;
  int64_t either = 0;
  int64_t in_truth = 0;

  double Iou() const { return static_cast<double>(both) / static_cast<double>(either); }
  double Recall() const { return static_cast<double>(both) / static_cast<double>(in_truth); }
};

Overlap OverlapOf(const LabelImage& shown, const LabelImage& truth) {
  Overlap overlap;
  for (size_t i = 0; i < truth.data.size(); ++i) {
    const bool is_truth = truth.data[i] != 0;
    const bool is_shown = shown.data[i] != 0;
    overlap.both += is_truth && is_shown;
    overlap.either += is_truth || is_shown;
    overlap.in_truth += is_truth;
  }
  return overlap;
}

// Of a view whose mask is not empty; `boundary` is that of its mask.
LabelScore ScoreView(const LabelImage& rendered,
                     const LabelImage& mask,
                     const LabelImage& boundary,
                     const std::vector<LabelId>& labels) {
  const LabelImage shown = MaskOf(rendered, labels);
  const Overlap overlap = OverlapOf(shown, mask);
  return {overlap.Iou(), overlap.Recall(), OverlapOf(BoundaryOf(shown), boundary).Iou()};
}

}  // namespace

LabelImage BoundaryOf(const LabelImage& mask) {
  const double diagonal = std::hypot(mask.width, mask.height);
  const int reach = std::max(1, static_cast<int>(std::lround(0.02 * diagonal)));
  // sums[y][x]: pixels of the mask in the rows above y and the columns before x.
  const size_t stride = mask.width + 1;
  std::vector<int32_t> sums(stride * (mask.height + 1), 0);
  for (int y = 0; y < mask.height; ++y) {
    for (int x = 0; x < mask.width; ++x) {
      sums[(y + 1) * stride + x + 1] = (mask.data[size_t{1} * y * mask.width + x] != 0) +
                                       sums[y * stride + x + 1] + sums[(y + 1) * stride + x] -
                                       sums[y * stride + x];
    }
  }
  const int window = (2 * reach + 1) * (2 * reach + 1);
  LabelImage boundary{mask.width, mask.height, {}};
  boundary.data.reserve(mask.data.size());
  for (int y = 0; y < mask.height; ++y) {
    const size_t top = std::max(y - reach, 0);
    const size_t bottom = std::min(y + reach + 1, mask.height);
    for (int x = 0; x < mask.width; ++x) {
      const size_t left = std::max(x - reach, 0);
      const size_t right = std::min(x + reach + 1, mask.width);
      const int inside = sums[bottom * stride + right] - sums[top * stride + right] -
                         sums[bottom * stride + left] + sums[top * stride + left];
      const bool in_mask = mask.data[size_t{1} * y * mask.width + x] != 0;
      // A window that the image cuts has fewer pixels than `window`: beyond is outside.
      boundary.data.push_back(in_mask && inside < window);
    }
  }
  return boundary;
}

void ObjectScorer::Add(const LabelImage& rendered, const LabelImage& mask) {
  CHECK_EQ(rendered.width, mask.width);
  CHECK_EQ(rendered.height, mask.height);
  const size_t view = num_views_++;
  if (IsEmpty(mask)) return;
  if (score_.views.empty()) score_.prompt_labels = PromptLabels(rendered, mask);
  const LabelImage boundary = BoundaryOf(mask);
  ViewLabelScore& of_view = score_.views.emplace_back();
  of_view.view = view;
  of_view.prompt = ScoreView(rendered, mask, boundary, score_.prompt_labels);
  if (id_.has_value()) of_view.direct = ScoreView(rendered, mask, boundary, {*id_});
}

std::optional<ObjectScore> ObjectScorer::Finish() const {
  if (score_.views.empty()) return std::nullopt;
  ObjectScore score = score_;
  if (id_.has_value()) score.direct.emplace();
  const double share = 1.0 / static_cast<double>(score.views.size());
  for (const ViewLabelScore& view : score.views) {
    score.prompt.Add(view.prompt, share);
    if (score.direct && view.direct) score.direct->Add(*view.direct, share);
  }
  return score;
}

}  // namespace semfoam
