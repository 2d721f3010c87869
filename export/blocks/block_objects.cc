// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/blocks/block_objects.h"

#include "export/scene/names.h"
#include "export/scene/object_components.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <utility>
#include <vector>

#include <glog/logging.h>

namespace semfoam {
namespace {

// The node of all cells of which no object and no hidden pocket is made (ObjectFinder::ClassOf).
constexpr uint32_t kOpenNode = 0;

// Connected cells of one block: matter of one class with a label, or air.
struct Node {
  // kUnlabelled: air.
  ClassIndex class_index = kUnlabelled;
  // Air: whether it touches a guard or a cell in the open.
  bool is_open = false;
  ComponentMeasures measures;
  // Of all its cells with their corners, in the frame of the files.
  Eigen::AlignedBox3d box;
  // Of its cells, by their own labels.
  std::map<LabelId, MeanConfidence> confidence;

  void Add(const Node& other) {
    is_open = is_open || other.is_open;
    measures.cells += other.measures.cells;
    measures.volume += other.measures.volume;
    measures.moment += other.measures.moment;
    box.extend(other.box);
    for (const auto& [label, mean] : other.confidence) confidence[label].Add(mean);
  }
};

// Sets of nodes that have been joined. The lowest node of a set stands for it.
class NodeSets {
 public:
  uint32_t Add() {
    parents_.push_back(static_cast<uint32_t>(parents_.size()));
    return parents_.back();
  }
  uint32_t Find(uint32_t node) {
    while (parents_[node] != node) node = parents_[node] = parents_[parents_[node]];
    return node;
  }
  void Join(uint32_t a, uint32_t b) {
    a = Find(a);
    b = Find(b);
    parents_[std::max(a, b)] = std::min(a, b);
  }
  uint32_t size() const { return static_cast<uint32_t>(parents_.size()); }

 private:
  std::vector<uint32_t> parents_;
};

class ObjectFinder {
 public:
  ObjectFinder(const Model& run, const ExportableSceneOptions& options, uint32_t num_sites)
      : run_(run), options_(options), node_of_cell_(num_sites, kOpenNode) {
    scene_.transform = options.transform;
    scene_.colmap_from_normalized = run.world_from_normalized;
    scene_.world_from_normalized = options.transform.Unturned(run.world_from_normalized);
    scene_.label_table = run.labels;
    scene_.object_of_cell.assign(num_sites, -1);
    AddNode();
  }

  // Adds a block, all of whose predecessors have been added.
  void AddBlock(const BlockScene& block) {
    FindNodes(block);
    Connect(block);
  }

  // Makes the objects, when all blocks have been added.
  ExportableScene Finish() {
    JoinNodes();
    GatherObjects();
    if (options_.fill_hidden_space) AddCavities();
    KeepComponents();
    if (options_.components.min_cells == 0 && !options_.components.keep_fragments) {
      LeaveOutFragments();
    }
    Describe();
    return std::move(scene_);
  }

 private:
  // An object and the sets of nodes of its components, the lowest first.
  struct Found {
    ObjectInfo info;
    std::vector<uint32_t> components;
  };

  uint32_t AddNode() {
    nodes_.emplace_back();
    return sets_.Add();
  }

  // Returns the class of a cell's node; kUnlabelled: air. Sets `is_open` for cells of kOpenNode:
  // matter without a label, what is solid and no matter, air with a camera, and sites at the place
  // of another one.
  ClassIndex ClassOf(const BlockScene& block, uint32_t cell, bool* is_open) const {
    const ExportableScene& scene = block.scene;
    *is_open = scene.delaunay.Neighbors(cell).empty();
    if (scene.is_matter[cell]) {
      const ClassIndex c = scene.labels.class_index[cell];
      *is_open = *is_open || c == kUnlabelled || scene.label_id[cell] == kNoObject;
      return c;
    }
    *is_open = *is_open || scene.labels.solid[cell] || block.has_camera[cell];
    return kUnlabelled;
  }

  void AddCell(const ExportableScene& scene, uint32_t cell, Node* node) const {
    const Eigen::Vector3d site = scene.cell_positions[cell].cast<double>();
    ComponentMeasures& measures = node->measures;
    if (measures.cells == 0) measures.site = site;
    ++measures.cells;
    measures.volume += scene.volume[cell];
    measures.moment += scene.volume[cell] * site;
    for (const uint32_t tet : scene.tets_of_cells.Of(cell)) {
      node->box.extend(scene.FileFromNormalized(scene.voronoi_vertices[tet]));
    }
    MeanConfidence& confidence = node->confidence[scene.label_id[cell]];
    confidence.sum += scene.labels.confidence[cell];
    ++confidence.count;
  }

  // Makes the nodes of a block.
  void FindNodes(const BlockScene& block) {
    constexpr uint32_t kNone = UINT32_MAX;
    const uint32_t first_id = block.num_own > 0 ? block.ids[0] : 0;
    uint32_t* const node_of = node_of_cell_.data() + first_id;
    std::vector<ClassIndex> classes(block.num_own);
    for (uint32_t i = 0; i < block.num_own; ++i) {
      bool is_open = false;
      classes[i] = ClassOf(block, i, &is_open);
      node_of[i] = is_open ? kOpenNode : kNone;
    }
    std::vector<uint32_t> reached;
    for (uint32_t start = 0; start < block.num_own; ++start) {
      if (node_of[start] != kNone) continue;
      const uint32_t index = AddNode();
      Node& node = nodes_[index];
      node.class_index = classes[start];
      node_of[start] = index;
      reached.assign(1, start);
      for (size_t k = 0; k < reached.size(); ++k) {
        AddCell(block.scene, reached[k], &node);
        for (const uint32_t next : block.scene.delaunay.Neighbors(reached[k])) {
          if (next >= block.num_own || node_of[next] != kNone || classes[next] != classes[start]) {
            continue;
          }
          node_of[next] = index;
          reached.push_back(next);
        }
      }
    }
  }

  // Joins and links the nodes of a block, with each other and with those of the blocks before it.
  void Connect(const BlockScene& block) {
    std::vector<std::pair<uint32_t, uint32_t>> links;
    for (uint32_t i = 0; i < block.num_own; ++i) {
      const uint32_t own = node_of_cell_[block.ids[i]];
      for (const uint32_t j : block.scene.delaunay.Neighbors(i)) {
        if (j >= block.scene.NumSites()) {
          nodes_[own].is_open = true;
          continue;
        }
        if (block.ids[j] > block.ids[i]) continue;
        const uint32_t other = node_of_cell_[block.ids[j]];
        if (own != other) links.emplace_back(std::min(own, other), std::max(own, other));
      }
    }
    std::sort(links.begin(), links.end());
    links.erase(std::unique(links.begin(), links.end()), links.end());
    for (const auto& [a, b] : links) {
      const bool a_is_air = a != kOpenNode && nodes_[a].class_index == kUnlabelled;
      const bool b_is_air = nodes_[b].class_index == kUnlabelled;
      if (a == kOpenNode) {
        nodes_[b].is_open = true;
      } else if (nodes_[a].class_index == nodes_[b].class_index) {
        sets_.Join(a, b);
      } else if (a_is_air) {
        air_links_.emplace_back(a, b);
      } else if (b_is_air) {
        air_links_.emplace_back(b, a);
      }
    }
  }

  // Adds the measures of joined nodes up.
  void JoinNodes() {
    for (uint32_t node = 1; node < nodes_.size(); ++node) {
      const uint32_t set = sets_.Find(node);
      if (set != node) nodes_[set].Add(nodes_[node]);
    }
  }

  std::vector<uint32_t> SetsOfClass(ClassIndex class_index) {
    std::vector<uint32_t> sets;
    for (uint32_t node = 1; node < nodes_.size(); ++node) {
      if (nodes_[node].class_index == class_index && sets_.Find(node) == node) {
        sets.push_back(node);
      }
    }
    return sets;
  }

  // As GatherObjects of MakeExportableScene. Every cell counts as photographed.
  void GatherObjects() {
    object_of_set_.assign(nodes_.size(), -1);
    const float share = options_.components.min_cells > 0 ? 0 : options_.min_component_share;
    std::vector<int32_t> classes(run_.labels.size());
    std::iota(classes.begin(), classes.end(), 0);
    std::sort(classes.begin(), classes.end(), [&](int32_t a, int32_t b) {
      return run_.labels[a].id < run_.labels[b].id;
    });
    for (const int32_t k : classes) {
      const Label& label = run_.labels[k];
      if (label.id == kNoObject) continue;
      const std::vector<uint32_t> sets = SetsOfClass(ClassIndex{k});
      if (sets.empty()) {
        scene_.labels_without_cells.push_back(label);
        continue;
      }
      int64_t largest = 0;
      for (const uint32_t set : sets) largest = std::max(largest, nodes_[set].measures.cells);
      Found found;
      for (const uint32_t set : sets) {
        const ComponentMeasures& measures = nodes_[set].measures;
        if (static_cast<float>(measures.cells) < share * static_cast<float>(largest)) {
          LeaveOut(scene_, measures, &found.info.left_out);
          continue;
        }
        object_of_set_[set] = static_cast<int32_t>(found_.size());
        found.components.push_back(set);
      }
      found.info.id = label.id;
      found.info.name = DisplayName(label.id, label.name);
      found.info.file_stem = FileStem(label.id, label.name);
      found.info.color = LabelColor(label.id);
      found_.push_back(std::move(found));
    }
  }

  // Joins to an object's components the air that they enclose: all of it that touches nothing but
  // one object.
  void AddCavities() {
    // Of each set of air: the object that it touches, -1 for none yet.
    std::map<uint32_t, int32_t> owner;
    for (const auto& [air_node, matter_node] : air_links_) {
      const uint32_t air = sets_.Find(air_node);
      const int32_t object = object_of_set_[sets_.Find(matter_node)];
      const auto [entry, is_new] = owner.emplace(air, object);
      if (object < 0 || (!is_new && entry->second != object)) nodes_[air].is_open = true;
    }
    for (const auto& [air_node, matter_node] : air_links_) {
      const uint32_t air = sets_.Find(air_node), matter = sets_.Find(matter_node);
      // Once it is joined, it is matter, and joins the other components that it touches.
      const bool is_air = nodes_[air].class_index == kUnlabelled;
      if ((is_air && nodes_[air].is_open) || air == matter) continue;
      const ClassIndex class_index = nodes_[matter].class_index;
      const int32_t object = object_of_set_[matter];
      sets_.Join(air, matter);
      const uint32_t joined = sets_.Find(air), added = joined == air ? matter : air;
      nodes_[joined].Add(nodes_[added]);
      nodes_[joined].class_index = class_index;
      object_of_set_[joined] = object;
    }
    for (Found& found : found_) {
      for (uint32_t& component : found.components) component = sets_.Find(component);
      std::sort(found.components.begin(), found.components.end());
      found.components.erase(std::unique(found.components.begin(), found.components.end()),
                             found.components.end());
    }
  }

  // As semfoam::KeepComponents.
  void KeepComponents() {
    std::vector<Found> kept;
    for (Found& found : found_) {
      std::vector<uint32_t> by_volume = std::move(found.components);
      found.components.clear();
      std::stable_sort(by_volume.begin(), by_volume.end(), [&](uint32_t a, uint32_t b) {
        return nodes_[a].measures.volume > nodes_[b].measures.volume;
      });
      for (const uint32_t set : by_volume) {
        const ComponentMeasures& measures = nodes_[set].measures;
        if (IsKept(options_.components, measures.cells, std::ssize(found.components))) {
          found.components.push_back(set);
        } else {
          LeaveOut(scene_, measures, &found.info.left_out);
        }
      }
      if (found.components.empty()) {
        scene_.labels_left_out.push_back(
            {found.info.id, found.info.name, found.info.left_out, kTooFewCells});
      } else {
        kept.push_back(std::move(found));
      }
    }
    found_ = std::move(kept);
  }

  // Of the cells of an object that have its label.
  MeanConfidence ConfidenceOf(const Found& found) const {
    MeanConfidence mean;
    for (const uint32_t set : found.components) {
      const auto of_label = nodes_[set].confidence.find(found.info.id);
      if (of_label != nodes_[set].confidence.end()) mean.Add(of_label->second);
    }
    return mean;
  }

  // As semfoam::LeaveOutFragments.
  void LeaveOutFragments() {
    std::vector<FragmentEvidence> evidence;
    MeanConfidence of_all;
    int64_t num_cells = 0;
    for (const Found& found : found_) {
      FragmentEvidence& object = evidence.emplace_back();
      for (const uint32_t set : found.components) {
        object.cells += nodes_[set].measures.cells;
        object.largest = std::max(object.largest, nodes_[set].measures.cells);
      }
      const MeanConfidence confidence = ConfidenceOf(found);
      object.confidence = confidence.Value();
      of_all.Add(confidence);
      num_cells += object.cells;
    }
    std::vector<Found> kept;
    for (size_t index = 0; index < found_.size(); ++index) {
      Found& found = found_[index];
      const std::string reason = FragmentReason(evidence[index], num_cells, of_all.Value());
      if (reason.empty()) {
        kept.push_back(std::move(found));
        continue;
      }
      std::sort(found.components.begin(), found.components.end());
      for (const uint32_t set : found.components) {
        LeaveOut(scene_, nodes_[set].measures, &found.info.left_out);
      }
      scene_.labels_left_out.push_back(
          {found.info.id, found.info.name, found.info.left_out, reason, /*is_fragment=*/true});
    }
    found_ = std::move(kept);
  }

  // Gives the objects their cells and measures.
  void Describe() {
    std::fill(object_of_set_.begin(), object_of_set_.end(), -1);
    const double scale = scene_.world_from_normalized.scale;
    for (Found& found : found_) {
      ObjectInfo& info = found.info;
      for (const uint32_t set : found.components) {
        object_of_set_[set] = static_cast<int32_t>(scene_.objects.size());
        info.volume += nodes_[set].measures.volume;
        info.bounding_box.extend(nodes_[set].box);
      }
      info.volume *= scale * scale * scale;
      info.confidence = ConfidenceOf(found).Value();
      info.components = static_cast<int>(found.components.size());
      scene_.objects.push_back(std::move(info));
    }
    for (uint32_t id = 0; id < node_of_cell_.size(); ++id) {
      const int32_t object = object_of_set_[sets_.Find(node_of_cell_[id])];
      scene_.object_of_cell[id] = object;
      if (object >= 0) scene_.objects[object].cells.push_back(id);
    }
  }

  const Model& run_;
  const ExportableSceneOptions& options_;
  std::vector<Node> nodes_;
  NodeSets sets_;
  // By the cell's number in the whole foam.
  std::vector<uint32_t> node_of_cell_;
  // Nodes of air, and the nodes of matter that they touch.
  std::vector<std::pair<uint32_t, uint32_t>> air_links_;
  // By set: index into found_, in the end into the scene's objects; -1: none.
  std::vector<int32_t> object_of_set_;
  std::vector<Found> found_;
  ExportableScene scene_;
};

}  // namespace

ExportableScene FindBlockObjects(BlockScenes* scenes) {
  ObjectFinder finder(scenes->blocks().run, scenes->options(), scenes->NumSites());
  for (size_t b = 0; b < scenes->NumBlocks(); ++b) finder.AddBlock(scenes->Make(b));
  return finder.Finish();
}

}  // namespace semfoam
