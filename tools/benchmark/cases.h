// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>

// One function per subject; what each measures stands in its file. `num_sites` is the size of the
// scene (scenes.h) and the end of the cases' names.
//
// Each case gives its rates, `bytes_per_site` (what it keeps in memory for each site) and, as the
// floor of its memory traffic, the bytes that one step, ray, site or update has to touch.

namespace semfoam {

void RegisterDelaunayCases(int64_t num_sites);  // delaunay
void RegisterWalkCases(int64_t num_sites);      // walk/scalar, walk/simd, walk/interleaved
void RegisterRenderCases(int64_t num_sites);    // render/forward, render/backward
void RegisterUpdateCases(int64_t num_sites);    // update
void RegisterVoxelizeCases(int64_t num_sites);  // voxelize

// render/forward/foam, render/backward/foam and voxelize/foam, on the scene of a trained foam.
void RegisterRenderCases(const std::filesystem::path& foam_file);
void RegisterVoxelizeCases(const std::filesystem::path& foam_file);

}  // namespace semfoam
