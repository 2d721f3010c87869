// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/image/image.h"
#include "foam/util/scratch_folder.h"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace semfoam {

// What a folder of masks was made by.
struct MaskOrigin {
  // The member of labels.json by which the folder is known: "imported_from".
  const char* key;
  // In the sentence about a folder of another origin: "an import of masks".
  const char* description;
};

// The content of labels.json.
struct MaskTable {
  // Value of MaskOrigin::key.
  std::string made_from;
  // Whether id 0 is unlabelled, however many pixels it has (SaysZeroIsUnlabelled).
  bool zero_is_unlabelled = false;
  // Names by id.
  std::map<int32_t, std::string> labels;
  // The ids that the masks had before, by id, where they were numbered anew: "original_ids". For
  // the user alone; "source_ids" would be ids of the masks beside the file (ReadLabelNames).
  std::map<int32_t, int64_t> original_ids;
};

// Writes a folder of masks as trainings read them: a 16-bit PNG of label ids for each photo, and
// labels.json beside them. All files are written into a scratch folder before the first of them is
// moved to its place, so that a set of which one cannot be made leaves nothing.
class MaskFolderWriter {
 public:
  // Makes a writer of the masks `names`, relative to `folder` (NamesForMasks), which is created if
  // it is missing. Throws UserError, one sentence naming the file, where the folder has a
  // labels.json of another origin, which would be lost, or PNGs that are not to be replaced, which
  // would be taken for masks of this set.
  MaskFolderWriter(const std::filesystem::path& folder,
                   const MaskOrigin& origin,
                   std::vector<std::string> names);

  // Writes the mask names[index]. Can be called in parallel for different masks. Throws UserError
  // as WriteLabelPng does.
  void Write(size_t index, const LabelImage& ids) const;

  // Moves all masks, each of which must have been written, to their places, and writes labels.json.
  // Throws UserError naming the file for which that is not possible.
  void Finish(const MaskTable& table) const;

 private:
  const std::filesystem::path folder_;
  const MaskOrigin origin_;
  const std::vector<std::string> names_;
  const ScratchFolder scratch_;
};

}  // namespace semfoam
