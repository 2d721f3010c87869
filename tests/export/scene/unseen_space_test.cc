// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/scene/unseen_space.h"

#include "foam/geometry/guard_sites.h"
#include "foam/geometry/voronoi.h"

#include <algorithm>
#include <limits>
#include <numeric>

#include "tests/export/test_foams.h"
#include <gtest/gtest.h>

namespace semfoam {
namespace {

struct Cells {
  explicit Cells(const std::vector<Eigen::Vector3f>& sites)
      : positions(WithGuardSites(sites)),
        delaunay(Triangulate(positions)),
        areas(FaceAreas(positions, delaunay, VoronoiVertices(positions, delaunay))),
        knowledge(delaunay.num_cells, CellKnowledge::kOpen) {}

  std::vector<uint32_t> Inside() const {
    std::vector<uint32_t> cells;
    for (uint32_t i = 0; i < delaunay.num_sites; ++i) {
      if (knowledge[i] == CellKnowledge::kInside) cells.push_back(i);
    }
    return cells;
  }
  std::vector<uint32_t> Unseen() const {
    return UnseenInside(delaunay, areas, knowledge, Inside());
  }

  // The surface of the object if it owns `more` besides.
  double Area(const std::vector<uint32_t>& more) const {
    std::vector<uint8_t> owned(delaunay.num_cells, 0);
    for (const uint32_t cell : Inside()) owned[cell] = 1;
    for (const uint32_t cell : more) owned[cell] = 1;
    double area = 0;
    for (uint32_t i = 0; i < delaunay.num_cells; ++i) {
      for (uint32_t e = delaunay.offsets[i]; e < delaunay.offsets[i + 1]; ++e) {
        if (owned[i] && !owned[delaunay.neighbors[e]]) area += areas[e];
      }
    }
    return area;
  }

  std::vector<Eigen::Vector3f> positions;
  Delaunay delaunay;
  std::vector<double> areas;
  std::vector<CellKnowledge> knowledge;
};

// Against all 2^12 ways to divide the unseen cells.
TEST(UnseenSpace, IsDividedByTheSmallestSurface) {
  constexpr int kUnseen = 12;
  int divided = 0;
  for (unsigned seed = 0; seed < 20; ++seed) {
    Cells cells(RandomSites(60, seed));
    std::vector<uint32_t> by_distance(60);
    std::iota(by_distance.begin(), by_distance.end(), 0);
    std::sort(by_distance.begin(), by_distance.end(), [&](uint32_t a, uint32_t b) {
      return cells.positions[a].squaredNorm() < cells.positions[b].squaredNorm();
    });
    for (int k = 0; k < 30; ++k) {
      cells.knowledge[by_distance[k]] = k < kUnseen  ? CellKnowledge::kUnseen
                                        : k % 3 != 0 ? CellKnowledge::kInside
                                                     : CellKnowledge::kOpen;
    }
    double smallest = std::numeric_limits<double>::infinity();
    for (int subset = 0; subset < 1 << kUnseen; ++subset) {
      std::vector<uint32_t> more;
      for (int k = 0; k < kUnseen; ++k) {
        if (subset >> k & 1) more.push_back(by_distance[k]);
      }
      smallest = std::min(smallest, cells.Area(more));
    }
    const std::vector<uint32_t> got = cells.Unseen();
    EXPECT_NEAR(cells.Area(got), smallest, 1e-12 * smallest);
    EXPECT_TRUE(std::is_sorted(got.begin(), got.end()));
    divided += !got.empty() && got.size() < kUnseen;
  }
  EXPECT_GT(divided, 5);  // neither everything nor nothing
}

TEST(UnseenSpace, BehindAWallStaysOutside) {
  // A wall across the middle of a grid, and nobody has seen what is behind it.
  Cells cells(GridSites(6, 1, 0.2f, 3));
  for (uint32_t i = 0; i < cells.delaunay.num_sites; ++i) {
    const float x = cells.positions[i].x();
    if (x < 0) cells.knowledge[i] = CellKnowledge::kUnseen;
    if (x > 0 && x < 1) cells.knowledge[i] = CellKnowledge::kInside;
  }
  EXPECT_TRUE(cells.Unseen().empty());
}

TEST(UnseenSpace, WithNothingUnseenOrNoObjectIsEmpty) {
  Cells cells(RandomSites(60, 1));
  EXPECT_TRUE(cells.Unseen().empty());
  cells.knowledge[5] = CellKnowledge::kUnseen;
  EXPECT_TRUE(cells.Unseen().empty());
}

// Guards are open whatever is said of them: the object would else own the world.
TEST(UnseenSpace, EndsWhereTheWorldEnds) {
  Cells cells(RandomSites(60, 2));
  std::fill(cells.knowledge.begin(), cells.knowledge.end(), CellKnowledge::kUnseen);
  cells.knowledge[7] = CellKnowledge::kInside;
  for (const uint32_t cell : cells.Unseen()) EXPECT_LT(cell, cells.delaunay.num_sites);
}

}  // namespace
}  // namespace semfoam
