// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/evaluation/accuracy_study.h"

#include "tools/support/value_text.h"

#include <algorithm>
#include <cstdio>
#include <limits>
#include <set>
#include <sstream>

namespace semfoam {
namespace {

// What is measured against seconds.
struct Measure {
  const char* name;
  double AccuracyRow::*value;
  bool less_is_better;
};
constexpr Measure kMeasures[] = {{"PSNR in dB", &AccuracyRow::psnr, false},
                                 {"mIoU", &AccuracyRow::miou, false},
                                 {"surface error", &AccuracyRow::surface_error, true}};

// Rows of exports have no pictures, and their surfaces are measured over fewer points.
bool IsTraining(const AccuracyRow& row) { return std::isfinite(row.psnr); }

std::vector<PlotPoint> FrontOf(const std::vector<AccuracyRow>& rows, const Measure& measure) {
  std::vector<PlotPoint> points;
  for (const AccuracyRow& row : rows) {
    if (IsTraining(row)) points.push_back({row.seconds, row.*measure.value});
  }
  return ParetoFront(std::move(points), measure.less_is_better);
}

std::string Text(const char* format, double value) {
  if (!std::isfinite(value)) return "";
  char text[32];
  std::snprintf(text, sizeof(text), format, value);
  return text;
}

}  // namespace

std::vector<StudyRun> SweepsAround(const TrainingOptions& base,
                                   int longest_side,
                                   bool base_sweeps) {
  std::vector<StudyRun> runs;
  const auto add = [&](const char* sweep, auto value, auto change) {
    StudyRun run{sweep, FormatValue(value), base, -1};
    change(&run);
    if (run.training.Check().empty()) runs.push_back(std::move(run));
  };
  const auto rays = [&](double factor) {
    const auto value = static_cast<int64_t>(factor * static_cast<double>(base.num_rays));
    add("num_rays", value, [&](StudyRun* run) { run->training.num_rays = value; });
  };
  const auto sites = [&](double factor) {
    const auto value = static_cast<int>(factor * base.final_sites);
    add("final_sites", value, [&](StudyRun* run) { run->training.final_sites = value; });
  };
  const auto size = [&](int divisor) {
    const int value = std::max(1, longest_side / divisor);
    add("max_image_size", value, [&](StudyRun* run) { run->max_image_size = value; });
  };
  const auto degree = [&](int value) {
    if (value == base.sh_degree) return;
    add("sh_degree", value, [&](StudyRun* run) { run->training.sh_degree = value; });
  };
  const auto cutoff = [&](double value) {
    if (value == base.transmittance_cutoff) return;
    add("transmittance_cutoff", value, [&](StudyRun* run) {
      run->training.transmittance_cutoff = value;
    });
  };
  const auto without = [&](const char* name, double TrainingOptions::*weight) {
    if (base.*weight == 0) return;
    add(name, 0, [&](StudyRun* run) { run->training.*weight = 0; });
  };
  rays(0.25), sites(0.25), size(2), degree(0), cutoff(0.1);
  without("color_gradient_rate", &TrainingOptions::color_gradient_rate);
  without("color_tv_weight", &TrainingOptions::color_tv_weight);
  if (base_sweeps) {
    without("distance_weight", &TrainingOptions::distance_weight);
    add("sweep_photos", 0, [](StudyRun* run) { run->sweeps = false; });
  }
  rays(0.5), sites(0.5), size(4), degree(1), cutoff(0.01);
  rays(2), sites(2), degree(2), cutoff(1e-4);
  degree(3);
  return runs;
}

std::vector<PlotPoint> ParetoFront(std::vector<PlotPoint> points, bool less_is_better) {
  std::erase_if(points, [](const PlotPoint& point) {
    return !std::isfinite(point.x) || !std::isfinite(point.y);
  });
  const double sign = less_is_better ? -1 : 1;
  std::sort(points.begin(), points.end(), [&](const PlotPoint& a, const PlotPoint& b) {
    return a.x != b.x ? a.x < b.x : sign * a.y > sign * b.y;
  });
  std::vector<PlotPoint> front;
  for (PlotPoint& point : points) {
    if (front.empty() || sign * point.y > sign * front.back().y) front.push_back(std::move(point));
  }
  return front;
}

std::string FormatAccuracyCsv(const std::vector<AccuracyRow>& rows) {
  std::ostringstream csv;
  csv << "sweep,value,rays,sites,sh_degree,image_size,transmittance_cutoff,seconds,psnr,ssim,miou,"
         "surface_error\n";
  for (const AccuracyRow& row : rows) {
    csv << row.sweep << ',' << row.value << ',' << row.rays << ',' << row.sites << ','
        << row.sh_degree << ',' << row.image_size << ',' << Text("%.6g", row.transmittance_cutoff)
        << ',' << Text("%.3f", row.seconds);
    for (const double value : {row.psnr, row.ssim, row.miou, row.surface_error}) {
      csv << ',' << Text("%.6g", value);
    }
    csv << '\n';
  }
  return csv.str();
}

std::string FormatAccuracyTable(const std::vector<AccuracyRow>& rows) {
  std::vector<std::vector<PlotPoint>> fronts;
  for (const Measure& measure : kMeasures) fronts.push_back(FrontOf(rows, measure));
  std::ostringstream table;
  table << "| what | value | rays | cells | seconds | PSNR | SSIM | mIoU | surface error |\n"
           "| --- | --- | --- | --- | --- | --- | --- | --- | --- |\n";
  for (const AccuracyRow& row : rows) {
    const auto figure = [&](int measure, const char* format) {
      const double value = row.*kMeasures[measure].value;
      const std::string text = Text(format, value);
      const auto& front = fronts[measure];
      const bool best = std::any_of(front.begin(), front.end(), [&](const PlotPoint& point) {
        return point.x == row.seconds && point.y == value;
      });
      return text.empty() ? "-" : best ? "**" + text + "**" : text;
    };
    const std::string ssim = Text("%.3f", row.ssim);
    table << "| " << row.sweep << " | " << row.value << " | "
          << Text("%.3g M", static_cast<double>(row.rays) / 1e6) << " | " << row.sites << " | "
          << Text("%.1f", row.seconds) << " | " << figure(0, "%.2f") << " | "
          << (ssim.empty() ? "-" : ssim) << " | " << figure(1, "%.3f") << " | " << figure(2, "%.3g")
          << " |\n";
  }
  return table.str();
}

Plot AccuracyPlot(const std::vector<AccuracyRow>& rows) {
  Plot plot{"What accuracy costs", "Pareto front", {}};
  std::vector<std::string> sweeps;  // in the order of their first rows
  for (const AccuracyRow& row : rows) {
    if (std::find(sweeps.begin(), sweeps.end(), row.sweep) == sweeps.end()) {
      sweeps.push_back(row.sweep);
    }
  }
  for (const Measure& measure : kMeasures) {
    PlotPanel panel{"seconds", measure.name, true, {}, FrontOf(rows, measure)};
    if (panel.front.empty()) continue;
    for (const std::string& sweep : sweeps) {
      const auto is_member = [&](const AccuracyRow& row) { return row.sweep == sweep; };
      const AccuracyRow& first = *std::find_if(rows.begin(), rows.end(), is_member);
      PlotSeries series{sweep, {}, /*line=*/true, /*markers=*/true};
      for (const AccuracyRow& row : rows) {
        const bool leads_through = &row == &rows.front() && IsTraining(first) && sweep != "preset";
        if (!is_member(row) && !leads_through) continue;
        const bool is_named = is_member(row) && sweep == "preset";
        series.points.push_back({row.seconds, row.*measure.value, is_named ? row.value : ""});
      }
      std::stable_sort(series.points.begin(),
                       series.points.end(),
                       [](const PlotPoint& a, const PlotPoint& b) { return a.x < b.x; });
      const bool is_known = std::any_of(rows.begin(), rows.end(), [&](const AccuracyRow& row) {
        return is_member(row) && std::isfinite(row.*measure.value);
      });
      if (is_known) panel.series.push_back(std::move(series));
    }
    plot.panels.push_back(std::move(panel));
  }
  return plot;
}

}  // namespace semfoam
