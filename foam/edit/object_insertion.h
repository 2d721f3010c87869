// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/edit/object_editing.h"
#include "foam/geometry/delaunay.h"
#include "foam/geometry/sim3.h"
#include "foam/model/model.h"

#include <cstddef>
#include <vector>

namespace semfoam {

// The placement of an object: from the COLMAP frame of its model to that of the scene's.
using ObjectPlacement = Sim3;

// Transforms objects into the scene's normalised frame: moves the positions, rotates the colours
// (ShRotation), scales the densities so that the optical depth across a cell stays, and gives them
// at least the scene's SH degree and its kinds of statistics. Throws UserError when a cell of an
// object would lie beyond kFarRadius; ring sites that would are left out.
ExtractedObjects PlaceObjects(ExtractedObjects objects,
                              const ObjectPlacement& placement,
                              const Model& scene);

struct Insertion {
  Model model;
  // Labels of the objects in the model, in the order of the objects.
  std::vector<Label> labels;
  // Number of the scene's cells that the objects replaced.
  size_t num_removed = 0;
  // Number of ring sites kept around the objects, with the scene's matter or air.
  size_t num_ring_sites = 0;
};

// Inserts objects that PlaceObjects has placed into a scene. `delaunay` is the scene's.
//
// Removes a cell of the scene if its site lies in a cell of an object, or so near that it would cut
// into one. It uses no convex hull: matter in the hole of a torus stays. The ring sites bound the
// object, and belong to the scene: each takes the parameters of the scene's cell at its position,
// unless that cell's own site is very near. So objects that are inserted where they were extracted
// leave the scene unchanged, objects that are placed on a table leave the table intact, and no cell
// of the scene extends into the place of the removed cells, because the ring separates them.
//
// Each object gets its own class (AddClass, WithFreeId), and all its cells get that class's
// feature; the scene's cells keep theirs. Embeddings (LabelFeatures) of another length than the
// scene's are left out. Frame, photos and options are the scene's.
Insertion InsertObjects(const Model& scene,
                        const Delaunay& delaunay,
                        const ExtractedObjects& placed);

}  // namespace semfoam
