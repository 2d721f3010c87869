// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask/surface_views.h"

#include "foam/util/parallel.h"
#include "plugin/mask/mask_evidence.h"
#include "plugin/mask/point_labels.h"
#include "plugin/util/files.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <unordered_map>
#include <vector>

#include <Eigen/Geometry>
#include <glog/logging.h>

namespace semfoam {
namespace {

constexpr double kMostPixels = 1 << 27;
// Points of a cloud for each pixel of depth.
constexpr double kPointsPerPixel = 16;
// Triangles with longer sides, in pixels, are divided.
constexpr double kLongestSide = 24;
constexpr int kMostDivisions = 16;
// How many pixels, and which share of the distance, a place may lie behind the surface.
constexpr double kPixelsBehind = 1.5;
constexpr double kShareBehind = 2e-3;
constexpr double kCloudShareBehind = 1e-2;
constexpr double kLeastCosine = 0.1;

// Chebyshev distance of each pixel from the next one of another class, less one, up to `most`.
std::vector<uint8_t> RadiiOf(const std::vector<uint16_t>& classes,
                             int width,
                             int height,
                             int most) {
  std::vector<uint8_t> radii(classes.size(), static_cast<uint8_t>(most));
  const auto at = [&](int x, int y) { return static_cast<size_t>(y) * width + x; };
  const auto spread = [&](int x, int y, int dx, int dy) {
    const int nx = x + dx, ny = y + dy;
    if (nx < 0 || ny < 0 || nx >= width || ny >= height) return;
    const int next = classes[at(nx, ny)] != classes[at(x, y)] ? 0 : radii[at(nx, ny)] + 1;
    radii[at(x, y)] = static_cast<uint8_t>(std::min<int>(radii[at(x, y)], next));
  };
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      for (const auto& [dx, dy] : {std::pair(-1, -1), {0, -1}, {1, -1}, {-1, 0}}) {
        spread(x, y, dx, dy);
      }
    }
  }
  for (int y = height - 1; y >= 0; --y) {
    for (int x = width - 1; x >= 0; --x) {
      for (const auto& [dx, dy] : {std::pair(1, 1), {0, 1}, {-1, 1}, {1, 0}}) spread(x, y, dx, dy);
    }
  }
  return radii;
}

}  // namespace

// A photo: its cameras at the sizes of depth and mask, and both images.
struct SurfaceViews::View {
  Camera depth_camera, mask_camera;
  Eigen::Matrix3d rotation;  // camera from world
  Eigen::Vector3d translation;
  PhotoRecord mask_photo;  // of the size of the mask
  // Largest angle between the camera's axis and a ray of its image.
  double widest = std::numbers::pi;
  // Angle of a pixel.
  double depth_angle = 0, mask_angle = 0;
  bool is_cloud = false;
  std::vector<float> depth;        // distance from the camera's centre; infinite: nothing
  std::vector<uint16_t> class_of;  // kNoClass: none; empty: no mask
  std::vector<uint8_t> radius;

  static constexpr uint16_t kNoClass = 0xffff;

  Eigen::Vector3d InCamera(const Eigen::Vector3d& x) const { return rotation * x + translation; }

  void MeasureImage() {
    const auto w = static_cast<double>(depth_camera.width);
    const auto h = static_cast<double>(depth_camera.height);
    widest = 0;
    for (int k = 0; k < 8; ++k) {
      constexpr double kPlaces[8][2] = {
          {0, 0}, {0.5, 0}, {1, 0}, {0, 0.5}, {1, 0.5}, {0, 1}, {0.5, 1}, {1, 1}};
      const auto ray = Unproject(depth_camera, {kPlaces[k][0] * w, kPlaces[k][1] * h});
      widest =
          std::max(widest, ray ? std::atan2(ray->head<2>().norm(), ray->z()) : std::numbers::pi);
    }
    const auto angle = [](const Camera& camera) {
      const Eigen::Vector2d middle(0.5 * static_cast<double>(camera.width),
                                   0.5 * static_cast<double>(camera.height));
      const auto a = Unproject(camera, middle),
                 b = Unproject(camera, middle + Eigen::Vector2d(1, 0));
      return a && b ? (*a - *b).norm() : 2 * std::numbers::pi / static_cast<double>(camera.width);
    };
    depth_angle = angle(depth_camera);
    mask_angle = angle(mask_camera);
  }

  void Put(int x, int y, double distance) {
    if (x < 0 || y < 0 || x >= static_cast<int>(depth_camera.width) ||
        y >= static_cast<int>(depth_camera.height)) {
      return;
    }
    float& at = depth[static_cast<size_t>(y) * depth_camera.width + x];
    at = std::min(at, static_cast<float>(distance));
  }

  void DrawPoint(const Eigen::Vector3d& x) {
    const auto pixel = Project(depth_camera, x);
    if (!pixel || pixel->cwiseAbs().maxCoeff() > 1e8) return;
    Put(static_cast<int>(std::floor(pixel->x())),
        static_cast<int>(std::floor(pixel->y())),
        x.norm());
  }

  // Fills the pixels whose centres a small triangle covers, by the reciprocal of the distance; at
  // least the one of its centre.
  void Fill(const std::array<Eigen::Vector3d, 3>& corners,
            const std::array<Eigen::Vector2d, 3>& pixels) {
    Eigen::Vector2d low = pixels[0], high = pixels[0];
    for (const Eigen::Vector2d& pixel : pixels) {
      low = low.cwiseMin(pixel);
      high = high.cwiseMax(pixel);
    }
    const auto cross = [](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
      return a.x() * b.y() - a.y() * b.x();
    };
    const double area = cross(pixels[1] - pixels[0], pixels[2] - pixels[0]);
    if ((high - low).maxCoeff() < 1 || area == 0) {
      DrawPoint((corners[0] + corners[1] + corners[2]) / 3);
      return;
    }
    double inverse[3];
    for (int k = 0; k < 3; ++k) inverse[k] = 1 / corners[k].norm();
    const int first_x = std::max(0, static_cast<int>(std::ceil(low.x() - 0.5)));
    const int last_x = std::min<int>(static_cast<int>(depth_camera.width) - 1,
                                     static_cast<int>(std::floor(high.x() - 0.5)));
    const int first_y = std::max(0, static_cast<int>(std::ceil(low.y() - 0.5)));
    const int last_y = std::min<int>(static_cast<int>(depth_camera.height) - 1,
                                     static_cast<int>(std::floor(high.y() - 0.5)));
    for (int y = first_y; y <= last_y; ++y) {
      for (int x = first_x; x <= last_x; ++x) {
        const Eigen::Vector2d p(x + 0.5, y + 0.5);
        const double b = cross(p - pixels[0], pixels[2] - pixels[0]) / area;
        const double c = cross(pixels[1] - pixels[0], p - pixels[0]) / area;
        if (b < 0 || c < 0 || b + c > 1) continue;
        Put(x, y, 1 / ((1 - b - c) * inverse[0] + b * inverse[1] + c * inverse[2]));
      }
    }
  }

  // Draws a triangle of the camera's frame, divided until it is small in the image.
  void Draw(const std::array<Eigen::Vector3d, 3>& corners, int divisions) {
    const Eigen::Vector3d center = (corners[0] + corners[1] + corners[2]) / 3;
    double radius = 0;
    for (const Eigen::Vector3d& corner : corners) {
      radius = std::max(radius, (corner - center).norm());
    }
    const double distance = center.norm();
    const bool is_apart = radius < distance;
    if (is_apart) {
      const double off_axis = std::atan2(center.head<2>().norm(), center.z());
      if (off_axis - std::asin(radius / distance) > widest) return;
    }
    std::array<Eigen::Vector2d, 3> pixels;
    bool is_seen = true;
    for (int k = 0; k < 3 && is_seen; ++k) {
      const auto pixel = Project(depth_camera, corners[k]);
      is_seen = pixel && pixel->cwiseAbs().maxCoeff() < 1e8;
      if (is_seen) pixels[k] = *pixel;
    }
    if (is_seen && is_apart) {
      double longest = 0;
      for (int k = 0; k < 3; ++k) {
        longest = std::max(longest, (pixels[k] - pixels[(k + 1) % 3]).norm());
      }
      if (longest <= kLongestSide) {
        Fill(corners, pixels);
        return;
      }
    }
    if (divisions == kMostDivisions || radius < 0.25 * distance * depth_angle) return;
    const Eigen::Vector3d ab = 0.5 * (corners[0] + corners[1]);
    const Eigen::Vector3d bc = 0.5 * (corners[1] + corners[2]);
    const Eigen::Vector3d ca = 0.5 * (corners[2] + corners[0]);
    Draw({corners[0], ab, ca}, divisions + 1);
    Draw({ab, corners[1], bc}, divisions + 1);
    Draw({ca, bc, corners[2]}, divisions + 1);
    Draw({ab, bc, ca}, divisions + 1);
  }

  void TakeMask(const ClassImage& mask, const PhotoRecord& photo) {
    if (mask.Empty()) return;
    const auto w = static_cast<int>(mask_camera.width), h = static_cast<int>(mask_camera.height);
    class_of.resize(static_cast<size_t>(w) * h);
    for (int y = 0; y < h; ++y) {
      const size_t row = static_cast<size_t>(y) * photo.height / h * photo.width;
      for (int x = 0; x < w; ++x) {
        const ClassIndex c = mask[row + static_cast<size_t>(x) * photo.width / w];
        class_of[static_cast<size_t>(y) * w + x] =
            c == kUnlabelled ? kNoClass : static_cast<uint16_t>(Value(c));
      }
    }
    radius = RadiiOf(class_of, w, h, std::min(254, SafeRadius(mask_photo)));
  }

  // Returns whether the photo sees a place of the surface, whose normal has this cosine to the ray.
  bool Sees(const Eigen::Vector3d& in_camera, double distance, double cosine) const {
    const auto pixel = Project(depth_camera, in_camera);
    if (!pixel || !(pixel->x() >= 0 && pixel->y() >= 0 &&
                    pixel->x() < static_cast<double>(depth_camera.width) &&
                    pixel->y() < static_cast<double>(depth_camera.height))) {
      return false;
    }
    const float there = depth[static_cast<size_t>(pixel->y()) * depth_camera.width +
                              static_cast<size_t>(pixel->x())];
    const double slope = 1 / std::max(kLeastCosine, cosine);
    const double behind =
        kPixelsBehind * depth_angle * slope + (is_cloud ? kCloudShareBehind : kShareBehind);
    return distance * (1 - behind) <= there;
  }
};

SurfaceViews::~SurfaceViews() = default;

SurfaceViews::SurfaceViews(const Reconstruction& model,
                           const CorrectedPhotos& photos,
                           std::span<const Eigen::Vector3d> vertices,
                           std::span<const std::array<uint32_t, 3>> triangles) {
  const std::vector<PhotoRecord>& records = photos.photos.photos;
  std::unordered_map<uint32_t, const Camera*> camera_of;
  for (const Camera& camera : model.cameras) camera_of.emplace(camera.id, &camera);
  std::unordered_map<std::string, const Image*> image_of;
  for (const Image& image : model.images) image_of.emplace(image.name, &image);
  double pixels = 0;
  for (const PhotoRecord& photo : records) pixels += 1.0 * photo.width * photo.height;
  const double mask_share = std::min(1.0, std::sqrt(kMostPixels / std::max(1.0, pixels)));
  const double most_of_cloud =
      std::max(256.0, static_cast<double>(vertices.size()) / kPointsPerPixel);

  views_.resize(records.size());
  ForEachFile(static_cast<int64_t>(views_.size()), [&](int64_t v) {
    const PhotoRecord& photo = records[v];
    const Image& image = *image_of.at(photo.name);
    View& view = views_[v];
    const auto sized = [&](double share) {
      const auto side = [&](int length) {
        return std::max<uint64_t>(1, static_cast<uint64_t>(std::lround(share * length)));
      };
      return RescaledCamera(*camera_of.at(image.camera_id), side(photo.width), side(photo.height));
    };
    double depth_share = mask_share;
    if (triangles.empty()) {
      depth_share =
          std::min(depth_share, std::sqrt(most_of_cloud / (1.0 * photo.width * photo.height)));
    }
    view.is_cloud = triangles.empty();
    view.mask_camera = sized(mask_share);
    view.depth_camera = sized(depth_share);
    view.rotation = image.cam_from_world.UnitRotation().toRotationMatrix();
    view.translation = image.cam_from_world.translation;
    view.mask_photo = photo;
    view.mask_photo.width = static_cast<int>(view.mask_camera.width);
    view.mask_photo.height = static_cast<int>(view.mask_camera.height);
    view.MeasureImage();
    view.TakeMask(photos.Mask(static_cast<int>(v)), photo);
    view.depth.assign(view.depth_camera.width * view.depth_camera.height,
                      std::numeric_limits<float>::infinity());
    for (const auto& triangle : triangles) {
      std::array<Eigen::Vector3d, 3> corners;
      bool is_finite = true;
      for (int k = 0; k < 3; ++k) {
        corners[k] = view.InCamera(vertices[triangle[k]]);
        is_finite &= corners[k].allFinite();
      }
      if (is_finite) view.Draw(corners, 0);
    }
    if (!triangles.empty()) return;
    for (const Eigen::Vector3d& x : vertices) {
      if (x.allFinite()) view.DrawPoint(view.InCamera(x));
    }
  });
}

MaskVerdict SurfaceViews::Vote(const Eigen::Vector3d& x, const Eigen::Vector3d& normal) const {
  MaskVerdict verdict;
  if (!x.allFinite()) return verdict;
  const double length = normal.norm();
  const bool has_normal = std::isfinite(length) && length > 0;
  std::vector<semfoam::Vote<uint16_t>> votes;
  for (const View& view : views_) {
    const Eigen::Vector3d in_camera = view.InCamera(x);
    const double distance = in_camera.norm();
    if (!(distance > 0)) continue;
    const double cosine =
        has_normal ? std::abs((view.rotation * normal).dot(in_camera)) / (length * distance) : 0.5;
    if (!view.Sees(in_camera, distance, cosine)) continue;
    ++verdict.num_views;
    if (view.class_of.empty()) continue;
    const auto pixel = Project(view.mask_camera, in_camera);
    if (!pixel) continue;
    const auto column = static_cast<size_t>(
        std::clamp(pixel->x(), 0.0, static_cast<double>(view.mask_camera.width) - 1));
    const auto row = static_cast<size_t>(
        std::clamp(pixel->y(), 0.0, static_cast<double>(view.mask_camera.height) - 1));
    const size_t at = row * view.mask_camera.width + column;
    if (view.class_of[at] == View::kNoClass) continue;
    AddVote(view.class_of[at],
            BorderWeight(view.radius[at], view.mask_photo) * static_cast<float>(cosine),
            &votes);
  }
  float most = 0, total = 0;
  for (const semfoam::Vote<uint16_t>& vote : votes) {
    total += vote.weight;
    const ClassIndex c{vote.label};
    if (vote.weight < most || (vote.weight == most && c > verdict.class_index)) continue;
    most = vote.weight;
    verdict.class_index = c;
  }
  if (total > 0) verdict.confidence = most / total;
  return verdict;
}

double SurfaceViews::PixelSize(const Eigen::Vector3d& x) const {
  double least = 0;
  for (const View& view : views_) {
    const Eigen::Vector3d in_camera = view.InCamera(x);
    const double distance = in_camera.norm();
    if (!(distance > 0) || !view.Sees(in_camera, distance, 0.5)) continue;
    const double size = distance * view.mask_angle;
    if (least == 0 || size < least) least = size;
  }
  return least;
}

}  // namespace semfoam
