// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/mask/masked_photos.h"
#include "plugin/mask/point_labels.h"

#include <cstdint>
#include <string>
#include <vector>

namespace semfoam {

// What makes a photo's mask suspicious.
enum class MaskFault {
  kUnreadable,    // damaged, or no mask format
  kWrongAspect,   // of another shape than its photo
  kNone,          // the photo has no mask
  kMissing,       // an object's points lie where the mask says nothing
  kSwitched,      // a region bears the id of another thing
  kNewId,         // a region bears an id of its own for a thing that has one
  kMerged,        // a region holds several things
  kContradicted,  // a region is not what its id says, nor clearly anything else
  kFragment,      // a region of an id that hardly any photo has and no point confirms
};

// The word for it in tables and files: "missing", "wrong aspect", ...
std::string FaultName(MaskFault fault);

struct MaskFinding {
  int32_t view = 0;
  MaskFault fault = MaskFault::kNone;
  int32_t given_class = kUnlabelled;  // the region's, of MaskedPhotos::given, where there is one
  std::vector<int32_t> classes;       // of MaskedPhotos::labels: what it is, or what is missing
  int num_points = 0;                 // that speak against the mask
  double share = 0;                   // of the photo that the region covers, 0..1

  // How much there is to look at: points, or percent of the photo, whichever are more.
  double Weight() const;
};

// What the tracks find wrong with the masks, by view. `labels` is LabelPoints of the photos.
//
// Regions are as CorrectMasks found them. An object is missing where at least three points
// that are it with a confidence above 1/2, and at least half of those that the photo sees, lie in
// what the mask leaves unlabelled, away from borders. Where id 0 is a class, a region of it that
// holds an object is that object missing.
std::vector<MaskFinding> FindMaskFaults(const MaskedPhotos& photos,
                                        const std::vector<PointLabel>& labels);

// A photo and all that is wrong with its mask.
struct SuspiciousPhoto {
  int32_t view = 0;
  double weight = 0;  // of all findings
  std::vector<MaskFinding> findings;
};

// Photos with findings, the most suspicious first: masks that cannot be used or are not there, then
// by weight, then by view; and within a photo likewise.
std::vector<SuspiciousPhoto> RankPhotos(const std::vector<MaskFinding>& findings);

}  // namespace semfoam
