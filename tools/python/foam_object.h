// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/exportable_scene.h"
#include "foam/model/model.h"
#include "foam/view/view_renderer.h"

#include <cstdint>
#include <filesystem>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace semfoam::python {

// What numpy arrays of a foam's cells refer to besides the arrays of ExportableScene, in the COLMAP
// frame, [N] each.
struct CellArrays {
  std::vector<Eigen::Vector3d> positions;
  std::vector<float> density;
  std::vector<double> volume;
  std::vector<int32_t> label;
  std::vector<int32_t> object;
};

// A foam as Python holds it: an immutable model, and what is computed from it when it is first
// asked for. Thread-safe; calls no Python.
class FoamObject {
 public:
  // `path` is the file of the model; empty where it was made by an edit.
  FoamObject(Model model, std::filesystem::path path);

  // Throws UserError where the file cannot be read.
  static std::shared_ptr<FoamObject> Load(const std::filesystem::path& path);

  const Model& model() const { return model_; }
  // What error messages call the foam.
  std::filesystem::path Name() const;

  // Returns the checksum of its file (ModelChecksum), which exports name in labels.json; of a foam
  // without a file, that of the file that saving it would make.
  const std::string& Checksum() const;

  // Return what the exporters, the renderer and the arrays work on. The first call takes seconds,
  // so the caller must not hold the GIL.
  const ExportableScene& Scene() const;
  const ViewRenderer& Renderer() const;
  const CellArrays& Cells() const;

 private:
  const Model model_;
  const std::filesystem::path path_;
  mutable std::once_flag checksum_is_made_;
  mutable std::once_flag scene_is_made_;
  mutable std::once_flag renderer_is_made_;
  mutable std::once_flag cells_are_made_;
  mutable std::string checksum_;
  mutable std::unique_ptr<const ExportableScene> scene_;
  mutable std::unique_ptr<const ViewRenderer> renderer_;
  mutable std::unique_ptr<const CellArrays> cells_;
};

}  // namespace semfoam::python
