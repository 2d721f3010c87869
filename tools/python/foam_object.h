// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/exportable_scene.h"
#include "foam/model/model.h"
#include "foam/view/view_renderer.h"

#include <filesystem>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <pybind11/pybind11.h>

namespace semfoam::python {

// What numpy arrays of a foam's cells refer to, in the COLMAP frame, [N] each but for the list of
// neighbours.
struct CellArrays {
  std::vector<Eigen::Vector3d> positions;
  std::vector<float> density;
  std::vector<double> volume;
  std::vector<int32_t> label;
  std::vector<int32_t> object;
};

// A foam as Python holds it: an immutable model, and what is computed from it when it is first
// asked for. Thread-safe, without the GIL, too.
class FoamObject {
 public:
  // `path` is the file of the model; empty where it was made by an edit.
  FoamObject(Model model, std::filesystem::path path);

  static std::shared_ptr<FoamObject> Load(const std::string& path);

  const Model& model() const { return model_; }
  const std::filesystem::path& path() const { return path_; }
  // What error messages call the foam.
  std::filesystem::path Name() const;

  // Return what the exporters, the renderer and the arrays work on; the first call takes seconds.
  const ExportableScene& Scene() const;
  const ViewRenderer& Renderer() const;
  const CellArrays& Cells() const;

 private:
  const Model model_;
  const std::filesystem::path path_;
  mutable std::once_flag scene_is_made_;
  mutable std::once_flag renderer_is_made_;
  mutable std::once_flag cells_are_made_;
  mutable std::unique_ptr<const ExportableScene> scene_;
  mutable std::unique_ptr<const ViewRenderer> renderer_;
  mutable std::unique_ptr<const CellArrays> cells_;
};

// Adds Foam, Cells, Object, Mesh, Photo, Camera, Rendering and load.
void AddFoam(pybind11::module_* module);

}  // namespace semfoam::python
