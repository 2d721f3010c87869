// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/colmap/colmap_model.h"

#include <filesystem>
#include <string>
#include <vector>

namespace semfoam {

// Reads and writes the binary and the text encoding of each file of a COLMAP model; colmap_model.cc
// chooses the encoding and checks the model. Readers take all bytes of the file; `path` is for
// messages. They throw UserError for bytes that are not such a file, and check each record by
// itself.

std::vector<Camera> ParseCamerasBinary(const std::filesystem::path& path, const std::string& bytes);
std::vector<Image> ParseImagesBinary(const std::filesystem::path& path, const std::string& bytes);
std::vector<Point3D> ParsePointsBinary(const std::filesystem::path& path, const std::string& bytes);
std::vector<Rig> ParseRigsBinary(const std::filesystem::path& path, const std::string& bytes);
std::vector<Frame> ParseFramesBinary(const std::filesystem::path& path, const std::string& bytes);

std::string CamerasToBinary(const std::vector<Camera>& cameras);
std::string ImagesToBinary(const std::vector<Image>& images);
std::string PointsToBinary(const std::vector<Point3D>& points);
std::string RigsToBinary(const std::vector<Rig>& rigs);
std::string FramesToBinary(const std::vector<Frame>& frames);

std::vector<Camera> ParseCamerasText(const std::filesystem::path& path, const std::string& bytes);
std::vector<Image> ParseImagesText(const std::filesystem::path& path, const std::string& bytes);
std::vector<Point3D> ParsePointsText(const std::filesystem::path& path, const std::string& bytes);
std::vector<Rig> ParseRigsText(const std::filesystem::path& path, const std::string& bytes);
std::vector<Frame> ParseFramesText(const std::filesystem::path& path, const std::string& bytes);

std::string CamerasToText(const std::vector<Camera>& cameras);
std::string ImagesToText(const std::vector<Image>& images);
std::string PointsToText(const std::vector<Point3D>& points);
std::string RigsToText(const std::vector<Rig>& rigs);
std::string FramesToText(const std::vector<Frame>& frames);

}  // namespace semfoam
