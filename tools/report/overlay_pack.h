// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/exportable_scene.h"
#include "foam/model/model.h"

#include <cstdint>
#include <filesystem>
#include <string>

#include <nlohmann/json.hpp>

namespace semfoam {

// What the report's page shows besides the foam (tools/report_page/overlay_data.ts reads it):
// surfaces of the objects, and SfM points. Positions are in the normalised frame, with 16 bits
// along each edge of their box. Little-endian; every part begins at a multiple of 4.
struct PackedOverlays {
  // {"surfaces": [{"object": index, "vertices": n, "triangles": n, "begin", "origin": [3],
  // "step": [3]}, ...], "points": {"points": n, "begin", "origin", "step"} or null, "bytes": n}
  // A position is origin + step * integers.
  //
  // A surface: [vertices][3] uint16, [vertices][3] uint8 colours, display values, padding,
  // [triangles][3] uint32. Points: [points][3] uint16, [points][3] uint8.
  nlohmann::ordered_json header;
  std::string bytes;
};

// Packs the smooth surface of every object (ExtractSmoothSurface), with at most `max_faces`
// triangles in all, and at most `max_points` points of the COLMAP model in `input_path`, spread
// evenly over those seen in at least three photos; no points where `input_path` is empty. Throws
// UserError where the COLMAP model is damaged.
PackedOverlays PackOverlays(const Model& model,
                            const ExportableScene& scene,
                            const std::filesystem::path& input_path,
                            int64_t max_faces,
                            int64_t max_points);

}  // namespace semfoam
