// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask_import/stroke_growing.h"

#include "plugin/mask_import/superpixels.h"
#include "plugin/util/files.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include <Eigen/Core>
#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <glog/logging.h>

namespace semfoam {
namespace {

// Superpixels along the longest side; smaller ones are hardly better, and take longer.
constexpr int kSpacingsAlong = 53;
constexpr int kLeastSpacing = 4;
// Difference of colours across which a walk hardly steps, and what it still does.
constexpr float kEdgeColor = 5;
constexpr float kEdgeStep = 0.01f;
// Width of the kernel by which the density of a label's colours is estimated, and the density that
// counts for no label: colours that are less likely are unknown.
constexpr float kKernelColor = 4;
constexpr double kUnknownDensity = 2e-3;
// How often a walk ends for a pixel by its colour.
constexpr double kColorEnds = 1e-3;
// Rounds of colours and growth.
constexpr int kColorRounds = 4;
// Lead over the second label from which the first one is clear.
constexpr double kClearLead = 0.3;
// Colours of a label, evenly taken of all.
constexpr size_t kMostColors = 400;

// The share of each label in a superpixel: [superpixels][columns], the last column is no label.
using Shares = Eigen::MatrixXd;

struct GrowingPhoto {
  Superpixels superpixels;
  // At the size of the superpixels.
  std::vector<int32_t> known;
  // The labels that are marked, ascending.
  std::vector<int32_t> ids;
  // [superpixels] The column of the label that is marked; -1 = none.
  std::vector<int32_t> marked;
  // [ids][superpixels] Whether a label may grow there; empty: everywhere.
  std::vector<std::vector<uint8_t>> allowed;
  Shares shares;
};

struct Color {
  Eigen::Vector3f lab = Eigen::Vector3f::Zero();
  float weight = 0;
};

// Calls visit(pixel) for the pixels that a line between two points passes, in steps of half a
// pixel, within the picture.
template <typename Visit>
void VisitLine(PolygonPoint from, PolygonPoint to, int width, int height, const Visit& visit) {
  // Points may be anywhere; what is far outside would take forever to pass.
  const auto inside = [&](PolygonPoint p) {
    return PolygonPoint{std::clamp(p.x, 0., static_cast<double>(width)),
                        std::clamp(p.y, 0., static_cast<double>(height))};
  };
  from = inside(from);
  to = inside(to);
  const int steps = 1 + static_cast<int>(2 * std::hypot(to.x - from.x, to.y - from.y));
  for (int k = 0; k <= steps; ++k) {
    const double share = static_cast<double>(k) / steps;
    const int x = std::min(width - 1, static_cast<int>(from.x + share * (to.x - from.x)));
    const int y = std::min(height - 1, static_cast<int>(from.y + share * (to.y - from.y)));
    visit(static_cast<size_t>(y) * width + x);
  }
}

// Calls visit(pixel) for the pixels whose centres are within a box scaled about its centre.
template <typename Visit>
void VisitBox(const Mark& box, double scale, int width, int height, const Visit& visit) {
  const auto [x0, x1] = std::minmax(box.points[0].x, box.points[1].x);
  const auto [y0, y1] = std::minmax(box.points[0].y, box.points[1].y);
  const double x = (x0 + x1) / 2, y = (y0 + y1) / 2;
  const double half_width = scale * (x1 - x0) / 2, half_height = scale * (y1 - y0) / 2;
  for (int v = 0; v < height; ++v) {
    if (std::abs(v + 0.5 - y) > half_height) continue;
    for (int u = 0; u < width; ++u) {
      if (std::abs(u + 0.5 - x) <= half_width) visit(static_cast<size_t>(v) * width + u);
    }
  }
}

// The marks in pixels of the superpixels.
std::vector<Mark> ScaledMarks(const MarkedPhoto& photo, const Superpixels& superpixels) {
  std::vector<Mark> marks = photo.marks;
  for (Mark& mark : marks) {
    for (PolygonPoint& point : mark.points) {
      point.x *= static_cast<double>(superpixels.width) / photo.size.width;
      point.y *= static_cast<double>(superpixels.height) / photo.size.height;
    }
  }
  return marks;
}

// Finds which superpixels are marked, and where labels in boxes may grow.
void PlaceMarks(const std::vector<Mark>& marks, GrowingPhoto* photo) {
  const Superpixels& superpixels = photo->superpixels;
  const int width = superpixels.width, height = superpixels.height;
  std::set<int32_t> ids, drawn;
  for (const Mark& mark : marks) {
    ids.insert(mark.id);
    if (!mark.is_box) drawn.insert(mark.id);
  }
  for (const int32_t id : photo->known) {
    if (id == 0) continue;
    ids.insert(id);
    drawn.insert(id);
  }
  photo->ids.assign(ids.begin(), ids.end());
  const auto column_of = [&](int32_t id) {
    return std::lower_bound(photo->ids.begin(), photo->ids.end(), id) - photo->ids.begin();
  };
  // Pixels of each label in each superpixel. Known ones count where they are half of it; of marks,
  // one is enough.
  const size_t count = superpixels.areas.size();
  std::vector<std::map<int32_t, int32_t>> pixels(count);
  for (size_t i = 0; i < photo->known.size(); ++i) {
    if (photo->known[i] != 0) ++pixels[superpixels.of_pixel[i]][photo->known[i]];
  }
  for (size_t k = 0; k < count; ++k) {
    std::erase_if(pixels[k],
                  [&](const auto& known) { return 2 * known.second < superpixels.areas[k]; });
  }
  photo->allowed.resize(photo->ids.size());
  for (const Mark& mark : marks) {
    const auto add = [&](size_t pixel) { ++pixels[superpixels.of_pixel[pixel]][mark.id]; };
    if (!mark.is_box) {
      for (size_t k = 0; k < mark.points.size(); ++k) {
        VisitLine(mark.points[k == 0 ? 0 : k - 1], mark.points[k], width, height, add);
      }
      continue;
    }
    std::vector<uint8_t>& allowed = photo->allowed[column_of(mark.id)];
    allowed.resize(count, 0);
    std::vector<int32_t> inside(count, 0);
    VisitBox(mark, 1, width, height, [&](size_t pixel) { ++inside[superpixels.of_pixel[pixel]]; });
    for (size_t k = 0; k < count; ++k) allowed[k] |= 2 * inside[k] > superpixels.areas[k];
    if (!drawn.contains(mark.id)) VisitBox(mark, 0.5, width, height, add);
  }
  photo->marked.assign(count, -1);
  for (size_t k = 0; k < count; ++k) {
    int32_t most = 0;
    for (const auto& [id, number] : pixels[k]) {
      if (number <= most) continue;
      most = number;
      photo->marked[k] = static_cast<int32_t>(column_of(id));
    }
  }
}

// Whether a label may be at a superpixel.
bool IsAllowed(const GrowingPhoto& photo, int64_t column, size_t k) {
  return photo.allowed[column].empty() || photo.allowed[column][k] != 0;
}

// The density of a label's colours: 1 where all of them are this one.
double Density(const std::vector<Color>& colors, const Eigen::Vector3f& lab) {
  float sum = 0, weight = 0;
  for (const Color& color : colors) {
    sum += color.weight *
           std::exp(-(color.lab - lab).squaredNorm() / (2 * kKernelColor * kKernelColor));
    weight += color.weight;
  }
  return weight > 0 ? sum / weight : 0;
}

// Where walks end by the colours; before these are known, at no label, so that a label does not
// take what is far from its marks.
Shares EndsByColor(const GrowingPhoto& photo,
                   const std::map<int32_t, std::vector<Color>>& colors_of) {
  const auto count = static_cast<int64_t>(photo.superpixels.areas.size());
  const auto none = static_cast<int64_t>(photo.ids.size());
  Shares ends = Shares::Zero(count, none + 1);
  for (int64_t k = 0; k < count; ++k) {
    for (int64_t c = 0; c < none; ++c) {
      const auto colors = colors_of.find(photo.ids[c]);
      if (colors == colors_of.end() || !IsAllowed(photo, c, k)) continue;
      ends(k, c) = Density(colors->second, photo.superpixels.colors[k]);
    }
    ends(k, none) = kUnknownDensity;
    ends.row(k) *= kColorEnds * photo.superpixels.areas[k] / ends.row(k).sum();
  }
  return ends;
}

// Solves for the probabilities of all walks: a sparse linear system with a row for each superpixel.
void Walk(const Shares& ends, GrowingPhoto* photo) {
  const Superpixels& superpixels = photo->superpixels;
  const auto count = static_cast<int64_t>(superpixels.areas.size());
  std::vector<Eigen::Triplet<double>> entries;
  Eigen::VectorXd diagonal = ends.rowwise().sum();
  Shares right = ends;
  for (const SuperpixelBorder& border : superpixels.borders) {
    const float squared =
        (superpixels.colors[border.a] - superpixels.colors[border.b]).squaredNorm();
    const double weight =
        border.length * (std::exp(-squared / (2 * kEdgeColor * kEdgeColor)) + kEdgeStep);
    diagonal[border.a] += weight;
    diagonal[border.b] += weight;
    const int32_t at_a = photo->marked[border.a], at_b = photo->marked[border.b];
    if (at_a < 0 && at_b < 0) {
      entries.emplace_back(border.a, border.b, -weight);
      entries.emplace_back(border.b, border.a, -weight);
    } else if (at_a < 0) {
      right(border.a, at_b) += weight;
    } else if (at_b < 0) {
      right(border.b, at_a) += weight;
    }
  }
  for (int64_t k = 0; k < count; ++k) {
    const int32_t column = photo->marked[k];
    if (column >= 0) {
      diagonal[k] = 1;
      right.row(k).setZero();
      right(k, column) = 1;
    }
    entries.emplace_back(k, k, diagonal[k]);
  }
  Eigen::SparseMatrix<double> matrix(count, count);
  matrix.setFromTriplets(entries.begin(), entries.end());
  // Positive definite: every row ends somewhere.
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(matrix);
  CHECK(solver.info() == Eigen::Success);
  photo->shares = solver.solve(right);
}

// Returns [superpixels] the column of the label that is clear; -1 = none is.
std::vector<int32_t> ClearLabels(const GrowingPhoto& photo) {
  const auto none = static_cast<int64_t>(photo.ids.size());
  std::vector<int32_t> clear(photo.superpixels.areas.size(), -1);
  for (size_t k = 0; k < clear.size(); ++k) {
    int64_t first = none;
    double most = -1, second = -1;
    for (int64_t c = 0; c <= none; ++c) {
      const double share = photo.shares(static_cast<int64_t>(k), c);
      second = std::max(second, std::min(share, most));
      if (share <= most) continue;
      most = share;
      first = c;
    }
    if (first < none && most - second >= kClearLead && IsAllowed(photo, first, k)) {
      clear[k] = static_cast<int32_t>(first);
    }
  }
  return clear;
}

// The colours of each label in all photos.
std::map<int32_t, std::vector<Color>> ColorsOf(const std::vector<GrowingPhoto>& photos) {
  std::map<int32_t, std::vector<Color>> all;
  for (const GrowingPhoto& photo : photos) {
    for (const int32_t id : photo.ids) all[id];
    const std::vector<int32_t> clear = ClearLabels(photo);
    for (size_t k = 0; k < clear.size(); ++k) {
      if (clear[k] < 0) continue;
      all[photo.ids[clear[k]]].push_back(
          {photo.superpixels.colors[k], static_cast<float>(photo.superpixels.areas[k])});
    }
  }
  for (auto& [id, colors] : all) {
    const size_t stride = (colors.size() + kMostColors - 1) / kMostColors;
    if (stride < 2) continue;
    std::vector<Color> some;
    for (size_t k = 0; k < colors.size(); k += stride) some.push_back(colors[k]);
    colors = std::move(some);
  }
  return all;
}

GrowingPhoto Prepare(const MarkedPhoto& photo) {
  const Image8 full = ReadPhoto(photo.file);
  const PhotoSize size = ReducedSize({full.width, full.height}, kGrownSide);
  const int spacing = std::max(kLeastSpacing, std::max(size.width, size.height) / kSpacingsAlong);
  GrowingPhoto growing;
  growing.superpixels = DivideIntoSuperpixels(ReducePhoto(full, size), spacing);
  if (photo.known.data.empty()) {
    growing.known.assign(growing.superpixels.of_pixel.size(), 0);
  } else {
    growing.known = ResizeLabels(photo.known, size).data;
  }
  PlaceMarks(ScaledMarks(photo, growing.superpixels), &growing);
  return growing;
}

LabelImage MaskOf(const GrowingPhoto& photo) {
  const std::vector<int32_t> clear = ClearLabels(photo);
  LabelImage mask{photo.superpixels.width, photo.superpixels.height, photo.known};
  for (size_t i = 0; i < mask.data.size(); ++i) {
    const int32_t column = clear[photo.superpixels.of_pixel[i]];
    if (mask.data[i] == 0 && column >= 0) mask.data[i] = photo.ids[column];
  }
  return mask;
}

}  // namespace

LabelImage ResizeLabels(const LabelImage& labels, const PhotoSize& size) {
  CHECK(labels.width > 0 && labels.height > 0 && size.width > 0 && size.height > 0);
  LabelImage resized{size.width, size.height, {}};
  resized.data.reserve(static_cast<size_t>(size.width) * size.height);
  for (int64_t y = 0; y < size.height; ++y) {
    const int64_t v = (2 * y + 1) * labels.height / (2 * int64_t{size.height});
    for (int64_t x = 0; x < size.width; ++x) {
      const int64_t u = (2 * x + 1) * labels.width / (2 * int64_t{size.width});
      resized.data.push_back(labels.data[v * labels.width + u]);
    }
  }
  return resized;
}

std::vector<LabelImage> GrowMarks(const std::vector<MarkedPhoto>& photos) {
  const auto count = static_cast<int64_t>(photos.size());
  std::vector<GrowingPhoto> growing(photos.size());
  ForEachFile(count, [&](int64_t i) {
    growing[i] = Prepare(photos[i]);
    Walk(EndsByColor(growing[i], {}), &growing[i]);
  });
  for (int round = 0; round < kColorRounds; ++round) {
    const std::map<int32_t, std::vector<Color>> colors = ColorsOf(growing);
    ForEachFile(count, [&](int64_t i) { Walk(EndsByColor(growing[i], colors), &growing[i]); });
  }
  std::vector<LabelImage> masks(photos.size());
  ForEachFile(count, [&](int64_t i) { masks[i] = MaskOf(growing[i]); });
  return masks;
}

}  // namespace semfoam
