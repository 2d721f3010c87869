// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/data/training_views.h"
#include "foam/model/model.h"
#include "plugin/colmap/tracks.h"
#include "plugin/mask/masks.h"

#include <cmath>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// What the SfM tracks say of masks: a *region* is all pixels of one id in one photo, an
// *observation* is a point of the model seen in a region, and observations of one point or of
// neighbouring points in two photos are *linked*.

inline constexpr int32_t kNoLabel = -1;

struct Region {
  int32_t view = 0;
  int32_t mask_class = 0;
  int64_t num_pixels = 0;
  int32_t label = 0;       // what it is taken for; kNoLabel: dropped or split
  bool is_judged = false;  // enough points
  std::vector<uint32_t> observations;
  std::vector<int32_t> parts;  // of a split region: its labels, ascending
};

struct Observation {
  uint32_t point = 0;
  int32_t region = 0;
  float x = 0, y = 0;
  int32_t label = 0;  // what it says: the label of its region, of its part of it, or kNoLabel
  int32_t verdict = kNoLabel;  // what the other photos say
};

// A label and what speaks for it; labels around one point are few, so a vector of them is enough.
struct Vote {
  int32_t label = 0;
  float weight = 0;
};

// Adds to the vote for a label.
void AddVote(int32_t label, float weight, std::vector<Vote>* votes);

// How far the pixel at (x, y) is from what is another class or out of the photo: the largest square
// around it, by the pixels to each side, at most `most`, that is all of its class. -1 where (x, y)
// is outside of the image, which has the photo's size, or not a number.
int UniformRadius(const ClassImage& image, const PhotoRecord& photo, float x, float y, int most);

// Borders are ragged, and points on the edge of a thing are as often on what is behind it: within
// so many pixels of a border a pixel's class is not to be relied on.
int RaggedRadius(const PhotoRecord& photo);

// What one photo's mask shows: all that is asked of it before it is rewritten.
struct ViewEvidence {
  std::map<int32_t, int64_t> pixels_of;  // by class
  // The class at each place, kNoLabel where it is none or within RaggedRadius of a border.
  std::vector<int32_t> class_at;
};

// So many pixels from a border on, at kSafeSide pixels a side, a pixel's class is as sure as it
// gets.
inline constexpr int kSafePixels = 4;
inline constexpr int kSafeSide = 640;
int SafeRadius(const PhotoRecord& photo);

// Where the tracks see something in each of `num_views` views, in the order of the tracks.
std::vector<std::vector<Eigen::Vector2f>> PlacesByView(const std::vector<PixelObservations>& tracks,
                                                       size_t num_views);

// Nothing for held-out photos and empty images. Before the mask's ids have classes, `image` may
// also be the indices of its own ids (DecodedMask::indices), and so are those of the result.
ViewEvidence LookAtMask(const ClassImage& image,
                        const PhotoRecord& photo,
                        const std::vector<Eigen::Vector2f>& places);

// Makes such indices classes; `classes` [ids of the mask], no two of them the same but kUnlabelled.
void GiveClasses(const std::vector<int32_t>& classes, ViewEvidence* evidence);

// The observations of all points that masks have something to say of. Held-out photos have none,
// nor have observations within RaggedRadius of a border.
class Evidence {
 public:
  // `views` [photos] are LookAtMask at PlacesByView of `tracks` [seeds].
  Evidence(const std::vector<SeedPoint>& seeds,
           const std::vector<PixelObservations>& tracks,
           const std::vector<ViewEvidence>& views);

  std::vector<Region> regions;            // by view, then class
  std::vector<Observation> observations;  // by point

  // Calls f(other observation, weight) for what other photos saw of the same point and of its
  // neighbours.
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

  // How far the photos agree, over all pairs of observations of a point by two of them.
  struct PairAgreement {
    double kappa = NAN;  // Cohen's: 0 = as often as chance would have it, 1 = always
    double share = NAN;  // of the pairs whose labels are the same, 0..1
    int64_t num_pairs = 0;
  };
  PairAgreement Agreement() const;

 private:
  // Tracks are short (two or three photos), so what lies next to a point speaks too, with less
  // weight: points hardly apart are on the same object seven times in eight.
  static constexpr float kNeighborWeight = 0.5f;

  void FindNeighbors(const std::vector<Eigen::Vector3f>& positions);

  std::vector<uint32_t> offsets_;  // [points + 1] into observations
  std::vector<std::vector<uint32_t>> neighbors_;
};

}  // namespace semfoam
