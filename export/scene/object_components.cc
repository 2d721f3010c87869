// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/scene/object_components.h"

#include <algorithm>
#include <cstdio>

#include <glog/logging.h>

namespace semfoam {
namespace {

struct Component {
  std::vector<uint32_t> cells;
  double volume = 0;
};

// Returns the connected components of an object's cells, by their lowest cells.
std::vector<Component> ComponentsOf(const ExportableScene& scene,
                                    int32_t object_index,
                                    std::vector<uint8_t>* visited) {
  std::vector<Component> components;
  for (const uint32_t start : scene.objects[object_index].cells) {
    if ((*visited)[start]) continue;
    Component& component = components.emplace_back();
    component.cells.push_back(start);
    (*visited)[start] = 1;
    for (size_t k = 0; k < component.cells.size(); ++k) {
      for (const uint32_t next : scene.delaunay.Neighbors(component.cells[k])) {
        if (next >= scene.NumSites() || scene.object_of_cell[next] != object_index ||
            (*visited)[next]) {
          continue;
        }
        (*visited)[next] = 1;
        component.cells.push_back(next);
      }
    }
    std::sort(component.cells.begin(), component.cells.end());
    for (const uint32_t cell : component.cells) component.volume += scene.volume[cell];
  }
  return components;
}

// Of cells, over those of the object's own class.
struct MeanConfidence {
  double sum = 0;
  int64_t count = 0;
  double Value() const { return count > 0 ? sum / static_cast<double>(count) : 0; }
};

MeanConfidence ConfidenceOf(const ExportableScene& scene, const ObjectInfo& object) {
  MeanConfidence mean;
  for (const uint32_t cell : object.cells) {
    if (scene.label_id[cell] != object.id) continue;
    mean.sum += scene.labels.confidence[cell];
    ++mean.count;
  }
  return mean;
}

}  // namespace

void LeaveOut(const ExportableScene& scene,
              const std::vector<uint32_t>& component,
              LeftOutComponents* left_out) {
  double volume = 0;
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();
  for (const uint32_t cell : component) {
    volume += scene.volume[cell];
    moment += scene.volume[cell] * scene.cell_positions[cell].cast<double>();
  }
  const double scale = scene.world_from_normalized.scale;
  const double file_volume = volume * scale * scale * scale;
  const auto cells = static_cast<int64_t>(component.size());
  if (left_out->components == 0 || file_volume > left_out->largest_volume) {
    left_out->largest_cells = cells;
    left_out->largest_volume = file_volume;
    // A cell that nothing bounds but its near-duplicates has no volume.
    left_out->largest_center = scene.FileFromNormalized(
        volume > 0 ? Eigen::Vector3d(moment / volume)
                   : Eigen::Vector3d(scene.cell_positions[component.front()].cast<double>()));
  }
  left_out->components += 1;
  left_out->cells += cells;
  left_out->volume += file_volume;
}

int64_t CountComponents(const ExportableScene& scene, const std::vector<uint32_t>& cells) {
  std::vector<uint8_t> is_left(scene.delaunay.num_cells, 0);
  for (const uint32_t cell : cells) is_left[cell] = 1;
  int64_t count = 0;
  std::vector<uint32_t> reached;
  for (const uint32_t start : cells) {
    if (!is_left[start]) continue;
    ++count;
    is_left[start] = 0;
    reached.assign(1, start);
    while (!reached.empty()) {
      const uint32_t cell = reached.back();
      reached.pop_back();
      for (const uint32_t next : scene.delaunay.Neighbors(cell)) {
        if (!is_left[next]) continue;
        is_left[next] = 0;
        reached.push_back(next);
      }
    }
  }
  return count;
}

void KeepComponents(const ComponentOptions& options, ExportableScene* scene) {
  CHECK_GE(options.min_cells, 0);
  CHECK_GE(options.keep_largest, 0);
  std::vector<ObjectInfo> kept_objects;
  std::vector<uint8_t> visited(scene->NumSites(), 0);
  for (size_t index = 0; index < scene->objects.size(); ++index) {
    std::vector<Component> components = ComponentsOf(*scene, static_cast<int32_t>(index), &visited);
    std::stable_sort(components.begin(),
                     components.end(),
                     [](const Component& a, const Component& b) { return a.volume > b.volume; });
    ObjectInfo& object = scene->objects[index];
    object.cells.clear();
    for (const Component& component : components) {
      const bool is_wanted =
          static_cast<int64_t>(component.cells.size()) >= options.min_cells &&
          (options.keep_largest == 0 || object.components < options.keep_largest);
      if (!is_wanted) LeaveOut(*scene, component.cells, &object.left_out);
      const int32_t owner = is_wanted ? static_cast<int32_t>(kept_objects.size()) : -1;
      for (const uint32_t cell : component.cells) scene->object_of_cell[cell] = owner;
      if (!is_wanted) continue;
      object.cells.insert(object.cells.end(), component.cells.begin(), component.cells.end());
      ++object.components;
    }
    if (object.cells.empty()) {
      scene->labels_left_out.push_back(
          {object.id, object.name, object.left_out, "too few cells in every piece"});
      continue;
    }
    std::sort(object.cells.begin(), object.cells.end());
    kept_objects.push_back(std::move(object));
  }
  scene->objects = std::move(kept_objects);
}

void LeaveOutFragments(ExportableScene* scene) {
  constexpr size_t kFewestCells = 10;
  std::vector<MeanConfidence> confidence;
  MeanConfidence of_all;
  size_t num_cells = 0;
  for (const ObjectInfo& object : scene->objects) {
    confidence.push_back(ConfidenceOf(*scene, object));
    of_all.sum += confidence.back().sum;
    of_all.count += confidence.back().count;
    num_cells += object.cells.size();
  }
  std::vector<ObjectInfo> kept_objects;
  std::vector<uint8_t> visited(scene->NumSites(), 0);
  for (size_t index = 0; index < scene->objects.size(); ++index) {
    ObjectInfo& object = scene->objects[index];
    const double share = static_cast<double>(object.cells.size()) / static_cast<double>(num_cells);
    std::vector<Component> components;
    size_t largest = 0;
    if (share < kFragmentShare) {
      components = ComponentsOf(*scene, static_cast<int32_t>(index), &visited);
      for (const Component& component : components) {
        largest = std::max(largest, component.cells.size());
      }
    }
    const bool is_unsure = confidence[index].Value() < kFragmentConfidence * of_all.Value();
    const bool is_strewn = largest < kFewestCells && 2 * largest < object.cells.size();
    const bool is_speck = object.cells.size() == 1;
    const bool is_fragment = !components.empty() && (is_unsure || is_strewn || is_speck);
    const int32_t owner = is_fragment ? -1 : static_cast<int32_t>(kept_objects.size());
    for (const uint32_t cell : object.cells) scene->object_of_cell[cell] = owner;
    if (!is_fragment) {
      kept_objects.push_back(std::move(object));
      continue;
    }
    for (const Component& component : components) {
      LeaveOut(*scene, component.cells, &object.left_out);
    }
    char reason[200];
    std::snprintf(reason,
                  sizeof(reason),
                  "a fragment: %zu %s, %.2g %% of those of all objects, in pieces of at most "
                  "%zu; confidence %.2f, where all objects have %.2f",
                  object.cells.size(),
                  object.cells.size() == 1 ? "cell" : "cells",
                  100 * share,
                  largest,
                  confidence[index].Value(),
                  of_all.Value());
    scene->labels_left_out.push_back(
        {object.id, object.name, object.left_out, reason, /*is_fragment=*/true});
  }
  scene->objects = std::move(kept_objects);
}

}  // namespace semfoam
