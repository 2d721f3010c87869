// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/data/training_views.h"
#include "foam/model/model.h"
#include "plugin/colmap/tracks.h"
#include "plugin/mask/mask_evidence.h"
#include "plugin/mask/mask_rewriting.h"
#include "plugin/mask/masks.h"

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace semfoam {

// Masks of a tracker are wrong here and there: an object is lost, merged with another, given
// another's id or a new one, or broken into fragments. The SfM tracks tell: they see the same point
// in several photos, and what a point belongs to does not depend on who looks.
//
// A *region* is all pixels of one id in one photo. Each point in it is judged by what the other
// photos say of that point and of those next to it in space; from that follows what the region is.

enum class MaskConsistency {
  kAuto,         // kTracks or kIndependent, whichever the ids call for; kOff without evidence
  kOff,          // masks are believed
  kTracks,       // ids mean the same in all photos, but for errors
  kIndependent,  // ids mean nothing from one photo to the next: regions are matched by the tracks
};

// What has become of one region.
struct RegionReport {
  int32_t view = 0;
  int32_t given_class = 0;  // in the masks as they were
  int64_t num_pixels = 0;
  std::vector<int32_t> classes;  // in the corrected masks: one; several, ascending, of a split
                                 // region; none of a dropped one
  int num_points = 0;            // seen in it, away from its border
  int num_judged = 0;            // of those, how many the other photos say something of
  int num_agreeing = 0;          // how many of these are what the region is taken for
  int num_as_given = 0;          // and how many are what the masks took it for
  bool is_renamed = false;       // another label than the masks gave
  bool is_contradicted = false;  // dropped for its points; else, if dropped, for want of them
};

struct MaskConsistencyReport {
  MaskConsistency used = MaskConsistency::kOff;
  int num_regions = 0;
  int num_renamed = 0;   // the tracks say another label
  int num_split = 0;     // several labels: pixels clearly next to the points of one are its own
  int num_dropped = 0;   // unlabelled: the tracks contradict the region, or nothing confirms it
  int num_unjudged = 0;  // believed, for want of points
  int labels_before = 0;
  int labels_after = 0;
  // How much more often two photos agree on a point than chance would have it (Cohen's kappa);
  // NaN where no point is seen twice in masks.
  double agreement_before = 0;
  double agreement_after = 0;
  std::vector<RegionReport> regions;  // by view, then class; none where `used` is kOff

  std::string Line() const;  // for the log
};

// What the tracks make of a set of masks.
struct MaskCorrection {
  MaskConsistencyReport report;
  std::shared_ptr<const MaskRewriter> rewriter;  // none where the masks stay as they are
};

// Corrects the masks of the photos that are not held out. Held-out photos have no say, and are only
// brought to the same labels (with kIndependent they are unlabelled).
//
// `tracks` [seeds] are those of `seeds`, over photos that are not held out; an observation near the
// border of a region or outside of its photo says nothing. `labels` are those of the masks'
// classes, and `views` [photos] what the masks show at the places of the tracks (mask_evidence.h).
// Labels without any pixel left are removed, so the classes are renumbered; the order of those that
// stay remains. With kIndependent labels are new, 1..n, in the order in which they first appear,
// and nameless; id 0, where it is a class, stays what it is.
//
// Deterministic. Takes 0.13 s of one core for 64 photos of 640 x 480 with 5 k points and 12 k
// observations. Throws UserError when kIndependent leaves more than 65535 labels.
MaskCorrection CorrectMasks(const std::vector<SeedPoint>& seeds,
                            const std::vector<PixelObservations>& tracks,
                            const std::vector<PhotoRecord>& photos,
                            MaskConsistency mode,
                            const std::vector<Label>& labels,
                            const std::vector<ViewEvidence>& views);

// Names `labels`, which CorrectMasks left of `given` ones, the masks' own, from a labels.json that
// the user named (`is_given`) or that lies beside the masks: see NameLabels. With kIndependent the
// labels are new, and only a file that the user named can know them. Returns a sentence for the
// user about names that are not used; empty where all are.
std::string NameCorrectedLabels(const std::filesystem::path& labels_file,
                                bool is_given,
                                const MaskConsistencyReport& report,
                                const std::vector<Label>& given,
                                std::vector<Label>* labels);

}  // namespace semfoam
