// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/colmap/reference_positions.h"

#include "foam/util/error.h"
#include "foam/util/input_file.h"
#include "foam/util/number_text.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <set>
#include <string_view>

namespace semfoam {
namespace {

constexpr std::string_view kSeparators = " \t\r,";

// WGS 84: the equatorial radius in metres, and the squared eccentricity.
constexpr double kEquator = 6378137;
constexpr double kFlattening = 1 / 298.257223563;
constexpr double kEccentricitySquared = kFlattening * (2 - kFlattening);

// Takes the last word off a line; empty where there is none.
std::string_view TakeLastWord(std::string_view* line) {
  const size_t last = line->find_last_not_of(kSeparators);
  if (last == std::string_view::npos) return {};
  const size_t before = line->find_last_of(kSeparators, last);
  const size_t begin = before == std::string_view::npos ? 0 : before + 1;
  const std::string_view word = line->substr(begin, last + 1 - begin);
  *line = line->substr(0, begin);
  return word;
}

std::optional<ImagePosition> ParsePosition(std::string_view line) {
  ImagePosition position;
  for (int axis = 2; axis >= 0; --axis) {
    double number = 0;
    if (!ParseNumber(std::string(TakeLastWord(&line)), &number) || !std::isfinite(number)) {
      return std::nullopt;
    }
    position.position[axis] = number;
  }
  const size_t last = line.find_last_not_of(kSeparators);
  if (last == std::string_view::npos) return std::nullopt;
  position.image = line.substr(0, last + 1);
  return position;
}

bool IsGeodetic(const Eigen::Vector3d& place) {
  return std::abs(place[0]) <= 90 && std::abs(place[1]) <= 360;
}

// Returns the place in the frame of the earth's centre (ECEF).
Eigen::Vector3d EarthCentered(double latitude, double longitude, double altitude) {
  const double sine = std::sin(latitude);
  const double normal = kEquator / std::sqrt(1 - kEccentricitySquared * sine * sine);
  return {(normal + altitude) * std::cos(latitude) * std::cos(longitude),
          (normal + altitude) * std::cos(latitude) * std::sin(longitude),
          (normal * (1 - kEccentricitySquared) + altitude) * sine};
}

}  // namespace

std::vector<ImagePosition> ReadReferencePositions(const std::filesystem::path& path, bool is_gps) {
  const std::string bytes = ReadFileBytes(path, "a text file of camera positions");
  std::string_view text = WithoutByteOrderMark(bytes);
  std::vector<ImagePosition> positions;
  std::set<std::string> images;
  for (int number = 1; !text.empty(); ++number) {
    const size_t end = std::min(text.find('\n'), text.size());
    std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    const size_t first = line.find_first_not_of(kSeparators);
    if (first == std::string_view::npos || line[first] == '#') continue;
    line.remove_prefix(first);
    const std::optional<ImagePosition> position = ParsePosition(line);
    if (!position || (is_gps && !IsGeodetic(position->position))) {
      throw UserError(path.string(),
                      ": line ",
                      number,
                      " is '",
                      Shortened(line),
                      "'; it must be the name of an image and its camera's ",
                      is_gps ? "latitude, longitude and altitude." : "x, y and z.");
    }
    if (!images.insert(position->image).second) {
      throw UserError(path.string(),
                      ": line ",
                      number,
                      " has a second position of '",
                      Shortened(position->image),
                      "'; each image must have one.");
    }
    positions.push_back(*position);
  }
  if (positions.empty()) {
    throw UserError(path.string(),
                    ": has no camera position; lines with the name of an image and its camera's ",
                    is_gps ? "latitude, longitude and altitude" : "x, y and z",
                    " would be right.");
  }
  if (is_gps) {
    const Eigen::Vector3d origin = positions.front().position;
    for (ImagePosition& position : positions) {
      position.position = EastNorthUp(position.position, origin);
    }
  }
  return positions;
}

Eigen::Vector3d EastNorthUp(const Eigen::Vector3d& place, const Eigen::Vector3d& origin) {
  constexpr double kDegree = std::numbers::pi / 180;
  const double latitude = origin[0] * kDegree, longitude = origin[1] * kDegree;
  const Eigen::Vector3d offset = EarthCentered(place[0] * kDegree, place[1] * kDegree, place[2]) -
                                 EarthCentered(latitude, longitude, origin[2]);
  const double sin_lat = std::sin(latitude), cos_lat = std::cos(latitude);
  const double sin_lon = std::sin(longitude), cos_lon = std::cos(longitude);
  Eigen::Matrix3d turn;
  turn << -sin_lon, cos_lon, 0,                         //
      -sin_lat * cos_lon, -sin_lat * sin_lon, cos_lat,  //
      cos_lat * cos_lon, cos_lat * sin_lon, sin_lat;
  return turn * offset;
}

}  // namespace semfoam
