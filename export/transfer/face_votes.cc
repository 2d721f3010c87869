// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/transfer/face_votes.h"

#include "foam/util/parallel.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>
#include <glog/logging.h>

namespace semfoam {
namespace {

constexpr int64_t kBlock = 1024;
constexpr int kMaxPlaces = 256;
constexpr float kNothingKnown = 0.25f;

// Sets `places` to points that are spread evenly over the face: by the R2 sequence (a
// generalisation of the golden ratio to the plane) over its triangles, each with its share of the
// area.
void SpreadPlaces(const PolygonMesh& mesh,
                  std::span<const uint32_t> face,
                  double spacing,
                  std::vector<Eigen::Vector3d>* places) {
  places->clear();
  std::vector<double> area_up_to;
  double area = 0;
  for (size_t k = 2; k < face.size(); ++k) {
    const Eigen::Vector3d& a = mesh.vertices[face[0]];
    area += 0.5 * (mesh.vertices[face[k - 1]] - a).cross(mesh.vertices[face[k]] - a).norm();
    area_up_to.push_back(area);
  }
  const double wanted = std::ceil(area / (spacing * spacing));
  const int count = wanted < kMaxPlaces ? std::max(1, static_cast<int>(wanted)) : kMaxPlaces;
  if (count == 1 || !(area > 0)) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const uint32_t corner : face) sum += mesh.vertices[corner];
    places->push_back(sum / static_cast<double>(face.size()));
    return;
  }
  constexpr double kStepU = 0.7548776662466927, kStepV = 0.5698402909980532;
  double u = 0.5, v = 0.5;
  for (int k = 0; k < count; ++k) {
    u = u + kStepU - std::floor(u + kStepU);
    v = v + kStepV - std::floor(v + kStepV);
    const double at = area * (k + 0.5) / count;
    const size_t triangle = std::min<size_t>(
        std::upper_bound(area_up_to.begin(), area_up_to.end(), at) - area_up_to.begin(),
        area_up_to.size() - 1);
    const bool is_beyond = u + v > 1;
    const double s = is_beyond ? 1 - u : u, t = is_beyond ? 1 - v : v;
    const Eigen::Vector3d& a = mesh.vertices[face[0]];
    places->push_back(a + s * (mesh.vertices[face[triangle + 1]] - a) +
                      t * (mesh.vertices[face[triangle + 2]] - a));
  }
}

// Sums up the labels of a face by id, ascending.
void AppendVotes(std::vector<SurfaceLabel>* labels,
                 float weight_of_unknown,
                 std::vector<FaceVote>* votes) {
  std::stable_sort(labels->begin(),
                   labels->end(),
                   [](const SurfaceLabel& a, const SurfaceLabel& b) { return a.id < b.id; });
  const size_t first = votes->size();
  for (const SurfaceLabel& label : *labels) {
    const bool is_known = label.id != kNoObject || label.confidence > 0;
    const float weight = is_known ? label.confidence : weight_of_unknown;
    if (!(weight > 0)) continue;
    if (votes->size() == first || votes->back().id != label.id) votes->push_back({label.id, 0});
    votes->back().weight += weight;
  }
  for (size_t k = first; k < votes->size(); ++k) {
    (*votes)[k].weight /= static_cast<float>(labels->size());
  }
}

}  // namespace

FaceVotes CollectFaceVotes(const PolygonMesh& mesh,
                           double spacing,
                           bool unknown_is_unlabelled,
                           const LabelPlaces& label) {
  CHECK_GT(spacing, 0);
  const auto num_faces = static_cast<int64_t>(mesh.NumFaces());
  std::vector<std::vector<FaceVote>> of_block((num_faces + kBlock - 1) / kBlock);
  std::vector<uint8_t> num_votes_of(num_faces);
  ParallelForBlocks(num_faces, kBlock, [&](int64_t begin, int64_t end) {
    std::vector<FaceVote>& votes = of_block[begin / kBlock];
    std::vector<Eigen::Vector3d> places;
    std::vector<SurfaceLabel> labels;
    uint32_t hint = 0;
    for (int64_t f = begin; f < end; ++f) {
      const Eigen::Vector3d area = mesh.FaceArea(f);
      if (mesh.Face(f).empty() || !area.allFinite()) continue;
      SpreadPlaces(mesh, mesh.Face(f), spacing, &places);
      labels.resize(places.size());
      label(area, places, labels, &hint);
      const size_t before = votes.size();
      AppendVotes(&labels, unknown_is_unlabelled ? kNothingKnown : 0, &votes);
      num_votes_of[f] = static_cast<uint8_t>(std::min<size_t>(votes.size() - before, 255));
      votes.resize(before + num_votes_of[f]);
    }
  });
  FaceVotes result;
  result.first.reserve(num_faces + 1);
  for (int64_t f = 0; f < num_faces; ++f) {
    result.first.push_back(result.first.back() + num_votes_of[f]);
  }
  result.votes.reserve(result.first.back());
  for (std::vector<FaceVote>& votes : of_block) {
    result.votes.insert(result.votes.end(), votes.begin(), votes.end());
    std::vector<FaceVote>().swap(votes);
  }
  return result;
}

}  // namespace semfoam
