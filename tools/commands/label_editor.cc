// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/scene/label_choice.h"
#include "export/scene/names.h"
#include "export/scene/object_selection.h"
#include "foam/edit/class_table.h"
#include "foam/edit/label_editing.h"
#include "foam/model/model.h"
#include "foam/util/error.h"
#include "foam/util/json_file.h"
#include "foam/util/photo_name.h"
#include "plugin/colmap/camera_models.h"
#include "plugin/colmap/camera_rays.h"
#include "tools/cli/option_manager.h"
#include "tools/commands/commands.h"
#include "tools/controllers/effects_report.h"
#include "tools/controllers/export_record.h"
#include "tools/controllers/label_names.h"
#include "tools/options/object_choice.h"
#include "tools/support/output_lock.h"
#include "tools/support/value_text.h"

#include <algorithm>
#include <filesystem>
#include <limits>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <glog/logging.h>
#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

using Json = nlohmann::json;

// Objects that a smaller share of the pixels in an outline shows are not meant by it.
constexpr double kLeastShareOfOutline = 0.05;

// Pieces of an object with a smaller share of its cells keep its label when it is split.
constexpr double kLeastShareOfPiece = 0.01;
constexpr const char* kRightEdits =
    R"({"edits": [{"rename": "7", "to": "mug"}, {"merge": "a,b"}, {"split": "chairs"}, {"drop": "x"}, )"
    R"({"assign": "mug", "pick": "a.jpg,12,34"}, {"assign": "mug", "box": "0,0,0,1,1,1"}, )"
    R"({"assign": "lid", "outline": "a.jpg,9,9,30,9,20,25"}]})";

enum class EditKind { kRename, kMerge, kSplit, kDrop, kAssign };

struct LabelEdit {
  EditKind kind = EditKind::kRename;
  // Names or ids, separated by commas; the name of the new label in kAssign.
  std::string labels;
  // New name, in kRename.
  std::string to;
  // "x,y,z,x,y,z", "IMAGE,x,y" or "IMAGE,x,y,x,y,x,y...", in kAssign; one of them.
  std::string box;
  std::string pick;
  std::string outline;
};

// A model that is edited.
class LabelEditor {
 public:
  LabelEditor(Model* model, fs::path foam_path, const Device& device)
      : model_(*model), foam_path_(std::move(foam_path)), device_(device) {}

  // Returns what was done, for the log. Throws UserError where a label or object is missing.
  std::string Apply(const LabelEdit& edit) {
    switch (edit.kind) {
      case EditKind::kRename:
        return Rename(edit);
      case EditKind::kMerge:
        return Merge(edit);
      case EditKind::kSplit:
        return Split(edit);
      case EditKind::kDrop:
        return Drop(edit);
      case EditKind::kAssign:
        return Assign(edit);
    }
    LOG(FATAL) << "no such edit";
    return "";
  }

 private:
  ClassIndex ClassOf(LabelId id) const {
    const auto found = std::find_if(model_.labels.begin(),
                                    model_.labels.end(),
                                    [id](const Label& label) { return label.id == id; });
    return ClassIndex{static_cast<int32_t>(found - model_.labels.begin())};
  }

  std::string TextOf(LabelId id) const {
    return OneLine(DisplayName(id, model_.labels[Value(ClassOf(id))].name)) + " (" +
           std::to_string(Value(id)) + ")";
  }

  // The ids of at least `least` labels, in the order in which they are named.
  std::vector<LabelId> Find(const std::string& labels, size_t least) const {
    std::vector<LabelId> ids;
    const std::vector<NamedLabel> names = NamedLabels(model_.labels);
    for (const LabelText& text : FindLabels(labels, names)) {
      if (text.ids.empty()) {
        const std::string meant = WhetherMeant(text.text, names);
        throw UserError(foam_path_.string(),
                        ": has no label '",
                        text.text,
                        "'",
                        meant == "." ? "; foam_analyzer lists those that it has." : meant);
      }
      ids.insert(ids.end(), text.ids.begin(), text.ids.end());
    }
    if (ids.size() < least) {
      throw UserError(foam_path_.string(),
                      ": '",
                      labels,
                      "' is one label, where two or more are to be merged.");
    }
    return ids;
  }

  std::string Rename(const LabelEdit& edit) {
    const std::vector<LabelId> ids = Find(edit.labels, 1);
    if (ids.size() > 1 || edit.to.empty() || !IsUtf8(edit.to)) {
      throw UserError(foam_path_.string(),
                      ": '",
                      edit.labels,
                      "' cannot be renamed to '",
                      OneLine(edit.to),
                      "'; one label and a name for it would be right.");
    }
    std::string before = TextOf(ids[0]);
    model_.labels[Value(ClassOf(ids[0]))].name = edit.to;
    return "Renamed " + before + " to " + TextOf(ids[0]);
  }

  std::string Merge(const LabelEdit& edit) {
    const std::vector<LabelId> ids = Find(edit.labels, 2);
    RequireCells(ids[0]);
    std::string merged;
    for (size_t i = 1; i < ids.size(); ++i) {
      if (ids[i] == ids[0]) continue;
      merged += (merged.empty() ? "" : ", ") + TextOf(ids[i]);
      MergeClass(ClassOf(ids[i]), ClassOf(ids[0]), &model_);
    }
    return "Merged " + merged + " into " + TextOf(ids[0]);
  }

  std::string Split(const LabelEdit& edit) {
    const std::vector<LabelId> ids = Find(edit.labels, 1);
    std::string text;
    for (const LabelId id : ids) {
      const ChosenObjects chosen = ChooseObjects(model_, IdChoice(id), foam_path_);
      const std::vector<uint32_t> cells = SolidCells(chosen, ClassOf(id));
      std::vector<std::vector<uint32_t>> pieces = ComponentsOf(cells, chosen.delaunay);
      const double least = kLeastShareOfPiece * static_cast<double>(cells.size());
      std::erase_if(
          pieces, [least](const auto& piece) { return static_cast<double>(piece.size()) < least; });
      const std::string name = DisplayName(id, model_.labels[Value(ClassOf(id))].name);
      for (size_t i = 1; i < pieces.size(); ++i) {
        Label label = WithFreeId(model_.labels, {});
        label.name = name + "_" + std::to_string(i + 1);
        label.features = model_.labels[Value(ClassOf(id))].features;
        label.source_id = MaskId{static_cast<uint32_t>(Value(label.id))};
        GiveCellsNewLabel(pieces[i], label, &model_);
      }
      text += (text.empty() ? "Split " : "; ") + TextOf(id) + " into " +
              std::to_string(std::max<size_t>(1, pieces.size())) +
              (pieces.size() > 1 ? " pieces" : " piece");
    }
    return text;
  }

  std::string Drop(const LabelEdit& edit) {
    std::string dropped;
    for (const LabelId id : Find(edit.labels, 1)) {
      dropped += (dropped.empty() ? "" : ", ") + TextOf(id);
      DropClass(ClassOf(id), &model_);
    }
    return "Dropped " + dropped;
  }

  std::string Assign(const LabelEdit& edit) {
    const std::vector<uint32_t> cells = !edit.box.empty()    ? CellsInBox(edit.box)
                                        : !edit.pick.empty() ? PickedCells(edit.pick)
                                                             : CellsInOutline(edit.outline);
    std::vector<NamedLabel> names = NamedLabels(model_.labels);
    // A new label may have the name of a class.
    for (NamedLabel& name : names) name.class_name.clear();
    const std::vector<LabelText> found = FindLabels(edit.labels, names);
    if (found.size() > 1 || found[0].ids.size() > 1 || found[0].text.empty()) {
      throw UserError(foam_path_.string(),
                      ": '",
                      edit.labels,
                      "' is not one label, to which cells could be assigned.");
    }
    LabelId id = kNoObject;
    if (found[0].ids.empty()) {
      Label label = WithFreeId(model_.labels, {});
      label.name = found[0].text;
      label.source_id = MaskId{static_cast<uint32_t>(Value(label.id))};
      id = label.id;
      GiveCellsNewLabel(cells, label, &model_);
    } else {
      id = found[0].ids[0];
      RequireCells(id);
      GiveCells(cells, ClassOf(id), &model_);
    }
    return "Assigned " + std::to_string(cells.size()) + " cells to " + TextOf(id);
  }

  void RequireCells(LabelId id) const {
    const std::vector<ClassIndex> classes = ClassesOfCells(model_.foam);
    if (std::find(classes.begin(), classes.end(), ClassOf(id)) != classes.end()) return;
    throw UserError(foam_path_.string(),
                    ": no cell has the label ",
                    TextOf(id),
                    ", so that no other cell can become like them; another name would be right.");
  }

  static LabelChoice IdChoice(LabelId id) { return {"id:" + std::to_string(Value(id))}; }

  // The solid cells of a class, those of pieces that exports leave out included.
  static std::vector<uint32_t> SolidCells(const ChosenObjects& chosen, ClassIndex class_index) {
    std::vector<uint32_t> cells;
    for (uint32_t i = 0; i < chosen.cell_labels.solid.size(); ++i) {
      const bool is_of_class = chosen.cell_labels.class_index[i] == class_index;
      if (is_of_class && chosen.cell_labels.solid[i] != 0) cells.push_back(i);
    }
    return cells;
  }

  // The piece of an object that a pixel shows.
  std::vector<uint32_t> PickedCells(const std::string& pick) const {
    ObjectSelection selection;
    selection.pick = pick;
    const ChosenObjects chosen = ChooseObjects(model_, selection, foam_path_, device_);
    const SeenSurface seen = SurfaceAt(
        model_, ViewRenderer(model_.foam, device_), ParsePhotoPixel("pick", pick), foam_path_);
    const Eigen::Vector3d point = model_.world_from_normalized.Invert(seen.point);
    std::vector<uint32_t> nearest;
    double least = std::numeric_limits<double>::infinity();
    for (std::vector<uint32_t>& piece :
         ComponentsOf(SolidCells(chosen, ClassOf(seen.label_id)), chosen.delaunay)) {
      double distance = std::numeric_limits<double>::infinity();
      for (const uint32_t cell : piece) {
        distance =
            std::min(distance, (model_.foam.positions[cell].cast<double>() - point).squaredNorm());
      }
      if (distance >= least) continue;
      least = distance;
      nearest = std::move(piece);
    }
    return nearest;
  }

  // The cells whose sites a photo's outline goes around, front and back, of the objects that it
  // shows there.
  std::vector<uint32_t> CellsInOutline(const std::string& text) const {
    const PhotoOutline outline = ParsePhotoOutline("outline", text);
    const PhotoRecord& photo = FindPhoto(model_, outline, foam_path_);
    const CameraRays all = MakeCameraRays(photo, model_.world_from_normalized, foam_path_);
    CameraRays inside{0, 1, all.origin, {}};
    for (int y = 0; y < photo.height; ++y) {
      for (int x = 0; x < photo.width; ++x) {
        if (!outline.Contains({x + 0.5, y + 0.5})) continue;
        inside.directions.push_back(all.directions[static_cast<size_t>(y) * photo.width + x]);
      }
    }
    inside.width = static_cast<int>(inside.directions.size());
    std::map<ClassIndex, int> pixels;
    if (inside.width > 0) {
      const RenderedView view = ViewRenderer(model_.foam, device_).Render(inside);
      for (size_t i = 0; i < view.distance.size(); ++i) {
        if (view.distance[i] > 0) ++pixels[view.class_index[i]];
      }
    }
    std::erase_if(pixels, [&](const auto& shown) {
      return LabelIdOf(model_.labels, shown.first) == kNoObject ||
             shown.second < kLeastShareOfOutline * inside.width;
    });
    const ChosenObjects chosen = ChooseObjects(model_, LabelChoice{}, foam_path_);
    const Camera camera = CameraOf(photo, foam_path_);
    const Pose pose = PoseOf(photo);
    std::vector<uint32_t> cells;
    for (uint32_t i = 0; i < chosen.is_in_object.size(); ++i) {
      if (chosen.is_in_object[i] == 0) continue;
      if (!pixels.contains(chosen.cell_labels.class_index[i])) continue;
      const Eigen::Vector3d position =
          model_.world_from_normalized.Apply(model_.foam.positions[i].cast<double>());
      const auto pixel = Project(camera, pose.UnitRotation() * position + pose.translation);
      if (pixel.has_value() && outline.Contains(*pixel)) cells.push_back(i);
    }
    if (cells.empty()) {
      throw UserError(foam_path_.string(),
                      ": the outline ",
                      text,
                      " goes around no object; one around a part of an object would be right.");
    }
    return cells;
  }

  // The cells of all objects whose sites are in a box of the COLMAP frame.
  std::vector<uint32_t> CellsInBox(const std::string& text) const {
    const std::vector<std::string> parts = SplitAtCommas(text);
    double numbers[6] = {};
    bool is_box = parts.size() == 6;
    for (size_t i = 0; is_box && i < 6; ++i) is_box = ParseValue(parts[i], &numbers[i]);
    Eigen::AlignedBox3d box;
    if (is_box) {
      box.extend(Eigen::Vector3d(numbers[0], numbers[1], numbers[2]));
      box.extend(Eigen::Vector3d(numbers[3], numbers[4], numbers[5]));
    } else {
      throw UserError("The box '",
                      text,
                      "' is invalid; two corners in the frame of the model, x,y,z,x,y,z, would be "
                      "right.");
    }
    const ChosenObjects all = ChooseObjects(model_, LabelChoice{}, foam_path_);
    std::vector<uint32_t> cells;
    for (uint32_t i = 0; i < all.is_in_object.size(); ++i) {
      const Eigen::Vector3d position =
          model_.world_from_normalized.Apply(model_.foam.positions[i].cast<double>());
      if (all.is_in_object[i] != 0 && box.contains(position)) cells.push_back(i);
    }
    if (cells.empty()) {
      throw UserError(foam_path_.string(),
                      ": has no cell of an object in the box ",
                      text,
                      "; foam_analyzer tells where its objects are.");
    }
    return cells;
  }

  Model& model_;
  const fs::path foam_path_;
  const Device& device_;
};

int CountPlaces(const std::string& box, const std::string& pick, const std::string& outline) {
  return int{!box.empty()} + int{!pick.empty()} + int{!outline.empty()};
}

std::string TextMember(const fs::path& file, const Json& edit, const char* key) {
  if (!edit.contains(key)) return "";
  if (edit[key].is_string() && !edit[key].get<std::string>().empty()) {
    return edit[key].get<std::string>();
  }
  throw UserError(
      file.string(), ": \"", key, "\" of an edit is no text; ", kRightEdits, " would be right.");
}

std::vector<LabelEdit> ReadEdits(const fs::path& file) {
  const Json json = ReadJsonFile(file);
  if (!json.is_object() || !json.contains("edits") || !json["edits"].is_array()) {
    throw UserError(file.string(), ": has no list \"edits\"; ", kRightEdits, " would be right.");
  }
  constexpr std::pair<const char*, EditKind> kKinds[] = {{"rename", EditKind::kRename},
                                                         {"merge", EditKind::kMerge},
                                                         {"split", EditKind::kSplit},
                                                         {"drop", EditKind::kDrop},
                                                         {"assign", EditKind::kAssign}};
  std::vector<LabelEdit> edits;
  for (const Json& value : json["edits"]) {
    int num_kinds = 0;
    LabelEdit edit;
    for (const auto& [key, kind] : kKinds) {
      if (!value.is_object() || !value.contains(key)) continue;
      ++num_kinds;
      edit.kind = kind;
      edit.labels = TextMember(file, value, key);
    }
    if (num_kinds == 1) {
      edit.to = TextMember(file, value, "to");
      edit.box = TextMember(file, value, "box");
      edit.pick = TextMember(file, value, "pick");
      edit.outline = TextMember(file, value, "outline");
    }
    const bool is_complete =
        (edit.kind != EditKind::kRename || !edit.to.empty()) &&
        (edit.kind != EditKind::kAssign || CountPlaces(edit.box, edit.pick, edit.outline) == 1);
    if (num_kinds != 1 || !is_complete) {
      throw UserError(
          file.string(), ": edit ", edits.size() + 1, " is not one of those in ", kRightEdits, ".");
    }
    edits.push_back(edit);
  }
  return edits;
}

// Options of the command line, one edit each.
struct EditOptions {
  std::string edits_path;
  std::string rename;
  std::string merge;
  std::string split;
  std::string drop;
  std::string assign;
  std::string box;
  std::string pick;
  std::string outline;
};

std::vector<LabelEdit> EditsOf(const EditOptions& options) {
  std::vector<LabelEdit> edits;
  if (!options.edits_path.empty()) edits = ReadEdits(options.edits_path);
  if (!options.rename.empty()) {
    const size_t equals = options.rename.find('=');
    if (equals == std::string::npos || equals + 1 == options.rename.size()) {
      throw UserError(
          "Failed to parse options - the argument ('",
          options.rename,
          "') for option '--rename' is invalid; OLD=NEW, such as 7=mug, would be right.");
    }
    edits.push_back({EditKind::kRename,
                     options.rename.substr(0, equals),
                     options.rename.substr(equals + 1),
                     "",
                     "",
                     ""});
  }
  if (!options.merge.empty()) edits.push_back({EditKind::kMerge, options.merge, "", "", "", ""});
  if (!options.split.empty()) edits.push_back({EditKind::kSplit, options.split, "", "", "", ""});
  if (!options.drop.empty()) edits.push_back({EditKind::kDrop, options.drop, "", "", "", ""});
  if (!options.assign.empty()) {
    if (CountPlaces(options.box, options.pick, options.outline) != 1) {
      throw UserError(
          "Failed to parse options - --assign takes the cells of --box, of --pick or of --outline; "
          "give one of them.");
    }
    edits.push_back(
        {EditKind::kAssign, options.assign, "", options.box, options.pick, options.outline});
  }
  if (edits.empty()) {
    throw UserError(
        "Failed to parse options - there is nothing to do; give --edits_path, --rename, --merge, "
        "--split, --drop or --assign.");
  }
  return edits;
}

}  // namespace

void RunLabelEditor(int argc, char** argv) {
  std::string foam_path;
  std::string output_path;
  EditOptions edit_options;
  OptionManager options(
      "label_editor",
      "Edits the labels of a trained foam without training again: what objects are called, and "
      "which cells belong to them. Writes another foam; shapes and colours stay.");
  options.AddDeviceOption();
  options.AddRequiredOption("foam_path", &foam_path, "the model, scene.foam");
  options.AddRequiredOption("output_path", &output_path, "folder for the edited scene.foam");
  options.AddDefaultOption("edits_path",
                           &edit_options.edits_path,
                           "a JSON file with edits, done one after another, before those below");
  options.AddDefaultOption("rename", &edit_options.rename, "OLD=NEW: a label's name");
  options.AddDefaultOption(
      "merge", &edit_options.merge, "labels, separated by commas, that become the first of them");
  options.AddDefaultOption(
      "split", &edit_options.split, "labels whose connected components become labels of their own");
  options.AddDefaultOption("drop", &edit_options.drop, "labels whose cells become unlabelled");
  options.AddDefaultOption(
      "assign",
      &edit_options.assign,
      "the label, there already or new, of the cells that --box, --pick or --outline chooses");
  options.AddDefaultOption(
      "box",
      &edit_options.box,
      "x,y,z,x,y,z: two corners of a box in the frame of the COLMAP model; the "
      "cells of all objects in it");
  options.AddDefaultOption(
      "pick", &edit_options.pick, "IMAGE,x,y: the piece of the object that this pixel shows");
  options.AddDefaultOption("outline",
                           &edit_options.outline,
                           "IMAGE,x,y,x,y,x,y ...: corners of an outline in a photo; the cells in "
                           "it, front and back, of the objects that it shows");
  if (!options.Parse(argc, argv)) return;
  if (edit_options.assign.empty()) {
    options.RequireEffect({"box", "pick", "outline"}, "without --assign; give both, or neither");
  }
  const std::vector<LabelEdit> edits = EditsOf(edit_options);

  const OutputLock lock(output_path);
  Model model = ReadNamedModel(foam_path);
  const fs::path target = EditedFoamPath(output_path, {foam_path});
  if (!model.foam.HasSemantics()) {
    throw UserError(foam_path,
                    ": has no labels to edit; a foam trained with masks would be right.");
  }
  LabelEditor editor(&model, foam_path, options.device());
  std::vector<std::string> done;
  for (const LabelEdit& edit : edits) done.push_back(editor.Apply(edit));
  WriteModel(target, model);
  CopyLight(model, foam_path, target);
  WarnOfOtherExports(output_path);
  for (const std::string& line : done) LOG(INFO) << line;
  LOG(INFO) << "The edited foam is " << target.string();
}

}  // namespace semfoam
