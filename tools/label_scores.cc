// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/label_scores.h"

#include <algorithm>
#include <map>

#include <glog/logging.h>

namespace semfoam {
namespace {

bool IsEmpty(const LabelImage& mask) {
  return std::all_of(mask.data.begin(), mask.data.end(), [](int32_t value) { return value == 0; });
}

std::vector<int32_t> PromptLabels(const MaskedView& view) {
  struct Pixels {
    int64_t inside = 0;
    int64_t all = 0;
  };
  std::map<int32_t, Pixels> of_label;
  for (size_t i = 0; i < view.mask.data.size(); ++i) {
    Pixels& pixels = of_label[view.rendered->data[i]];
    ++pixels.all;
    pixels.inside += view.mask.data[i] != 0;
  }
  std::vector<int32_t> labels;
  for (const auto& [label, pixels] : of_label) {
    if (2 * pixels.inside > pixels.all) labels.push_back(label);
  }
  if (!labels.empty()) return labels;
  const auto most = std::max_element(of_label.begin(), of_label.end(), [](auto& a, auto& b) {
    return a.second.inside < b.second.inside;
  });
  return {most->first};
}

// Mean over views none of whose masks is empty.
LabelScore Score(const std::vector<const MaskedView*>& views, const std::vector<int32_t>& labels) {
  LabelScore mean;
  for (const MaskedView* view : views) {
    int64_t both = 0;
    int64_t either = 0;
    int64_t in_mask = 0;
    for (size_t i = 0; i < view->mask.data.size(); ++i) {
      const bool is_object = view->mask.data[i] != 0;
      const bool is_rendered =
          std::find(labels.begin(), labels.end(), view->rendered->data[i]) != labels.end();
      both += is_object && is_rendered;
      either += is_object || is_rendered;
      in_mask += is_object;
    }
    mean.iou += static_cast<double>(both) / static_cast<double>(either);
    mean.recall += static_cast<double>(both) / static_cast<double>(in_mask);
  }
  mean.iou /= static_cast<double>(views.size());
  mean.recall /= static_cast<double>(views.size());
  return mean;
}

}  // namespace

std::optional<ObjectScore> ScoreObject(const std::vector<MaskedView>& views,
                                       const std::optional<int32_t>& id) {
  std::vector<const MaskedView*> seen;
  for (const MaskedView& view : views) {
    CHECK_EQ(view.rendered->width, view.mask.width);
    CHECK_EQ(view.rendered->height, view.mask.height);
    if (!IsEmpty(view.mask)) seen.push_back(&view);
  }
  if (seen.empty()) return std::nullopt;
  ObjectScore score;
  score.num_views = static_cast<int>(seen.size());
  score.prompt_labels = PromptLabels(*seen.front());
  score.prompt = Score(seen, score.prompt_labels);
  if (id.has_value()) score.direct = Score(seen, {*id});
  return score;
}

}  // namespace semfoam
