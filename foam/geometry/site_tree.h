// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// A k-d tree of sites, for queries of the sites nearest to a point. Takes 4 bytes a site besides
// the positions, which it refers to.
class SiteTree {
 public:
  // A tree of the sites listed in `sites`.
  SiteTree(const std::vector<Eigen::Vector3f>& positions, std::vector<uint32_t> sites);

  // Returns at most `most` of the sites that are no farther from `query` than `reach`, both in the
  // unit of the positions: the nearest ones, by distance (ties: by index).
  std::vector<uint32_t> Nearest(const Eigen::Vector3d& query, double reach, size_t most) const;

 private:
  struct Found {
    double squared_distance;
    uint32_t site;
    bool operator<(const Found& other) const {
      return squared_distance != other.squared_distance ? squared_distance < other.squared_distance
                                                        : site < other.site;
    }
  };

  // Orders sites_[begin, end) around their median along `axis`, and its halves along the next axes.
  void Build(size_t begin, size_t end, int axis);
  void Search(const Eigen::Vector3d& query,
              size_t most,
              size_t begin,
              size_t end,
              int axis,
              double* squared_reach,
              std::vector<Found>* heap) const;

  const std::vector<Eigen::Vector3f>& positions_;
  std::vector<uint32_t> sites_;
};

}  // namespace semfoam
