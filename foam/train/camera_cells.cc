// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/train/camera_cells.h"

namespace semfoam {

CameraCells::CameraCells(const TrainingViews& views, TrainingDevice* device)
    : views_(views), device_(device), cells_(views.NumViews(), 0) {}

void CameraCells::Reset() { cells_.assign(views_.NumViews(), 0); }

const std::vector<uint32_t>& CameraCells::Update(const std::vector<int>& views) {
  cells_ = Find(views);
  return cells_;
}

std::vector<uint32_t> CameraCells::Find(const std::vector<int>& views) const {
  std::vector<Eigen::Vector3d> origins;
  std::vector<uint32_t> found;
  for (const int view : views) {
    origins.push_back(views_.Origin(view));
    found.push_back(cells_[view]);
  }
  device_->StartCells(origins, &found);
  std::vector<uint32_t> result = cells_;
  for (size_t i = 0; i < views.size(); ++i) result[views[i]] = found[i];
  return result;
}

}  // namespace semfoam
