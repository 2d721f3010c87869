// SPDX-License-Identifier: GPL-3.0-or-later
//
// Photos that do not fit into memory give the same bytes as photos that do.
#include "foam/data/pixel_cache.h"

#include "foam/train/trainer.h"
#include "foam/util/error.h"
#include "foam/util/parallel.h"

#include <atomic>
#include <cmath>
#include <limits>
#include <memory>
#include <set>
#include <string>

#include "tests/foam/foam_digest.h"
#include "tests/foam/synthetic_views.h"
#include "tests/mistake.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

constexpr int kWidth = 64, kHeight = 48;
constexpr int64_t kAll = std::numeric_limits<int64_t>::max();

// The synthetic room in photos of bytes, which are in memory or are not.
class RoomPhotos final : public TrainingViews {
 public:
  explicit RoomPhotos(int num_views, int64_t cache_bytes = kAll, int fails_at = -1)
      : room_(num_views, kWidth, kHeight, 0.2f),
        cache_bytes_(cache_bytes),
        fails_at_(fails_at),
        opened_(num_views) {}

  int NumViews() const override { return room_.NumViews(); }
  int Width(int) const override { return kWidth; }
  int Height(int) const override { return kHeight; }
  bool IsHeldOut(int view) const override { return room_.IsHeldOut(view); }
  Eigen::Vector3d Origin(int view) const override { return room_.Origin(view); }

  bool Ray(int view, int x, int y, TrainingRay* ray) const override {
    EXPECT_TRUE(HoldsPixels());
    return RayOf(view, x, y, ValueAt(view, x, y), ray);
  }
  bool RayDirection(int view, int x, int y, Eigen::Vector3f* direction) const override {
    *direction = room_.Direction(view, x, y);
    return true;
  }
  bool HoldsPixels() const override { return cache_bytes_ == kAll; }
  int64_t CacheBytes() const override { return cache_bytes_; }
  int MostOpenViews() const override { return 2; }
  std::unique_ptr<ViewPixels> OpenView(int view) const override {
    const int before = num_opened_++;
    if (before == fails_at_) throw UserError("photo ", view, " is gone.");
    ++opened_[view];
    return std::make_unique<OpenPhoto>(*this, view);
  }
  bool RayOf(int view, int x, int y, const PixelValue& value, TrainingRay* ray) const override {
    ray->direction = room_.Direction(view, x, y);
    for (int c = 0; c < 3; ++c) ray->color[c] = value.color[c] / 255.f;
    ray->class_index = value.Class();
    return true;
  }

  PixelValue ValueAt(int view, int x, int y) const {
    TrainingRay ray;
    room_.Ray(view, x, y, &ray);
    PixelValue value;
    for (int c = 0; c < 3; ++c) {
      value.color[c] = static_cast<uint8_t>(std::lround(255 * std::min(ray.color[c], 1.f)));
    }
    value.SetClass(x == 0 ? kUnlabelled : ray.class_index);
    return value;
  }
  const SyntheticViews& room() const { return room_; }
  int Opened(int view) const { return opened_[view]; }
  int num_opened() const { return num_opened_; }

 private:
  class OpenPhoto final : public ViewPixels {
   public:
    OpenPhoto(const RoomPhotos& photos, int view) : photos_(photos), view_(view) {
      EXPECT_LE(++photos_.num_open_, 3) << "two, and the one that is read ahead";
    }
    ~OpenPhoto() override { --photos_.num_open_; }
    PixelValue At(int x, int y) const override { return photos_.ValueAt(view_, x, y); }

   private:
    const RoomPhotos& photos_;
    int view_;
  };

  SyntheticViews room_;
  int64_t cache_bytes_;
  int fails_at_;
  mutable std::vector<std::atomic<int>> opened_;
  mutable std::atomic<int> num_opened_ = 0, num_open_ = 0;
};

DrawingPlan PlanOf(const TrainingViews& views, int64_t num_tiles) {
  std::vector<int> all, odd;
  for (int view = 0; view < views.NumViews(); ++view) {
    all.push_back(view);
    if (view % 2 == 1) odd.push_back(view);
  }
  DrawingPlan plan;
  plan.seed = 7;
  plan.num_tiles = static_cast<int>(num_tiles);
  plan.ranges = {PixelRange(views, odd), PixelRange(views, all)};
  plan.kept = {{5, 3, 4}, {0, 0, 0}, {5, 63, 47}};
  // Either of them in between.
  plan.ranges_at = [](int64_t iteration) {
    if (iteration < 20) return std::vector<int>{0};
    return iteration < 30 ? std::vector<int>{0, 1} : std::vector<int>{1};
  };
  return plan;
}

bool Same(const PixelValue& a, const PixelValue& b) {
  return std::equal(a.color, a.color + 3, b.color) && a.Class() == b.Class();
}

// Every pixel is the one that its place names, in one chapter and in many, also in a run that is
// taken up again.
TEST(PixelCache, HasWhatIsDrawn) {
  constexpr int kIterations = 60;
  for (const int64_t first : {0, 25}) {
    for (const int64_t bytes : {int64_t{10'000'000}, int64_t{40'000}}) {
      const RoomPhotos photos(8, bytes);
      DrawingPlan plan = PlanOf(photos, 50);
      plan.first_iteration = first;
      PixelCache cache(photos, plan);
      int64_t compared = 0;
      for (int64_t iteration = first; iteration < kIterations; ++iteration) {
        for (const int r : plan.ranges_at(iteration)) {
          const PixelRange& range = plan.ranges[r];
          const PixelValue* values = cache.Drawn(iteration, r, kIterations);
          const std::vector<int64_t> tiles = DrawTiles(7, iteration, 50, range);
          for (size_t i = 0; i < tiles.size() * kTileRays; ++i) {
            const ViewPixel pixel =
                TilePixel(range.At(tiles[i / kTileRays]), i % kTileRays, kWidth, kHeight);
            ASSERT_TRUE(Same(values[i], photos.ValueAt(pixel.view, pixel.x, pixel.y)));
            ++compared;
          }
        }
      }
      EXPECT_EQ(compared, (kIterations + 10 - (first == 0 ? 0 : 30)) * 200);
      for (size_t k = 0; k < plan.kept.size(); ++k) {
        const ViewPixel& pixel = plan.kept[k];
        EXPECT_TRUE(Same(cache.Kept(k), photos.ValueAt(pixel.view, pixel.x, pixel.y)));
      }
      const int64_t whole = PixelCache::BytesOfRun(plan, kIterations);
      if (bytes >= whole) {
        EXPECT_EQ(cache.num_chapters(), 1);
      } else {
        // Two are in memory at a time.
        EXPECT_GE(cache.num_chapters(), 2 * whole / bytes);
        EXPECT_LE(cache.num_chapters(), 2 * whole / bytes + 3);
      }
      for (int view = 0; view < 8; ++view) EXPECT_EQ(photos.Opened(view), cache.num_chapters());
    }
  }
}

TEST(PixelCache, MemoryIsPlannedBeforeItIsTaken) {
  const RoomPhotos photos(8, 10'000'000);
  const DrawingPlan plan = PlanOf(photos, 50);
  // 50 tiles of 4 pixels of 5 bytes and their place, 70 batches; and the three that are kept.
  EXPECT_EQ(PixelCache::BytesOfRun(plan, 60), 70 * 50 * 28 + 3 * 21);
  EXPECT_EQ(PixelCache::LeastBytes(plan), 4 * 50 * 28 + 3 * 21);
  const RoomPhotos enough(8, PixelCache::LeastBytes(plan));
  PixelCache cache(enough, plan);
  cache.Drawn(0, 0, 2);
  const RoomPhotos too_few(8, PixelCache::LeastBytes(plan) - 1);
  try {
    const PixelCache no(too_few, plan);
    FAIL();
  } catch (const UserError& error) {
    EXPECT_THAT(error.what(), NamesMistake("", {"image_cache_gb", "0.001"}, "is too little"));
  }
}

// Photos that vanish: at once, and from under the thread that reads ahead.
TEST(PixelCache, SaysWhichPhotoIsGone) {
  for (const int fails_at : {3, 11}) {
    const RoomPhotos photos(8, 40'000, fails_at);
    const DrawingPlan plan = PlanOf(photos, 50);
    PixelCache cache(photos, plan);
    std::string message;
    int64_t iteration = 0;
    try {
      for (; iteration < 20; ++iteration) cache.Drawn(iteration, 0, 60);
    } catch (const UserError& error) {
      message = error.what();
    }
    EXPECT_THAT(message, testing::MatchesRegex("photo [0-7] is gone."));
    EXPECT_TRUE(fails_at != 3 || iteration == 0);
    EXPECT_LT(iteration, 20) << "told when its turn has come, at the latest";
  }
}

TrainingOptions SmallRun() {
  TrainingOptions options;
  options.num_rays = 120'000;
  options.rays_per_iteration = 1024;
  options.initial_sites = 500;
  options.final_sites = 1500;
  options.sh_degree = 2;
  options.densify_events = 4;
  return options;
}

uint64_t DigestOfRun(const RoomPhotos& photos, const TrainingOptions& options) {
  const TrainingSummary summary = TrainFoam(photos, photos.room().Seeds(400), 3, options, nullptr);
  // What the held-out views look like is not in the foam.
  return DigestOf(summary) + static_cast<uint64_t>(1e9 * summary.last.held_out_psnr) +
         static_cast<uint64_t>(1e9 * summary.last.held_out_miou);
}

// 12 views to train on: one of them is a probe until the SH degree is settled.
TEST(PixelCache, ARunHasTheSameBytesWhateverTheMemory) {
  const TrainingOptions options = SmallRun();
  const uint64_t in_memory = DigestOfRun(RoomPhotos(16), options);
  for (const int threads : {1, 2, 5}) {
    const ThreadLimit limit(threads);
    const RoomPhotos one_chapter(16, 10'000'000);
    EXPECT_EQ(DigestOfRun(one_chapter, options), in_memory) << threads;
    EXPECT_EQ(one_chapter.num_opened(), 16) << "each photo once";
    const RoomPhotos many_chapters(16, 700'000);
    EXPECT_EQ(DigestOfRun(many_chapters, options), in_memory) << threads;
    EXPECT_GT(many_chapters.num_opened(), 4 * 16);
  }
  TrainingOptions other = options;
  other.random_seed = 1;
  EXPECT_NE(DigestOfRun(RoomPhotos(16), other), in_memory) << "the digest tells nothing";
}

// Where the SH degree is never settled early, at once, or late in a run of a few iterations; where
// the clock decides how long the run is.
TEST(PixelCache, KnowsWhatARunMayDrawFrom) {
  for (const int sh_degree : {0, 1, 3}) {
    for (const int rays : {4096, 30'000}) {
      for (const double seconds : {0.0, 1e-6}) {
        TrainingOptions options = SmallRun();
        options.num_rays = rays;
        options.sh_degree = sh_degree;
        options.seconds = seconds;
        options.densify_until = sh_degree == 3 ? 0.15 : 0.6;
        EXPECT_EQ(DigestOfRun(RoomPhotos(16, 500'000), options),
                  DigestOfRun(RoomPhotos(16), options))
            << sh_degree << " " << rays << " " << seconds;
      }
    }
  }
}

TEST(PixelCache, SaysHowManyPhotosAreRead) {
  const RoomPhotos photos(16, 10'000'000);
  TrainingOptions options = SmallRun();
  options.num_rays = 10'000;
  int last = 0;
  TrainFoam(photos, photos.room().Seeds(400), 3, options, [&](const TrainingProgress& progress) {
    if (progress.photos_to_read == 0) return;
    EXPECT_EQ(progress.photos_to_read, 16);
    EXPECT_EQ(progress.photos_read, last + 1);
    EXPECT_EQ(progress.iteration, 0);
    last = progress.photos_read;
  });
  EXPECT_EQ(last, 16);
}

}  // namespace
}  // namespace semfoam
