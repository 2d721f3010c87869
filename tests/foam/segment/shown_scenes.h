// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/segment/surface_graph.h"

#include <algorithm>
#include <cstdint>
#include <functional>
#include <vector>

#include "tests/foam/edit/object_scenes.h"
#include <Eigen/Core>

namespace semfoam {

// Makes photos show the solid cells of a model that border on air, where `is_shown`.
inline void ShowSurfaces(const std::function<bool(const Eigen::Vector3f&)>& is_shown,
                         Model* model) {
  const Delaunay delaunay = TriangulateModel(*model);
  const CellLabels labels = LabelCells(model->foam, delaunay);
  CellStatistics& statistics = model->statistics;
  const size_t count = model->foam.NumSites();
  statistics.contribution.assign(count, 0);
  statistics.passed.assign(count, 0);
  statistics.stopped.assign(count, 0);
  statistics.mean_color.assign(count, Eigen::Vector3f::Constant(0.5f));
  for (uint32_t i = 0; i < count; ++i) {
    if (labels.solid[i] == 0) statistics.passed[i] = 100;
    if (labels.solid[i] == 0 || !is_shown(model->foam.positions[i])) continue;
    for (const uint32_t other : delaunay.Neighbors(i)) {
      if (other < count && labels.solid[other] != 0) continue;
      statistics.contribution[i] = 1;
      statistics.stopped[i] = 50;
    }
  }
}

inline bool IsAnywhere(const Eigen::Vector3f&) { return true; }

// A model without classes in the cube [-1, 1]^3, cell of site x matter where kind_of(x) is not
// kAir, of which photos show the surfaces where `is_shown`.
inline Model ShownModel(int num_sites,
                        const std::function<int(const Eigen::Vector3f&)>& kind_of,
                        const std::function<bool(const Eigen::Vector3f&)>& is_shown = IsAnywhere) {
  std::vector<Eigen::Vector3f> sites = FarSites();
  for (const Eigen::Vector3f& x : RandomSites(num_sites, 3)) sites.push_back(x);
  Model model = ModelOf(sites, 0, 0, [&](const Eigen::Vector3f& x) {
    return x.cwiseAbs().maxCoeff() > 1 ? kAir : kind_of(x);
  });
  ShowSurfaces(is_shown, &model);
  return model;
}

// Two balls whose middles are `apart`.
inline Model TwoBalls(float apart) {
  constexpr float kRadius = 0.45f;
  const Eigen::Vector3f half(0.5f * apart, 0, 0);
  return ShownModel(30000, [&](const Eigen::Vector3f& x) {
    return std::min((x - half).norm(), (x + half).norm()) < kRadius ? 0 : kAir;
  });
}

enum { kTop, kLeg, kBox, kPost, kSnowman };

// A table on a leg; a box, a post and two balls, one on the other, on its top.
inline int Table(const Eigen::Vector3f& x) {
  const Eigen::Vector2f at = x.head<2>();
  if (x.z() < -0.4f) return at.norm() < 0.2f ? kLeg : kAir;
  if (x.z() < -0.2f) return at.cwiseAbs().maxCoeff() < 0.95f ? kTop : kAir;
  const auto near = [&](float x0, float y0) { return Eigen::Vector2f(at.x() - x0, at.y() - y0); };
  if (near(-0.5f, -0.5f).cwiseAbs().maxCoeff() < 0.22f && x.z() < 0.3f) return kBox;
  if (near(0.55f, -0.55f).norm() < 0.17f && x.z() < 0.5f) return kPost;
  const Eigen::Vector3f ball(0.3f, 0.4f, 0.08f), head(0.3f, 0.4f, 0.5f);
  return (x - ball).norm() < 0.32f || (x - head).norm() < 0.2f ? kSnowman : kAir;
}

// No photo shows the underside of the top.
inline Model TableModel() {
  return ShownModel(
      60000, Table, [](const Eigen::Vector3f& x) { return Table(x) != kTop || x.z() > -0.33f; });
}

inline SurfaceGraph GraphOf(const Model& model) {
  const Delaunay delaunay = TriangulateModel(model);
  return BuildSurfaceGraph(model, delaunay, LabelCells(model.foam, delaunay));
}

}  // namespace semfoam
