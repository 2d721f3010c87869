// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/image/srgb.h"
#include "foam/util/random.h"
#include "plugin/colmap/colmap_model.h"
#include "plugin/photo/photo.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "tests/plugin/test_util.h"
#include <Eigen/Core>

namespace semfoam {

// What a camera on automatic does to the photos of a set, put in by us: so it is known.
struct CameraHabits {
  double exposure = 0;            // standard deviation of the log gains
  double white_balance = 0;       // of the channels around them
  double falloff = 0;             // light lost in the corners, as a share: 1 - falloff r^2
  bool is_falloff_below = false;  // not the camera's: whether the lower half alone loses light
  double shading = 0;  // not the camera's: standard deviation of the log light's slopes, over
                       // the width of a photo, that a lamp makes which moves with it
  double tone = 0;     // of a second camera, which takes every other photo: its contrast is more by
                       // this share, its saturation by as much again
  std::vector<int> passed_by = {};  // not the camera's: numbers of the photos, in the order of
                                    // names, in which something passes by (PaintPasserBy)
  std::vector<int> shaken = {};     // numbers of the photos that are blurred (BlurByMotion)
  uint64_t seed = 0;
};

// Blurs the photo as a camera does that turns by 1/30 of its width during the exposure.
inline void BlurByMotion(double angle, Image8* photo) {
  const int reach = std::max(1, photo->width / 60);
  const Image8 sharp = *photo;
  for (int y = 0; y < photo->height; ++y) {
    for (int x = 0; x < photo->width; ++x) {
      int sum[3] = {0, 0, 0};
      for (int step = -reach; step <= reach; ++step) {
        const int u = x + static_cast<int>(std::lround(step * std::cos(angle)));
        const int v = y + static_cast<int>(std::lround(step * std::sin(angle)));
        const size_t at = static_cast<size_t>(std::clamp(v, 0, photo->height - 1)) * photo->width +
                          std::clamp(u, 0, photo->width - 1);
        for (int c = 0; c < 3; ++c) sum[c] += sharp.data[3 * at + c];
      }
      uint8_t* rgb = &photo->data[3 * (static_cast<size_t>(y) * photo->width + x)];
      for (int c = 0; c < 3; ++c) rgb[c] = static_cast<uint8_t>(sum[c] / (2 * reach + 1));
    }
  }
}

// Whether something that passes by covers a pixel: a disc on an arm that comes from below.
inline bool IsOfPasserBy(int x, int y, int width, int height) {
  const float u = (x + 0.5f) / width - 0.4f, v = (y + 0.5f) / height - 0.55f;
  return u * u + 0.6f * v * v < 0.015f || (std::abs(u) < 0.06f && v > 0);
}

// Paints it over the photo, with stripes.
inline void PaintPasserBy(Image8* photo) {
  for (int y = 0; y < photo->height; ++y) {
    for (int x = 0; x < photo->width; ++x) {
      if (!IsOfPasserBy(x, y, photo->width, photo->height)) continue;
      uint8_t* rgb = &photo->data[3 * (static_cast<size_t>(y) * photo->width + x)];
      const bool stripe = (x + 2 * y) * 20 / photo->width % 2 == 0;
      rgb[0] = stripe ? 20 : 60;
      rgb[1] = stripe ? 170 : 120;
      rgb[2] = 90;
    }
  }
}

// The gains of the photo of that number in the order of names.
inline Eigen::Vector3d DrawGain(const CameraHabits& habits, uint64_t number) {
  CounterRandom random(habits.seed, 0x6761696e, number);
  const double exposure = habits.exposure * random.Normal();
  Eigen::Vector3d log_gain;
  for (int c = 0; c < 3; ++c) log_gain[c] = exposure + habits.white_balance * random.Normal();
  return log_gain.array().exp();
}

// The slopes, likewise.
inline Eigen::Vector2d DrawSlopes(const CameraHabits& habits, uint64_t number) {
  CounterRandom random(habits.seed, 0x736c6f70, number);
  const double horizontal = habits.shading * random.Normal();
  return {horizontal, habits.shading * random.Normal()};
}

// The light as the second camera shows it.
inline Eigen::Vector3d SecondCamera(const CameraHabits& habits, const Eigen::Vector3d& light) {
  const double grey = std::max(light.mean(), 1e-6);
  const double contrast = 1 + habits.tone, saturation = contrast * (1 + habits.tone);
  return 0.18 * std::pow(grey / 0.18, contrast) *
         (light.cwiseMax(1e-6) / grey).array().pow(saturation);
}

// The photo as that camera would have taken it: in linear light, cut off at white, in 8 bits.
inline void ChangePhoto(const CameraHabits& habits,
                        const Eigen::Vector3d& gain,
                        const Eigen::Vector2d& slopes,
                        Image8* photo,
                        bool is_second_camera = false) {
  const Eigen::Vector2f half(0.5f * photo->width, 0.5f * photo->height);
  float light_of[256];
  for (int i = 0; i < 256; ++i) light_of[i] = LinearFromDisplay(i / 255.0f);
  for (int y = 0; y < photo->height; ++y) {
    for (int x = 0; x < photo->width; ++x) {
      const Eigen::Vector2f place = Eigen::Vector2f(x + 0.5f, y + 0.5f) - half;
      const double falloff = habits.is_falloff_below && place.y() < 0 ? 0 : habits.falloff;
      const float kept =
          (1 - static_cast<float>(falloff) * place.squaredNorm() / half.squaredNorm()) *
          std::exp(slopes.cast<float>().dot(place) / photo->width);
      uint8_t* rgb = &photo->data[3 * (static_cast<size_t>(y) * photo->width + x)];
      Eigen::Vector3f seen(light_of[rgb[0]], light_of[rgb[1]], light_of[rgb[2]]);
      if (is_second_camera) seen = SecondCamera(habits, seen.cast<double>()).cast<float>();
      for (int c = 0; c < 3; ++c) {
        const float light = std::min(1.0f, static_cast<float>(gain[c]) * kept * seen[c]);
        rgb[c] = static_cast<uint8_t>(std::lround(255 * DisplayFromLinear(light)));
      }
    }
  }
}

// A copy of a workspace whose photos, as PNG, are changed. Returns the gains, in the order of
// names.
inline std::vector<Eigen::Vector3d> WriteChangedWorkspace(const std::filesystem::path& source,
                                                          const std::filesystem::path& target,
                                                          const CameraHabits& habits) {
  namespace fs = std::filesystem;
  fs::create_directories(target);
  for (const char* part : {"object_mask", "labels.json", "segmentation_labels"}) {
    if (fs::exists(source / part)) {
      fs::copy(source / part, target / part, fs::copy_options::recursive);
    }
  }
  Reconstruction model = ReadReconstruction(source / "sparse/0");
  std::sort(model.images.begin(), model.images.end(), [](const Image& a, const Image& b) {
    return a.name < b.name;
  });
  Camera second = model.cameras.front();
  second.id += 1;
  if (habits.tone != 0) model.cameras.push_back(second);
  std::vector<Eigen::Vector3d> gains;
  for (Image& image : model.images) {
    gains.push_back(DrawGain(habits, gains.size()));
    Image8 photo = ReadPhoto(source / "images" / image.name);
    const int number = static_cast<int>(gains.size()) - 1;
    const bool is_second_camera = habits.tone != 0 && number % 2 == 1;
    if (is_second_camera) image.camera_id = second.id;
    ChangePhoto(habits, gains.back(), DrawSlopes(habits, number), &photo, is_second_camera);
    if (std::count(habits.passed_by.begin(), habits.passed_by.end(), number) > 0) {
      PaintPasserBy(&photo);
    }
    if (std::count(habits.shaken.begin(), habits.shaken.end(), number) > 0) {
      BlurByMotion(number, &photo);
    }
    image.name = fs::path(image.name).replace_extension(".png").generic_string();
    WritePng(target / "images" / image.name,
             photo.width,
             photo.height,
             8,
             PNG_COLOR_TYPE_RGB,
             photo.data);
  }
  WriteReconstruction(target / "sparse/0", model, ModelFormat::kBinary);
  return gains;
}

}  // namespace semfoam
