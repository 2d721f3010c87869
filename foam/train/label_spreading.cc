// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/train/label_spreading.h"

#include "foam/geometry/guard_sites.h"
#include "foam/geometry/voronoi.h"
#include "foam/model/activation.h"
#include "foam/model/classifier.h"
#include "foam/util/parallel.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <limits>
#include <queue>
#include <utility>

#include <glog/logging.h>

namespace semfoam {
namespace {

float Env(const char* name, float value) {
  const char* text = std::getenv(name);
  return text ? std::atof(text) : value;
}

// Sum of weights in labelled pixels at which a cell's own identity counts as much as all of its
// neighbours'.
const float kEvenEvidence = Env("SF_EVEN", 1.0f);
// Difference of colour at which an edge conducts by exp(-1/2) less, display values.
const float kColorScale = Env("SF_COLOR", 0.1f);
// Conductance of an edge through air, and of one between colours that have nothing in common.
const float kLeastConductance = Env("SF_LEAST", 1e-3f);
const int kIterations = Env("SF_ITER", 100);

using Identity = Eigen::Matrix<float, kIdentityDim, 1>;

// Returns the conductance of every directed edge, aligned with delaunay.neighbors; 0 towards
// guards. Those of one cell add up to 1.
std::vector<float> Conductances(const Delaunay& delaunay,
                                const CellStatistics& statistics,
                                const Foam& foam) {
  const std::vector<Eigen::Vector3f> cells = WithGuardSites(foam.positions);
  const std::vector<float> radii = CellRadii(cells, delaunay);
  const std::vector<double> areas = FaceAreas(cells, delaunay, VoronoiVertices(cells, delaunay));
  const int64_t n = delaunay.num_sites;
  std::vector<float> opacity(n);
  for (int64_t i = 0; i < n; ++i) {
    opacity[i] = -std::expm1(-2 * radii[i] * Density(foam.raw_density[i]));
  }
  std::vector<float> conductance(delaunay.neighbors.size(), 0.f);
  ParallelForBlocks(n, 1024, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) {
      double sum = 0;
      for (uint32_t k = delaunay.offsets[i]; k < delaunay.offsets[i + 1]; ++k) {
        const uint32_t j = delaunay.neighbors[k];
        if (j >= n) continue;
        const float length = (foam.positions[i] - foam.positions[j]).norm();
        // Nobody sees the colours of cells inside of things.
        const bool both_seen = statistics.contribution[i] > 0.01f && statistics.contribution[j] > 0.01f;
        const float difference =
            both_seen ? (statistics.mean_color[i] - statistics.mean_color[j]).norm() : kColorScale;
        const float likeness = std::exp(-0.5f * difference * difference / (kColorScale * kColorScale));
        const float matter = opacity[i] * opacity[j];
        conductance[k] = static_cast<float>(areas[k]) / length *
                         std::max(matter * likeness, kLeastConductance);
        sum += conductance[k];
      }
      for (uint32_t k = delaunay.offsets[i]; k < delaunay.offsets[i + 1] && sum > 0; ++k) {
        conductance[k] = static_cast<float>(conductance[k] / sum);
      }
    }
  });
  return conductance;
}

// Returns for each cell the labelled cell from which the way is the easiest: the sum of an edge's
// length over its conductance; kNoCell where there is none.
std::vector<uint32_t> NearestLabelled(const Delaunay& delaunay,
                                      const std::vector<float>& conductance,
                                      const std::vector<float>& labelled,
                                      const Foam& foam) {
  using Entry = std::pair<float, uint32_t>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
  const uint32_t n = delaunay.num_sites;
  std::vector<uint32_t> source(n, kNoCell);
  std::vector<float> cost(n, std::numeric_limits<float>::infinity());
  for (uint32_t i = 0; i < n; ++i) {
    if (labelled[i] < kEvenEvidence) continue;
    source[i] = i;
    cost[i] = 0;
    queue.emplace(0.f, i);
  }
  while (!queue.empty()) {
    const auto [reached, i] = queue.top();
    queue.pop();
    if (reached > cost[i]) continue;
    for (uint32_t k = delaunay.offsets[i]; k < delaunay.offsets[i + 1]; ++k) {
      const uint32_t j = delaunay.neighbors[k];
      if (j >= n || !(conductance[k] > 0)) continue;
      const float length = (foam.positions[i] - foam.positions[j]).norm();
      const float to_neighbor = reached + length / conductance[k];
      if (!(to_neighbor < cost[j])) continue;
      cost[j] = to_neighbor;
      source[j] = source[i];
      queue.emplace(to_neighbor, j);
    }
  }
  return source;
}

std::vector<int32_t> ClassesOf(const Foam& foam) {
  std::vector<int32_t> classes(foam.NumSites());
  ParallelForBlocks(foam.NumSites(), 1024, [&](int64_t begin, int64_t end) {
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

int64_t SpreadLabels(const Delaunay& delaunay,
                     const CellStatistics& statistics,
                     const std::vector<float>& labelled,
                     Foam* foam) {
  const int64_t n = delaunay.num_sites;
  CHECK_EQ(n, std::ssize(foam->positions));
  CHECK_EQ(n, std::ssize(labelled));
  CHECK_EQ(n, std::ssize(statistics.contribution));
  const std::vector<int32_t> before = ClassesOf(*foam);
  const std::vector<float> conductance = Conductances(delaunay, statistics, *foam);
  const std::vector<uint32_t> source = NearestLabelled(delaunay, conductance, labelled, *foam);

  const auto trained = [&](int64_t i) {
    return Eigen::Map<const Identity>(&foam->identity[i * kIdentityDim]);
  };
  std::vector<Identity> now(n), next(n);
  for (int64_t i = 0; i < n; ++i) now[i] = trained(source[i] == kNoCell ? i : source[i]);
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    ParallelForBlocks(n, 1024, [&](int64_t begin, int64_t end) {
      for (int64_t i = begin; i < end; ++i) {
        const float own = labelled[i] / kEvenEvidence;
        Identity sum = own * trained(i);
        float weight = own;
        for (uint32_t k = delaunay.offsets[i]; k < delaunay.offsets[i + 1]; ++k) {
          if (!(conductance[k] > 0)) continue;
          sum += conductance[k] * now[delaunay.neighbors[k]];
          weight += conductance[k];
        }
        next[i] = weight > 0 ? Identity(sum / weight) : now[i];
      }
    });
    std::swap(now, next);
  }
  for (int64_t i = 0; i < n; ++i) {
    std::copy_n(now[i].data(), kIdentityDim, &foam->identity[i * kIdentityDim]);
  }

  const std::vector<int32_t> after = ClassesOf(*foam);
  int64_t changed = 0;
  for (int64_t i = 0; i < n; ++i) changed += after[i] != before[i];
  return changed;
}

}  // namespace semfoam
