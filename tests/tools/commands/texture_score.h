// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/texture/triangle_raster.h"
#include "foam/image/image.h"
#include "foam/model/model.h"
#include "plugin/colmap/camera_models.h"
#include "plugin/colmap/camera_rays.h"
#include "plugin/photo/photo.h"
#include "plugin/photo/photo_light.h"
#include "tools/controllers/effects_report.h"
#include "tools/images/image_files.h"

#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// How near the colours of exported meshes are to photos that gave none of them.

// An OBJ with vertex colours and a texture.
struct TexturedObj {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<Eigen::Vector3d> colors;       // [vertices], 0..1
  std::vector<Eigen::Vector2d> coordinates;  // 0..1, from the lower left corner
  std::vector<std::array<uint32_t, 3>> triangles;
  std::vector<std::array<uint32_t, 3>> texture_triangles;
  Image8 texture;

  Eigen::Vector3d VertexColor(uint32_t triangle, const Eigen::Vector3d& weights) const {
    Eigen::Vector3d color = Eigen::Vector3d::Zero();
    for (int k = 0; k < 3; ++k) color += weights[k] * colors[triangles[triangle][k]];
    return 255 * color;
  }

  // Interpolates between the centres of texels.
  Eigen::Vector3d TextureColor(uint32_t triangle, const Eigen::Vector3d& weights) const {
    Eigen::Vector2d place = Eigen::Vector2d::Zero();
    for (int k = 0; k < 3; ++k) place += weights[k] * coordinates[texture_triangles[triangle][k]];
    const double x = std::clamp(place.x() * texture.width - 0.5, 0.0, texture.width - 1.0);
    const double y = std::clamp((1 - place.y()) * texture.height - 0.5, 0.0, texture.height - 1.0);
    Eigen::Vector3d color = Eigen::Vector3d::Zero();
    for (int dy = 0; dy < 2; ++dy) {
      for (int dx = 0; dx < 2; ++dx) {
        const int tx = std::min(static_cast<int>(x) + dx, texture.width - 1);
        const int ty = std::min(static_cast<int>(y) + dy, texture.height - 1);
        const double fx = x - static_cast<int>(x), fy = y - static_cast<int>(y);
        const double weight = (dx == 1 ? fx : 1 - fx) * (dy == 1 ? fy : 1 - fy);
        const uint8_t* rgb = &texture.data[3 * (static_cast<size_t>(ty) * texture.width + tx)];
        color += weight * Eigen::Vector3d(rgb[0], rgb[1], rgb[2]);
      }
    }
    return color;
  }
};

inline TexturedObj ReadTexturedObj(const std::filesystem::path& path) {
  TexturedObj obj;
  std::ifstream lines(path);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string kind;
    words >> kind;
    if (kind == "v") {
      Eigen::Vector3d &v = obj.vertices.emplace_back(), &c = obj.colors.emplace_back();
      words >> v.x() >> v.y() >> v.z() >> c.x() >> c.y() >> c.z();
    } else if (kind == "vt") {
      Eigen::Vector2d& t = obj.coordinates.emplace_back();
      words >> t.x() >> t.y();
    } else if (kind == "f") {
      auto &triangle = obj.triangles.emplace_back(),
           &texture = obj.texture_triangles.emplace_back();
      for (int k = 0; k < 3; ++k) {
        char slash = 0;
        words >> triangle[k] >> slash >> texture[k];
        --triangle[k];
        --texture[k];
      }
    } else if (kind == "mtllib") {
      std::string name;
      words >> name;
      std::ifstream material(path.parent_path() / name);
      for (std::string entry; std::getline(material, entry);) {
        if (entry.rfind("map_Kd ", 0) == 0) {
          obj.texture = ReadPhoto(path.parent_path() / entry.substr(7));
        }
      }
    }
  }
  return obj;
}

struct TextureScore {
  int64_t pixels = 0;
  double vertex_error = 0;  // sum of squares over pixels and channels
  double texture_error = 0;

  static double Psnr(double error, int64_t pixels) {
    return 10 * std::log10(255.0 * 255 * 3 * static_cast<double>(pixels) / error);
  }
  double VertexPsnr() const { return Psnr(vertex_error, pixels); }
  double TexturePsnr() const { return Psnr(texture_error, pixels); }
};

// Compares an OBJ in the COLMAP frame with the held-out photos of a model, each in the reference
// exposure (`lights`, empty: none): in the pixels that the mesh covers and whose exact mask
// (`mask_path`/<photo>.png; empty: none) shows the object. A pixel is the mean of 2 x 2 places.
inline TextureScore ScoreTexture(const TexturedObj& obj,
                                 const Model& model,
                                 const std::filesystem::path& image_path,
                                 const std::filesystem::path& mask_path,
                                 const std::vector<PhotoLight>& lights,
                                 bool held_out = true) {
  constexpr int kSamples = 2;
  TextureScore score;
  for (size_t i = 0; i < model.photos.size(); ++i) {
    const PhotoRecord& record = model.photos[i];
    if (record.held_out != held_out) continue;
    const Image8 photo = ReadPhoto(image_path / record.name);
    const int width = photo.width, height = photo.height;
    const Camera camera = RescaledCamera(CameraOf(record, "model"), width, height);
    LabelImage mask;
    if (!mask_path.empty()) {
      const auto file = mask_path / std::filesystem::path(record.name).replace_extension(".png");
      if (!std::filesystem::exists(file)) continue;
      mask = ResizeNearest(ReadForeground(file).mask, width, height);
    }
    std::vector<ImageVertex> places(obj.vertices.size());
    for (size_t v = 0; v < places.size(); ++v) {
      const Eigen::Vector3d x =
          record.cam_from_world_rotation * obj.vertices[v] + record.cam_from_world_translation;
      const auto pixel = Project(camera, x);
      if (pixel && x.z() > 0) places[v] = {kSamples * *pixel, x.norm()};
    }
    const TriangleRaster raster =
        DrawTriangles(places, obj.triangles, kSamples * width, kSamples * height);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const size_t at = static_cast<size_t>(y) * width + x;
        if (!mask.data.empty() && mask.data[at] == 0) continue;
        Eigen::Vector3d vertex = Eigen::Vector3d::Zero(), texture = Eigen::Vector3d::Zero();
        bool is_covered = true;
        for (int s = 0; s < kSamples * kSamples; ++s) {
          const int sx = kSamples * x + s % kSamples, sy = kSamples * y + s / kSamples;
          const uint32_t f = raster.triangle[static_cast<size_t>(sy) * raster.width + sx];
          is_covered &= f != kNoTriangle;
          if (!is_covered) break;
          std::array<Eigen::Vector2d, 3> corners;
          Eigen::Vector3d weights;
          for (int k = 0; k < 3; ++k) corners[k] = places[obj.triangles[f][k]].pixel;
          weights = CornerWeights(corners, {sx + 0.5, sy + 0.5});
          for (int k = 0; k < 3; ++k) weights[k] /= places[obj.triangles[f][k]].distance;
          weights /= weights.sum();
          vertex += obj.VertexColor(f, weights) / (kSamples * kSamples);
          texture += obj.TextureColor(f, weights) / (kSamples * kSamples);
        }
        if (!is_covered) continue;
        const uint8_t* rgb = &photo.data[3 * at];
        Eigen::Vector3d truth(rgb[0], rgb[1], rgb[2]);
        if (!lights.empty()) {
          const Eigen::Vector3f color =
              ReferenceColor(rgb, lights[i], PlaceInPhoto({x + 0.5, y + 0.5}, width, height));
          if (!color.allFinite()) continue;
          truth = 255 * color.cast<double>();
        }
        ++score.pixels;
        score.vertex_error += (vertex - truth).squaredNorm();
        score.texture_error += (texture - truth).squaredNorm();
      }
    }
  }
  return score;
}

}  // namespace semfoam
