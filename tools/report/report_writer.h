// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/exportable_scene.h"
#include "foam/device/device.h"
#include "foam/model/model.h"
#include "plugin/colmap/camera_rays.h"

#include <cstdint>
#include <filesystem>

namespace semfoam {

// Options of WriteReport. The defaults are those of `semfoam report_writer`.
struct ReportOptions {
  std::filesystem::path foam_path;   // the model's file
  std::filesystem::path image_path;  // folder of the photos
  // Folder of the COLMAP model, for its points; empty: none are shown.
  std::filesystem::path input_path;
  // Folder of the exact masks; empty: labels are not scored. See FindTruth.
  std::filesystem::path truth_path;
  // Number of views to score and to show photo beside render: spread evenly over those held out.
  int max_views = 8;
  // Number of cells in the page, those that matter most (PackFoam); 0: all.
  int64_t max_cells = 500'000;
  // Number of triangles of all surfaces in the page, and of SfM points.
  int64_t max_faces = 300'000;
  int64_t max_points = 50'000;
  // Rays along each edge of a pixel of the views, see RenderCamera.
  int supersample = kDefaultSupersample;
  // Renders the views.
  Device device;
};

// Throws FieldError where an option is out of range.
void RequireValid(const ReportOptions& options);

// Throws UserError where `path` exists and is not a report of this program, which would be lost.
// Must be called before any work.
void RequireOwnReport(const std::filesystem::path& path);

// Removes a report of an earlier foam, and logs that. Does nothing where `path` is none.
void RemoveReport(const std::filesystem::path& path);

// Writes the report of a foam, one HTML file that needs nothing else: figures, views, objects, and
// the foam itself to be looked at in 3D (tools/README.md). Renders and scores held-out views; where
// there is none, views of the training. `model` was read from options.foam_path; `scene` was made
// of it and has the photos of its objects (PrepareExport). Same files, same bytes. Throws UserError
// where a photo is missing, or the report cannot be written.
void WriteReport(const Model& model,
                 const ExportableScene& scene,
                 const ReportOptions& options,
                 const std::filesystem::path& path);

}  // namespace semfoam
