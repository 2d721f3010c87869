// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/data/training_views.h"
#include "foam/model/model.h"
#include "foam/util/ids.h"
#include "plugin/colmap/tracks.h"
#include "plugin/mask/class_image.h"

#include <cmath>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// Collects the evidence of the SfM tracks about masks: a *region* is all pixels of one id in one
// photo, an *observation* is a point of the model seen in a region, and observations of one point
// or of neighbouring points in two photos are *linked*.

// A label of regions while masks are corrected: an index into RegionLabels::labels. Regions begin
// with the class of their id as their label.
enum class RegionLabel : int32_t {};
inline constexpr RegionLabel kNoLabel{-1};
constexpr int32_t Value(RegionLabel label) { return static_cast<int32_t>(label); }

struct Region {
  int32_t view = 0;
  ClassIndex mask_class{0};
  int64_t num_pixels = 0;
  // Label assigned to the region; kNoLabel: dropped or split.
  RegionLabel label{0};
  // Whether it has enough points to be judged.
  bool is_judged = false;
  // Indices into Evidence::observations.
  std::vector<uint32_t> observations;
  // Labels of the parts of a split region, ascending.
  std::vector<RegionLabel> parts;
};

struct Observation {
  // Index of the seed.
  uint32_t point = 0;
  // Index into Evidence::regions.
  int32_t region = 0;
  // Pixel of the photo record's size.
  float x = 0, y = 0;
  // Label voted for: that of the region, of the part of it that holds the pixel, or kNoLabel.
  RegionLabel label{0};
  // Label that the other photos vote for.
  RegionLabel verdict = kNoLabel;
};

// A label of any type and the weight of the votes for it. Few labels occur around a point, so a
// vector of votes is searched linearly.
template <typename T>
struct Vote {
  T label{};
  float weight = 0;
};

// Adds `weight` to the vote for `label`.
template <typename T>
void AddVote(T label, float weight, std::vector<Vote<T>>* votes) {
  for (Vote<T>& vote : *votes) {
    if (vote.label != label) continue;
    vote.weight += weight;
    return;
  }
  votes->push_back({label, weight});
}

// Returns the radius in pixels, at most `most`, of the largest square around pixel (x, y) that lies
// inside the photo and is all of one index; -1 if (x, y) lies outside of the image, which has the
// photo's size, or is not a number.
template <typename Index>
int UniformRadius(
    const IndexImage<Index>& image, const PhotoRecord& photo, float x, float y, int most);

// Returns the distance from a border, in pixels, within which a pixel's class is not used: borders
// of masks are ragged, and points on the edge of an object belong to its background as often as to
// it.
int RaggedRadius(const PhotoRecord& photo);

// What one photo's mask shows at the places of the tracks.
template <typename Index>
struct MaskSamples {
  // Number of pixels by index.
  std::map<Index, int64_t> pixels_of;
  // Index at each place; -1 where there is none or within RaggedRadius of a border.
  std::vector<Index> index_at;
};
// In indices of the mask's own ids, until the ids of all masks are numbered.
using IdSamples = MaskSamples<IdIndex>;
// Evidence of one photo's mask, kept until the mask is rewritten.
using ViewEvidence = MaskSamples<ClassIndex>;

// Distance from a border, in pixels of a photo of kSafeSide pixels a side, from which on a vote has
// full weight.
inline constexpr int kSafePixels = 4;
inline constexpr int kSafeSide = 640;
// Returns that distance in pixels of this photo.
int SafeRadius(const PhotoRecord& photo);

// Returns the observed pixels of each of `num_views` views, in the order of the tracks.
std::vector<std::vector<Eigen::Vector2f>> PlacesByView(const std::vector<PixelObservations>& tracks,
                                                       size_t num_views);

// Returns what one mask shows at `places`: nothing for held-out photos and empty images.
template <typename Index>
MaskSamples<Index> LookAtMask(const IndexImage<Index>& image,
                              const PhotoRecord& photo,
                              const std::vector<Eigen::Vector2f>& places);

// Returns the samples by classes; `classes` [ids of the mask] are distinct but for kUnlabelled.
ViewEvidence GiveClasses(const std::vector<ClassIndex>& classes, const IdSamples& samples);

// Regions, and the observations of all seeds inside them. Held-out photos have none, and pixels
// within RaggedRadius of a border are skipped.
class Evidence {
 public:
  // Links `tracks` [seeds]; `views` [photos] are LookAtMask at their PlacesByView.
  Evidence(const std::vector<SeedPoint>& seeds,
           const std::vector<PixelObservations>& tracks,
           const std::vector<ViewEvidence>& views);

  // By view, then class.
  std::vector<Region> regions;
  // By point.
  std::vector<Observation> observations;

  // Calls f(other observation, weight) for the observations of the same point and of its neighbours
  // in other photos.
  template <typename F>
  void ForEachLink(const Observation& observation, F&& f) const {
    const int32_t view = regions[observation.region].view;
    const auto visit = [&](uint32_t point, float weight) {
      for (uint32_t i = offsets_[point]; i < offsets_[point + 1]; ++i) {
        const Observation& other = observations[i];
        if (regions[other.region].view != view) f(other, weight);
      }
    };
    visit(observation.point, 1.f);
    for (const uint32_t neighbor : neighbors_[observation.point]) {
      visit(neighbor, kNeighborWeight);
    }
  }

  // Agreement of the labels over all pairs of observations of a point by two photos.
  struct PairAgreement {
    // Cohen's kappa: 0 = they agree as often as by chance, 1 = always.
    double kappa = NAN;
    // Share of the pairs whose labels are the same, 0..1.
    double share = NAN;
    int64_t num_pairs = 0;
  };
  PairAgreement Agreement() const;

 private:
  // Tracks are short (two or three photos), so neighbouring points vote too, with less weight:
  // adjacent points lie on the same object seven times in eight.
  static constexpr float kNeighborWeight = 0.5f;

  void FindNeighbors(const std::vector<Eigen::Vector3f>& positions);

  // [points + 1] Indices into observations.
  std::vector<uint32_t> offsets_;
  // [points] Neighbouring points that vote.
  std::vector<std::vector<uint32_t>> neighbors_;
};

}  // namespace semfoam
