// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/training_log.h"

#include <cmath>
#include <iomanip>
#include <sstream>
#include <utility>

namespace semfoam {

std::string FormatTrainingLog(const std::vector<TrainingProgress>& reports) {
  std::ostringstream log;
  log << "seconds,iteration,rays,sites,color_loss,opacity_loss,quantile_loss,identity_loss,tv_loss,"
         "held_out_psnr,held_out_miou\n";
  for (const TrainingProgress& report : reports) {
    log << std::fixed << std::setprecision(3) << report.seconds << ',' << report.iteration << ','
        << report.rays << ',' << report.sites << std::defaultfloat << std::setprecision(6);
    for (const double value : {report.color_loss,
                               report.opacity_loss,
                               report.quantile_loss,
                               report.identity_loss,
                               report.tv_loss,
                               report.held_out_psnr,
                               report.held_out_miou}) {
      log << ',';
      if (!std::isnan(value)) log << value;
    }
    log << '\n';
  }
  return log.str();
}

Plot TrainingPlot(const std::vector<TrainingProgress>& reports) {
  Plot plot{"Held-out quality while training", "", {}};
  const auto add = [&](const char* name, double TrainingProgress::*value) {
    PlotPanel panel{"seconds", name, false, {{"", {}, /*line=*/true, /*markers=*/true}}, {}};
    std::vector<PlotPoint>& points = panel.series[0].points;
    for (const TrainingProgress& report : reports) {
      // Reports between two evaluations repeat what the last one said.
      const double known = report.*value;
      if (std::isnan(known) || (!points.empty() && points.back().y == known)) continue;
      points.push_back({report.seconds, known});
    }
    if (!points.empty()) plot.panels.push_back(std::move(panel));
  };
  add("PSNR in dB", &TrainingProgress::held_out_psnr);
  add("mIoU", &TrainingProgress::held_out_miou);
  return plot;
}

}  // namespace semfoam
