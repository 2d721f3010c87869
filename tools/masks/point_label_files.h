// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/model/model.h"
#include "plugin/colmap/colmap_model.h"
#include "plugin/mask/point_labels.h"

#include <filesystem>
#include <vector>

namespace semfoam {

// What labelled points leave; each file is written beside its target and renamed into place, and
// all throw UserError where that is not possible. Everything is in the COLMAP frame, in the order
// of the model.

// The model with its points in the colours of their labels (LabelColor), grey where there is none;
// all else is as it was.
Reconstruction ColoredByLabel(const Reconstruction& model,
                              const std::vector<PointLabel>& points,
                              const std::vector<Label>& labels);

// PLY, binary little-endian, one vertex for each point: double x y z, uchar red green blue (the
// model's own colours: what the photos show), int label (0 = none), float confidence.
void WritePointsPly(const std::filesystem::path& path,
                    const Reconstruction& model,
                    const std::vector<PointLabel>& points,
                    const std::vector<Label>& labels);

// points_labels.json: the label table, as other files of labels have it; how many points there are
// and how many have a label; and under "objects" for every label but id 0: id, name, color, points,
// the mean of their confidence, and, where there are points, the bounding_box and the names of the
// photos that see them.
void WritePointLabelsJson(const std::filesystem::path& path,
                          const Reconstruction& model,
                          const MaskedPhotos& photos,
                          const std::vector<PointLabel>& points,
                          const std::vector<Label>& labels);

}  // namespace semfoam
