// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/util/error.h"
#include "plugin/colmap/colmap_model.h"
#include "plugin/dataset/mask_choice.h"
#include "plugin/mask/mask_undistortion.h"
#include "plugin/util/plural.h"
#include "tools/cli/option_manager.h"
#include "tools/commands/commands.h"
#include "tools/masks/model_masks.h"
#include "tools/options/mask_options.h"
#include "tools/support/output_lock.h"

#include <cstdio>
#include <filesystem>
#include <string>

#include <glog/logging.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

struct UndistorterOptions {
  MaskOptions masks;
  std::string ignore_path;
  bool invert = false;
  std::string input_path;
  std::string undistorted_path;
  std::string output_path;
};

void AddOptions(OptionManager* options, UndistorterOptions* undistorter) {
  AddMaskPathOptions(options, &undistorter->masks);
  options->AddRequiredOption(
      "input_path",
      &undistorter->input_path,
      "the COLMAP model of the original photos, which the masks belong to: the --input_path of "
      "image_undistorter");
  options->AddRequiredOption("undistorted_path",
                             &undistorter->undistorted_path,
                             "the --output_path of image_undistorter, or the model in it, sparse/");
  options->AddRequiredOption(
      "output_path",
      &undistorter->output_path,
      "folder for the masks and labels.json, such as object_mask/ in --undistorted_path");
  options->AddDefaultOption(
      "ignore_path",
      &undistorter->ignore_path,
      "folder of binary masks of ignored pixels, as trainings read them, to be undistorted in "
      "place of instance masks");
  options->AddDefaultOption("invert",
                            &undistorter->invert,
                            "1 = what is white, or opaque, in --ignore_path is ignored; black is "
                            "in the undistorted masks, whichever it was");
}

// "12 %", or as many digits as tell a small share from nothing.
std::string Percent(double share) {
  char text[32];
  std::snprintf(text, sizeof(text), share < 0.1 ? "%.2g %%" : "%.0f %%", 100 * share);
  return text;
}

void LogResult(const UndistorterOptions& undistorter,
               const UndistortedPhotos& photos,
               const MaskUndistortion& result) {
  const size_t num_photos = photos.photos.size() + photos.only_undistorted.size();
  LOG(INFO) << "Masks of " << result.num_masks << " of "
            << Plural(static_cast<int64_t>(num_photos), "photo") << " are in "
            << undistorter.output_path;
  if (result.num_renumbered > 0) {
    LOG(INFO) << "Ids above 65535 do not fit into 16 bits, so "
              << Plural(result.num_renumbered, "label")
              << (result.num_renumbered == 1 ? " has" : " have")
              << " another id now; original_ids in labels.json says which they had";
  }
  if (result.share_outside > 0) {
    LOG(INFO) << Percent(result.share_outside)
              << " of their pixels show no place of an original photo and are 0"
              << (result.zero_is_class ? ", which is a class of its own in these masks" : "");
  }
  if (!photos.only_undistorted.empty()) {
    LOG(WARNING) << "Not in " << undistorter.input_path << ", and so without a mask: "
                 << Plural(static_cast<int64_t>(photos.only_undistorted.size()), "photo") << " of "
                 << undistorter.undistorted_path << " (" << FirstNames(photos.only_undistorted)
                 << ").";
  }
  if (!photos.only_original.empty()) {
    LOG(WARNING) << "Not in " << undistorter.undistorted_path << ": "
                 << Plural(static_cast<int64_t>(photos.only_original.size()), "photo") << " of "
                 << undistorter.input_path << " (" << FirstNames(photos.only_original) << ").";
  }
  if (!result.without_photo.empty()) {
    LOG(WARNING) << "Left out, as their undistorted photos are not there: "
                 << Plural(static_cast<int64_t>(result.without_photo.size()), "mask") << " ("
                 << FirstNames(result.without_photo) << ").";
  }
}

}  // namespace

void RunMaskUndistorter(int argc, char** argv) {
  UndistorterOptions undistorter;
  OptionManager options(
      "mask_undistorter",
      "Makes masks for the photos of a workspace that COLMAP's image_undistorter wrote, from the "
      "masks of the photos that it was given: 16-bit PNGs of the same ids, and labels.json. Reads "
      "both models, and no photos.");
  AddOptions(&options, &undistorter);
  if (!options.Parse(argc, argv)) return;
  const bool is_ignore = !undistorter.ignore_path.empty();
  if (is_ignore) {
    options.RequireEffect({"mask_path", "labels_path"},
                          "with --ignore_path; a run for each, into a folder for each, would be "
                          "right");
  } else {
    options.RequireEffect({"invert"}, "without --ignore_path; give both, or neither");
  }
  MaskedModelPaths paths;
  if (is_ignore) {
    paths.model_folder = FindModelFolder(undistorter.input_path);
  } else {
    paths = FindMaskedModel(
        /*workspace_path=*/"", undistorter.input_path, undistorter.masks, /*needs_model=*/true);
  }
  const fs::path undistorted_folder = FindModelFolder(undistorter.undistorted_path);
  const OutputLock lock(undistorter.output_path);
  const UndistortedPhotos photos = PairUndistorted(ReadRegistered(paths.model_folder),
                                                   paths.model_folder,
                                                   ReadRegistered(undistorted_folder),
                                                   undistorted_folder);
  const MaskUndistortion result =
      is_ignore
          ? UndistortIgnoredPixels(photos,
                                   undistorter.ignore_path,
                                   FindIgnoreFiles(undistorter.ignore_path, photos.OriginalNames()),
                                   undistorter.invert,
                                   undistorter.output_path)
          : UndistortMasks(photos, paths.mask_folder, paths.labels_file, undistorter.output_path);
  LogResult(undistorter, photos, result);
}

}  // namespace semfoam
