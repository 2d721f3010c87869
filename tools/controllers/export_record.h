// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/export_transform.h"
#include "export/scene/exportable_scene.h"
#include "foam/util/ids.h"
#include "tools/controllers/export_format.h"

#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

namespace semfoam {

// Reads and writes the record of the exports in an output folder, its labels.json: their foam and
// their frame. Every file belongs to one foam: only files that this record lists are ever removed
// or replaced by a later export. A command that exports calls RequireSameFoam and RequireOneFrame
// before it writes a file, and WriteLabels when all are written.

// Returns the checksum at the end of a model's file (WriteModel), 16 hexadecimal digits, for
// VolumeExportOptions::source_checksum. Throws UserError where the file cannot be read.
std::string ModelChecksum(const std::filesystem::path& foam_path);

struct ExportRecord {
  struct File {
    // Id of the object's label; kNoObject: the whole scene.
    LabelId object_id = kNoObject;
    // Key in labels.json.
    std::string format;
    // Path relative to the folder, such as objects/7_mug.ply.
    std::string path;
  };
  // ModelChecksum; empty: written by a version without this key.
  std::string foam_checksum;
  // ExportTransformJson.
  std::string frame;
  // The table "labels", by id.
  std::map<LabelId, std::string> label_names;
  // The names in "objects", by id.
  std::map<LabelId, std::string> object_names;
  // The existing files.
  std::vector<File> files;
};

// Reads the record in `output_path`; returns nothing without a labels.json. Throws UserError where
// that is no JSON, was not written by an export and would be lost, or has another version of the
// format.
std::optional<ExportRecord> ReadExportRecord(const std::filesystem::path& output_path);

// Returns whether the record's files are in the frame of `transform`.
bool IsInFrame(const ExportRecord& record, const ExportTransform& transform);

// Throws UserError where an export of the foam of this checksum cannot be written into
// `output_path`: it holds another scene.foam, or a labels.json that ReadExportRecord refuses. Must
// be called before any work.
void RequireSameFoam(const std::filesystem::path& output_path, const std::string& foam_checksum);

// Throws UserError where `output_path` holds exports of this foam in another frame and `formats`
// would not replace all of them: labels.json can describe only one frame. Exports of another foam
// are removed later (WriteLabels).
void RequireOneFrame(const ExportTransform& transform,
                     const std::filesystem::path& output_path,
                     const std::set<ExportFormat>& formats,
                     const std::string& foam_checksum);

// Warns where the exports in `output_path` are of another foam than the scene.foam there. Must be
// called after a training without exports.
void WarnOfOtherExports(const std::filesystem::path& output_path);

// The files of an export, and their foam.
struct FinishedExport {
  std::string foam_checksum;
  std::vector<WrittenFile> files;
  // Whether the foam was just trained, so that the files of an older labels.json are of another
  // one.
  bool is_new_foam = false;
};

// Writes labels.json, which lists the files of this export and those of the folder's record that
// are of the same foam and objects. Must be called when all files have been written. First removes
// the files of the folder's record that are of another foam, of objects that `scene` no longer has
// or that have another name, or in another frame, and logs them in a warning. If the record has no
// checksum of the foam, the files stay (unless the foam is new), with a warning.
void WriteLabels(const ExportableScene& scene,
                 const std::filesystem::path& output_path,
                 const FinishedExport& finished);

}  // namespace semfoam
