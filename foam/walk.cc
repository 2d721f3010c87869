// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/walk.h"

#include "foam/parallel.h"

#include <glog/logging.h>

namespace semfoam {

template <typename Real>
void Refresh(const std::vector<Eigen::Matrix<Real, 3, 1>>& cell_positions,
             const Delaunay& delaunay,
             WalkGeometry<Real>* geometry) {
  CHECK_EQ(cell_positions.size(), delaunay.num_cells);
  geometry->delaunay = &delaunay;
  geometry->positions = cell_positions;
  geometry->planes.resize(delaunay.neighbors.size());
  ParallelForBlocks(delaunay.num_cells, 4096, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) {
      for (uint32_t e = delaunay.offsets[i]; e < delaunay.offsets[i + 1]; ++e) {
        FacePlane<Real>& plane = geometry->planes[e];
        plane.normal = cell_positions[delaunay.neighbors[e]] - cell_positions[i];
        plane.half_squared = Real(0.5) * plane.normal.squaredNorm();
      }
    }
  });
}

template void Refresh(const std::vector<Eigen::Vector3f>&, const Delaunay&, WalkGeometry<float>*);
template void Refresh(const std::vector<Eigen::Vector3d>&, const Delaunay&, WalkGeometry<double>*);

}  // namespace semfoam
