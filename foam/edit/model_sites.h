// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/model/model.h"

#include <cstdint>
#include <vector>

namespace semfoam {

// Operations on all per-site arrays of a model at once, so that positions, densities, colours,
// identities and statistics stay aligned.

// Returns the model with only these sites (indices, in this order, possibly repeated); classifier,
// labels, photos, frame and options are copied.
Model WithSites(const Model& model, const std::vector<uint32_t>& sites);

// Appends the sites of `other` to those of `model`; everything else of `other` is ignored. CHECKs
// that both have the same SH degree, and both or neither identities and each kind of statistics.
void AppendSites(const Model& other, Model* model);

// Sorts the sites in Hilbert order, which Foam requires.
void SortSites(Model* model);

// Raises the degree of the spherical harmonics: colours stay the same.
void RaiseShDegree(int sh_degree, Foam* foam);

// Makes a site transparent, and sets its statistics (those that the model has) to those of a cell
// that all rays pass.
void MakeEmpty(uint32_t site, Model* model);

// Gives the model the same kinds of statistics as `like`. Missing ones are filled as if the photos
// showed every cell: opaque, in the colour of its constant SH term.
void MatchStatistics(const CellStatistics& like, Model* model);

}  // namespace semfoam
