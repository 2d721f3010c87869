// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace semfoam {

struct PlotPoint {
  double x = 0;
  double y = 0;
  std::string label = {};  // beside the point; empty = none
};

// Points that belong together: one colour, one marker, one entry in the legend.
struct PlotSeries {
  std::string name;  // series of one name share colour, marker and entry, in all panels
  std::vector<PlotPoint> points;  // those that are not finite are left out
  bool line = true;               // join the points in their order
  bool markers = false;
};

// One pair of axes.
struct PlotPanel {
  std::string x_label;
  std::string y_label;
  bool log_x = false;  // points with x <= 0 are left out
  std::vector<PlotSeries> series;
  std::vector<PlotPoint> front;  // a dashed line in steps below the series, by ascending x
};

// Panels from left to right under one title, above one legend.
struct Plot {
  std::string title;
  std::string front_name;  // of the dashed lines, in the legend
  std::vector<PlotPanel> panels;
};

// Draws the plot as `<stem>.svg` and as `<stem>.png` with twice the resolution; the same code draws
// both, and the same plot gives the same bytes (with the same cairo and fonts). Each is written
// beside its target and renamed into place. Throws UserError where that is not possible.
void WritePlot(const std::filesystem::path& stem, const Plot& plot);

// Where an axis that holds `low` to `high` has its marks: multiples of 1, 2 or 5 times a power of
// ten, ascending, at most `most`, all within. With `log`, for an axis in powers of ten (low > 0):
// 1, 2, 5 of each power of ten, or powers of ten alone where those would be too many, or linear
// marks where those would be fewer than three. CHECKs low < high.
std::vector<double> PlotTicks(double low, double high, int most, bool log);

}  // namespace semfoam
