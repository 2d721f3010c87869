// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/dataset/training_scene.h"

#include "foam/util/error.h"
#include "foam/util/parallel.h"
#include "plugin/dataset/ray_tables.h"
#include "plugin/dataset/scene_memory.h"
#include "plugin/dataset/survey_places.h"
#include "plugin/mask/mask_evidence.h"
#include "plugin/util/files.h"

#include <algorithm>
#include <chrono>
#include <mutex>
#include <utility>

#include <glog/logging.h>

namespace semfoam {

namespace fs = std::filesystem;

TrainingScene::TrainingScene(ScenePlan plan, const LoadOptions& load)
    : plan_(std::move(plan)),
      views_(plan_.photos.size()),
      holds_pixels_(MemoryOf(plan_).held <= static_cast<uint64_t>(load.cache_bytes)),
      cache_bytes_(load.cache_bytes),
      most_open_views_(load.most_at_once > 0 ? load.most_at_once : NumThreads()) {
  const auto start = std::chrono::steady_clock::now();
  LoadPhotosAndMasks(load);
  if (plan_.masks.NumPaired() > 0) {
    names_warning_ = NameCorrectedLabels(
        plan_.labels_file, plan_.labels_are_given, consistency_, mask_classes_.labels, &labels_);
    AverageRegionFeatures();
  }
  seconds_decoding_ =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const std::vector<std::shared_ptr<const PixelRays>> rays =
      MakePhotoRays(plan_.photos, plan_.table_views);
  for (int view = 0; view < NumViews(); ++view) {
    views_[view].rays = rays[view];
    PlaceCamera(view);
  }
  AddSeeds(std::move(plan_.seed_cloud.points));
  plan_.seed_cloud.points = {};
}

void TrainingScene::AddSeeds(std::vector<SeedPoint> dense) {
  if (dense.empty()) return;
  if (seeds_.empty()) seeds_ = plan_.seeds;
  seeds_.insert(seeds_.end(), dense.begin(), dense.end());
}

void TrainingScene::LoadPhotosAndMasks(const LoadOptions& load) {
  DecodedMasks masks = DecodeAll(load);
  if (load.keeps_findings) kept_samples_ = masks.samples;
  if (plan_.mask_folder.empty()) return;
  mask_classes_ = NumberMasks(mask_contents_, plan_.masks, plan_.mask_folder, plan_.label_zero);
  if (plan_.masks_are_given && !NoIdsSentence().empty()) throw UserError(NoIdsSentence());
  labels_ = mask_classes_.labels;
  if (!plan_.seed_tracks.empty()) CorrectMaskClasses(std::move(masks.samples));
  if (!holds_pixels_) return;
  ForEachFile(NumViews(), most_open_views_, [&](int64_t i) {
    if (plan_.masks.masks[i].empty() || masks.indices[i].Empty()) return;
    views_[i].classes = ClassesOfMask(static_cast<int>(i), std::move(masks.indices[i]));
  });
}

// Decodes every file once before anything is trained, whether its pixels stay or not, so that
// damage is reported at once; but for what is known of photos that are not drawn.
TrainingScene::DecodedMasks TrainingScene::DecodeAll(const LoadOptions& load) {
  const int num_views = NumViews();
  const std::vector<std::vector<SurveyPlace>> places = SurveyPlacesOf(plan_);
  const bool is_judged = !plan_.seed_tracks.empty();
  const std::vector<std::vector<Eigen::Vector2f>> seed_places =
      PlacesByView(plan_.seed_tracks, plan_.photos.size());
  surveys_.resize(num_views);
  mask_contents_.resize(num_views);
  DecodedMasks masks;
  masks.indices.resize(num_views);
  masks.samples.resize(num_views);
  const auto is_decoded = [&](int64_t i) { return load.known == nullptr || plan_.IsDrawn(i); };
  int num_decoded = 0;
  for (int i = 0; i < num_views; ++i) num_decoded += is_decoded(i) ? 1 : 0;
  std::mutex report_mutex;
  int num_done = 0;
  ForEachFile(num_views, most_open_views_, [&](int64_t i) {
    const PhotoSize size = {Width(static_cast<int>(i)), Height(static_cast<int>(i))};
    if (!plan_.ignore_files[i].empty()) {
      views_[i].ignored = ReadIgnoredPixels(plan_.ignore_files[i], size, plan_.ignore_inverted);
    }
    if (!is_decoded(i)) {
      const PhotoFindings& known = load.known->photos[i];
      surveys_[i] = known.survey;
      views_[i].contrast = known.contrast;
      mask_contents_[i] = known.mask;
      masks.samples[i] = known.samples;
      return;
    }
    Image8 photo = DecodePhoto(static_cast<int>(i));
    surveys_[i] = SurveyPhoto(photo, places[i]);
    views_[i].contrast =
        BlockContrast(photo, [&](int x, int y) { return !views_[i].ignored.Contains(x, y); });
    const bool is_held = HoldsPixelsOf(static_cast<int>(i));
    if (is_held) views_[i].photo = std::move(photo);
    photo = Image8();
    if (!plan_.masks.masks[i].empty()) {
      DecodedMask mask = DecodeMask(plan_.masks.masks[i], size);
      mask_contents_[i] = std::move(mask.contents);
      if (is_judged) masks.samples[i] = LookAtMask(mask.indices, plan_.photos[i], seed_places[i]);
      if (is_held) masks.indices[i] = std::move(mask.indices);
    } else {
      masks.samples[i].index_at.assign(seed_places[i].size(), IdImage::kNone);
    }
    if (!load.report) return;
    const std::lock_guard lock(report_mutex);
    load.report(++num_done, num_decoded);
  });
  return masks;
}

void TrainingScene::CorrectMaskClasses(std::vector<IdSamples> samples) {
  std::vector<ViewEvidence> evidence;
  for (int view = 0; view < NumViews(); ++view) {
    evidence.push_back(GiveClasses(mask_classes_.Of(mask_contents_[view]), samples[view]));
    samples[view] = {};
  }
  MaskCorrection correction = CorrectMasks(plan_.seeds,
                                           plan_.seed_tracks,
                                           plan_.photos,
                                           plan_.mask_consistency,
                                           mask_classes_.labels,
                                           evidence);
  plan_.seed_tracks = {};
  consistency_ = std::move(correction.report);
  mask_rewriter_ = std::move(correction.rewriter);
  if (mask_rewriter_) labels_ = mask_rewriter_->labels();
}

void TrainingScene::PlaceCamera(int view) {
  const Pose pose = PoseOf(plan_.photos[view]);
  views_[view].origin = plan_.world_from_normalized.Invert(pose.Center());
  views_[view].world_from_cam = pose.UnitRotation().toRotationMatrix().transpose();
}

Image8 TrainingScene::DecodePhoto(int view) const {
  const PhotoSize size = {Width(view), Height(view)};
  Image8 photo = ReadPhoto(plan_.files[view]);
  if (PhotoSize{photo.width, photo.height} != plan_.file_sizes[view]) {
    throw UserError(plan_.files[view].string(),
                    ": has changed its size since it was first looked at; photos that stay as "
                    "they are would be right.");
  }
  return size == plan_.file_sizes[view] ? std::move(photo) : ReducePhoto(photo, size);
}

ClassImage TrainingScene::ClassesOfMask(int view, IdImage indices) const {
  ClassImage classes = ClassesOf(indices,
                                 mask_classes_.Of(mask_contents_[view]),
                                 static_cast<int>(mask_classes_.labels.size()));
  indices = {};
  return mask_rewriter_ ? mask_rewriter_->Rewrite(view, plan_.photos[view], classes)
                        : std::move(classes);
}

PixelValue TrainingScene::ValueAt(const Image8& photo,
                                  const ClassImage& classes,
                                  int x,
                                  int y) const {
  const size_t pixel = static_cast<size_t>(y) * photo.width + x;
  PixelValue value;
  std::copy_n(photo.data.data() + 3 * pixel, 3, value.color);
  value.SetClass(classes.Empty() ? kUnlabelled : classes[pixel]);
  return value;
}

std::unique_ptr<ViewPixels> TrainingScene::OpenView(int view) const {
  class Decoded final : public ViewPixels {
   public:
    Decoded(const TrainingScene& scene, int view)
        : scene_(scene), view_(scene.views_[view]), is_held_(scene.HoldsPixelsOf(view)) {
      if (is_held_) return;
      const fs::path& mask_file = scene.plan_.masks.masks[view];
      for (const fs::path& file : {scene.plan_.files[view], mask_file}) {
        if (file.empty() || fs::is_regular_file(file)) continue;
        throw UserError(file.string(),
                        ": is no longer there, while training still reads the photos and masks "
                        "that are not held in memory; files that stay until the end would be "
                        "right.");
      }
      // The mask first: its classes are made in several steps, each with an image of its own.
      if (!mask_file.empty()) {
        classes_ = scene.ClassesOfMask(
            view,
            DecodeMaskAgain(
                mask_file, {scene.Width(view), scene.Height(view)}, scene.mask_contents_[view])
                .indices);
      }
      photo_ = scene.DecodePhoto(view);
    }
    PixelValue At(int x, int y) const override {
      return is_held_ ? scene_.ValueAt(view_.photo, view_.classes, x, y)
                      : scene_.ValueAt(photo_, classes_, x, y);
    }

   private:
    const TrainingScene& scene_;
    const View& view_;
    bool is_held_;
    Image8 photo_;
    ClassImage classes_;
  };
  return std::make_unique<Decoded>(*this, view);
}

SceneFindings TrainingScene::TakeFindings() {
  CHECK_EQ(kept_samples_.size(), views_.size());
  SceneFindings findings;
  for (int view = 0; view < NumViews(); ++view) {
    findings.photos.push_back({surveys_[view],
                               views_[view].contrast,
                               mask_contents_[view],
                               std::move(kept_samples_[view])});
  }
  kept_samples_ = {};
  return findings;
}

const Image8& TrainingScene::Photo(int view) const {
  CHECK(HoldsPhoto(view));
  return views_[view].photo;
}

bool TrainingScene::RayDirection(int view, int x, int y, Eigen::Vector3f* direction) const {
  const View& v = views_[view];
  if (v.ignored.Contains(x, y) || !v.rays->Direction(x, y, direction)) return false;
  *direction = RotateToWorld(v.world_from_cam, *direction);
  return true;
}

bool TrainingScene::Ray(int view, int x, int y, TrainingRay* ray) const {
  CHECK(holds_pixels_);
  const View& v = views_[view];
  return RayOf(view, x, y, ValueAt(v.photo, v.classes, x, y), ray);
}

void TrainingScene::Prefetch(int view, int x, int y) const {
  if (!holds_pixels_) return;
  const View& v = views_[view];
  const size_t pixel = static_cast<size_t>(y) * v.photo.width + x;
  __builtin_prefetch(v.photo.data.data() + 3 * pixel);
  v.classes.Prefetch(pixel);
  v.rays->Prefetch(x, y);
  if (!depths_.empty()) {
    depths_[view].Prefetch((x + 0.5f) / static_cast<float>(v.photo.width),
                           (y + 0.5f) / static_cast<float>(v.photo.height));
  }
}

bool TrainingScene::RayOf(int view, int x, int y, const PixelValue& value, TrainingRay* ray) const {
  if (!excluded_.empty() && excluded_[view].Contains(x, y)) return false;
  const View& v = views_[view];
  Eigen::Vector3f in_camera;
  if (v.ignored.Contains(x, y) || !v.rays->Direction(x, y, &in_camera)) return false;
  ray->direction = RotateToWorld(v.world_from_cam, in_camera);
  ray->distance = depths_.empty() ? 0 : depths_[view].DistanceAlong(in_camera);
  const uint8_t* color = value.color;
  if (lights_.empty()) {
    ray->color = Eigen::Vector3f(color[0], color[1], color[2]) / 255.0f;
    ray->at_least = 0;
  } else {
    const Eigen::Vector2d place = PlaceInPhoto({x + 0.5, y + 0.5}, Width(view), Height(view));
    ray->color = LeastReferenceColor(color, lights_[view], place, &ray->at_least);
  }
  ray->class_index = value.Class();
  return true;
}

void TrainingScene::SetLights(std::vector<PhotoLight> lights) {
  CHECK(lights.empty() || lights.size() == views_.size());
  lights_ = std::move(lights);
}

void TrainingScene::SetPoses(const std::vector<Pose>& cam_from_world) {
  CHECK_EQ(cam_from_world.size(), views_.size());
  for (int view = 0; view < NumViews(); ++view) {
    plan_.photos[view].cam_from_world_rotation = cam_from_world[view].UnitRotation();
    plan_.photos[view].cam_from_world_translation = cam_from_world[view].translation;
    PlaceCamera(view);
  }
}

void TrainingScene::SetDepths(std::vector<PhotoDepths> depths) {
  CHECK(depths.empty() || depths.size() == views_.size());
  depths_ = std::move(depths);
}

void TrainingScene::SetPassesPerDraw(std::vector<int> passes) {
  CHECK(passes.empty() || passes.size() == views_.size());
  passes_per_draw_ = std::move(passes);
}

void TrainingScene::SetExcluded(std::vector<PixelBlocks> excluded) {
  CHECK(excluded.empty() || excluded.size() == views_.size());
  excluded_ = std::move(excluded);
}

LabelImage TrainingScene::LabelIds(int view) const {
  LabelImage image{Width(view), Height(view), {}};
  image.data.assign(static_cast<size_t>(image.width) * image.height, Value(kNoObject));
  if (!HasMask(view)) return image;
  const std::unique_ptr<ViewPixels> pixels = OpenView(view);
  size_t i = 0;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x, ++i) {
      image.data[i] = Value(LabelIdOf(labels_, pixels->At(x, y).Class()));
    }
  }
  return image;
}

}  // namespace semfoam
