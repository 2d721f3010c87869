// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/util/random.h"
#include "plugin/mask/mask_consistency.h"
#include "plugin/mask/masked_photos.h"

#include <array>
#include <cstdint>
#include <iterator>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace semfoam {

inline constexpr int kWidth = 120, kHeight = 60, kViews = 12, kBand = 40;

// Masks in memory.
struct PaintedMasks {
  std::vector<Label> labels;        // one per class, ascending by source id
  std::vector<ClassImage> classes;  // one per photo, of its size; empty without a mask
};

// A wall of three things side by side, 40 pixels each, seen by twelve photos that differ in
// nothing. Points are few and seen three times, as in real models.
class Wall {
 public:
  // `first_id`: the things' ids are this and the next two.
  explicit Wall(int num_points = 300, uint32_t first_id = 7) {
    for (int view = 0; view < kViews; ++view) {
      PhotoRecord photo;
      photo.name = std::string("photo") + static_cast<char>('a' + view);
      photo.width = kWidth;
      photo.height = kHeight;
      photos.push_back(photo);
      ids.emplace_back(kWidth * kHeight);
      Paint(view, 0, 0, kWidth, [&](int x) { return static_cast<int>(first_id) + x / kBand; });
    }
    for (int i = 0; i < num_points; ++i) {
      CounterRandom random(1, 2, i);
      const auto x = static_cast<float>(kWidth * random.Uniform());
      const auto y = static_cast<float>(kHeight * random.Uniform());
      seeds.push_back({Eigen::Vector3f(x, y, 0) / kWidth, Eigen::Vector3f::Zero()});
      PixelObservations& track = tracks.emplace_back();
      std::set<int32_t> views;
      while (views.size() < 3) views.insert(static_cast<int32_t>(random.Below(kViews)));
      for (const int32_t view : views) track.push_back({view, {x, y}});
    }
  }

  // Gives the pixels of [left, right) below `top` the id of their column.
  template <typename F>
  void Paint(int view, int top, int left, int right, F&& id_of_column) {
    for (int y = top; y < kHeight; ++y) {
      for (int x = left; x < right; ++x) ids[view][y * kWidth + x] = id_of_column(x);
    }
  }
  void PaintBand(int view, int band, int id) {
    Paint(view, 0, band * kBand, (band + 1) * kBand, [&](int) { return id; });
  }

  // The photos' masks as they are painted.
  PaintedMasks Painted(bool zero_is_class = false) const {
    std::set<int> all;
    for (const auto& image : ids) all.insert(image.begin(), image.end());
    if (!zero_is_class) all.erase(0);
    PaintedMasks painted;
    for (const int id : all) {
      Label label;
      label.id = LabelId{id};
      label.source_id = static_cast<MaskId>(id);
      painted.labels.push_back(label);
    }
    for (int view = 0; view < kViews; ++view) {
      ClassImage image({kWidth, kHeight}, static_cast<int>(all.size()));
      for (int i = 0; i < kWidth * kHeight; ++i) {
        const auto found = all.find(ids[view][i]);
        if (found != all.end()) {
          image.Set(i, static_cast<ClassIndex>(std::distance(all.begin(), found)));
        }
      }
      painted.classes.push_back(std::move(image));
    }
    return painted;
  }

  MaskConsistencyReport Correct(MaskConsistency mode, bool zero_is_class = false) {
    masks = Painted(zero_is_class);
    const std::vector<std::vector<Eigen::Vector2f>> places = PlacesByView(tracks, photos.size());
    std::vector<ViewEvidence> views;
    for (size_t view = 0; view < photos.size(); ++view) {
      views.push_back(LookAtMask(masks.classes[view], photos[view], places[view]));
    }
    MaskCorrection correction = CorrectMasks(seeds, tracks, photos, mode, masks.labels, views);
    if (!correction.rewriter) return std::move(correction.report);
    masks.labels = correction.rewriter->labels();
    for (size_t view = 0; view < photos.size(); ++view) {
      ClassImage& image = masks.classes[view];
      image = correction.rewriter->Rewrite(static_cast<int>(view), photos[view], image);
    }
    return std::move(correction.report);
  }

  // The photos with their masks, held against the tracks as in Correct.
  MaskedPhotos HeldAgainstTracks(bool zero_is_class = false) {
    const PaintedMasks given = Painted(zero_is_class);
    MaskedPhotos result;
    result.photos = photos;
    result.given.labels = given.labels;
    result.consistency = Correct(MaskConsistency::kTracks, zero_is_class);
    result.labels = masks.labels;
    result.observations = tracks;
    CollectObservations(
        [&](int view) {
          return ViewMasks{given.classes[view], masks.classes[view]};
        },
        &result);
    return result;
  }

  // The label id of a corrected pixel; -1 where unlabelled.
  int IdAt(int view, int x, int y) const {
    const ClassIndex c = masks.classes[view][y * kWidth + x];
    return c == kUnlabelled ? -1 : Value(masks.labels[Value(c)].id);
  }
  std::array<int, 3> BandIds(int view) const {
    return {IdAt(view, 20, 30), IdAt(view, 60, 30), IdAt(view, 100, 30)};
  }

  std::vector<PhotoRecord> photos;
  std::vector<SeedPoint> seeds;
  std::vector<PixelObservations> tracks;
  std::vector<std::vector<int>> ids;  // of the masks, per view
  PaintedMasks masks;                 // after Correct
};

}  // namespace semfoam
