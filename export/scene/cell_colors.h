// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/exportable_scene.h"
#include "foam/model/model.h"

#include <vector>

#include <Eigen/Core>

namespace semfoam {

// Returns the colour of each cell in the photos, display values in 0..1: CellStatistics::mean_color
// if the model has statistics, else the view-independent part of the spherical harmonics.
std::vector<Eigen::Vector3f> DisplayColors(const Model& model);

// Returns the weight of each cell's colour in means over cells: the largest rendering weight of the
// cell in a training ray (CellStatistics::contribution); almost 0 for a cell that is not
// photographed; 1 for all if the model has no statistics.
std::vector<float> ColorWeights(const Model& model, const std::vector<uint8_t>& photographed);

// Gives the cells of an object that are not photographed the mean colour of their neighbours in the
// object, layer by layer from the photographed ones inwards. Their trained colours have no evidence
// in the photos: they differ by 0.1 to 0.2 from the surface around, and are mostly darker.
void SpreadColors(ExportableScene* scene);

}  // namespace semfoam
