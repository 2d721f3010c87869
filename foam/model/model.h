// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/geometry/similarity.h"
#include "foam/model/foam.h"

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace semfoam {

// One class of the classifier. Its index in Model::labels is the class index k.
struct Label {
  int32_t id =
      0;  // what renders and exports write; 1..65535, or 0 for the class of unlabelled pixels
  uint32_t source_id =
      0;             // what the masks said; equals `id` unless one of the set's ids is above 65535
  std::string name;  // from labels.json; empty = none
};

// A photo of the training set: enough to cast its rays again. Poses are COLMAP's: x_cam = rotation
// * x_world + translation.
struct PhotoRecord {
  std::string name;  // relative to the image folder, as in the COLMAP model
  std::string camera_model;
  int width = 0;
  int height = 0;
  std::vector<double> camera_params;
  Eigen::Quaterniond cam_from_world_rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d cam_from_world_translation = Eigen::Vector3d::Zero();
  bool held_out = false;
};

// Everything that scene.foam holds.
struct Model {
  Foam foam;
  CellStatistics statistics;
  Similarity world_from_normalized;
  std::vector<Label> labels;
  std::vector<PhotoRecord> photos;
  std::map<std::string, std::string>
      options;  // the training's options by name; no path, thread count, time or date
};

// The file is little-endian: 8 bytes magic "SEMFOAM\n", u32 version, u32 reserved (0), u64 length
// of the JSON header, the header, then the arrays it lists (name -> type, shape, offset from the
// end of the header), each starting at a multiple of 64 bytes, and an XXH64 of all before it. Same
// model, same bytes. Throws UserError when the file cannot be written.
void WriteModel(const std::filesystem::path& path, const Model& model);

// Throws UserError with one sentence when the file is missing, is no foam, is of a newer version,
// is cut or is damaged. Every size in the file is checked against the bytes that are there before
// it is used.
Model ReadModel(const std::filesystem::path& path);

}  // namespace semfoam
