// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/image/image.h"
#include "foam/util/ids.h"

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// A decoded photo.
struct TexturePhoto {
  // Display values in the reference exposure, without the effects of the camera.
  Image8 image;
  // [height][width] Whether the colour of the pixel is known; empty: everywhere.
  std::vector<uint8_t> is_known;
  // Ids of labels at the photo's size; empty: the photo has no mask.
  LabelImage labels;
};

// The photos that textures are baked from. Places are in the COLMAP frame; pixels as COLMAP's (the
// corner of the photo is (0, 0)). Thread-safe, except that Read may be called by one thread at a
// time.
class TexturePhotos {
 public:
  virtual ~TexturePhotos() = default;

  virtual int NumPhotos() const = 0;
  virtual const std::string& Name(int photo) const = 0;
  // Whether the photo may give colours: those held out for evaluation do not.
  virtual bool IsUsed(int photo) const = 0;
  virtual int Width(int photo) const = 0;
  virtual int Height(int photo) const = 0;
  virtual Eigen::Vector3d Center(int photo) const = 0;
  // Returns the size of a pixel in the middle of the photo at the distance 1.
  virtual double PixelAngle(int photo) const = 0;
  // Returns the pixel that shows a place; nothing where the camera does not see it. The pixel may
  // be outside of the photo.
  virtual std::optional<Eigen::Vector2d> Project(int photo, const Eigen::Vector3d& x) const = 0;

  // Returns the distance from the camera's centre up to which the foam lets a place be seen near
  // this pixel; infinite where it shows nothing.
  virtual double VisibleDistance(int photo, const Eigen::Vector2d& pixel) const = 0;

  // Throws UserError naming the file where it can no longer be read.
  virtual std::shared_ptr<const TexturePhoto> Read(int photo) const = 0;

  // Returns the file of a texture, and its extension: "png" or "jpg". Same image, same bytes.
  virtual std::string Encode(const Image8& image) const = 0;
  virtual std::string Extension() const = 0;
};

}  // namespace semfoam
