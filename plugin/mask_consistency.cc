// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask_consistency.h"

#include "foam/delaunay.h"
#include "foam/error.h"
#include "foam/guard_sites.h"
#include "foam/parallel.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <memory>
#include <numeric>
#include <queue>
#include <set>
#include <sstream>
#include <utility>

#include <glog/logging.h>

namespace semfoam {
namespace {

constexpr int32_t kNone = -1;
constexpr size_t kMaxLabels = 65535;

// Tracks are short (two or three photos), so what lies next to a point speaks too, with less
// weight: points hardly apart are on the same object seven times in eight.
constexpr size_t kNumNeighbors = 4;
constexpr float kNeighborWeight = 0.5f;

// A point is judged where the others' votes weigh at least this, and more than half agree.
constexpr float kLeastVotes = 1.5f;
// A region is judged from this many judged points on, and a label is in it from so many on.
constexpr int kLeastPoints = 3;
// A label is in a region if it has this share of the region's points, or if the region has this
// share of the label's points in the photo (a small thing merged with a large one).
constexpr double kShareOfRegion = 0.3;
constexpr double kShareOfLabel = 0.5;
// Regions change while such a share of their points agree: the clear ones first, as their
// correction may clear up others.
constexpr double kClearShares[] = {0.8, 0.65, 0.5, 0.5, 0.5, 0.5};
// A contradicted region that is not clearly anything else is dropped from so many points on.
constexpr int kPointsToDrop = 8;
// A label in less than this share of the photos is rare: a fragment, unless points confirm it.
constexpr double kShareOfPhotos = 0.1;
// A pixel of a split region belongs to the label whose nearest point is less than this times as far
// as the nearest of any other label.
constexpr float kClearlyNearer = 0.7f;
// Clusters are joined while their links meet at least this much, counted over the photos of both
// (intersection over union), with so many links' weight of doubt.
constexpr double kJoinOverlap = 0.3;
constexpr double kJoinDoubt = 3;
// Ids that agree less than this are taken to mean nothing between photos.
constexpr double kLeastAgreement = 0.1;
constexpr int kLeastPairs = 20;

struct Region {
  int32_t view = 0;
  int32_t mask_class = 0;
  int32_t label = 0;       // what it is taken for; kNone: dropped or split
  bool is_judged = false;  // enough points
  std::vector<uint32_t> observations;
  std::vector<int32_t> parts;  // of a split region: its labels, ascending
};

struct Observation {
  uint32_t point = 0;
  int32_t region = 0;
  float x = 0, y = 0;
  int32_t label = 0;        // what it says: the label of its region, of its part of it, or kNone
  int32_t verdict = kNone;  // what the other photos say
};

struct Vote {
  int32_t label;
  float weight;
};

// Adds to the vote for a label; labels around one point are few.
void AddVote(int32_t label, float weight, std::vector<Vote>* votes) {
  for (Vote& vote : *votes) {
    if (vote.label != label) continue;
    vote.weight += weight;
    return;
  }
  votes->push_back({label, weight});
}

// The observations of all points that masks have something to say of.
class Evidence {
 public:
  Evidence(const std::vector<SeedPoint>& seeds,
           const std::vector<Sightings>& tracks,
           const std::vector<PhotoRecord>& photos,
           const MaskSet& masks);

  std::vector<Region> regions;            // by view, then class
  std::vector<Observation> observations;  // by point

  // Calls f(other observation, weight) for what other photos saw of the same point and of its
  // neighbours.
  template <typename F>
  void ForEachLink(const Observation& observation, F&& f) const {
    const int32_t view = regions[observation.region].view;
    const auto visit = [&](uint32_t point, float weight) {
      for (uint32_t i = offsets_[point]; i < offsets_[point + 1]; ++i) {
        const Observation& other = observations[i];
        if (regions[other.region].view != view) f(other, weight);
      }
    };
    visit(observation.point, 1.f);
    for (const uint32_t neighbor : neighbors_[observation.point]) {
      visit(neighbor, kNeighborWeight);
    }
  }

  // Cohen's kappa of the labels over all pairs of observations of a point, and the number of pairs.
  std::pair<double, int64_t> Agreement() const;

 private:
  void FindNeighbors(const std::vector<Eigen::Vector3f>& positions);

  std::vector<uint32_t> offsets_;  // [points + 1] into observations
  std::vector<std::vector<uint32_t>> neighbors_;
};

// The class of a pixel, if all pixels around it are of that class: borders are ragged, and points
// on the edge of a thing are as often on what is behind it.
int32_t InnerClass(const ClassImage& image, const PhotoRecord& photo, float x, float y) {
  const int radius = std::max(1, std::max(photo.width, photo.height) / 320);
  // Also keeps wild numbers from the conversion.
  if (!(x >= 0 && x < photo.width && y >= 0 && y < photo.height)) return kNone;
  const int left = static_cast<int>(std::floor(x)) - radius;
  const int top = static_cast<int>(std::floor(y)) - radius;
  const int side = 2 * radius + 1;
  if (left < 0 || top < 0 || left + side > photo.width || top + side > photo.height) return kNone;
  const auto at = [&](int column, int row) {
    return image[static_cast<size_t>(top + row) * photo.width + left + column];
  };
  const int32_t own = at(radius, radius);
  for (int row = 0; row < side; ++row) {
    for (int column = 0; column < side; ++column) {
      if (at(column, row) != own) return kNone;
    }
  }
  return own;
}

Evidence::Evidence(const std::vector<SeedPoint>& seeds,
                   const std::vector<Sightings>& tracks,
                   const std::vector<PhotoRecord>& photos,
                   const MaskSet& masks) {
  std::vector<std::map<int32_t, int32_t>> region_of(photos.size());  // by class
  ParallelForBlocks(static_cast<int64_t>(photos.size()), 1, [&](int64_t view, int64_t) {
    const ClassImage& image = masks.classes[view];
    if (photos[view].held_out || image.Empty()) return;
    int32_t last = kUnlabelled;
    const size_t pixels = static_cast<size_t>(photos[view].width) * photos[view].height;
    for (size_t i = 0; i < pixels; ++i) {
      const int32_t c = image[i];
      if (c != last && c != kUnlabelled) region_of[view][c] = 0;
      last = c;
    }
  });
  for (size_t view = 0; view < photos.size(); ++view) {
    for (auto& [c, index] : region_of[view]) {
      index = static_cast<int32_t>(regions.size());
      Region& region = regions.emplace_back();
      region.view = static_cast<int32_t>(view);
      region.mask_class = region.label = c;
    }
  }
  std::vector<Eigen::Vector3f> positions;
  for (size_t i = 0; i < tracks.size(); ++i) {
    const size_t before = observations.size();
    for (const Sighting& sighting : tracks[i]) {
      const ClassImage& image = masks.classes[sighting.view];
      if (photos[sighting.view].held_out || image.Empty()) continue;
      const Eigen::Vector2f pixel = sighting.pixel.cast<float>();
      const int32_t c = InnerClass(image, photos[sighting.view], pixel.x(), pixel.y());
      if (c == kUnlabelled) continue;
      Observation& observation = observations.emplace_back();
      observation.point = static_cast<uint32_t>(positions.size());
      observation.region = region_of[sighting.view].at(c);
      observation.x = pixel.x();
      observation.y = pixel.y();
      observation.label = c;
      regions[observation.region].observations.push_back(
          static_cast<uint32_t>(observations.size() - 1));
    }
    if (observations.size() == before) continue;
    offsets_.push_back(static_cast<uint32_t>(before));
    positions.push_back(seeds[i].position);
  }
  offsets_.push_back(static_cast<uint32_t>(observations.size()));
  FindNeighbors(positions);
}

// The nearest of a point's Delaunay neighbours, among which its nearest neighbour always is.
void Evidence::FindNeighbors(const std::vector<Eigen::Vector3f>& positions) {
  const Delaunay delaunay = Triangulate(WithGuardSites(positions));
  neighbors_.resize(positions.size());
  for (uint32_t i = 0; i < positions.size(); ++i) {
    std::vector<std::pair<float, uint32_t>> by_distance;
    for (const uint32_t j : delaunay.Neighbors(i)) {
      if (j < positions.size()) {
        by_distance.emplace_back((positions[j] - positions[i]).squaredNorm(), j);
      }
    }
    const size_t count = std::min(kNumNeighbors, by_distance.size());
    std::partial_sort(by_distance.begin(), by_distance.begin() + count, by_distance.end());
    for (size_t k = 0; k < count; ++k) neighbors_[i].push_back(by_distance[k].second);
  }
}

std::pair<double, int64_t> Evidence::Agreement() const {
  std::map<int32_t, double> count_of_label;
  double count = 0;
  int64_t same = 0, pairs = 0;
  for (size_t point = 0; point + 1 < offsets_.size(); ++point) {
    for (uint32_t i = offsets_[point]; i < offsets_[point + 1]; ++i) {
      if (observations[i].label == kNone) continue;
      ++count_of_label[observations[i].label];
      ++count;
      for (uint32_t j = offsets_[point]; j < i; ++j) {
        if (observations[j].label == kNone ||
            regions[observations[j].region].view == regions[observations[i].region].view) {
          continue;
        }
        same += observations[j].label == observations[i].label;
        ++pairs;
      }
    }
  }
  if (pairs == 0) return {NAN, 0};
  double by_chance = 0;
  for (const auto& [label, n] : count_of_label) by_chance += (n / count) * (n / count);
  if (by_chance >= 1) return {1, pairs};
  return {(static_cast<double>(same) / static_cast<double>(pairs) - by_chance) / (1 - by_chance),
          pairs};
}

// Joins what the tracks say is the same: nodes (regions, or the regions of an id) are clustered
// greedily, those of the greatest overlap first. The overlap of two clusters is the intersection
// over union of their points as far as both have photos that could see them; so it does not matter
// how often each was seen.
class Association {
 public:
  Association(const Evidence& evidence, const std::vector<int32_t>& node_of_region, int num_nodes)
      : clusters_(num_nodes), root_(num_nodes) {
    std::iota(root_.begin(), root_.end(), 0);
    for (size_t r = 0; r < evidence.regions.size(); ++r) {
      clusters_[node_of_region[r]].views.insert(evidence.regions[r].view);
    }
    for (const Observation& observation : evidence.observations) {
      const int32_t node = node_of_region[observation.region];
      evidence.ForEachLink(observation, [&](const Observation& other, float weight) {
        const int32_t other_node = node_of_region[other.region];
        clusters_[node].links_to_view[evidence.regions[other.region].view] += weight;
        if (other_node == node) return;
        clusters_[node].links[other_node] += weight;
        clusters_[other_node].links[node] += weight;
      });
    }
    for (int32_t node = 0; node < num_nodes; ++node) PushAll(node, /*larger_only=*/true);
    Join();
  }

  // The cluster of each node, by one of its nodes.
  std::vector<int32_t> Roots() const {
    std::vector<int32_t> roots(root_.size());
    for (size_t i = 0; i < roots.size(); ++i) roots[i] = Root(static_cast<int32_t>(i));
    return roots;
  }

 private:
  struct Cluster {
    std::set<int32_t> views;
    std::map<int32_t, double> links_to_view;  // to any region of that view
    std::map<int32_t, double> links;          // to other clusters and back, both directions
    int version = 0;
    bool is_joined = false;  // into another
  };
  struct Candidate {
    double overlap;
    int32_t a, b;
    int version_a, version_b;
    bool operator<(const Candidate& other) const {
      if (overlap != other.overlap) return overlap < other.overlap;
      return std::pair(a, b) > std::pair(other.a, other.b);
    }
  };

  int32_t Root(int32_t node) const {
    while (root_[node] != node) node = root_[node];
    return node;
  }

  static double LinksTo(const Cluster& cluster, const std::set<int32_t>& views) {
    double sum = 0;
    for (const auto& [view, weight] : cluster.links_to_view) {
      if (views.contains(view)) sum += weight;
    }
    return sum;
  }

  void Push(int32_t a, int32_t b) {
    if (a > b) std::swap(a, b);
    const Cluster& first = clusters_[a];
    const Cluster& second = clusters_[b];
    const auto links = first.links.find(b);
    if (links == first.links.end()) return;
    const double common = links->second / 2;
    const double all = LinksTo(first, second.views) + LinksTo(second, first.views) - common;
    const double overlap = common / (all + kJoinDoubt);
    if (overlap < kJoinOverlap) return;
    queue_.push({overlap, a, b, first.version, second.version});
  }

  void PushAll(int32_t node, bool larger_only) {
    for (const auto& [other, weight] : clusters_[node].links) {
      if (!larger_only || other > node) Push(node, other);
    }
  }

  void Join() {
    while (!queue_.empty()) {
      const Candidate candidate = queue_.top();
      queue_.pop();
      Cluster& kept = clusters_[candidate.a];
      Cluster& gone = clusters_[candidate.b];
      if (kept.is_joined || gone.is_joined || kept.version != candidate.version_a ||
          gone.version != candidate.version_b) {
        continue;
      }
      root_[candidate.b] = candidate.a;
      gone.is_joined = true;
      ++kept.version;
      kept.views.insert(gone.views.begin(), gone.views.end());
      for (const auto& [view, weight] : gone.links_to_view) kept.links_to_view[view] += weight;
      for (const auto& [other, weight] : gone.links) {
        clusters_[other].links.erase(candidate.b);
        if (other == candidate.a) continue;
        kept.links[other] += weight;
        clusters_[other].links[candidate.a] += weight;
      }
      gone = Cluster();
      gone.is_joined = true;
      PushAll(candidate.a, /*larger_only=*/false);
    }
  }

  std::vector<Cluster> clusters_;
  std::vector<int32_t> root_;
  std::priority_queue<Candidate> queue_;
};

// Ids that are the same thing become one label, that of the id with the most regions.
void JoinLabels(int num_labels, Evidence* evidence) {
  std::vector<int32_t> node_of_region;
  std::vector<int> num_regions(num_labels, 0);
  for (const Region& region : evidence->regions) {
    node_of_region.push_back(region.mask_class);
    ++num_regions[region.mask_class];
  }
  const std::vector<int32_t> roots = Association(*evidence, node_of_region, num_labels).Roots();
  std::vector<int32_t> main_label(num_labels, kNone);  // of each root
  for (int32_t label = 0; label < num_labels; ++label) {
    int32_t& main = main_label[roots[label]];
    if (main == kNone || num_regions[label] > num_regions[main]) main = label;
  }
  for (Region& region : evidence->regions) region.label = main_label[roots[region.mask_class]];
}

// Every region by itself: the labels are the clusters, numbered in the order of their first
// regions, behind id 0, whose regions stay together where it is a class. Returns their number.
int AssociateRegions(bool has_zero_class, Evidence* evidence) {
  std::vector<int32_t> node_of_region;
  int32_t num_nodes = has_zero_class ? 1 : 0;
  for (const Region& region : evidence->regions) {
    const bool is_zero = has_zero_class && region.mask_class == 0;
    node_of_region.push_back(is_zero ? 0 : num_nodes++);
  }
  const std::vector<int32_t> roots = Association(*evidence, node_of_region, num_nodes).Roots();
  std::vector<int32_t> label_of_root(num_nodes, kNone);
  int num_labels = 0;
  if (has_zero_class) label_of_root[roots[0]] = num_labels++;
  for (size_t r = 0; r < evidence->regions.size(); ++r) {
    int32_t& label = label_of_root[roots[node_of_region[r]]];
    if (label == kNone) label = num_labels++;
    evidence->regions[r].label = label;
  }
  return num_labels;
}

void LetRegionsSpeak(Evidence* evidence) {
  for (Observation& observation : evidence->observations) {
    const Region& region = evidence->regions[observation.region];
    const bool in_part =
        std::binary_search(region.parts.begin(), region.parts.end(), observation.verdict);
    observation.label = in_part ? observation.verdict : region.label;
  }
}

// What the other photos say of each observation.
void JudgeObservations(Evidence* evidence) {
  std::vector<Vote> votes;
  for (Observation& observation : evidence->observations) {
    votes.clear();
    float total = 0;
    evidence->ForEachLink(observation, [&](const Observation& other, float weight) {
      if (other.label == kNone) return;
      AddVote(other.label, weight, &votes);
      total += weight;
    });
    observation.verdict = kNone;
    if (total < kLeastVotes) continue;
    for (const Vote& vote : votes) {
      if (vote.weight > 0.5f * total) observation.verdict = vote.label;
    }
  }
}

// Which labels few photos have, by the regions' labels.
std::vector<char> RareLabels(int num_labels, const std::vector<Region>& regions) {
  std::vector<std::set<int32_t>> views(num_labels);
  std::set<int32_t> all_views;
  for (const Region& region : regions) {
    all_views.insert(region.view);
    if (region.label != kNone) views[region.label].insert(region.view);
  }
  const double enough = std::max(2.0, kShareOfPhotos * static_cast<double>(all_views.size()));
  std::vector<char> is_rare;
  for (const auto& v : views) is_rare.push_back(static_cast<double>(v.size()) < enough);
  return is_rare;
}

// What each region is, by the verdicts on its observations; `believed` are the labels that the
// masks gave, `is_rare` tells which of them few photos have.
void JudgeRegions(const std::vector<int32_t>& believed,
                  const std::vector<char>& is_rare,
                  double clear_share,
                  Evidence* evidence) {
  // How many points of a label each photo sees.
  std::map<std::pair<int32_t, int32_t>, int> in_view;  // (view, label)
  for (const Observation& observation : evidence->observations) {
    if (observation.verdict == kNone) continue;
    ++in_view[{evidence->regions[observation.region].view, observation.verdict}];
  }
  for (size_t r = 0; r < evidence->regions.size(); ++r) {
    Region& region = evidence->regions[r];
    std::map<int32_t, int> count;
    int judged = 0;
    for (const uint32_t i : region.observations) {
      const int32_t verdict = evidence->observations[i].verdict;
      if (verdict == kNone) continue;
      ++count[verdict];
      ++judged;
    }
    region.is_judged = judged >= kLeastPoints;
    region.label = believed[r];
    region.parts.clear();
    if (!region.is_judged) continue;
    const auto holds_most_of = [&](int32_t label, int n) {
      return n >= kShareOfLabel * in_view.at({region.view, label});
    };
    std::vector<int32_t> present;
    int most = 0;
    for (const auto& [label, n] : count) {
      most = std::max(most, n);
      if (n >= kLeastPoints && (n >= kShareOfRegion * judged || holds_most_of(label, n))) {
        present.push_back(label);
      }
    }
    const double last_share = *std::prev(std::end(kClearShares));
    if (clear_share > last_share && most < clear_share * judged) continue;  // too early to say
    if (present.size() > 1) {
      region.label = kNone;
      region.parts = std::move(present);
      continue;
    }
    // The one label that is there takes the region if it has no other place in this photo, or if
    // the region is one of a fragment. Else its few points may be those of the border.
    if (present.size() == 1 && count[present[0]] >= last_share * judged &&
        (is_rare[believed[r]] || holds_most_of(present[0], count[present[0]]))) {
      region.label = present[0];
    } else if (!count.contains(believed[r]) && judged >= kPointsToDrop) {
      region.label = kNone;
    }
  }
}

// Labels that no point confirms and that few photos have are fragments, or a thing that cannot be
// learned.
void DropUnconfirmed(int num_labels, Evidence* evidence) {
  std::vector<int> confirmed(num_labels, 0);
  for (const Observation& observation : evidence->observations) {
    if (observation.label != kNone && observation.label == observation.verdict) {
      ++confirmed[observation.label];
    }
  }
  const std::vector<char> is_rare = RareLabels(num_labels, evidence->regions);
  for (Region& region : evidence->regions) {
    if (region.label == kNone || confirmed[region.label] >= kLeastPoints) continue;
    if (is_rare[region.label]) region.label = kNone;
  }
}

// The label of every pixel of a split region, by its points: in blocks, whose size grows with the
// photo's, so that the time does not.
class SplitRegion {
 public:
  SplitRegion(const Evidence& evidence, const Region& region, const PhotoRecord& photo)
      : block_(std::max(1, std::max(photo.width, photo.height) / 160)),
        columns_((photo.width + block_ - 1) / block_),
        labels_(static_cast<size_t>(columns_) * ((photo.height + block_ - 1) / block_), kUnknown),
        evidence_(evidence),
        region_(region) {}

  int32_t LabelAt(int x, int y) {
    int32_t& label = labels_[static_cast<size_t>(y / block_) * columns_ + x / block_];
    if (label == kUnknown) {
      const auto middle = [&](int at) {
        return (static_cast<float>(at / block_) + 0.5f) * static_cast<float>(block_);
      };
      label = Nearest(middle(x), middle(y));
    }
    return label;
  }

 private:
  static constexpr int32_t kUnknown = -2;

  int32_t Nearest(float x, float y) const {
    int32_t nearest = kNone;
    float distance = INFINITY, distance_of_others = INFINITY;
    for (const uint32_t i : region_.observations) {
      const Observation& observation = evidence_.observations[i];
      if (observation.label == kNone) continue;
      const float d = std::hypot(observation.x - x, observation.y - y);
      if (d < distance) {
        if (observation.label != nearest) distance_of_others = distance;
        nearest = observation.label;
        distance = d;
      } else if (observation.label != nearest) {
        distance_of_others = std::min(distance_of_others, d);
      }
    }
    return distance < kClearlyNearer * distance_of_others ? nearest : kNone;
  }

  int block_;
  int columns_;
  std::vector<int32_t> labels_;
  const Evidence& evidence_;
  const Region& region_;
};

// Writes what has been found into the masks. `label_of_class` is for the held-out photos.
void Apply(const Evidence& evidence,
           const std::vector<PhotoRecord>& photos,
           const std::vector<int32_t>& label_of_class,
           std::vector<Label> labels,
           MaskSet* masks) {
  std::vector<char> is_used(labels.size(), 0);
  for (const Region& region : evidence.regions) {
    if (region.label != kNone) is_used[region.label] = 1;
    for (const int32_t part : region.parts) is_used[part] = 1;
  }
  std::vector<int32_t> class_of_label(labels.size(), kUnlabelled);
  masks->labels.clear();
  for (size_t label = 0; label < labels.size(); ++label) {
    if (!is_used[label]) continue;
    class_of_label[label] = static_cast<int32_t>(masks->labels.size());
    masks->labels.push_back(std::move(labels[label]));
  }
  const auto new_class = [&](int32_t label) {
    return label == kNone ? kUnlabelled : class_of_label[label];
  };
  const auto num_classes = static_cast<int>(masks->labels.size());
  ParallelForBlocks(static_cast<int64_t>(photos.size()), 1, [&](int64_t view, int64_t) {
    if (masks->classes[view].Empty()) return;
    const PhotoRecord& photo = photos[view];
    std::vector<int32_t> class_of_class(label_of_class.size(), kUnlabelled);
    std::vector<std::unique_ptr<SplitRegion>> split(label_of_class.size());
    if (photo.held_out) {
      std::transform(
          label_of_class.begin(), label_of_class.end(), class_of_class.begin(), new_class);
    }
    auto region = std::lower_bound(
        evidence.regions.begin(), evidence.regions.end(), view, [](const Region& r, int64_t v) {
          return r.view < v;
        });
    for (; region != evidence.regions.end() && region->view == view; ++region) {
      class_of_class[region->mask_class] = new_class(region->label);
      if (!region->parts.empty()) {
        split[region->mask_class] = std::make_unique<SplitRegion>(evidence, *region, photo);
      }
    }
    ClassImage image({photo.width, photo.height}, num_classes);
    size_t pixel = 0;
    for (int y = 0; y < photo.height; ++y) {
      for (int x = 0; x < photo.width; ++x, ++pixel) {
        const int32_t c = masks->classes[view][pixel];
        if (c == kUnlabelled) continue;
        image.Set(pixel, split[c] ? new_class(split[c]->LabelAt(x, y)) : class_of_class[c]);
      }
    }
    masks->classes[view] = std::move(image);
  });
}

void Log(const Evidence& evidence,
         const std::vector<int32_t>& given,
         const std::vector<PhotoRecord>& photos,
         const std::vector<Label>& mask_labels,
         const std::vector<Label>& labels) {
  for (size_t r = 0; r < evidence.regions.size(); ++r) {
    const Region& region = evidence.regions[r];
    if (region.label == given[r]) continue;
    std::ostringstream text;
    text << photos[region.view].name << ", id " << mask_labels[region.mask_class].source_id << ", "
         << region.observations.size() << " points: ";
    if (region.label != kNone) {
      text << "is " << labels[region.label].id;
    } else if (region.parts.empty()) {
      text << "dropped";
    } else {
      text << "split into";
      for (const int32_t part : region.parts) text << " " << labels[part].id;
    }
    VLOG(1) << text.str();
  }
}

}  // namespace

std::string MaskConsistencyReport::Line() const {
  std::ostringstream text;
  text.precision(2);
  if (used == MaskConsistency::kOff) {
    text << "The tracks say too little of the masks; they are believed";
    return text.str();
  }
  text << (used == MaskConsistency::kTracks ? "Masks held against the tracks: "
                                            : "Masks of each photo matched by the tracks: ")
       << "of " << num_regions << " regions " << num_renamed << " renamed, " << num_split
       << " split, " << num_dropped << " dropped, " << num_unjudged
       << " with too few points to tell; " << labels_before << " ids became " << labels_after
       << " labels; agreement " << std::fixed << agreement_before << " before, " << agreement_after
       << " after";
  return text.str();
}

MaskConsistencyReport MakeMasksConsistent(const std::vector<SeedPoint>& seeds,
                                          const std::vector<Sightings>& tracks,
                                          const std::vector<PhotoRecord>& photos,
                                          MaskConsistency mode,
                                          MaskSet* masks) {
  CHECK_EQ(seeds.size(), tracks.size());
  CHECK_EQ(photos.size(), masks->classes.size());
  MaskConsistencyReport report;
  if (mode == MaskConsistency::kOff || masks->labels.empty()) return report;
  Evidence evidence(seeds, tracks, photos, *masks);
  const auto [agreement, num_pairs] = evidence.Agreement();
  report.agreement_before = agreement;
  if (num_pairs < kLeastPairs) return report;
  if (mode == MaskConsistency::kAuto) {
    mode = agreement < kLeastAgreement ? MaskConsistency::kIndependent : MaskConsistency::kTracks;
  }
  report.used = mode;
  report.num_regions = static_cast<int>(evidence.regions.size());
  report.labels_before = static_cast<int>(masks->labels.size());

  std::vector<Label> labels = masks->labels;
  std::vector<int32_t> label_of_class(labels.size(), kNone);
  const bool has_zero_class = labels[0].source_id == 0;
  if (mode == MaskConsistency::kTracks) {
    JoinLabels(static_cast<int>(labels.size()), &evidence);
    std::iota(label_of_class.begin(), label_of_class.end(), 0);
    for (const Region& region : evidence.regions) label_of_class[region.mask_class] = region.label;
  } else {
    const int count = AssociateRegions(has_zero_class, &evidence);
    const Label zero = labels[0];
    labels.assign(count, Label());
    if (has_zero_class) {
      labels[0] = zero;
      label_of_class[0] = 0;
    }
  }
  std::vector<int32_t> believed;
  for (const Region& region : evidence.regions) believed.push_back(region.label);
  // What a region is compared with in the report: a joined id is a renamed one.
  std::vector<int32_t> given = believed;
  if (mode == MaskConsistency::kTracks) {
    for (size_t r = 0; r < given.size(); ++r) given[r] = evidence.regions[r].mask_class;
  }
  const auto num_labels = static_cast<int>(labels.size());
  const std::vector<char> is_rare = RareLabels(num_labels, evidence.regions);
  for (const double clear_share : kClearShares) {
    LetRegionsSpeak(&evidence);
    JudgeObservations(&evidence);
    JudgeRegions(believed, is_rare, clear_share, &evidence);
  }
  LetRegionsSpeak(&evidence);
  DropUnconfirmed(num_labels, &evidence);
  LetRegionsSpeak(&evidence);
  report.agreement_after = evidence.Agreement().first;

  if (mode == MaskConsistency::kIndependent) {
    std::set<int32_t> used;
    for (const Region& region : evidence.regions) {
      if (region.label != kNone) used.insert(region.label);
      used.insert(region.parts.begin(), region.parts.end());
    }
    if (used.size() > kMaxLabels) {
      throw UserError("--Masks.consistency independent: the regions of the masks make ",
                      used.size(),
                      " labels, where at most ",
                      kMaxLabels,
                      " are possible; masks with fewer regions would be right.");
    }
    int32_t next_id = 1;
    for (const int32_t label : used) {
      if (has_zero_class && label == 0) continue;
      labels[label].id = next_id;
      labels[label].source_id = next_id++;
    }
  }
  for (size_t r = 0; r < evidence.regions.size(); ++r) {
    const Region& region = evidence.regions[r];
    report.num_renamed += region.label != kNone && region.label != given[r];
    report.num_split += !region.parts.empty();
    report.num_dropped += region.label == kNone && region.parts.empty();
    report.num_unjudged += !region.is_judged && region.label != kNone;
  }
  Log(evidence, given, photos, masks->labels, labels);
  Apply(evidence, photos, label_of_class, std::move(labels), masks);
  report.labels_after = static_cast<int>(masks->labels.size());
  return report;
}

}  // namespace semfoam
