// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/colmap/colmap_model.h"
#include "plugin/dataset/scene_checksums.h"
#include "plugin/dataset/scene_options.h"

#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "tests/plugin/test_util.h"

namespace semfoam {

// The checksums of a scene all of whose files are read.
inline SceneChecksums AllChecksumsOf(const ScenePlan& plan) {
  return ChecksumsOf(plan, ChecksumsOfFiles(plan));
}

// A workspace of three 8 x 6 photos by two cameras, whose pixels tell their place, with masks.
class SmallWorkspace {
 public:
  SmallWorkspace() {
    Camera pinhole;
    pinhole.id = 1;
    pinhole.model_id = 1;
    pinhole.width = 8;
    pinhole.height = 6;
    pinhole.params = {10, 11, 4, 3};
    Camera distorted = pinhole;
    distorted.id = 2;
    distorted.model_id = 4;
    distorted.params = {10, 11, 4, 3, -0.1, 0.01, 1e-3, 1e-3};
    model.cameras = {distorted, pinhole};
    // Not in the order of their names.
    for (const auto& [id, name] :
         {std::pair(9u, "sub/c.png"), std::pair(4u, "a.png"), std::pair(6u, "b.png")}) {
      Image image;
      image.id = id;
      image.name = name;
      image.camera_id = id == 4 ? 1 : 2;
      image.cam_from_world.rotation =
          Eigen::Quaterniond(Eigen::AngleAxisd(0.1 * id, Eigen::Vector3d(1, 2, 3).normalized()));
      image.cam_from_world.translation = {0.1 * id, 0.2, 3};
      model.images.push_back(image);
      WritePhoto(name, 8, 6);
      WriteMask(name, 8, 6);
    }
    for (uint64_t id : {5u, 3u, 8u}) {
      Point3D point;
      point.id = id;
      point.position = {0.1 * static_cast<double>(id), 0.3, -0.2};
      point.color = {static_cast<uint8_t>(id), 128, 255};
      point.track = {{4, 0}, {6, 0}};
      model.points.push_back(point);
    }
    WriteModelFiles();
  }

  void WriteModelFiles() const {
    WriteReconstruction(temp / "sparse/0", model, ModelFormat::kBinary);
  }

  void WritePhoto(const std::string& name, int width, int height) const {
    std::vector<uint8_t> samples;
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        samples.push_back(static_cast<uint8_t>(10 * x));
        samples.push_back(static_cast<uint8_t>(20 * y));
        samples.push_back(static_cast<uint8_t>(name[0] == 's' ? name[4] : name[0]));
      }
    }
    WritePng(temp / "images" / name, width, height, 8, PNG_COLOR_TYPE_RGB, samples);
  }

  // Id 0 in the left column, then 10 + the row.
  void WriteMask(const std::string& name, int width, int height) const {
    std::vector<uint8_t> samples;
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        samples.push_back(x == 0 ? 0 : static_cast<uint8_t>(10 + y));
      }
    }
    WritePng(temp / "object_mask" / name, width, height, 8, PNG_COLOR_TYPE_GRAY, samples);
  }

  SceneOptions Options() const {
    SceneOptions options;
    options.image_path = temp / "images/";
    options.input_path = temp.path();
    options.label_zero = LabelZero::kIgnore;
    return options;
  }

  TempFolder temp;
  Reconstruction model;
};

}  // namespace semfoam
