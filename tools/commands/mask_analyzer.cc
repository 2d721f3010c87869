// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/scene/names.h"
#include "foam/model/model.h"
#include "foam/util/error.h"
#include "foam/util/output_file.h"
#include "plugin/photo/photo.h"
#include "plugin/util/files.h"
#include "tools/cli/option_manager.h"
#include "tools/commands/commands.h"
#include "tools/images/contact_sheet.h"
#include "tools/masks/mask_analysis.h"
#include "tools/masks/suggested_masks.h"
#include "tools/options/json_option.h"
#include "tools/options/mask_options.h"
#include "tools/support/output_lock.h"

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <glog/logging.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

// images/ in the workspace or beside the masks; empty where there is none.
fs::path FindImages(const std::string& image_path,
                    const std::string& workspace_path,
                    const fs::path& mask_folder) {
  if (!image_path.empty()) {
    if (fs::is_directory(image_path)) return image_path;
    throw UserError(image_path, ": there is no such folder; it should hold the photos.");
  }
  const fs::path folder =
      (workspace_path.empty() ? ParentFolder(mask_folder) : fs::path(workspace_path)) / "images";
  return fs::is_directory(folder) ? folder : fs::path();
}

// Returns the ids of the most photos, in their order.
std::vector<SheetLegendEntry> Legend(const MaskAnalysis& analysis) {
  std::vector<IdSurvey> ids = analysis.coverage.ids;
  std::stable_sort(ids.begin(), ids.end(), [](const IdSurvey& a, const IdSurvey& b) {
    return a.views.size() > b.views.size();
  });
  ids.resize(std::min<size_t>(ids.size(), kMostLegendEntries));
  std::sort(ids.begin(), ids.end(), [](const IdSurvey& a, const IdSurvey& b) {
    return a.given_class < b.given_class;
  });
  std::vector<SheetLegendEntry> legend;
  for (const IdSurvey& id : ids) {
    const Label& label = analysis.photos.given.labels[Value(id.given_class)];
    std::string name = std::to_string(Value(label.source_id));
    if (!label.name.empty()) name.append(" ").append(OneLine(label.name));
    legend.push_back({name, LabelColor(label.id)});
  }
  return legend;
}

SheetTile MakeTile(const MaskAnalysis& analysis, const SuspiciousPhoto* suspicion, int view) {
  SheetTile tile;
  tile.caption = OneLine(analysis.photos.photos[view].name);
  if (suspicion != nullptr) {
    tile.remark = OneLine(DescribeFinding(analysis, suspicion->findings.front()));
    if (suspicion->findings.size() > 1) {
      tile.remark = std::to_string(suspicion->findings.size()) + " findings, " + tile.remark;
    }
  }
  Image8 photo;
  const fs::path file = analysis.image_folder / analysis.photos.photos[view].name;
  if (!analysis.image_folder.empty() && fs::is_regular_file(file)) photo = ReadPhoto(file);
  const ClassImage classes = analysis.photos.GivenMask(view);
  LabelImage labels;
  if (!classes.Empty()) {
    labels.width = analysis.photos.photos[view].width;
    labels.height = analysis.photos.photos[view].height;
    const size_t pixels = static_cast<size_t>(labels.width) * labels.height;
    labels.data.reserve(pixels);
    for (size_t i = 0; i < pixels; ++i) {
      labels.data.push_back(Value(LabelIdOf(analysis.photos.given.labels, classes[i])));
    }
  }
  tile.picture = OverlayTile(photo, labels);
  return tile;
}

void WriteSheet(const MaskAnalysis& analysis, const fs::path& folder) {
  std::vector<const SuspiciousPhoto*> suspicion(analysis.photos.photos.size(), nullptr);
  for (const SuspiciousPhoto& photo : analysis.suspicious) suspicion[photo.view] = &photo;
  const auto count = static_cast<int>(analysis.photos.photos.size());
  const std::string title = std::to_string(count) + (count == 1 ? " photo, " : " photos, ") +
                            std::to_string(analysis.suspicious.size()) + " suspicious";
  WriteContactSheet(folder / "contact_sheet", title, Legend(analysis), count, [&](int view) {
    return MakeTile(analysis, suspicion[view], view);
  });
}

// Prints which photos to mask next.
void PrintSuggestion(const SuggestedMasks& masks, bool json) {
  if (json) {
    std::fputs(SuggestionJson(masks).c_str(), stdout);
  } else {
    for (const std::string& line : SuggestionLines(masks)) std::printf("%s\n", line.c_str());
  }
}

}  // namespace

void RunMaskAnalyzer(int argc, char** argv) {
  std::string workspace_path;
  std::string image_path;
  std::string input_path;
  std::string output_path;
  std::string foam_path;
  int suggest = 0;
  int test_every = 0;
  bool json = false;
  MaskOptions masks;
  OptionManager options(
      "mask_analyzer",
      "Says what is in a folder of instance masks: formats, ids, areas, how far the photos agree "
      "by the tracks of the COLMAP model, and which photos' masks look wrong and why. Or, with "
      "--suggest, which photos to mask where only a few will be.");
  options.AddDefaultOption("workspace_path",
                           &workspace_path,
                           "folder with object_mask/, images/ and sparse/; or give --mask_path");
  AddMaskPathOptions(&options, &masks);
  options.AddDefaultOption(
      "image_path",
      &image_path,
      "folder of the photos; by default images/ of the workspace or beside the masks, if any");
  options.AddDefaultOption("input_path",
                           &input_path,
                           "the COLMAP model; by default sparse/0/, then sparse/ of the "
                           "workspace, if any; without one, photos are not compared");
  options.AddDefaultOption("output_path",
                           &output_path,
                           "folder for masks.json, the whole report, and contact_sheet_1.png, ..., "
                           "the photos under their masks; by default none");
  options.AddDefaultOption("suggest",
                           &suggest,
                           "instead of the report, print so many photos to mask next: those that, "
                           "with the masked ones, show most of the scene by the model's tracks, or "
                           "of what --foam_path is not sure of; there may be no masks yet");
  options.AddDefaultOption("foam_path",
                           &foam_path,
                           "with --suggest: a foam, scene.foam, that was trained with the masks "
                           "that there are; it is looked at in place of the COLMAP model, and "
                           "photos that it held out are not suggested");
  options.AddDefaultOption("test_every",
                           &test_every,
                           "with --suggest: photos that the training will hold out, every so many "
                           "by name, from the first, are not suggested; 0 = none");
  AddJsonOption(&options, &json);
  AddMaskReadingOptions(&options, &masks);
  if (!options.Parse(argc, argv)) return;
  if (suggest < 0 || test_every < 0) {
    throw UserError("Failed to parse options - --",
                    suggest < 0 ? "suggest" : "test_every",
                    " is negative; it must be a number of photos.");
  }
  if (suggest > 0) {
    options.RequireEffect({"labels_path",
                           "image_path",
                           "output_path",
                           "FoamTraining.label_zero",
                           "Masks.consistency"},
                          "with --suggest, which looks at no pixel; leave it out");
    if (!foam_path.empty()) {
      options.RequireEffect({"input_path", "test_every"},
                            "with --foam_path, which knows its photos; leave it out");
      const MaskedModelPaths paths = FindMaskedModel(
          workspace_path, input_path, masks, /*needs_model=*/false, /*needs_masks=*/false);
      return PrintSuggestion(
          SuggestMasks(ReadModel(foam_path), foam_path, paths.mask_folder, suggest), json);
    }
    const MaskedModelPaths model = FindMaskedModel(
        workspace_path, input_path, masks, /*needs_model=*/true, /*needs_masks=*/false);
    return PrintSuggestion(SuggestMasks(model, suggest, test_every), json);
  }
  options.RequireEffect({"foam_path", "test_every"},
                        "without --suggest; give it too, or leave it out");
  const MaskedModelPaths paths =
      FindMaskedModel(workspace_path, input_path, masks, /*needs_model=*/false);
  if (paths.model_folder.empty()) {
    options.RequireEffect({"Masks.consistency"},
                          "without the COLMAP model; give --input_path too, or leave it out");
  }
  std::optional<OutputLock> lock;
  if (!output_path.empty()) lock.emplace(output_path);
  const MaskAnalysis analysis =
      AnalyzeMasks(paths, FindImages(image_path, workspace_path, paths.mask_folder), masks);
  for (const std::string& warning : {analysis.photos.size_warning, analysis.names_warning}) {
    if (!warning.empty()) LOG(WARNING) << warning;
  }
  const std::string report = MaskReportJson(analysis);
  if (!output_path.empty()) {
    WriteTextFile(fs::path(output_path) / "masks.json", report);
    WriteSheet(analysis, output_path);
  }
  if (json) {
    std::fputs(report.c_str(), stdout);
  } else {
    for (const std::string& line : MaskReportLines(analysis)) std::printf("%s\n", line.c_str());
  }
}

}  // namespace semfoam
