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

// What the labels.json of an output folder says of the exports there: of which foam and in which
// frame they are. Every file belongs to one foam: only files that this record lists are ever
// removed or claimed by a later export. A command that exports asks RequireSameFoam and
// RequireOneFrame before it writes a file, and calls WriteLabels when all are written.

// Returns the checksum at the end of a model's file (WriteModel), 16 hexadecimal digits, as
// VolumeExportOptions::source_checksum has it. Throws UserError where the file cannot be read.
std::string ModelChecksum(const std::filesystem::path& foam_path);

struct ExportRecord {
  struct File {
    // The object's label; kNoObject = the whole scene.
    LabelId object_id = kNoObject;
    // The key in labels.json.
    std::string format;
    // Relative to the folder, one that exports write (objects/7_mug.ply).
    std::string path;
  };
  // See ModelChecksum; empty = written before there was the key.
  std::string foam_checksum;
  // JSON, as ExportTransformJson writes it.
  std::string frame;
  // The table "labels", by id.
  std::map<LabelId, std::string> label_names;
  // The names in "objects", by id.
  std::map<LabelId, std::string> object_names;
  // The files that are there.
  std::vector<File> files;
};

// Reads the record in `output_path`; nothing where there is no labels.json. Throws UserError where
// that is no JSON, was not written by an export, and so would be lost, or is of another version of
// its format.
std::optional<ExportRecord> ReadExportRecord(const std::filesystem::path& output_path);

// Returns whether the record's files are in the frame of `transform`.
bool IsInFrame(const ExportRecord& record, const ExportTransform& transform);

// Throws UserError where an export of the foam of this checksum cannot go into `output_path`: it
// holds another scene.foam, or a labels.json that ReadExportRecord refuses. To be called before any
// work.
void RequireSameFoam(const std::filesystem::path& output_path, const std::string& foam_checksum);

// Throws UserError where `output_path` holds exports of this foam in another frame of which
// `formats` would not replace all: labels.json could not be true of both. What is there of another
// foam goes (WriteLabels).
void RequireOneFrame(const ExportTransform& transform,
                     const std::filesystem::path& output_path,
                     const std::set<ExportFormat>& formats,
                     const std::string& foam_checksum);

// Warns where the exports in `output_path` are of another foam than the scene.foam that has been
// written there. To be called where exports do not follow.
void WarnOfOtherExports(const std::filesystem::path& output_path);

// What an export wrote, and of which foam.
struct FinishedExport {
  std::string foam_checksum;
  std::vector<WrittenFile> files;
  // Whether the foam was just trained: what an older labels.json lists is not of it.
  bool is_new_foam = false;
};

// Writes labels.json, which lists what this export wrote and what the folder's record listed of the
// same foam and objects. To be called when all files have been written. First removes the files
// that the folder's record lists and that are of another foam, of objects that `scene` no longer
// has or calls by another name, or in another frame; names them in a warning. Of a record that does
// not say of which foam its files are, they stay (unless the foam is new), with a warning.
void WriteLabels(const ExportableScene& scene,
                 const std::filesystem::path& output_path,
                 const FinishedExport& finished);

}  // namespace semfoam
