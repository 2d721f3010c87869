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

MeanConfidence ConfidenceOf(const ExportableScene& scene, const ObjectInfo& object) {
  MeanConfidence mean;
  for (const uint32_t cell : object.cells) {
    if (scene.label_id[cell] != object.id) continue;
    mean.sum += scene.labels.confidence[cell];
    ++mean.count;
  }
  return mean;
}

// Returns whether an object has as few of all cells as a fragment.
bool HasFragmentShare(int64_t cells, int64_t all_cells) {
  return static_cast<double>(cells) / static_cast<double>(all_cells) < kFragmentShare;
}

}  // namespace

void LeaveOut(const ExportableScene& scene,
              const ComponentMeasures& component,
              LeftOutComponents* left_out) {
  const double scale = scene.world_from_normalized.scale;
  const double file_volume = component.volume * scale * scale * scale;
  if (left_out->components == 0 || file_volume > left_out->largest_volume) {
    left_out->largest_cells = component.cells;
    left_out->largest_volume = file_volume;
    // A cell that nothing bounds but its near-duplicates has no volume.
    left_out->largest_center = scene.FileFromNormalized(
        component.volume > 0 ? Eigen::Vector3d(component.moment / component.volume)
                             : component.site);
  }
  left_out->components += 1;
  left_out->cells += component.cells;
  left_out->volume += file_volume;
}

void LeaveOut(const ExportableScene& scene,
              const std::vector<uint32_t>& component,
              LeftOutComponents* left_out) {
  ComponentMeasures measures;
  measures.cells = std::ssize(component);
  for (const uint32_t cell : component) {
    measures.volume += scene.volume[cell];
    measures.moment += scene.volume[cell] * scene.cell_positions[cell].cast<double>();
  }
  measures.site = scene.cell_positions[component.front()].cast<double>();
  LeaveOut(scene, measures, left_out);
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

bool IsKept(const ComponentOptions& options, int64_t cells, int64_t kept) {
  return cells >= options.min_cells && (options.keep_largest == 0 || kept < options.keep_largest);
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
      const bool is_wanted = IsKept(options, std::ssize(component.cells), object.components);
      if (!is_wanted) LeaveOut(*scene, component.cells, &object.left_out);
      const int32_t owner = is_wanted ? static_cast<int32_t>(kept_objects.size()) : -1;
      for (const uint32_t cell : component.cells) scene->object_of_cell[cell] = owner;
      if (!is_wanted) continue;
      object.cells.insert(object.cells.end(), component.cells.begin(), component.cells.end());
      ++object.components;
    }
    if (object.cells.empty()) {
      scene->labels_left_out.push_back({object.id, object.name, object.left_out, kTooFewCells});
      continue;
    }
    std::sort(object.cells.begin(), object.cells.end());
    kept_objects.push_back(std::move(object));
  }
  scene->objects = std::move(kept_objects);
}

std::string FragmentReason(const FragmentEvidence& object,
                           int64_t all_cells,
                           double all_confidence) {
  constexpr int64_t kFewestCells = 10;
  if (!HasFragmentShare(object.cells, all_cells)) return "";
  const bool is_unsure = object.confidence < kFragmentConfidence * all_confidence;
  const bool is_strewn = object.largest < kFewestCells && 2 * object.largest < object.cells;
  const bool is_speck = object.cells == 1;
  if (!is_unsure && !is_strewn && !is_speck) return "";
  char reason[200];
  std::snprintf(reason,
                sizeof(reason),
                "a fragment: %lld %s, %.2g %% of those of all objects, in pieces of at most "
                "%lld; confidence %.2f, where all objects have %.2f",
                static_cast<long long>(object.cells),
                object.cells == 1 ? "cell" : "cells",
                100 * static_cast<double>(object.cells) / static_cast<double>(all_cells),
                static_cast<long long>(object.largest),
                object.confidence,
                all_confidence);
  return reason;
}

void LeaveOutFragments(ExportableScene* scene) {
  std::vector<MeanConfidence> confidence;
  MeanConfidence of_all;
  int64_t num_cells = 0;
  for (const ObjectInfo& object : scene->objects) {
    confidence.push_back(ConfidenceOf(*scene, object));
    of_all.Add(confidence.back());
    num_cells += std::ssize(object.cells);
  }
  std::vector<ObjectInfo> kept_objects;
  std::vector<uint8_t> visited(scene->NumSites(), 0);
  for (size_t index = 0; index < scene->objects.size(); ++index) {
    ObjectInfo& object = scene->objects[index];
    FragmentEvidence evidence;
    evidence.cells = std::ssize(object.cells);
    evidence.confidence = confidence[index].Value();
    std::vector<Component> components;
    if (HasFragmentShare(evidence.cells, num_cells)) {
      components = ComponentsOf(*scene, static_cast<int32_t>(index), &visited);
    }
    for (const Component& component : components) {
      evidence.largest = std::max(evidence.largest, std::ssize(component.cells));
    }
    const std::string reason = FragmentReason(evidence, num_cells, of_all.Value());
    const int32_t owner = reason.empty() ? static_cast<int32_t>(kept_objects.size()) : -1;
    for (const uint32_t cell : object.cells) scene->object_of_cell[cell] = owner;
    if (reason.empty()) {
      kept_objects.push_back(std::move(object));
      continue;
    }
    for (const Component& component : components) {
      LeaveOut(*scene, component.cells, &object.left_out);
    }
    scene->labels_left_out.push_back(
        {object.id, object.name, object.left_out, reason, /*is_fragment=*/true});
  }
  scene->objects = std::move(kept_objects);
}

}  // namespace semfoam
