// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/util/ids.h"
#include "plugin/mask/masked_photos.h"
#include "plugin/mask/point_labels.h"

#include <cstdint>
#include <string>
#include <vector>

namespace semfoam {

// Finds the faults of masks by the SfM tracks, and ranks the photos by them.

enum class MaskFault {
  // Damaged, or no mask format.
  kUnreadable,
  // Of another shape than its photo.
  kWrongAspect,
  // The photo has no mask.
  kNone,
  // An object's points lie where the mask is unlabelled.
  kMissing,
  // A region has the id of another object.
  kSwitched,
  // A region has an id of its own though its object has another one.
  kNewId,
  // A region holds several objects.
  kMerged,
  // The points of a region contradict its id, but agree on no other object.
  kContradicted,
  // A region of an id that hardly any photo has and no point confirms.
  kFragment,
};

// Returns the word for a fault in tables and files: "missing", "wrong aspect", ...
std::string FaultName(MaskFault fault);

struct MaskFinding {
  int32_t view = 0;
  MaskFault fault = MaskFault::kNone;
  // Class of the region in MaskedPhotos::given, where there is a region.
  ClassIndex given_class = kUnlabelled;
  // Classes in MaskedPhotos::labels: those of the region's objects, or of the missing one.
  std::vector<ClassIndex> classes;
  // Number of points that contradict the mask.
  int num_points = 0;
  // Share of the photo that the region covers, 0..1.
  double share = 0;

  // Returns the number of these points, or the percent of the photo, whichever is more.
  double Weight() const;
};

// Returns the faults that the tracks find in the masks, by view. `labels` is LabelPoints of the
// photos.
//
// Regions are those of CorrectMasks. An object is missing where at least three points that have its
// label with a confidence above 1/2, and at least half of those that the photo sees, lie in
// unlabelled parts of the mask, away from borders. Where id 0 is a class, an object in a region of
// it is missing.
std::vector<MaskFinding> FindMaskFaults(const MaskedPhotos& photos,
                                        const std::vector<PointLabel>& labels);

// A photo and all findings on its mask.
struct SuspiciousPhoto {
  int32_t view = 0;
  // Weight of all findings.
  double weight = 0;
  std::vector<MaskFinding> findings;
};

// Returns the photos with findings, the most suspicious first: masks that cannot be used or are not
// there, then by weight, then by view; and within a photo likewise.
std::vector<SuspiciousPhoto> RankPhotos(const std::vector<MaskFinding>& findings);

}  // namespace semfoam
