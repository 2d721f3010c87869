// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/exportable_scene.h"
#include "foam/model/model.h"

#include <vector>

#include <Eigen/Core>

namespace semfoam {

// What photos show of each cell, display values in 0..1: CellStatistics::mean_color where the model
// has statistics, else the view-independent part of the spherical harmonics.
std::vector<Eigen::Vector3f> DisplayColors(const Model& model);

// How much each cell's colour counts beside those of its neighbours: the largest weight that it had
// in a training ray (CellStatistics::contribution); next to nothing for a cell that is not
// photographed; 1 for all where the model has no statistics.
std::vector<float> ColorWeights(const Model& model, const std::vector<uint8_t>& photographed);

// No photo says which colour the cells are that are not photographed: what training left there is
// off by 0.1 to 0.2 from the surface around, and mostly darker. So those of an object take the mean
// of their neighbours in the object, layer by layer from the photographed ones inwards.
void SpreadColors(ExportableScene* scene);

}  // namespace semfoam
