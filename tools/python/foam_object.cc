// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/python/foam_object.h"

#include "foam/util/scratch_folder.h"
#include "tools/controllers/export_objects.h"
#include "tools/controllers/export_record.h"
#include "tools/controllers/label_names.h"

#include <utility>

namespace semfoam::python {

FoamObject::FoamObject(Model model, std::filesystem::path path)
    : model_(std::move(model)), path_(std::move(path)) {
  // Now, while the file holds this foam.
  if (!path_.empty()) {
    std::call_once(checksum_is_made_, [this] { checksum_ = ModelChecksum(path_); });
  }
}

std::shared_ptr<FoamObject> FoamObject::Load(const std::filesystem::path& path) {
  return std::make_shared<FoamObject>(ReadNamedModel(path), path);
}

std::filesystem::path FoamObject::Name() const { return path_.empty() ? "the foam" : path_; }

const std::string& FoamObject::Checksum() const {
  std::call_once(checksum_is_made_, [this] {
    const ScratchFolder folder(std::filesystem::temp_directory_path());
    const std::filesystem::path file = folder.path() / "scene.foam";
    WriteModel(file, model_);
    checksum_ = ModelChecksum(file);
  });
  return checksum_;
}

const ExportableScene& FoamObject::Scene() const {
  std::call_once(scene_is_made_, [this] {
    scene_ = std::make_unique<const ExportableScene>(PrepareExport(model_, Name()));
  });
  return *scene_;
}

const ViewRenderer& FoamObject::Renderer() const {
  std::call_once(renderer_is_made_,
                 [this] { renderer_ = std::make_unique<const ViewRenderer>(model_.foam); });
  return *renderer_;
}

const CellArrays& FoamObject::Cells() const {
  std::call_once(cells_are_made_, [this] {
    const ExportableScene& scene = Scene();
    const Similarity& frame = model_.world_from_normalized;
    auto cells = std::make_unique<CellArrays>();
    for (uint32_t i = 0; i < scene.NumSites(); ++i) {
      cells->positions.push_back(frame.Apply(model_.foam.positions[i].cast<double>()));
      cells->density.push_back(static_cast<float>(scene.density[i] / frame.scale));
      cells->volume.push_back(scene.volume[i] * frame.scale * frame.scale * frame.scale);
      cells->label.push_back(Value(scene.label_id[i]));
      cells->object.push_back(Value(scene.ObjectId(i)));
    }
    cells_ = std::move(cells);
  });
  return *cells_;
}

}  // namespace semfoam::python
