// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/enum_names.h"
#include "export/scene/exportable_scene.h"
#include "export/texture/texture_photos.h"
#include "foam/model/model.h"
#include "plugin/dataset/scene_options.h"

#include <filesystem>
#include <memory>

namespace semfoam {

enum class TextureFormat { kPng, kJpeg };
inline constexpr EnumName<TextureFormat> kTextureFormatNames[] = {{TextureFormat::kPng, "png"},
                                                                  {TextureFormat::kJpeg, "jpeg"}};

// Returns the photos of the foam's training, in full resolution and with their masks, for textures.
// `photos` says where they are; the size to which photos are reduced is ignored, what it says of
// held-out photos and masks only shapes the correction of masks. `model` was read from `foam_path`,
// `scene` made of it; both must outlive the result.
//
// - Light: gains, vignetting and shading are those in the effects.json beside the foam, where there
//   is one.
// - Masks: labels are found by their ids in the masks (Label::source_id).
// - Photos that were held out of the training are not used, nor those that it did not have.
// - Visible is what is no farther away than the foam's depth (CoarseViews), with a margin of 2 %
//   and of two of its pixels; in photos without masks also not within one or two of these of the
//   outline of something nearer, which would leave its colours there.
//
// Decoded photos are kept while they fit into a quarter of the memory that is available at first.
// Throws UserError where a file is missing or damaged, and where no photo of the folder was taken
// by a camera of the foam at the same place.
std::unique_ptr<TexturePhotos> MakeTextureSource(const Model& model,
                                                 const ExportableScene& scene,
                                                 const std::filesystem::path& foam_path,
                                                 SceneOptions photos,
                                                 TextureFormat format);

}  // namespace semfoam
