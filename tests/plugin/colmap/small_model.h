// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/colmap/colmap_model.h"

#include <utility>

namespace semfoam {

// A model with everything that a format can get wrong: two cameras, ids unordered and sparse,
// sub-folders, a name with blanks and dots, an image without points, a point without a track,
// numbers that need all 17 digits.
inline Reconstruction SmallModel(bool with_rigs) {
  Reconstruction model;
  Camera radial;
  radial.id = 4'000'000'000u;
  radial.model_id = 2;
  radial.width = 640;
  radial.height = 480;
  radial.params = {533.33333333333337, 320, 240, -0.1};
  Camera fisheye;
  fisheye.id = 3;
  fisheye.model_id = 10;
  fisheye.width = 320;
  fisheye.height = 200;
  fisheye.params = {100, 101, 160, 100, 0.1, 0.01, 1e-3, 1e-4, 1e-5, 1e-300, 0.1 + 0.2, -0.0};
  model.cameras = {radial, fisheye};

  Image a;
  a.id = 77;
  a.camera_id = 3;
  a.name = "left/day 1/a.b.jpg";
  a.cam_from_world.rotation = Eigen::Quaterniond(0.9, -0.1, 0.3, 0.3);  // of length 1
  a.cam_from_world.translation = {1.0 / 3, -2e-7, 4.5e6};
  a.points = {{1.5, 2.25, 9}, {100.1, 1e-9, kNoPoint3D}, {3, 4, 1'000'000'000'000}};
  Image b;
  b.id = 5;
  b.camera_id = 4'000'000'000u;
  b.name = "right/b.png";
  Image c = a;
  c.id = 6;
  c.name = "c.jpg";
  c.points = {{320, 240, 9}};
  model.images = {a, b, c};

  Point3D p;
  p.id = 1'000'000'000'000;
  p.position = {0.1, 0.2, 0.3};
  p.color = {255, 0, 7};
  p.error = -1;
  p.track = {{77, 2}};
  Point3D q;
  q.id = 9;
  q.position = {-1e-5, 5e5 + 0.125, 1e17};
  q.color = {1, 2, 3};
  q.error = 0.8059070001;
  q.track = {{6, 0}, {77, 0}};
  Point3D without_track;
  without_track.id = 2;
  model.points = {p, q, without_track};

  if (with_rigs) {
    Rig stereo;
    stereo.id = 12;
    stereo.reference = Sensor{SensorType::kCamera, 4'000'000'000u};
    // Image 5 is where the rig is, and 77 where its camera is on it.
    stereo.others = {{{SensorType::kCamera, 3}, a.cam_from_world},
                     {{SensorType::kImu, 1}, std::nullopt}};
    Rig single;
    single.id = 1;
    single.reference = Sensor{SensorType::kCamera, 3};
    Rig empty;
    empty.id = 2;
    model.rigs = {stereo, single, empty};
    Frame first;
    first.id = 40;
    first.rig_id = 12;
    first.data = {{{SensorType::kCamera, 4'000'000'000u}, 5}, {{SensorType::kCamera, 3}, 77}};
    Frame second;
    second.id = 2;
    second.rig_id = 1;
    second.rig_from_world = a.cam_from_world;
    second.data = {{{SensorType::kCamera, 3}, 6}};
    model.frames = {first, second};
  }
  return model;
}

}  // namespace semfoam
