// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask/mask_consistency.h"

#include "foam/util/error.h"
#include "plugin/mask/mask_association.h"
#include "plugin/mask/mask_evidence.h"
#include "plugin/mask/mask_rewriting.h"

#include <algorithm>
#include <iterator>
#include <map>
#include <numeric>
#include <set>
#include <sstream>
#include <utility>

#include <glog/logging.h>

namespace semfoam {
namespace {

constexpr size_t kMaxLabels = 65535;

// A point is judged where the others' votes weigh at least this, and more than half agree.
constexpr float kLeastVotes = 1.5f;
// A region is judged from this many judged points on, and a label is in it from so many on.
constexpr int kLeastPoints = 3;
// A label is in a region if it has this share of the region's points, or if the region has this
// share of the label's points in the photo (a small thing merged with a large one).
constexpr double kShareOfRegion = 0.3;
constexpr double kShareOfLabel = 0.5;
// Regions change while such a share of their points agree: the clear ones first, as their
// correction may clear up others.
constexpr double kClearShares[] = {0.8, 0.65, 0.5, 0.5, 0.5, 0.5};
// A contradicted region that is not clearly anything else is dropped from so many points on.
constexpr int kPointsToDrop = 8;
// A label in less than this share of the photos is rare: a fragment, unless points confirm it.
constexpr double kShareOfPhotos = 0.1;
// Ids that agree less than this are taken to mean nothing between photos: beyond chance, and at
// all. Where one thing is nearly everywhere, chance alone agrees nearly always, and a few errors of
// the tracker leave nothing beyond it; such ids mean what they say all the same.
constexpr double kLeastAgreement = 0.1;
constexpr double kLeastShareOfPairs = 0.6;
constexpr int kLeastPairs = 20;

// Ids that are the same thing become one label, that of the id with the most regions.
void JoinLabels(int num_labels, Evidence* evidence) {
  std::vector<int32_t> node_of_region;
  std::vector<int> num_regions(num_labels, 0);
  for (const Region& region : evidence->regions) {
    node_of_region.push_back(region.mask_class);
    ++num_regions[region.mask_class];
  }
  const std::vector<int32_t> roots = ClusterNodes(*evidence, node_of_region, num_labels);
  std::vector<int32_t> main_label(num_labels, kNoLabel);  // of each root
  for (int32_t label = 0; label < num_labels; ++label) {
    int32_t& main = main_label[roots[label]];
    if (main == kNoLabel || num_regions[label] > num_regions[main]) main = label;
  }
  for (Region& region : evidence->regions) region.label = main_label[roots[region.mask_class]];
}

// Every region by itself: the labels are the clusters, numbered in the order of their first
// regions, behind id 0, whose regions stay together where it is a class. Returns their number.
int AssociateRegions(bool has_zero_class, Evidence* evidence) {
  std::vector<int32_t> node_of_region;
  int32_t num_nodes = has_zero_class ? 1 : 0;
  for (const Region& region : evidence->regions) {
    const bool is_zero = has_zero_class && region.mask_class == 0;
    node_of_region.push_back(is_zero ? 0 : num_nodes++);
  }
  const std::vector<int32_t> roots = ClusterNodes(*evidence, node_of_region, num_nodes);
  std::vector<int32_t> label_of_root(num_nodes, kNoLabel);
  int num_labels = 0;
  if (has_zero_class) label_of_root[roots[0]] = num_labels++;
  for (size_t r = 0; r < evidence->regions.size(); ++r) {
    int32_t& label = label_of_root[roots[node_of_region[r]]];
    if (label == kNoLabel) label = num_labels++;
    evidence->regions[r].label = label;
  }
  return num_labels;
}

void PropagateRegionLabels(Evidence* evidence) {
  for (Observation& observation : evidence->observations) {
    const Region& region = evidence->regions[observation.region];
    const bool in_part =
        std::binary_search(region.parts.begin(), region.parts.end(), observation.verdict);
    observation.label = in_part ? observation.verdict : region.label;
  }
}

// What the other photos say of each observation.
void JudgeObservations(Evidence* evidence) {
  std::vector<Vote> votes;
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
    for (const Vote& vote : votes) {
      if (vote.weight > 0.5f * total) observation.verdict = vote.label;
    }
  }
}

// Which labels few photos have, by the regions' labels.
std::vector<char> RareLabels(int num_labels, const std::vector<Region>& regions) {
  std::vector<std::set<int32_t>> views(num_labels);
  std::set<int32_t> all_views;
  for (const Region& region : regions) {
    all_views.insert(region.view);
    if (region.label != kNoLabel) views[region.label].insert(region.view);
  }
  const double enough = std::max(2.0, kShareOfPhotos * static_cast<double>(all_views.size()));
  std::vector<char> is_rare;
  is_rare.reserve(views.size());
  for (const auto& v : views) is_rare.push_back(static_cast<double>(v.size()) < enough);
  return is_rare;
}

// What each region is, by the verdicts on its observations; `believed` are the labels that the
// masks gave, `is_rare` tells which of them few photos have.
void JudgeRegions(const std::vector<int32_t>& believed,
                  const std::vector<char>& is_rare,
                  double clear_share,
                  Evidence* evidence) {
  // How many points of a label each photo sees.
  std::map<std::pair<int32_t, int32_t>, int> in_view;  // (view, label)
  for (const Observation& observation : evidence->observations) {
    if (observation.verdict == kNoLabel) continue;
    ++in_view[{evidence->regions[observation.region].view, observation.verdict}];
  }
  for (size_t r = 0; r < evidence->regions.size(); ++r) {
    Region& region = evidence->regions[r];
    std::map<int32_t, int> count;
    int judged = 0;
    for (const uint32_t i : region.observations) {
      const int32_t verdict = evidence->observations[i].verdict;
      if (verdict == kNoLabel) continue;
      ++count[verdict];
      ++judged;
    }
    region.is_judged = judged >= kLeastPoints;
    region.label = believed[r];
    region.parts.clear();
    if (!region.is_judged) continue;
    const auto holds_most_of = [&](int32_t label, int n) {
      return n >= kShareOfLabel * in_view.at({region.view, label});
    };
    std::vector<int32_t> present;
    int most = 0;
    for (const auto& [label, n] : count) {
      most = std::max(most, n);
      if (n >= kLeastPoints && (n >= kShareOfRegion * judged || holds_most_of(label, n))) {
        present.push_back(label);
      }
    }
    const double last_share = *std::prev(std::end(kClearShares));
    if (clear_share > last_share && most < clear_share * judged) continue;  // too early to say
    if (present.size() > 1) {
      region.label = kNoLabel;
      region.parts = std::move(present);
      continue;
    }
    // The one label that is there takes the region if it has no other place in this photo, or if
    // the region is one of a fragment. Else its few points may be those of the border.
    if (present.size() == 1 && count[present[0]] >= last_share * judged &&
        (is_rare[believed[r]] || holds_most_of(present[0], count[present[0]]))) {
      region.label = present[0];
    } else if (!count.contains(believed[r]) && judged >= kPointsToDrop) {
      region.label = kNoLabel;
    }
  }
}

// Labels that no point confirms and that few photos have are fragments, or a thing that cannot be
// learned.
void DropUnconfirmed(int num_labels, Evidence* evidence) {
  std::vector<int> confirmed(num_labels, 0);
  for (const Observation& observation : evidence->observations) {
    if (observation.label != kNoLabel && observation.label == observation.verdict) {
      ++confirmed[observation.label];
    }
  }
  const std::vector<char> is_rare = RareLabels(num_labels, evidence->regions);
  for (Region& region : evidence->regions) {
    if (region.label == kNoLabel || confirmed[region.label] >= kLeastPoints) continue;
    if (is_rare[region.label]) region.label = kNoLabel;
  }
}

// `given` are the regions' labels as the masks had them, `believed` those with equal ids joined.
std::vector<RegionReport> ReportRegions(const Evidence& evidence,
                                        const std::vector<int32_t>& given,
                                        const std::vector<int32_t>& believed,
                                        const std::vector<char>& is_contradicted,
                                        const std::vector<int32_t>& class_of_label) {
  std::vector<RegionReport> reports;
  for (size_t r = 0; r < evidence.regions.size(); ++r) {
    const Region& region = evidence.regions[r];
    RegionReport& report = reports.emplace_back();
    report.view = region.view;
    report.given_class = region.mask_class;
    report.num_pixels = region.num_pixels;
    if (region.label != kNoLabel) report.classes.push_back(class_of_label[region.label]);
    for (const int32_t part : region.parts) report.classes.push_back(class_of_label[part]);
    report.is_renamed = region.label != kNoLabel && region.label != given[r];
    report.is_contradicted = is_contradicted[r] != 0;
    report.num_points = static_cast<int>(region.observations.size());
    for (const uint32_t i : region.observations) {
      const Observation& observation = evidence.observations[i];
      if (observation.verdict == kNoLabel) continue;
      ++report.num_judged;
      report.num_agreeing += observation.verdict == observation.label;
      report.num_as_given += observation.verdict == believed[r];
    }
  }
  return reports;
}

void Log(const Evidence& evidence,
         const std::vector<int32_t>& given,
         const std::vector<PhotoRecord>& photos,
         const std::vector<Label>& mask_labels,
         const std::vector<Label>& labels) {
  for (size_t r = 0; r < evidence.regions.size(); ++r) {
    const Region& region = evidence.regions[r];
    if (region.label == given[r]) continue;
    std::ostringstream text;
    text << photos[region.view].name << ", id " << mask_labels[region.mask_class].source_id << ", "
         << region.observations.size() << " points: ";
    if (region.label != kNoLabel) {
      text << "is " << labels[region.label].id;
    } else if (region.parts.empty()) {
      text << "dropped";
    } else {
      text << "split into";
      for (const int32_t part : region.parts) text << " " << labels[part].id;
    }
    VLOG(1) << text.str();
  }
}

}  // namespace

std::string MaskConsistencyReport::Line() const {
  std::ostringstream text;
  text.precision(2);
  if (used == MaskConsistency::kOff) {
    text << "The tracks say too little of the masks; they are believed";
    return text.str();
  }
  text << (used == MaskConsistency::kTracks ? "Masks held against the tracks: "
                                            : "Masks of each photo matched by the tracks: ")
       << "of " << num_regions << " regions " << num_renamed << " renamed, " << num_split
       << " split, " << num_dropped << " dropped, " << num_unjudged
       << " with too few points to tell; " << labels_before << " ids became " << labels_after
       << " labels; agreement " << std::fixed << agreement_before << " before, " << agreement_after
       << " after";
  return text.str();
}

MaskCorrection CorrectMasks(const std::vector<SeedPoint>& seeds,
                            const std::vector<PixelObservations>& tracks,
                            const std::vector<PhotoRecord>& photos,
                            MaskConsistency mode,
                            const std::vector<Label>& given_labels,
                            const std::vector<ViewEvidence>& views) {
  CHECK_EQ(seeds.size(), tracks.size());
  CHECK_EQ(photos.size(), views.size());
  MaskCorrection correction;
  MaskConsistencyReport& report = correction.report;
  if (mode == MaskConsistency::kOff || given_labels.empty()) return correction;
  Evidence evidence(seeds, tracks, views);
  const Evidence::PairAgreement agreement = evidence.Agreement();
  report.agreement_before = agreement.kappa;
  if (agreement.num_pairs < kLeastPairs) return correction;
  if (mode == MaskConsistency::kAuto) {
    const bool means_nothing =
        agreement.kappa < kLeastAgreement && agreement.share < kLeastShareOfPairs;
    mode = means_nothing ? MaskConsistency::kIndependent : MaskConsistency::kTracks;
  }
  report.used = mode;
  report.num_regions = static_cast<int>(evidence.regions.size());
  report.labels_before = static_cast<int>(given_labels.size());

  std::vector<Label> labels = given_labels;
  std::vector<int32_t> label_of_class(labels.size(), kNoLabel);
  const bool has_zero_class = labels[0].source_id == 0;
  if (mode == MaskConsistency::kTracks) {
    JoinLabels(static_cast<int>(labels.size()), &evidence);
    std::iota(label_of_class.begin(), label_of_class.end(), 0);
    for (const Region& region : evidence.regions) label_of_class[region.mask_class] = region.label;
  } else {
    const int count = AssociateRegions(has_zero_class, &evidence);
    const Label zero = labels[0];
    labels.assign(count, Label());
    if (has_zero_class) {
      labels[0] = zero;
      label_of_class[0] = 0;
    }
  }
  std::vector<int32_t> believed;
  believed.reserve(evidence.regions.size());
  for (const Region& region : evidence.regions) believed.push_back(region.label);
  // What a region is compared with in the report: a joined id is a renamed one.
  std::vector<int32_t> given = believed;
  if (mode == MaskConsistency::kTracks) {
    for (size_t r = 0; r < given.size(); ++r) given[r] = evidence.regions[r].mask_class;
  }
  const auto num_labels = static_cast<int>(labels.size());
  const std::vector<char> is_rare = RareLabels(num_labels, evidence.regions);
  for (const double clear_share : kClearShares) {
    PropagateRegionLabels(&evidence);
    JudgeObservations(&evidence);
    JudgeRegions(believed, is_rare, clear_share, &evidence);
  }
  PropagateRegionLabels(&evidence);
  std::vector<char> is_contradicted;
  is_contradicted.reserve(evidence.regions.size());
  for (const Region& region : evidence.regions) {
    is_contradicted.push_back(region.label == kNoLabel && region.parts.empty());
  }
  DropUnconfirmed(num_labels, &evidence);
  PropagateRegionLabels(&evidence);
  report.agreement_after = evidence.Agreement().kappa;

  if (mode == MaskConsistency::kIndependent) {
    std::set<int32_t> used;
    for (const Region& region : evidence.regions) {
      if (region.label != kNoLabel) used.insert(region.label);
      used.insert(region.parts.begin(), region.parts.end());
    }
    if (used.size() > kMaxLabels) {
      throw UserError("--Masks.consistency independent: the regions of the masks make ",
                      used.size(),
                      " labels, where at most ",
                      kMaxLabels,
                      " are possible; masks with fewer regions would be right.");
    }
    int32_t next_id = 1;
    for (const int32_t label : used) {
      if (has_zero_class && label == 0) continue;
      labels[label].id = next_id;
      labels[label].source_id = next_id++;
    }
  }
  for (const Region& region : evidence.regions) {
    report.num_split += !region.parts.empty();
    report.num_dropped += region.label == kNoLabel && region.parts.empty();
    report.num_unjudged += !region.is_judged && region.label != kNoLabel;
  }
  Log(evidence, given, photos, given_labels, labels);
  const auto rewriter =
      std::make_shared<MaskRewriter>(std::move(evidence), std::move(label_of_class), labels);
  report.regions = ReportRegions(
      rewriter->evidence(), given, believed, is_contradicted, rewriter->class_of_label());
  report.num_renamed = static_cast<int>(
      std::count_if(report.regions.begin(), report.regions.end(), [](const RegionReport& region) {
        return region.is_renamed;
      }));
  report.labels_after = static_cast<int>(rewriter->labels().size());
  correction.rewriter = rewriter;
  return correction;
}

std::string NameCorrectedLabels(const std::filesystem::path& labels_file,
                                bool is_given,
                                const MaskConsistencyReport& report,
                                const std::vector<Label>& given,
                                std::vector<Label>* labels) {
  if (labels_file.empty()) return "";
  const bool is_independent = report.used == MaskConsistency::kIndependent;
  if (is_independent && !is_given) {
    return labels_file.string() +
           ": its names are not used, as the masks' ids mean nothing from photo to photo and the "
           "labels were numbered anew; --labels_path with names for the new ids would be right.";
  }
  NameLabels(labels_file, labels);
  // Labels that the tracks do not confirm are no mistake of the names.
  return UnusedNamesWarning(labels_file, is_independent ? *labels : given);
}

}  // namespace semfoam
