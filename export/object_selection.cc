// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/object_selection.h"

#include "export/names.h"
#include "foam/error.h"

#include <algorithm>
#include <sstream>

namespace semfoam {
namespace {

std::string Trim(const std::string& text) {
  const size_t begin = text.find_first_not_of(' ');
  if (begin == std::string::npos) return "";
  return text.substr(begin, text.find_last_not_of(' ') - begin + 1);
}

std::string Listed(const std::vector<ObjectInfo>& objects) {
  if (objects.empty()) return "the scene has no objects";
  std::string text;
  for (const ObjectInfo& object : objects) {
    text += (text.empty() ? "the scene has " : ", ") + std::to_string(object.id) + " (" +
            object.name + ")";
  }
  return text;
}

}  // namespace

std::vector<const ObjectInfo*> SelectObjects(const ExportableScene& scene,
                                             const std::string& labels) {
  std::vector<uint8_t> wanted(scene.objects.size(), labels.empty());
  std::istringstream parts(labels);
  for (std::string part; std::getline(parts, part, ',');) {
    part = Trim(part);
    const auto is_meant = [&](int32_t id, const std::string& name) {
      return part == std::to_string(id) || part == name;
    };
    bool found = false;
    for (size_t k = 0; k < scene.objects.size(); ++k) {
      if (!is_meant(scene.objects[k].id, scene.objects[k].name)) continue;
      wanted[k] = found = true;
    }
    if (found) continue;
    const bool is_label = std::any_of(
        scene.labels_without_cells.begin(),
        scene.labels_without_cells.end(),
        [&](const Label& label) { return is_meant(label.id, DisplayName(label.id, label.name)); });
    const bool is_left_out = std::any_of(
        scene.labels_left_out.begin(), scene.labels_left_out.end(), [&](const LeftOutLabel& label) {
          return is_meant(label.id, label.name);
        });
    throw UserError("The labels to export name '",
                    part,
                    is_label      ? "', a label without solid cells; "
                    : is_left_out ? "', all of whose pieces are left out; "
                                  : "', which is no object; ",
                    Listed(scene.objects),
                    ".");
  }
  std::vector<const ObjectInfo*> objects;
  for (size_t k = 0; k < scene.objects.size(); ++k) {
    if (wanted[k]) objects.push_back(&scene.objects[k]);
  }
  return objects;
}

}  // namespace semfoam
