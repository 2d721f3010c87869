// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/options/block_export_options.h"

#include "foam/util/error.h"

namespace semfoam {

void AddBlocksPathOption(OptionManager* options, std::string* blocks_path) {
  options->AddStandInOption("blocks_path",
                            blocks_path,
                            "instead of --foam_path: the output folder of scene_splitter, whose "
                            "trained blocks are exported one after the other, as they are, in the "
                            "memory of one");
}

void RequireByBlock(const OptionManager& options, const std::set<std::string>& own) {
  std::set<std::string> names = {"blocks_path",
                                 "output_path",
                                 "labels_path",
                                 "labels",
                                 "exclude_labels",
                                 "keep_largest",
                                 "min_cells",
                                 "keep_fragments",
                                 "transform",
                                 "ref_images_path",
                                 "ref_is_gps",
                                 "level",
                                 "level_to_zero",
                                 "up_axis",
                                 "scale",
                                 "scale_points",
                                 "scale_distance",
                                 "units"};
  names.insert(own.begin(), own.end());
  options.RequireOnly(
      names,
      "with --blocks_path, whose blocks are written one at a time; merge them (foam_merger) and "
      "give --foam_path, or leave this out");
  if (options.IsGiven("output_path")) return;
  throw UserError("Failed to parse options - the option '--output_path' is required but missing.");
}

}  // namespace semfoam
