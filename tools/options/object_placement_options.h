// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/edit/object_insertion.h"
#include "tools/cli/option_manager.h"
#include "tools/options/object_choice.h"

#include <string>

#include <Eigen/Core>

namespace semfoam {

// Options of the placement of an object. By default it keeps its position in the COLMAP frame.
struct PlacementOptions {
  // x,y,z in units of the scene's COLMAP frame.
  std::string translation = "0,0,0";
  // Degrees about the x, then the y, then the z axis of that frame, through the object's middle.
  std::string rotation = "0,0,0";
  // 1e-6..1e6, about the object's middle.
  double scale = 1;
  // Pixel "IMAGE,x,y" of the surface to place the object on; empty: none.
  std::string align_to;
};

void AddPlacementOptions(OptionManager* options, PlacementOptions* placement);

// PlacementOptions as numbers.
struct ParsedPlacement {
  Eigen::Vector3d translation;
  Eigen::Matrix3d rotation;
  double scale = 1;
};

// Parses the options. Throws UserError, naming the option, when one is out of range. Must be called
// before any work.
ParsedPlacement ParsePlacement(const PlacementOptions& options);

// Returns the placement that rotates and scales an object about the middle of the box of its sites,
// and moves it by `translation`.
ObjectPlacement PlaceAboutMiddle(const ExtractedObjects& objects, const ParsedPlacement& parsed);

// Returns the placement of an object on a surface. Rotates it by `rotation`; then rotates the
// original upward direction, the mean of the upward directions of its photos, onto the surface's
// normal by the smallest angle; puts its lowest cells on the surface and its middle above the
// point; then moves it by `translation`. Throws UserError naming `object_path` when the photos do
// not determine an upward direction.
ObjectPlacement PlaceOnSurface(const ExtractedObjects& objects,
                               const ParsedPlacement& parsed,
                               const SeenSurface& surface,
                               const std::filesystem::path& object_path);

}  // namespace semfoam
