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
#include <map>
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
// About that of sRGB.
constexpr double kDisplayGamma = 2.4;
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

// Returns the weight of a pair whose log(photo / render) is off by `residual`, `slope` being the
// change of the photo's display value over that of its logarithm. One for all channels: what is not
// light disturbs all of them.
double WeightOf(const Eigen::Vector3d& slope, const Eigen::Vector3d& residual) {
  const double squares =
      slope.cwiseProduct(residual).squaredNorm() / (kResidualScale * kResidualScale);
  return (kDisplayGamma * slope).squaredNorm() / 3 / (1 + squares / 3);
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

// What FitTones sums up over the pairs of a photo: for the tone's difference D, the least squares
// of log(photo / lens's render under its field) = D x, x = log(render / kMidGrey), both around
// their means in the photo, since its gain takes these up.
struct ToneSums {
  // D = (normal^-1 right)^T
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d right = Eigen::Matrix3d::Zero();

  void Add(const ToneSums& other) {
    normal += other.normal;
    right += other.right;
  }
};

// `by_lens`: the same pairs as the lens shows them.
ToneSums SumsOf(const std::vector<LightPair>& pairs,
                const std::vector<LightPair>& by_lens,
                int degree,
                int half) {
  const LightField field = FitLightField(by_lens, degree, half);
  double weights = 0;
  Eigen::Vector3d mean_x = Eigen::Vector3d::Zero(), mean_y = Eigen::Vector3d::Zero();
  ToneSums sums;
  for (size_t i = 0; i < pairs.size(); ++i) {
    if ((half >= 0 && pairs[i].half != half) || !IsUsable(pairs[i]) || !IsUsable(by_lens[i])) {
      continue;
    }
    Eigen::Vector3d x;
    for (int c = 0; c < 3; ++c) {
      x[c] = std::log(LinearFromDisplay(pairs[i].render[c]) / kMidGrey);
    }
    const Eigen::Vector3d y = LogRatio(by_lens[i]) - field * TermsAt(pairs[i].place);
    const double weight = WeightOf(pairs[i].photo / kDisplayGamma, y);
    weights += weight;
    mean_x += weight * x;
    mean_y += weight * y;
    sums.normal += weight * x * x.transpose();
    sums.right += weight * x * y.transpose();
  }
  if (weights > 0) {
    sums.normal -= mean_x * mean_x.transpose() / weights;
    sums.right -= mean_x * mean_y.transpose() / weights;
  }
  return sums;
}

// Returns whether two lenses or more have enough photos for a tone.
bool HasSeveralLenses(const LensPairs& photos) {
  std::map<int, int> counts;
  for (const int lens : photos.lenses) ++counts[lens];
  int lenses = 0;
  for (const auto& [lens, count] : counts) lenses += count >= kFewestOfLens ? 1 : 0;
  return lenses >= 2;
}

PhotoLight LensOf(const Eigen::Vector2d& falloff, const Eigen::Matrix3d& tone) {
  PhotoLight lens;
  lens.falloff = falloff;
  lens.tone = tone;
  return lens;
}

// Returns the squared error on held-back pixels where each half has its own tones and fields.
double ErrorWithTones(const LensPairs& photos, int degree) {
  const auto count = static_cast<int64_t>(photos.pairs.size());
  double sum = 0;
  for (int half = 0; half < 2; ++half) {
    const std::vector<Eigen::Matrix3d> tones = FitTones(photos, degree, half);
    std::vector<double> errors(photos.pairs.size(), 0);
    ParallelForBlocks(count, 1, [&](int64_t begin, int64_t end) {
      for (int64_t i = begin; i < end; ++i) {
        const PhotoLight lens = LensOf(photos.falloffs[i], tones[i]);
        const std::vector<LightPair> pairs = WithLens(photos.pairs[i], lens);
        const LightField field = FitLightField(pairs, degree, half);
        for (const LightPair& pair : pairs) {
          if (pair.half != half) errors[i] += SquaredErrorOf(pair, field);
        }
      }
    });
    for (const double error : errors) sum += error;
  }
  return sum;
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
    observations.push_back({TermsAt(pair.place), LogRatio(pair), pair.photo / kDisplayGamma});
  }
  const int count = NumTerms(degree);
  LightField field = LightField::Zero();
  for (int step = 0; step < kReweightings; ++step) {
    Eigen::MatrixXd normal = kPriorWeight * Eigen::MatrixXd::Identity(count, count);
    Eigen::MatrixXd right = Eigen::MatrixXd::Zero(count, 3);
    for (const Observation& seen : observations) {
      const double weight = WeightOf(seen.slope, seen.log_ratio - field * seen.terms);
      normal.noalias() += weight * seen.terms.head(count) * seen.terms.head(count).transpose();
      right.noalias() += weight * seen.terms.head(count) * seen.log_ratio.transpose();
    }
    field.leftCols(count) = normal.ldlt().solve(right).transpose();
  }
  return field;
}

std::vector<LightPair> WithLens(std::vector<LightPair> pairs, const PhotoLight& lens) {
  if (lens.falloff.isZero(0) && lens.tone == Eigen::Matrix3d::Identity()) return pairs;
  PhotoLight falloff;
  falloff.falloff = lens.falloff;
  for (LightPair& pair : pairs) {
    Eigen::Vector3d light;
    for (int c = 0; c < 3; ++c) light[c] = LinearFromDisplay(std::max(pair.render[c], 0.0));
    light = Toned(light, lens.tone).cwiseProduct(LightAt(falloff, pair.place));
    for (int c = 0; c < 3; ++c) pair.render[c] = DisplayFromLinear(light[c]);
  }
  return pairs;
}

std::vector<Eigen::Matrix3d> FitTones(const LensPairs& photos, int degree, int half) {
  constexpr int kRounds = 3;
  // In pixels of full brightness whose light is e times mid-grey.
  constexpr double kTonePrior = 10;
  constexpr double kLargestTone = 0.4;
  const size_t count = photos.pairs.size();
  std::map<int, int> photos_of_lens;
  for (const int lens : photos.lenses) ++photos_of_lens[lens];
  std::vector<Eigen::Matrix3d> tones(count, Eigen::Matrix3d::Identity());
  for (int round = 0; round < kRounds; ++round) {
    std::vector<ToneSums> sums(count);
    ParallelForBlocks(static_cast<int64_t>(count), 1, [&](int64_t begin, int64_t end) {
      for (int64_t i = begin; i < end; ++i) {
        const PhotoLight lens = LensOf(photos.falloffs[i], tones[i]);
        sums[i] = SumsOf(photos.pairs[i], WithLens(photos.pairs[i], lens), degree, half);
      }
    });
    std::map<int, ToneSums> of_lens;
    for (size_t i = 0; i < count; ++i) of_lens[photos.lenses[i]].Add(sums[i]);
    Eigen::Matrix3d mean = Eigen::Matrix3d::Zero();
    for (size_t i = 0; i < count; ++i) {
      if (photos_of_lens[photos.lenses[i]] >= kFewestOfLens) {
        const ToneSums& sum = of_lens[photos.lenses[i]];
        const Eigen::Matrix3d normal = sum.normal + kTonePrior * Eigen::Matrix3d::Identity();
        tones[i] += normal.ldlt().solve(sum.right).transpose();
        // Can be undone, whatever it was fitted to.
        const Eigen::Matrix3d difference = tones[i] - Eigen::Matrix3d::Identity();
        tones[i] -= difference * (1 - std::min(1.0, kLargestTone / difference.norm()));
      }
      mean += tones[i] / static_cast<double>(count);
    }
    for (Eigen::Matrix3d& tone : tones) tone += Eigen::Matrix3d::Identity() - mean;
  }
  return tones;
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
    pairs.push_back(pair);
  }
  return pairs;
}

LensPairs LightRefiner::CollectPairs(const std::vector<ComparedView>& views) const {
  LensPairs photos;
  for (const ComparedView& compared : views) {
    photos.pairs.push_back(PairsOf(compared));
    photos.lenses.push_back(scene_->Plan().lenses[compared.view]);
    photos.falloffs.push_back(lights_.empty() ? Eigen::Vector2d(0, 0)
                                              : lights_[compared.view].falloff);
  }
  return photos;
}

void LightRefiner::Decide(const LensPairs& photos) {
  // [degree + 1] Sums over the photos, each fitted to one half and compared on the other; first
  // without a change of the light.
  constexpr int kChoices = kMaxLightDegree + 2;
  const auto count = static_cast<int64_t>(photos.pairs.size());
  std::vector<std::array<double, kChoices>> errors(photos.pairs.size());
  ParallelForBlocks(count, 1, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) {
      errors[i].fill(0);
      const PhotoLight lens = LensOf(photos.falloffs[i], Eigen::Matrix3d::Identity());
      const std::vector<LightPair> pairs = WithLens(photos.pairs[i], lens);
      const LightField before =
          lights_.empty() ? LightField(LightField::Zero()) : FieldOf(lights_[training_views_[i]]);
      for (int choice = 0; choice < kChoices; ++choice) {
        LightField fields[2] = {before, before};
        for (int half = 0; half < 2 && choice > 0; ++half) {
          fields[half] = FitLightField(pairs, choice - 1, half);
        }
        for (const LightPair& pair : pairs) {
          errors[i][choice] += SquaredErrorOf(pair, fields[1 - pair.half]);
        }
      }
    }
  });
  std::array<double, kChoices> sums = {};
  for (const auto& of_photo : errors) {
    for (int choice = 0; choice < kChoices; ++choice) sums[choice] += of_photo[choice];
  }
  if (mode_ != EffectSwitch::kOn &&
      sums[0] > (1 - kLeastContrast) * SquaredContrast(photos.pairs)) {
    return;
  }
  int chosen = 1;
  for (int choice = 2; choice < kChoices; ++choice) {
    if (sums[choice] < (1 - kLeastDegreeGain) * sums[chosen]) chosen = choice;
  }
  double least = sums[chosen];
  if (HasSeveralLenses(photos)) {
    const double with_tones = ErrorWithTones(photos, chosen - 1);
    has_tones_ = with_tones < (1 - kLeastToneGain) * least;
    if (has_tones_) least = with_tones;
  }
  explained_ = sums[0] > 0 ? 1 - least / sums[0] : 0;
  const bool pays = explained_ >= kLeastLightGain;
  degree_ = pays || mode_ == EffectSwitch::kOn ? chosen - 1 : -1;
  has_tones_ = has_tones_ && degree_ >= 0;
  decided_ = true;
}

void LightRefiner::Refine(const std::vector<ComparedView>& views) {
  if (!IsLooking() || training_views_.empty()) return;
  CHECK_EQ(views.size(), training_views_.size());
  const LensPairs photos = CollectPairs(views);
  if (!decided_) Decide(photos);
  if (degree_ < 0) return;
  std::vector<Eigen::Matrix3d> tones(photos.pairs.size(), Eigen::Matrix3d::Identity());
  if (has_tones_) tones = FitTones(photos, degree_, -1);
  std::vector<LightField> fields(photos.pairs.size());
  ParallelForBlocks(static_cast<int64_t>(fields.size()), 1, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) {
      const PhotoLight lens = LensOf(photos.falloffs[i], tones[i]);
      fields[i] = FitLightField(WithLens(photos.pairs[i], lens), degree_, -1);
    }
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
    light.tone = tones[i];
  }
  const ExpectedLights expected(scene_->Photos(), scene_->Plan().lenses, lights_);
  for (int view = 0; view < scene_->NumViews(); ++view) {
    if (!scene_->IsHeldOut(view)) continue;
    const PhotoLight light = expected.OfPhoto(view);
    if (knows_held_out_) {
      lights_[view].tone = light.tone;
    } else {
      lights_[view] = light;
    }
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
    effect.measures["tones"] = has_tones_ ? 1 : 0;
  }
  effect.cost = std::to_string(sizeof(PhotoLight)) + " bytes a photo, 0.1 us a ray";
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
        "%% within photos%s",
        degree_,
        100 * explained_,
        100 * GainSpread(),
        100 * ShadingSpread(),
        has_tones_ ? "; each lens has a tone of its own" : "");
  }
  return text;
}

}  // namespace semfoam
