// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/texture/texture_baker.h"

#include "export/texture/chart_packing.h"
#include "export/texture/seam_levelling.h"
#include "export/texture/triangle_raster.h"
#include "export/texture/uv_charts.h"
#include "foam/image/srgb.h"
#include "foam/util/parallel.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <set>
#include <span>
#include <string>
#include <utility>

#include <glog/logging.h>

namespace semfoam {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::Vector3f;
using Triangle = std::array<uint32_t, 3>;

constexpr int kMostTextureSize = 16384;
// Texels along a pixel of the photos with most detail, and the share of vertices that see less.
constexpr double kTexelsPerPixel = 1.0 / 0.7;
constexpr double kDetailQuantile = 0.75;
// Texels of a triangle in a chart that no photo shows, for the foam's colours.
constexpr double kTexelsPerUnseenTriangle = 8;
// Photos kept for each vertex, and those of them that have a share.
constexpr int kKept = 8;
constexpr int kSharing = 5;
// Power of the relative scores in the shares of coarse and of fine detail.
constexpr float kCoarsePower = 1;
constexpr float kFinePower = 6;
// Width of the smoothing that parts coarse from fine detail, and of the border along which scores
// fall, as shares of the photo's longer side.
constexpr double kCoarseShare = 0.006;
constexpr double kBorderShare = 0.008;
constexpr double kLeastCosine = 0.15;
// By how many pixels and which share of the distance a place may lie behind what is visible.
constexpr double kPixelsBehind = 2;
constexpr double kShareBehind = 3e-3;
// Shares of the photos below which a texel takes some of the foam's colour.
constexpr float kFullShare = 0.25f;
// Distance of texels that are far from all charts.
constexpr uint8_t kFar = 255;
constexpr int64_t kVerticesPerBlock = 4096;
constexpr int64_t kTrianglesPerBlock = 512;

// A photo that shows a vertex.
struct Candidate {
  int photo = -1;  // -1: none
  float score = 0;
  std::array<uint8_t, 3> color = {};
};

// The best photos of a vertex, best first.
using Candidates = std::array<Candidate, kKept>;

void Insert(const Candidate& candidate, Candidates* candidates) {
  if (!(candidate.score > candidates->back().score)) return;
  size_t at = kKept - 1;
  while (at > 0 && candidate.score > (*candidates)[at - 1].score) {
    (*candidates)[at] = (*candidates)[at - 1];
    --at;
  }
  (*candidates)[at] = candidate;
}

// Positions in the COLMAP frame and unit normals of the vertices.
struct Geometry {
  std::vector<Vector3d> vertices;
  std::vector<Vector3d> normals;
};

Geometry GeometryOf(const ExportableScene& scene, const ObjectSurface& surface) {
  Geometry geometry;
  geometry.vertices.reserve(surface.vertices.size());
  for (const Vector3d& vertex : surface.vertices) {
    geometry.vertices.push_back(scene.ColmapFromFile(vertex));
  }
  geometry.normals.assign(surface.vertices.size(), Vector3d::Zero());
  for (const auto& [a, b, c] : surface.triangles) {
    const Vector3d area = (geometry.vertices[b] - geometry.vertices[a])
                              .cross(geometry.vertices[c] - geometry.vertices[a]);
    for (const uint32_t corner : {a, b, c}) geometry.normals[corner] += area;
  }
  // Once over the neighbours: the facets of a rough surface say little of what photos show.
  std::vector<Vector3d> sums = geometry.normals;
  for (const Triangle& triangle : surface.triangles) {
    for (int k = 0; k < 3; ++k) sums[triangle[k]] += geometry.normals[triangle[(k + 1) % 3]];
  }
  for (size_t v = 0; v < sums.size(); ++v) geometry.normals[v] = sums[v].stableNormalized();
  return geometry;
}

// The part of a photo in which a surface lies, and what is visible there. Pixels of the window
// begin at (left, top) of the photo.
class PhotoWindow {
 public:
  PhotoWindow(const TexturePhotos& photos, int photo, LabelId object, const Geometry& geometry)
      : photos_(photos), photo_(photo), object_(object), geometry_(geometry) {}

  // Returns whether the surface lies in the photo at all.
  bool Look(std::span<const Triangle> triangles) {
    center_ = photos_.Center(photo_);
    places_.assign(geometry_.vertices.size(), {});
    ParallelForBlocks(std::ssize(places_), kVerticesPerBlock, [&](int64_t begin, int64_t end) {
      for (int64_t v = begin; v < end; ++v) {
        const auto pixel = photos_.Project(photo_, geometry_.vertices[v]);
        // Far outside, a distorted camera has no useful pixels.
        if (!pixel || pixel->cwiseAbs().maxCoeff() > 1e6) continue;
        places_[v] = {*pixel, (geometry_.vertices[v] - center_).norm()};
      }
    });
    Vector2d low = Vector2d::Constant(1e9), high = -low;
    for (const ImageVertex& place : places_) {
      if (place.distance == 0) continue;
      low = low.cwiseMin(place.pixel);
      high = high.cwiseMax(place.pixel);
    }
    left_ = static_cast<int>(std::clamp<double>(low.x() - 2, 0, photos_.Width(photo_)));
    top_ = static_cast<int>(std::clamp<double>(low.y() - 2, 0, photos_.Height(photo_)));
    width_ = static_cast<int>(std::clamp<double>(high.x() + 3, 0, photos_.Width(photo_))) - left_;
    height_ = static_cast<int>(std::clamp<double>(high.y() + 3, 0, photos_.Height(photo_))) - top_;
    if (width_ <= 0 || height_ <= 0) return false;
    for (ImageVertex& place : places_) place.pixel -= Vector2d(left_, top_);
    raster_ = DrawTriangles(places_, triangles, width_, height_);
    pixels_ = photos_.Read(photo_);
    CHECK_EQ(pixels_->image.width, photos_.Width(photo_));
    CHECK_EQ(pixels_->image.height, photos_.Height(photo_));
    MeasureBorders();
    return true;
  }

  // Returns the number of pixels on a unit of area at a vertex, times a factor that falls to 0
  // towards borders; 0 where the photo does not show the vertex.
  float Score(uint32_t vertex) const {
    const ImageVertex& place = places_[vertex];
    if (place.distance == 0) return 0;
    const double cosine =
        geometry_.normals[vertex].dot(center_ - geometry_.vertices[vertex]) / place.distance;
    if (!(cosine > kLeastCosine)) return 0;
    const float border = BorderFactor(place.pixel, place.distance, cosine);
    if (border == 0) return 0;
    const Vector2d pixel = place.pixel + Vector2d(left_, top_);
    if (place.distance * (1 - kShareBehind) > photos_.VisibleDistance(photo_, pixel)) return 0;
    return static_cast<float>(border * (cosine - kLeastCosine) * DensityAt(place.distance));
  }

  // Pixels on a unit of area that is seen from the front.
  double DensityAt(double distance) const {
    const double size = distance * photos_.PixelAngle(photo_);
    return 1 / (size * size);
  }

  const ImageVertex& Place(uint32_t vertex) const { return places_[vertex]; }

  // Returns the place of a point of the surface in the window; nothing where the photo does not
  // show it. `cosine`: between the normal and the direction to the camera.
  bool Find(const Vector3d& x, double cosine, Vector2d* pixel) const {
    const auto projected = photos_.Project(photo_, x);
    if (!projected || projected->cwiseAbs().maxCoeff() > 1e6) return false;
    *pixel = *projected - Vector2d(left_, top_);
    return BorderFactor(*pixel, (x - center_).norm(), cosine) > 0;
  }

  double Cosine(const Vector3d& x, const Vector3d& normal) const {
    return normal.dot((center_ - x).normalized());
  }

  // Interpolates the photo at a place in the window.
  Vector3f Color(const Vector2d& pixel) const {
    return Interpolate(pixel, [&](int x, int y) {
      const uint8_t* rgb = &pixels_->image.data[3 * PhotoIndex(x, y)];
      return Vector3f(rgb[0], rgb[1], rgb[2]);
    });
  }

  // Prepares CoarseColor.
  void MakeCoarse() {
    radius_ = std::max(1, static_cast<int>(std::lround(kCoarseShare * LongerSide())));
    // Sums over boxes, twice, of the pixels that show the object: nearly a Gaussian.
    std::vector<Vector3f> colors(static_cast<size_t>(width_) * height_, Vector3f::Zero());
    std::vector<float> weights(colors.size(), 0);
    for (int y = 0; y < height_; ++y) {
      for (int x = 0; x < width_; ++x) {
        const size_t at = static_cast<size_t>(y) * width_ + x;
        if (border_[at] == 0) continue;
        const uint8_t* rgb = &pixels_->image.data[3 * PhotoIndex(x, y)];
        colors[at] = Vector3f(rgb[0], rgb[1], rgb[2]);
        weights[at] = 1;
      }
    }
    for (int round = 0; round < 2; ++round) {
      BoxSums(width_, height_, 1, width_, &colors);
      BoxSums(height_, width_, width_, 1, &colors);
      BoxSums(width_, height_, 1, width_, &weights);
      BoxSums(height_, width_, width_, 1, &weights);
    }
    for (size_t at = 0; at < colors.size(); ++at) {
      if (weights[at] > 0.5f) colors[at] /= weights[at];
    }
    coarse_ = std::move(colors);
  }

  // Interpolates the photo without its fine detail.
  Vector3f CoarseColor(const Vector2d& pixel) const {
    return Interpolate(pixel,
                       [&](int x, int y) { return coarse_[static_cast<size_t>(y) * width_ + x]; });
  }

 private:
  double LongerSide() const { return std::max(photos_.Width(photo_), photos_.Height(photo_)); }
  size_t PhotoIndex(int x, int y) const {
    return static_cast<size_t>(y + top_) * photos_.Width(photo_) + x + left_;
  }

  // Replaces each value by the sum of those up to radius_ away along a line.
  template <typename T>
  void BoxSums(int length, int lines, size_t step, size_t line_step, std::vector<T>* values) const {
    const int radius = radius_;
    ParallelForBlocks(lines, 64, [&](int64_t begin, int64_t end) {
      std::vector<T> line(length);
      for (int64_t l = begin; l < end; ++l) {
        T* const first = values->data() + l * line_step;
        for (int i = 0; i < length; ++i) line[i] = first[i * step];
        for (int i = 0; i < length; ++i) {
          T sum = line[i];
          for (int k = 1; k <= radius; ++k) {
            if (i - k >= 0) sum += line[i - k];
            if (i + k < length) sum += line[i + k];
          }
          first[i * step] = sum;
        }
      }
    });
  }

  // Between the centres of pixels; those that do not show the object have no share where others do.
  template <typename At>
  Vector3f Interpolate(const Vector2d& pixel, const At& at) const {
    const double x = std::clamp(pixel.x() - 0.5, 0.0, width_ - 1.0);
    const double y = std::clamp(pixel.y() - 0.5, 0.0, height_ - 1.0);
    const int x0 = static_cast<int>(x), y0 = static_cast<int>(y);
    const int x1 = std::min(x0 + 1, width_ - 1), y1 = std::min(y0 + 1, height_ - 1);
    const auto fx = static_cast<float>(x - x0), fy = static_cast<float>(y - y0);
    Vector3f sum = Vector3f::Zero();
    float total = 0;
    const auto add = [&](int px, int py, float weight) {
      if (border_[static_cast<size_t>(py) * width_ + px] == 0) weight *= 1e-6f;
      sum += weight * at(px, py);
      total += weight;
    };
    add(x0, y0, (1 - fx) * (1 - fy));
    add(x1, y0, fx * (1 - fy));
    add(x0, y1, (1 - fx) * fy);
    add(x1, y1, fx * fy);
    return total > 0 ? Vector3f(sum / total) : at(x0, y0);
  }

  // 0 where a place is not visible; 1 far from all borders.
  float BorderFactor(const Vector2d& pixel, double distance, double cosine) const {
    if (!(pixel.x() >= 0 && pixel.y() >= 0 && pixel.x() < width_ && pixel.y() < height_)) return 0;
    const int x = static_cast<int>(pixel.x()), y = static_cast<int>(pixel.y());
    const size_t at = static_cast<size_t>(y) * width_ + x;
    if (border_[at] == 0) return 0;
    const double slope = 1 / std::max(kLeastCosine, cosine);
    const double behind = kPixelsBehind * photos_.PixelAngle(photo_) * slope + kShareBehind;
    if (distance * (1 - behind) > raster_.distance[at]) return 0;
    return border_[at] / static_cast<float>(border_width_ + 1);
  }

  // Chebyshev distances of the pixels from the next one that does not show the object, or in which
  // another part of it is nearer; 0 for those, at most border_width_ + 1.
  void MeasureBorders() {
    border_width_ = std::clamp(static_cast<int>(std::lround(kBorderShare * LongerSide())), 1, 250);
    const auto most = static_cast<uint8_t>(border_width_ + 1);
    border_.assign(static_cast<size_t>(width_) * height_, most);
    const auto at = [&](int x, int y) { return static_cast<size_t>(y) * width_ + x; };
    const LabelImage& labels = pixels_->labels;
    const bool has_mask = !labels.data.empty() && object_ != kNoObject;
    for (int y = 0; y < height_; ++y) {
      for (int x = 0; x < width_; ++x) {
        const size_t index = PhotoIndex(x, y);
        const bool shows = (!has_mask || labels.data[index] == Value(object_)) &&
                           (pixels_->is_known.empty() || pixels_->is_known[index] != 0);
        if (!shows) border_[at(x, y)] = 0;
        // A step of depth: the part behind ends here.
        const float here = raster_.distance[at(x, y)];
        const float step =
            here * static_cast<float>(20 * photos_.PixelAngle(photo_) + kShareBehind);
        for (const auto& [dx, dy] : {std::pair(1, 0), {0, 1}, {-1, 0}, {0, -1}}) {
          if (x + dx < 0 || y + dy < 0 || x + dx >= width_ || y + dy >= height_) continue;
          if (here - raster_.distance[at(x + dx, y + dy)] > step) {
            border_[at(x, y)] = std::min<uint8_t>(border_[at(x, y)], 1);
          }
        }
        // Pixels at the photo's own border.
        const int edge = std::min({x + left_,
                                   y + top_,
                                   photos_.Width(photo_) - 1 - x - left_,
                                   photos_.Height(photo_) - 1 - y - top_});
        border_[at(x, y)] = static_cast<uint8_t>(std::min<int>(border_[at(x, y)], edge + 1));
      }
    }
    const auto spread = [&](int x, int y, int dx, int dy) {
      const int nx = x + dx, ny = y + dy;
      if (nx < 0 || ny < 0 || nx >= width_ || ny >= height_) return;
      border_[at(x, y)] =
          static_cast<uint8_t>(std::min<int>(border_[at(x, y)], border_[at(nx, ny)] + 1));
    };
    for (int y = 0; y < height_; ++y) {
      for (int x = 0; x < width_; ++x) {
        for (const auto& [dx, dy] : {std::pair(-1, -1), {0, -1}, {1, -1}, {-1, 0}}) {
          spread(x, y, dx, dy);
        }
      }
    }
    for (int y = height_ - 1; y >= 0; --y) {
      for (int x = width_ - 1; x >= 0; --x) {
        for (const auto& [dx, dy] : {std::pair(1, 1), {0, 1}, {-1, 1}, {1, 0}}) {
          spread(x, y, dx, dy);
        }
      }
    }
  }

  const TexturePhotos& photos_;
  const int photo_;
  const LabelId object_;
  const Geometry& geometry_;
  Vector3d center_;
  int left_ = 0, top_ = 0, width_ = 0, height_ = 0;
  std::vector<ImageVertex> places_;
  TriangleRaster raster_;
  std::shared_ptr<const TexturePhoto> pixels_;
  int border_width_ = 1;
  std::vector<uint8_t> border_;
  int radius_ = 1;
  std::vector<Vector3f> coarse_;
};

// Shares of the photos in a vertex, those of its candidates in their order.
struct Shares {
  std::array<float, kKept> coarse = {};
  std::array<float, kKept> fine = {};
};

Shares SharesOf(const Candidates& candidates) {
  Shares shares;
  const float best = candidates[0].score;
  if (!(best > 0)) return shares;
  const float least = candidates[kSharing].score / best;
  float coarse = 0, fine = 0;
  for (int k = 0; k < kSharing; ++k) {
    const float relative = candidates[k].score / best;
    if (!(relative > least)) break;
    const float above = (relative - least) / (1 - least);
    shares.coarse[k] = std::pow(above, kCoarsePower);
    shares.fine[k] = std::pow(above, kFinePower);
    coarse += shares.coarse[k];
    fine += shares.fine[k];
  }
  for (int k = 0; k < kSharing && coarse > 0; ++k) {
    shares.coarse[k] /= coarse;
    shares.fine[k] /= fine;
  }
  return shares;
}

// The texels of each triangle.
struct Texels {
  // Texels of triangle f: first[f], ...
  std::vector<uint32_t> first;
  // Index of the texel in the image.
  std::vector<uint32_t> pixel;
};

Texels FindTexels(const UvCharts& charts,
                  const std::vector<Vector2d>& places,
                  const std::vector<Vector3d>& file_vertices,
                  std::span<const Triangle> surface_triangles,
                  int size) {
  // Where triangles of a rough surface overlap, the one with the larger image has the texel.
  std::vector<uint32_t> owner(static_cast<size_t>(size) * size, kNoTriangle);
  std::vector<float> flatness(charts.triangles.size());
  std::vector<std::array<Vector2d, 3>> corners(charts.triangles.size());
  for (uint32_t f = 0; f < charts.triangles.size(); ++f) {
    for (int k = 0; k < 3; ++k) corners[f][k] = places[charts.triangles[f][k]];
    const Vector2d ab = corners[f][1] - corners[f][0], ac = corners[f][2] - corners[f][0];
    const auto& [a, b, c] = surface_triangles[f];
    const double area =
        (file_vertices[b] - file_vertices[a]).cross(file_vertices[c] - file_vertices[a]).norm();
    flatness[f] = area > 0 ? static_cast<float>((ab.x() * ac.y() - ab.y() * ac.x()) / area) : -1.f;
  }
  const auto claim = [&](uint32_t f, int x, int y) {
    uint32_t& at = owner[static_cast<size_t>(y) * size + x];
    if (at == kNoTriangle || flatness[f] > flatness[at]) at = f;
  };
  for (uint32_t f = 0; f < charts.triangles.size(); ++f) {
    ForEachCoveredPixel(
        corners[f], size, 0, size, [&](int x, int y, const Vector3d&) { claim(f, x, y); });
  }
  // Triangles between the centres of texels.
  for (uint32_t f = 0; f < charts.triangles.size(); ++f) {
    const Vector2d middle = (corners[f][0] + corners[f][1] + corners[f][2]) / 3;
    const int x = std::clamp(static_cast<int>(middle.x()), 0, size - 1);
    const int y = std::clamp(static_cast<int>(middle.y()), 0, size - 1);
    uint32_t& at = owner[static_cast<size_t>(y) * size + x];
    if (at == kNoTriangle) at = f;
  }
  Texels texels;
  texels.first.assign(charts.triangles.size() + 1, 0);
  for (const uint32_t f : owner) {
    if (f != kNoTriangle) ++texels.first[f + 1];
  }
  for (size_t f = 0; f < charts.triangles.size(); ++f) texels.first[f + 1] += texels.first[f];
  texels.pixel.resize(texels.first.back());
  std::vector<uint32_t> next(texels.first.begin(), texels.first.end() - 1);
  for (uint32_t i = 0; i < owner.size(); ++i) {
    if (owner[i] != kNoTriangle) texels.pixel[next[owner[i]]++] = i;
  }
  return texels;
}

// Sums over photos at a texel or a vertex.
struct Sum {
  Vector3f coarse = Vector3f::Zero();
  Vector3f fine = Vector3f::Zero();
  float coarse_weight = 0;
  float fine_weight = 0;

  // Display values, 0..255.
  Vector3f Color() const {
    Vector3f color = coarse / coarse_weight;
    if (fine_weight > 0) color += fine / fine_weight;
    return color;
  }
};

// Changes the light of a photo by a gain, in display values of 0..255.
class Gain {
 public:
  explicit Gain(const Vector3d& gain) {
    for (int c = 0; c < 3; ++c) {
      for (int i = 0; i <= kSteps; ++i) {
        const double value = DisplayFromLinear(gain[c] * LinearFromDisplay(i / double{kSteps}));
        table_[c][i] = static_cast<float>(255 * value);
      }
    }
  }

  Vector3f operator()(const Vector3f& color) const {
    Vector3f result;
    for (int c = 0; c < 3; ++c) {
      const float at = std::clamp(color[c] * (kSteps / 255.f), 0.f, kSteps - 1e-3f);
      const int i = static_cast<int>(at);
      result[c] = table_[c][i] + (at - static_cast<float>(i)) * (table_[c][i + 1] - table_[c][i]);
    }
    return result;
  }

 private:
  static constexpr int kSteps = 255;
  std::array<std::array<float, kSteps + 1>, 3> table_;
};

Vector3f ToVector(const Color8& color) { return Vector3f(color[0], color[1], color[2]); }

Color8 ToBytes(const Vector3f& color) {
  Color8 bytes;
  for (int c = 0; c < 3; ++c) {
    bytes[c] = static_cast<uint8_t>(std::lround(std::clamp(color[c], 0.f, 255.f)));
  }
  return bytes;
}

class Baker {
 public:
  Baker(const ExportableScene& scene,
        const ObjectInfo& object,
        const ObjectSurface& surface,
        const TexturePhotos& photos,
        const TextureOptions& options)
      : object_(object),
        surface_(surface),
        photos_(photos),
        options_(options),
        geometry_(GeometryOf(scene, surface)) {
    // Without a list all photos may show it.
    std::set<std::string> names;
    for (const PhotoObservation& one : object.photos) names.insert(one.photo);
    for (int photo = 0; photo < photos.NumPhotos(); ++photo) {
      if (!photos.IsUsed(photo)) continue;
      if (names.empty() || names.count(photos.Name(photo)) != 0) used_.push_back(photo);
    }
  }

  SurfaceTexture Bake() {
    FindCandidates();
    gains_ = FindGains();
    MakeLayout();
    SumPhotos();
    Paint();
    return std::move(texture_);
  }

 private:
  void FindCandidates() {
    candidates_.assign(geometry_.vertices.size(), {});
    detail_.assign(geometry_.vertices.size(), 0);
    std::vector<int> showing;
    for (const int photo : used_) {
      PhotoWindow window(photos_, photo, object_.id, geometry_);
      if (!window.Look(surface_.triangles)) continue;
      showing.push_back(photo);
      ParallelForBlocks(
          std::ssize(candidates_), kVerticesPerBlock, [&](int64_t begin, int64_t end) {
            for (int64_t v = begin; v < end; ++v) {
              const float score = window.Score(static_cast<uint32_t>(v));
              if (score == 0) continue;
              const ImageVertex& place = window.Place(static_cast<uint32_t>(v));
              detail_[v] =
                  std::max(detail_[v], static_cast<float>(window.DensityAt(place.distance)));
              Insert({photo, score, ToBytes(window.Color(place.pixel))}, &candidates_[v]);
            }
          });
    }
    used_ = std::move(showing);
  }

  std::vector<Vector3d> FindGains() const {
    std::vector<VertexObservation> observations;
    observations.reserve(kKept * candidates_.size());
    for (const Candidates& candidates : candidates_) {
      for (const Candidate& one : candidates) {
        const float weight = candidates[0].score > 0 ? one.score / candidates[0].score : 0;
        observations.push_back({one.photo, weight, one.color});
      }
    }
    return PhotoGains(observations, kKept, photos_.NumPhotos());
  }

  // Returns the texels along a unit of each chart, in the unit of the files: as many as the photos
  // that show it have detail, so that what is far from all cameras does not take the texture from
  // what is near.
  std::vector<double> ChartScales(const UvCharts& charts) const {
    const double pixels_in_files = kTexelsPerPixel / LengthInFiles();
    std::vector<float> all;
    for (const float detail : detail_) {
      if (detail > 0) all.push_back(detail);
    }
    const double most = all.empty() ? std::numeric_limits<double>::infinity()
                                    : pixels_in_files * std::sqrt(DetailOf(&all));

    std::vector<std::vector<float>> details(charts.sizes.size());
    for (size_t f = 0; f < charts.triangles.size(); ++f) {
      for (const uint32_t point : charts.triangles[f]) {
        const float detail = detail_[charts.vertex_of[point]];
        if (detail > 0) details[charts.chart_of[f]].push_back(detail);
      }
    }
    std::vector<int64_t> num_triangles(charts.sizes.size(), 0);
    std::vector<double> areas(charts.sizes.size(), 0);
    for (size_t f = 0; f < charts.triangles.size(); ++f) {
      ++num_triangles[charts.chart_of[f]];
      areas[charts.chart_of[f]] += AreaOf(surface_.triangles[f]);
    }
    std::vector<double> scales(charts.sizes.size());
    for (size_t chart = 0; chart < scales.size(); ++chart) {
      const double wanted =
          details[chart].empty()
              ? std::sqrt(kTexelsPerUnseenTriangle * static_cast<double>(num_triangles[chart]) /
                          std::max(areas[chart], 1e-300))
              : pixels_in_files * std::sqrt(DetailOf(&details[chart]));
      scales[chart] = std::min(most, wanted);
    }
    return scales;
  }

  // Returns the pixels on a unit of area that all but a quarter of the vertices stay below.
  static double DetailOf(std::vector<float>* details) {
    const auto at =
        details->begin() +
        static_cast<ptrdiff_t>(kDetailQuantile * static_cast<double>(details->size() - 1));
    std::nth_element(details->begin(), at, details->end());
    return *at;
  }

  // The length in the files of a unit of the COLMAP frame.
  double LengthInFiles() const {
    double files = 0, colmap = 0;
    for (const auto& [a, b, c] : surface_.triangles) {
      files += (surface_.vertices[b] - surface_.vertices[a]).norm();
      colmap += (geometry_.vertices[b] - geometry_.vertices[a]).norm();
    }
    return colmap > 0 ? files / colmap : 1;
  }

  // In the files.
  double AreaOf(const Triangle& triangle) const {
    const auto& [a, b, c] = triangle;
    return 0.5 * (surface_.vertices[b] - surface_.vertices[a])
                     .cross(surface_.vertices[c] - surface_.vertices[a])
                     .norm();
  }

  void MakeLayout() {
    UvCharts charts = MakeUvCharts(surface_.vertices, surface_.triangles);
    std::vector<uint32_t> chart_of_point(charts.points.size());
    for (size_t f = 0; f < charts.triangles.size(); ++f) {
      for (const uint32_t p : charts.triangles[f]) chart_of_point[p] = charts.chart_of[f];
    }
    const std::vector<double> scales = ChartScales(charts);
    for (size_t p = 0; p < charts.points.size(); ++p) charts.points[p] *= scales[chart_of_point[p]];
    for (size_t chart = 0; chart < scales.size(); ++chart) charts.sizes[chart] *= scales[chart];
    const ChartPacking packing = PackCharts(charts.sizes, 1, options_.size);
    size_ = packing.size;
    places_.reserve(charts.points.size());
    texture_.coordinates.reserve(charts.points.size());
    for (size_t p = 0; p < charts.points.size(); ++p) {
      places_.push_back(packing.offsets[chart_of_point[p]] + packing.scale * charts.points[p]);
      places_.back() = places_.back().cwiseMin(size_).cwiseMax(0);
      texture_.coordinates.push_back((places_.back() / size_).cast<float>());
    }
    texels_ = FindTexels(charts, places_, surface_.vertices, surface_.triangles, size_);
    texture_.vertex_of = std::move(charts.vertex_of);
    texture_.triangles = std::move(charts.triangles);
    texture_.num_texels = std::ssize(texels_.pixel);
  }

  void SumPhotos() {
    std::vector<Shares> shares(candidates_.size());
    for (size_t v = 0; v < candidates_.size(); ++v) shares[v] = SharesOf(candidates_[v]);
    sums_.assign(texels_.pixel.size(), {});
    vertex_sums_.assign(candidates_.size(), {});
    // Shares of the photo at hand.
    std::vector<float> coarse(candidates_.size()), fine(candidates_.size());
    for (const int photo : used_) {
      bool has_share = false;
      for (size_t v = 0; v < candidates_.size(); ++v) {
        coarse[v] = fine[v] = 0;
        for (int k = 0; k < kSharing; ++k) {
          if (candidates_[v][k].photo != photo) continue;
          coarse[v] = shares[v].coarse[k];
          fine[v] = shares[v].fine[k];
          has_share |= coarse[v] > 0;
        }
      }
      if (!has_share) continue;
      ++texture_.num_photos;
      PhotoWindow window(photos_, photo, object_.id, geometry_);
      CHECK(window.Look(surface_.triangles));
      window.MakeCoarse();
      const Gain gain(gains_[photo]);
      const auto add = [&](const Vector2d& pixel, float coarse_share, float fine_share, Sum* sum) {
        const Vector3f low = gain(window.CoarseColor(pixel));
        sum->coarse += coarse_share * low;
        sum->coarse_weight += coarse_share;
        sum->fine += fine_share * (gain(window.Color(pixel)) - low);
        sum->fine_weight += fine_share;
      };
      ParallelForBlocks(
          std::ssize(vertex_sums_), kVerticesPerBlock, [&](int64_t begin, int64_t end) {
            for (int64_t v = begin; v < end; ++v) {
              if (coarse[v] > 0) {
                add(window.Place(static_cast<uint32_t>(v)).pixel,
                    coarse[v],
                    fine[v],
                    &vertex_sums_[v]);
              }
            }
          });
      ParallelForBlocks(
          std::ssize(texture_.triangles), kTrianglesPerBlock, [&](int64_t begin, int64_t end) {
            for (int64_t f = begin; f < end; ++f) {
              const Triangle& triangle = surface_.triangles[f];
              const Vector3d coarse_at(
                  coarse[triangle[0]], coarse[triangle[1]], coarse[triangle[2]]);
              if (coarse_at.isZero(0)) continue;
              const Vector3d fine_at(fine[triangle[0]], fine[triangle[1]], fine[triangle[2]]);
              for (uint32_t t = texels_.first[f]; t < texels_.first[f + 1]; ++t) {
                const Vector3d weights = WeightsAt(static_cast<uint32_t>(f), texels_.pixel[t]);
                Vector3d x = Vector3d::Zero(), normal = Vector3d::Zero();
                for (int k = 0; k < 3; ++k) {
                  x += weights[k] * geometry_.vertices[triangle[k]];
                  normal += weights[k] * geometry_.normals[triangle[k]];
                }
                const auto share = static_cast<float>(coarse_at.dot(weights));
                Vector2d pixel;
                if (!(share > 0) ||
                    !window.Find(x, window.Cosine(x, normal.stableNormalized()), &pixel)) {
                  continue;
                }
                add(pixel, share, static_cast<float>(fine_at.dot(weights)), &sums_[t]);
              }
            }
          });
    }
  }

  // The weights of a triangle's corners at a texel of it, none negative.
  Vector3d WeightsAt(uint32_t f, uint32_t pixel) const {
    std::array<Vector2d, 3> corners;
    for (int k = 0; k < 3; ++k) corners[k] = places_[texture_.triangles[f][k]];
    Vector3d weights = CornerWeights(
        corners, Vector2d(pixel % size_ + 0.5, static_cast<double>(pixel / size_) + 0.5));
    weights = weights.cwiseMax(0);
    return weights / weights.sum();
  }

  void Paint() {
    // What photos show at the vertices, less what the foam has there.
    std::vector<uint8_t> is_known(vertex_sums_.size());
    std::vector<Vector3f> difference(vertex_sums_.size(), Vector3f::Zero());
    for (size_t v = 0; v < vertex_sums_.size(); ++v) {
      is_known[v] = vertex_sums_[v].coarse_weight > 0;
      if (is_known[v] != 0) {
        difference[v] = vertex_sums_[v].coarse / vertex_sums_[v].coarse_weight -
                        ToVector(surface_.vertex_color[v]);
      }
    }
    ExtendOverSurface(surface_.triangles, is_known, &difference);

    const size_t count = static_cast<size_t>(size_) * size_;
    texture_.image = {size_, size_, std::vector<uint8_t>(3 * count)};
    std::vector<uint8_t> distance(count, kFar);  // from the charts, in texels
    std::vector<uint8_t> from_photos(texels_.pixel.size());
    ParallelForBlocks(
        std::ssize(texture_.triangles), kTrianglesPerBlock, [&](int64_t begin, int64_t end) {
          for (int64_t f = begin; f < end; ++f) {
            for (uint32_t t = texels_.first[f]; t < texels_.first[f + 1]; ++t) {
              const uint32_t pixel = texels_.pixel[t];
              const Vector3d weights = WeightsAt(static_cast<uint32_t>(f), pixel);
              Vector3f foam = Vector3f::Zero();
              for (int k = 0; k < 3; ++k) {
                const uint32_t v = surface_.triangles[f][k];
                foam += static_cast<float>(weights[k]) *
                        (ToVector(surface_.vertex_color[v]) + difference[v]);
              }
              const Sum& sum = sums_[t];
              const float share = std::min(1.f, sum.coarse_weight / kFullShare);
              from_photos[t] = share > 0.5f;
              const Vector3f color =
                  share > 0 ? Vector3f(share * sum.Color() + (1 - share) * foam) : foam;
              const Color8 bytes = ToBytes(color);
              std::copy(bytes.begin(), bytes.end(), &texture_.image.data[3 * size_t{pixel}]);
              distance[pixel] = 0;
            }
          }
        });
    for (const uint8_t one : from_photos) texture_.num_photo_texels += one;
    FillGaps(&distance);
  }

  // Continues the charts beyond their borders, and gives the rest their mean colour.
  void FillGaps(std::vector<uint8_t>* distance) {
    std::vector<uint8_t>& data = texture_.image.data;
    std::array<uint64_t, 3> sums = {};
    for (const uint32_t pixel : texels_.pixel) {
      for (int c = 0; c < 3; ++c) sums[c] += data[3 * size_t{pixel} + c];
    }
    const uint64_t total = std::max<uint64_t>(1, texels_.pixel.size());
    std::vector<uint32_t> border = texels_.pixel;
    for (uint8_t ring = 1; ring <= kChartMargin + 1; ++ring) {
      std::vector<uint32_t> next;
      for (const uint32_t pixel : border) {
        ForEachAround(pixel, [&](uint32_t around) {
          if ((*distance)[around] != kFar) return;
          (*distance)[around] = ring;
          next.push_back(around);
        });
      }
      for (const uint32_t pixel : next) {
        std::array<int, 3> sum = {};
        int count = 0;
        ForEachAround(pixel, [&](uint32_t around) {
          if ((*distance)[around] >= ring) return;
          for (int c = 0; c < 3; ++c) sum[c] += data[3 * size_t{around} + c];
          ++count;
        });
        for (int c = 0; c < 3; ++c) {
          data[3 * size_t{pixel} + c] = static_cast<uint8_t>((sum[c] + count / 2) / count);
        }
      }
      border = std::move(next);
    }
    for (size_t at = 0; at < distance->size(); ++at) {
      if ((*distance)[at] != kFar) continue;
      for (int c = 0; c < 3; ++c) {
        data[3 * at + c] = static_cast<uint8_t>((sums[c] + total / 2) / total);
      }
    }
  }

  // Calls visit for the texels around one, and for itself.
  template <typename Visit>
  void ForEachAround(uint32_t pixel, const Visit& visit) const {
    const int x = static_cast<int>(pixel % size_), y = static_cast<int>(pixel / size_);
    for (int ny = std::max(0, y - 1); ny <= std::min(size_ - 1, y + 1); ++ny) {
      for (int nx = std::max(0, x - 1); nx <= std::min(size_ - 1, x + 1); ++nx) {
        visit(static_cast<uint32_t>(ny) * size_ + nx);
      }
    }
  }

  const ObjectInfo& object_;
  const ObjectSurface& surface_;
  const TexturePhotos& photos_;
  const TextureOptions& options_;
  const Geometry geometry_;
  // Photos in which the surface lies.
  std::vector<int> used_;
  std::vector<Candidates> candidates_;
  // [vertices] Pixels on a unit of area in the photo with most detail; 0: none shows it.
  std::vector<float> detail_;
  std::vector<Vector3d> gains_;
  int size_ = 0;
  // Places of the texture's coordinates, in texels.
  std::vector<Vector2d> places_;
  Texels texels_;
  std::vector<Sum> sums_;         // [texels]
  std::vector<Sum> vertex_sums_;  // [vertices]
  SurfaceTexture texture_;
};

}  // namespace

std::string TextureOptions::Check() const {
  if (size >= kLeastTextureSize && size <= kMostTextureSize) return "";
  return "texture_size is " + std::to_string(size) + "; " + std::to_string(kLeastTextureSize) +
         " to " + std::to_string(kMostTextureSize) + " texels would be right.";
}

SurfaceTexture BakeTexture(const ExportableScene& scene,
                           const ObjectInfo& object,
                           const ObjectSurface& surface,
                           const TexturePhotos& photos,
                           const TextureOptions& options) {
  CHECK_EQ(options.Check(), "");
  CHECK(!surface.triangles.empty());
  SurfaceTexture texture = Baker(scene, object, surface, photos, options).Bake();
  texture.file = photos.Encode(texture.image);
  texture.extension = photos.Extension();
  return texture;
}

}  // namespace semfoam
