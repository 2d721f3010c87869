// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/training_log.h"

#include <cmath>
#include <iomanip>
#include <sstream>

namespace semfoam {

std::string FormatTrainingLog(const std::vector<TrainingProgress>& reports) {
  std::ostringstream log;
  log << "seconds,iteration,rays,sites,color_loss,opacity_loss,quantile_loss,identity_loss,tv_loss,"
         "held_out_psnr\n";
  for (const TrainingProgress& report : reports) {
    log << std::fixed << std::setprecision(3) << report.seconds << ',' << report.iteration << ','
        << report.rays << ',' << report.sites << std::defaultfloat << std::setprecision(6);
    for (const double value : {report.color_loss,
                               report.opacity_loss,
                               report.quantile_loss,
                               report.identity_loss,
                               report.tv_loss,
                               report.held_out_psnr}) {
      log << ',';
      if (!std::isnan(value)) log << value;
    }
    log << '\n';
  }
  return log.str();
}

}  // namespace semfoam
