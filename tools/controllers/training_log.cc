// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/controllers/training_log.h"

#include "foam/util/error.h"
#include "tools/support/value_text.h"

#include <array>
#include <cmath>
#include <fstream>
#include <iomanip>
#include <sstream>

namespace semfoam {
namespace {

constexpr const char* kHead =
    "seconds,iteration,rays,sites,color_loss,opacity_loss,quantile_loss,identity_loss,tv_loss,"
    "held_out_psnr,held_out_miou";
// Logs written before there was this loss end without it.
constexpr const char* kLastColumn = ",distance_loss";

// The columns from the fifth on: those that may be empty.
constexpr std::array<double TrainingProgress::*, 8> kMeasures = {&TrainingProgress::color_loss,
                                                                 &TrainingProgress::opacity_loss,
                                                                 &TrainingProgress::quantile_loss,
                                                                 &TrainingProgress::identity_loss,
                                                                 &TrainingProgress::tv_loss,
                                                                 &TrainingProgress::held_out_psnr,
                                                                 &TrainingProgress::held_out_miou,
                                                                 &TrainingProgress::distance_loss};

// Returns false where the line is not one of a training log with `num_measures` of kMeasures.
bool ParseLine(const std::string& line, size_t num_measures, TrainingProgress* report) {
  const std::vector<std::string> fields = SplitAtCommas(line);
  if (fields.size() != 4 + num_measures) return false;
  bool good = ParseValue(fields[0], &report->seconds) &&
              ParseValue(fields[1], &report->iteration) && ParseValue(fields[2], &report->rays) &&
              ParseValue(fields[3], &report->sites);
  for (size_t i = 0; i < num_measures; ++i) {
    const std::string& field = fields[4 + i];
    good = good && (field.empty() || ParseValue(field, &(report->*kMeasures[i])));
  }
  return good;
}

}  // namespace

std::string FormatTrainingLog(const std::vector<TrainingProgress>& reports) {
  std::ostringstream log;
  log << kHead << kLastColumn << '\n';
  for (const TrainingProgress& report : reports) {
    log << std::fixed << std::setprecision(3) << report.seconds << ',' << report.iteration << ','
        << report.rays << ',' << report.sites << std::defaultfloat << std::setprecision(6);
    for (const auto measure : kMeasures) {
      log << ',';
      if (!std::isnan(report.*measure)) log << report.*measure;
    }
    log << '\n';
  }
  return log.str();
}

std::vector<TrainingProgress> ReadTrainingLog(const std::filesystem::path& path) {
  std::ifstream file(path);
  std::string line;
  const bool is_read = static_cast<bool>(std::getline(file, line));
  const bool has_last = line == std::string(kHead) + kLastColumn;
  if (!is_read || (!has_last && line != kHead)) {
    throw UserError(path.string(),
                    ": is missing or no training log; it should be the training_log.csv of a "
                    "training.");
  }
  std::vector<TrainingProgress> reports;
  while (std::getline(file, line)) {
    TrainingProgress report;
    if (!ParseLine(line, kMeasures.size() - (has_last ? 0 : 1), &report)) {
      throw UserError(path.string(),
                      ": line ",
                      reports.size() + 2,
                      " does not hold the numbers that the head line names; a training log that "
                      "nothing else has changed would be right.");
    }
    reports.push_back(report);
  }
  return reports;
}

}  // namespace semfoam
