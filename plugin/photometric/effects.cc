// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/photometric/effects.h"

#include "foam/image/srgb.h"
#include "foam/model/foam.h"
#include "plugin/photometric/light_fit.h"
#include "plugin/photometric/photo_blur.h"
#include "plugin/photometric/view_dependence.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <optional>
#include <tuple>
#include <utility>

#include <glog/logging.h>

namespace semfoam {
namespace {

constexpr double kLeastGainSpread = 0.01;
constexpr double kLeastColorSpread = 0.01;
constexpr double kLeastFalloff = 0.03;  // of the corners' light
constexpr double kLeastViewDependence = 0.01;
constexpr double kHalfwayOut = 0.5;           // squared radius of what is half-way to the corners
constexpr double kLeastShareOutside = 0.02;   // of the observations, farther out than that
constexpr double kLeastShareOfQuarter = 0.5;  // of the mean falloff over the quarters
constexpr double kMostShading = 0.5;          // planes over photos, as a share of the effect
constexpr size_t kFewestSamples = 100;
constexpr size_t kFewestPhotos = 3;  // of a point
constexpr uint8_t kDarkest = 8;      // display values beyond these two are cut off or mostly noise
constexpr uint8_t kBrightest = 250;

template <typename... Values>
std::string Format(const char* format, Values... values) {
  char text[256];
  std::snprintf(text, sizeof(text), format, values...);
  return text;
}

// The logarithm of the mean light of the pixels around a place; false where a value is cut off.
bool LogLight(const PhotoSurvey::Patch& patch, Eigen::Vector3d* log_light) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (size_t i = 0; i < patch.size(); ++i) {
    if (patch[i] <= kDarkest || patch[i] >= kBrightest) return false;
    sum[i % 3] += LinearFromDisplay(patch[i] / 255.0);
  }
  *log_light = (sum / 9).array().log();
  return true;
}

struct Samples {
  LightSamples training;              // of points that three training photos or more show
  std::vector<LightSample> held_out;  // of the same points
};

Samples CollectSamples(const TrainingScene& scene) {
  const ScenePlan& plan = scene.Plan();
  std::vector<Eigen::Vector3d> centers;
  centers.reserve(plan.photos.size());
  for (const PhotoRecord& photo : plan.photos) centers.push_back(PoseOf(photo).Center());
  Samples samples;
  samples.training.num_views = scene.NumViews();
  std::vector<size_t> next_patch(plan.photos.size(), 0);
  samples.training.num_lenses = 1 + *std::max_element(plan.lenses.begin(), plan.lenses.end());
  for (const Track& track : plan.tracks) {
    std::vector<LightSample> training, held_out;
    for (const PixelObservation& seen : track.observations) {
      LightSample sample;
      const std::optional<PhotoSurvey::Patch>& patch =
          scene.Survey(seen.view).patches.at(next_patch[seen.view]++);
      const int width = scene.Width(seen.view), height = scene.Height(seen.view);
      const Eigen::Vector3d offset = track.position - centers[seen.view];
      if (offset.isZero(0) || !patch || !LogLight(*patch, &sample.log_light)) continue;
      sample.point = samples.training.num_points;
      sample.view = seen.view;
      sample.lens = plan.lenses[seen.view];
      sample.squared_radius = PlaceInPhoto(seen.pixel, width, height).squaredNorm();
      sample.quarter = (2 * seen.pixel.x() > width ? 1 : 0) + (2 * seen.pixel.y() > height ? 2 : 0);
      sample.place = seen.pixel / width;
      sample.direction = offset.normalized();
      (scene.IsHeldOut(seen.view) ? held_out : training).push_back(sample);
    }
    if (training.size() < kFewestPhotos) continue;
    ++samples.training.num_points;
    samples.training.all.insert(samples.training.all.end(), training.begin(), training.end());
    samples.held_out.insert(samples.held_out.end(), held_out.begin(), held_out.end());
  }
  return samples;
}

// All models of the camera's effects, by Choice::gains and Choice::falloff.
using Fits = std::array<std::array<LightFit, 2>, 3>;

struct Choice {
  int gains = 0;  // 0: none, 1: exposure, 2: and white balance
  int falloff = 0;
};

LightModel ModelOf(Choice choice, bool planes) {
  return {choice.gains, choice.falloff != 0, planes};
}

bool IsSeen(const LightFit& fit, Choice choice, Choice least) {
  if (choice.gains > 0 && least.gains == 0 && fit.GainSpread() < kLeastGainSpread) return false;
  if (choice.gains > 1 && least.gains < 2 && fit.ColorSpread() < kLeastColorSpread) return false;
  return choice.falloff == 0 || least.falloff != 0 || fit.CornerLight() <= 1 - kLeastFalloff;
}

// What the options leave to choose from.
struct Range {
  Choice least, most;
};

Range RangeOf(const EffectsOptions& options) {
  Range range;
  if (options.white_balance == EffectSwitch::kOn) {
    range.least.gains = 2;
  } else if (options.exposure == EffectSwitch::kOn) {
    range.least.gains = 1;
  }
  range.most.gains = options.white_balance == EffectSwitch::kOff ? 1 : 2;
  if (options.exposure == EffectSwitch::kOff) range.most.gains = 0;
  range.most.gains = std::max(range.least.gains, range.most.gains);
  range.least.falloff = options.vignetting == EffectSwitch::kOn ? 1 : 0;
  range.most.falloff = options.vignetting == EffectSwitch::kOff ? 0 : 1;
  return range;
}

Choice LowestBic(const Fits& fits, const Range& range) {
  Choice best = range.least;
  for (int gains = range.least.gains; gains <= range.most.gains; ++gains) {
    for (int falloff = range.least.falloff; falloff <= range.most.falloff; ++falloff) {
      const Choice choice = {gains, falloff};
      const LightFit& fit = fits[gains][falloff];
      if (IsSeen(fit, choice, range.least) && fit.bic < fits[best.gains][best.falloff].bic) {
        best = choice;
      }
    }
  }
  return best;
}

// Returns the share of the observations farther out than half-way to the corners. A thing in the
// middle of its photos has none there: a falloff would be its own light and shadow, carried on to
// the corners.
double ShareOutside(const std::vector<LightSample>& samples) {
  const auto outside = std::count_if(samples.begin(), samples.end(), [](const LightSample& sample) {
    return sample.squared_radius > kHalfwayOut;
  });
  return static_cast<double>(outside) / static_cast<double>(samples.size());
}

// [quarters] Light half-way to the corners over light in the middle.
using QuarterLights = std::array<double, 4>;

// Fits one falloff to each quarter of the photos, of all lenses.
QuarterLights FitQuarters(const LightSamples& samples, int gains) {
  LightSamples quarters = samples;
  quarters.num_lenses = std::tuple_size_v<QuarterLights>;
  for (LightSample& sample : quarters.all) sample.lens = sample.quarter;
  const LightFit fit = FitLight(quarters, ModelOf({gains, 1}, false), nullptr);
  QuarterLights lights;
  for (size_t q = 0; q < lights.size(); ++q) {
    const Eigen::Vector2d& falloff = fit.falloff[q];
    lights[q] = std::exp(kHalfwayOut * (falloff[0] + kHalfwayOut * falloff[1]));
  }
  return lights;
}

// Returns whether all quarters are darkened about as much as their mean is, as by a lens.
bool IsOfLens(const QuarterLights& lights) {
  double mean = 0;
  for (const double light : lights) mean += std::log(light) / static_cast<double>(lights.size());
  const double brightest = *std::max_element(lights.begin(), lights.end());
  return std::log(brightest) <= kLeastShareOfQuarter * mean && mean < 0;
}

// What the light of the scene, rather than the camera, does to the photos.
struct Shading {
  double spread = 0;  // of the planes over the photos; 0 where they do not pay
  bool explains_gains = false;
  bool explains_falloff = false;
};

// Effects that the user switched on are not in question. Gains that are shading leave no falloff
// that could be told from it.
Shading FindShading(const LightSamples& samples, const Fits& fits, Choice choice, Choice least) {
  const bool asks_gains = choice.gains > least.gains;
  const bool asks_falloff = choice.falloff > least.falloff;
  Shading shading;
  if (!asks_gains && !asks_falloff) return shading;
  const LightFit& without = fits[choice.gains][choice.falloff];
  const LightFit planes = FitLight(samples, ModelOf(choice, true), &without);
  if (planes.bic >= without.bic) return shading;
  shading.spread = planes.PlaneSpread(samples.all);
  const auto explains = [&](double effect) { return shading.spread > kMostShading * effect; };
  shading.explains_gains = asks_gains && explains(without.GainSpread());
  shading.explains_falloff =
      asks_falloff && (shading.explains_gains || explains(without.FalloffSpread(samples.all)));
  return shading;
}

Effect MakeEffect(const std::string& name, bool on, EffectSwitch option, std::string cost) {
  return {name, on, option != EffectSwitch::kAuto, "", {}, std::move(cost)};
}

std::string CostOfLight() {
  return Format("%d bytes a photo, 0.06 us a ray", static_cast<int>(sizeof(PhotoLight)));
}

std::string BicText(double gain) {
  return Format("BIC %s by %.0f", gain > 0 ? "better" : "worse", std::abs(gain));
}

void AddShading(const Shading& shading, Effect* effect) {
  effect->measures["shading"] = shading.spread;
  effect->evidence += Format("; but light moves, %.1f %% within photos", 100 * shading.spread);
}

Effect ExposureEffect(const Fits& fits,
                      Choice choice,
                      const Shading& shading,
                      const EffectsOptions& options) {
  Effect effect =
      MakeEffect("exposure",
                 choice.gains > 0,
                 options.white_balance == EffectSwitch::kOn ? EffectSwitch::kOn : options.exposure,
                 CostOfLight());
  // Colours alone can also pay; where one gain and three both would, the better one speaks.
  const LightFit& none = fits[0][choice.falloff];
  const LightFit& gains = fits[2][choice.falloff].bic < fits[1][choice.falloff].bic &&
                                  options.white_balance != EffectSwitch::kOff
                              ? fits[2][choice.falloff]
                              : fits[1][choice.falloff];
  effect.measures = {{"spread", gains.GainSpread()}, {"bic_gain", none.bic - gains.bic}};
  effect.evidence =
      Format("gains spread by %.1f %%, ", 100 * gains.GainSpread()) + BicText(none.bic - gains.bic);
  if (shading.explains_gains) AddShading(shading, &effect);
  return effect;
}

Effect WhiteBalanceEffect(const Fits& fits, Choice choice, const EffectsOptions& options) {
  Effect effect = MakeEffect(
      "white_balance",
      choice.gains > 1,
      options.exposure == EffectSwitch::kOff && options.white_balance == EffectSwitch::kAuto
          ? EffectSwitch::kOff
          : options.white_balance,
      "none beside exposure");
  const LightFit& grey = fits[1][choice.falloff];
  const LightFit& colored = fits[2][choice.falloff];
  effect.measures = {{"spread", colored.ColorSpread()}, {"bic_gain", grey.bic - colored.bic}};
  effect.evidence = Format("colours spread by %.1f %%, ", 100 * colored.ColorSpread()) +
                    BicText(grey.bic - colored.bic);
  return effect;
}

std::string ChangeText(double light) {
  return Format("%.1f %% %s", 100 * std::abs(light - 1), light < 1 ? "darker" : "brighter");
}

// `quarters`: where they are not of a lens.
Effect VignettingEffect(const Fits& fits,
                        Choice choice,
                        const Shading& shading,
                        double share_outside,
                        const std::optional<QuarterLights>& quarters,
                        const EffectsOptions& options) {
  Effect effect = MakeEffect("vignetting", choice.falloff != 0, options.vignetting, CostOfLight());
  effect.measures["share_outside"] = share_outside;
  if (!effect.on && share_outside < kLeastShareOutside) {
    effect.evidence =
        Format("%.1f %% of the observations are more than half-way to the corners, too few to tell",
               100 * share_outside);
    return effect;
  }
  const LightFit& flat = fits[choice.gains][0];
  const LightFit& vignetted = fits[choice.gains][1];
  effect.measures["corner_light"] = vignetted.CornerLight();
  effect.measures["bic_gain"] = flat.bic - vignetted.bic;
  effect.evidence =
      "corners " + ChangeText(vignetted.CornerLight()) + ", " + BicText(flat.bic - vignetted.bic);
  if (shading.explains_falloff) AddShading(shading, &effect);
  if (quarters) {
    const auto [darkest, brightest] = std::minmax_element(quarters->begin(), quarters->end());
    effect.measures["darkest_quarter_light"] = *darkest;
    effect.measures["brightest_quarter_light"] = *brightest;
    effect.evidence += "; but from " + ChangeText(*brightest) + " to " + ChangeText(*darkest) +
                       " in quarters of the photos, half-way to the corners";
  }
  return effect;
}

Effect ShDegreeEffect(const std::vector<ViewDependence>& degrees,
                      const EffectsOptions& options,
                      int* sh_degree) {
  int found = 0;
  std::string spreads, bics;
  Effect effect;
  for (const ViewDependence& degree : degrees) {
    const bool pays = degree.bic_gain > 0 && degree.spread >= kLeastViewDependence;
    if (pays && found == degree.degree - 1) found = degree.degree;
    const std::string name = "degree_" + std::to_string(degree.degree);
    effect.measures[name + "_spread"] = degree.spread;
    effect.measures[name + "_bic_gain"] = degree.bic_gain;
    const char* separator = spreads.empty() ? "" : ", ";
    spreads += Format("%s%.1f %%", separator, 100 * degree.spread);
    bics += Format("%s%+.0f", separator, degree.bic_gain);
  }
  const bool known = !degrees.empty();
  const int called_for = found > 0 ? found + 1 : 0;
  *sh_degree = options.fixed_sh_degree || !known ? options.sh_degree
                                                 : std::min(called_for, options.sh_degree);
  effect.name = "sh_degree";
  effect.on = *sh_degree > 0;
  effect.by_option = options.fixed_sh_degree;
  effect.measures["degree"] = *sh_degree;
  effect.evidence =
      known ? "degrees 1 to 3 make " + spreads + ", BIC " + bics : "too few tracks to tell";
  effect.cost = Format("%d bytes a site", 12 * (NumShCoefficients(*sh_degree) - 1));
  return effect;
}

Effect BlurEffect(const TrainingScene& scene, const PhotoBlur& blur, bool enabled) {
  Effect effect;
  effect.name = "blur";
  effect.on = enabled && !blur.blurred.empty();
  effect.by_option = !enabled;
  effect.evidence = blur.Report(scene);
  effect.measures["photos"] = static_cast<double>(blur.blurred.size());
  effect.cost = Format("their pixels are drawn %d times less", kPassesOfBlurred);
  return effect;
}

Effect DistortionEffect(const ScenePlan& plan, const EffectsOptions& options) {
  const bool on = plan.distortion > 0 && options.distortion != EffectSwitch::kOff &&
                  (options.distortion == EffectSwitch::kOn || plan.distortion >= kLeastDistortion);
  Effect effect =
      MakeEffect("distortion", on, options.distortion, "12 bytes a pixel of each camera");
  effect.evidence = std::isfinite(plan.distortion)
                        ? Format("corners move by %.2f pixels", plan.distortion)
                        : "corners that no pinhole camera sees";
  if (std::isfinite(plan.distortion)) effect.measures["pixels"] = plan.distortion;
  return effect;
}

Effect SemanticsEffect(const ScenePlan& plan, const EffectsOptions& options) {
  Effect effect;
  effect.name = "semantics";
  effect.on = plan.masks.NumPaired() > 0;
  effect.by_option = !options.semantics;
  effect.measures["masks"] = plan.masks.NumPaired();
  effect.evidence = options.semantics ? Format("%d of %d photos have a mask",
                                               plan.masks.NumPaired(),
                                               static_cast<int>(plan.photos.size()))
                                      : "masks were not looked for";
  effect.cost = Format("%d bytes a site, classifier, total variation",
                       kIdentityDim * static_cast<int>(sizeof(float)));
  return effect;
}

Effect BackgroundEffect(const TrainingScene& scene) {
  int64_t pixels = 0;
  int64_t white = 0;
  for (int view = 0; view < scene.NumViews(); ++view) {
    if (scene.IsHeldOut(view)) continue;
    pixels += scene.Survey(view).border_pixels;
    white += scene.Survey(view).white_border_pixels;
  }
  Effect effect;
  effect.name = "background";
  effect.measures["white_border"] = static_cast<double>(white) / static_cast<double>(pixels);
  effect.evidence = Format("%.0f %% of the photos' borders are white; rays that leave see white",
                           100 * effect.measures["white_border"]);
  effect.cost = "nothing but white is simulated";
  return effect;
}

}  // namespace

const Effect& SceneEffects::Find(const std::string& name) const {
  const auto found = std::find_if(
      effects.begin(), effects.end(), [&](const Effect& effect) { return effect.name == name; });
  CHECK(found != effects.end()) << name;
  return *found;
}

SceneEffects ProbeEffects(const TrainingScene& scene, const EffectsOptions& options) {
  const ScenePlan& plan = scene.Plan();
  const Samples samples = CollectSamples(scene);
  Range range = RangeOf(options);
  SceneEffects result;
  result.lenses = plan.lenses;
  if (samples.training.all.size() < kFewestSamples) {
    for (const auto& [name, option] : {std::pair("exposure", options.exposure),
                                       std::pair("white_balance", options.white_balance),
                                       std::pair("vignetting", options.vignetting)}) {
      Effect effect = MakeEffect(name, false, option, "nothing to fit it to");
      effect.evidence =
          Format("%d observations, too few to tell", static_cast<int>(samples.training.all.size()));
      result.effects.push_back(effect);
    }
  } else {
    Fits fits;
    for (int gains = 0; gains <= 2; ++gains) {
      for (int falloff = 0; falloff <= 1; ++falloff) {
        const LightFit* simpler = falloff > 0 ? &fits[gains][0]
                                  : gains > 0 ? &fits[gains - 1][0]
                                              : nullptr;
        fits[gains][falloff] =
            FitLight(samples.training, ModelOf({gains, falloff}, false), simpler);
      }
    }
    const double share_outside = ShareOutside(samples.training.all);
    if (share_outside < kLeastShareOutside) range.most.falloff = range.least.falloff;
    Choice camera = LowestBic(fits, range);
    std::optional<QuarterLights> quarters;
    if (camera.falloff > range.least.falloff) {
      quarters = FitQuarters(samples.training, camera.gains);
      if (IsOfLens(*quarters)) {
        quarters.reset();
      } else {
        range.most.falloff = range.least.falloff;
        camera = LowestBic(fits, range);
      }
    }
    const Shading shading = FindShading(samples.training, fits, camera, range.least);
    const Choice choice = {shading.explains_gains ? range.least.gains : camera.gains,
                           shading.explains_falloff ? range.least.falloff : camera.falloff};
    const LightFit& chosen = fits[choice.gains][choice.falloff];
    result.effects = {ExposureEffect(fits, choice, shading, options),
                      WhiteBalanceEffect(fits, choice, options),
                      VignettingEffect(fits, choice, shading, share_outside, quarters, options)};
    if (choice.gains > 0 || choice.falloff > 0) {
      result.lights = chosen.Lights(plan.lenses, samples.held_out);
    }
    result.view_dependence = FitViewDependence(samples.training.all, chosen);
  }
  result.effects.push_back(ShDegreeEffect(result.view_dependence, options, &result.sh_degree));
  const PhotoBlur blur = FindBlurredPhotos(scene);
  if (options.blur) result.passes_per_draw = blur.PassesPerDraw();
  result.effects.push_back(BlurEffect(scene, blur, options.blur));
  result.effects.push_back(DistortionEffect(plan, options));
  result.effects.push_back(SemanticsEffect(plan, options));
  result.effects.push_back(BackgroundEffect(scene));
  return result;
}

void ChooseShDegree(const EffectsOptions& options, SceneEffects* effects) {
  for (Effect& effect : effects->effects) {
    if (effect.name != "sh_degree") continue;
    effect = ShDegreeEffect(effects->view_dependence, options, &effects->sh_degree);
  }
}

}  // namespace semfoam
