// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/scene/object_selection.h"

#include "export/scene/names.h"
#include "foam/util/error.h"

#include <algorithm>
#include <map>
#include <set>

namespace semfoam {
namespace {

std::string Listed(const std::vector<ObjectInfo>& objects) {
  if (objects.empty()) return "the scene has no objects";
  std::string text;
  for (const ObjectInfo& object : objects) {
    text += (text.empty() ? "the scene has " : ", ") + std::to_string(Value(object.id)) + " (" +
            object.name + ")";
  }
  return text;
}

}  // namespace

std::vector<NamedLabel> NamedLabels(const std::vector<Label>& labels) {
  std::vector<NamedLabel> named;
  for (const Label& label : labels) {
    if (label.id == kNoObject) continue;
    named.push_back(
        {label.id, DisplayName(label.id, label.name), OneLine(label.features.class_name)});
  }
  return named;
}

LabelFeatures FeaturesOf(const ExportableScene& scene, LabelId id) {
  const auto label = std::find_if(scene.label_table.begin(),
                                  scene.label_table.end(),
                                  [id](const Label& one) { return one.id == id; });
  return label == scene.label_table.end() ? LabelFeatures{} : label->features;
}

LabelFilter FilterObjects(const ExportableScene& scene,
                          const LabelChoice& choice,
                          std::vector<std::string>* labels_without_object) {
  std::vector<NamedLabel> labels;
  std::set<LabelId> objects, left_out, fragments;
  const auto class_of = [&](LabelId id) { return OneLine(FeaturesOf(scene, id).class_name); };
  for (const ObjectInfo& object : scene.objects) {
    labels.push_back({object.id, object.name, class_of(object.id)});
    objects.insert(object.id);
  }
  for (const LeftOutLabel& label : scene.labels_left_out) {
    labels.push_back({label.id, label.name, class_of(label.id)});
    (label.is_fragment ? fragments : left_out).insert(label.id);
  }
  for (const NamedLabel& label : NamedLabels(scene.labels_without_cells)) labels.push_back(label);

  LabelFilter filter = ChooseLabels(choice, labels, [&](const LabelText& part) -> std::string {
    const auto is_in = [&](const std::set<LabelId>& ids) {
      return std::any_of(
          part.ids.begin(), part.ids.end(), [&](LabelId id) { return ids.count(id) != 0; });
    };
    if (is_in(objects) || (labels_without_object != nullptr && !part.ids.empty())) return "";
    return (part.ids.empty()   ? "which is no object; "
            : is_in(left_out)  ? "all of whose components are left out; "
            : is_in(fragments) ? "which is left out as a fragment (keep_fragments); "
                               : "a label without solid cells; ") +
           Listed(scene.objects) + (part.ids.empty() ? WhetherMeant(part.text, labels) : ".");
  });
  if (labels_without_object != nullptr && filter.only) {
    for (const NamedLabel& label : labels) {
      if (!filter.Has(label.id) || objects.count(label.id) != 0) continue;
      labels_without_object->push_back(label.name + " (" + std::to_string(Value(label.id)) + ")");
    }
  }
  return filter;
}

std::vector<const ObjectInfo*> SelectObjects(const ExportableScene& scene,
                                             const LabelFilter& filter) {
  std::vector<const ObjectInfo*> objects;
  for (const ObjectInfo& object : scene.objects) {
    if (filter.Has(object.id)) objects.push_back(&object);
  }
  return objects;
}

std::vector<const ObjectInfo*> SelectObjects(const ExportableScene& scene,
                                             const LabelChoice& choice) {
  return SelectObjects(scene, FilterObjects(scene, choice));
}

bool HasCell(const ExportableScene& scene, const LabelFilter& filter, uint32_t cell) {
  const int32_t object = scene.object_of_cell[cell];
  if (object >= 0) return filter.Has(scene.objects[object].id);
  return !filter.only && filter.Has(scene.label_id[cell]);
}

}  // namespace semfoam
