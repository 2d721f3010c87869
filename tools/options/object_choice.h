// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/label_choice.h"
#include "foam/device/device.h"
#include "foam/model/model.h"
#include "foam/util/ids.h"
#include "foam/view/view_renderer.h"
#include "tools/cli/option_manager.h"
#include "tools/controllers/chosen_objects.h"

#include <filesystem>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// Selects the objects that a command works on, by label or by a pixel of a photo.

// A pixel of a photo, column x and row y from the upper left corner, at the size that the photo has
// in the model (PhotoRecord).
struct PhotoPixel {
  std::string image;
  int x = 0;
  int y = 0;
};

// Parses "IMAGE,x,y", separated by commas or spaces. Throws UserError naming `option`.
PhotoPixel ParsePhotoPixel(const std::string& option, const std::string& text);

// A closed outline in a photo, at the size that the photo has in the model: corners, of which the
// last is joined to the first. The middle of the upper left pixel is (0.5, 0.5).
struct PhotoOutline {
  std::string image;
  std::vector<Eigen::Vector2d> corners;

  // Whether a point is inside, by the even-odd rule.
  bool Contains(const Eigen::Vector2d& point) const;
};

// Parses "IMAGE,x,y,x,y,x,y ...", separated by commas or spaces: three corners or more. Throws
// UserError naming `option`.
PhotoOutline ParsePhotoOutline(const std::string& option, const std::string& text);

// Returns the photo of an outline. Throws UserError where the model has none of this name.
const PhotoRecord& FindPhoto(const Model& model,
                             const PhotoOutline& outline,
                             const std::filesystem::path& foam_path);

// The surface of a foam at a pixel, where the transmittance of its ray is 1/2.
struct SeenSurface {
  // Label of the rendered identity; kNoObject: unlabelled.
  LabelId label_id = kNoObject;
  // COLMAP frame.
  Eigen::Vector3d point;
  // Normal of the plane that fits the pixels around it, unit length, towards the camera.
  Eigen::Vector3d normal;
};

// Returns the surface at a pixel. The normal is that of a plane fitted to the pixels of the same
// label within a thirtieth of the photo's width, without the third of them that fits worst. Throws
// UserError when the model has no such photo or pixel, or the pixel shows no surface.
SeenSurface SurfaceAt(const Model& model,
                      const ViewRenderer& renderer,
                      const PhotoPixel& pixel,
                      const std::filesystem::path& foam_path);

// The options --labels and --exclude_labels, or --pick.
struct ObjectSelection {
  LabelChoice choice;
  std::string pick;
};
void AddSelectionOptions(OptionManager* options, ObjectSelection* selection);
// Throws UserError where the options contradict each other. Must be called before any work.
void RequireValid(const ObjectSelection& selection);

// Finds the selected objects (chosen_objects.h); if `selection.pick` is given, the object at that
// pixel, rendered on `device`. Throws UserError also where the pixel shows no object.
ChosenObjects ChooseObjects(const Model& model,
                            const ObjectSelection& selection,
                            const std::filesystem::path& foam_path,
                            const Device& device);

// Returns output_path/scene.foam. Throws UserError when that is one of the inputs, or a trained
// foam, which edits never replace.
std::filesystem::path EditedFoamPath(const std::filesystem::path& output_path,
                                     const std::vector<std::filesystem::path>& inputs);

}  // namespace semfoam
