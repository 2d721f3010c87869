// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask/mask_findings.h"

#include "plugin/mask/mask_evidence.h"

#include <algorithm>
#include <map>
#include <tuple>
#include <utility>

namespace semfoam {
namespace {

// Minimum number of points for a finding, as in mask_consistency.
constexpr int kLeastPoints = 3;
constexpr float kLeastConfidence = 0.5f;

bool IsZero(const std::vector<Label>& labels, ClassIndex class_index) {
  return labels[Value(class_index)].source_id == kZeroMaskId;
}

// Returns which ids few photos have, so that they are no objects of their own.
std::vector<char> RareClasses(const MaskedPhotos& photos) {
  std::vector<int> views(photos.given.labels.size());
  int num_views = 0;
  int32_t last_view = -1;
  for (const RegionReport& region : photos.consistency.regions) {
    ++views[Value(region.given_class)];
    num_views += region.view != last_view;
    last_view = region.view;
  }
  std::vector<char> is_rare;
  is_rare.reserve(views.size());
  for (const int count : views) is_rare.push_back(count < std::max(2.0, 0.1 * num_views));
  return is_rare;
}

MaskFault FaultOf(const RegionReport& region, bool is_zero, bool is_rare) {
  if (region.classes.empty()) {
    return region.is_contradicted ? MaskFault::kContradicted : MaskFault::kFragment;
  }
  if (is_zero) return MaskFault::kMissing;
  if (region.classes.size() > 1) return MaskFault::kMerged;
  return is_rare ? MaskFault::kNewId : MaskFault::kSwitched;
}

void FindFaultyRegions(const MaskedPhotos& photos, std::vector<MaskFinding>* findings) {
  const std::vector<char> is_rare = RareClasses(photos);
  for (const RegionReport& region : photos.consistency.regions) {
    if (region.classes.size() == 1 && !region.is_renamed) continue;
    const bool is_zero = IsZero(photos.given.labels, region.given_class);
    MaskFinding finding;
    finding.view = region.view;
    finding.given_class = region.given_class;
    finding.fault = FaultOf(region, is_zero, is_rare[Value(region.given_class)] != 0);
    finding.classes = region.classes;
    const PhotoRecord& photo = photos.photos[region.view];
    finding.share =
        static_cast<double>(region.num_pixels) / (static_cast<double>(photo.width) * photo.height);
    if (finding.fault == MaskFault::kMissing) {
      std::erase_if(finding.classes, [&](ClassIndex c) { return IsZero(photos.labels, c); });
    }
    // An id of its own is the same thing once joined; all of its points speak for the other id.
    finding.num_points = finding.fault == MaskFault::kNewId
                             ? region.num_agreeing
                             : region.num_judged - region.num_as_given;
    findings->push_back(std::move(finding));
  }
}

struct Seen {
  int labelled = 0;
  int unlabelled = 0;
};

void FindMissingObjects(const MaskedPhotos& photos,
                        const std::vector<PointLabel>& labels,
                        std::vector<MaskFinding>* findings) {
  std::map<std::pair<int32_t, ClassIndex>, Seen> seen;  // by view and class
  for (size_t i = 0; i < labels.size(); ++i) {
    if (labels[i].class_index == kUnlabelled || labels[i].confidence <= kLeastConfidence) continue;
    if (IsZero(photos.labels, labels[i].class_index)) continue;
    for (size_t k = 0; k < photos.observations[i].size(); ++k) {
      const int32_t view = photos.observations[i][k].view;
      const MaskObservation& shown = photos.shown[i][k];
      if (shown.given_radius < RaggedRadius(photos.photos[view])) continue;
      Seen& s = seen[{view, labels[i].class_index}];
      ++(shown.given_class == kUnlabelled ? s.unlabelled : s.labelled);
    }
  }
  for (const auto& [key, s] : seen) {
    if (s.unlabelled < kLeastPoints || s.unlabelled < s.labelled) continue;
    MaskFinding finding;
    finding.view = key.first;
    finding.fault = MaskFault::kMissing;
    finding.classes = {key.second};
    finding.num_points = s.unlabelled;
    findings->push_back(std::move(finding));
  }
}

bool IsUnusable(MaskFault fault) {
  return fault == MaskFault::kUnreadable || fault == MaskFault::kWrongAspect ||
         fault == MaskFault::kNone;
}

}  // namespace

double MaskFinding::Weight() const { return std::max<double>(num_points, 100 * share); }

std::string FaultName(MaskFault fault) {
  switch (fault) {
    case MaskFault::kUnreadable:
      return "unreadable";
    case MaskFault::kWrongAspect:
      return "wrong aspect";
    case MaskFault::kNone:
      return "no mask";
    case MaskFault::kMissing:
      return "missing";
    case MaskFault::kSwitched:
      return "switched";
    case MaskFault::kNewId:
      return "new id";
    case MaskFault::kMerged:
      return "merged";
    case MaskFault::kContradicted:
      return "contradicted";
    case MaskFault::kFragment:
      return "fragment";
  }
  return "";
}

std::vector<MaskFinding> FindMaskFaults(const MaskedPhotos& photos,
                                        const std::vector<PointLabel>& labels) {
  std::vector<MaskFinding> findings;
  FindFaultyRegions(photos, &findings);
  FindMissingObjects(photos, labels, &findings);
  std::stable_sort(findings.begin(), findings.end(), [](const auto& a, const auto& b) {
    return a.view < b.view;
  });
  return findings;
}

std::vector<SuspiciousPhoto> RankPhotos(const std::vector<MaskFinding>& findings) {
  std::map<int32_t, SuspiciousPhoto> photos;
  for (const MaskFinding& finding : findings) {
    SuspiciousPhoto& photo = photos[finding.view];
    photo.view = finding.view;
    photo.weight += finding.Weight();
    photo.findings.push_back(finding);
  }
  std::vector<SuspiciousPhoto> ranked;
  const auto finding_key = [](const MaskFinding& f) {
    return std::tuple(!IsUnusable(f.fault), -f.Weight(), f.given_class, f.classes);
  };
  for (auto& [view, photo] : photos) {
    std::stable_sort(photo.findings.begin(),
                     photo.findings.end(),
                     [&](const auto& a, const auto& b) { return finding_key(a) < finding_key(b); });
    ranked.push_back(std::move(photo));
  }
  std::stable_sort(ranked.begin(), ranked.end(), [](const auto& a, const auto& b) {
    const auto key = [](const SuspiciousPhoto& p) {
      return std::tuple(!IsUnusable(p.findings.front().fault), -p.weight, p.view);
    };
    return key(a) < key(b);
  });
  return ranked;
}

}  // namespace semfoam
