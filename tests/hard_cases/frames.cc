// SPDX-License-Identifier: GPL-3.0-or-later
//
// Hard frames: scenes of extreme size and place, scenes without points, and cameras where none
// should be. What the user has is in the world frame, in double; what is traced is in the
// normalised frame, in float.
#include "foam/geometry/guard_sites.h"
#include "foam/optim/initialization.h"
#include "plugin/colmap/normalized_frame.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "tests/hard_cases/hard_case.h"

namespace semfoam {
namespace {

struct World {
  std::vector<Viewpoint> cameras;
  std::vector<Eigen::Vector3d> points;
};

// A dozen cameras around a ball of points, ten units across before `scale`.
World Room(double scale, const Eigen::Vector3d& offset) {
  World world;
  for (int i = 0; i < 12; ++i) {
    const double angle = 2 * std::numbers::pi * i / 12;
    const Eigen::Vector3d center(5 * std::cos(angle), 5 * std::sin(angle), 2);
    world.cameras.push_back({scale * center + offset, -center.normalized()});
  }
  CounterRandom random(1, 0x91, 0);
  for (int i = 0; i < 400; ++i) {
    world.points.push_back(scale * 2 * random.Uniform() * RandomDirection(&random) + offset);
  }
  return world;
}

std::vector<Eigen::Vector3f> Normalized(const Similarity& frame,
                                        const std::vector<Eigen::Vector3d>& world_points) {
  std::vector<Eigen::Vector3f> points;
  for (const Eigen::Vector3d& x : world_points) points.push_back(frame.Invert(x).cast<float>());
  return points;
}

std::vector<Eigen::Vector3d> Centers(const Similarity& frame,
                                     const std::vector<Viewpoint>& cameras) {
  std::vector<Eigen::Vector3d> centers;
  for (const Viewpoint& camera : cameras) centers.push_back(frame.Invert(camera.center));
  return centers;
}

// From every centre into all directions, a third of them towards the origin.
std::vector<RayCase> RaysFrom(const std::vector<Eigen::Vector3d>& centers, int rays_per_center) {
  std::vector<RayCase> rays;
  for (size_t i = 0; i < centers.size(); ++i) {
    for (int k = 0; k < rays_per_center; ++k) {
      const uint64_t seed = i * rays_per_center + k;
      CounterRandom random(2, 0x92, seed);
      Eigen::Vector3d direction = RandomDirection(&random);
      const Eigen::Vector3d to_middle = RandomPoint(&random, 0.3) - centers[i];
      if (k % 3 == 0) direction = to_middle.normalized();
      rays.push_back(MakeRay(centers[i], direction, seed));
    }
  }
  return rays;
}

// A scene anywhere must be the same foam, and lead back to where it was.
HardCase ScaledCase(const std::string& name,
                    const std::string& expected,
                    double scale,
                    const Eigen::Vector3d& offset,
                    double frame_bound,
                    double world_bound) {
  return {
      name, expected, [=](const CheckOptions& options) {
        HardCaseResult result;
        const World unit = Room(1, Eigen::Vector3d::Zero()), world = Room(scale, offset);
        const Similarity from_unit = NormalizedFrame(unit.cameras, unit.points);
        const Similarity from_world = NormalizedFrame(world.cameras, world.points);
        double in_frame = 0, in_world = 0;
        for (size_t i = 0; i < world.points.size(); ++i) {
          const Eigen::Vector3d x = from_world.Invert(world.points[i]);
          in_frame = std::max(in_frame, (x - from_unit.Invert(unit.points[i])).norm());
          const Eigen::Vector3d stored = ToFloat(x).cast<double>();
          in_world = std::max(in_world, (from_world.Apply(stored) - world.points[i]).norm());
        }
        result.Expect(in_frame <= frame_bound,
                      "the normalised points deviate by ",
                      in_frame,
                      ", more than ",
                      frame_bound,
                      ".");
        result.Expect(in_world <= world_bound,
                      "points come back ",
                      in_world,
                      " from where they were, more than ",
                      world_bound,
                      ".");
        const RayScene scene(Normalized(from_world, world.points), 21);
        result.Add(CheckRays(scene, RaysFrom(Centers(from_world, world.cameras), 4), {}, options));
        return result;
      }};
}

// The foam that training starts from, where there is little to start from.
HardCase InitialCase(const std::string& name, const World& world) {
  return {name,
          "a foam of finite sites within the far radius, and every ray is right",
          [=](const CheckOptions& options) {
            HardCaseResult result;
            const Similarity frame = NormalizedFrame(world.cameras, world.points);
            const std::vector<Eigen::Vector3d> centers = Centers(frame, world.cameras);
            std::vector<SeedPoint> seeds;
            for (const Eigen::Vector3f& p : Normalized(frame, world.points)) {
              seeds.push_back({p, Eigen::Vector3f::Constant(0.5f)});
            }
            InitializationOptions initialization;
            initialization.num_scattered = 600;
            initialization.num_far = 300;
            const Foam foam = InitialFoam(seeds, centers, initialization);
            result.Expect(foam.NumSites() >= 800, "only ", foam.NumSites(), " sites.");
            for (const Eigen::Vector3f& p : foam.positions) {
              result.Expect(p.norm() <= kFarRadius, "a site lies at radius ", p.norm(), ".");
            }
            if (!result.failures.empty()) return result;
            const RayScene scene(foam.positions, 22);
            const int rays_per_center = centers.size() == 1 ? 40 : 4;
            result.Add(CheckRays(scene, RaysFrom(centers, rays_per_center), {}, options));
            return result;
          }};
}

HardCaseResult CameraInSolidCells(const CheckOptions& options) {
  RayScene scene(RandomSites(400, 23), 23);
  for (float& raw : scene.values.raw_density) raw = 40;
  scene.Update();
  std::vector<Eigen::Vector3d> centers;
  CounterRandom random(23, 0x93, 0);
  for (int i = 0; i < 10; ++i) centers.push_back(RandomPoint(&random, 0.7));
  const std::vector<RayCase> rays = RaysFrom(centers, 4);
  HardCaseResult result = CheckRays(scene, rays, {}, options);
  for (const RayCase& ray : rays) {
    const uint32_t start = scene.cells.BruteForceNearest(ray.origin);
    const RayRecord<float> record =
        TraceCase(scene.cells.float_geometry, scene.values, scene.density, ray, start);
    result.Expect(record.composite.Opacity() == 1, "light passes a solid cell.");
    result.Expect(
        record.composite.quantile_segment[0] >= 0 && record.composite.quantile_depth[0] < 0.1f,
        "the depth of a ray from within solid matter is ",
        record.composite.quantile_depth[0],
        ".");
  }
  return result;
}

HardCase OutsideCase(double distance, const RayBounds& bounds) {
  std::ostringstream name;
  name << "camera_at_distance_" << distance;
  return {name.str(),
          "the walk comes in through the guards' cells, with the rounding of that distance",
          [=](const CheckOptions& options) {
            const RayScene scene(RandomSites(400, 24), 24);
            std::vector<RayCase> rays;
            for (int i = 0; i < 40; ++i) {
              CounterRandom random(24, 0x94, i);
              const Eigen::Vector3d origin = distance * RandomDirection(&random);
              const Eigen::Vector3d aim = RandomPoint(&random, 0.8) - origin;
              rays.push_back(MakeRay(origin, aim.normalized(), i));
            }
            // Away from everything: guards' cells alone, or none at all.
            rays.push_back(MakeRay({distance, 0, 0}, {1, 0, 0}, 0));
            rays.push_back(MakeRay({0, 0, distance}, {0, 1, 0}, 0));
            return CheckRays(scene, rays, bounds, options);
          }};
}

// A part of the scene far from the middle of the frame, seen from near by: only what is computed
// relative to the sites keeps its bits.
HardCaseResult FarFromTheMiddle(const CheckOptions& options) {
  const Eigen::Vector3d middle(20, 15, -10);
  std::vector<Eigen::Vector3f> sites;
  CounterRandom random(25, 0x95, 0);
  for (int i = 0; i < 400; ++i) sites.push_back(ToFloat(middle + RandomPoint(&random, 0.1)));
  const RayScene scene(sites, 25);
  std::vector<RayCase> rays;
  for (int i = 0; i < 60; ++i) {
    const Eigen::Vector3d origin = middle + RandomPoint(&random, 0.15);
    const Eigen::Vector3d aim = middle + RandomPoint(&random, 0.08);
    rays.push_back(MakeRay(origin, (aim - origin).normalized(), i));
  }
  return CheckRays(scene, rays, {}, options);
}

}  // namespace

std::vector<HardCase> FramesCases() {
  const Eigen::Vector3d origin = Eigen::Vector3d::Zero(), utm(5e5, 4.5e6, 300);
  const std::string same = "the same foam as at unit size, to float; points come back ";
  World no_points = Room(1, origin), one_camera = Room(1, origin), nothing = Room(1, origin);
  no_points.points.clear();
  one_camera.cameras.resize(1);
  nothing.cameras.resize(1);
  nothing.points.clear();
  RayBounds far;
  far.color_float = 0.1;  // a float of 1e5 has bits of 0.008, and cells are hardly larger
  far.gradient_double = 1e-7;
  return {
      ScaledCase("scene_of_1e-4_units", same + "to 1e-11 units", 1e-5, origin, 1e-12, 1e-11),
      ScaledCase("scene_of_1e6_units", same + "to 0.1 units", 1e5, origin, 1e-12, 0.1),
      ScaledCase("scene_at_utm_coordinates", same + "to a thousandth", 10, utm, 1e-8, 1e-3),
      {"far_from_the_middle",
       "colours as in double, to 1e-3 at a density of 2000",
       FarFromTheMiddle},
      InitialCase("no_points", no_points),
      InitialCase("one_camera", one_camera),
      InitialCase("one_camera_and_no_points", nothing),
      {"camera_inside_solid_cells",
       "opaque from the first cell on, its depth is within it, gradients are finite",
       CameraInSolidCells},
      OutsideCase(150, {}),
      OutsideCase(1e3, {}),
      OutsideCase(1e5, far),
  };
}

}  // namespace semfoam
