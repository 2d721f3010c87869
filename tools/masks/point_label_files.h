// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/model/model.h"
#include "plugin/colmap/colmap_model.h"
#include "plugin/mask/point_labels.h"

#include <filesystem>
#include <vector>

namespace semfoam {

// Writes labelled points. Each file is written beside its target and renamed into place; all
// functions throw UserError where that is not possible. Everything is in the COLMAP frame, in the
// order of the model.

// Returns the model with its points in the colours of their labels (LabelColor), grey without a
// label; everything else is unchanged.
Reconstruction ColoredByLabel(const Reconstruction& model,
                              const std::vector<PointLabel>& points,
                              const std::vector<Label>& labels);

// Writes a PLY, binary little-endian, with one vertex for each point: double x y z, uchar red green
// blue (the model's own colours, as in the photos), int label (0 = none), float confidence.
void WritePointsPly(const std::filesystem::path& path,
                    const Reconstruction& model,
                    const std::vector<PointLabel>& points,
                    const std::vector<Label>& labels);

// Writes points_labels.json: the label table (LabelTableJson); the number of points and of labelled
// points; and under "objects" for every label but id 0: id, name, color, points, the mean of their
// confidence, and, if there are points, the bounding_box and the names of the photos that observe
// them.
void WritePointLabelsJson(const std::filesystem::path& path,
                          const Reconstruction& model,
                          const MaskedPhotos& photos,
                          const std::vector<PointLabel>& points,
                          const std::vector<Label>& labels);

}  // namespace semfoam
