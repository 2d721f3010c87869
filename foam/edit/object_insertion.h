// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/edit/object_editing.h"
#include "foam/geometry/delaunay.h"
#include "foam/model/model.h"

#include <cstddef>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// Where an object goes: x_scene = scale * rotation * x_object + translation, both in the COLMAP
// frames of their models.
struct ObjectPlacement {
  double scale = 1;                                        // > 0
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();  // orthonormal, determinant 1
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  Eigen::Vector3d Apply(const Eigen::Vector3d& x) const {
    return scale * (rotation * x) + translation;
  }
};

// The objects as cells of the scene's normalised frame: positions moved, colours turned with them
// (ShRotation), densities such that the optical depth across them stays, SH degree and statistics
// as the scene has them (the degree at least). Throws UserError when a cell of an object would lie
// beyond kFarRadius; ring sites that would are left out.
ExtractedObjects PlaceObjects(ExtractedObjects objects,
                              const ObjectPlacement& placement,
                              const Model& scene);

struct Insertion {
  Model model;
  std::vector<Label> labels;  // of the objects, in their order, as they are in the model
  size_t num_removed = 0;     // cells of the scene that were where an object is now
  size_t num_ring_sites = 0;  // sites that now bound the objects, with the scene's matter or air
};

// Puts objects that PlaceObjects has placed into a scene. `delaunay` is the scene's.
//
// A cell of the scene goes if its site lies in a cell of an object, or so near that it would cut
// into one. No convex hull: what stands in the hole of a ring stays. The object's ring says where
// the object ends, and what begins there is the scene's: each ring site takes all that the scene's
// cell has at its place, unless that has a site hard by. So objects that are inserted where they
// were taken from leave the scene as it was, objects that are put on a table leave the table whole,
// and nothing grows into the place of the cells that went, because the ring lies before it.
//
// Each object becomes a class of its own (AddClass, WithFreeId), and all its cells get that
// class's feature; the scene's cells keep theirs. Frame, photos and options are the scene's.
Insertion InsertObjects(const Model& scene,
                        const Delaunay& delaunay,
                        const ExtractedObjects& placed);

}  // namespace semfoam
