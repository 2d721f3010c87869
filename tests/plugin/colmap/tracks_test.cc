// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/colmap/tracks.h"

#include "plugin/colmap/camera_rays.h"

#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

// `num_images` of 100 x 80, each through the camera that `camera_of` gives it; a point for each
// number of `lengths`, shown by so many of the first images at (id, image).
Reconstruction MakeModel(int num_images, int num_cameras, const std::vector<int>& lengths) {
  Reconstruction model;
  for (int i = 0; i < num_cameras; ++i) {
    Camera camera;
    camera.id = 10 + i;
    camera.model_id = 1;
    camera.width = 100;
    camera.height = 80;
    camera.params = {100, 100, 50, 40};
    model.cameras.push_back(camera);
  }
  for (int i = 0; i < num_images; ++i) {
    Image image;
    image.id = i;
    image.camera_id = 10 + i % num_cameras;
    image.name = std::to_string(i);
    model.images.push_back(image);
  }
  for (size_t p = 0; p < lengths.size(); ++p) {
    Point3D point;
    point.id = 100 + p;
    point.position = {1.0 * p, 2, 3};
    model.points.push_back(point);
    for (int i = 0; i < lengths[p]; ++i) {
      model.images[i].points.push_back({1.0 * p, 1.0 * i, point.id});
    }
  }
  return model;
}

std::vector<PhotoRecord> PhotosOf(const Reconstruction& model, double scale) {
  std::vector<PhotoRecord> photos;
  for (const Image& image : model.images) {
    photos.push_back(MakePhotoRecord(model.cameras[image.camera_id - 10], image, false));
    photos.back().width = static_cast<int>(photos.back().width * scale);
    photos.back().height = static_cast<int>(photos.back().height * scale);
  }
  return photos;
}

TEST(Tracks, PointsThatThreePhotosShowAtThePhotosOwnSize) {
  Reconstruction model = MakeModel(5, 1, {5, 2, 3, 0});
  model.images[1].points.push_back({7, 7, 100});  // seen twice: the first counts
  model.images[1].points.push_back({7, 7, 999});  // no such point
  const std::vector<Track> tracks = SampleTracks(model, PhotosOf(model, 0.5), 0);
  ASSERT_EQ(tracks.size(), 2u);
  EXPECT_EQ(tracks[0].position, Eigen::Vector3d(0, 2, 3));
  ASSERT_EQ(tracks[0].observations.size(), 5u);
  EXPECT_EQ(tracks[1].observations.size(), 3u);
  EXPECT_EQ(tracks[1].observations[2].view, 2);
  EXPECT_EQ(tracks[1].observations[2].pixel, Eigen::Vector2d(1, 1));
}

TEST(Tracks, ASampleIsBoundedAndDependsOnTheSeedAlone) {
  Reconstruction model = MakeModel(10, 1, std::vector<int>(2000, 10));
  const std::vector<PhotoRecord> photos = PhotosOf(model, 1);
  const std::vector<Track> tracks = SampleTracks(model, photos, 0);
  EXPECT_EQ(tracks.size(), 1200u);
  const auto positions = [](const std::vector<Track>& sample) {
    std::vector<double> x;
    for (const Track& track : sample) x.push_back(track.position.x());
    return x;
  };
  EXPECT_TRUE(std::is_sorted(tracks.begin(), tracks.end(), [](const Track& a, const Track& b) {
    return a.position.x() < b.position.x();
  }));
  EXPECT_NE(positions(SampleTracks(model, photos, 1)), positions(tracks));
  std::reverse(model.points.begin(), model.points.end());
  EXPECT_EQ(positions(SampleTracks(model, photos, 0)), positions(tracks));
}

TEST(Tracks, LensesAreCamerasUnlessEachPhotoHasItsOwn) {
  Reconstruction model = MakeModel(8, 2, {});
  EXPECT_THAT(LensOfPhotos(model, PhotosOf(model, 1)),
              testing::ElementsAre(0, 1, 0, 1, 0, 1, 0, 1));
  model = MakeModel(4, 4, {});
  EXPECT_THAT(LensOfPhotos(model, PhotosOf(model, 1)), testing::ElementsAre(0, 0, 0, 0));
  std::vector<PhotoRecord> photos = PhotosOf(model, 1);
  photos[2].width = 40;
  EXPECT_THAT(LensOfPhotos(model, photos), testing::ElementsAre(0, 0, 1, 0));
}

}  // namespace
}  // namespace semfoam
