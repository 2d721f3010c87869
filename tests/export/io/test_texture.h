// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/object_surface.h"
#include "export/texture/surface_texture.h"

#include <cstdint>

namespace semfoam {

// A texture of a surface whose first triangle is a chart of its own: its corners have coordinates
// behind those of the vertices, which are in their order.
inline SurfaceTexture TestTexture(const ObjectSurface& surface) {
  SurfaceTexture texture;
  const auto add = [&](uint32_t v) {
    const auto i = static_cast<float>(texture.coordinates.size());
    texture.coordinates.emplace_back(0.25f + 0.5f / (1 + i), 0.125f + 0.25f / (1 + i));
    texture.vertex_of.push_back(v);
    return static_cast<uint32_t>(texture.vertex_of.size() - 1);
  };
  for (uint32_t v = 0; v < surface.vertices.size(); ++v) add(v);
  texture.triangles = surface.triangles;
  for (uint32_t& corner : texture.triangles.front()) corner = add(corner);
  texture.image = {2, 2, {0, 0, 0, 1, 1, 1, 2, 2, 2, 3, 3, 3}};
  texture.file = "the bytes of a picture";
  texture.extension = "png";
  return texture;
}

}  // namespace semfoam
