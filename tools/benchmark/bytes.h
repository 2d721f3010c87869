// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/geometry/delaunay.h"
#include "foam/model/foam.h"
#include "foam/render/walk.h"

#include <cstddef>
#include <cstdint>
#include <vector>

// Counts the bytes of the data structures, and the bytes that an operation has to read.

namespace semfoam {

template <typename Vector>
size_t BytesOf(const Vector& values) {
  return values.size() * sizeof(values[0]);
}

inline size_t BytesOf(const Delaunay& delaunay) {
  return BytesOf(delaunay.offsets) + BytesOf(delaunay.neighbors) + BytesOf(delaunay.tets) +
         BytesOf(delaunay.tet_neighbors);
}

// Returns the bytes of all arrays that a walk reads.
inline size_t WalkBytes(const WalkGeometry<float>& geometry) {
  return BytesOf(geometry.positions) + BytesOf(geometry.first_block) + BytesOf(geometry.blocks);
}

// Returns the bytes that a step out of `cell` has to read: its site, the range of its blocks, their
// planes, and the index of the next cell.
inline size_t StepBytes(const WalkGeometry<float>& geometry, uint32_t cell) {
  using Block = PlaneBlock<float>;
  const size_t blocks = geometry.first_block[cell + 1] - geometry.first_block[cell];
  return sizeof(geometry.positions[cell]) + 2 * sizeof(geometry.first_block[cell]) +
         blocks * (sizeof(Block) - sizeof(Block::neighbor)) + sizeof(uint32_t);
}

// Returns the bytes of a cell's colour and identity.
inline size_t AppearanceBytes(const Foam& foam) {
  return sizeof(float) * (foam.ShStride() + (foam.HasColorGradients() ? kColorGradientDim : 0) +
                          (foam.HasSemantics() ? kIdentityDim : 0));
}

}  // namespace semfoam
