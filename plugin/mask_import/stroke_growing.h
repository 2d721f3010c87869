// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/image/image.h"
#include "plugin/mask_import/pixel_runs.h"
#include "plugin/photo/photo.h"

#include <cstdint>
#include <filesystem>
#include <vector>

namespace semfoam {

// Grows points, lines and boxes on photos into masks.
//
// A photo, reduced to a longest side of 640 pixels, is divided into superpixels. Those that are
// marked have a label; for each other one the probability of a label is that of a random walk from
// it to meet this label first (Grady, "Random walks for image segmentation", 2006). A walk steps to
// a neighbour in proportion to the length of their border and to the likeness of their colours
// (CIELAB), and in proportion to the area it ends: at a label by the likelihood of its colour
// ("Multilabel random walker image segmentation using prior models", 2005), or, where the colour is
// like none that is known, at no label. The colours of a label are those of the superpixels that
// are surely of it, in all photos; first those around the marks, then those to which it has grown.
// So the marks of all labels in a photo compete, and a photo helps the others.
//
// A pixel gets the most probable label where this is clear; else it stays unlabelled, because a
// training on few masks labels it better from all sides than a guess does.

// A mark of an object in a photo.
struct Mark {
  // What it marks: > 0, the same in all photos.
  int32_t id = 0;
  // In pixels of the picture that was marked. One point is a point, several are a line from one to
  // the next. A box is any two opposite corners.
  std::vector<PolygonPoint> points;
  // An object in a box does not grow out of its boxes in this photo. Where nothing else marks it
  // there, half of a box's width and height around its centre are taken for it.
  bool is_box = false;
};

struct MarkedPhoto {
  std::filesystem::path file;
  // Of the picture that was marked, with the shape of the photo.
  PhotoSize size;
  std::vector<Mark> marks;
  // The ids of pixels that are known, 0 elsewhere, in any size of the photo's shape; empty: none.
  // They are kept as they are.
  LabelImage known;
};

// Returns the ids in another size, each pixel that of the nearest centre. CHECKs that both sizes
// have a pixel.
LabelImage ResizeLabels(const LabelImage& labels, const PhotoSize& size);

// Returns the masks [photos], each of ids, 0 = unlabelled, in the size that the photo is reduced
// to. Photos are worked on in parallel; some 2 MB of each stay in memory. The result does not
// depend on the threads. Throws UserError as ReadPhoto does.
std::vector<LabelImage> GrowMarks(const std::vector<MarkedPhoto>& photos);

// Longest side of the masks, in pixels.
inline constexpr int kGrownSide = 640;

}  // namespace semfoam
