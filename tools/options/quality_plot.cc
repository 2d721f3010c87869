// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/options/quality_plot.h"

#include "export/scene/names.h"
#include "foam/util/error.h"
#include "tools/controllers/training_log.h"
#include "tools/support/output_lock.h"
#include "tools/support/value_text.h"

#include <cmath>
#include <cstdio>
#include <set>
#include <utility>
#include <vector>

namespace semfoam {

namespace fs = std::filesystem;

Plot TrainingPlot(const std::vector<TrainingCurve>& curves) {
  Plot plot{"Held-out quality while training", "", {}};
  const auto add = [&](const char* name, double TrainingProgress::*value) {
    PlotPanel panel{"seconds", name, /*log_x=*/curves.size() > 1, {}, {}};
    for (const TrainingCurve& curve : curves) {
      PlotSeries series{curve.name, {}, /*line=*/true, /*markers=*/true};
      for (const TrainingProgress& report : curve.reports) {
        // Reports between two evaluations repeat what the last one said.
        const double known = report.*value;
        if (std::isnan(known) || (!series.points.empty() && series.points.back().y == known)) {
          continue;
        }
        series.points.push_back({report.seconds, known});
      }
      if (!series.points.empty()) panel.series.push_back(std::move(series));
    }
    if (!panel.series.empty()) plot.panels.push_back(std::move(panel));
  };
  add("PSNR in dB", &TrainingProgress::held_out_psnr);
  add("mIoU", &TrainingProgress::held_out_miou);
  return plot;
}

void PlotTrainings(const std::string& run_paths,
                   const std::string& names,
                   const fs::path& output_path) {
  const std::vector<std::string> paths = SplitAtCommas(run_paths);
  const std::vector<std::string> given =
      names.empty() ? std::vector<std::string>() : SplitAtCommas(names);
  if (!given.empty() && given.size() != paths.size()) {
    throw UserError("Failed to parse options - --names has ",
                    given.size(),
                    " names for ",
                    paths.size(),
                    " trainings; it must have one for each, or be empty.");
  }
  const OutputLock lock(output_path.string());
  std::vector<TrainingCurve> curves;
  std::set<std::string> seen;
  for (size_t i = 0; i < paths.size(); ++i) {
    const fs::path folder(paths[i]);
    // What is drawn must be UTF-8.
    const std::string name =
        OneLine(given.empty() ? (folder / "").parent_path().filename().string() : given[i]);
    if (!seen.insert(name).second) {
      throw UserError("Failed to parse options - two of the trainings are called `",
                      name,
                      "`; --names must tell them apart.");
    }
    curves.push_back({name, ReadTrainingLog(folder / "training_log.csv")});
  }
  const Plot plot = TrainingPlot(curves);
  if (plot.panels.empty()) {
    throw UserError(run_paths,
                    ": none of the trainings knows its held-out quality; train with --test_every.");
  }
  const fs::path stem = output_path / "quality_over_seconds";
  WritePlot(stem, plot);
  std::printf("%s.svg and .png show %zu trainings\n", stem.c_str(), curves.size());
}

void DrawTrainingPlot(const std::vector<TrainingProgress>& reports, const TrainingFolder& folder) {
  if (const Plot plot = TrainingPlot({{"", reports}}); !plot.panels.empty()) {
    WritePlot(folder.path() / "training_plot", plot);
    return;
  }
  for (const char* file : {"training_plot.svg", "training_plot.png"}) folder.RemoveReplaced(file);
}

}  // namespace semfoam
