// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/controllers/left_out_log.h"

#include "export/scene/names.h"

#include <cstdint>
#include <iomanip>
#include <sstream>
#include <string>

#include <glog/logging.h>

namespace semfoam {
namespace {

// "3 components of 25 cells, volume 0.00123; the largest, of 20 cells, at (1, 2, 3)".
std::string Describe(const LeftOutComponents& left_out) {
  const auto plural = [](int64_t count, const char* noun) {
    return std::to_string(count) + " " + noun + (count == 1 ? "" : "s");
  };
  const Eigen::Vector3d& at = left_out.largest_center;
  std::ostringstream text;
  text << plural(left_out.components, "component") << " of " << plural(left_out.cells, "cell")
       << ", volume " << left_out.volume << "; the largest, of "
       << plural(left_out.largest_cells, "cell") << ", at (" << std::setprecision(9) << at.x()
       << ", " << at.y() << ", " << at.z() << ")";
  return text.str();
}

// Logs the fragments together.
void LogLeftovers(const ExportableScene& scene) {
  int64_t fragments = 0, cells = 0;
  for (const LeftOutLabel& label : scene.labels_left_out) {
    if (!label.is_fragment) continue;
    ++fragments;
    cells += label.left_out.cells;
  }
  if (fragments == 0) return;
  LOG(INFO) << "Leftovers: " << fragments << (fragments == 1 ? " fragment" : " fragments") << " of "
            << cells << (cells == 1 ? " cell" : " cells")
            << ", without files; keep_fragments makes objects of them";
}

}  // namespace

void LogLeftOut(const ExportableScene& scene) {
  for (const ObjectInfo& object : scene.objects) {
    if (object.left_out.components == 0) continue;
    LOG(INFO) << "Left out of " << object.name << " (" << object.id
              << "): " << Describe(object.left_out);
  }
  for (const LeftOutLabel& label : scene.labels_left_out) {
    LOG(INFO) << "No object " << label.name << " (" << label.id << "), " << label.reason << ": "
              << Describe(label.left_out);
  }
  LogLeftovers(scene);
  std::string without_cells;
  for (const Label& label : scene.labels_without_cells) {
    if (!without_cells.empty()) without_cells += ", ";
    without_cells +=
        DisplayName(label.id, label.name) + " (" + std::to_string(Value(label.id)) + ")";
  }
  if (!without_cells.empty()) {
    LOG(INFO) << "Labels without solid cells, for which there will be no object: " << without_cells;
  }
}

}  // namespace semfoam
