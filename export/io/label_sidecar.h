// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/exportable_scene.h"

#include <filesystem>
#include <string>
#include <vector>

namespace semfoam {

// Returns the label table, as stored in VDB files: {"version": 1, "labels": {"7": "mug"}}. Ids are
// in the order of the table, without id 0; a label without a name is called "label_<id>". If the
// masks' own ids were renumbered, "source_ids": {"7": 81234} holds them.
std::string LabelTableJson(const std::vector<Label>& labels);

inline constexpr int kLabelSidecarVersion = 1;
// Key of the model's checksum, in labels.json and in the metadata of volumes.
inline constexpr char kSourceModelKey[] = "source_model_xxh64";

// Writes labels.json, whose schema is in export/README.md: the label table; the checksum of the
// model (VolumeExportOptions::source_checksum) unless it is empty; "frame", as in
// ExportTransformJson; under "files" those of `files` that belong to the whole scene, {"glb":
// "scene.glb", ...}; under "objects" every object of the scene with the fields of ObjectInfo and
// its own "files": {"ply": "objects/7_mug.ply", ...}; and under "labels_left_out" the labels whose
// objects are left out, with the reason, if any; and under "leftovers" the fragments among them
// (LeaveOutFragments) as one entry, if any: their ids, all cells, the volume and the limits. The
// file is also a valid input (ReadLabelNames),
// which reads only "labels" and "source_ids". Throws UserError when the file cannot be written.
void WriteLabelSidecar(const std::filesystem::path& path,
                       const ExportableScene& scene,
                       const std::vector<WrittenFile>& files,
                       const std::string& source_checksum = {});

}  // namespace semfoam
