// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/texture/seam_levelling.h"

#include "foam/image/srgb.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <glog/logging.h>

namespace semfoam {
namespace {

// Standard deviations of the logarithms: of a photo's gain, and of one observation beyond which
// Huber's weight falls.
constexpr double kGainSpread = 0.03;
constexpr double kNoise = 0.05;
constexpr int kRounds = 5;
// Vertices that the gains are found from.
constexpr size_t kMostVertices = 20'000;
// Darker or brighter values say little of a gain.
constexpr int kLeastValue = 16;
constexpr int kMostValue = 245;
// Layers of vertices that a quantity is extended over, and how it fades in each.
constexpr int kLayers = 400;
constexpr float kDecay = 0.995f;

struct LogObservation {
  int photo;
  double weight;
  double light;  // logarithm
};

}  // namespace

std::vector<Eigen::Vector3d> PhotoGains(std::span<const VertexObservation> observations,
                                        int observations_per_vertex,
                                        int num_photos) {
  std::vector<Eigen::Vector3d> gains(num_photos, Eigen::Vector3d::Ones());
  const size_t num_vertices = observations.size() / observations_per_vertex;
  const size_t stride = num_vertices / kMostVertices + 1;
  for (int channel = 0; channel < 3; ++channel) {
    std::vector<std::vector<LogObservation>> vertices;
    for (size_t v = 0; v < num_vertices; v += stride) {
      std::vector<LogObservation> of_vertex;
      for (int k = 0; k < observations_per_vertex; ++k) {
        const VertexObservation& one = observations[v * observations_per_vertex + k];
        if (one.photo < 0 || !(one.weight > 0)) continue;
        const int value = one.color[channel];
        if (value < kLeastValue || value > kMostValue) continue;
        of_vertex.push_back({one.photo, one.weight, std::log(LinearFromDisplay(value / 255.0))});
      }
      if (of_vertex.size() > 1) vertices.push_back(std::move(of_vertex));
    }
    Eigen::VectorXd log_gain = Eigen::VectorXd::Zero(num_photos);
    for (int round = 0; round < kRounds; ++round) {
      const double information = 1 / (kNoise * kNoise);
      Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(num_photos, num_photos);
      Eigen::VectorXd right = Eigen::VectorXd::Zero(num_photos);
      normal.diagonal().setConstant(1 / (kGainSpread * kGainSpread));
      for (const std::vector<LogObservation>& of_vertex : vertices) {
        // light_k = light - gain_k + noise: the gain takes the photo back to the common light.
        double sum = 0, mean = 0;
        for (const LogObservation& one : of_vertex) {
          sum += one.weight;
          mean += one.weight * (one.light + log_gain[one.photo]);
        }
        mean /= sum;
        std::vector<double> weights;
        double total = 0;
        for (const LogObservation& one : of_vertex) {
          const double off = std::abs(one.light + log_gain[one.photo] - mean);
          weights.push_back(one.weight / sum * std::min(1.0, kNoise / std::max(off, 1e-12)));
          total += weights.back();
        }
        for (size_t i = 0; i < of_vertex.size(); ++i) {
          const int a = of_vertex[i].photo;
          normal(a, a) += information * weights[i];
          right[a] -= information * weights[i] * of_vertex[i].light;
          for (size_t j = 0; j < of_vertex.size(); ++j) {
            const double both = information * weights[i] * weights[j] / total;
            normal(a, of_vertex[j].photo) -= both;
            right[a] += both * of_vertex[j].light;
          }
        }
      }
      log_gain = normal.ldlt().solve(right);
    }
    for (int photo = 0; photo < num_photos; ++photo) {
      gains[photo][channel] = std::exp(log_gain[photo]);
    }
  }
  return gains;
}

void ExtendOverSurface(std::span<const std::array<uint32_t, 3>> triangles,
                       std::span<const uint8_t> is_known,
                       std::vector<Eigen::Vector3f>* values) {
  const size_t num_vertices = is_known.size();
  CHECK_EQ(values->size(), num_vertices);
  std::vector<uint32_t> first(num_vertices + 1, 0);
  for (const auto& triangle : triangles) {
    for (const uint32_t v : triangle) ++first[v + 1];
  }
  for (size_t v = 0; v < num_vertices; ++v) first[v + 1] += first[v];
  // The vertex that follows in each triangle: of a closed surface all neighbours, each once.
  std::vector<uint32_t> neighbors(first.back());
  std::vector<uint32_t> next(first.begin(), first.end() - 1);
  for (const auto& triangle : triangles) {
    for (int k = 0; k < 3; ++k) neighbors[next[triangle[k]]++] = triangle[(k + 1) % 3];
  }
  // Layer by layer outwards, then the values are smoothed where they were extended.
  std::vector<uint8_t> has_value(is_known.begin(), is_known.end());
  std::vector<uint32_t> order;
  std::vector<uint32_t> layer;
  for (uint32_t v = 0; v < num_vertices; ++v) {
    if (!is_known[v]) layer.push_back(v);
  }
  for (int round = 0; round < kLayers && !layer.empty(); ++round) {
    std::vector<uint32_t> reached, left;
    for (const uint32_t v : layer) {
      Eigen::Vector3f sum = Eigen::Vector3f::Zero();
      int count = 0;
      for (uint32_t i = first[v]; i < first[v + 1]; ++i) {
        if (!has_value[neighbors[i]]) continue;
        sum += (*values)[neighbors[i]];
        ++count;
      }
      if (count == 0) {
        left.push_back(v);
        continue;
      }
      (*values)[v] = kDecay * sum / static_cast<float>(count);
      reached.push_back(v);
    }
    if (reached.empty()) break;
    for (const uint32_t v : reached) has_value[v] = 1;
    order.insert(order.end(), reached.begin(), reached.end());
    layer = std::move(left);
  }
  for (const uint32_t v : layer) (*values)[v].setZero();
  constexpr int kSmoothings = 30;
  for (int round = 0; round < kSmoothings; ++round) {
    for (const uint32_t v : order) {
      Eigen::Vector3f sum = Eigen::Vector3f::Zero();
      for (uint32_t i = first[v]; i < first[v + 1]; ++i) sum += (*values)[neighbors[i]];
      const auto count = static_cast<float>(first[v + 1] - first[v]);
      if (count > 0) (*values)[v] = kDecay * sum / count;
    }
  }
}

}  // namespace semfoam
