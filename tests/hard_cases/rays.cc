// SPDX-License-Identifier: GPL-3.0-or-later
//
// Hard ways for a ray to meet cells: ties at every turn, faces that it runs in, and cells without
// end.
#include "foam/geometry/voronoi.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "tests/hard_cases/hard_case.h"
#include <Eigen/Geometry>

namespace semfoam {
namespace {

using Eigen::Vector3d;

// Sites at the multiples of a quarter in [-1, 1]: faces lie at the odd multiples of an eighth, and
// all of it is exact in float.
const RayScene& Lattice() {
  static const RayScene* const scene = [] {
    std::vector<Eigen::Vector3f> sites;
    for (int i = 0; i < 9 * 9 * 9; ++i) {
      sites.push_back(Eigen::Vector3f(i % 9, i / 9 % 9, i / 81) / 4.f - Eigen::Vector3f::Ones());
    }
    return new RayScene(sites, 31);
  }();
  return *scene;
}

const RayScene& RandomFoam() {
  static const RayScene* const scene = new RayScene(RandomSites(500, 32), 32);
  return *scene;
}

// The directions of lattice lines, both ways.
std::vector<Vector3d> LatticeDirections() {
  std::vector<Vector3d> directions;
  for (const Vector3d& d : {Vector3d(1, 0, 0),
                            Vector3d(0, 1, 0),
                            Vector3d(0, 0, 1),
                            Vector3d(1, 1, 0),
                            Vector3d(0, 1, -1),
                            Vector3d(1, 1, 1),
                            Vector3d(1, -1, 1),
                            Vector3d(1, 2, 0)}) {
    directions.push_back(d.normalized());
    directions.push_back(-d.normalized());
  }
  return directions;
}

// Along all lattice lines through lattice points shifted by `shift`.
HardCase LatticeCase(const std::string& name, const std::string& expected, const Vector3d& shift) {
  return {name, expected, [=](const CheckOptions& options) {
            std::vector<RayCase> rays;
            for (const Vector3d& direction : LatticeDirections()) {
              for (const Vector3d& through : {Vector3d(0, 0, 0), Vector3d(0.25, -0.5, 0.25)}) {
                const Vector3d origin = through + shift - 2 * direction;
                rays.push_back(MakeRay(origin, direction, rays.size()));
              }
            }
            return CheckRays(Lattice(), rays, {}, options);
          }};
}

// From where two, four or eight cells meet, and from a site, in all directions.
HardCaseResult StartingOnAFace(const CheckOptions& options) {
  std::vector<RayCase> rays;
  CounterRandom random(33, 0xa1, 0);
  for (const Vector3d& origin : {Vector3d(0, 0, 0),
                                 Vector3d(0.125, 0, 0),
                                 Vector3d(0.125, 0.125, 0),
                                 Vector3d(0.125, 0.125, 0.125)}) {
    for (const Vector3d& direction : LatticeDirections()) {
      rays.push_back(MakeRay(origin, direction, rays.size()));
    }
    for (int i = 0; i < 8; ++i) {
      rays.push_back(MakeRay(origin, RandomDirection(&random), rays.size()));
    }
  }
  return CheckRays(Lattice(), rays, {}, options);
}

// Off the direction of a face by less and less, down to the smallest float.
HardCaseResult NearlyParallelToFaces(const CheckOptions& options) {
  std::vector<RayCase> rays;
  for (const double slope : {1e-3, 1e-5, 1e-7, 1e-12, 1e-20, 1e-37, 1e-45}) {
    for (const double sign : {-1.0, 1.0}) {
      for (const double y : {0.125, 0.1249999, 0.0}) {
        const Vector3d direction(1, sign * slope, -sign * slope);
        rays.push_back(MakeRay({-2, y, 0.125}, direction.normalized(), rays.size()));
      }
    }
  }
  return CheckRays(Lattice(), rays, {}, options);
}

// Through the corners of random cells: along their edges, and in the planes of their faces.
HardCaseResult AlongRandomEdges(const CheckOptions& options) {
  const RayScene& scene = RandomFoam();
  const Delaunay& delaunay = scene.cells.delaunay;
  const std::vector<Vector3d> vertices = VoronoiVertices(scene.cells.positions, delaunay);
  std::vector<RayCase> rays;
  for (uint32_t t = 0; t < vertices.size() && rays.size() < 60; ++t) {
    for (int k = 0; k < 4; ++k) {
      const uint32_t across = delaunay.tet_neighbors[t][k];
      if (across == kNoTet || vertices[t].norm() > 1 || vertices[across].norm() > 1) continue;
      const Vector3d along = (vertices[across] - vertices[t]).normalized();
      rays.push_back(MakeRay(vertices[t] - 0.5 * along, along, rays.size()));
      rays.push_back(MakeRay(vertices[t], along, rays.size()));
      // In the plane of one of the edge's faces: across the edge, square to the face's normal.
      const Vector3d normal = scene.cells.geometry.positions[delaunay.tets[t][(k + 1) % 4]] -
                              scene.cells.geometry.positions[delaunay.tets[t][(k + 2) % 4]];
      const Vector3d in_face = normal.cross(along).normalized();
      rays.push_back(MakeRay(vertices[t] - 0.5 * in_face, in_face, rays.size()));
    }
  }
  // Either side of a face is right for a ray that runs in it, and their colours differ.
  RayBounds bounds;
  bounds.color_float = std::numeric_limits<double>::infinity();
  return CheckRays(scene, rays, bounds, options);
}

// From site to site, which is the direction of a face's normal, and through corners of cells.
HardCaseResult ThroughRandomSitesAndCorners(const CheckOptions& options) {
  const RayScene& scene = RandomFoam();
  const Delaunay& delaunay = scene.cells.delaunay;
  const std::vector<Vector3d> vertices = VoronoiVertices(scene.cells.positions, delaunay);
  std::vector<RayCase> rays;
  for (uint32_t i = 0; i < 20; ++i) {
    const Vector3d site = scene.cells.geometry.positions[i];
    const Vector3d neighbor = scene.cells.geometry.positions[delaunay.Neighbors(i)[0]];
    const Vector3d normal = (neighbor - site).normalized();
    rays.push_back(MakeRay(site - normal, normal, i));
    rays.push_back(MakeRay(site, normal, i));
  }
  for (uint32_t t = 0; t < vertices.size() && rays.size() < 60; ++t) {
    if (vertices[t].norm() > 1) continue;
    CounterRandom random(34, 0xa2, t);
    const Vector3d direction = RandomDirection(&random);
    rays.push_back(MakeRay(vertices[t] - direction, direction, t));
    rays.push_back(MakeRay(vertices[t], direction, t));
  }
  return CheckRays(scene, rays, {}, options);
}

// A line of sites, along which one ray meets them all.
HardCaseResult LongRay(const CheckOptions& options) {
  constexpr int kSites = 100'000;
  std::vector<Eigen::Vector3f> sites;
  for (int i = 0; i < kSites; ++i) {
    sites.emplace_back(static_cast<float>(2 * (i + 0.5) / kSites - 1), 0.f, 0.f);
  }
  const RayScene scene(sites, 35, 0, 2);
  std::vector<RayCase> rays = {MakeRay({-2, 0, 0}, {1, 0, 0}, 0),
                               MakeRay({2, 1e-3, 0}, {-1, 0, 0}, 1)};
  RayBounds bounds;
  bounds.gradient_float = 5e-4;  // sums of 1e5 roundings
  HardCaseResult result = CheckRays(scene, rays, bounds, options);
  result.Expect(result.steps >= 4 * kSites, "only ", result.steps, " steps on four rays.");
  return result;
}

// Rings of sites around a ray, all at one distance from it and square to it: every hop is nearly
// perpendicular to the ray, and rounding decides where it is and which way it leads. The rule that
// such a hop must go to a site farther along the ray keeps the walk out of circles.
HardCaseResult PerpendicularHops(const CheckOptions& options) {
  HardCaseResult result;
  RayBounds bounds;
  // All sites of a ring are equally near, to rounding: any cell of it will do.
  bounds.color_float = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 400; ++i) {
    CounterRandom random(36, 0xa4, i);
    const Vector3d direction = RandomDirection(&random);
    const Vector3d across = direction.unitOrthogonal();
    const int count = 3 + static_cast<int>(random.Below(10));
    const double turn = random.Uniform();
    std::vector<Eigen::Vector3f> sites;
    for (int k = 0; k < count; ++k) {
      const Eigen::AngleAxisd rotation(2 * std::numbers::pi * (k + turn) / count, direction);
      sites.push_back((rotation * across).cast<float>());
    }
    const RayScene scene(sites, 36, 0, 2);
    const RayCase rays[] = {MakeRay({0, 0, 0}, direction, i),
                            MakeRay(-2 * direction, direction, i),
                            MakeRay(-direction, -direction, i)};
    result.Add(CheckRays(scene,
                         {std::begin(rays), std::end(rays)},
                         bounds,
                         i % 40 == 0 ? options : CheckOptions{nullptr, options.device}));
  }
  result.Expect(result.zero_length_steps > 100,
                "only ",
                result.zero_length_steps,
                " hops were of no length.");
  return result;
}

}  // namespace

std::vector<HardCase> RaysCases() {
  const std::string right = "every piece lies in the cell of its nearest site, ";
  return {
      LatticeCase("along_lattice_lines_through_sites",
                  right + "the faces are hit in their middle, at edges and at corners",
                  {0, 0, 0}),
      LatticeCase("along_lattice_lines_in_faces", right + "any of the two", {0, 0.125, 0}),
      LatticeCase("along_lattice_lines_on_edges", right + "any of the four", {0, 0.125, 0.125}),
      LatticeCase("along_lattice_lines_through_vertices",
                  right + "any of the eight",
                  {0.125, 0.125, 0.125}),
      {"starting_on_a_face_an_edge_or_a_corner", right + "from the start", StartingOnAFace},
      {"nearly_parallel_to_faces",
       right + "and a face met at less than 1e-5 gets no gradient",
       NearlyParallelToFaces},
      {"through_sites_and_corners_of_random_cells",
       right + "whatever the tie",
       ThroughRandomSitesAndCorners},
      {"along_edges_and_in_faces_of_random_cells", right + "whatever the tie", AlongRandomEdges},
      {"1e5_cells_long", right + "and 1e5 roundings add up to less than 5e-4", LongRay},
      {"nearly_perpendicular_hops",
       "no walk goes in circles: a hop of no length leads farther along the ray",
       PerpendicularHops},
  };
}

}  // namespace semfoam
