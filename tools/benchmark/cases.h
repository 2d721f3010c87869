// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>

// Registers the cases, one function per subject; each file documents its measurement. `num_sites`
// is the size of the scene (scenes.h) and the suffix of the cases' names.
//
// Each case reports its rates, `bytes_per_site` (its memory per site) and, as the lower bound of
// its memory traffic, the bytes that one step, ray, site or update has to access.

namespace semfoam {

void RegisterDelaunayCases(int64_t num_sites);  // delaunay
void RegisterWalkCases(int64_t num_sites);      // walk/scalar, walk/simd, walk/interleaved
void RegisterRenderCases(int64_t num_sites);    // render/forward, render/backward
void RegisterUpdateCases(int64_t num_sites);    // update
void RegisterVoxelizeCases(int64_t num_sites);  // voxelize

// Register render/forward/foam, render/backward/foam and voxelize/foam, on the scene of a trained
// foam.
void RegisterRenderCases(const std::filesystem::path& foam_file);
void RegisterVoxelizeCases(const std::filesystem::path& foam_file);

}  // namespace semfoam
