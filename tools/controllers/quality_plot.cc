// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/controllers/quality_plot.h"

#include "export/scene/names.h"
#include "foam/util/error.h"
#include "tools/cli/option_manager.h"
#include "tools/cli/output_lock.h"
#include "tools/controllers/training_log.h"
#include "tools/images/plot.h"

#include <cstdio>
#include <set>
#include <vector>

namespace semfoam {

namespace fs = std::filesystem;

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

}  // namespace semfoam
