// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/scene/export_transform.h"

#include "foam/util/error.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <glog/logging.h>
#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

constexpr double kMaxScale = 1e9;
// What six digits of a rotation's matrix leave of its orthonormality.
constexpr double kRotationTolerance = 1e-5;
// Below this the photos' upward unit vectors cancel out rather than agree.
constexpr double kMinAgreement = 0.2;

bool ScaleInRange(double scale) { return scale >= 1 / kMaxScale && scale <= kMaxScale; }

// Throws when the text is anything but finite numbers apart by spaces or commas.
std::vector<double> ParseNumbers(const std::string& text, const FieldError& error) {
  std::string spaced = text;
  std::replace(spaced.begin(), spaced.end(), ',', ' ');
  std::vector<double> numbers;
  const char* at = spaced.data();
  const char* const end = at + spaced.size();
  while (true) {
    while (at != end && *at == ' ') ++at;
    if (at == end) return numbers;
    if (*at == '+') ++at;
    double number;
    const auto [next, code] = std::from_chars(at, end, number);
    if (code != std::errc() || !std::isfinite(number) || (next != end && *next != ' ')) throw error;
    numbers.push_back(number);
    at = next;
  }
}

void SetSimilarity(const std::string& text, ExportTransform* transform) {
  const FieldError error("transform",
                         " is '",
                         text,
                         "'; it must be the 12 or 16 numbers, row by row, of a similarity's "
                         "matrix: a rotation times one scale, and a translation in the last "
                         "column.");
  const std::vector<double> numbers = ParseNumbers(text, error);
  if (numbers.size() != 12 && numbers.size() != 16) throw error;
  if (numbers.size() == 16 &&
      !std::equal(numbers.begin() + 12, numbers.end(), std::begin({0., 0., 0., 1.}))) {
    throw error;
  }
  const Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>> matrix(numbers.data());
  const Eigen::Matrix3d linear = matrix.leftCols<3>();
  // A mirror image has a negative determinant.
  const double scale = std::cbrt(linear.determinant());
  if (!ScaleInRange(scale)) throw error;
  Eigen::Matrix3d rotation = linear / scale;
  const double deviation =
      (rotation * rotation.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (deviation > kRotationTolerance) throw error;
  if (deviation > 0) {
    // The rotation nearest to what the user's digits say.
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(rotation,
                                                Eigen::ComputeFullU | Eigen::ComputeFullV);
    rotation = svd.matrixU() * svd.matrixV().transpose();
  }
  transform->scale = scale;
  transform->rotation = rotation;
  transform->translation = matrix.col(3);
}

}  // namespace

double ExportTransform::MetersPerUnit() const {
  switch (unit) {
    case LengthUnit::kMillimeter:
      return 0.001;
    case LengthUnit::kCentimeter:
      return 0.01;
    case LengthUnit::kKilometer:
      return 1000;
    case LengthUnit::kInch:
      return 0.0254;
    case LengthUnit::kFoot:
      return 0.3048;
    case LengthUnit::kMeter:
    case LengthUnit::kUnknown:
      return 1;
  }
  LOG(FATAL) << "no unit of length: " << static_cast<int>(unit);
}

Similarity ExportTransform::Unturned(const Similarity& colmap_from_normalized) const {
  if (IsIdentity()) return colmap_from_normalized;
  return {scale * colmap_from_normalized.scale,
          scale * colmap_from_normalized.translation + rotation.transpose() * translation};
}

ExportTransform ParseExportTransform(const ExportTransformOptions& options) {
  ExportTransform transform;
  if (!options.transform.empty()) SetSimilarity(options.transform, &transform);
  if (!ScaleInRange(options.scale)) {
    throw FieldError("scale", " is ", options.scale, "; it must be from 1e-9 to 1e9.");
  }
  transform.scale *= options.scale;
  transform.translation *= options.scale;
  transform.up_axis = options.up_axis;
  transform.unit = options.units;
  return transform;
}

void TurnUpright(const std::vector<PhotoRecord>& photos, ExportTransform* transform) {
  if (transform->up_axis == UpAxis::kColmap) return;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const PhotoRecord& photo : photos) {
    // A camera's y axis points down.
    sum -= photo.cam_from_world_rotation.inverse() * Eigen::Vector3d::UnitY();
  }
  if (photos.empty() || sum.norm() < kMinAgreement * static_cast<double>(photos.size())) {
    throw FieldError("up_axis",
                     " is ",
                     NameOf(kUpAxisNames, transform->up_axis),
                     ", but the photos do not tell what is up; give the turn with ",
                     Field{"transform"},
                     " "
                     "instead.");
  }
  const Eigen::Vector3d up = transform->rotation * sum;
  int axis;
  up.cwiseAbs().maxCoeff(&axis);
  const Eigen::Vector3d from = Eigen::Vector3d::Unit(axis) * (up[axis] > 0 ? 1 : -1);
  const Eigen::Vector3d to = Eigen::Vector3d::Unit(transform->up_axis == UpAxis::kY ? 1 : 2);
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  if (from == -to) {
    turn.diagonal() << 1, -1, -1;
  } else if (from != to) {
    // Rodrigues' formula for 90 degrees about k, in whole numbers.
    const Eigen::Vector3d k = from.cross(to);
    turn << k.x() * k.x(), -k.z(), k.y(), k.z(), k.y() * k.y(), -k.x(), -k.y(), k.x(),
        k.z() * k.z();
  }
  // Not by an arc cosine, which has no digits for small angles.
  const Eigen::Vector3d turned = turn * up;
  transform->up_tilt_degrees =
      std::atan2(turned.cross(to).norm(), turned.dot(to)) * 180 / std::numbers::pi;
  transform->rotation = turn * transform->rotation;
  transform->translation = turn * transform->translation;
}

std::string ExportTransformJson(const ExportTransform& transform) {
  std::vector<double> matrix;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      // + 0.0: no negative zeros.
      matrix.push_back(transform.scale * transform.rotation(row, column) + 0.0);
    }
    matrix.push_back(transform.translation[row] + 0.0);
  }
  matrix.insert(matrix.end(), {0, 0, 0, 1});
  nlohmann::ordered_json json = {{"file_from_colmap", matrix},
                                 {"up_axis", NameOf(kUpAxisNames, transform.up_axis)},
                                 {"unit", NameOf(kLengthUnitNames, transform.unit)},
                                 {"meters_per_unit", transform.MetersPerUnit()}};
  // Photos that are no evidence of a plane's tilt leave none.
  if (transform.up_axis != UpAxis::kColmap && std::isfinite(transform.up_tilt_degrees)) {
    json["up_tilt_degrees"] = std::round(100 * transform.up_tilt_degrees) / 100;
  }
  return json.dump();
}

}  // namespace semfoam
