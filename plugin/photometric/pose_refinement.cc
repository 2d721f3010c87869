// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/photometric/pose_refinement.h"

#include "foam/util/median.h"
#include "plugin/photometric/camera_placement.h"
#include "plugin/photometric/track_adjustment.h"
#include "plugin/util/files.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <memory>
#include <unordered_map>
#include <utility>

namespace semfoam {
namespace {

// With fewer tracks, their errors say little.
constexpr size_t kFewestTracks = 100;
constexpr float kLeastOpacity = 0.5f;
// Longest side of a photo in samples of a patch, about: larger photos are sampled so far apart.
constexpr double kPatchResolution = 640;
// Pixels of the grid along an edge of a chessboard's block.
constexpr int kBlockEdge = 4;
constexpr double kDegrees = 180 / 3.14159265358979323846;

std::vector<Pose> PosesOf(const TrainingScene& scene) {
  std::vector<Pose> poses;
  poses.reserve(scene.NumViews());
  for (const PhotoRecord& photo : scene.Photos()) poses.push_back(PoseOf(photo));
  return poses;
}

}  // namespace

PoseRefiner::PoseRefiner(TrainingScene* scene, EffectSwitch mode)
    : scene_(scene), mode_(mode), given_(PosesOf(*scene)), first_(given_), poses_(given_) {}

void PoseRefiner::RefineByTracks() {
  if (!IsPossible()) return;
  const ScenePlan& plan = scene_->Plan();
  std::vector<TrackView> views;
  std::vector<CameraPlacement> before;
  for (int view = 0; view < scene_->NumViews(); ++view) {
    const PhotoRecord& photo = plan.photos[view];
    views.push_back({CameraOf(photo, plan.files[view]),
                     PlacementOf(poses_[view], plan.world_from_normalized),
                     photo.held_out});
    before.push_back(views.back().placement);
  }
  const AdjustableTracks tracks = MakeAdjustable(plan.tracks, plan.world_from_normalized, views);
  num_tracks_ = tracks.points.size();
  if (num_tracks_ < kFewestTracks) return;
  track_gain_ = TrackGain(tracks, before, AdjustToTracks(tracks, views, 0, 2), 1, 2);
  by_tracks_ = track_gain_ >= (mode_ == EffectSwitch::kOn ? 0 : kLeastTrackGain);
  if (!by_tracks_) return;
  const std::vector<CameraPlacement> adjusted = AdjustToTracks(tracks, views, 0, 1);
  for (size_t view = 0; view < poses_.size(); ++view) {
    if (!views[view].held_out) poses_[view] = PoseOf(adjusted[view], plan.world_from_normalized);
  }
  first_ = poses_;
  scene_->SetPoses(poses_);
}

std::vector<AlignedPixel> PoseRefiner::PixelsOf(const ComparedView& compared) const {
  const int view = compared.view;
  const ScenePlan& plan = scene_->Plan();
  const Camera camera = CameraOf(plan.photos[view], plan.files[view]);
  const CameraPlacement placement = PlacementOf(poses_[view], plan.world_from_normalized);
  const int width = scene_->Width(view), height = scene_->Height(view);
  const int spacing = std::max<int>(1, std::lround(std::max(width, height) / kPatchResolution));
  const int margin = kPatchRadius * spacing;
  const std::unique_ptr<ViewPixels> photo = scene_->OpenView(view);
  std::vector<AlignedPixel> pixels;
  for (size_t i = 0; i < compared.rendered.size(); ++i) {
    const RenderedRay& rendered = compared.rendered[i];
    const int x = compared.X(i), y = compared.Y(i);
    if (rendered.opacity < kLeastOpacity || !(rendered.distance > 0) || x < margin || y < margin ||
        x + margin >= width || y + margin >= height) {
      continue;
    }
    const auto frame = PixelFrameAt(camera, {x + 0.5, y + 0.5});
    if (!frame) continue;
    AlignedPixel& pixel = pixels.emplace_back();
    pixel.point =
        placement.center + rendered.distance * (placement.world_from_cam * frame->direction);
    pixel.frame = *frame;
    pixel.frame.pixels /= spacing;
    pixel.render = rendered.color.cast<double>().cwiseMin(1);
    pixel.half = (static_cast<int>(i) % compared.columns / kBlockEdge +
                  static_cast<int>(i) / compared.columns / kBlockEdge) %
                 2;
    for (int row = 0; row < kPatchEdge; ++row) {
      for (int column = 0; column < kPatchEdge; ++column) {
        const PixelValue value =
            photo->At(x + (column - kPatchRadius) * spacing, y + (row - kPatchRadius) * spacing);
        for (int c = 0; c < 3; ++c) {
          pixel.photo.values[c][row][column] = static_cast<float>(value.color[c]) / 255;
        }
      }
    }
  }
  return pixels;
}

void PoseRefiner::Decide(const std::vector<ComparedView>& views) {
  // Errors on held-back pixels, under a gain alone and aligned.
  std::vector<std::array<double, 2>> errors(views.size());
  ForEachFile(std::ssize(views), scene_->MostOpenViews(), [&](int64_t i) {
    const CameraPlacement start = PlacementOf(poses_[views[i].view], scene_->WorldFromNormalized());
    const std::vector<AlignedPixel> pixels = PixelsOf(views[i]);
    for (int half = 0; half < 2; ++half) {
      for (int moves = 0; moves < 2; ++moves) {
        errors[i][moves] +=
            AlignmentError(pixels, AlignPhoto(pixels, start, half, moves != 0), 1 - half);
      }
    }
  });
  double before = 0, after = 0;
  for (const std::array<double, 2>& of_view : errors) {
    before += of_view[0];
    after += of_view[1];
  }
  pixel_gain_ = before > 0 ? 1 - after / before : 0;
  by_pixels_ = mode_ == EffectSwitch::kOn || pixel_gain_ >= kLeastPixelGain;
  decided_ = true;
}

void PoseRefiner::Refine(const std::vector<ComparedView>& views) {
  if (!IsLooking() || views.empty()) return;
  const auto num_views = static_cast<int64_t>(views.size());
  const Similarity& frame = scene_->WorldFromNormalized();
  if (!decided_) Decide(views);
  if (!by_pixels_) return;
  std::vector<CameraPlacement> first(views.size()), aligned(views.size());
  ForEachFile(num_views, scene_->MostOpenViews(), [&](int64_t i) {
    const int view = views[i].view;
    first[i] = PlacementOf(first_[view], frame);
    aligned[i] =
        AlignPhoto(PixelsOf(views[i]), PlacementOf(poses_[view], frame), -1, true).placement;
  });
  RemoveDrift(first, &aligned);
  for (int64_t i = 0; i < num_views; ++i) poses_[views[i].view] = PoseOf(aligned[i], frame);
  scene_->SetPoses(poses_);
}

void PoseRefiner::Restore() {
  if (IsOn()) scene_->SetPoses(poses_);
}

PoseRefiner::Movements PoseRefiner::MeasureMovements() const {
  std::vector<double> degrees, shifts;
  const Similarity& frame = scene_->WorldFromNormalized();
  for (int view = 0; view < scene_->NumViews(); ++view) {
    if (scene_->IsHeldOut(view)) continue;
    const CameraPlacement from = PlacementOf(given_[view], frame);
    const CameraPlacement to = PlacementOf(poses_[view], frame);
    degrees.push_back(kDegrees * AngleBetween(from, to));
    shifts.push_back((from.center - to.center).norm());
  }
  Movements result;
  if (degrees.empty()) return result;
  result.median_degrees = Median(degrees);
  result.largest_degrees = *std::max_element(degrees.begin(), degrees.end());
  result.median_shift = Median(shifts);
  result.largest_shift = *std::max_element(shifts.begin(), shifts.end());
  return result;
}

std::string PoseRefiner::Report() const {
  if (scene_->Plan().has_rigs) {
    return "Poses stay as they are: cameras on rigs of several sensors are not refined";
  }
  std::string evidence;
  char text[256];
  if (num_tracks_ >= kFewestTracks) {
    std::snprintf(text,
                  sizeof(text),
                  "adjusted to half of %zu tracks, poses explain %.1f %% of the squared errors of "
                  "the other half",
                  num_tracks_,
                  100 * std::max(0.0, track_gain_));
    evidence = text;
  }
  if (decided_) {
    std::snprintf(
        text,
        sizeof(text),
        "%saligned to renders, %s explain %.1f %% of the squared error on held-back pixels",
        evidence.empty() ? "" : "; ",
        evidence.empty() ? "poses" : "they",
        100 * std::max(0.0, pixel_gain_));
    evidence += text;
  }
  if (evidence.empty()) evidence = "neither tracks nor renders tell";
  if (!IsOn()) return "Poses stay as they are: " + evidence;
  const Movements moved = MeasureMovements();
  std::snprintf(
      text,
      sizeof(text),
      "; photos turn by %.3f degrees (at most %.3f) and move by %.3f %% of the extent (at "
      "most %.3f)",
      moved.median_degrees,
      moved.largest_degrees,
      100 * moved.median_shift,
      100 * moved.largest_shift);
  return "Poses are refined: " + evidence + text;
}

Effect PoseRefiner::MakeEffect() const {
  Effect effect;
  effect.name = "poses";
  effect.on = IsOn();
  effect.by_option = mode_ != EffectSwitch::kAuto;
  effect.evidence = mode_ == EffectSwitch::kOff ? "not looked for" : Report();
  if (IsPossible()) {
    effect.measures["tracks"] = static_cast<double>(num_tracks_);
    effect.measures["track_gain"] = track_gain_;
  }
  if (decided_) effect.measures["pixel_gain"] = pixel_gain_;
  if (IsOn()) {
    const Movements moved = MeasureMovements();
    effect.measures["median_degrees"] = moved.median_degrees;
    effect.measures["largest_degrees"] = moved.largest_degrees;
    effect.measures["median_shift"] = moved.median_shift;
    effect.measures["largest_shift"] = moved.largest_shift;
  }
  effect.cost = "nothing in the training";
  return effect;
}

void WriteRefinedModel(const std::filesystem::path& input_path,
                       const std::vector<PhotoRecord>& photos,
                       const std::filesystem::path& folder) {
  const std::filesystem::path model_folder = FindModelFolder(input_path);
  Reconstruction model = ReadReconstruction(model_folder);
  std::unordered_map<std::string, Pose> poses;
  for (const PhotoRecord& photo : photos) {
    if (!photo.held_out) poses.emplace(photo.name, PoseOf(photo));
  }
  std::unordered_map<uint64_t, Pose> by_id;
  for (Image& image : model.images) {
    const auto found = poses.find(image.name);
    if (found == poses.end()) continue;
    image.cam_from_world = found->second;
    by_id.emplace(image.id, found->second);
  }
  if (model.frames) {
    // Each rig has one sensor, whose pose is the frame's.
    for (Frame& frame : *model.frames) {
      for (const FrameData& data : frame.data) {
        const auto found = by_id.find(data.id);
        if (found != by_id.end()) frame.rig_from_world = found->second;
      }
    }
  }
  WriteReconstruction(folder, model, FindModelFormat(model_folder));
}

}  // namespace semfoam
