// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/exportable_scene.h"
#include "foam/model/model.h"
#include "tools/evaluation/evaluation.h"

#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace semfoam {

// The data of a report besides the foam itself, as JSON for the page (tools/report_page/report.ts
// lists the fields).

// One view of the report: a photo beside its render.
struct ReportView {
  // Name of the photo.
  std::string photo;
  // data: URLs of the pictures; `labels` is empty without semantics.
  std::string photo_url;
  std::string render_url;
  std::string labels_url;
  std::string error_url;
};

struct ReportInput {
  // The file of the model, and the folder of the photos.
  std::filesystem::path foam_path;
  std::filesystem::path image_path;
  // Number of photos to show as small pictures in 3D, spread evenly; 0: none.
  int max_thumbnails = 100;
  // Scores of `views`, in the same order.
  Scores scores;
  std::vector<ReportView> views;
  // Whether the views were kept from training.
  bool views_are_held_out = true;
};

// Returns the data. `model` was read from `input.foam_path`, and `scene` made of it. Reads
// training_log.csv, effects.json and labels.json beside the model, where they are, and the photos
// to show small. Throws UserError where one of these is damaged.
nlohmann::ordered_json ReportContent(const Model& model,
                                     const ExportableScene& scene,
                                     const ReportInput& input);

}  // namespace semfoam
