// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/edit/object_editing.h"
#include "foam/geometry/delaunay.h"
#include "foam/geometry/guard_sites.h"
#include "foam/model/activation.h"
#include "foam/model/cell_labels.h"
#include "foam/model/model.h"
#include "foam/util/ids.h"
#include "foam/util/random.h"
#include "foam/view/view_renderer.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <vector>

#include "tests/foam/random_cells.h"
#include <Eigen/Core>
#include <Eigen/Geometry>

namespace semfoam {

inline constexpr int kAir = -1;

// A model with colours that depend on place and direction: cell of site x is matter of class
// class_of(x), with label 10, 11, ..., or air.
inline Model ModelOf(const std::vector<Eigen::Vector3f>& sites,
                     int num_classes,
                     int sh_degree,
                     const std::function<int(const Eigen::Vector3f&)>& class_of) {
  Model model;
  Foam& foam = model.foam;
  foam.positions = sites;
  foam.sh_degree = sh_degree;
  foam.num_classes = num_classes;
  foam.classifier_bias.assign(num_classes, 0.f);
  foam.classifier_weight.assign(num_classes * kIdentityDim, 0.f);
  for (int k = 0; k < num_classes; ++k) {
    foam.classifier_weight[k * kIdentityDim + k] = 2;
    model.labels.push_back({LabelId{10 + k}, static_cast<MaskId>(10 + k), ""});
  }
  for (size_t i = 0; i < sites.size(); ++i) {
    const int k = class_of(sites[i]);
    foam.raw_density.push_back(k == kAir ? -10.f : static_cast<float>(RawDensity(200)));
    for (int c = 0; c < 3; ++c) foam.sh.push_back(std::sin(3 * sites[i][c] + k));
    for (int c = 3; c < foam.ShStride(); ++c) {
      foam.sh.push_back(0.2f * std::sin(5 * sites[i].sum() + static_cast<float>(c)));
    }
    for (int c = 0; c < kColorGradientDim; ++c) {
      foam.color_gradient.push_back(std::sin(7 * sites[i].sum() + static_cast<float>(c)));
    }
    for (int d = 0; d < (num_classes > 0 ? kIdentityDim : 0); ++d) {
      foam.identity.push_back(d == std::max(k, 0) ? 3 + 0.5f * std::sin(sites[i].x()) : 0.f);
    }
  }
  return model;
}

// Places of air around everything: 300, from 2 to 28 away.
inline std::vector<Eigen::Vector3f> FarSites() {
  std::vector<Eigen::Vector3f> sites;
  for (int i = 0; i < 300; ++i) {
    CounterRandom random(9, 9, i);
    const double radius = 2 * std::pow(14, random.Uniform());
    sites.push_back((radius * RandomDirection(&random)).cast<float>());
  }
  return sites;
}

// A ring (class 0) that lies on a table (class 1), and a ball (class 2) in the hole of the ring,
// clear of both.
enum { kRing, kTable, kBall };
inline constexpr float kTableTop = -0.16f, kRingRadius = 0.55f, kBallRadius = 0.2f;

inline int RingTableBall(const Eigen::Vector3f& x) {
  if (x.head<2>().cwiseAbs().maxCoeff() > 0.8f) return kAir;
  if (x.z() < kTableTop) return x.z() > -0.5f ? kTable : kAir;
  if (x.norm() < kBallRadius) return x.z() < -0.1f ? kAir : kBall;
  const float to_circle = std::hypot(std::hypot(x.x(), x.y()) - kRingRadius, x.z());
  return to_circle < -kTableTop ? kRing : kAir;
}

// Sites for it, different ones for each seed. Those next to the table's top are mirrored in it, so
// that it is flat.
inline std::vector<Eigen::Vector3f> RingTableBallSites(uint64_t seed) {
  std::vector<Eigen::Vector3f> sites = FarSites();
  for (const Eigen::Vector3f& u : RandomSites(15000, seed)) {
    const Eigen::Vector3f x(0.95f * u.x(), 0.95f * u.y(), 0.6f * u.z() - 0.05f);
    if (std::abs(x.z() - kTableTop) > 0.11f) sites.push_back(x);
  }
  for (int i = -11; i <= 11; ++i) {
    for (int j = -11; j <= 11; ++j) {
      const float shift = 0.001f * static_cast<float>(seed);
      const Eigen::Vector2f x(0.08f * i + shift, 0.08f * j + 2 * shift);
      sites.emplace_back(x.x(), x.y(), kTableTop + 0.04f);
      sites.emplace_back(x.x(), x.y(), kTableTop - 0.04f);
    }
  }
  return sites;
}

inline Model RingTableBallModel(int sh_degree = 2) {
  return ModelOf(RingTableBallSites(7), 3, sh_degree, RingTableBall);
}

inline Delaunay TriangulateModel(const Model& model) {
  return Triangulate(WithGuardSites(model.foam.positions));
}

// The solid cells of a class.
inline ObjectCells CellsOf(const Model& model, int32_t class_index) {
  const CellLabels labels = LabelCells(model.foam, TriangulateModel(model));
  ObjectCells object{ClassIndex{class_index}, {}};
  for (uint32_t i = 0; i < model.foam.NumSites(); ++i) {
    if (labels.solid[i] && labels.class_index[i] == object.class_index) object.cells.push_back(i);
  }
  return object;
}

inline ExtractedObjects Extract(const Model& model, int32_t class_index) {
  return ExtractObjects(model, TriangulateModel(model), {CellsOf(model, class_index)});
}

// Objects are the solid cells, each of its class.
inline Model Remove(const Model& model, const ObjectCells& object) {
  const Delaunay delaunay = TriangulateModel(model);
  const CellLabels labels = LabelCells(model.foam, delaunay);
  return RemoveObjects(model, delaunay, labels, labels.solid, {object});
}
inline Model Remove(const Model& model, int32_t class_index) {
  return Remove(model, CellsOf(model, class_index));
}

// A pinhole camera at `origin` that looks at `target`, its picture's columns along `right`.
inline CameraRays LookAt(const Eigen::Vector3d& origin,
                         const Eigen::Vector3d& target,
                         const Eigen::Vector3d& right_hint = {0.6, 0.8, 0},
                         int size = 80) {
  CameraRays rays{size, size, origin, {}};
  const Eigen::Vector3d forward = (target - origin).normalized();
  const Eigen::Vector3d right = (right_hint - right_hint.dot(forward) * forward).normalized();
  const Eigen::Vector3d down = forward.cross(right);
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      const double u = (x + 0.5) / size - 0.5, v = (y + 0.5) / size - 0.5;
      rays.directions.push_back((forward + u * right + v * down).normalized().cast<float>());
    }
  }
  return rays;
}

inline std::vector<CameraRays> SomeViews() {
  return {LookAt({1.5, 1.2, 1.4}, {0, 0, 0}),
          LookAt({-2, 0.3, 0.5}, {0, 0, 0}),
          LookAt({0.05, 0.02, 2}, {0, 0, 0}),
          LookAt({0.3, -1.9, 0.1}, {0, 0, 0})};
}

inline RenderedView Render(const Model& model, const CameraRays& rays) {
  return ViewRenderer(model.foam).Render(rays);
}

// The largest difference of two renders of a view in any channel.
inline float LargestDifference(const RenderedView& a, const RenderedView& b) {
  float largest = 0;
  for (size_t i = 0; i < a.color.size(); ++i) {
    largest = std::max(largest, (a.color[i] - b.color[i]).cwiseAbs().maxCoeff());
  }
  return largest;
}

}  // namespace semfoam
