// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/exportable_scene.h"
#include "export/scene/object_surface.h"
#include "export/texture/surface_texture.h"
#include "export/texture/texture_photos.h"

#include <string>
#include <vector>

namespace semfoam {

struct TextureOptions {
  // Largest edge of a texture, in texels; 64..16384. A texture is smaller (PackCharts) where the
  // photos do not show more.
  int size = 2048;

  // Returns an empty string, or one sentence that names the option out of range.
  std::string Check() const;
};

// Bakes the texture of the surface of an object from the photos that show it. `surface` is in the
// frame of the files of `scene`.
//
// - Charts: MakeUvCharts, packed by PackCharts. A texel is 0.7 times as wide as a pixel of the
// photos
//   that show most detail, or larger where `options.size` asks for it.
// - Which photos? A photo shows a vertex where the vertex is no farther away than what the surface
//   itself and the foam (TexturePhotos::VisibleDistance) leave to be seen, and where the mask of
//   the photo, if it has one and `object` has an id, shows the object. Its score is the number of
//   its pixels on a unit of the surface (resolution and angle), falling to 0 towards borders of
//   mask, photo and visible parts. The best photos of each vertex have shares that fall to 0
//   towards those that are just not among them; texels have the shares of their triangle's corners,
//   interpolated, so that they change smoothly everywhere, across the borders of charts too. Each
//   texel of a photo is tested again by mask and surface.
// - Colour: coarse detail is the mean of these photos, fine detail mostly that of the best, so that
//   photos that differ a little neither blur each other nor leave seams.
// - Exposure: photos are in the reference exposure; what remains is taken out by PhotoGains.
// - Texels that no photo shows have the colours of the vertices, which are the foam's, plus the
//   difference between photos and foam at the vertices around (ExtendOverSurface).
//
// Beyond its charts the texture repeats their borders for kChartMargin texels, and has the mean
// colour elsewhere. The same bytes on any number of threads.
SurfaceTexture BakeTexture(const ExportableScene& scene,
                           const ObjectInfo& object,
                           const ObjectSurface& surface,
                           const TexturePhotos& photos,
                           const TextureOptions& options);

}  // namespace semfoam
