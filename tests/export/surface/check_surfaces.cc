// SPDX-License-Identifier: GPL-3.0-or-later
//
// check_surfaces MESH...: holds mesh files (.ply, .obj) against what our surfaces promise, with
// CGAL's readers and checks alone: an oriented 2-manifold, closed, turned outwards. One line per
// file; exit code 1 where one breaks a promise. For runs by hand on large data sets, too.
#include <cstdio>
#include <iterator>
#include <vector>

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/IO/polygon_soup_io.h>
#include <CGAL/Polygon_mesh_processing/connected_components.h>
#include <CGAL/Polygon_mesh_processing/manifoldness.h>
#include <CGAL/Polygon_mesh_processing/measure.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/boost/graph/helpers.h>

namespace {

namespace PMP = CGAL::Polygon_mesh_processing;
using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Mesh = CGAL::Surface_mesh<Kernel::Point_3>;

// Null where all is well. `mesh` receives the mesh where it is one.
const char* WhatIsWrong(const char* path, Mesh* mesh) {
  std::vector<Kernel::Point_3> points;
  std::vector<std::vector<size_t>> faces;
  if (!CGAL::IO::read_polygon_soup(path, points, faces)) return "cannot be read";
  if (faces.empty()) return "has no faces";
  if (!PMP::is_polygon_soup_a_polygon_mesh(faces)) {
    return "has an edge of more than two faces, or of two that are turned differently";
  }
  PMP::polygon_soup_to_polygon_mesh(points, faces, *mesh);
  if (!CGAL::is_valid_polygon_mesh(*mesh)) return "is no valid polygon mesh";
  if (!CGAL::is_closed(*mesh)) return "has a border";
  std::vector<Mesh::Halfedge_index> pinched;
  PMP::non_manifold_vertices(*mesh, std::back_inserter(pinched));
  if (!pinched.empty()) return "has a vertex where two fans of faces meet";
  if (!(PMP::volume(*mesh) > 0)) return "is turned inside out";
  return nullptr;
}

}  // namespace

int main(int argc, char** argv) {
  bool all_good = argc > 1;
  for (int i = 1; i < argc; ++i) {
    Mesh mesh;
    const char* wrong = WhatIsWrong(argv[i], &mesh);
    all_good = all_good && wrong == nullptr;
    if (wrong != nullptr) {
      std::printf("%s: %s\n", argv[i], wrong);
      continue;
    }
    const auto component = mesh.add_property_map<Mesh::Face_index, size_t>("component", 0).first;
    std::printf("%s: closed, oriented 2-manifold of %zu faces, %zu shells, volume %.6g\n",
                argv[i],
                static_cast<size_t>(mesh.number_of_faces()),
                static_cast<size_t>(PMP::connected_components(mesh, component)),
                CGAL::to_double(PMP::volume(mesh)));
  }
  return all_good ? 0 : 1;
}
