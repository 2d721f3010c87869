// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/photo/photo_survey.h"

#include "plugin/photo/patch_contrast.h"

#include <algorithm>

namespace semfoam {
namespace {

constexpr uint8_t kWhite = 250;

std::optional<PhotoSurvey::Patch> PatchAt(const Image8& photo, const Eigen::Vector2d& place) {
  const bool inside = place.x() >= 1 && place.y() >= 1 && place.x() < photo.width - 1 &&
                      place.y() < photo.height - 1;
  if (!inside) return std::nullopt;  // not numbers, too
  const int x = static_cast<int>(place.x());
  const int y = static_cast<int>(place.y());
  PhotoSurvey::Patch patch;
  for (int row = 0; row < 3; ++row) {
    const size_t first = static_cast<size_t>(y - 1 + row) * photo.width + x - 1;
    std::copy_n(photo.data.data() + 3 * first, 9, patch.data() + 9 * row);
  }
  return patch;
}

}  // namespace

PhotoSurvey SurveyPhoto(const Image8& photo, const std::vector<SurveyPlace>& places) {
  PhotoSurvey survey;
  for (const SurveyPlace& place : places) {
    survey.patches.push_back(PatchAt(photo, place.pixel));
    survey.contrasts.push_back(PatchContrast(photo, place.pixel, place.spacing));
  }
  const auto look = [&](int x, int y) {
    const uint8_t* rgb = photo.data.data() + 3 * (static_cast<size_t>(y) * photo.width + x);
    ++survey.border_pixels;
    survey.white_border_pixels += rgb[0] >= kWhite && rgb[1] >= kWhite && rgb[2] >= kWhite;
  };
  for (int x = 0; x < photo.width; ++x) {
    look(x, 0);
    look(x, photo.height - 1);
  }
  for (int y = 1; y + 1 < photo.height; ++y) {
    look(0, y);
    look(photo.width - 1, y);
  }
  return survey;
}

}  // namespace semfoam
