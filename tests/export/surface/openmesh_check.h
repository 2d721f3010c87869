// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/surface/semantic_mesh.h"

#include <gtest/gtest.h>

namespace semfoam {

// OpenMesh takes the surface as it is and finds neither border nor pinched vertex.
inline void ExpectClosedForOpenMesh(const ObjectSurface& surface) {
  const SemanticMesh mesh = ToSemanticMesh(surface);
  EXPECT_EQ(mesh.n_vertices(), surface.vertices.size());
  EXPECT_EQ(mesh.n_faces(), surface.triangles.size());
  for (const auto edge : mesh.edges()) ASSERT_FALSE(mesh.is_boundary(edge));
  for (const auto vertex : mesh.vertices()) ASSERT_TRUE(mesh.is_manifold(vertex));
}

}  // namespace semfoam
