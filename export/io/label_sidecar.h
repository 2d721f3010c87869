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
// File beside labels.json with the embeddings of the objects, and its key under "files".
inline constexpr char kEmbeddingsFile[] = "label_embeddings.npy";
inline constexpr char kEmbeddingsFormat[] = "npy";
// Key of the model's checksum, in labels.json and in the metadata of volumes.
inline constexpr char kSourceModelKey[] = "source_model_xxh64";

// Returns whether an object of the scene has an embedding.
bool HasEmbeddings(const ExportableScene& scene);

// Writes labels.json, whose schema is in export/README.md: the label table; the checksum of the
// model (VolumeExportOptions::source_checksum) unless it is empty; "frame", as in
// ExportTransformJson; under "files" those of `files` that belong to the whole scene, {"glb":
// "scene.glb", ...}; under "objects" every object of the scene with the fields of ObjectInfo, its
// own "files": {"ply": "objects/7_mug.ply", ...}, and those of "class", "score" and "embedding"
// ({"file": kEmbeddingsFile, "row": 0}) that its label has (LabelFeatures); and under
// "labels_left_out" the labels whose objects are left out, with the reason, if any; and under
// "leftovers" the fragments among them (LeaveOutFragments) as one entry, if any: their ids, all
// cells, the volume and the limits. The file is also a valid input (ReadLabelNames), which reads
// only "labels" and "source_ids". Where objects have embeddings, writes these beside it: a .npy of
// float32 [objects with an embedding][dimension]. Throws UserError when a file cannot be written.
void WriteLabelSidecar(const std::filesystem::path& path,
                       const ExportableScene& scene,
                       const std::vector<WrittenFile>& files,
                       const std::string& source_checksum = {});

}  // namespace semfoam
