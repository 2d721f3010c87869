// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/photometric/light_refinement.h"

#include "foam/image/srgb.h"
#include "foam/train/training_rays.h"
#include "foam/util/parallel.h"
#include "plugin/photometric/expected_light.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <utility>

#include <Eigen/Cholesky>
#include <glog/logging.h>

namespace semfoam {
namespace {

// Display values beyond these are cut off or mostly noise.
constexpr double kDarkest = 0.04;
constexpr double kBrightest = 0.985;
constexpr double kLeastOpacity = 0.5;
// Scale of the residuals, in display values, from which on they count less.
constexpr double kResidualScale = 0.05;
constexpr int kReweightings = 6;
// The prior's weight, in pixels of full brightness: a photo has thousands.
constexpr double kPriorWeight = 1;
// Pixels of the grid along an edge of a chessboard's block.
constexpr int kBlockEdge = 8;

using Terms = Eigen::Matrix<double, 1 + kNumShadingTerms, 1>;

Terms TermsAt(const Eigen::Vector2d& place) {
  Terms terms;
  terms << 1, ShadingTerms(place);
  return terms;
}

int NumTerms(int degree) { return (degree + 1) * (degree + 2) / 2; }

bool IsUsable(const LightPair& pair) {
  const auto is_inside = [](const Eigen::Vector3d& color) {
    return color.minCoeff() >= kDarkest && color.maxCoeff() <= kBrightest;
  };
  return is_inside(pair.photo) && is_inside(pair.render);
}

// log(photo / render) of the linear light.
Eigen::Vector3d LogRatio(const LightPair& pair) {
  Eigen::Vector3d ratio;
  for (int c = 0; c < 3; ++c) {
    ratio[c] = std::log(LinearFromDisplay(pair.photo[c]) / LinearFromDisplay(pair.render[c]));
  }
  return ratio;
}

// Squared error of the render under this light, in display values clipped at white.
double SquaredErrorOf(const LightPair& pair, const LightField& field) {
  const Eigen::Vector3d log_light = field * TermsAt(pair.place);
  double sum = 0;
  for (int c = 0; c < 3; ++c) {
    const double light = LinearFromDisplay(std::min(pair.render[c], 1.0)) * std::exp(log_light[c]);
    const double difference = std::min(DisplayFromLinear(light), 1.0) - pair.photo[c];
    sum += difference * difference;
  }
  return sum;
}

LightField FieldOf(const PhotoLight& light) {
  LightField field;
  field << light.gain.array().log().matrix(), light.shading;
  return field;
}

// Sum of the squared differences of the photos' display values from their mean.
double SquaredContrast(const std::vector<std::vector<LightPair>>& pairs) {
  Eigen::Array3d sum = Eigen::Array3d::Zero(), squares = Eigen::Array3d::Zero();
  double count = 0;
  for (const auto& of_photo : pairs) {
    for (const LightPair& pair : of_photo) {
      sum += pair.photo.array();
      squares += pair.photo.array().square();
    }
    count += static_cast<double>(of_photo.size());
  }
  return count > 0 ? (squares - sum.square() / count).sum() : 0;
}

}  // namespace

LightField FitLightField(const std::vector<LightPair>& pairs, int degree, int half) {
  struct Observation {
    Terms terms;
    Eigen::Vector3d log_ratio;
    // Change of the display value over change of the logarithm of the light.
    Eigen::Vector3d slope;
  };
  std::vector<Observation> observations;
  for (const LightPair& pair : pairs) {
    if ((half >= 0 && pair.half != half) || !IsUsable(pair)) continue;
    observations.push_back({TermsAt(pair.place), LogRatio(pair), pair.photo / 2.4});
  }
  const int count = NumTerms(degree);
  LightField field = LightField::Zero();
  for (int step = 0; step < kReweightings; ++step) {
    Eigen::MatrixXd normal = kPriorWeight * Eigen::MatrixXd::Identity(count, count);
    Eigen::MatrixXd right = Eigen::MatrixXd::Zero(count, 3);
    for (const Observation& seen : observations) {
      const Eigen::Vector3d residual =
          seen.slope.cwiseProduct(seen.log_ratio - field * seen.terms) / kResidualScale;
      // One weight for all channels: what is not light disturbs all of them.
      const double weight = (2.4 * seen.slope).squaredNorm() / 3 / (1 + residual.squaredNorm() / 3);
      normal.noalias() += weight * seen.terms.head(count) * seen.terms.head(count).transpose();
      right.noalias() += weight * seen.terms.head(count) * seen.log_ratio.transpose();
    }
    field.leftCols(count) = normal.ldlt().solve(right).transpose();
  }
  return field;
}

LightRefiner::LightRefiner(TrainingScene* scene, std::vector<PhotoLight> lights, EffectSwitch mode)
    : scene_(scene),
      mode_(mode),
      knows_held_out_(!lights.empty()),
      training_views_(SelectViews(*scene, false)),
      lights_(std::move(lights)) {}

std::vector<LightPair> LightRefiner::PairsOf(const ComparedView& compared) const {
  const int view = compared.view;
  std::vector<LightPair> pairs;
  pairs.reserve(compared.photo.size());
  for (size_t i = 0; i < compared.photo.size(); ++i) {
    if (compared.rendered[i].opacity < kLeastOpacity) continue;
    LightPair pair;
    pair.place = PlaceInPhoto(
        {compared.X(i) + 0.5, compared.Y(i) + 0.5}, scene_->Width(view), scene_->Height(view));
    pair.photo = compared.photo[i].cast<double>();
    pair.render = compared.rendered[i].color.cast<double>();
    const int column = static_cast<int>(i) % compared.columns;
    const int row = static_cast<int>(i) / compared.columns;
    pair.half = (column / kBlockEdge + row / kBlockEdge) % 2;
    if (!lights_.empty()) {
      // The falloff stays: it is the lens', the same in all its photos.
      PhotoLight lens;
      lens.falloff = lights_[view].falloff;
      const Eigen::Vector3d falloff = LightAt(lens, pair.place);
      for (int c = 0; c < 3; ++c) {
        const double light = LinearFromDisplay(std::max(pair.render[c], 0.0)) * falloff[c];
        pair.render[c] = DisplayFromLinear(light);
      }
    }
    pairs.push_back(pair);
  }
  return pairs;
}

void LightRefiner::Decide(const std::vector<std::vector<LightPair>>& pairs) {
  // [degree + 1] Sums over the photos, each fitted to one half and compared on the other; first
  // without a change of the light.
  constexpr int kChoices = kMaxLightDegree + 2;
  std::vector<std::array<double, kChoices>> errors(pairs.size());
  ParallelForBlocks(static_cast<int64_t>(pairs.size()), 1, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) {
      errors[i].fill(0);
      const LightField before =
          lights_.empty() ? LightField(LightField::Zero()) : FieldOf(lights_[training_views_[i]]);
      for (int choice = 0; choice < kChoices; ++choice) {
        LightField fields[2] = {before, before};
        for (int half = 0; half < 2 && choice > 0; ++half) {
          fields[half] = FitLightField(pairs[i], choice - 1, half);
        }
        for (const LightPair& pair : pairs[i]) {
          errors[i][choice] += SquaredErrorOf(pair, fields[1 - pair.half]);
        }
      }
    }
  });
  std::array<double, kChoices> sums = {};
  for (const auto& of_photo : errors) {
    for (int choice = 0; choice < kChoices; ++choice) sums[choice] += of_photo[choice];
  }
  if (mode_ != EffectSwitch::kOn && sums[0] > (1 - kLeastContrast) * SquaredContrast(pairs)) return;
  int chosen = 1;
  for (int choice = 2; choice < kChoices; ++choice) {
    if (sums[choice] < (1 - kLeastDegreeGain) * sums[chosen]) chosen = choice;
  }
  explained_ = sums[0] > 0 ? 1 - sums[chosen] / sums[0] : 0;
  const bool pays = explained_ >= kLeastLightGain;
  degree_ = pays || mode_ == EffectSwitch::kOn ? chosen - 1 : -1;
  decided_ = true;
}

void LightRefiner::Refine(const std::vector<ComparedView>& views) {
  if (!IsLooking() || training_views_.empty()) return;
  CHECK_EQ(views.size(), training_views_.size());
  std::vector<std::vector<LightPair>> pairs;
  pairs.reserve(views.size());
  for (const ComparedView& compared : views) pairs.push_back(PairsOf(compared));
  if (!decided_) Decide(pairs);
  if (degree_ < 0) return;
  std::vector<LightField> fields(pairs.size());
  ParallelForBlocks(static_cast<int64_t>(pairs.size()), 1, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) fields[i] = FitLightField(pairs[i], degree_, -1);
  });
  LightField mean = LightField::Zero();
  for (const LightField& field : fields) mean += field;
  mean /= static_cast<double>(fields.size());
  lights_.resize(scene_->NumViews());
  for (size_t i = 0; i < fields.size(); ++i) {
    const LightField field = fields[i] - mean;
    PhotoLight& light = lights_[training_views_[i]];
    light.gain = field.col(0).array().exp();
    light.shading = field.rightCols<kNumShadingTerms>();
  }
  if (!knows_held_out_) {
    const ExpectedLights expected(scene_->Photos(), scene_->Plan().lenses, lights_);
    for (int view = 0; view < scene_->NumViews(); ++view) lights_[view] = expected.OfPhoto(view);
  }
  scene_->SetLights(lights_);
}

void LightRefiner::Restore() {
  if (degree_ >= 0) scene_->SetLights(lights_);
}

double LightRefiner::GainSpread() const {
  double sum = 0;
  for (const int view : training_views_) {
    if (!lights_.empty()) sum += lights_[view].gain.array().log().square().mean();
  }
  return training_views_.empty() ? 0 : std::sqrt(sum / static_cast<double>(training_views_.size()));
}

double LightRefiner::ShadingSpread() const {
  // Over the photo, on a grid of places.
  constexpr int kEdge = 8;
  double sum = 0;
  int64_t count = 0;
  for (const int view : training_views_) {
    if (lights_.empty()) break;
    for (int i = 0; i < kEdge * kEdge; ++i) {
      const int width = scene_->Width(view), height = scene_->Height(view);
      const Eigen::Vector2d pixel((i % kEdge + 0.5) * width / kEdge,
                                  (i / kEdge + 0.5) * height / kEdge);
      const Eigen::Vector3d log_light =
          lights_[view].shading * ShadingTerms(PlaceInPhoto(pixel, width, height));
      sum += log_light.squaredNorm() / 3;
      ++count;
    }
  }
  return count == 0 ? 0 : std::sqrt(sum / static_cast<double>(count));
}

Effect LightRefiner::MakeEffect() const {
  Effect effect;
  effect.name = "shading";
  effect.on = IsOn();
  effect.by_option = mode_ != EffectSwitch::kAuto;
  effect.evidence = decided_ ? Report() : "not looked for";
  if (decided_) effect.measures["explained"] = explained_;
  if (IsOn()) {
    effect.measures["degree"] = degree_;
    effect.measures["spread"] = GainSpread();
    effect.measures["shading"] = ShadingSpread();
  }
  effect.cost = "160 bytes a photo, 0.1 us a ray";
  return effect;
}

std::string LightRefiner::Report() const {
  char text[256];
  if (!IsOn()) {
    std::snprintf(
        text,
        sizeof(text),
        "Light of the photos stays as it is: a field of gains for each photo would explain "
        "%.1f %% of the squared error on held-back pixels",
        100 * std::max(0.0, explained_));
  } else {
    std::snprintf(
        text,
        sizeof(text),
        "Light of the photos: a field of gains of degree %d for each photo explains %.1f %% "
        "of the squared error on held-back pixels; gains spread by %.1f %%, fields by %.1f "
        "%% within photos",
        degree_,
        100 * explained_,
        100 * GainSpread(),
        100 * ShadingSpread());
  }
  return text;
}

}  // namespace semfoam
