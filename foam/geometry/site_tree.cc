// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/geometry/site_tree.h"

#include <algorithm>
#include <utility>

namespace semfoam {
namespace {

// Ranges of at most this many sites are searched one by one.
constexpr size_t kLeaf = 16;

int NextAxis(int axis) { return (axis + 1) % 3; }

}  // namespace

SiteTree::SiteTree(const std::vector<Eigen::Vector3f>& positions, std::vector<uint32_t> sites)
    : positions_(positions), sites_(std::move(sites)) {
  Build(0, sites_.size(), 0);
}

void SiteTree::Build(size_t begin, size_t end, int axis) {
  if (end - begin <= kLeaf) return;
  const size_t middle = begin + (end - begin) / 2;
  std::nth_element(sites_.begin() + static_cast<std::ptrdiff_t>(begin),
                   sites_.begin() + static_cast<std::ptrdiff_t>(middle),
                   sites_.begin() + static_cast<std::ptrdiff_t>(end),
                   [&](uint32_t a, uint32_t b) {
                     const float x = positions_[a][axis], y = positions_[b][axis];
                     return x != y ? x < y : a < b;
                   });
  Build(begin, middle, NextAxis(axis));
  Build(middle + 1, end, NextAxis(axis));
}

void SiteTree::Search(const Eigen::Vector3d& query,
                      size_t most,
                      size_t begin,
                      size_t end,
                      int axis,
                      double* squared_reach,
                      std::vector<Found>* heap) const {
  const auto look_at = [&](uint32_t site) {
    const double distance = (positions_[site].cast<double>() - query).squaredNorm();
    if (distance > *squared_reach) return;
    if (heap->size() == most) {
      if (!(Found{distance, site} < heap->front())) return;
      std::pop_heap(heap->begin(), heap->end());
      heap->pop_back();
    }
    heap->push_back({distance, site});
    std::push_heap(heap->begin(), heap->end());
    if (heap->size() == most) *squared_reach = heap->front().squared_distance;
  };
  if (end - begin <= kLeaf) {
    for (size_t k = begin; k < end; ++k) look_at(sites_[k]);
    return;
  }
  const size_t middle = begin + (end - begin) / 2;
  const double beyond = query[axis] - positions_[sites_[middle]][axis];
  const std::pair<size_t, size_t> below(begin, middle), above(middle + 1, end);
  const auto& near = beyond < 0 ? below : above;
  const auto& far = beyond < 0 ? above : below;
  Search(query, most, near.first, near.second, NextAxis(axis), squared_reach, heap);
  if (beyond * beyond > *squared_reach) return;
  look_at(sites_[middle]);
  Search(query, most, far.first, far.second, NextAxis(axis), squared_reach, heap);
}

std::vector<uint32_t> SiteTree::Nearest(const Eigen::Vector3d& query,
                                        double reach,
                                        size_t most) const {
  std::vector<Found> heap;
  double squared_reach = reach * reach;
  if (most > 0) Search(query, most, 0, sites_.size(), 0, &squared_reach, &heap);
  std::sort_heap(heap.begin(), heap.end());
  std::vector<uint32_t> sites;
  for (const Found& found : heap) sites.push_back(found.site);
  return sites;
}

}  // namespace semfoam
