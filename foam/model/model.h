// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/geometry/similarity.h"
#include "foam/model/foam.h"
#include "foam/util/ids.h"

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace semfoam {

// What detectors and encoders said about the regions of an object in the masks, averaged over these
// (plugin/dataset/label_features.h).
struct LabelFeatures {
  // "chair"; empty: none.
  std::string class_name;
  // Mean score of that class, or of the regions where none has a class; >= 0; nothing: none.
  std::optional<double> score = std::nullopt;
  // Unit length; empty: none. All that are not empty in a model have the same length.
  std::vector<float> embedding = {};

  bool operator==(const LabelFeatures&) const = default;
};

// One class of the classifier. Its position in Model::labels is the ClassIndex.
struct Label {
  // The value in renders and exports: 1 to 65535, or 0 for the class of unlabelled pixels.
  LabelId id = kNoObject;
  // The value in the masks; equals `id` unless one of the set's ids is above 65535.
  MaskId source_id{0};
  // From labels.json; empty: none.
  std::string name;
  LabelFeatures features = {};
};

// Returns the id of a class of `labels`; kNoObject of kUnlabelled.
inline LabelId LabelIdOf(const std::vector<Label>& labels, ClassIndex c) {
  return c == kUnlabelled ? kNoObject : labels.at(Value(c)).id;
}

// A photo of the training set: enough to cast its rays again. The pose is COLMAP's: x_cam =
// rotation * x_world + translation, in the user's frame.
struct PhotoRecord {
  // Relative to the image folder, as in the COLMAP model.
  std::string name;
  std::string camera_model;
  int width = 0;
  int height = 0;
  std::vector<double> camera_params;
  Eigen::Quaterniond cam_from_world_rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d cam_from_world_translation = Eigen::Vector3d::Zero();
  // Whether the photo was kept from training, for evaluation.
  bool held_out = false;
};

// The content of scene.foam.
struct Model {
  Foam foam;
  CellStatistics statistics;
  Similarity world_from_normalized;
  std::vector<Label> labels;
  std::vector<PhotoRecord> photos;
  // The training's options by name, without paths, number of threads, time and date.
  std::map<std::string, std::string> options;
};

// Writes a model as a checksummed file (foam/util/checksummed_file.h), little-endian: 8 bytes magic
// "SEMFOAM\n", u32 version, u32 reserved (0), u64 length of the JSON header, the header, then the
// arrays it lists (name -> type, shape, offset from the end of the header), each starting at a
// multiple of 64 bytes, and an XXH64 of all before it. Same model, same bytes. Copies no array.
// Throws UserError when the file cannot be written.
void WriteModel(const std::filesystem::path& path, const Model& model);

// Reads a model and verifies it: every size in the file is checked against the bytes that are there
// before it is used. Takes as much memory as the file has bytes, and the model's. Throws UserError
// with one sentence when the file is missing, is no foam, is of another version, is cut or is
// damaged.
Model ReadModel(const std::filesystem::path& path);

}  // namespace semfoam
