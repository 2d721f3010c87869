// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/data/training_views.h"
#include "foam/optim/training_device.h"

#include <cstdint>
#include <vector>

// Finds the cells that contain the cameras, where the rays of a view start.

namespace semfoam {

// Finds the cells of the cameras in a foam whose sites move. Each search starts at the last result,
// which is the same cell or a near one.
class CameraCells {
 public:
  // Starts with cell 0 for every view. Both arguments must outlive this object.
  CameraCells(const TrainingViews& views, TrainingDevice* device);

  // Starts with cell 0 again. Must be called when the sites change their order.
  void Reset();

  // Searches the cells of `views` by the device's current planes and remembers them. Returns the
  // cells of all views [NumViews]; those of other views are unchanged.
  const std::vector<uint32_t>& Update(const std::vector<int>& views);

  // Returns what Update would, without remembering the cells.
  std::vector<uint32_t> Find(const std::vector<int>& views) const;

  // Describes the remembered cells (checkpoint_state.h).
  template <typename Archive>
  void Serialize(Archive* archive) {
    archive->Array("start_cells", &cells_, views_.NumViews());
  }

 private:
  const TrainingViews& views_;
  TrainingDevice* const device_;
  // [NumViews] The last result for each camera.
  std::vector<uint32_t> cells_;
};

}  // namespace semfoam
