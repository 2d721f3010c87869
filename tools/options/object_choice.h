// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/exportable_scene.h"
#include "export/scene/label_choice.h"
#include "foam/device/device.h"
#include "foam/edit/object_editing.h"
#include "foam/model/model.h"
#include "foam/util/ids.h"
#include "foam/view/view_renderer.h"
#include "tools/cli/option_manager.h"

#include <filesystem>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// Which objects a command is to work on, and which pixel a user points at.

// A pixel of a photo, column x and row y from the upper left corner, at the size that the photo has
// in the model (PhotoRecord).
struct PhotoPixel {
  std::string image;
  int x = 0;
  int y = 0;
};

// "IMAGE,x,y"; blanks do as well as commas. Throws UserError in the option manager's words.
PhotoPixel ParsePhotoPixel(const std::string& option, const std::string& text);

// What a foam shows at a pixel: where its ray has lost half of its light.
struct SeenSurface {
  LabelId label_id = kNoObject;  // of the rendered identity
  Eigen::Vector3d point;         // COLMAP frame
  Eigen::Vector3d normal;  // of the plane that fits the pixels around it, unit length, towards the
                           // camera
};

// Throws UserError when the model has no such photo or pixel, or nothing is there. The normal is
// that of the pixels of the same label within a thirtieth of the photo's width; a third of them,
// those that fit the plane least, are left out of it.
SeenSurface SurfaceAt(const Model& model,
                      const ViewRenderer& renderer,
                      const PhotoPixel& pixel,
                      const std::filesystem::path& foam_path);

// --labels and --exclude_labels, or --pick.
struct ObjectSelection {
  LabelChoice choice;
  std::string pick;
};
void AddSelectionOptions(OptionManager* options, ObjectSelection* selection);
// Throws UserError, to be called before any work.
void RequireValid(const ObjectSelection& selection);

// Objects of a model, as the exporters find them.
struct ChosenObjects {
  Delaunay delaunay;  // of the model, and what its cells are
  CellLabels cell_labels;
  std::vector<uint8_t> is_in_object;  // [sites] of any object, chosen or not
  std::vector<ObjectCells> objects;
  std::vector<std::string> names;  // "mug (6)", one per object
  size_t num_cells = 0;            // of all of them
};

// As exports have them, but with fragments: who names one means it.
ExportableSceneOptions EveryObject();

// The objects that `choice` names (SelectObjects). Throws UserError when one is not there, or the
// model has no objects at all.
ChosenObjects ChooseObjects(const Model& model,
                            const LabelChoice& choice,
                            const std::filesystem::path& foam_path);

// As above; the one object that is seen, rendered on `device`, at the pixel where `selection.pick`
// is given. Throws UserError also where no object is seen there.
ChosenObjects ChooseObjects(const Model& model,
                            const ObjectSelection& selection,
                            const std::filesystem::path& foam_path,
                            const Device& device);

// output_path/scene.foam. Throws UserError when that is one of the files that are read, or a
// trained foam, which no edit replaces.
std::filesystem::path EditedFoamPath(const std::filesystem::path& output_path,
                                     const std::vector<std::filesystem::path>& inputs);

}  // namespace semfoam
