// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask/mask_consistency.h"

#include "plugin/mask/label_naming.h"
#include "plugin/mask/label_propagation.h"
#include "plugin/mask/region_labels.h"
#include "plugin/mask/region_report.h"

#include <algorithm>
#include <set>
#include <sstream>
#include <utility>

#include <glog/logging.h>

namespace semfoam {
namespace {

// Ids that agree less than this are taken to mean nothing between photos: beyond chance, and at
// all. Where one thing is nearly everywhere, chance alone agrees nearly always, and a few errors of
// the tracker leave nothing beyond it; such ids mean what they say all the same.
constexpr double kLeastAgreement = 0.1;
constexpr double kLeastShareOfPairs = 0.6;
constexpr int kLeastPairs = 20;

// So few masks that agree so well are believed: they are hardly a tracker's, and the few points
// that two of them see are most often wrong themselves.
constexpr size_t kFewMasks = 10;
constexpr double kGoodAgreement = 0.9;

// Returns how masks are corrected where `mode` is asked for; kOff where the evidence is too little,
// or says that there is nothing to correct.
MaskConsistency ChooseConsistency(MaskConsistency mode,
                                  const Evidence::PairAgreement& agreement,
                                  const std::vector<Region>& regions) {
  if (agreement.num_pairs < kLeastPairs) return MaskConsistency::kOff;
  if (mode != MaskConsistency::kAuto) return mode;
  const bool means_nothing =
      agreement.kappa < kLeastAgreement && agreement.share < kLeastShareOfPairs;
  if (means_nothing) return MaskConsistency::kIndependent;
  std::set<int32_t> views;
  for (const Region& region : regions) views.insert(region.view);
  return views.size() <= kFewMasks && agreement.kappa >= kGoodAgreement ? MaskConsistency::kOff
                                                                        : MaskConsistency::kTracks;
}

}  // namespace

std::string MaskConsistencyReport::Line() const {
  std::ostringstream text;
  text.precision(2);
  if (used == MaskConsistency::kOff) {
    text << (agreement_before >= kGoodAgreement
                 ? "The few masks agree with the tracks; they are believed"
                 : "The tracks say too little of the masks; they are believed");
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
  report.used = ChooseConsistency(mode, agreement, evidence.regions);
  if (report.used == MaskConsistency::kOff) return correction;
  const bool is_independent = report.used == MaskConsistency::kIndependent;
  report.num_regions = static_cast<int>(evidence.regions.size());
  report.labels_before = static_cast<int>(given_labels.size());

  RegionLabels labels =
      is_independent ? MatchRegions(given_labels, &evidence) : JoinIds(given_labels, &evidence);
  const std::vector<char> is_contradicted =
      PropagateLabels(labels.believed, static_cast<int>(labels.labels.size()), &evidence);
  report.agreement_after = evidence.Agreement().kappa;
  if (is_independent) NumberLabels(evidence.regions, &labels);

  CountRegions(evidence.regions, &report);
  LogChangedRegions(evidence, photos, given_labels, labels);
  const auto rewriter = std::make_shared<MaskRewriter>(
      std::move(evidence), std::move(labels.label_of_class), labels.labels);
  report.regions =
      ReportRegions(rewriter->evidence(), labels, is_contradicted, rewriter->class_of_label());
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
           "labels were numbered anew; labels_path with names for the new ids would be right.";
  }
  NameLabels(labels_file, labels);
  // Labels that the tracks do not confirm are no mistake of the names.
  return UnusedNamesWarning(labels_file, is_independent ? *labels : given);
}

}  // namespace semfoam
