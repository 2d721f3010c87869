// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/image/image.h"
#include "foam/model/model.h"
#include "foam/view/view_renderer.h"

#include <vector>

#include <Eigen/Core>

namespace semfoam {

// A render as pictures, all of its size.

// Colours over white, cut to 0..1 and rounded to 8 bits.
Image8 ColorImage(const RenderedView& view);

// The ids of the labels, which are the input masks' (see Label); 0 where there is none.
LabelImage IdImage(const RenderedView& view, const std::vector<Label>& labels);

// Depth along the camera's z axis at transmittance 0.5, in units of the world (COLMAP) frame; 0
// where the ray never loses half of its light. `rays` are those that `view` was rendered from,
// `z_axis` is the camera's viewing direction in the same axes (unit length), `scale` the world
// units per normalised unit.
std::vector<float> DepthImage(const RenderedView& view,
                              const CameraRays& rays,
                              const Eigen::Vector3d& z_axis,
                              double scale);

// The ids in the colours that labels.json gives them; black for 0.
Image8 PaletteImage(const LabelImage& ids);

// Where a render is wrong: per pixel the mean absolute difference of the channels, in colours that
// go from black (equal) over violet and orange to white (kWhiteError of 255, or more) and grow
// brighter all the way. CHECKs equal sizes.
inline constexpr int kWhiteError = 64;
Image8 ErrorImage(const Image8& render, const Image8& photo);

// Side by side, from left to right. CHECKs equal heights.
Image8 SideBySide(const std::vector<Image8>& images);

// Nearest neighbour, as ResizeNearest.
Image8 ResizeNearest(const Image8& image, int width, int height);

}  // namespace semfoam
