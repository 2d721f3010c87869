// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask/region_labels.h"

#include "foam/util/error.h"
#include "plugin/mask/class_image.h"
#include "plugin/mask/mask_association.h"

#include <cstdint>
#include <set>

namespace semfoam {
namespace {

bool HasZeroClass(const std::vector<Label>& mask_labels) {
  return mask_labels[0].source_id == kZeroMaskId;
}

std::vector<RegionLabel> LabelsOf(const std::vector<Region>& regions) {
  std::vector<RegionLabel> labels;
  labels.reserve(regions.size());
  for (const Region& region : regions) labels.push_back(region.label);
  return labels;
}

void JoinLabels(int num_labels, Evidence* evidence) {
  std::vector<int32_t> node_of_region;
  std::vector<int> num_regions(num_labels, 0);
  for (const Region& region : evidence->regions) {
    node_of_region.push_back(Value(region.mask_class));
    ++num_regions[Value(region.mask_class)];
  }
  const std::vector<int32_t> roots = ClusterNodes(*evidence, node_of_region, num_labels);
  std::vector<RegionLabel> main_label(num_labels, kNoLabel);  // of each root
  for (int32_t label = 0; label < num_labels; ++label) {
    RegionLabel& main = main_label[roots[label]];
    if (main == kNoLabel || num_regions[label] > num_regions[Value(main)]) {
      main = RegionLabel{label};
    }
  }
  for (Region& region : evidence->regions)
    region.label = main_label[roots[Value(region.mask_class)]];
}

// Returns the number of labels.
int AssociateRegions(bool has_zero_class, Evidence* evidence) {
  std::vector<int32_t> node_of_region;
  int32_t num_nodes = has_zero_class ? 1 : 0;
  for (const Region& region : evidence->regions) {
    const bool is_zero = has_zero_class && region.mask_class == ClassIndex{0};
    node_of_region.push_back(is_zero ? 0 : num_nodes++);
  }
  const std::vector<int32_t> roots = ClusterNodes(*evidence, node_of_region, num_nodes);
  std::vector<RegionLabel> label_of_root(num_nodes, kNoLabel);
  int num_labels = 0;
  if (has_zero_class) label_of_root[roots[0]] = RegionLabel{num_labels++};
  for (size_t r = 0; r < evidence->regions.size(); ++r) {
    RegionLabel& label = label_of_root[roots[node_of_region[r]]];
    if (label == kNoLabel) label = RegionLabel{num_labels++};
    evidence->regions[r].label = label;
  }
  return num_labels;
}

}  // namespace

RegionLabels JoinIds(const std::vector<Label>& mask_labels, Evidence* evidence) {
  RegionLabels result;
  result.labels = mask_labels;
  result.has_zero_class = HasZeroClass(mask_labels);
  JoinLabels(static_cast<int>(mask_labels.size()), evidence);
  for (size_t c = 0; c < mask_labels.size(); ++c) {
    result.label_of_class.push_back(static_cast<RegionLabel>(c));
  }
  for (const Region& region : evidence->regions) {
    result.label_of_class[Value(region.mask_class)] = region.label;
    result.given.push_back(RegionLabel{Value(region.mask_class)});
  }
  result.believed = LabelsOf(evidence->regions);
  return result;
}

RegionLabels MatchRegions(const std::vector<Label>& mask_labels, Evidence* evidence) {
  RegionLabels result;
  result.has_zero_class = HasZeroClass(mask_labels);
  result.labels.resize(AssociateRegions(result.has_zero_class, evidence));
  result.label_of_class.assign(mask_labels.size(), kNoLabel);
  if (result.has_zero_class) {
    result.labels[0] = mask_labels[0];
    result.label_of_class[0] = RegionLabel{0};
  }
  result.believed = LabelsOf(evidence->regions);
  result.given = result.believed;
  return result;
}

void NumberLabels(const std::vector<Region>& regions, RegionLabels* labels) {
  std::set<RegionLabel> used;
  for (const Region& region : regions) {
    if (region.label != kNoLabel) used.insert(region.label);
    used.insert(region.parts.begin(), region.parts.end());
  }
  if (used.size() > kMaxMaskClasses) {
    throw FieldError("mask_consistency",
                     " independent: the regions of the masks make ",
                     used.size(),
                     " labels, where at most ",
                     kMaxMaskClasses,
                     " are possible; masks with fewer regions would be right.");
  }
  int32_t next_id = 1;
  for (const RegionLabel region_label : used) {
    if (labels->has_zero_class && region_label == RegionLabel{0}) continue;
    Label& label = labels->labels[Value(region_label)];
    label.id = LabelId{next_id};
    label.source_id = static_cast<MaskId>(next_id++);
  }
}

}  // namespace semfoam
