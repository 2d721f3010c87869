// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/transfer/polygon_mesh.h"
#include "foam/util/ids.h"

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// A vote of samples of a face for a label.
struct FaceVote {
  LabelId id = kNoObject;
  // Share of the face's area times confidence, 0..1.
  float weight = 0;
};

// The votes of all faces of a mesh, each label of a face once, ascending. Those of a face sum to 1
// at most; what is missing has voted for nothing.
struct FaceVotes {
  // CSR: those of face f are votes[first[f]] .. votes[first[f + 1]].
  std::vector<uint64_t> first = {0};  // [faces + 1]
  std::vector<FaceVote> votes;

  std::span<const FaceVote> Of(size_t f) const {
    return {votes.data() + first[f], votes.data() + first[f + 1]};
  }
};

// Labels places on a face, all with the face's normal, of any length (zero where it has no area).
// `*hint` is 0 at the first face of a block of faces, and then what the call for the one before has
// left there.
using LabelPlaces = std::function<void(const Eigen::Vector3d& normal,
                                       std::span<const Eigen::Vector3d> places,
                                       std::span<SurfaceLabel> labels,
                                       uint32_t* hint)>;

// Collects votes at places that are spread evenly over each face, one for each `spacing` squared of
// its area, from 1 to 256 of them. A place without a label and confidence votes for nothing, or,
// with `unknown_is_unlabelled`, for kNoObject with a confidence of 1/4, so that small faces where
// nothing is known go with those around them. Calls `label` from several threads. A face with a
// corner that is not finite has no votes.
FaceVotes CollectFaceVotes(const PolygonMesh& mesh,
                           double spacing,
                           bool unknown_is_unlabelled,
                           const LabelPlaces& label);

}  // namespace semfoam
