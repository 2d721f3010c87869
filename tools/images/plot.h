// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace semfoam {

struct PlotPoint {
  double x = 0;
  double y = 0;
  // Text beside the point; empty: none.
  std::string label = {};
};

// Points with one colour, one marker, and one entry in the legend.
struct PlotSeries {
  // Series of the same name share colour, marker and entry, in all panels.
  std::string name;
  // Points that are not finite are left out.
  std::vector<PlotPoint> points;
  // Whether to connect the points in their order.
  bool line = true;
  bool markers = false;
};

// One pair of axes.
struct PlotPanel {
  std::string x_label;
  std::string y_label;
  // Whether the x axis is logarithmic; points with x <= 0 are then left out.
  bool log_x = false;
  std::vector<PlotSeries> series;
  // Points of a dashed step line below the series, by ascending x.
  std::vector<PlotPoint> front;
};

// Panels from left to right under one title, above one legend.
struct Plot {
  std::string title;
  // Name of the dashed lines in the legend.
  std::string front_name;
  std::vector<PlotPanel> panels;
};

// Draws the plot as `<stem>.svg` and as `<stem>.png` with twice the resolution; the same code draws
// both, and the same plot gives the same bytes (with the same cairo and fonts). Each is written
// beside its target and renamed into place. Throws UserError where a file cannot be written.
void WritePlot(const std::filesystem::path& stem, const Plot& plot);

// Returns the positions of the tick marks of an axis from `low` to `high`: multiples of 1, 2 or 5
// times a power of ten, ascending, at most `most`, all within the range. With `log`, for a
// logarithmic axis (low > 0): 1, 2 and 5 times each power of ten, or only powers of ten if those
// would be too many, or linear marks if those would be fewer than three. CHECKs low < high.
std::vector<double> PlotTicks(double low, double high, int most, bool log);

}  // namespace semfoam
