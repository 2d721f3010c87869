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
  // A PLY, or an OBJ without `split`.
  std::filesystem::path input;
  // Created if it does not exist.
  std::filesystem::path output_path;
  // Whether to write each object as a file of its own, too, in objects/.
  bool split = false;
  // LabelTransferOptions::smoothness.
  double smoothness = -1;
  // With `split`, of a mesh: whether the boundaries of each object are closed.
  bool cap = false;
};

// Throws UserError where the folder holds a labels.json, a file of the name of the input, or, for
// `split`, a folder of objects, that WriteLabelled has not written. Must be called before any work.
void RequireRoomForLabelled(const std::filesystem::path& output_path,
                            const std::filesystem::path& file,
                            bool split);

// Copies the input with the labels of `source`, and logs what was written. `source_checksum` is
// ModelChecksum of the foam, empty for masks. Throws UserError as TransferLabels does.
TransferredLabels WriteLabelled(LabelSource* source,
                                const LabelledFiles& files,
                                const std::string& source_checksum);

}  // namespace semfoam
