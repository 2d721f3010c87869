// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/geometry/delaunay.h"
#include "foam/model/foam.h"
#include "foam/render/walk.h"

#include <cstddef>
#include <cstdint>
#include <vector>

// What the data structures hold and what using them has to touch. Bytes.

namespace semfoam {

template <typename Vector>
size_t BytesOf(const Vector& values) {
  return values.size() * sizeof(values[0]);
}

inline size_t BytesOf(const Delaunay& delaunay) {
  return BytesOf(delaunay.offsets) + BytesOf(delaunay.neighbors) + BytesOf(delaunay.tets) +
         BytesOf(delaunay.tet_neighbors);
}

// All that a walk reads.
inline size_t WalkBytes(const WalkGeometry<float>& geometry) {
  return BytesOf(geometry.positions) + BytesOf(geometry.first_block) + BytesOf(geometry.blocks);
}

// What a step out of `cell` has to read: its site, where its blocks begin and end, their planes,
// and the one neighbour that it goes to.
inline size_t StepBytes(const WalkGeometry<float>& geometry, uint32_t cell) {
  using Block = PlaneBlock<float>;
  const size_t blocks = geometry.first_block[cell + 1] - geometry.first_block[cell];
  return sizeof(geometry.positions[cell]) + 2 * sizeof(geometry.first_block[cell]) +
         blocks * (sizeof(Block) - sizeof(Block::neighbor)) + sizeof(uint32_t);
}

// A cell's colour and identity.
inline size_t AppearanceBytes(const Foam& foam) {
  return sizeof(float) * (foam.ShStride() + (foam.HasSemantics() ? kIdentityDim : 0));
}

}  // namespace semfoam
