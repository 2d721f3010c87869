// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/exportable_scene.h"
#include "export/transfer/polygon_mesh.h"
#include "foam/render/walk.h"

#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// Finds which matter of a foam is nearest to a place, and with it the place's label.
//
// Matter is the cells of objects, their hidden insides too, and the photographed cells of matter
// whose class is that of unlabelled pixels. Cells that an object has left out (crumbs, fragments)
// are none: their label is a mistake.
class MatterSearch {
 public:
  // `scene` must outlive the search. `tolerance` is the distance up to which matter is found, in
  // units of the files of the scene's frame; 0: a fiftieth of the diagonal of the robust extent of
  // the scene (MakeVolumeFrame), and at least three times the resolution.
  explicit MatterSearch(const ExportableScene& scene, double tolerance = 0);

  // In units of the files.
  double tolerance() const;
  // Median radius of the photographed cells of objects, in units of the files: what the foam can
  // tell apart.
  double resolution() const { return resolution_; }

  // Matter near a place.
  struct Found {
    // kNoCell: none within the tolerance.
    uint32_t cell = kNoCell;
    // In the normalised frame, at most the tolerance.
    double distance = 0;
  };

  // Finds the matter nearest to `x`, a place in the frame of the files. With a `normal`, of any
  // length and either sign, it is what the straight line along it meets first, forwards or
  // backwards, if it meets any; otherwise, or with a zero normal, the cell of matter that lies
  // nearest in any direction, by the plane between its site and that of the cell of `x`. `*hint` is
  // any cell at first, and the cell of the last place afterwards, with which the next one nearby is
  // found sooner.
  Found Find(const Eigen::Vector3d& x, const Eigen::Vector3d& normal, uint32_t* hint) const;

  // Returns the label of that matter: its object's id, and the softmax of the cell's class, or,
  // where that is not the object's (hidden insides), the confidence of the object. Without any
  // matter: no label, confidence 0.
  SurfaceLabel LabelOf(const Found& found) const;

  // Returns the distance from `x` to the nearest site of matter, however far, in units of the
  // files. Looks at every site.
  double DistanceToMatter(const Eigen::Vector3d& x) const;
  // Returns the mean of the sites of matter, in the frame of the files.
  Eigen::Vector3d MiddleOfMatter() const;

 private:
  Found Along(const Eigen::Vector3d& x, const Eigen::Vector3d& direction, uint32_t cell) const;
  Found Around(const Eigen::Vector3d& x, uint32_t cell) const;

  const ExportableScene& scene_;
  WalkGeometry<float> geometry_;
  // [cells] Whether each is matter; guards are not.
  std::vector<uint8_t> is_matter_;
  // In the normalised frame.
  double tolerance_ = 0;
  double resolution_ = 0;
};

}  // namespace semfoam
