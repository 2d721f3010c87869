// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/enum_names.h"
#include "foam/image/image.h"
#include "foam/model/model.h"

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace semfoam {

// Writes masks of photos in the formats that other programs train on.

enum class MaskOutput {
  kPng16,    // <photo>.png, 16-bit grey
  kPalette,  // <photo>.png, 8-bit palette, as DEVA, SAM 2 and DAVIS have it
  kCoco      // instances.json: COCO annotations with compressed run lengths and track ids
};
inline constexpr EnumName<MaskOutput> kMaskOutputNames[] = {
    {MaskOutput::kPng16, "png"}, {MaskOutput::kPalette, "palette"}, {MaskOutput::kCoco, "coco"}};

// Receives masks of photos one after another.
class MaskWriter {
 public:
  virtual ~MaskWriter() = default;
  // `ids` are those of `labels`, 0 = none. Throws UserError where a file cannot be written.
  virtual void Add(const std::string& photo, const LabelImage& ids) = 0;
  // Writes what belongs to all of them.
  virtual void Finish() = 0;
};

// Makes a writer into `folder` for masks of these photos, with these labels; all writers write
// labels.json. Throws UserError, before anything is written: for kPalette, an id above 255; files
// that exist in the folder and were not written by this program.
std::unique_ptr<MaskWriter> MakeMaskWriter(MaskOutput output,
                                           const std::filesystem::path& folder,
                                           const std::vector<std::string>& photos,
                                           const std::vector<Label>& labels);

}  // namespace semfoam
