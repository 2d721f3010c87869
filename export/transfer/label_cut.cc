// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/transfer/label_cut.h"

#include "foam/util/min_cut.h"
#include "foam/util/parallel.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <deque>
#include <limits>
#include <numbers>
#include <numeric>
#include <queue>
#include <utility>

#include <Eigen/Geometry>

namespace semfoam {
namespace {

// Angle at which an edge is much cheaper to cut than a flat one, and what the cheapest cost.
constexpr double kCreaseDegrees = 30;
constexpr double kConcaveFlatness = 0.05;
constexpr double kConvexFlatness = 0.5;
// Faces farther than so many times the smoothness from any doubt keep their largest vote.
constexpr double kReach = 4;
constexpr int kMaxSweeps = 6;
constexpr double kNoArea = 1e-200;
constexpr uint32_t kNoNode = std::numeric_limits<uint32_t>::max();

struct Link {
  uint32_t other = 0;
  float length = 0;  // of the edge
  // Length times flatness.
  float weight = 0;
};

// The faces that share an edge with each face.
struct FaceGraph {
  std::vector<uint64_t> first;  // [faces + 1]
  std::vector<Link> links;

  std::span<const Link> Of(size_t f) const {
    return {links.data() + first[f], links.data() + first[f + 1]};
  }
};

// Returns [vertices] the lowest vertex at the same place.
std::vector<uint32_t> FirstVertexAtPlace(const std::vector<Eigen::Vector3d>& vertices) {
  const auto key = [&](uint32_t v) {
    const Eigen::Vector3d& x = vertices[v];
    return std::array<double, 3>{x.x(), x.y(), x.z()};
  };
  std::vector<uint32_t> first(vertices.size());
  std::iota(first.begin(), first.end(), 0u);
  std::vector<uint32_t> order;
  for (uint32_t v = 0; v < vertices.size(); ++v) {
    if (vertices[v].allFinite()) order.push_back(v);
  }
  std::sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) {
    const auto ka = key(a), kb = key(b);
    return ka != kb ? ka < kb : a < b;
  });
  for (size_t k = 1; k < order.size(); ++k) {
    if (key(order[k]) == key(order[k - 1])) first[order[k]] = first[order[k - 1]];
  }
  return first;
}

struct Side {
  uint32_t low = 0, high = 0;  // the two places
  uint32_t face = 0;
  bool is_ascending = false;  // the direction in which the face goes along it
};

// What the faces look like to each other.
struct FaceShape {
  std::vector<float> area;
  std::vector<Eigen::Vector3f> normal;  // unit length, or 0
  std::vector<Eigen::Vector3d> center;  // mean of the corners
};

FaceShape MeasureFaces(const PolygonMesh& mesh) {
  FaceShape shape;
  const size_t count = mesh.NumFaces();
  shape.area.resize(count);
  shape.normal.resize(count, Eigen::Vector3f::Zero());
  shape.center.resize(count, Eigen::Vector3d::Zero());
  ParallelForBlocks(static_cast<int64_t>(count), 4096, [&](int64_t begin, int64_t end) {
    for (int64_t f = begin; f < end; ++f) {
      const Eigen::Vector3d area = mesh.FaceArea(f);
      const double length = area.norm();
      if (!std::isfinite(length)) continue;
      shape.area[f] = static_cast<float>(length);
      if (length > 0) shape.normal[f] = (area / length).cast<float>();
      for (const uint32_t corner : mesh.Face(f)) shape.center[f] += mesh.vertices[corner];
      shape.center[f] /= std::max<double>(1, static_cast<double>(mesh.Face(f).size()));
    }
  });
  return shape;
}

double Flatness(const FaceShape& shape, const Side& a, const Side& b) {
  const Eigen::Vector3d n = shape.normal[a.face].cast<double>();
  // Faces that go along an edge in the same direction look to opposite sides.
  const double turn = a.is_ascending == b.is_ascending ? -1 : 1;
  const Eigen::Vector3d m = turn * shape.normal[b.face].cast<double>();
  if (n.isZero() || m.isZero()) return 1;
  const double degrees = std::atan2(n.cross(m).norm(), n.dot(m)) * 180 / std::numbers::pi;
  const double least =
      (shape.center[b.face] - shape.center[a.face]).dot(n) > 0 ? kConcaveFlatness : kConvexFlatness;
  const double share = degrees / kCreaseDegrees;
  return std::max(least, std::exp(-share * share));
}

FaceGraph LinkFaces(const PolygonMesh& mesh, const FaceShape& shape) {
  std::vector<Side> sides;
  sides.reserve(mesh.corners.size());
  {
    const std::vector<uint32_t> place = FirstVertexAtPlace(mesh.vertices);
    for (uint32_t f = 0; f < mesh.NumFaces(); ++f) {
      const std::span<const uint32_t> face = mesh.Face(f);
      for (size_t k = 0; k < face.size(); ++k) {
        const uint32_t from = place[face[k]], to = place[face[(k + 1) % face.size()]];
        if (from == to) continue;
        sides.push_back({std::min(from, to), std::max(from, to), f, from < to});
      }
    }
  }
  std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
    if (a.low != b.low) return a.low < b.low;
    return a.high != b.high ? a.high < b.high : a.face < b.face;
  });
  struct Pair {
    uint32_t a, b;
    float length, weight;
  };
  std::vector<Pair> pairs;
  FaceGraph graph;
  graph.first.assign(mesh.NumFaces() + 1, 0);
  for (size_t k = 1; k < sides.size(); ++k) {
    const Side &a = sides[k - 1], &b = sides[k];
    if (a.low != b.low || a.high != b.high || a.face == b.face) continue;
    const double length = (mesh.vertices[a.high] - mesh.vertices[a.low]).norm();
    pairs.push_back({a.face,
                     b.face,
                     static_cast<float>(length),
                     static_cast<float>(length * Flatness(shape, a, b))});
    ++graph.first[a.face + 1];
    ++graph.first[b.face + 1];
  }
  std::partial_sum(graph.first.begin(), graph.first.end(), graph.first.begin());
  graph.links.resize(graph.first.back());
  std::vector<uint64_t> fill(graph.first.begin(), graph.first.end() - 1);
  for (const Pair& pair : pairs) {
    graph.links[fill[pair.a]++] = {pair.b, pair.length, pair.weight};
    graph.links[fill[pair.b]++] = {pair.a, pair.length, pair.weight};
  }
  return graph;
}

float VoteFor(const FaceVotes& votes, size_t f, LabelId id) {
  for (const FaceVote& vote : votes.Of(f)) {
    if (vote.id == id) return vote.weight;
  }
  return 0;
}

std::vector<LabelId> LargestVotes(const PolygonMesh& mesh, const FaceVotes& votes) {
  std::vector<LabelId> label(mesh.NumFaces(), kNoObject);
  for (size_t f = 0; f < mesh.NumFaces(); ++f) {
    float most = 0;
    for (const FaceVote& vote : votes.Of(f)) {
      if (vote.weight <= most) continue;
      most = vote.weight;
      label[f] = vote.id;
    }
  }
  return label;
}

bool HasVotes(const FaceVotes& votes, size_t f) { return !votes.Of(f).empty(); }

// Returns whether each face is near enough to a doubtful one for the cut: one that has votes for
// several labels or hardly any, or lies beside one of another label. Faces without votes are not.
std::vector<uint8_t> FacesNearDoubt(const FaceGraph& graph,
                                    const FaceShape& shape,
                                    const FaceVotes& votes,
                                    const std::vector<LabelId>& label,
                                    double reach) {
  const size_t count = label.size();
  std::vector<float> distance(count, std::numeric_limits<float>::infinity());
  std::deque<uint32_t> queue;
  for (uint32_t f = 0; f < count; ++f) {
    if (!HasVotes(votes, f)) continue;
    const auto of = votes.Of(f);
    bool is_doubtful = of.size() != 1 || of[0].weight < 0.5f;
    for (const Link& link : graph.Of(f)) {
      is_doubtful |= HasVotes(votes, link.other) && label[link.other] != label[f];
    }
    if (!is_doubtful) continue;
    distance[f] = 0;
    queue.push_back(f);
  }
  while (!queue.empty()) {
    const uint32_t f = queue.front();
    queue.pop_front();
    for (const Link& link : graph.Of(f)) {
      const double step = (shape.center[link.other] - shape.center[f]).norm();
      const auto to_other = static_cast<float>(distance[f] + step);
      if (to_other > reach || to_other >= distance[link.other]) continue;
      if (!HasVotes(votes, link.other)) continue;
      distance[link.other] = to_other;
      queue.push_back(link.other);
    }
  }
  std::vector<uint8_t> is_near(count);
  for (size_t f = 0; f < count; ++f) is_near[f] = std::isfinite(distance[f]);
  return is_near;
}

// Returns the connected groups of faces that are near.
std::vector<std::vector<uint32_t>> Groups(const FaceGraph& graph,
                                          const std::vector<uint8_t>& is_near) {
  std::vector<std::vector<uint32_t>> groups;
  std::vector<uint8_t> is_met(is_near.size(), 0);
  for (uint32_t f = 0; f < is_near.size(); ++f) {
    if (!is_near[f] || is_met[f]) continue;
    std::vector<uint32_t>& group = groups.emplace_back(1, f);
    is_met[f] = 1;
    for (size_t k = 0; k < group.size(); ++k) {
      for (const Link& link : graph.Of(group[k])) {
        if (!is_near[link.other] || is_met[link.other]) continue;
        is_met[link.other] = 1;
        group.push_back(link.other);
      }
    }
    std::sort(group.begin(), group.end());
  }
  return groups;
}

// The cut of one connected group of faces; those around it keep their labels.
class GroupCut {
 public:
  // `node_of` [faces] is the place of a face of this group in `faces`.
  GroupCut(const FaceGraph& graph,
           const FaceShape& shape,
           const FaceVotes& votes,
           const std::vector<LabelId>& label,
           const std::vector<uint8_t>& is_near,
           const std::vector<uint32_t>& node_of,
           const std::vector<uint32_t>& faces,
           double smoothness) {
    double total = 0;
    for (const uint32_t f : faces) {
      total += shape.area[f];
      for (const Link& link : graph.Of(f)) total += smoothness * link.weight;
    }
    const double unit = total > 0 ? std::ldexp(1.0, 58) / total : 0;
    for (const uint32_t f : faces) {
      label_.push_back(label[f]);
      labels_.push_back(label[f]);
      for (const FaceVote& vote : votes.Of(f)) labels_.push_back(vote.id);
      for (const Link& link : graph.Of(f)) {
        if (!is_near[link.other] && HasVotes(votes, link.other)) {
          labels_.push_back(label[link.other]);
        }
      }
    }
    std::sort(labels_.begin(), labels_.end());
    labels_.erase(std::unique(labels_.begin(), labels_.end()), labels_.end());
    cost_.resize(faces.size() * labels_.size());
    for (uint32_t node = 0; node < faces.size(); ++node) {
      const uint32_t f = faces[node];
      for (size_t k = 0; k < labels_.size(); ++k) {
        const double share = std::clamp(1.0 - VoteFor(votes, f, labels_[k]), 0.0, 1.0);
        cost_[node * labels_.size() + k] = static_cast<int64_t>(unit * shape.area[f] * share);
      }
      for (const Link& link : graph.Of(f)) {
        const auto weight = static_cast<int64_t>(unit * smoothness * link.weight);
        if (is_near[link.other]) {
          if (f < link.other) pairs_.push_back({node, node_of[link.other], weight});
          continue;
        }
        if (!HasVotes(votes, link.other)) continue;
        for (size_t k = 0; k < labels_.size(); ++k) {
          if (labels_[k] != label[link.other]) cost_[node * labels_.size() + k] += weight;
        }
      }
    }
    for (LabelId& id : label_) index_.push_back(IndexOf(id));
  }

  // Returns [faces of the group] the labels of the cut.
  std::vector<LabelId> Solve() {
    if (labels_.size() > 1) {
      int64_t energy = Energy(index_);
      for (int sweep = 0; sweep < kMaxSweeps; ++sweep) {
        bool has_changed = false;
        for (size_t alpha = 0; alpha < labels_.size(); ++alpha) {
          const std::vector<size_t> expanded = Expanded(alpha);
          const int64_t lower = Energy(expanded);
          if (lower >= energy) continue;
          energy = lower;
          index_ = expanded;
          has_changed = true;
        }
        if (!has_changed) break;
      }
    }
    for (size_t node = 0; node < label_.size(); ++node) label_[node] = labels_[index_[node]];
    return label_;
  }

 private:
  struct Pair {
    uint32_t a, b;
    int64_t weight;
  };

  size_t IndexOf(LabelId id) const {
    return std::lower_bound(labels_.begin(), labels_.end(), id) - labels_.begin();
  }
  int64_t Cost(size_t node, size_t k) const { return cost_[node * labels_.size() + k]; }

  int64_t Energy(const std::vector<size_t>& index) const {
    int64_t sum = 0;
    for (size_t node = 0; node < index.size(); ++node) sum += Cost(node, index[node]);
    for (const Pair& pair : pairs_) {
      if (index[pair.a] != index[pair.b]) sum += pair.weight;
    }
    return sum;
  }

  // Returns the best labelling in which each face either keeps its label or gets `alpha`. With x =
  // 1 for a face that gets it, the cost of an edge between faces of the labels a and b is
  //   e00 + (e10 - e00) x_a - e10 x_b + (e01 + e10 - e00) (1 - x_a) x_b
  // (Kolmogorov and Zabih, 2004): two terms of one face each, and an edge of the network.
  std::vector<size_t> Expanded(size_t alpha) const {
    std::vector<int64_t> to_keep(index_.size()), to_change(index_.size());
    for (size_t node = 0; node < index_.size(); ++node) {
      to_keep[node] = Cost(node, index_[node]);
      to_change[node] = Cost(node, alpha);
    }
    MinCut cut(index_.size());
    for (const Pair& pair : pairs_) {
      const size_t a = index_[pair.a], b = index_[pair.b];
      const int64_t e00 = a != b ? pair.weight : 0;
      const int64_t e01 = a != alpha ? pair.weight : 0;
      const int64_t e10 = b != alpha ? pair.weight : 0;
      (e10 >= e00 ? to_change : to_keep)[pair.a] += std::abs(e10 - e00);
      to_keep[pair.b] += e10;
      if (e01 + e10 > e00) cut.AddEdge(pair.b, pair.a, e01 + e10 - e00, 0);
    }
    for (size_t node = 0; node < index_.size(); ++node) {
      const int64_t both = std::min(to_keep[node], to_change[node]);
      cut.AddTerminals(node, to_keep[node] - both, to_change[node] - both);
    }
    std::vector<size_t> expanded = index_;
    const std::vector<uint8_t> changes = cut.SourceSide();
    for (size_t node = 0; node < index_.size(); ++node) {
      if (changes[node]) expanded[node] = alpha;
    }
    return expanded;
  }

  // Labels that any face of the group may get, ascending.
  std::vector<LabelId> labels_;
  std::vector<LabelId> label_;
  // [nodes] Index into `labels_`.
  std::vector<size_t> index_;
  // [nodes][labels]
  std::vector<int64_t> cost_;
  std::vector<Pair> pairs_;
};

// Relabels the faces near a doubtful one by the cuts of their groups.
void CutGroups(const FaceGraph& graph,
               const FaceShape& shape,
               const FaceVotes& votes,
               double smoothness,
               std::vector<LabelId>* label) {
  const std::vector<uint8_t> is_near =
      FacesNearDoubt(graph, shape, votes, *label, kReach * smoothness);
  const std::vector<std::vector<uint32_t>> groups = Groups(graph, is_near);
  std::vector<uint32_t> node_of(label->size(), kNoNode);
  for (const std::vector<uint32_t>& group : groups) {
    for (uint32_t node = 0; node < group.size(); ++node) node_of[group[node]] = node;
  }
  std::vector<std::vector<LabelId>> solved(groups.size());
  ParallelForBlocks(std::ssize(groups), 1, [&](int64_t g, int64_t) {
    solved[g] =
        GroupCut(graph, shape, votes, *label, is_near, node_of, groups[g], smoothness).Solve();
  });
  for (size_t g = 0; g < groups.size(); ++g) {
    for (size_t node = 0; node < groups[g].size(); ++node) {
      (*label)[groups[g][node]] = solved[g][node];
    }
  }
}

// Gives each face without votes the label of the nearest face with votes, along the mesh; an edge
// is the farther the less flat it is.
void FillFromAround(const FaceGraph& graph,
                    const FaceShape& shape,
                    const FaceVotes& votes,
                    std::vector<LabelId>* label) {
  using Reached = std::pair<float, uint32_t>;
  std::priority_queue<Reached, std::vector<Reached>, std::greater<>> next;
  std::vector<float> distance(label->size(), std::numeric_limits<float>::infinity());
  for (uint32_t f = 0; f < label->size(); ++f) {
    if (!HasVotes(votes, f)) continue;
    distance[f] = 0;
    next.emplace(0.f, f);
  }
  while (!next.empty()) {
    const auto [at, f] = next.top();
    next.pop();
    if (at > distance[f]) continue;
    for (const Link& link : graph.Of(f)) {
      if (HasVotes(votes, link.other)) continue;
      const double flatness =
          std::max<double>(link.weight, kNoArea) / std::max<double>(link.length, kNoArea);
      const double step = (shape.center[link.other] - shape.center[f]).norm();
      const auto there = static_cast<float>(at + step / flatness);
      if (!(there < distance[link.other])) continue;
      distance[link.other] = there;
      (*label)[link.other] = (*label)[f];
      next.emplace(there, link.other);
    }
  }
}

}  // namespace

std::vector<SurfaceLabel> CutFaceLabels(const PolygonMesh& mesh,
                                        const FaceVotes& votes,
                                        double smoothness) {
  std::vector<LabelId> label = LargestVotes(mesh, votes);
  const FaceShape shape = MeasureFaces(mesh);
  const FaceGraph graph = LinkFaces(mesh, shape);
  if (smoothness > 0) CutGroups(graph, shape, votes, smoothness, &label);
  FillFromAround(graph, shape, votes, &label);
  std::vector<SurfaceLabel> labels(mesh.NumFaces());
  for (size_t f = 0; f < mesh.NumFaces(); ++f) {
    labels[f] = {label[f], std::min(1.f, VoteFor(votes, f, label[f]))};
  }
  return labels;
}

std::vector<SurfaceLabel> VertexLabels(const PolygonMesh& mesh,
                                       const std::vector<SurfaceLabel>& face_labels) {
  std::vector<uint64_t> first(mesh.vertices.size() + 1, 0);
  for (const uint32_t corner : mesh.corners) ++first[corner + 1];
  std::partial_sum(first.begin(), first.end(), first.begin());
  std::vector<uint32_t> faces(mesh.corners.size());
  std::vector<uint64_t> fill(first.begin(), first.end() - 1);
  for (uint32_t f = 0; f < mesh.NumFaces(); ++f) {
    for (const uint32_t corner : mesh.Face(f)) faces[fill[corner]++] = f;
  }
  std::vector<SurfaceLabel> labels(mesh.vertices.size());
  ParallelForBlocks(std::ssize(mesh.vertices), 4096, [&](int64_t begin, int64_t end) {
    struct Share {
      LabelId id;
      double area, confidence;
    };
    std::vector<Share> shares;
    for (int64_t v = begin; v < end; ++v) {
      shares.clear();
      for (uint64_t k = first[v]; k < first[v + 1]; ++k) {
        const SurfaceLabel& label = face_labels[faces[k]];
        // A face without an area counts where there is no other.
        double area = mesh.FaceArea(faces[k]).norm();
        if (!(area > 0) || !std::isfinite(area)) area = kNoArea;
        auto share = std::find_if(
            shares.begin(), shares.end(), [&](const Share& known) { return known.id == label.id; });
        if (share == shares.end()) share = shares.insert(share, {label.id, 0, 0});
        share->area += area;
        share->confidence += area * label.confidence;
      }
      const auto most =
          std::max_element(shares.begin(), shares.end(), [](const Share& a, const Share& b) {
            return a.area != b.area ? a.area < b.area : a.id > b.id;
          });
      if (most == shares.end()) continue;
      labels[v] = {most->id, static_cast<float>(most->confidence / most->area)};
    }
  });
  return labels;
}

}  // namespace semfoam
