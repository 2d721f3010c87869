// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/geometry/delaunay.h"

#include "foam/geometry/voronoi.h"
#include "foam/util/parallel.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <set>
#include <vector>

#include "tests/foam/random_cells.h"
#include <gtest/gtest.h>

namespace semfoam {
namespace {

// What must hold of any triangulation, however degenerate the sites.
void ExpectValid(const WalkableCells& cells) {
  const Delaunay& delaunay = cells.delaunay;
  ASSERT_EQ(delaunay.offsets.size(), delaunay.num_cells + 1);
  ASSERT_EQ(delaunay.offsets.back(), delaunay.neighbors.size());
  for (uint32_t i = 0; i < delaunay.num_cells; ++i) {
    const auto around = delaunay.Neighbors(i);
    ASSERT_TRUE(std::is_sorted(around.begin(), around.end()));
    for (const uint32_t j : around) {
      ASSERT_NE(j, i);
      ASSERT_TRUE(std::ranges::binary_search(delaunay.Neighbors(j), i)) << "not symmetric";
    }
  }
  for (uint32_t t = 0; t < delaunay.tets.size(); ++t) {
    for (int k = 0; k < 4; ++k) {
      const uint32_t across = delaunay.tet_neighbors[t][k];
      if (across == kNoTet) {
        // Only guards are on the hull.
        for (int c = 0; c < 4; ++c) {
          if (c != k) {
            ASSERT_GE(delaunay.tets[t][c], delaunay.num_sites);
          }
        }
        continue;
      }
      std::set<uint32_t> shared(delaunay.tets[t].begin(), delaunay.tets[t].end());
      shared.erase(delaunay.tets[t][k]);
      for (const uint32_t v : delaunay.tets[across]) shared.erase(v);
      ASSERT_TRUE(shared.empty()) << "neighbours do not share the facet";
    }
  }
}

std::vector<Eigen::Vector3f> Grid(int n) {
  std::vector<Eigen::Vector3f> sites;
  for (int i = 0; i < n * n * n; ++i) {
    sites.push_back(Eigen::Vector3f(i % n, i / n % n, i / n / n) / float(n));
  }
  return sites;
}

TEST(Delaunay, IsValidForRandomAndDegenerateSites) {
  ExpectValid(WalkableCells(RandomSites(1000, 1)));
  ExpectValid(WalkableCells(Grid(8)));
  ExpectValid(WalkableCells(std::vector<Eigen::Vector3f>{}));
  ExpectValid(WalkableCells(RandomSites(1, 2)));
  ExpectValid(WalkableCells(RandomSites(4, 3)));
}

TEST(Delaunay, IsEmptyOfOtherSites) {
  const WalkableCells cells(RandomSites(300, 4));
  const auto centers = VoronoiVertices(cells.positions, cells.delaunay);
  for (uint32_t t = 0; t < centers.size(); ++t) {
    const double radius = (cells.geometry.positions[cells.delaunay.tets[t][0]] - centers[t]).norm();
    if (centers[t].norm() > 50) continue;  // cut circumcentres of the guards' own tetrahedra
    const double nearest =
        (cells.geometry.positions[cells.BruteForceNearest(centers[t])] - centers[t]).norm();
    ASSERT_NEAR(nearest, radius, 1e-6 * (1 + radius));
  }
}

TEST(Delaunay, GivesADuplicateSiteAnEmptyCellAndTheLowestIndexTheFullOne) {
  std::vector<Eigen::Vector3f> sites = RandomSites(50, 5);
  sites.push_back(sites[7]);
  const WalkableCells cells(sites);
  EXPECT_FALSE(cells.delaunay.Neighbors(7).empty());
  EXPECT_TRUE(cells.delaunay.Neighbors(50).empty());
  ExpectValid(cells);
  EXPECT_EQ(NearestCell(cells.positions, cells.delaunay, sites[7].cast<double>(), 50), 7u);
}

TEST(Delaunay, DoesNotDependOnTheThreads) {
  const auto positions = WithGuardSites(RandomSites(3000, 6));
  const auto triangulate = [&](int threads) {
    const ThreadLimit limit(threads);
    return Triangulate(positions);
  };
  const Delaunay one = triangulate(1), five = triangulate(5);
  EXPECT_EQ(one.neighbors, five.neighbors);
  EXPECT_EQ(one.tets, five.tets);
}

TEST(Delaunay, NearestCellIsTheNearestFromAnyStart) {
  const WalkableCells cells(RandomSites(500, 7));
  for (int i = 0; i < 300; ++i) {
    CounterRandom random(7, 0x71, i);
    const Eigen::Vector3d query = RandomPoint(&random, i % 5 == 0 ? 120 : 1.3);
    const uint32_t start = random.Below(cells.delaunay.num_cells);
    EXPECT_EQ(NearestCell(cells.positions, cells.delaunay, query, start),
              cells.BruteForceNearest(query));
  }
}

TEST(Delaunay, HilbertOrderIsAPermutationOfNeighbours) {
  const auto sites = RandomSites(2000, 8);
  const auto order = HilbertOrder(sites);
  std::vector<uint32_t> sorted = order;
  std::sort(sorted.begin(), sorted.end());
  for (uint32_t i = 0; i < sorted.size(); ++i) ASSERT_EQ(sorted[i], i);
  double along_curve = 0, as_given = 0;
  for (size_t k = 1; k < order.size(); ++k) {
    along_curve += (sites[order[k]] - sites[order[k - 1]]).norm();
    as_given += (sites[k] - sites[k - 1]).norm();
  }
  EXPECT_LT(along_curve, 0.2 * as_given);
}

TEST(DelaunayVoronoi, CellsOfAGridAreCubes) {
  const int n = 6;
  const WalkableCells cells(Grid(n));
  const auto vertices = VoronoiVertices(cells.positions, cells.delaunay);
  const auto areas = FaceAreas(cells.positions, cells.delaunay, vertices);
  const auto volumes = CellVolumes(cells.positions, cells.delaunay, areas);
  const auto radii = CellRadii(cells.positions, cells.delaunay);
  const double edge = 1.0 / n;
  int inner = 0;
  for (int i = 0; i < n * n * n; ++i) {
    const int x = i % n, y = i / n % n, z = i / n / n;
    if (std::min({x, y, z}) == 0 || std::max({x, y, z}) == n - 1) continue;
    ++inner;
    EXPECT_NEAR(volumes[i], edge * edge * edge, 1e-6 * edge * edge * edge);
    double surface = 0;
    for (uint32_t e = cells.delaunay.offsets[i]; e < cells.delaunay.offsets[i + 1]; ++e) {
      surface += areas[e];
    }
    EXPECT_NEAR(surface, 6 * edge * edge, 1e-6 * edge * edge);
    EXPECT_GE(radii[i], 0.499 * edge);
  }
  EXPECT_EQ(inner, (n - 2) * (n - 2) * (n - 2));
}

TEST(DelaunayVoronoi, VolumesAgreeWithCountingPoints) {
  const WalkableCells cells(RandomSites(200, 9));
  const auto areas =
      FaceAreas(cells.positions, cells.delaunay, VoronoiVertices(cells.positions, cells.delaunay));
  const auto volumes = CellVolumes(cells.positions, cells.delaunay, areas);
  // Cells that lie inside the cube altogether: their share of random points is their share of the
  // volume.
  std::vector<int> count(cells.delaunay.num_cells, 0);
  std::vector<double> reach(cells.delaunay.num_cells, 0);
  const int num_points = 200'000;
  uint32_t hint = 0;
  for (int i = 0; i < num_points; ++i) {
    CounterRandom random(9, 0x91, i);
    const Eigen::Vector3d x = RandomPoint(&random, 1);
    hint = NearestCell(cells.positions, cells.delaunay, x, hint);
    ++count[hint];
    reach[hint] = std::max(reach[hint], x.cwiseAbs().maxCoeff());
  }
  int compared = 0;
  for (int i = 0; i < 200; ++i) {
    if (reach[i] > 0.95 || count[i] < 200) continue;
    const double expected = 8.0 * count[i] / num_points;
    EXPECT_NEAR(volumes[i], expected, 5 * expected / std::sqrt(count[i]));
    ++compared;
  }
  EXPECT_GT(compared, 30);
}

TEST(DelaunayVoronoi, VerticesAreFiniteForSlivers) {
  // Nearly cospherical sites make slivers whose circumcentres lie anywhere.
  std::vector<Eigen::Vector3f> sites = Grid(6);
  for (size_t i = 0; i < sites.size(); ++i) {
    CounterRandom random(10, 0x92, i);
    sites[i] += 1e-6f * RandomDirection(&random).cast<float>();
  }
  const WalkableCells cells(sites);
  for (const Eigen::Vector3d& v : VoronoiVertices(cells.positions, cells.delaunay)) {
    ASSERT_TRUE(v.allFinite());
    ASSERT_LE(v.norm(), 2.001 * kGuardRadius);
  }
}

}  // namespace
}  // namespace semfoam
