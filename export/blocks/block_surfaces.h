// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/blocks/block_scene.h"
#include "export/scene/exportable_scene.h"
#include "export/scene/object_surface.h"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// Gives the cells of a block, and those around it, the objects of FindBlockObjects. The objects of
// `block->scene` have the cells of this block alone.
void TakeObjects(const ExportableScene& objects, BlockScene* block);

// Writes into `folder` the faces around the cells of every object of a block (ExtractFaces), after
// TakeObjects, for JoinSurface. Throws UserError where a file cannot be written.
void WriteSurfacePieces(const BlockScene& block,
                        size_t number,
                        const std::filesystem::path& folder);

// The surface of one object.
struct JoinedSurface {
  // As ExtractSurface makes it, but in another order, and without vertex_tet and triangle_cells.
  ObjectSurface surface;
  // The vertices in the normalised frame, and their distances from the sites whose cells meet
  // there.
  std::vector<Eigen::Vector3d> normalized;
  std::vector<double> distances;
};

// Joins the pieces of an object of `objects` that WriteSurfacePieces has written for all blocks. A
// vertex on a seam is in the pieces of more than one block: it is recognised by the four sites
// whose cells meet there, never by its position. So the surface is closed and a manifold exactly as
// that of the whole foam is. Throws UserError where a file cannot be read.
JoinedSurface JoinSurface(const ExportableScene& objects,
                          size_t object,
                          size_t num_blocks,
                          const std::filesystem::path& folder);

// Adds to an object of FindBlockObjects what its surface tells: area, centroid, cavities and genus.
void DescribeBySurface(const ObjectSurface& surface, ObjectInfo* object);

}  // namespace semfoam
