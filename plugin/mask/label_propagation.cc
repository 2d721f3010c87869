// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask/label_propagation.h"

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <map>
#include <set>
#include <utility>

namespace semfoam {
namespace {

// A point is judged where the others' votes weigh at least this, and more than half agree.
constexpr float kLeastVotes = 1.5f;
// A region is judged from this many judged points on, and a label is in it from so many on.
constexpr int kLeastPoints = 3;
// A label is in a region if it has this share of the region's points, or if the region has this
// share of the label's points in the photo (a small thing merged with a large one).
constexpr double kShareOfRegion = 0.3;
constexpr double kShareOfLabel = 0.5;
// Regions change while such a share of their points agree: one round for each.
constexpr double kClearShares[] = {0.8, 0.65, 0.5, 0.5, 0.5, 0.5};
// A contradicted region that is not clearly anything else is dropped from so many points on.
constexpr int kPointsToDrop = 8;
// A label in less than this share of the photos with masks is rare: a fragment, unless points
// confirm it. So none is where ten photos or fewer have masks.
constexpr double kShareOfPhotos = 0.1;

// Gives the observations the labels of their regions, and of the parts of split ones.
void PropagateRegionLabels(Evidence* evidence) {
  for (Observation& observation : evidence->observations) {
    const Region& region = evidence->regions[observation.region];
    const bool in_part =
        std::binary_search(region.parts.begin(), region.parts.end(), observation.verdict);
    observation.label = in_part ? observation.verdict : region.label;
  }
}

// Sets the verdict of the other photos on each observation.
void JudgeObservations(Evidence* evidence) {
  std::vector<Vote<RegionLabel>> votes;
  for (Observation& observation : evidence->observations) {
    votes.clear();
    float total = 0;
    evidence->ForEachLink(observation, [&](const Observation& other, float weight) {
      if (other.label == kNoLabel) return;
      AddVote(other.label, weight, &votes);
      total += weight;
    });
    observation.verdict = kNoLabel;
    if (total < kLeastVotes) continue;
    for (const Vote<RegionLabel>& vote : votes) {
      if (vote.weight > 0.5f * total) observation.verdict = vote.label;
    }
  }
}

// Returns for each label whether few photos have it, by the regions' labels.
std::vector<char> RareLabels(int num_labels, const std::vector<Region>& regions) {
  std::vector<std::set<int32_t>> views(num_labels);
  std::set<int32_t> all_views;
  for (const Region& region : regions) {
    all_views.insert(region.view);
    if (region.label != kNoLabel) views[Value(region.label)].insert(region.view);
  }
  const double enough = kShareOfPhotos * static_cast<double>(all_views.size());
  std::vector<char> is_rare;
  is_rare.reserve(views.size());
  for (const auto& v : views) is_rare.push_back(static_cast<double>(v.size()) < enough);
  return is_rare;
}

// Number of observations with a verdict, by (view, verdict).
using VerdictsOfViews = std::map<std::pair<int32_t, RegionLabel>, int>;

VerdictsOfViews CountVerdicts(const Evidence& evidence) {
  VerdictsOfViews counts;
  for (const Observation& observation : evidence.observations) {
    if (observation.verdict == kNoLabel) continue;
    ++counts[{evidence.regions[observation.region].view, observation.verdict}];
  }
  return counts;
}

// Judges one region by the verdicts on its observations. It begins with the label `believed`, which
// few photos have where `is_rare`.
void JudgeRegion(const std::vector<Observation>& observations,
                 const VerdictsOfViews& in_view,
                 RegionLabel believed,
                 bool is_rare,
                 double clear_share,
                 Region* region) {
  std::map<RegionLabel, int> count;
  int judged = 0;
  for (const uint32_t i : region->observations) {
    const RegionLabel verdict = observations[i].verdict;
    if (verdict == kNoLabel) continue;
    ++count[verdict];
    ++judged;
  }
  region->is_judged = judged >= kLeastPoints;
  region->label = believed;
  region->parts.clear();
  if (!region->is_judged) return;
  const auto holds_most_of = [&](RegionLabel label, int n) {
    return n >= kShareOfLabel * in_view.at({region->view, label});
  };
  std::vector<RegionLabel> present;
  int most = 0;
  for (const auto& [label, n] : count) {
    most = std::max(most, n);
    if (n >= kLeastPoints && (n >= kShareOfRegion * judged || holds_most_of(label, n))) {
      present.push_back(label);
    }
  }
  const double last_share = *std::prev(std::end(kClearShares));
  if (clear_share > last_share && most < clear_share * judged) return;  // too early to say
  if (present.size() > 1) {
    region->label = kNoLabel;
    region->parts = std::move(present);
    return;
  }
  // The one label that is there takes the region if it has no other place in this photo, or if
  // the region is one of a fragment. Else its few points may be those of the border.
  if (present.size() == 1 && count[present[0]] >= last_share * judged &&
      (is_rare || holds_most_of(present[0], count[present[0]]))) {
    region->label = present[0];
  } else if (!count.contains(believed) && judged >= kPointsToDrop) {
    region->label = kNoLabel;
  }
}

void JudgeRegions(const std::vector<RegionLabel>& believed,
                  const std::vector<char>& is_rare,
                  double clear_share,
                  Evidence* evidence) {
  const VerdictsOfViews in_view = CountVerdicts(*evidence);
  for (size_t r = 0; r < evidence->regions.size(); ++r) {
    JudgeRegion(evidence->observations,
                in_view,
                believed[r],
                is_rare[Value(believed[r])] != 0,
                clear_share,
                &evidence->regions[r]);
  }
}

void DropUnconfirmed(int num_labels, Evidence* evidence) {
  std::vector<int> confirmed(num_labels, 0);
  for (const Observation& observation : evidence->observations) {
    if (observation.label != kNoLabel && observation.label == observation.verdict) {
      ++confirmed[Value(observation.label)];
    }
  }
  const std::vector<char> is_rare = RareLabels(num_labels, evidence->regions);
  for (Region& region : evidence->regions) {
    if (region.label == kNoLabel || confirmed[Value(region.label)] >= kLeastPoints) continue;
    if (is_rare[Value(region.label)]) region.label = kNoLabel;
  }
}

}  // namespace

std::vector<char> PropagateLabels(const std::vector<RegionLabel>& believed,
                                  int num_labels,
                                  Evidence* evidence) {
  const std::vector<char> is_rare = RareLabels(num_labels, evidence->regions);
  for (const double clear_share : kClearShares) {
    PropagateRegionLabels(evidence);
    JudgeObservations(evidence);
    JudgeRegions(believed, is_rare, clear_share, evidence);
  }
  PropagateRegionLabels(evidence);
  std::vector<char> is_contradicted;
  is_contradicted.reserve(evidence->regions.size());
  for (const Region& region : evidence->regions) {
    is_contradicted.push_back(region.label == kNoLabel && region.parts.empty());
  }
  DropUnconfirmed(num_labels, evidence);
  PropagateRegionLabels(evidence);
  return is_contradicted;
}

}  // namespace semfoam
