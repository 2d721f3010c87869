// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/edit/object_insertion.h"
#include "tools/cli/option_manager.h"
#include "tools/options/object_choice.h"

#include <string>

#include <Eigen/Core>

namespace semfoam {

// How a user says where an object goes. Without any of it: where it was, in the COLMAP frame.
struct PlacementOptions {
  std::string translation = "0,0,0";  // x,y,z in units of the scene's COLMAP frame
  std::string rotation = "0,0,0";     // degrees about the x, then the y, then the z axis of that
                                      // frame, through the object's middle
  double scale = 1;                   // 1e-6..1e6, about the object's middle
  std::string align_to;               // "IMAGE,x,y"
};

void AddPlacementOptions(OptionManager* options, PlacementOptions* placement);

// The same as numbers. Throws UserError, in the words of the option manager, when one is out of
// range. To be called before any work.
struct ParsedPlacement {
  Eigen::Vector3d translation;
  Eigen::Matrix3d rotation;
  double scale = 1;
};
ParsedPlacement ParsePlacement(const PlacementOptions& options);

// The middle of the box of an object's sites stays in place under rotation and scale, and
// `translation` moves it.
ObjectPlacement PlaceAboutMiddle(const ExtractedObjects& objects, const ParsedPlacement& parsed);

// Stands the object on a surface: first turned by `rotation`; then what was up before that, by the
// mean of the upward directions of its photos, is turned onto the surface's normal by the shortest
// way; its lowest cells on the surface, its middle above the point; then moved by `translation`.
// Throws UserError naming `object_path` when the photos do not tell what is up.
ObjectPlacement PlaceOnSurface(const ExtractedObjects& objects,
                               const ParsedPlacement& parsed,
                               const SeenSurface& surface,
                               const std::filesystem::path& object_path);

}  // namespace semfoam
