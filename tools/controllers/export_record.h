// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/export_transform.h"
#include "export/scene/exportable_scene.h"

#include <cstdint>
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
    int32_t object_id = 0;  // 0 = the whole scene
    std::string format;     // the key in labels.json
    std::string path;       // relative to the folder, one that exports write (objects/7_mug.ply)
  };
  std::string foam_checksum;  // see ModelChecksum; empty = written before there was the key
  std::string frame;          // JSON, as ExportTransformJson
  std::map<int32_t, std::string> label_names;   // "labels"
  std::map<int32_t, std::string> object_names;  // of "objects"
  std::vector<File> files;                      // those that are there
};

// Reads the record in `output_path`; nothing where there is no labels.json. Throws UserError where
// that is no JSON, was not written by an export, and so would be lost, or is of another version of
// its format.
std::optional<ExportRecord> ReadExportRecord(const std::filesystem::path& output_path);

// Whether its files are in the frame of `transform`.
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
                     const std::set<std::string>& formats,
                     const std::string& foam_checksum);

// Warns where the exports in `output_path` are of another foam than the scene.foam that has been
// written there. To be called where exports do not follow.
void WarnOfOtherExports(const std::filesystem::path& output_path);

// What an export wrote, and of which foam.
struct FinishedExport {
  std::string foam_checksum;
  std::vector<WrittenFile> files;
  bool is_new_foam = false;  // just trained: what an older labels.json lists is not of it
};

// To be called when all files have been written. Removes the files that the folder's record lists
// and that are of another foam, of objects that `scene` no longer has or calls by another name, or
// in another frame; names them in a warning. Of a record that does not say of which foam its files
// are, they stay (unless the foam is new), with a warning. Then writes labels.json, which lists
// what this export wrote and what the record listed of the same foam and objects.
void WriteLabels(const ExportableScene& scene,
                 const std::filesystem::path& output_path,
                 const FinishedExport& finished);

}  // namespace semfoam
