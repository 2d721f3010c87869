// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask/mask_evidence.h"

#include "foam/geometry/delaunay.h"
#include "foam/geometry/guard_sites.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

namespace semfoam {
namespace {

constexpr size_t kNumNeighbors = 4;

// The index of a pixel that is not near a border; else kNone.
template <typename Index>
Index InnerIndex(const IndexImage<Index>& image, const PhotoRecord& photo, float x, float y) {
  const int radius = RaggedRadius(photo);
  if (UniformRadius(image, photo, x, y, radius) < radius) return image.kNone;
  return image[static_cast<size_t>(y) * photo.width + static_cast<size_t>(x)];
}

}  // namespace

int RaggedRadius(const PhotoRecord& photo) {
  return std::max(1, std::max(photo.width, photo.height) / 320);
}

int SafeRadius(const PhotoRecord& photo) {
  return kSafePixels * std::max(1, std::max(photo.width, photo.height) / kSafeSide);
}

template <typename Index>
int UniformRadius(
    const IndexImage<Index>& image, const PhotoRecord& photo, float x, float y, int most) {
  // Also keeps wild numbers from the conversion.
  if (!(x >= 0 && x < photo.width && y >= 0 && y < photo.height)) return -1;
  const int column = static_cast<int>(x);
  const int row = static_cast<int>(y);
  const auto at = [&](int i, int j) { return image[static_cast<size_t>(j) * photo.width + i]; };
  const Index own = at(column, row);
  for (int radius = 1; radius <= most; ++radius) {
    const int left = column - radius, right = column + radius;
    const int top = row - radius, bottom = row + radius;
    if (left < 0 || top < 0 || right >= photo.width || bottom >= photo.height) return radius - 1;
    for (int i = left; i <= right; ++i) {
      if (at(i, top) != own || at(i, bottom) != own) return radius - 1;
    }
    for (int j = top + 1; j < bottom; ++j) {
      if (at(left, j) != own || at(right, j) != own) return radius - 1;
    }
  }
  return most;
}

std::vector<std::vector<Eigen::Vector2f>> PlacesByView(const std::vector<PixelObservations>& tracks,
                                                       size_t num_views) {
  std::vector<std::vector<Eigen::Vector2f>> places(num_views);
  for (const PixelObservations& track : tracks) {
    for (const PixelObservation& seen : track) {
      places[seen.view].push_back(seen.pixel.cast<float>());
    }
  }
  return places;
}

template <typename Index>
MaskSamples<Index> LookAtMask(const IndexImage<Index>& image,
                              const PhotoRecord& photo,
                              const std::vector<Eigen::Vector2f>& places) {
  constexpr Index kNone = IndexImage<Index>::kNone;
  MaskSamples<Index> samples;
  samples.index_at.assign(places.size(), kNone);
  if (photo.held_out || image.Empty()) return samples;
  Index last = kNone;
  int64_t run = 0;
  const auto end_run = [&] {
    if (last != kNone) samples.pixels_of[last] += run;
  };
  const size_t pixels = static_cast<size_t>(photo.width) * photo.height;
  for (size_t i = 0; i < pixels; ++i) {
    const Index index = image[i];
    if (index != last) {
      end_run();
      run = 0;
    }
    last = index;
    ++run;
  }
  end_run();
  for (size_t k = 0; k < places.size(); ++k) {
    samples.index_at[k] = InnerIndex(image, photo, places[k].x(), places[k].y());
  }
  return samples;
}

template int UniformRadius(const ClassImage&, const PhotoRecord&, float, float, int);
template ViewEvidence LookAtMask(const ClassImage&,
                                 const PhotoRecord&,
                                 const std::vector<Eigen::Vector2f>&);
template IdSamples LookAtMask(const IdImage&,
                              const PhotoRecord&,
                              const std::vector<Eigen::Vector2f>&);

ViewEvidence GiveClasses(const std::vector<ClassIndex>& classes, const IdSamples& samples) {
  const auto class_of = [&](IdIndex own) { return classes[static_cast<size_t>(own)]; };
  ViewEvidence evidence;
  for (const auto& [own, pixels] : samples.pixels_of) {
    if (class_of(own) != kUnlabelled) evidence.pixels_of[class_of(own)] = pixels;
  }
  evidence.index_at.reserve(samples.index_at.size());
  for (const IdIndex own : samples.index_at) {
    evidence.index_at.push_back(own == IdImage::kNone ? kUnlabelled : class_of(own));
  }
  return evidence;
}

Evidence::Evidence(const std::vector<SeedPoint>& seeds,
                   const std::vector<PixelObservations>& tracks,
                   const std::vector<ViewEvidence>& views) {
  std::vector<std::map<ClassIndex, int32_t>> region_of(views.size());
  for (size_t view = 0; view < views.size(); ++view) {
    for (const auto& [c, pixels] : views[view].pixels_of) {
      region_of[view][c] = static_cast<int32_t>(regions.size());
      Region& region = regions.emplace_back();
      region.view = static_cast<int32_t>(view);
      region.mask_class = c;
      region.label = RegionLabel{Value(c)};
      region.num_pixels = pixels;
    }
  }
  std::vector<Eigen::Vector3f> positions;
  std::vector<size_t> next_place(views.size(), 0);
  for (size_t i = 0; i < tracks.size(); ++i) {
    const size_t before = observations.size();
    for (const PixelObservation& seen : tracks[i]) {
      const ClassIndex c = views[seen.view].index_at.at(next_place[seen.view]++);
      if (c == kUnlabelled) continue;
      const Eigen::Vector2f pixel = seen.pixel.cast<float>();
      Observation& observation = observations.emplace_back();
      observation.point = static_cast<uint32_t>(positions.size());
      observation.region = region_of[seen.view].at(c);
      observation.x = pixel.x();
      observation.y = pixel.y();
      observation.label = RegionLabel{Value(c)};
      regions[observation.region].observations.push_back(
          static_cast<uint32_t>(observations.size() - 1));
    }
    if (observations.size() == before) continue;
    offsets_.push_back(static_cast<uint32_t>(before));
    positions.push_back(seeds[i].position);
  }
  offsets_.push_back(static_cast<uint32_t>(observations.size()));
  FindNeighbors(positions);
}

// The nearest of a point's Delaunay neighbours, among which its nearest neighbour always is.
void Evidence::FindNeighbors(const std::vector<Eigen::Vector3f>& positions) {
  const Delaunay delaunay = Triangulate(WithGuardSites(positions));
  neighbors_.resize(positions.size());
  for (uint32_t i = 0; i < positions.size(); ++i) {
    std::vector<std::pair<float, uint32_t>> by_distance;
    for (const uint32_t j : delaunay.Neighbors(i)) {
      if (j < positions.size()) {
        by_distance.emplace_back((positions[j] - positions[i]).squaredNorm(), j);
      }
    }
    const size_t count = std::min(kNumNeighbors, by_distance.size());
    std::partial_sort(by_distance.begin(), by_distance.begin() + count, by_distance.end());
    for (size_t k = 0; k < count; ++k) neighbors_[i].push_back(by_distance[k].second);
  }
}

Evidence::PairAgreement Evidence::Agreement() const {
  std::map<RegionLabel, double> count_of_label;
  double count = 0;
  int64_t same = 0, pairs = 0;
  for (size_t point = 0; point + 1 < offsets_.size(); ++point) {
    for (uint32_t i = offsets_[point]; i < offsets_[point + 1]; ++i) {
      if (observations[i].label == kNoLabel) continue;
      ++count_of_label[observations[i].label];
      ++count;
      for (uint32_t j = offsets_[point]; j < i; ++j) {
        if (observations[j].label == kNoLabel ||
            regions[observations[j].region].view == regions[observations[i].region].view) {
          continue;
        }
        same += observations[j].label == observations[i].label;
        ++pairs;
      }
    }
  }
  if (pairs == 0) return {};
  double by_chance = 0;
  for (const auto& [label, n] : count_of_label) by_chance += (n / count) * (n / count);
  const double share = static_cast<double>(same) / static_cast<double>(pairs);
  const double kappa = by_chance >= 1 ? 1 : (share - by_chance) / (1 - by_chance);
  return {kappa, share, pairs};
}

}  // namespace semfoam
