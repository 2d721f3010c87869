// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/train/label_spreading.h"

#include "foam/geometry/guard_sites.h"
#include "foam/geometry/voronoi.h"
#include "foam/model/activation.h"
#include "foam/model/classifier.h"
#include "foam/util/parallel.h"
#include "foam/util/random.h"

#include <algorithm>
#include <cmath>

#include <glog/logging.h>

namespace semfoam {
namespace {

// Difference of colour, in display values, at which an edge conducts exp(-1/2) as much.
constexpr float kColorScale = 0.1f;
// Share that an edge through air, or between colours that have nothing in common, conducts at
// least: everything is connected, so that no cell stays without a label.
constexpr float kLeastConductance = 1e-3f;
// Least contribution of a cell whose mean colour is known. The insides of things are not seen.
constexpr float kSeenContribution = 0.01f;
// Votes, in pixels, that count as much as all neighbours of a cell. Cells at the edges of things
// have a few wrong ones.
constexpr float kEvenVotes = 16;
// What a cell's colour tells of its class counts this much, where all its neighbours count 1:
// little beside a mask, more the farther all masks are.
constexpr float kColorHold = 0.01f;
// Density, over that of colours that are evenly spread, that every class has for any colour. Shade,
// and parts of a thing that no mask shows, have colours that are not among those of its class.
constexpr float kLeastColorDensity = 30;
// Times that colours are weighed with what the spread labels make likely, and labels spread anew.
constexpr int kColorRounds = 2;
// Least share of a class in a cell, far from its votes, that its colours can raise.
constexpr float kLeastShare = 1e-6f;
// Bins of colours in each dimension.
constexpr int kColorBins = 16;
// Cells that a thread takes at a time.
constexpr int64_t kBlock = 1024;
// Logits by which a cell of one class alone wins: exp(-8) is 3e-4.
constexpr float kMargin = 8;
using Vector = IdentityVector;

std::vector<int32_t> ClassesOf(const Foam& foam) {
  std::vector<int32_t> classes(foam.NumSites());
  ParallelForBlocks(foam.NumSites(), kBlock, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) {
      classes[i] = FindMostLikelyClass(foam.classifier_weight.data(),
                                       foam.classifier_bias.data(),
                                       foam.num_classes,
                                       &foam.identity[i * kIdentityDim])
                       .class_index;
    }
  });
  return classes;
}

// Makes the classifier that has kMargin logits between a class's code and any other code.
void SetClassifier(const std::vector<Vector>& codes, Foam* foam) {
  float largest_cosine = 0;
  for (size_t a = 0; a < codes.size(); ++a) {
    for (size_t b = 0; b < a; ++b)
      largest_cosine = std::max(largest_cosine, codes[a].dot(codes[b]));
  }
  const float scale = kMargin / (1 - largest_cosine);
  for (size_t k = 0; k < codes.size(); ++k) {
    for (int c = 0; c < kIdentityDim; ++c) {
      foam->classifier_weight[k * kIdentityDim + c] = scale * codes[k][c];
    }
    foam->classifier_bias[k] = 0;
  }
}

// Returns the classes with votes that have few cells. Gives those without a cell the one with their
// greatest vote (ties: the first) that is not the last of another class.
std::vector<ClassIndex> KeepVotedClasses(const std::vector<LabelVote>& votes,
                                         const std::vector<Vector>& codes,
                                         Foam* foam) {
  std::vector<int32_t> classes = ClassesOf(*foam);
  std::vector<int64_t> count(codes.size(), 0);
  for (const int32_t c : classes) ++count[c];
  std::vector<bool> has_votes(codes.size(), false);
  for (const LabelVote& vote : votes) has_votes[Value(vote.class_index)] = true;
  std::vector<ClassIndex> small;
  for (size_t k = 0; k < codes.size(); ++k) {
    if (has_votes[k] && count[k] < kFewCells) small.push_back(ClassIndex{static_cast<int32_t>(k)});
  }
  for (const ClassIndex k : small) {
    if (count[Value(k)] > 0) continue;
    const LabelVote* greatest = nullptr;
    for (const LabelVote& vote : votes) {
      if (vote.class_index != k || count[classes[vote.cell]] == 1) continue;
      if (greatest == nullptr || vote.weight > greatest->weight) greatest = &vote;
    }
    if (greatest == nullptr) continue;
    --count[classes[greatest->cell]];
    classes[greatest->cell] = Value(k);
    ++count[Value(k)];
    std::copy_n(codes[Value(k)].data(),
                kIdentityDim,
                &foam->identity[greatest->cell * size_t{kIdentityDim}]);
  }
  return small;
}

// The densities of the colours of each class, over that of evenly spread colours.
class ColorDensities {
 public:
  ColorDensities(const CellStatistics& statistics,
                 const std::vector<LabelVote>& votes,
                 size_t num_classes)
      : bins_(num_classes, std::vector<float>(kNumBins, 0.f)) {
    std::vector<float> sums(num_classes, 0.f);
    for (const LabelVote& vote : votes) {
      const size_t k = Value(vote.class_index);
      bins_[k][BinOf(statistics.mean_color[vote.cell])] += vote.weight;
      sums[k] += vote.weight;
    }
    for (size_t k = 0; k < num_classes; ++k) {
      if (sums[k] == 0) continue;
      classes_.push_back(k);
      for (float& bin : bins_[k]) bin *= kNumBins / sums[k];
      for (const int stride : {1, kColorBins, kColorBins * kColorBins}) Smooth(stride, &bins_[k]);
    }
  }

  // Those with votes.
  const std::vector<size_t>& Classes() const { return classes_; }

  float Density(size_t class_index, const Eigen::Vector3f& color) const {
    return bins_[class_index][BinOf(color)];
  }

 private:
  static constexpr int kNumBins = kColorBins * kColorBins * kColorBins;

  static int BinOf(const Eigen::Vector3f& color) {
    int bin = 0;
    for (int c = 0; c < 3; ++c) {
      const float place = std::clamp(color[c] * kColorBins, 0.f, kColorBins - 1.f);
      bin = bin * kColorBins + static_cast<int>(place);
    }
    return bin;
  }

  // By 1/4, 1/2, 1/4 along one dimension.
  static void Smooth(int stride, std::vector<float>* bins) {
    const std::vector<float> before = *bins;
    for (int i = 0; i < kNumBins; ++i) {
      const int place = i / stride % kColorBins;
      const float lower = before[place > 0 ? i - stride : i];
      const float upper = before[place + 1 < kColorBins ? i + stride : i];
      (*bins)[i] = 0.25f * (lower + 2 * before[i] + upper);
    }
  }

  std::vector<size_t> classes_;
  // [classes][bins]
  std::vector<std::vector<float>> bins_;
};

// Computes the shares of the classes in an identity, which is a mixture of their codes: by matching
// pursuit, as codes of many classes are not orthogonal; where they are, these are the products with
// the codes. None is less than kLeastShare.
void FindShares(const std::vector<Vector>& codes, Vector identity, std::vector<float>* shares) {
  shares->assign(codes.size(), kLeastShare);
  for (int step = 0; step < kIdentityDim; ++step) {
    size_t largest = 0;
    float product = 0;
    for (size_t k = 0; k < codes.size(); ++k) {
      const float of_class = identity.dot(codes[k]);
      if (of_class <= product) continue;
      product = of_class;
      largest = k;
    }
    if (product <= kLeastShare) return;
    (*shares)[largest] += product;
    identity -= product * codes[largest];
  }
}

// Holds seen cells a little to the classes that are likely there by the labels as they are spread,
// `identities`, and by their colours. The shares of the former count by their square roots: they
// fall off fast along a surface, and would outweigh any colour. `hold` and `target` are as of
// ExtendHarmonically.
void AddColorEvidence(const CellStatistics& statistics,
                      const ColorDensities& densities,
                      const std::vector<Vector>& codes,
                      const std::vector<Vector>& identities,
                      std::vector<float>* hold,
                      std::vector<Vector>* target) {
  ParallelForBlocks(std::ssize(*hold), kBlock, [&](int64_t begin, int64_t end) {
    std::vector<float> shares;
    for (int64_t i = begin; i < end; ++i) {
      if (!(statistics.contribution[i] > kSeenContribution)) continue;
      FindShares(codes, identities[i], &shares);
      Vector mean = Vector::Zero();
      float sum = 0;
      for (const size_t k : densities.Classes()) {
        const float likelihood =
            densities.Density(k, statistics.mean_color[i]) + kLeastColorDensity;
        const float weight = std::sqrt(shares[k]) * likelihood;
        mean += weight * codes[k];
        sum += weight;
      }
      if (!(sum > 0)) continue;
      const float firmness = (*hold)[i] + kColorHold;
      (*target)[i] = ((*hold)[i] * (*target)[i] + kColorHold * mean / sum) / firmness;
      (*hold)[i] = firmness;
    }
  });
}

}  // namespace

bool FewViewsHaveLabels(const TrainingViews& views) {
  int num_training = 0, num_labelled = 0;
  for (int view = 0; view < views.NumViews(); ++view) {
    if (views.IsHeldOut(view)) continue;
    ++num_training;
    num_labelled += views.HasLabels(view);
  }
  return num_labelled > 0 && 2 * num_labelled < num_training;
}

ConductanceGraph MakeConductanceGraph(const Delaunay& delaunay,
                                      const CellStatistics& statistics,
                                      const Foam& foam) {
  const int64_t n = delaunay.num_sites;
  CHECK_EQ(n, std::ssize(foam.positions));
  CHECK_EQ(n, std::ssize(statistics.contribution));
  const std::vector<Eigen::Vector3f> cells = WithGuardSites(foam.positions);
  const std::vector<float> radii = CellRadii(cells, delaunay);
  const std::vector<double> areas = FaceAreas(cells, delaunay, VoronoiVertices(cells, delaunay));
  std::vector<float> opacity(n);
  for (int64_t i = 0; i < n; ++i) {
    opacity[i] = -std::expm1(-2 * radii[i] * Density(foam.raw_density[i]));
  }
  const auto is_seen = [&](uint32_t cell) {
    return statistics.contribution[cell] > kSeenContribution;
  };
  ConductanceGraph graph;
  graph.offsets.push_back(0);
  for (uint32_t i = 0; i < n; ++i) {
    for (uint32_t k = delaunay.offsets[i]; k < delaunay.offsets[i + 1]; ++k) {
      const uint32_t j = delaunay.neighbors[k];
      if (j >= n) continue;
      const float length = (foam.positions[i] - foam.positions[j]).norm();
      // An edge from or to the inside of a thing conducts as one between colours that differ a bit.
      const float difference =
          is_seen(i) && is_seen(j)
              ? (statistics.mean_color[i] - statistics.mean_color[j]).norm() / kColorScale
              : 1;
      const float likeness = std::exp(-0.5f * difference * difference);
      graph.neighbors.push_back(j);
      graph.conductance.push_back(static_cast<float>(areas[k]) / length *
                                  std::max(opacity[i] * opacity[j] * likeness, kLeastConductance));
    }
    graph.offsets.push_back(static_cast<uint32_t>(graph.neighbors.size()));
  }
  return graph;
}

std::vector<IdentityVector> ClassCodes(int num_classes) {
  std::vector<Vector> codes(num_classes);
  if (num_classes <= kIdentityDim) {
    for (int k = 0; k < num_classes; ++k) codes[k] = Vector::Unit(k);
    return codes;
  }
  // Random directions, of which each is the one of many that is the farthest from those before.
  constexpr int kTries = 64;
  for (int k = 0; k < num_classes; ++k) {
    float least = 2;
    CounterRandom random(/*seed=*/0, /*purpose=*/0x1abe1, k);
    for (int trial = 0; trial < kTries; ++trial) {
      Vector code;
      for (int c = 0; c < kIdentityDim; ++c) code[c] = static_cast<float>(random.Normal());
      code.normalize();
      float largest = -1;
      for (int other = 0; other < k; ++other) largest = std::max(largest, code.dot(codes[other]));
      if (largest >= least) continue;
      least = largest;
      codes[k] = code;
    }
  }
  return codes;
}

SpreadingResult SpreadLabels(const Delaunay& delaunay,
                             const CellStatistics& statistics,
                             const std::vector<LabelVote>& votes,
                             Foam* foam) {
  SpreadingResult result;
  if (votes.empty()) return result;
  const int64_t n = delaunay.num_sites;
  const std::vector<int32_t> before = ClassesOf(*foam);
  const std::vector<Vector> codes = ClassCodes(foam->num_classes);
  std::vector<float> hold(n, 0.f);
  std::vector<Vector> target(n, Vector::Zero());
  for (const LabelVote& vote : votes) {
    hold[vote.cell] += vote.weight;
    target[vote.cell] += vote.weight * codes.at(Value(vote.class_index));
  }
  for (int64_t i = 0; i < n; ++i) {
    if (hold[i] > 0) target[i] /= hold[i];
    hold[i] /= kEvenVotes;
  }
  const ColorDensities densities(statistics, votes, codes.size());
  const ConductanceGraph graph = MakeConductanceGraph(delaunay, statistics, *foam);
  std::vector<Vector> identities = ExtendHarmonically<kIdentityDim>(graph, hold, target);
  for (int round = 0; round < kColorRounds; ++round) {
    std::vector<float> color_hold = hold;
    std::vector<Vector> color_target = target;
    AddColorEvidence(statistics, densities, codes, identities, &color_hold, &color_target);
    identities = ExtendHarmonically<kIdentityDim>(graph, color_hold, color_target);
  }
  for (int64_t i = 0; i < n; ++i) {
    std::copy_n(identities[i].data(), kIdentityDim, &foam->identity[i * kIdentityDim]);
  }
  SetClassifier(codes, foam);
  result.small_classes = KeepVotedClasses(votes, codes, foam);
  const std::vector<int32_t> after = ClassesOf(*foam);
  for (int64_t i = 0; i < n; ++i) result.changed_cells += after[i] != before[i];
  return result;
}

}  // namespace semfoam
