// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/transfer/label_source.h"
#include "export/transfer/label_transfer.h"

#include <filesystem>
#include <string>

namespace semfoam {

// The files of a mesh or point cloud with labels (export/transfer/label_transfer.h): itself, under
// its name, and labels.json.
struct LabelledFiles {
  // Of a MeshFormat.
  std::filesystem::path input;
  // Created if it does not exist.
  std::filesystem::path output_path;
  LabelTransferOptions options;
};

// Returns the labelled file, LabelledName in the folder. Throws UserError where the input cannot be
// labelled as requested (RequireLabelledFormat), or would be written over.
std::filesystem::path LabelledFile(const LabelledFiles& files);

// Throws UserError where the folder holds a labels.json, the labelled file, or, for
// LabelTransferOptions::split, a folder of objects, that WriteLabelled has not written. Must be
// called before any work.
void RequireRoomForLabelled(const LabelledFiles& files);

// Copies the input with the labels of `source`, and logs what was written. `source_checksum` is
// ModelChecksum of the foam, empty for masks. Throws UserError as TransferLabels does.
TransferredLabels WriteLabelled(LabelSource* source,
                                const LabelledFiles& files,
                                const std::string& source_checksum);

}  // namespace semfoam
