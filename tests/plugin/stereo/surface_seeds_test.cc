// SPDX-License-Identifier: GPL-3.0-or-later
//
// A plane sweep of rendered photos, whose surfaces are known.
#include "plugin/stereo/surface_seeds.h"

#include "foam/geometry/guard_sites.h"
#include "foam/util/parallel.h"
#include "foam/util/random.h"
#include "plugin/colmap/camera_models.h"
#include "plugin/colmap/colmap_model.h"
#include "plugin/dataset/scene_plan.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <iterator>
#include <optional>
#include <string>
#include <vector>

#include "tests/plugin/test_util.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

// A wall at z = 2, of one colour beyond kPlain, and a ball before it. Cameras are near z = 0.
constexpr double kWall = 2, kPlain = 0.45, kBallRadius = 0.35;
// Size of lawns and paths, by that of the parts of the texture.
constexpr double kPatchSize = 6;
// More than there are in most tests.
constexpr int kPhotos = 150;
const Eigen::Vector3d kBall(-0.1, 0, 1.45);
// Of the ground, which takes the place of the ball in two tests; y is down.
constexpr double kGround = 0.5;
const Eigen::Vector3d kPatch(0.55, 0.4, kWall), kPrint(0.75, 0, kWall);

// A smooth random function of space, 0..1, that changes over some 0.04 units.
double Texture(const Eigen::Vector3d& x, uint64_t channel) {
  const Eigen::Vector3d at = x * 25;
  const Eigen::Vector3d cell = at.array().floor(), u = at - cell;
  double sum = 0;
  for (int corner = 0; corner < 8; ++corner) {
    uint64_t key = channel;
    double weight = 1;
    for (int axis = 0; axis < 3; ++axis) {
      const int step = corner >> axis & 1;
      key = key * 4096 + static_cast<uint64_t>(cell[axis] + step + 2048);
      weight *= step == 1 ? u[axis] : 1 - u[axis];
    }
    sum += weight * CounterRandom(7, 0x7e, key).Uniform();
  }
  return sum;
}

// Soft clouds in the sky.
Eigen::Vector3d CloudsAt(const Eigen::Vector3d& direction) {
  const double x = direction.x() / direction.z(), y = direction.y() / direction.z();
  const double cloud = 0.1 * std::sin(14 * x + 5 * y) * std::cos(11 * y - 3 * x);
  return Eigen::Vector3d(0.5, 0.65, 0.85) + Eigen::Vector3d(cloud, cloud, 0.5 * cloud);
}

// Returns the first surface point along a ray from z < 1 towards z > 0.
Eigen::Vector3d Hit(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) {
  const Eigen::Vector3d to_ball = kBall - origin;
  const double along = to_ball.dot(direction);
  const double square = kBallRadius * kBallRadius - (to_ball.squaredNorm() - along * along);
  if (square > 0) return origin + (along - std::sqrt(square)) * direction;
  return origin + (kWall - origin.z()) / direction.z() * direction;
}

// The same of the ground, instead of the ball.
Eigen::Vector3d HitOfGround(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) {
  const double to_wall = (kWall - origin.z()) / direction.z();
  const double to_ground = (kGround - origin.y()) / direction.y();
  return origin + (to_ground > 0 ? std::min(to_ground, to_wall) : to_wall) * direction;
}

bool IsOnGround(const Eigen::Vector3d& x) { return x.y() > kGround - 1e-9; }

double DistanceToSurface(const Eigen::Vector3d& x) {
  return std::min(std::abs(x.z() - kWall), std::abs((x - kBall).norm() - kBallRadius));
}

// `focal` is by the longest side.
Camera MakeCamera(uint32_t id, int model, uint64_t width, uint64_t height, double focal) {
  Camera camera;
  camera.id = id;
  camera.model_id = model;
  camera.width = width;
  camera.height = height;
  const double x = static_cast<double>(width), y = static_cast<double>(height);
  camera.params = {focal * std::max(x, y), x / 2 + 3, y / 2 - 2};
  if (model == 1) camera.params.insert(camera.params.begin(), 0.98 * focal * std::max(x, y));
  if (model == 2) camera.params.push_back(-0.25);
  return camera;
}

struct Rendering {
  // COLMAP's camera models of the photos, in turn: 1 PINHOLE, 2 SIMPLE_RADIAL.
  std::vector<int> camera_models = {1, 2};
  int num_photos = 12;
  // Longest side; every third photo is upright.
  int size = 240;
  int num_points = 80;
  bool has_tracks = true;
  // Number of the texture that the i-th photo shows, by name.
  std::function<int(int i)> texture = [](int) { return 0; };
  // Where the wall begins to be of one colour.
  double plain_from = kPlain;
  // Whether there is no wall there, but cloudy sky.
  bool has_sky = false;
  // Whether all surfaces are of one colour.
  bool is_plain = false;
  // Radius of a disc on the wall that is of one colour, around kPatch.
  double patch_radius = 0;
  // Radius of a disc on the wall, around kPrint, that has texture where the wall is of one colour.
  double print_radius = 0;
  // Whether there is ground instead of the ball, of lawns and paths that are each of one colour and
  // have no SfM point, and cameras of a wider angle show what lies before them.
  bool has_ground = false;
  // By how much the ground is brighter in the first photo.
  double brighter = 0;
};

// A workspace of rendered photos, on a grid of cameras that look at the ball.
class RenderedWorkspace {
 public:
  explicit RenderedWorkspace(const Rendering& rendering) : rendering_(rendering) {
    for (int i = 0; i < rendering.num_photos; ++i) AddPhoto(i);
    for (int i = 0; i < rendering.num_points; ++i) AddPoint(i);
    WriteReconstruction(temp_ / "sparse/0", model_, ModelFormat::kBinary);
  }

  TrainingScene Scene(int test_every = 0) const {
    SceneOptions options;
    options.image_path = temp_ / "images";
    options.input_path = temp_ / "sparse/0";
    options.test_every = test_every;
    return TrainingScene(PlanScene(options));
  }

  // Returns how many photos show a point that nothing hides.
  int64_t NumShowing(const Eigen::Vector3d& point) const {
    return std::count_if(model_.images.begin(), model_.images.end(), [&](const Image& image) {
      const Camera& camera = model_.cameras[image.camera_id - 1];
      const auto pixel = Project(
          camera, image.cam_from_world.UnitRotation() * point + image.cam_from_world.translation);
      return pixel && pixel->x() >= 0 && pixel->y() >= 0 &&
             pixel->x() < static_cast<double>(camera.width) &&
             pixel->y() < static_cast<double>(camera.height);
    });
  }

 private:
  void AddPhoto(int i) {
    const auto models = static_cast<int>(rendering_.camera_models.size());
    const bool is_upright = i % 3 == 2;
    const int width = is_upright ? rendering_.size * 3 / 4 : rendering_.size;
    const int height = is_upright ? rendering_.size : rendering_.size * 3 / 4;
    const Camera camera = MakeCamera(static_cast<uint32_t>(i + 1),
                                     rendering_.camera_models[i % models],
                                     width,
                                     height,
                                     rendering_.has_ground ? 0.6 : 0.95);
    model_.cameras.push_back(camera);

    Image image;
    image.id = static_cast<uint32_t>(i + 1);
    image.camera_id = camera.id;
    image.name =
        std::string(1, static_cast<char>('a' + i / 26)) + static_cast<char>('a' + i % 26) + ".png";
    const int columns = 4;
    const Eigen::Vector3d center(
        0.3 * (i % columns - 1.5), 0.3 * (i / columns % 3 - 1), 0.03 * (i % 5));
    const Eigen::Vector3d forward = (Eigen::Vector3d(0, 0, 1.8) - center).normalized();
    Eigen::Matrix3d world_from_cam;
    world_from_cam.col(0) = Eigen::Vector3d::UnitY().cross(forward).normalized();
    world_from_cam.col(1) = forward.cross(world_from_cam.col(0));
    world_from_cam.col(2) = forward;
    image.cam_from_world.rotation = Eigen::Quaterniond(world_from_cam.transpose());
    image.cam_from_world.translation = -(world_from_cam.transpose() * center);
    model_.images.push_back(image);
    Render(camera, image, world_from_cam, center, rendering_.texture(i));
  }

  void Render(const Camera& camera,
              const Image& image,
              const Eigen::Matrix3d& world_from_cam,
              const Eigen::Vector3d& center,
              int texture) const {
    const auto width = static_cast<int>(camera.width), height = static_cast<int>(camera.height);
    std::vector<uint8_t> samples;
    CounterRandom random(5, 0x4e, image.id);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        Eigen::Vector3d sum = Eigen::Vector3d::Zero();
        for (int k = 0; k < 4; ++k) {
          const auto ray = Unproject(camera, {x + 0.25 + 0.5 * (k % 2), y + 0.25 + 0.5 * (k / 2)});
          if (!ray) continue;
          const Eigen::Vector3d direction = (world_from_cam * *ray).normalized();
          const Eigen::Vector3d hit =
              rendering_.has_ground ? HitOfGround(center, direction) : Hit(center, direction);
          sum += (rendering_.has_sky && IsBeyondTexture(hit) ? CloudsAt(direction)
                                                             : ColorAt(hit, texture)) /
                 4;
          if (rendering_.has_ground && IsOnGround(hit) && image.id == 1) {
            sum.array() += rendering_.brighter / 4;
          }
        }
        for (int c = 0; c < 3; ++c) {
          const double noise = 5 * random.Uniform() - 2.5;
          samples.push_back(
              static_cast<uint8_t>(std::lround(std::clamp(255 * sum[c] + noise, 0.0, 255.0))));
        }
      }
    }
    WritePng(temp_ / "images" / image.name, width, height, 8, PNG_COLOR_TYPE_RGB, samples);
  }

  bool IsBeyondTexture(const Eigen::Vector3d& x) const {
    return x.z() > kWall - 1e-9 && x.x() > rendering_.plain_from;
  }

  Eigen::Vector3d ColorAt(const Eigen::Vector3d& x, int texture) const {
    if (rendering_.has_ground && IsOnGround(x)) {
      const bool is_path = Texture(x / kPatchSize, 0) > 0.5;
      return is_path ? Eigen::Vector3d(0.75, 0.7, 0.65) : Eigen::Vector3d(0.3, 0.4, 0.25);
    }
    const bool is_of_plain_wall =
        IsBeyondTexture(x) && (x - kPrint).norm() >= rendering_.print_radius;
    const bool is_of_patch = (x - kPatch).norm() < rendering_.patch_radius;
    if (rendering_.is_plain || is_of_plain_wall || is_of_patch) return {0.95, 0.95, 0.95};
    const auto first = static_cast<uint64_t>(3 * texture);
    return {Texture(x, first), Texture(x, first + 1), Texture(x, first + 2)};
  }

  // A point on the wall, or, every eighth, on the ball if there is one.
  void AddPoint(int i) {
    CounterRandom random(3, 0x99, i);
    const double x = random.Uniform() - 0.5, y = random.Uniform() - 0.5;
    Point3D point;
    point.id = static_cast<uint64_t>(i + 1);
    if (rendering_.has_ground) {
      point.position = {1.2 * x, kGround * (y - 0.5), kWall};
    } else {
      point.position = i % 8 == 0 ? Hit(Eigen::Vector3d::Zero(),
                                        (kBall + 0.3 * Eigen::Vector3d(x, y, 0)).normalized())
                                  : Eigen::Vector3d(1.2 * x, 1.2 * y, kWall);
    }
    for (Image& image : model_.images) {
      if (!rendering_.has_tracks) break;
      const auto pixel = Project(
          model_.cameras[image.camera_id - 1],
          image.cam_from_world.UnitRotation() * point.position + image.cam_from_world.translation);
      if (!pixel) continue;
      point.track.push_back({image.id, static_cast<uint32_t>(image.points.size())});
      image.points.push_back({pixel->x(), pixel->y(), point.id});
    }
    model_.points.push_back(point);
  }

  Rendering rendering_;
  TempFolder temp_;
  Reconstruction model_;
};

std::vector<Eigen::Vector3d> WorldPositions(const TrainingScene& scene, const SurfaceSeeds& seeds) {
  std::vector<Eigen::Vector3d> positions;
  for (const SeedPoint& seed : seeds.points) {
    positions.push_back(scene.WorldFromNormalized().Apply(seed.position.cast<double>()));
  }
  return positions;
}

// Share of the positions within so many percent of their distance from the cameras.
double ShareWithin(const std::vector<Eigen::Vector3d>& positions, double percent) {
  const auto count = std::count_if(positions.begin(), positions.end(), [&](const auto& x) {
    return DistanceToSurface(x) < percent / 100 * x.norm();
  });
  return static_cast<double>(count) / static_cast<double>(positions.size());
}

// Numbers of training rays.
struct Distances {
  int num_rays = 0;
  // With a distance, and with one that is right within 1 %.
  int num_known = 0, num_right = 0;
};

// Returns the numbers of those rays of which is_counted(view, surface point), with the point by
// `hit`.
template <typename HitFunction, typename IsCounted>
Distances DistancesOf(const TrainingScene& scene,
                      const HitFunction& hit,
                      const IsCounted& is_counted) {
  const Similarity& world_from_normalized = scene.WorldFromNormalized();
  Distances distances;
  for (int view = 0; view < scene.NumViews(); ++view) {
    const Eigen::Vector3d origin = scene.Origin(view);
    const Eigen::Vector3d eye = world_from_normalized.Apply(origin);
    for (int y = 0; y < scene.Height(view); ++y) {
      for (int x = 0; x < scene.Width(view); ++x) {
        TrainingRay ray;
        if (!scene.Ray(view, x, y, &ray)) continue;
        if (scene.IsHeldOut(view)) {
          EXPECT_EQ(ray.distance, 0);
          continue;
        }
        const auto point_at = [&](double distance) {
          return world_from_normalized.Apply(origin + distance * ray.direction.cast<double>());
        };
        const Eigen::Vector3d truth = hit(eye, (point_at(1) - eye).normalized());
        if (!is_counted(view, truth)) continue;
        ++distances.num_rays;
        if (ray.distance == 0) continue;
        ++distances.num_known;
        const double ratio = (point_at(ray.distance) - eye).norm() / (truth - eye).norm();
        distances.num_right += std::abs(ratio - 1) < 0.01;
      }
    }
  }
  return distances;
}

std::string Bytes(const SurfaceSeeds& seeds) {
  std::string bytes;
  for (const SeedPoint& seed : seeds.points) {
    for (const Eigen::Vector3f* v : {&seed.position, &seed.color}) {
      bytes.append(reinterpret_cast<const char*>(v->data()), 3 * sizeof(float));
    }
  }
  return bytes;
}

void ExpectSurfaces(const Rendering& rendering) {
  const RenderedWorkspace workspace(rendering);
  const TrainingScene scene = workspace.Scene();
  const SurfaceSeeds seeds = FindSurfaceSeeds(scene, kPhotos);
  EXPECT_EQ(seeds.num_swept, rendering.num_photos);
  const std::vector<Eigen::Vector3d> positions = WorldPositions(scene, seeds);
  // Of 173 000 pixels, most of textured surfaces.
  ASSERT_GT(positions.size(), 60'000u);
  EXPECT_GT(ShareWithin(positions, 0.5), 0.9);
  EXPECT_GT(ShareWithin(positions, 1), 0.98);

  // The wall's plane goes on around a print where it is of one colour.
  std::vector<Eigen::Vector3d> plain;
  std::copy_if(positions.begin(), positions.end(), std::back_inserter(plain), [&](const auto& x) {
    return x.x() > kPlain + 0.04 && (x - kPrint).norm() > rendering.print_radius + 0.04;
  });
  EXPECT_GT(plain.size(), 2000u);
  EXPECT_GT(ShareWithin(plain, 1), 0.99);
  // The ball has seeds all over what is seen of it by most cameras.
  std::vector<int> on_ball(8 * 8);
  for (const Eigen::Vector3d& x : positions) {
    const Eigen::Vector3d from_middle = (x - kBall) / kBallRadius;
    if (x.z() > 1.6) continue;
    const auto at = [](double v) { return std::clamp(static_cast<int>(4 * (v + 1)), 0, 7); };
    ++on_ball[at(from_middle.x()) * 8 + at(from_middle.y())];
  }
  for (int x = 2; x < 6; ++x) {
    for (int y = 2; y < 6; ++y) EXPECT_GT(on_ball[x * 8 + y], 100) << x << " " << y;
  }
  for (const SeedPoint& seed : seeds.points) ASSERT_TRUE(seed.is_dense);
  EXPECT_THAT(seeds.Report(),
              HasSubstr("Plane sweep: " + std::to_string(positions.size()) + " seeds from " +
                        std::to_string(rendering.num_photos) + " photos in "));
}

TEST(SurfaceSeeds, AreOnTheSurfaces) {
  ExpectSurfaces({.camera_models = {1}, .num_photos = 9, .print_radius = 0.15});
}

TEST(SurfaceSeeds, AreOnTheSurfacesWithDistortedCameras) {
  ExpectSurfaces({.camera_models = {1, 2}, .num_photos = 9, .print_radius = 0.15});
}

TEST(SurfaceSeeds, DoWithoutTracks) {
  ExpectSurfaces({.num_photos = 9, .has_tracks = false, .print_radius = 0.15});
}

TEST(SurfaceSeeds, FillPlainPatches) {
  constexpr double kRadius = 0.12;
  const RenderedWorkspace workspace({.num_photos = 9, .plain_from = 100, .patch_radius = kRadius});
  const TrainingScene scene = workspace.Scene();
  std::vector<Eigen::Vector3d> inside = WorldPositions(scene, FindSurfaceSeeds(scene, kPhotos));
  // Windows do not reach there.
  std::erase_if(inside, [](const auto& x) { return (x - kPatch).norm() > 0.6 * kRadius; });
  EXPECT_GT(inside.size(), 50u);
  EXPECT_GT(ShareWithin(inside, 1), 0.98);
}

TEST(SurfaceSeeds, TellRaysTheirDistances) {
  const RenderedWorkspace workspace({.num_photos = 9});
  TrainingScene scene = workspace.Scene(/*test_every=*/8);
  SurfaceSeeds seeds = FindSurfaceSeeds(scene, kPhotos);
  ASSERT_EQ(seeds.depths.size(), static_cast<size_t>(scene.NumViews()));
  EXPECT_LE(seeds.depths[1].inverse.size() * sizeof(float), PhotoDepthBytes(1));
  scene.SetDepths(std::move(seeds.depths));
  const Distances all = DistancesOf(scene, Hit, [](int, const auto&) { return true; });
  // Not on the plain wall, nor where one photo sees alone.
  EXPECT_GT(all.num_known, all.num_rays / 3);
  EXPECT_GT(all.num_right, 0.98 * all.num_known);

  scene.SetDepths({});
  TrainingRay ray;
  ASSERT_TRUE(scene.Ray(1, 100, 80, &ray));
  EXPECT_EQ(ray.distance, 0);
}

// Two other photos must agree on a depth elsewhere, and often do not show the ground before a
// camera.
TEST(SurfaceSeeds, AreOnTheGroundBeforeTheCameras) {
  const RenderedWorkspace workspace(
      {.camera_models = {1}, .num_photos = 6, .plain_from = 100, .has_ground = true});
  TrainingScene scene = workspace.Scene();
  SurfaceSeeds seeds = FindSurfaceSeeds(scene, kPhotos);
  EXPECT_TRUE(seeds.has_ground);
  EXPECT_THAT(seeds.Report(), HasSubstr("the ground before the cameras is a plane"));
  ASSERT_TRUE(seeds.solid_ground);
  const auto is_ground = [&](const Eigen::Vector3d& world) {
    return seeds.solid_ground->Contains(scene.WorldFromNormalized().Invert(world).cast<float>());
  };
  EXPECT_TRUE(is_ground({0, kGround + 0.01, 0.5}));
  EXPECT_TRUE(is_ground({0, kGround + 5, 0.5}));
  EXPECT_FALSE(is_ground({0, kGround - 0.1, 0.5}));
  EXPECT_FALSE(is_ground({20, kGround + 0.01, 0.5}));
  scene.SetDepths(std::move(seeds.depths));
  const Distances ground =
      DistancesOf(scene, HitOfGround, [](int, const auto& point) { return IsOnGround(point); });
  const Distances lonely = DistancesOf(scene, HitOfGround, [&](int, const auto& point) {
    return IsOnGround(point) && workspace.NumShowing(point) <= 2;
  });
  EXPECT_GT(ground.num_known, 0.85 * ground.num_rays);
  EXPECT_GT(ground.num_right, 0.95 * ground.num_known);
  ASSERT_GT(lonely.num_rays, 5000);
  EXPECT_GT(lonely.num_known, 0.7 * lonely.num_rays);
  EXPECT_GT(lonely.num_right, 0.98 * lonely.num_known);
}

// A photo that shows the ground in another colour contradicts the others, and they contradict it.
TEST(SurfaceSeeds, AreNotOnGroundThatAnotherPhotoContradicts) {
  const RenderedWorkspace workspace({.camera_models = {1},
                                     .num_photos = 6,
                                     .plain_from = 100,
                                     .has_ground = true,
                                     .brighter = 0.2});
  TrainingScene scene = workspace.Scene();
  SurfaceSeeds seeds = FindSurfaceSeeds(scene, kPhotos);
  EXPECT_TRUE(seeds.has_ground);
  scene.SetDepths(std::move(seeds.depths));
  const Distances brighter = DistancesOf(scene, HitOfGround, [&](int view, const auto& point) {
    return view == 0 && IsOnGround(point) && workspace.NumShowing(point) >= 3;
  });
  ASSERT_GT(brighter.num_rays, 5000);
  EXPECT_LT(brighter.num_known, brighter.num_rays / 100);
}

TEST(SurfaceSeeds, ShowSkyInfinitelyFarAway) {
  const RenderedWorkspace workspace({.plain_from = 0.2, .has_sky = true});
  TrainingScene scene = workspace.Scene();
  SurfaceSeeds seeds = FindSurfaceSeeds(scene, kPhotos);
  EXPECT_GT(seeds.far_share, 0.15);
  EXPECT_THAT(seeds.Report(), HasSubstr("of their pixels show sky"));
  int num_sky = 0;
  for (const SeedPoint& seed : seeds.points) {
    if (!IsSkySite(seed.position)) continue;
    ++num_sky;
    const Eigen::Vector3d clouds = CloudsAt(seed.position.cast<double>().normalized());
    EXPECT_LT((seed.color.cast<double>() - clouds).norm(), 0.06);
  }
  EXPECT_GT(num_sky, 50);
  EXPECT_LE(num_sky, kMostSkySeeds);
  scene.SetDepths(std::move(seeds.depths));
  const Eigen::Vector3d eye = scene.WorldFromNormalized().Apply(scene.Origin(0));
  int num_far = 0;
  for (int y = 0; y < scene.Height(0); ++y) {
    for (int x = 0; x < scene.Width(0); ++x) {
      TrainingRay ray;
      if (!scene.Ray(0, x, y, &ray) || !(ray.distance > 15)) continue;
      ++num_far;
      EXPECT_NEAR(ray.distance, 0.7 * kSkyRadius, 0.1);
      const Eigen::Vector3d hit = Hit(eye, ray.direction.cast<double>());
      EXPECT_GT(hit.x(), 0) << "a wall is not far";
    }
  }
  EXPECT_GT(num_far, scene.Width(0) * scene.Height(0) / 8);
  EXPECT_EQ(seeds.num_far, scene.NumViews());

  const SurfaceSeeds without = FindSurfaceSeeds(scene, kPhotos, /*find_sky=*/false);
  EXPECT_EQ(without.far_share, 0);
  EXPECT_FALSE(std::any_of(without.points.begin(), without.points.end(), [](const SeedPoint& seed) {
    return IsSkySite(seed.position);
  }));
}

TEST(SurfaceSeeds, HaveTheColorsOfThePhotos) {
  const RenderedWorkspace workspace({.num_photos = 8});
  const TrainingScene scene = workspace.Scene();
  const SurfaceSeeds seeds = FindSurfaceSeeds(scene, kPhotos);
  const std::vector<Eigen::Vector3d> positions = WorldPositions(scene, seeds);
  ASSERT_FALSE(positions.empty());
  double error = 0;
  for (size_t i = 0; i < positions.size(); ++i) {
    for (int c = 0; c < 3; ++c) {
      error += std::abs(Texture(positions[i], c) - seeds.points[i].color[c]) / 3;
    }
  }
  // Random colours of this texture differ by 0.2.
  EXPECT_LT(error / static_cast<double>(positions.size()), 0.06);
}

TEST(SurfaceSeeds, DoNotDependOnTheNumberOfThreads) {
  const RenderedWorkspace workspace({.num_photos = 7, .size = 160});
  std::vector<std::string> bytes;
  for (const int threads : {1, 2, 5}) {
    const ThreadLimit limit(threads);
    bytes.push_back(Bytes(FindSurfaceSeeds(workspace.Scene(), kPhotos)));
  }
  ASSERT_GT(bytes[0].size(), 1000u);
  EXPECT_EQ(bytes[0], bytes[1]);
  EXPECT_EQ(bytes[0], bytes[2]);
}

TEST(SurfaceSeeds, AreTheSameWherePhotosAreReadAgain) {
  const RenderedWorkspace workspace({.num_photos = 5, .size = 160});
  const TrainingScene scene = workspace.Scene();
  LoadOptions load;
  load.cache_bytes = 1000;
  const TrainingScene streamed(ScenePlan(scene.Plan()), load);
  ASSERT_FALSE(streamed.HoldsPixels());
  EXPECT_EQ(Bytes(FindSurfaceSeeds(scene, kPhotos)), Bytes(FindSurfaceSeeds(streamed, kPhotos)));
}

TEST(SurfaceSeeds, UseNoHeldOutPhoto) {
  // Every third photo is held out, from the first.
  std::vector<std::string> bytes;
  for (const int changed : {-1, 0, 1}) {
    const RenderedWorkspace workspace({.num_photos = 9, .size = 160, .texture = [changed](int i) {
                                         return i % 3 == changed ? 1 : 0;
                                       }});
    const TrainingScene scene = workspace.Scene(/*test_every=*/3);
    ASSERT_TRUE(scene.IsHeldOut(0));
    const SurfaceSeeds seeds = FindSurfaceSeeds(scene, kPhotos);
    EXPECT_EQ(seeds.num_training, 6);
    EXPECT_EQ(seeds.num_swept, 6);
    bytes.push_back(Bytes(seeds));
  }
  ASSERT_GT(bytes[0].size(), 1000u);
  EXPECT_EQ(bytes[0], bytes[1]);
  EXPECT_NE(bytes[0], bytes[2]);
}

TEST(SurfaceSeeds, AreNotFoundWhereNothingIsKnown) {
  const auto seeds_of = [](const Rendering& rendering) {
    return FindSurfaceSeeds(RenderedWorkspace(rendering).Scene(), kPhotos).points;
  };
  EXPECT_THAT(seeds_of({.num_photos = 6, .size = 120, .is_plain = true}), IsEmpty());
  EXPECT_THAT(seeds_of({.num_photos = 1, .size = 120}), IsEmpty());
  EXPECT_THAT(seeds_of({.num_photos = 2, .size = 120}), IsEmpty());
  EXPECT_THAT(seeds_of({.num_photos = 5, .size = 120, .num_points = 0}), IsEmpty());
  EXPECT_THAT(seeds_of({.num_photos = 5, .size = 8}), IsEmpty());
  EXPECT_THAT(seeds_of({.num_photos = 5, .size = 4}), IsEmpty());
}

TEST(SurfaceSeeds, AreConfirmedByAThirdPhoto) {
  // Pairs of photos agree on surfaces that the others do not show.
  const RenderedWorkspace workspace(
      {.num_photos = 6, .size = 160, .texture = [](int i) { return i / 2; }, .plain_from = 100});
  const size_t num_pixels = 6 * 160 * 120;
  EXPECT_LT(FindSurfaceSeeds(workspace.Scene(), kPhotos).points.size(), num_pixels / 50);
}

TEST(SurfaceSeeds, HardlyStandBesideAnOutline) {
  // A ball before a wall of one colour: windows at its outline show its depth beside it, too.
  const RenderedWorkspace workspace({.num_photos = 12, .plain_from = -100});
  const TrainingScene scene = workspace.Scene();
  const std::vector<Eigen::Vector3d> positions =
      WorldPositions(scene, FindSurfaceSeeds(scene, kPhotos));
  ASSERT_GT(positions.size(), 5000u);
  const auto beside = std::count_if(positions.begin(), positions.end(), [](const auto& x) {
    return (x - kBall).norm() > kBallRadius + 0.015;
  });
  EXPECT_LT(beside, static_cast<int64_t>(positions.size() / 250));
}

TEST(SurfaceSeeds, SweepABoundedNumberOfPhotos) {
  const RenderedWorkspace workspace({.num_photos = 20, .size = 120});
  const TrainingScene scene = workspace.Scene(/*test_every=*/5);
  const SurfaceSeeds all = FindSurfaceSeeds(scene, 16);
  EXPECT_EQ(all.num_training, 16);
  EXPECT_EQ(all.num_swept, 16);
  EXPECT_THAT(all.Report(), HasSubstr(" seeds from 16 photos in "));
  const SurfaceSeeds few = FindSurfaceSeeds(scene, 9);
  EXPECT_EQ(few.num_training, 16);
  EXPECT_EQ(few.num_swept, 9);
  EXPECT_THAT(few.Report(), HasSubstr(" seeds from 9 photos of 16 in "));
  EXPECT_GT(few.points.size(), all.points.size() / 4);
  EXPECT_LT(few.points.size(), all.points.size());
  EXPECT_THAT(FindSurfaceSeeds(scene, 0).points, IsEmpty());
  EXPECT_GT(SurfaceSeedBytes(16), all.points.size() * sizeof(SeedPoint));
}

}  // namespace
}  // namespace semfoam
