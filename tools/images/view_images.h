// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/image/image.h"
#include "foam/model/model.h"
#include "foam/view/view_renderer.h"
#include "plugin/photo/photo_light.h"

#include <vector>

#include <Eigen/Core>

namespace semfoam {

// Converts a render to pictures of the same size.

// Converts the colours of a render of a whole photo from the reference exposure to this light
// (PhotographedColor). Gives the same bytes on any number of threads.
void PutInLight(const PhotoLight& light, RenderedView* view);

// Returns the colours over white, clipped to 0..1 and rounded to 8 bits.
Image8 ColorImage(const RenderedView& view);

// Returns the ids of the labels (Label::id); 0 without a label.
LabelImage LabelIdImage(const RenderedView& view, const std::vector<Label>& labels);

// Returns the depth along the camera's z axis at transmittance 0.5, in units of the world (COLMAP)
// frame; 0 where the transmittance stays above 0.5. `rays` are those that `view` was rendered from,
// `z_axis` is the camera's viewing direction in the same axes (unit length), `scale` the world
// units per normalised unit.
std::vector<float> DepthImage(const RenderedView& view,
                              const CameraRays& rays,
                              const Eigen::Vector3d& z_axis,
                              double scale);

// Returns the ids in their LabelColor; black for 0.
Image8 PaletteImage(const LabelImage& ids);

// Returns the error of a render: per pixel the mean absolute difference of the channels, in colours
// of increasing brightness from black (equal) over violet and orange to white (kWhiteError of 255,
// or more). CHECKs equal sizes.
inline constexpr int kWhiteError = 64;
Image8 ErrorImage(const Image8& render, const Image8& photo);

// Joins images side by side, from left to right. CHECKs equal heights.
Image8 SideBySide(const std::vector<Image8>& images);

// Resizes an image by nearest neighbour, like ResizeNearest of labels.
Image8 ResizeNearest(const Image8& image, int width, int height);

}  // namespace semfoam
