// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/transfer/face_votes.h"
#include "export/transfer/polygon_mesh.h"

#include <vector>

namespace semfoam {

// Labels the faces of a mesh by a cut: of all labellings it looks for the one of the least
//
//   sum over faces f of area(f) * (1 - vote of f for its label)
//   + smoothness * sum over edges e between two labels of length(e) * flatness(e)
//
// the Potts model, by expansions of one label after the other, each a minimum cut (Boykov, Veksler
// and Zabih, 2001). `flatness` is 1 where two faces lie in one plane and falls to 0.05 as they
// meet at a concave angle, where things touch (0.5 at a sharp convex one): so borders follow
// creases rather than noise. `smoothness` is a length, in units of the mesh: a spot of another
// label with a smaller radius than about twice that is taken for noise. 0: the largest vote of each
// face.
//
// Vertices at the same place count as one, so that triangles that share nothing are joined; at an
// edge of more than two faces each is joined with the next. Faces far from any other label keep
// their largest vote. Faces without votes take the label of the nearest one that has some, along
// the mesh, where creases are far; if there is none, kNoObject. The confidence of a face is its
// vote for the label that it gets.
std::vector<SurfaceLabel> CutFaceLabels(const PolygonMesh& mesh,
                                        const FaceVotes& votes,
                                        double smoothness);

// Returns the labels of vertices: that of most of the area of their faces, with the mean of the
// confidences of these, weighted by area. Vertices of no face get {kNoObject, 0}.
std::vector<SurfaceLabel> VertexLabels(const PolygonMesh& mesh,
                                       const std::vector<SurfaceLabel>& face_labels);

}  // namespace semfoam
