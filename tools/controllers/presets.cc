// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/controllers/presets.h"

#include <cstdlib>

namespace semfoam {
namespace {

struct Preset {
  Quality quality;
  int64_t num_rays;
  int rays_per_iteration;
  int final_sites;
  int sh_degree;
  int densify_events;  // as many as make the sites grow by some 15 % each time, as the papers do
};

constexpr Preset kPresets[] = {
    {Quality::kLow, 12'000'000, 4096, 80'000, 2, 7},
    {Quality::kMedium, 72'000'000, 12288, 400'000, 2, 11},
    {Quality::kHigh, 190'000'000, 16384, 600'000, 2, 13},
    {Quality::kExtreme, 1'200'000'000, 32768, 1'000'000, 3, 15},
};

}  // namespace

TrainingOptions OptionsForQuality(Quality quality) {
  for (const Preset& preset : kPresets) {
    if (quality != preset.quality) continue;
    TrainingOptions options;
    options.num_rays = preset.num_rays;
    options.rays_per_iteration = preset.rays_per_iteration;
    options.final_sites = preset.final_sites;
    options.sh_degree = preset.sh_degree;
    options.densify_events = preset.densify_events;
    return options;
  }
  std::abort();  // no value of the enum
}

}  // namespace semfoam
