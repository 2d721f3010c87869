// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/model/model.h"

#include <cstdint>
#include <vector>

namespace semfoam {

// What a model keeps per site, taken together: positions, densities, colours, identities and
// statistics stay rows of the same site.

// The model with these sites alone (indices, in this order, repeated ones as often); classifier,
// labels, photos, frame and options as they are.
Model WithSites(const Model& model, const std::vector<uint32_t>& sites);

// Puts the sites of `other` behind those of `model`; everything else of `other` is left out. CHECKs
// that both have the same SH degree, and both or neither identities and each kind of statistics.
void AppendSites(const Model& other, Model* model);

// Brings the sites into Hilbert order, as a Foam has them.
void SortSites(Model* model);

// Raises the degree of the spherical harmonics: colours stay the same.
void RaiseShDegree(int sh_degree, Foam* foam);

// A site without matter, and statistics (as far as the model has any) that say that rays pass it.
void MakeEmpty(uint32_t site, Model* model);

// Statistics as `like` has them, no more and no fewer. Those that are missing say that the photos
// show every cell as what it is: opaque, in the colour of the constant SH term.
void MatchStatistics(const CellStatistics& like, Model* model);

}  // namespace semfoam
