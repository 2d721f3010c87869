// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/exportable_scene.h"
#include "foam/model/model.h"
#include "foam/render/cell_shading.h"
#include "foam/render/walk.h"
#include "foam/view/view_renderer.h"
#include "plugin/colmap/camera_models.h"

#include <cstdint>
#include <filesystem>
#include <vector>

namespace semfoam {

// Returns the photo's camera with `max_size` pixels along its longer side, or its own where it has
// fewer. Throws UserError naming `foam_path` when the record holds no valid camera.
Camera CoarseCamera(const PhotoRecord& photo,
                    double max_size,
                    const std::filesystem::path& foam_path);

// Finds what a foam shows where few rays say enough: no colours, and the triangulation that an
// export has anyway.
class CoarseViews {
 public:
  // `foam` and `scene`, which is made of it, must outlive this.
  CoarseViews(const Foam& foam, const ExportableScene& scene);

  // The cell in which the transmittance of a ray falls to 1/2, the depth of depth maps.
  struct Stop {
    // kNoCell: the ray gets through.
    uint32_t cell = kNoCell;
    // Distance from the origin at which the ray leaves it, in the normalised frame.
    float distance = 0;
  };
  // Returns the stops of the rays, in their order. In parallel; the same on any number of threads.
  std::vector<Stop> Look(const CameraRays& rays) const;

 private:
  const ExportableScene& scene_;
  const std::vector<float> density_;
  WalkGeometry<float> geometry_;
  CellShading<float> shading_;
};

// Distances of what the rays of a coarse camera show; infinite where that is nothing.
struct CoarseDistances {
  int width = 0;
  int height = 0;
  // [height][width]
  const std::vector<float>& distance;
};

// Returns the largest distance of what a photo shows around the pixel (x, y) of the coarse camera:
// of the pixel and its eight neighbours, for a coarse pixel is wide. With `keeps_off_outlines`,
// returns the smallest one instead where that is below 0.95 of the largest: there is the outline of
// something nearer, and a coarse pixel does not say on which side of it a place lies.
float FarthestVisible(const CoarseDistances& view, int x, int y, bool keeps_off_outlines);

}  // namespace semfoam
