// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/geometry/delaunay.h"
#include "foam/model/model.h"

#include <cstdint>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace semfoam {

// Packs a foam for the report's page, which walks it in a fragment shader
// (tools/report_page/foam_data.ts reads it). Lossy: 8 bits for a cell's SH coefficients of degree 1
// and higher, its colour gradient and its identity, each with a scale of its own; half precision
// for its density and its mean colour; positions stay float.

// Bytes of a cell's record before its SH coefficients of degree 1 and higher:
//    0  half       density after the activation, per normalised unit
//    2  3 halves   SH coefficients of degree 0
//    8  uint16     class in Model::labels, kNoPackedClass without; kLooseCell is set where the cell
//                  is part of no object
//   10  3 int8     exponents of the gradient, the SH coefficients and the identity:
//                  value = integer * 2^exponent
//   13  9 int8     colour gradient (Foam::color_gradient)
//   22  3 int8     per coefficient of degree 1 and higher: SH coefficients
inline constexpr int kPackedHeadBytes = 22;
// The least exponent of SH coefficients, whose step is then 1/128 of white.
inline constexpr int kPackedColorExponent = -7;
inline constexpr uint16_t kNoPackedClass = 0x7fff;
inline constexpr uint16_t kLooseCell = 0x8000;

struct PackedFoam {
  // Numbers of sites, cells (guards included), classes and record bytes, and where each section
  // begins in `bytes`, for foam_data.ts.
  nlohmann::json Header() const;

  // Cells that were left out; 0: all are there.
  int64_t num_left_out = 0;
  uint32_t num_sites = 0;
  uint32_t num_cells = 0;
  int num_classes = 0;
  int sh_degree = 0;
  // A multiple of 16.
  int record_bytes = 0;

  // Little-endian, one after the other:
  //   positions   [3][4][num_cells] bytes: for each axis the bits of the float, less those of the
  //               cell before (of the first: as they are), zigzag (0, -1, 1, -2 ... are 0, 1, 2,
  //               3 ...), their lowest bytes first
  //   classifier  [num_classes][kIdentityDim + 1] float, the bias last
  //   records     [num_sites][record_bytes]
  //   identities  [num_sites][kIdentityDim] int8; nothing without semantics
  //   neighbours  LEB128, for each cell: the number of its neighbours of higher index, then the
  //               differences of their ascending indices, from its own
  std::string bytes;
  size_t classifier_begin = 0;
  size_t records_begin = 0;
  size_t identities_begin = 0;
  size_t neighbors_begin = 0;
};

// Packs at most `max_cells` sites of a model (0: all): those that matter most to the training
// photos, by the largest contribution of a cell or a neighbour of it, since the faces of visible
// cells are where empty ones begin. `delaunay` is the triangulation of the model's sites and the
// guards; `object_of_cell` is ExportableScene::object_of_cell, empty where the model has no
// semantics. CHECKs their sizes.
PackedFoam PackFoam(const Model& model,
                    const Delaunay& delaunay,
                    const std::vector<int32_t>& object_of_cell,
                    int64_t max_cells);

}  // namespace semfoam
