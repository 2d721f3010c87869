// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/scene/exportable_scene.h"

#include "export/scene/cell_colors.h"
#include "export/scene/names.h"
#include "export/scene/object_components.h"
#include "export/scene/object_description.h"
#include "export/scene/scene_cells.h"
#include "export/scene/unseen_space.h"
#include "foam/util/parallel.h"

#include <algorithm>
#include <numeric>

#include <glog/logging.h>

namespace semfoam {
namespace {

// The connected components of the matter of a class in which at least one cell is photographed.
// `object_of_cell` gets `object_index` for each of their cells.
std::vector<std::vector<uint32_t>> PhotographedComponents(
    const ExportableScene& scene,
    const std::vector<uint32_t>& matter_of_class,
    ClassIndex class_index,
    int32_t object_index,
    std::vector<int32_t>* object_of_cell) {
  std::vector<std::vector<uint32_t>> components;
  for (const uint32_t start : matter_of_class) {
    if (!scene.photographed[start] || (*object_of_cell)[start] == object_index) continue;
    std::vector<uint32_t>& component = components.emplace_back(1, start);
    (*object_of_cell)[start] = object_index;
    for (size_t k = 0; k < component.size(); ++k) {
      for (const uint32_t next : scene.delaunay.Neighbors(component[k])) {
        if (next >= scene.NumSites() || !scene.is_matter[next] ||
            scene.labels.class_index[next] != class_index ||
            (*object_of_cell)[next] == object_index) {
          continue;
        }
        (*object_of_cell)[next] = object_index;
        component.push_back(next);
      }
    }
  }
  return components;
}

// Moves the cells of the large components into the object and takes those of the crumbs out of
// `object_of_cell`.
void GatherComponents(const ExportableScene& scene,
                      const std::vector<std::vector<uint32_t>>& components,
                      float min_component_share,
                      ObjectInfo* object,
                      std::vector<int32_t>* object_of_cell) {
  size_t largest = 0;
  for (const std::vector<uint32_t>& component : components) {
    largest = std::max(largest, component.size());
  }
  for (const std::vector<uint32_t>& component : components) {
    if (static_cast<float>(component.size()) >= min_component_share * static_cast<float>(largest)) {
      object->cells.insert(object->cells.end(), component.begin(), component.end());
      continue;
    }
    LeaveOut(scene, component, &object->left_out);
    for (const uint32_t cell : component) (*object_of_cell)[cell] = -1;
  }
}

// Finds the hidden pockets that objects enclose. Cells get a mark while one object is looked at, so
// that no cell is visited twice for it and nothing is cleared in between.
class CavityFinder {
 public:
  CavityFinder(const ExportableScene& scene, const std::vector<uint8_t>& has_camera)
      : scene_(scene), has_camera_(has_camera), mark_(scene.delaunay.num_cells, 0) {}

  // Returns the cells of all hidden pockets of the object, which owns `cells` so far.
  std::vector<uint32_t> Find(const std::vector<uint32_t>& cells, int32_t object_index) {
    const uint32_t pending = 2 * static_cast<uint32_t>(object_index) + 1;
    const uint32_t open = pending + 1;
    std::vector<uint32_t> cavities;
    std::vector<uint32_t> pocket;
    for (const uint32_t cell : cells) {
      for (const uint32_t start : scene_.delaunay.Neighbors(cell)) {
        if (Owned(start, object_index) || mark_[start] >= pending) continue;
        pocket.assign(1, start);
        mark_[start] = pending;
        bool is_open = false;
        for (size_t k = 0; k < pocket.size() && !is_open; ++k) {
          is_open = InTheOpen(pocket[k]);
          if (is_open) break;
          for (const uint32_t next : scene_.delaunay.Neighbors(pocket[k])) {
            if (Owned(next, object_index)) continue;
            if (mark_[next] == open) is_open = true;
            if (mark_[next] >= pending) continue;
            mark_[next] = pending;
            pocket.push_back(next);
          }
        }
        if (is_open) {
          for (const uint32_t visited : pocket) mark_[visited] = open;
        } else {
          cavities.insert(cavities.end(), pocket.begin(), pocket.end());
        }
      }
    }
    return cavities;
  }

 private:
  bool Owned(uint32_t cell, int32_t object_index) const {
    return cell < scene_.NumSites() && scene_.object_of_cell[cell] == object_index;
  }

  bool InTheOpen(uint32_t cell) const {
    return cell >= scene_.NumSites() || has_camera_[cell] || scene_.object_of_cell[cell] >= 0 ||
           (scene_.labels.solid[cell] && scene_.photographed[cell]);
  }

  const ExportableScene& scene_;
  const std::vector<uint8_t>& has_camera_;
  std::vector<uint32_t> mark_;
};

// Gives every object the unseen cells that are inside it (UnseenInside), small objects first: what
// is under a mug is the mug's and not the table's.
void AddUnseenInsides(const CellStatistics& statistics,
                      const std::vector<uint8_t>& has_camera,
                      ExportableScene* scene) {
  std::vector<size_t> order(scene->objects.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](size_t a, size_t b) {
    return scene->objects[a].cells.size() < scene->objects[b].cells.size();
  });
  std::vector<CellKnowledge> knowledge(scene->delaunay.num_cells, CellKnowledge::kOpen);
  for (uint32_t i = 0; i < scene->NumSites(); ++i) {
    if (has_camera[i] || scene->object_of_cell[i] >= 0) continue;
    // Where most of the light ends in what is no matter, nothing is certain.
    const bool is_empty = statistics.passed[i] > statistics.stopped[i];
    if (!scene->seen[i] || (!is_empty && !scene->labels.solid[i])) {
      knowledge[i] = CellKnowledge::kUnseen;
    }
  }
  for (const size_t index : order) {
    ObjectInfo& object = scene->objects[index];
    for (const uint32_t cell : object.cells) knowledge[cell] = CellKnowledge::kInside;
    const std::vector<uint32_t> unseen =
        UnseenInside(scene->delaunay, scene->face_areas, knowledge, object.cells);
    for (const uint32_t cell : unseen) scene->object_of_cell[cell] = static_cast<int32_t>(index);
    object.cells.insert(object.cells.end(), unseen.begin(), unseen.end());
    // To the next object all of this is another thing's.
    for (const uint32_t cell : object.cells) knowledge[cell] = CellKnowledge::kOpen;
  }
}

// Makes the objects, by ascending id, of their photographed components of matter.
void GatherObjects(const Model& model, float min_component_share, ExportableScene* scene) {
  std::vector<std::vector<uint32_t>> matter_of_class(model.foam.num_classes);
  for (uint32_t i = 0; i < scene->NumSites(); ++i) {
    const ClassIndex c = scene->labels.class_index[i];
    if (scene->is_matter[i] && c != kUnlabelled) matter_of_class[Value(c)].push_back(i);
  }
  std::vector<int32_t> classes(model.foam.num_classes);
  std::iota(classes.begin(), classes.end(), 0);
  std::sort(classes.begin(), classes.end(), [&](int32_t a, int32_t b) {
    return model.labels[a].id < model.labels[b].id;
  });
  for (const int32_t k : classes) {
    const Label& label = model.labels[k];
    if (label.id == kNoObject) continue;
    const int32_t index = static_cast<int32_t>(scene->objects.size());
    ObjectInfo object;
    GatherComponents(*scene,
                     PhotographedComponents(
                         *scene, matter_of_class[k], ClassIndex{k}, index, &scene->object_of_cell),
                     min_component_share,
                     &object,
                     &scene->object_of_cell);
    if (object.cells.empty()) {
      scene->labels_without_cells.push_back(label);
      continue;
    }
    object.id = label.id;
    object.name = DisplayName(label.id, label.name);
    object.file_stem = FileStem(label.id, label.name);
    object.color = LabelColor(label.id);
    scene->objects.push_back(std::move(object));
  }
}

// Gives every object the hidden pockets that it encloses.
void AddCavities(const std::vector<uint8_t>& has_camera, ExportableScene* scene) {
  CavityFinder finder(*scene, has_camera);
  for (size_t index = 0; index < scene->objects.size(); ++index) {
    ObjectInfo& object = scene->objects[index];
    const std::vector<uint32_t> hidden = finder.Find(object.cells, static_cast<int32_t>(index));
    for (const uint32_t cell : hidden) {
      // Pockets of two objects cannot overlap: each would have to enclose the other, and what
      // another owns is in the open.
      CHECK_EQ(scene->object_of_cell[cell], -1);
      scene->object_of_cell[cell] = static_cast<int32_t>(index);
    }
    object.cells.insert(object.cells.end(), hidden.begin(), hidden.end());
  }
}

// Finds the objects by the rules of MakeExportableScene, and measures them.
void FindObjects(const Model& model,
                 const ExportableSceneOptions& options,
                 ExportableScene* scene) {
  GatherObjects(model, options.components.min_cells > 0 ? 0 : options.min_component_share, scene);
  if (options.fill_hidden_space && !scene->objects.empty()) {
    const std::vector<uint8_t> has_camera = CellsWithCameras(model, *scene);
    if (!model.statistics.passed.empty()) {
      AddUnseenInsides(model.statistics, has_camera, scene);
    }
    AddCavities(has_camera, scene);
  }
  for (ObjectInfo& object : scene->objects) std::sort(object.cells.begin(), object.cells.end());
  KeepComponents(options.components, scene);
  if (options.components.min_cells == 0 && !options.components.keep_fragments) {
    LeaveOutFragments(scene);
  }
  ParallelForBlocks(std::ssize(scene->objects), 1, [&](int64_t index, int64_t) {
    DescribeObject(*scene, &scene->objects[index]);
  });
}

}  // namespace

ExportableScene MakeExportableScene(const Model& model, const ExportableSceneOptions& options) {
  ExportableScene scene = MakeSceneCells(model, options);
  FindObjects(model, options, &scene);
  SpreadColors(&scene);
  return scene;
}

}  // namespace semfoam
