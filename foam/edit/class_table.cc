// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/edit/class_table.h"

#include "foam/model/classifier.h"
#include "foam/util/error.h"
#include "foam/util/random.h"

#include <algorithm>
#include <cmath>
#include <set>

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <glog/logging.h>

namespace semfoam {
namespace {

using Vector = Eigen::Matrix<double, kIdentityDim, 1>;
using Matrix = Eigen::Matrix<double, kIdentityDim, kIdentityDim>;

// Logits by which a class wins clearly: exp(-8) is 3e-4.
constexpr double kMargin = 8;
// Minimum ratio of the new feature's length to the extent of any other feature in its direction.
constexpr double kReach = 4;
// Features that reach farther than this share of all are limited, see LimitReach.
constexpr double kUsualShare = 0.999;
// And so many times as long as the others are: the shorter it is, the less it shifts the logits of
// the other classes where a ray sees both.
constexpr double kShortest = 0.05;
// The share of a ray's weight from which on the new class shows: above 1 / kReach, so that no
// cell of the model reaches it, and below a half.
constexpr double kThreshold = 0.45;
// Of SetClasses: the logit of a class whose cells have all of a ray's weight, and the share of the
// weight from which on a class shows.
constexpr float kLogit = 64, kLeastShare = 0.25f;

Vector Row(const float* values) {
  return Eigen::Map<const Eigen::Matrix<float, kIdentityDim, 1>>(values).cast<double>();
}

// The model's features and classifier in double, for one new class.
struct KnownClasses {
  explicit KnownClasses(const Foam& foam) {
    for (int k = 0; k < foam.num_classes; ++k) {
      weights.push_back(Row(&foam.classifier_weight[k * kIdentityDim]));
      biases.push_back(foam.classifier_bias[k]);
    }
    for (size_t i = 0; i < foam.NumSites(); ++i) {
      features.push_back(Row(&foam.identity[i * kIdentityDim]));
    }
  }

  // Returns the largest logit of `feature`, and its class.
  double LargestLogit(const Vector& feature, int* class_index = nullptr) const {
    double largest = weights[0].dot(feature) + biases[0];
    if (class_index != nullptr) *class_index = 0;
    for (size_t k = 1; k < weights.size(); ++k) {
      const double logit = weights[k].dot(feature) + biases[k];
      if (!(logit > largest)) continue;
      largest = logit;
      if (class_index != nullptr) *class_index = static_cast<int>(k);
    }
    return largest;
  }

  std::vector<Vector> weights;
  std::vector<double> biases;
  std::vector<Vector> features;
};

// Adds a matrix of second moments at a weight of its own, so that no unit counts.
void AddNormalized(const Matrix& moments, Matrix* sum) {
  if (moments.trace() > 0) *sum += moments / moments.trace();
}

// Unit length; the sign makes its largest component positive.
Vector LeastUsedDirection(const KnownClasses& known) {
  // Each class counts alike, however few cells it has.
  std::vector<Matrix> of_class(known.weights.size(), Matrix::Zero());
  std::vector<size_t> count(known.weights.size(), 0);
  for (const Vector& feature : known.features) {
    int k = 0;
    known.LargestLogit(feature, &k);
    of_class[k] += feature * feature.transpose();
    ++count[k];
  }
  Matrix of_features = Matrix::Zero();
  for (size_t k = 0; k < of_class.size(); ++k) {
    if (count[k] > 0) of_features += of_class[k] / static_cast<double>(count[k]);
  }
  Matrix of_weights = Matrix::Zero();
  for (const Vector& weight : known.weights)
    AddNormalized(weight * weight.transpose(), &of_weights);
  Matrix moments = Matrix::Zero();
  AddNormalized(of_features, &moments);
  AddNormalized(of_weights, &moments);
  Vector direction = Eigen::SelfAdjointEigenSolver<Matrix>(moments).eigenvectors().col(0);
  int largest = 0;
  direction.cwiseAbs().maxCoeff(&largest);
  return direction[largest] > 0 ? direction : Vector(-direction);
}

// Returns how far the features reach in a direction of unit length. Few that reach far would make
// the new feature long: those beyond the 99.9 % quantile are brought back to it, in this one
// direction, where they keep their class.
double LimitReach(const Vector& direction, KnownClasses* known, Foam* foam) {
  if (known->features.empty()) return 0;
  std::vector<double> reaches(known->features.size());
  for (size_t i = 0; i < reaches.size(); ++i) {
    reaches[i] = std::abs(direction.dot(known->features[i]));
  }
  const auto limit = reaches.begin() + static_cast<ptrdiff_t>(kUsualShare * (reaches.size() - 1));
  std::nth_element(reaches.begin(), limit, reaches.end());
  double reach = *limit;
  for (size_t i = 0; i < known->features.size(); ++i) {
    Vector& f = known->features[i];
    const double along = direction.dot(f);
    if (std::abs(along) <= *limit) continue;
    const Vector limited = f + (std::copysign(*limit, along) - along) * direction;
    int was = 0, is = 0;
    known->LargestLogit(f, &was);
    known->LargestLogit(limited, &is);
    if (was != is) {
      reach = std::max(reach, std::abs(along));
      continue;
    }
    f = limited;
    Eigen::Map<Eigen::Matrix<float, kIdentityDim, 1>>(&foam->identity[i * kIdentityDim]) =
        limited.cast<float>();
  }
  return reach;
}

// Returns `count` features of unit length: axes, and from then on each the one of some thousand
// random directions whose largest cosine with those before is the smallest.
std::vector<Vector> DistinctFeatures(size_t count) {
  constexpr int kDraws = 4000;
  constexpr uint64_t kFeaturePurpose = 0x1a6;
  std::vector<Vector> features;
  for (size_t k = 0; k < std::min<size_t>(count, kIdentityDim); ++k) {
    features.push_back(Vector::Unit(static_cast<int>(k)));
  }
  CounterRandom random(0, kFeaturePurpose, count);
  while (features.size() < count) {
    Vector best = Vector::Zero();
    double least = 2;
    for (int draw = 0; draw < kDraws; ++draw) {
      Vector direction;
      for (int c = 0; c < kIdentityDim; ++c) direction[c] = random.Normal();
      direction.normalize();
      double largest = -1;
      // Most draws are dropped at one of the first features.
      for (size_t k = 0; k < features.size() && largest < least; ++k) {
        largest = std::max(largest, features[k].dot(direction));
      }
      if (largest >= least) continue;
      least = largest;
      best = direction;
    }
    features.push_back(best);
  }
  return features;
}

}  // namespace

void KeepClasses(const std::vector<ClassIndex>& classes, Model* model) {
  Foam& foam = model->foam;
  std::vector<float> weight, bias;
  std::vector<Label> labels;
  for (const ClassIndex kept : classes) {
    const int32_t k = Value(kept);
    CHECK(k >= 0 && k < foam.num_classes);
    const auto row = foam.classifier_weight.begin() + k * kIdentityDim;
    weight.insert(weight.end(), row, row + kIdentityDim);
    bias.push_back(foam.classifier_bias[k]);
    labels.push_back(model->labels[k]);
  }
  foam.num_classes = static_cast<int>(classes.size());
  foam.classifier_weight = std::move(weight);
  foam.classifier_bias = std::move(bias);
  model->labels = std::move(labels);
  if (!foam.HasSemantics()) foam.identity.clear();
}

void SetClasses(std::vector<Label> labels,
                const std::vector<ClassIndex>& class_of_cell,
                Model* model) {
  Foam& foam = model->foam;
  CHECK_EQ(class_of_cell.size(), foam.NumSites());
  for (const Label& label : labels) CHECK(label.id != kNoObject);
  const std::vector<Vector> features = DistinctFeatures(labels.size());
  const auto num_labels = static_cast<int32_t>(labels.size());
  foam.num_classes = num_labels + 1;
  foam.classifier_weight.assign(foam.num_classes * kIdentityDim, 0.f);
  foam.classifier_bias.assign(foam.num_classes, 0.f);
  foam.classifier_bias[0] = kLeastShare * kLogit;
  for (int32_t k = 0; k < num_labels; ++k) {
    for (int c = 0; c < kIdentityDim; ++c) {
      foam.classifier_weight[(k + 1) * kIdentityDim + c] =
          kLogit * static_cast<float>(features[k][c]);
    }
  }
  foam.identity.assign(foam.NumSites() * kIdentityDim, 0.f);
  for (size_t i = 0; i < foam.NumSites(); ++i) {
    const int32_t k = Value(class_of_cell[i]);
    if (class_of_cell[i] == kUnlabelled) continue;
    CHECK(k >= 0 && k < num_labels);
    for (int c = 0; c < kIdentityDim; ++c) {
      foam.identity[i * kIdentityDim + c] = static_cast<float>(features[k][c]);
    }
  }
  labels.insert(labels.begin(), Label{});
  model->labels = std::move(labels);
}

IdentityFeature AddClass(const Label& label, Model* model) {
  Foam& foam = model->foam;
  if (!foam.HasSemantics()) {
    model->labels.push_back({});
    foam.num_classes = 1;
    foam.identity.assign(foam.NumSites() * kIdentityDim, 0.f);
    foam.classifier_weight.assign(kIdentityDim, 0.f);
    foam.classifier_bias.assign(1, 0.f);
  }
  KnownClasses known(foam);
  const Vector direction = LeastUsedDirection(known);
  const double reach = LimitReach(direction, &known, &foam);
  double squared_norms = 0;
  for (const Vector& feature : known.features) squared_norms += feature.squaredNorm();
  const double typical_norm =
      known.features.empty() ? 0 : std::sqrt(squared_norms / known.features.size());
  double length = std::max(kReach * reach, kShortest * typical_norm);
  if (!(length > 0)) length = 1;
  const Vector feature = length * direction;

  // The new logit is slope * (direction . f - threshold): steep enough to lose on every cell that
  // there is, and on no light at all, and to win on what shows the new feature.
  const double threshold = kThreshold * length;
  double slope = 0;
  const auto lose_on = [&](const Vector& f) {
    slope = std::max(slope, (kMargin - known.LargestLogit(f)) / (threshold - direction.dot(f)));
  };
  const auto win_on = [&](const Vector& f) {
    slope = std::max(slope, (known.LargestLogit(f) + kMargin) / (direction.dot(f) - threshold));
  };
  lose_on(Vector::Zero());
  for (const Vector& f : known.features) lose_on(f);
  win_on(feature);
  win_on(0.6 * feature);

  IdentityFeature result;
  for (int c = 0; c < kIdentityDim; ++c) {
    result[c] = static_cast<float>(feature[c]);
    foam.classifier_weight.push_back(static_cast<float>(slope * direction[c]));
  }
  foam.classifier_bias.push_back(static_cast<float>(-slope * threshold));
  ++foam.num_classes;
  model->labels.push_back(label);
  return result;
}

Label WithFreeId(const std::vector<Label>& labels, Label label) {
  std::set<LabelId> taken;
  for (const Label& other : labels) taken.insert(other.id);
  if (label.id != kNoObject && !taken.count(label.id)) return label;
  for (int32_t id = 1; id <= 65535; ++id) {
    if (taken.count(LabelId{id})) continue;
    label.id = LabelId{id};
    return label;
  }
  throw UserError("The scene has all of the 65535 labels that there can be; remove an object.");
}

}  // namespace semfoam
