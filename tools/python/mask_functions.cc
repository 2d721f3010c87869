// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/python/mask_functions.h"

#include "foam/util/error.h"
#include "plugin/colmap/colmap_model.h"
#include "plugin/dataset/mask_choice.h"
#include "plugin/mask/mask_tables.h"
#include "plugin/mask/mask_undistortion.h"
#include "tools/masks/model_masks.h"
#include "tools/python/conversions.h"
#include "tools/support/output_lock.h"

#include <filesystem>
#include <optional>
#include <utility>

#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

namespace py = pybind11;

namespace semfoam::python {
namespace {

namespace fs = std::filesystem;

py::dict UndistortMasksOf(const fs::path& output_path,
                          const fs::path& input_path,
                          const fs::path& undistorted_path,
                          const std::optional<fs::path>& mask_path,
                          const std::optional<fs::path>& labels_path,
                          const std::optional<fs::path>& ignore_path,
                          bool invert) {
  if (mask_path.has_value() == ignore_path.has_value()) {
    throw UserError(mask_path ? "mask_path and ignore_path are both given"
                              : "neither mask_path nor ignore_path is given",
                    "; one of them would be right.");
  }
  if (ignore_path && labels_path) {
    throw FieldError("labels_path", " is given with ignore_path, whose masks have no labels.");
  }
  if (mask_path && invert) {
    throw FieldError("invert", " is given with mask_path; it is for masks of ignore_path.");
  }
  const auto [photos, result] = WithoutGil([&] {
    const fs::path original = FindModelFolder(input_path);
    const fs::path undistorted = FindModelFolder(undistorted_path);
    const OutputLock lock(output_path);
    UndistortedPhotos pairs = PairUndistorted(
        ReadRegistered(original), original, ReadRegistered(undistorted), undistorted);
    MaskUndistortion made =
        ignore_path ? UndistortIgnoredPixels(pairs,
                                             *ignore_path,
                                             FindIgnoreFiles(*ignore_path, pairs.OriginalNames()),
                                             invert,
                                             output_path)
                    : UndistortMasks(pairs,
                                     *mask_path,
                                     FindLabelsFile(labels_path.value_or(fs::path()), *mask_path),
                                     output_path);
    return std::pair(std::move(pairs), std::move(made));
  });
  py::dict dict;
  dict["masks"] = result.num_masks;
  dict["share_outside"] = result.share_outside;
  dict["zero_is_class"] = result.zero_is_class;
  dict["renumbered"] = result.num_renumbered;
  dict["without_photo"] = result.without_photo;
  dict["only_original"] = photos.only_original;
  dict["only_undistorted"] = photos.only_undistorted;
  return dict;
}

}  // namespace

void AddMaskFunctions(py::module_* module) {
  module->def(
      "undistort_masks",
      &UndistortMasksOf,
      py::arg("output_path"),
      py::kw_only(),
      py::arg("input_path"),
      py::arg("undistorted_path"),
      py::arg("mask_path") = py::none(),
      py::arg("labels_path") = py::none(),
      py::arg("ignore_path") = py::none(),
      py::arg("invert") = false,
      "Makes masks for the photos of COLMAP's image_undistorter from those of the photos that it "
      "was "
      "given, as `semfoam mask_undistorter` does: input_path is the COLMAP model that it read, "
      "undistorted_path its output folder, or the model in it. Writes 16-bit PNGs of ids, height x "
      "width of the undistorted cameras, and labels.json into the folder output_path, which is "
      "made "
      "if missing. The masks are those in mask_path, with the names in labels_path (None = "
      "labels.json in that folder or beside it), or binary ones of ignored pixels in ignore_path "
      "(invert = what is white is ignored); written are 0 for what is ignored, 65535 for the rest. "
      "Returns a dict: masks (number), share_outside (of the pixels, 0 to 1, which show no place "
      "of "
      "an original photo and are 0), zero_is_class (whether 0 is no object, instead of "
      "unlabelled), "
      "renumbered (number of ids that are others now, from above 65535; original_ids in "
      "labels.json "
      "has what they were), without_photo (masks left out), only_original, only_undistorted "
      "(photos "
      "of one model alone). Runs without the GIL. Raises Error.");
}

}  // namespace semfoam::python
