// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/controllers/texture_source.h"

#include "foam/train/training_options.h"
#include "foam/util/available_memory.h"
#include "foam/util/error.h"
#include "foam/util/parallel.h"
#include "plugin/colmap/camera_models.h"
#include "plugin/colmap/camera_rays.h"
#include "plugin/dataset/scene_plan.h"
#include "plugin/dataset/training_scene.h"
#include "plugin/photo/photo_light.h"
#include "tools/controllers/coarse_views.h"
#include "tools/controllers/effects_report.h"
#include "tools/controllers/scene_loading.h"
#include "tools/images/image_files.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <glog/logging.h>

namespace semfoam {
namespace {

constexpr double kSamplesAlongEdge = 192;
constexpr double kDepthMargin = 0.02;
constexpr double kDepthPixels = 2;
constexpr int kJpegQuality = 92;
// Of poses, relative to the scene: what is written as text and read again is nearer than that.
constexpr double kSamePlace = 1e-6;
constexpr int64_t kRowsPerBlock = 16;

TrainingScene LoadPhotos(const SceneOptions& options) {
  ScenePlan plan = PlanScene(options);
  const ImageMemory memory = PlanImageMemory(/*image_cache_gb=*/-1,
                                             plan,
                                             TrainingOptions{},
                                             SweepMemory{},
                                             /*draws_any_number=*/false,
                                             AvailableMemory());
  return LoadScene(std::move(plan), memory);
}

class PhotosOfScene final : public TexturePhotos {
 public:
  PhotosOfScene(const Model& model,
                const ExportableScene& scene,
                const std::filesystem::path& foam_path,
                const SceneOptions& options,
                TextureFormat format)
      : photos_(LoadPhotos(options)),
        format_(format),
        scale_(scene.colmap_from_normalized.scale),
        most_bytes_(AvailableMemory() / 4) {
    FindUsed(model, foam_path, options);
    FindLabels(model);
    lights_ = ReadLights(foam_path.parent_path() / "effects.json", photos_.Photos()).lights;
    const CoarseViews views(model.foam, scene);
    for (int photo = 0; photo < NumPhotos(); ++photo) {
      if (IsUsed(photo)) LookAtFoam(views, scene, photo, foam_path);
    }
  }

  int NumPhotos() const override { return photos_.NumViews(); }
  const std::string& Name(int photo) const override { return photos_.Photos()[photo].name; }
  bool IsUsed(int photo) const override { return views_[photo].is_used; }
  int Width(int photo) const override { return photos_.Width(photo); }
  int Height(int photo) const override { return photos_.Height(photo); }
  Eigen::Vector3d Center(int photo) const override { return views_[photo].center; }
  double PixelAngle(int photo) const override { return views_[photo].pixel_angle; }

  std::optional<Eigen::Vector2d> Project(int photo, const Eigen::Vector3d& x) const override {
    const View& view = views_[photo];
    return semfoam::Project(view.camera, view.rotation * x + view.translation);
  }

  double VisibleDistance(int photo, const Eigen::Vector2d& pixel) const override {
    const View& view = views_[photo];
    const int x = static_cast<int>(pixel.x() / Width(photo) * view.coarse_width);
    const int y = static_cast<int>(pixel.y() / Height(photo) * view.coarse_height);
    // A mask tells where the outlines of nearer things are.
    const float farthest = FarthestVisible({view.coarse_width, view.coarse_height, view.distance},
                                           x,
                                           y,
                                           /*keeps_off_outlines=*/!HasLabels(photo));
    const double coarse_angle = view.pixel_angle * Width(photo) / view.coarse_width;
    return scale_ * farthest * (1 + kDepthMargin + kDepthPixels * coarse_angle);
  }

  std::shared_ptr<const TexturePhoto> Read(int photo) const override {
    if (kept_.count(photo) != 0) return kept_.at(photo);
    auto decoded = std::make_shared<const TexturePhoto>(Decode(photo));
    const auto bytes =
        static_cast<int64_t>(decoded->image.data.size() + decoded->is_known.size() +
                             decoded->labels.data.size() * sizeof(decoded->labels.data[0]));
    if (kept_bytes_ + bytes <= most_bytes_) {
      kept_bytes_ += bytes;
      kept_.emplace(photo, decoded);
    }
    return decoded;
  }

  std::string Encode(const Image8& image) const override {
    return format_ == TextureFormat::kPng ? EncodePng(image) : EncodeJpeg(image, kJpegQuality);
  }
  std::string Extension() const override { return format_ == TextureFormat::kPng ? "png" : "jpg"; }

 private:
  struct View {
    bool is_used = false;
    Camera camera;
    Eigen::Matrix3d rotation;  // camera from world
    Eigen::Vector3d translation;
    Eigen::Vector3d center;
    double pixel_angle = 0;
    int coarse_width = 0, coarse_height = 0;
    // Normalised frame; infinite where the foam shows nothing.
    std::vector<float> distance;
  };

  void FindUsed(const Model& model,
                const std::filesystem::path& foam_path,
                const SceneOptions& options) {
    std::map<std::string, const PhotoRecord*> records;
    for (const PhotoRecord& record : model.photos) records[record.name] = &record;
    views_.resize(NumPhotos());
    bool is_any_used = false, is_any_held_out = false;
    for (int photo = 0; photo < NumPhotos(); ++photo) {
      const PhotoRecord& record = photos_.Photos()[photo];
      View& view = views_[photo];
      view.camera = CameraOf(record, options.input_path);
      const Pose pose = PoseOf(record);
      view.rotation = pose.UnitRotation().toRotationMatrix();
      view.translation = pose.translation;
      view.center = -view.rotation.transpose() * view.translation;
      view.pixel_angle = PixelAngleOf(view.camera);
      const auto trained = records.find(record.name);
      if (trained == records.end()) continue;
      const Pose other = PoseOf(*trained->second);
      const Eigen::Vector3d other_center = -(other.UnitRotation().conjugate() * other.translation);
      if ((view.center - other_center).norm() > kSamePlace * (scale_ + view.center.norm())) {
        throw UserError(options.input_path.string(),
                        ": the camera of ",
                        record.name,
                        " is elsewhere in ",
                        foam_path.string(),
                        "; the workspace that the foam was trained on would be right.");
      }
      view.is_used = !trained->second->held_out;
      is_any_used |= view.is_used;
      is_any_held_out |= trained->second->held_out;
    }
    if (is_any_used || is_any_held_out) return;
    throw UserError(options.image_path.string(),
                    ": holds none of the photos that ",
                    foam_path.string(),
                    " was trained on; the workspace of that training would be right.");
  }

  static double PixelAngleOf(const Camera& camera) {
    const Eigen::Vector2d middle(0.5 * static_cast<double>(camera.width),
                                 0.5 * static_cast<double>(camera.height));
    const auto a = Unproject(camera, middle);
    const auto b = Unproject(camera, middle + Eigen::Vector2d(1, 0));
    return a && b ? (*a - *b).norm() : 1 / static_cast<double>(camera.width);
  }

  // The label of the foam for each class of the masks.
  void FindLabels(const Model& model) {
    std::map<MaskId, LabelId> label_of;
    for (const Label& label : model.labels) label_of[label.source_id] = label.id;
    for (const Label& label : photos_.Labels()) {
      const auto found = label_of.find(label.source_id);
      label_of_class_.push_back(found == label_of.end() ? kNoObject : found->second);
    }
  }

  void LookAtFoam(const CoarseViews& views,
                  const ExportableScene& scene,
                  int photo,
                  const std::filesystem::path& foam_path) {
    View& view = views_[photo];
    const PhotoRecord& record = photos_.Photos()[photo];
    const CameraRays rays = MakeCameraRays(CoarseCamera(record, kSamplesAlongEdge, foam_path),
                                           PoseOf(record),
                                           scene.colmap_from_normalized);
    view.coarse_width = rays.width;
    view.coarse_height = rays.height;
    for (const CoarseViews::Stop& stop : views.Look(rays)) {
      view.distance.push_back(stop.cell == kNoCell ? std::numeric_limits<float>::infinity()
                                                   : stop.distance);
    }
  }

  bool HasLabels(int photo) const { return photos_.HasMask(photo) && !label_of_class_.empty(); }

  TexturePhoto Decode(int photo) const {
    TexturePhoto decoded;
    const int width = Width(photo), height = Height(photo);
    const size_t count = static_cast<size_t>(width) * height;
    decoded.image = {width, height, std::vector<uint8_t>(3 * count)};
    const bool has_mask = HasLabels(photo);
    if (has_mask) decoded.labels = {width, height, std::vector<int32_t>(count)};
    const PhotoLight* const light = lights_.empty() ? nullptr : &lights_[photo];
    decoded.is_known.assign(count, 1);
    const std::unique_ptr<ViewPixels> pixels = photos_.OpenView(photo);
    ParallelForBlocks(height, kRowsPerBlock, [&](int64_t begin, int64_t end) {
      for (auto y = static_cast<int>(begin); y < end; ++y) {
        for (int x = 0; x < width; ++x) {
          const size_t at = static_cast<size_t>(y) * width + x;
          const PixelValue value = pixels->At(x, y);
          uint8_t* const rgb = &decoded.image.data[3 * at];
          std::copy(value.color, value.color + 3, rgb);
          if (has_mask && value.Class() != kUnlabelled) {
            decoded.labels.data[at] = Value(label_of_class_.at(Value(value.Class())));
          }
          if (photos_.IsIgnored(photo, x, y)) decoded.is_known[at] = 0;
          if (light == nullptr) continue;
          const Eigen::Vector3f color =
              ReferenceColor(value.color, *light, PlaceInPhoto({x + 0.5, y + 0.5}, width, height));
          if (!color.allFinite()) {
            decoded.is_known[at] = 0;
            continue;
          }
          for (int c = 0; c < 3; ++c) rgb[c] = static_cast<uint8_t>(std::lround(255 * color[c]));
        }
      }
    });
    return decoded;
  }

  const TrainingScene photos_;
  const TextureFormat format_;
  const double scale_;  // COLMAP units of a normalised one
  std::vector<View> views_;
  // [classes of the masks]
  std::vector<LabelId> label_of_class_;
  // Empty: none.
  std::vector<PhotoLight> lights_;
  const int64_t most_bytes_;
  mutable int64_t kept_bytes_ = 0;
  mutable std::map<int, std::shared_ptr<const TexturePhoto>> kept_;
};

}  // namespace

std::unique_ptr<TexturePhotos> MakeTextureSource(const Model& model,
                                                 const ExportableScene& scene,
                                                 const std::filesystem::path& foam_path,
                                                 SceneOptions photos,
                                                 TextureFormat format) {
  photos.max_image_size = -1;
  return std::make_unique<PhotosOfScene>(model, scene, foam_path, photos, format);
}

}  // namespace semfoam
