// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/scene/export_transform.h"

#include "export/scene/exportable_scene.h"
#include "export/scene/object_surface.h"
#include "foam/util/error.h"

#include "tests/export/test_foams.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

ExportTransformOptions Matrix(const std::string& numbers) {
  ExportTransformOptions options;
  options.transform = numbers;
  return options;
}

Eigen::Vector3d Apply(const ExportTransform& transform, const Eigen::Vector3d& x) {
  return transform.scale * (transform.rotation * x) + transform.translation;
}

// Photos whose upward directions scatter about `up`.
std::vector<PhotoRecord> PhotosWithUp(const Eigen::Vector3d& up) {
  std::vector<PhotoRecord> photos;
  for (int k = 0; k < 8; ++k) {
    const Eigen::Vector3d tilted =
        up + 0.4 * Eigen::Vector3d(std::sin(k), std::cos(2 * k), std::sin(3 * k));
    PhotoRecord photo;
    photo.cam_from_world_rotation =
        Eigen::Quaterniond::FromTwoVectors(tilted, -Eigen::Vector3d::UnitY());
    photos.push_back(photo);
  }
  return photos;
}

TEST(ExportTransform, ByDefaultItIsTheColmapFrameExactly) {
  const ExportTransform transform = ParseExportTransform({});
  EXPECT_TRUE(transform.IsIdentity());
  EXPECT_EQ(transform.MetersPerUnit(), 1);
  const Similarity colmap{0.1, {1e6, -0.3, 7}};
  EXPECT_EQ(transform.Unturned(colmap).scale, colmap.scale);
  EXPECT_EQ(transform.Unturned(colmap).translation, colmap.translation);
}

TEST(ExportTransform, TakesASimilarityInTwelveOrSixteenNumbers) {
  const ExportTransform twelve = ParseExportTransform(Matrix("0 -2 0 10  2 0 0 20  0 0 2 30"));
  EXPECT_DOUBLE_EQ(twelve.scale, 2);
  EXPECT_LT((Apply(twelve, {1, 2, 3}) - Eigen::Vector3d(6, 22, 36)).norm(), 1e-14);
  const ExportTransform sixteen =
      ParseExportTransform(Matrix("0,-2,0,10, 2,0,0,20, 0,0,2,30, 0,0,0,1"));
  EXPECT_EQ(sixteen.rotation, twelve.rotation);
  EXPECT_EQ(sixteen.translation, twelve.translation);
  EXPECT_FALSE(twelve.IsIdentity());
  EXPECT_TRUE(ParseExportTransform(Matrix("1 0 0 0 0 1 0 0 0 0 1 0")).IsIdentity());
}

TEST(ExportTransform, RoundedDigitsOfARotationAreMadeARotation) {
  const ExportTransform transform =
      ParseExportTransform(Matrix("0.866025 -0.5 0 0 0.5 0.866025 0 0 0 0 1 0"));
  const Eigen::Matrix3d& r = transform.rotation;
  EXPECT_LT((r * r.transpose() - Eigen::Matrix3d::Identity()).norm(), 1e-14);
  EXPECT_NEAR(r(0, 0), std::sqrt(0.75), 1e-6);
  EXPECT_NEAR(r.determinant(), 1, 1e-14);
}

TEST(ExportTransform, AnythingButASimilarityIsOneSentence) {
  for (const char* bad : {"1 0 0 0 0 1 0 0 0 0 1",               // eleven
                          "1 0 0 0 0 1 0 0 0 0 1 0 0",           // thirteen
                          "1 0 0 0 0 1 0 0 0 0 1 x",             // no number
                          "1 0 0 0 0 1 0 0 0 0 1 0x",            // something behind it
                          "1 0 0 0 0 1 0 0 0 0 1 nan",           // none to go by
                          "1 0 0 0 0 1 0 0 0 0 1 1e999",         // too large
                          "1 0 0 0 0 1 0 0 0 0 -1 0",            // a mirror
                          "1 0 0 0 0 2 0 0 0 0 1 0",             // not uniform
                          "1 0.1 0 0 0 1 0 0 0 0 1 0",           // a shear
                          "0 0 0 0 0 0 0 0 0 0 0 0",             // nothing left
                          "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0.1 1",   // a perspective
                          "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 2"}) {  // homogeneous
    try {
      ParseExportTransform(Matrix(bad));
      ADD_FAILURE() << bad;
    } catch (const UserError& error) {
      EXPECT_THAT(error.what(),
                  AllOf(StartsWith("transform is '"), HasSubstr("'; it must be the 12 or 16")))
          << bad;
      EXPECT_THAT(error.what(), HasSubstr(bad));
    }
  }
}

TEST(ExportTransform, TheScaleComesAfterTheTransform) {
  ExportTransformOptions options = Matrix("1 0 0 5 0 1 0 0 0 0 1 0");
  options.scale = 100;
  options.units = LengthUnit::kCentimeter;
  const ExportTransform transform = ParseExportTransform(options);
  EXPECT_EQ(Apply(transform, {1, 2, 3}), Eigen::Vector3d(600, 200, 300));
  EXPECT_EQ(transform.MetersPerUnit(), 0.01);
  for (const double bad : {0.0, -1.0, 1e-10, 1e10}) {
    options.scale = bad;
    EXPECT_THROW(ParseExportTransform(options), UserError) << bad;
  }
}

TEST(ExportTransform, UnitsAreMetres) {
  const std::map<std::string, double> expected = {{"unknown", 1},
                                                  {"mm", 0.001},
                                                  {"cm", 0.01},
                                                  {"m", 1},
                                                  {"km", 1000},
                                                  {"inch", 0.0254},
                                                  {"foot", 0.3048}};
  EXPECT_EQ(AllNames(kLengthUnitNames).size(), expected.size());
  for (const auto& [unit, name] : kLengthUnitNames) {
    EXPECT_EQ(ParseEnum(kLengthUnitNames, name), unit);
    ExportTransformOptions options;
    options.units = unit;
    const ExportTransform transform = ParseExportTransform(options);
    EXPECT_EQ(transform.MetersPerUnit(), expected.at(name));
    EXPECT_TRUE(transform.IsIdentity()) << "a unit changes no number";
  }
}

TEST(ExportTransform, WhatIsUpInThePhotosComesUp) {
  for (const UpAxis to : {UpAxis::kY, UpAxis::kZ}) {
    const Eigen::Vector3d target =
        to == UpAxis::kY ? Eigen::Vector3d::UnitY() : Eigen::Vector3d::UnitZ();
    for (int axis = 0; axis < 3; ++axis) {
      for (const int sign : {-1, 1}) {
        const Eigen::Vector3d up = sign * Eigen::Vector3d::Unit(axis);
        ExportTransformOptions options;
        options.up_axis = to;
        ExportTransform transform = ParseExportTransform(options);
        TurnUpright(PhotosWithUp(up), &transform);
        EXPECT_EQ(transform.rotation * up, target);
        EXPECT_EQ(transform.rotation.determinant(), 1);
        EXPECT_EQ(transform.rotation, transform.rotation.array().round().matrix());
        EXPECT_EQ(transform.IsIdentity(), up == target);
      }
    }
  }
}

TEST(ExportTransform, UpIsWhatItIsAfterTheTransform) {
  // The transform lays the photos' -y onto +x; from there it is turned up, offset and all.
  ExportTransformOptions options = Matrix("0 -1 0 5 1 0 0 0 0 0 1 0");
  options.up_axis = UpAxis::kZ;
  ExportTransform transform = ParseExportTransform(options);
  TurnUpright(PhotosWithUp(-Eigen::Vector3d::UnitY()), &transform);
  EXPECT_EQ(Apply(transform, {0, -1, 0}), Eigen::Vector3d(0, 0, 6));
}

TEST(ExportTransform, SaysHowFarUpIsOffTheAxis) {
  const auto tilt = [](const Eigen::Vector3d& up, ExportTransformOptions options) {
    PhotoRecord photo;
    photo.cam_from_world_rotation =
        Eigen::Quaterniond::FromTwoVectors(up, -Eigen::Vector3d::UnitY());
    ExportTransform transform = ParseExportTransform(options);
    TurnUpright({photo}, &transform);
    return transform.up_tilt_degrees;
  };
  ExportTransformOptions y, z;
  y.up_axis = UpAxis::kY;
  z.up_axis = UpAxis::kZ;
  EXPECT_EQ(tilt(-Eigen::Vector3d::UnitY(), z), 0);
  for (const double degrees : {0.5, 9.0, 30.0, 44.0}) {
    const double angle = degrees * M_PI / 180;
    EXPECT_NEAR(tilt({std::sin(angle), -std::cos(angle), 0}, z), degrees, 1e-6);
    EXPECT_NEAR(tilt({0, std::cos(angle), -std::sin(angle)}, y), degrees, 1e-6);
  }
  // After --transform has levelled it, nothing remains.
  ExportTransformOptions options = Matrix("0.8 0.6 0 0 -0.6 0.8 0 0 0 0 1 0");
  options.up_axis = UpAxis::kZ;
  EXPECT_NEAR(tilt({0.6, -0.8, 0}, options), 0, 1e-6);
  EXPECT_NEAR(tilt({0.6, -0.8, 0}, z), 36.8698976, 1e-6);
}

TEST(ExportTransform, PhotosThatDoNotTellWhatIsUpAreAUserError) {
  ExportTransform none;
  TurnUpright({}, &none);  // kColmap asks nothing of them
  EXPECT_TRUE(none.IsIdentity());

  ExportTransform transform;
  transform.up_axis = UpAxis::kZ;
  EXPECT_THROW(TurnUpright({}, &transform), UserError);
  // A drone that looks straight down and comes back the other way.
  std::vector<PhotoRecord> photos(2);
  photos[0].cam_from_world_rotation = Eigen::AngleAxisd(0, Eigen::Vector3d::UnitZ());
  photos[1].cam_from_world_rotation = Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitZ());
  try {
    TurnUpright(photos, &transform);
    ADD_FAILURE();
  } catch (const UserError& error) {
    EXPECT_THAT(
        error.what(),
        AllOf(StartsWith("up_axis is "), HasSubstr("give the turn with transform instead")));
  }
}

TEST(ExportTransform, FilesTellOfIt) {
  EXPECT_EQ(
      ExportTransformJson({}),
      R"({"file_from_colmap":[1.0,0.0,0.0,0.0,0.0,1.0,0.0,0.0,0.0,0.0,1.0,0.0,0.0,0.0,0.0,1.0],)"
      R"("up_axis":"colmap","unit":"unknown","meters_per_unit":1.0})");
  ExportTransformOptions options = Matrix("0 -2 0 1 2 0 0 2 0 0 2 3");
  options.units = LengthUnit::kInch;
  const auto json = nlohmann::json::parse(ExportTransformJson(ParseExportTransform(options)));
  EXPECT_EQ(json["file_from_colmap"],
            nlohmann::json({0., -2., 0., 1., 2., 0., 0., 2., 0., 0., 2., 3., 0., 0., 0., 1.}));
  EXPECT_EQ(json["unit"], "inch");
  EXPECT_EQ(json["meters_per_unit"], 0.0254);
  EXPECT_FALSE(json.contains("up_tilt_degrees"));
  ExportTransform upright;
  upright.up_axis = UpAxis::kY;
  upright.up_tilt_degrees = 12.3456;
  EXPECT_EQ(nlohmann::json::parse(ExportTransformJson(upright))["up_tilt_degrees"], 12.35);
}

TEST(ExportTransform, ObjectsTakeIt) {
  Model model = TouchingBalls(800);
  model.world_from_normalized = {0.5, {100, 200, 300}};
  const ExportableScene plain = MakeExportableScene(model);
  ExportableSceneOptions options;
  options.transform = ParseExportTransform(Matrix("0 0 3 7 3 0 0 8 0 3 0 9"));
  const ExportableScene moved = MakeExportableScene(model, options);
  ASSERT_EQ(moved.objects.size(), plain.objects.size());
  for (size_t k = 0; k < plain.objects.size(); ++k) {
    const ObjectInfo& a = plain.objects[k];
    const ObjectInfo& b = moved.objects[k];
    EXPECT_EQ(a.cells, b.cells);
    EXPECT_NEAR(b.volume, 27 * a.volume, 1e-12 * b.volume);
    const ObjectSurface from = ExtractSurface(plain, a);
    const ObjectSurface to = ExtractSurface(moved, b);
    EXPECT_EQ(from.triangles, to.triangles);
    Eigen::AlignedBox3d box;
    for (size_t v = 0; v < from.vertices.size(); ++v) {
      const Eigen::Vector3d expected = Apply(options.transform, from.vertices[v]);
      EXPECT_LT((to.vertices[v] - expected).norm(), 1e-11);
      box.extend(to.vertices[v]);
    }
    EXPECT_EQ(b.bounding_box.min(), box.min());
    EXPECT_EQ(b.bounding_box.max(), box.max());
  }
}

}  // namespace
}  // namespace semfoam
