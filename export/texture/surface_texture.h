// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/image/image.h"

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// The texture of a surface.
struct SurfaceTexture {
  // Texture coordinates, 0..1: (0, 0) is the upper left corner of the image, v points down. Each is
  // of one vertex of the surface; vertices on the borders of charts have several.
  std::vector<Eigen::Vector2f> coordinates;
  std::vector<uint32_t> vertex_of;
  // [triangles of the surface] The coordinates of the corners.
  std::vector<std::array<uint32_t, 3>> triangles;

  // Square, display values.
  Image8 image;
  // `image` as a file, and its extension: "png" or "jpg".
  std::string file;
  std::string extension;

  // Number of texels that lie on the surface, and of those that take their colour from photos.
  int64_t num_texels = 0;
  int64_t num_photo_texels = 0;
  // Number of photos with a share in a texel.
  int num_photos = 0;
};

}  // namespace semfoam
