// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/texture/texture_baker.h"

#include "foam/util/parallel.h"

#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "tests/export/texture/test_meshes.h"
#include <gtest/gtest.h>

namespace semfoam {
namespace {

constexpr LabelId kBall{7};
constexpr int kSize = 200;
constexpr double kFocal = 260;

// The colour of a place of the unit sphere: smooth, with fine detail.
Eigen::Vector3d Paint(const Eigen::Vector3d& x) {
  return Eigen::Vector3d(128 + 60 * x.x() + 20 * std::sin(9 * x.y()),
                         110 + 50 * x.y(),
                         100 + 40 * x.z() + 20 * std::sin(7 * x.x()));
}

// Photos of the unit sphere by pinhole cameras that look at the origin.
class SpherePhotos : public TexturePhotos {
 public:
  struct Shot {
    Eigen::Vector3d center;
    bool is_used = true;
    // Added to its colours.
    double offset = 0;
    // The label of the sphere's pixels; 0: no mask.
    int label = 0;
    // How far the foam lets one see.
    double visible = std::numeric_limits<double>::infinity();
  };

  explicit SpherePhotos(std::vector<Shot> shots) : shots_(std::move(shots)) {
    for (size_t i = 0; i < shots_.size(); ++i) names_.push_back(std::to_string(i) + ".png");
  }

  int NumPhotos() const override { return static_cast<int>(shots_.size()); }
  const std::string& Name(int photo) const override { return names_[photo]; }
  bool IsUsed(int photo) const override { return shots_[photo].is_used; }
  int Width(int) const override { return kSize; }
  int Height(int) const override { return kSize; }
  Eigen::Vector3d Center(int photo) const override { return shots_[photo].center; }
  double PixelAngle(int) const override { return 1 / kFocal; }
  std::optional<Eigen::Vector2d> Project(int photo, const Eigen::Vector3d& x) const override {
    const Eigen::Vector3d in_camera = Axes(photo).transpose() * (x - shots_[photo].center);
    if (!(in_camera.z() > 0)) return std::nullopt;
    return kFocal / in_camera.z() * in_camera.head<2>() + Eigen::Vector2d::Constant(kSize / 2.0);
  }
  double VisibleDistance(int photo, const Eigen::Vector2d&) const override {
    return shots_[photo].visible;
  }

  std::shared_ptr<const TexturePhoto> Read(int photo) const override {
    auto read = std::make_shared<TexturePhoto>();
    read->image = {kSize, kSize, std::vector<uint8_t>(3 * kSize * kSize, 255)};
    const Shot& shot = shots_[photo];
    if (shot.label != 0) read->labels = {kSize, kSize, std::vector<int32_t>(kSize * kSize)};
    const Eigen::Matrix3d axes = Axes(photo);
    for (int y = 0; y < kSize; ++y) {
      for (int x = 0; x < kSize; ++x) {
        const Eigen::Vector3d direction =
            axes *
            Eigen::Vector3d(x + 0.5 - kSize / 2.0, y + 0.5 - kSize / 2.0, kFocal).normalized();
        const double along = -shot.center.dot(direction);
        const double off = shot.center.squaredNorm() - along * along;
        if (off > 1) continue;
        const Eigen::Vector3d place = shot.center + (along - std::sqrt(1 - off)) * direction;
        const Eigen::Vector3d color = Paint(place).array() + shot.offset;
        for (int c = 0; c < 3; ++c) {
          read->image.data[3 * (y * kSize + x) + c] =
              static_cast<uint8_t>(std::lround(std::clamp(color[c], 0.0, 255.0)));
        }
        if (shot.label != 0) read->labels.data[y * kSize + x] = shot.label;
      }
    }
    return read;
  }

  std::string Encode(const Image8& image) const override {
    return {image.data.begin(), image.data.end()};
  }
  std::string Extension() const override { return "png"; }

 private:
  // Columns: right, down, forward.
  Eigen::Matrix3d Axes(int photo) const {
    const Eigen::Vector3d forward = -shots_[photo].center.normalized();
    Eigen::Matrix3d axes;
    axes.col(0) = forward.unitOrthogonal();
    axes.col(1) = forward.cross(axes.col(0));
    axes.col(2) = forward;
    return axes;
  }

  std::vector<Shot> shots_;
  std::vector<std::string> names_;
};

// Cameras all around.
std::vector<SpherePhotos::Shot> AllAround() {
  std::vector<SpherePhotos::Shot> shots;
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {-1.0, 1.0}) {
      for (const double other : {-1.0, 1.0}) {
        Eigen::Vector3d center = Eigen::Vector3d::Constant(0.4);
        center[axis] = 3.5 * side;
        center[(axis + 1) % 3] = 1.5 * other;
        shots.push_back({center});
      }
    }
  }
  return shots;
}

constexpr Color8 kFoamColor = {20, 30, 40};

ObjectSurface Sphere() {
  const TestMesh mesh = Cube(14, 1);
  ObjectSurface surface;
  surface.object_id = kBall;
  surface.object_name = "ball";
  surface.vertices = mesh.vertices;
  surface.triangles = mesh.triangles;
  surface.vertex_color.assign(mesh.vertices.size(), kFoamColor);
  surface.vertex_confidence.assign(mesh.vertices.size(), 1.f);
  return surface;
}

SurfaceTexture Bake(const ObjectSurface& surface, const TexturePhotos& photos, int size = 2048) {
  const ExportableScene scene;
  ObjectInfo object;
  object.id = kBall;
  TextureOptions options;
  options.size = size;
  return BakeTexture(scene, object, surface, photos, options);
}

// The texture's colour at the middle of a triangle.
Eigen::Vector3d ColorOf(const SurfaceTexture& texture, uint32_t f) {
  Eigen::Vector2f place = Eigen::Vector2f::Zero();
  for (const uint32_t corner : texture.triangles[f]) place += texture.coordinates[corner] / 3;
  const auto x = static_cast<size_t>(place.x() * texture.image.width);
  const auto y = static_cast<size_t>(place.y() * texture.image.height);
  const uint8_t* rgb = &texture.image.data[3 * (y * texture.image.width + x)];
  return {double(rgb[0]), double(rgb[1]), double(rgb[2])};
}

Eigen::Vector3d MiddleOf(const ObjectSurface& surface, uint32_t f) {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const uint32_t corner : surface.triangles[f]) middle += surface.vertices[corner] / 3;
  return middle.normalized();
}

// The largest difference from Paint over all triangles that `is_asked` names.
template <typename IsAsked>
double Worst(const SurfaceTexture& texture, const ObjectSurface& surface, const IsAsked& is_asked) {
  double worst = 0;
  for (uint32_t f = 0; f < surface.triangles.size(); ++f) {
    const Eigen::Vector3d middle = MiddleOf(surface, f);
    if (!is_asked(middle)) continue;
    worst = std::max(worst, (ColorOf(texture, f) - Paint(middle)).cwiseAbs().maxCoeff());
  }
  return worst;
}
constexpr auto kEverywhere = [](const Eigen::Vector3d&) { return true; };

TEST(TextureBaker, ShowsWhatPhotosShow) {
  const ObjectSurface surface = Sphere();
  const SurfaceTexture texture = Bake(surface, SpherePhotos(AllAround()));
  EXPECT_LT(Worst(texture, surface, kEverywhere), 8);
  EXPECT_EQ(texture.extension, "png");
  EXPECT_EQ(texture.file.size(), texture.image.data.size());
  EXPECT_GT(texture.num_photo_texels, 0.99 * static_cast<double>(texture.num_texels));
  EXPECT_EQ(texture.num_photos, 12);
  // A pixel is about a hundredth of the radius: with texels of 0.7 pixels that makes 250 000.
  EXPECT_GT(texture.num_texels, 150'000);
  EXPECT_LT(texture.num_texels, 350'000);
  EXPECT_LT(texture.image.width, 2048);
  ASSERT_EQ(texture.vertex_of.size(), texture.coordinates.size());
  for (size_t f = 0; f < surface.triangles.size(); ++f) {
    for (int k = 0; k < 3; ++k) {
      EXPECT_EQ(texture.vertex_of[texture.triangles[f][k]], surface.triangles[f][k]);
    }
  }
}

TEST(TextureBaker, IsNoLargerThanAskedFor) {
  const ObjectSurface surface = Sphere();
  const SurfaceTexture texture = Bake(surface, SpherePhotos(AllAround()), 200);
  EXPECT_EQ(texture.image.width, 200);
  EXPECT_LT(Worst(texture, surface, kEverywhere), 20);
}

// A texture that is too small for all has what is near in detail, and the surroundings coarsely.
TEST(TextureBaker, SurroundingsLeaveTheTextureToWhatIsNear) {
  const ObjectSurface near = Sphere();
  ObjectSurface both = near;
  const auto count = static_cast<uint32_t>(near.vertices.size());
  for (const Eigen::Vector3d& vertex : near.vertices) {
    both.vertices.push_back(60 * vertex + Eigen::Vector3d(0, 0, 600));
    both.vertex_color.push_back(kFoamColor);
    both.vertex_confidence.push_back(1);
  }
  for (const auto& [a, b, c] : near.triangles) {
    both.triangles.push_back({a + count, b + count, c + count});
  }
  const SpherePhotos photos(AllAround());
  const SurfaceTexture texture = Bake(both, photos, 512);
  const SurfaceTexture alone = Bake(near, photos, 512);
  const auto texels_of_near = [&](const SurfaceTexture& of) {
    double area = 0;
    for (size_t f = 0; f < near.triangles.size(); ++f) {
      std::array<Eigen::Vector2d, 3> corners;
      for (int k = 0; k < 3; ++k) {
        corners[k] = 512 * of.coordinates[of.triangles[f][k]].cast<double>();
      }
      const Eigen::Vector2d ab = corners[1] - corners[0], ac = corners[2] - corners[0];
      area += 0.5 * std::abs(ab.x() * ac.y() - ab.y() * ac.x());
    }
    return area;
  };
  EXPECT_GT(texels_of_near(texture), 0.5 * texels_of_near(alone));
}

TEST(TextureBaker, HeldOutPhotosGiveNoTexel) {
  std::vector<SpherePhotos::Shot> shots = AllAround();
  const ObjectSurface surface = Sphere();
  const SurfaceTexture without = Bake(surface, SpherePhotos(shots));
  shots.push_back({{2.5, 0, 0}, /*is_used=*/false, /*offset=*/100});
  EXPECT_EQ(Bake(surface, SpherePhotos(shots)).file, without.file);
  shots.back().is_used = true;
  EXPECT_NE(Bake(surface, SpherePhotos(shots)).file, without.file);
}

TEST(TextureBaker, PhotosGiveNoTexelWhereTheirMaskShowsOtherThings) {
  std::vector<SpherePhotos::Shot> shots = AllAround();
  for (SpherePhotos::Shot& shot : shots) shot.label = Value(kBall);
  const ObjectSurface surface = Sphere();
  const SurfaceTexture without = Bake(surface, SpherePhotos(shots));
  EXPECT_LT(Worst(without, surface, kEverywhere), 8);
  shots.push_back({{2.5, 0, 0}, true, /*offset=*/100, /*label=*/8});
  EXPECT_EQ(Bake(surface, SpherePhotos(shots)).file, without.file);
}

TEST(TextureBaker, PhotosGiveNoTexelWhereTheFoamHidesTheSurface) {
  std::vector<SpherePhotos::Shot> shots = AllAround();
  const ObjectSurface surface = Sphere();
  const SurfaceTexture without = Bake(surface, SpherePhotos(shots));
  shots.push_back({{2.5, 0, 0}, true, /*offset=*/100, 0, /*visible=*/1});
  EXPECT_EQ(Bake(surface, SpherePhotos(shots)).file, without.file);
}

// Photos from above alone: below, the foam's colour is led on from what photos show.
TEST(TextureBaker, UnseenSidesHaveTheFoamsColourWithoutASeam) {
  std::vector<SpherePhotos::Shot> shots;
  for (const SpherePhotos::Shot& shot : AllAround()) {
    if (shot.center.z() > 1) shots.push_back(shot);
  }
  const ObjectSurface surface = Sphere();
  const SurfaceTexture texture = Bake(surface, SpherePhotos(shots));
  EXPECT_LT(texture.num_photo_texels, 0.8 * static_cast<double>(texture.num_texels));
  EXPECT_LT(Worst(texture, surface, [](const Eigen::Vector3d& x) { return x.z() > 0.5; }), 8);
  double worst = 0;
  for (uint32_t f = 0; f < surface.triangles.size(); ++f) {
    const Eigen::Vector3d middle = MiddleOf(surface, f);
    if (std::abs(middle.z() + 0.9) > 0.1) continue;
    const Eigen::Vector3d foam(kFoamColor[0], kFoamColor[1], kFoamColor[2]);
    worst = std::max(worst, (ColorOf(texture, f) - foam).maxCoeff());
  }
  EXPECT_GT(worst, 30);
}

TEST(TextureBaker, PhotosOfOtherLightAreLevelled) {
  std::vector<SpherePhotos::Shot> shots = AllAround();
  for (size_t i = 0; i < shots.size(); ++i) shots[i].offset = i % 2 == 0 ? 4 : -4;
  const ObjectSurface surface = Sphere();
  EXPECT_LT(Worst(Bake(surface, SpherePhotos(shots)), surface, kEverywhere), 10);
}

TEST(TextureBaker, WithoutPhotosTheFoamsColour) {
  const ObjectSurface surface = Sphere();
  const SurfaceTexture texture = Bake(surface, SpherePhotos({}));
  EXPECT_EQ(texture.num_photo_texels, 0);
  for (size_t i = 0; i < texture.image.data.size(); ++i) {
    ASSERT_EQ(texture.image.data[i], kFoamColor[i % 3]);
  }
}

TEST(TextureBaker, SameBytesOnAnyNumberOfThreads) {
  const ObjectSurface surface = Sphere();
  std::string first;
  for (const int threads : {1, 2, 5}) {
    const ThreadLimit limit(threads);
    const SurfaceTexture texture = Bake(surface, SpherePhotos(AllAround()));
    if (first.empty()) first = texture.file;
    EXPECT_EQ(texture.file, first) << threads;
  }
}

TEST(TextureBaker, SizeOutOfRange) {
  TextureOptions options;
  options.size = 63;
  EXPECT_NE(options.Check().find("texture_size is 63"), std::string::npos);
  options.size = 64;
  EXPECT_EQ(options.Check(), "");
}

}  // namespace
}  // namespace semfoam
