// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/edit/model_sites.h"

#include "foam/geometry/delaunay.h"
#include "foam/model/spherical_harmonics.h"
#include "foam/optim/optimizer.h"
#include "foam/util/array_rows.h"

#include <algorithm>

#include <glog/logging.h>

namespace semfoam {
namespace {

// So many rays say beyond doubt what a cell is (CellStatistics: passed, stopped).
constexpr float kManyLooks = 1000;

void GatherSites(const std::vector<uint32_t>& sites, Model* model) {
  Foam& foam = model->foam;
  CellStatistics& statistics = model->statistics;
  Gather(sites, 1, &foam.positions);
  Gather(sites, 1, &foam.raw_density);
  Gather(sites, 1, &foam.assumed_density);
  Gather(sites, foam.ShStride(), &foam.sh);
  Gather(sites, kColorGradientDim, &foam.color_gradient);
  Gather(sites, kIdentityDim, &foam.identity);
  Gather(sites, 1, &statistics.contribution);
  Gather(sites, 1, &statistics.mean_color);
  Gather(sites, 1, &statistics.passed);
  Gather(sites, 1, &statistics.stopped);
}

template <typename Vector>
void Append(const Vector& from, Vector* to) {
  to->insert(to->end(), from.begin(), from.end());
}

}  // namespace

Model WithSites(const Model& model, const std::vector<uint32_t>& sites) {
  Model selected = model;
  GatherSites(sites, &selected);
  return selected;
}

void AppendSites(const Model& other, Model* model) {
  const size_t n = model->foam.NumSites() + other.foam.NumSites();
  CHECK_EQ(other.foam.sh_degree, model->foam.sh_degree);
  // Cells of one colour are those of gradient 0.
  if (model->foam.HasColorGradients() || other.foam.HasColorGradients()) {
    LargePageVector<float>& gradients = model->foam.color_gradient;
    gradients.resize(model->foam.NumSites() * kColorGradientDim, 0.f);
    Append(other.foam.color_gradient, &gradients);
    gradients.resize(n * kColorGradientDim, 0.f);
  }
  if (!model->foam.assumed_density.empty() || !other.foam.assumed_density.empty()) {
    std::vector<float>& densities = model->foam.assumed_density;
    densities.resize(model->foam.NumSites(), 0.f);
    Append(other.foam.assumed_density, &densities);
    densities.resize(n, 0.f);
  }
  Append(other.foam.positions, &model->foam.positions);
  Append(other.foam.raw_density, &model->foam.raw_density);
  Append(other.foam.sh, &model->foam.sh);
  Append(other.foam.identity, &model->foam.identity);
  CellStatistics& statistics = model->statistics;
  Append(other.statistics.contribution, &statistics.contribution);
  Append(other.statistics.mean_color, &statistics.mean_color);
  Append(other.statistics.passed, &statistics.passed);
  Append(other.statistics.stopped, &statistics.stopped);
  CHECK(model->foam.identity.size() == (model->foam.HasSemantics() ? n * kIdentityDim : 0));
  CHECK(statistics.contribution.empty() || statistics.contribution.size() == n);
  CHECK_EQ(statistics.mean_color.size(), statistics.contribution.size());
  CHECK(statistics.passed.empty() || statistics.passed.size() == n);
  CHECK_EQ(statistics.stopped.size(), statistics.passed.size());
}

void SortSites(Model* model) { GatherSites(HilbertOrder(model->foam.positions), model); }

void RaiseShDegree(int sh_degree, Foam* foam) {
  CHECK_GE(sh_degree, foam->sh_degree);
  const size_t stride = foam->ShStride();
  foam->sh_degree = sh_degree;
  foam->sh = ResizeRows(foam->sh, stride, stride, foam->ShStride());
}

void MakeEmpty(uint32_t site, Model* model) {
  model->foam.raw_density[site] = kTransparentRawDensity;
  if (!model->foam.assumed_density.empty()) model->foam.assumed_density[site] = 0;
  CellStatistics& statistics = model->statistics;
  if (!statistics.contribution.empty()) statistics.contribution[site] = 0;
  if (!statistics.passed.empty()) {
    statistics.passed[site] = kManyLooks;
    statistics.stopped[site] = 0;
  }
}

void MatchStatistics(const CellStatistics& like, Model* model) {
  const Foam& foam = model->foam;
  CellStatistics& statistics = model->statistics;
  const size_t n = foam.NumSites();
  if (like.contribution.empty()) {
    statistics.contribution.clear();
    statistics.mean_color.clear();
  } else if (statistics.contribution.empty()) {
    statistics.contribution.assign(n, 1.f);
    statistics.mean_color.resize(n);
    for (size_t i = 0; i < n; ++i) {
      const float constant_term = static_cast<float>(kShDc);
      Eigen::Vector3f& color = statistics.mean_color[i];
      ShColor(&constant_term, 1, &foam.sh[i * foam.ShStride()], color.data());
      color = color.cwiseMin(1.f);
    }
  }
  if (like.passed.empty()) {
    statistics.passed.clear();
    statistics.stopped.clear();
  } else if (statistics.passed.empty()) {
    statistics.passed.assign(n, 0.f);
    statistics.stopped.assign(n, kManyLooks);
  }
}

}  // namespace semfoam
