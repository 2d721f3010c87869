// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/model/model.h"
#include "plugin/colmap/camera_rays.h"

#include <cstdint>
#include <memory>
#include <vector>

namespace semfoam {

// Chooses the distorted cameras whose rays are tabulated, and makes the rays of each photo. Photos
// of one camera share them.

// Returns the first view of each camera whose rays are worth a table: those of the most photos
// first, as long as all tables take 1 GiB at most.
std::vector<int> ChooseTables(const std::vector<PhotoRecord>& photos);

// Returns the bytes of the tables of these views.
uint64_t RayTableBytes(const std::vector<PhotoRecord>& photos, const std::vector<int>& table_views);

// Returns the rays of each photo. `table_views` are those of ChooseTables.
std::vector<std::shared_ptr<const PixelRays>> MakePhotoRays(const std::vector<PhotoRecord>& photos,
                                                            const std::vector<int>& table_views);

}  // namespace semfoam
