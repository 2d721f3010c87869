// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/exportable_scene.h"

#include <cstdint>
#include <vector>

#include <Eigen/Geometry>

namespace semfoam {

// Where an object stands on another one, or leans on it: no photo shows what is between them, the
// cells there are large, and their labels and densities chance.
struct ContactPlane {
  // Normalised frame; the normal points out of the object.
  Eigen::Hyperplane<double, 3> plane;
  // Median radius of the supporting object's cells around the contact.
  double length = 0;
};

// Finds the flat surfaces of other objects that an object touches: planes through what photos show
// of them around the contact, by least squares without outliers. There is none where such points
// are few or not flat (half of them within a `length` of the plane), or where photos show more
// than 3 % of the object's cells beyond the plane: then it does not end there. Without figures of
// the rays (ExportableScene::crossed) there are none.
std::vector<ContactPlane> ContactPlanes(const ExportableScene& scene, const ObjectInfo& object);

// Returns the cells of an object whose sites are on its side of the planes, and hidden cells of no
// object between them and a plane: those with more than 62 % of their neighbours, each by the
// inverse of its distance, in the object or beyond the plane. `cells` and the result ascend.
std::vector<uint32_t> CellsUpToContacts(const ExportableScene& scene,
                                        const std::vector<ContactPlane>& contacts,
                                        const std::vector<uint32_t>& cells);

}  // namespace semfoam
