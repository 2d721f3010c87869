// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/report/report_writer.h"

#include "foam/util/error.h"
#include "foam/util/input_file.h"
#include "foam/util/output_file.h"
#include "plugin/photo/photo.h"
#include "tools/controllers/effects_report.h"
#include "tools/evaluation/evaluation.h"
#include "tools/images/image_files.h"
#include "tools/images/view_images.h"
#include "tools/report/foam_pack.h"
#include "tools/report/overlay_pack.h"
#include "tools/report/page_text.h"
#include "tools/report/report_content.h"
#include "tools/report/report_page.h"
#include "tools/support/memory_task.h"

#include <algorithm>
#include <fstream>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <glog/logging.h>
#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

// The second line of every report.
constexpr char kMark[] = "<!-- Report of Semantic Foam for COLMAP -->";

bool IsReport(const fs::path& path) {
  std::ifstream file(path);
  std::string first, second;
  std::getline(file, first);
  std::getline(file, second);
  return second == kMark;
}

// Longest side of the pictures of the views, and the quality of their JPEGs.
constexpr int kPictureSize = 960;
constexpr int kPictureQuality = 88;

Image8 Reduced(const Image8& image) {
  return ReducePhoto(image, ReducedSize({image.width, image.height}, kPictureSize));
}

std::string JpegUrl(const Image8& image) {
  return DataUrl("image/jpeg", EncodeJpeg(Reduced(image), kPictureQuality));
}

ReportView PicturesOf(const std::string& photo, const ViewMaps& maps) {
  ReportView view{photo, JpegUrl(maps.photo), JpegUrl(maps.render), "", JpegUrl(maps.error)};
  if (maps.labels.width > 0) {
    // Without mixing colours.
    const PhotoSize size = ReducedSize({maps.labels.width, maps.labels.height}, kPictureSize);
    view.labels_url =
        DataUrl("image/png", EncodePng(ResizeNearest(maps.labels, size.width, size.height)));
  }
  return view;
}

// Indices of at most `most` photos, spread evenly over those that were held out or, where none was,
// over all.
std::vector<size_t> ChoosePhotos(const std::vector<PhotoRecord>& photos, int most) {
  std::vector<size_t> all, held_out;
  for (size_t i = 0; i < photos.size(); ++i) {
    all.push_back(i);
    if (photos[i].held_out) held_out.push_back(i);
  }
  const std::vector<size_t>& from = held_out.empty() ? all : held_out;
  std::vector<size_t> chosen;
  for (size_t i = 0; i < from.size(); ++i) {
    if ((i + 1) * most / from.size() > i * most / from.size()) chosen.push_back(from[i]);
  }
  return chosen;
}

// Scores the views, and lists them with their pictures in order of PSNR.
void ScoreViews(const Model& model, const ReportOptions& options, ReportInput* input) {
  const std::vector<size_t> photos = ChoosePhotos(model.photos, options.max_views);
  if (photos.empty()) return;
  std::map<std::string, ReportView> pictures;
  const std::optional<ExpectedLights> lights = FindExpectedLights(options.foam_path, model);
  input->scores = ScoreModel(model,
                             options.foam_path,
                             {options.image_path,
                              options.truth_path,
                              AdaptsLight(model),
                              options.supersample,
                              options.device,
                              photos,
                              lights ? &*lights : nullptr},
                             [&](const std::string& name, const ViewMaps& maps) {
                               pictures[name] = PicturesOf(name, maps);
                             });
  std::vector<ViewScore> worst = input->scores.views;
  std::stable_sort(
      worst.begin(), worst.end(), [](const auto& a, const auto& b) { return a.psnr < b.psnr; });
  for (const ViewScore& view : worst) input->views.push_back(std::move(pictures.at(view.name)));
}

}  // namespace

void RequireValid(const ReportOptions& options) {
  if (options.max_views < 1 || options.max_views > 1000) {
    throw FieldError("max_views", " is ", options.max_views, "; it must be from 1 to 1000.");
  }
  if (options.max_cells < 0 || options.max_cells > 10'000'000) {
    throw FieldError(
        "max_cells", " is ", options.max_cells, "; it must be from 0 (all) to 10000000.");
  }
}

void RequireOwnReport(const fs::path& path) {
  if (!fs::exists(fs::symlink_status(path))) return;
  RequireRegularFile(path, "an earlier report");
  if (!IsReport(path)) {
    throw UserError(path.string(),
                    ": exists, is no report of this program and would be lost; give another ",
                    Field{"output_path"},
                    ".");
  }
}

void RemoveReport(const fs::path& path) {
  if (!fs::is_regular_file(path) || !IsReport(path)) return;
  LOG(WARNING) << "Removed the report of an earlier foam, " << path.string();
  fs::remove(path);
}

void WriteReport(const Model& model,
                 const ExportableScene& scene,
                 const ReportOptions& options,
                 const fs::path& path) {
  RequireValid(options);
  RequireOwnReport(path);
  const MemoryTask task("the report is made", "a smaller --max_cells");
  ReportInput input;
  input.foam_path = options.foam_path;
  input.image_path = options.image_path;
  input.views_are_held_out = std::any_of(
      model.photos.begin(), model.photos.end(), [](const auto& photo) { return photo.held_out; });
  ScoreViews(model, options, &input);

  const PackedFoam foam = PackFoam(model, scene.delaunay, scene.object_of_cell, options.max_cells);
  nlohmann::ordered_json content = ReportContent(model, scene, input);
  content["foam"] = foam.Header();
  const PackedOverlays overlays =
      PackOverlays(model, scene, options.input_path, options.max_faces, options.max_points);
  content["overlays"] = overlays.header;
  const std::string page = FillPage(ReportPageHtml(),
                                    {{"style", std::string(ReportPageStyle())},
                                     {"script", std::string(ReportPageScript())},
                                     {"report", JsonForHtml(content)},
                                     {"foam", Base64(Gzip(foam.bytes))},
                                     {"overlays", Base64(Gzip(overlays.bytes))}});
  CHECK_EQ(page.find(kMark), page.find('\n') + 1);
  WriteTextFile(path, page);
  if (foam.num_left_out > 0) {
    LOG(WARNING) << "The report has " << foam.num_sites << " of "
                 << foam.num_sites + foam.num_left_out
                 << " cells, those that matter most to the photos; --max_cells 0 = all.";
  }
  LOG(INFO) << "Report for any browser: " << path.string() << " ("
            << (page.size() + 99'999) / 100'000 / 10. << " MB)";
}

}  // namespace semfoam
