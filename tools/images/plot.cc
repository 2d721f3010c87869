// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/images/plot.h"

#include "foam/util/error.h"
#include "foam/util/output_file.h"
#include "tools/images/drawing.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <map>

#include <cairo-svg.h>
#include <glog/logging.h>

namespace semfoam {
namespace {

using Color = DrawingColor;

// Okabe and Ito's colours, which people with any colour vision tell apart.
constexpr std::array<Color, 7> kColors = {{{0.00, 0.45, 0.70},
                                           {0.84, 0.37, 0.00},
                                           {0.00, 0.62, 0.45},
                                           {0.80, 0.47, 0.65},
                                           {0.90, 0.62, 0.00},
                                           {0.34, 0.71, 0.91},
                                           {0.35, 0.35, 0.35}}};
constexpr Color kGrid = {0.88, 0.88, 0.88};
constexpr Color kFront = {0.55, 0.55, 0.55};

// Lengths in points; the PNG has kPngScale pixels for each.
constexpr double kPngScale = 2;
constexpr double kPanelWidth = 330, kPanelHeight = 260;
constexpr double kLeft = 58, kRight = 22, kTop = 54, kBelowAxis = 44;
constexpr double kLegendLine = 20, kLegendMargin = 10;
constexpr double kTitleSize = 14, kLabelSize = 11, kTickSize = 10;
constexpr double kMarkerRadius = 3.6;
constexpr int kMostTicks = 7;

// An axis: from values to points on the page.
struct Axis {
  double low = 0, high = 1;
  bool log = false;
  double begin = 0, end = 1;

  double At(double value) const {
    const double share =
        log ? std::log(value / low) / std::log(high / low) : (value - low) / (high - low);
    return begin + share * (end - begin);
  }
};

bool IsShown(const PlotPanel& panel, const PlotPoint& point) {
  return std::isfinite(point.x) && std::isfinite(point.y) && (!panel.log_x || point.x > 0);
}

// Returns the values' range with some room around it, never empty.
Axis MakeAxis(std::vector<double> values, bool log, double begin, double end) {
  if (values.empty()) values = log ? std::vector<double>{1, 10} : std::vector<double>{0, 1};
  auto [low, high] = std::minmax_element(values.begin(), values.end());
  Axis axis{*low, *high, log, begin, end};
  constexpr double kRoom = 0.06;
  if (log) {
    const double room = std::max(std::pow(axis.high / axis.low, kRoom), 1.1);
    axis.low /= room;
    axis.high *= room;
  } else {
    const double range = axis.high - axis.low;
    const double room = range > 0 ? kRoom * range : std::max(0.1 * std::abs(axis.low), 0.1);
    axis.low -= room;
    axis.high += room;
  }
  return axis;
}

std::string TickText(double value) {
  char text[32];
  std::snprintf(text, sizeof(text), "%.6g", value + 0.0);  // and no -0
  return text;
}

using Align = TextAlign;

class Drawing {
 public:
  Drawing(cairo_t* cairo, const Plot& plot) : cairo_(cairo), plot_(plot) {
    for (const PlotPanel& panel : plot.panels) {
      for (const PlotSeries& series : panel.series) {
        styles_.try_emplace(series.name, styles_.size());
      }
    }
  }

  // [width, height] in points.
  static std::array<double, 2> Size(const Plot& plot) {
    const double panels = static_cast<double>(std::max<size_t>(plot.panels.size(), 1));
    double lines = 1;
    for (const PlotPanel& panel : plot.panels) {
      lines = std::max(lines, static_cast<double>(panel.series.size() + 1));
    }
    // As many lines of the legend as there would be with one entry a line and panel.
    return {panels * (kLeft + kPanelWidth + kRight),
            kTop + kPanelHeight + kBelowAxis + kLegendLine * std::ceil((lines + 1) / (2 * panels)) +
                kLegendMargin};
  }

  void Draw() {
    const auto [width, height] = Size(plot_);
    SetColor({1, 1, 1});
    cairo_rectangle(cairo_, 0, 0, width, height);
    cairo_fill(cairo_);
    Text(plot_.title, width / 2, kTop / 2 - 4, kTitleSize, Align::kCenter);
    for (size_t i = 0; i < plot_.panels.size(); ++i) {
      DrawPanel(plot_.panels[i], static_cast<double>(i) * (kLeft + kPanelWidth + kRight));
    }
    DrawLegend(width);
  }

 private:
  void SetColor(const Color& color) { semfoam::SetColor(cairo_, color); }

  double TextWidth(const std::string& text, double size) {
    return semfoam::TextWidth(cairo_, text, size);
  }

  void Text(const std::string& text, double x, double y, double size, Align align) {
    DrawText(cairo_, text, x, y, size, align);
  }

  void Line(double x0, double y0, double x1, double y1) {
    cairo_move_to(cairo_, x0, y0);
    cairo_line_to(cairo_, x1, y1);
    cairo_stroke(cairo_);
  }

  void Marker(size_t style, double x, double y) {
    const double r = kMarkerRadius;
    cairo_new_path(cairo_);
    switch (style % 4) {
      case 0:
        cairo_arc(cairo_, x, y, r, 0, 2 * M_PI);
        break;
      case 1:
        cairo_rectangle(cairo_, x - 0.9 * r, y - 0.9 * r, 1.8 * r, 1.8 * r);
        break;
      case 2:
        cairo_move_to(cairo_, x, y - 1.2 * r);
        cairo_line_to(cairo_, x + 1.15 * r, y + 0.8 * r);
        cairo_line_to(cairo_, x - 1.15 * r, y + 0.8 * r);
        cairo_close_path(cairo_);
        break;
      default:
        cairo_move_to(cairo_, x, y - 1.3 * r);
        cairo_line_to(cairo_, x + 1.3 * r, y);
        cairo_line_to(cairo_, x, y + 1.3 * r);
        cairo_line_to(cairo_, x - 1.3 * r, y);
        cairo_close_path(cairo_);
    }
    SetColor(kColors[style % kColors.size()]);
    cairo_fill(cairo_);
  }

  void SetDashes(bool on) {
    const double dashes[] = {5, 3};
    cairo_set_dash(cairo_, dashes, on ? 2 : 0, 0);
  }

  void DrawFrame(const PlotPanel& panel, const Axis& x, const Axis& y) {
    cairo_set_line_width(cairo_, 1);
    for (const double tick : PlotTicks(x.low, x.high, kMostTicks, x.log)) {
      SetColor(kGrid);
      Line(x.At(tick), y.begin, x.At(tick), y.end);
      Text(TickText(tick), x.At(tick), y.begin + 14, kTickSize, Align::kCenter);
    }
    for (const double tick : PlotTicks(y.low, y.high, kMostTicks, y.log)) {
      SetColor(kGrid);
      Line(x.begin, y.At(tick), x.end, y.At(tick));
      Text(TickText(tick), x.begin - 5, y.At(tick) + 3.5, kTickSize, Align::kRight);
    }
    SetColor(kInk);
    Line(x.begin, y.begin, x.end, y.begin);
    Line(x.begin, y.begin, x.begin, y.end);
    Text(panel.x_label, (x.begin + x.end) / 2, y.begin + 32, kLabelSize, Align::kCenter);
    Text(panel.y_label, x.begin - 40, y.end - 8, kLabelSize, Align::kLeft);
  }

  void DrawFront(const PlotPanel& panel, const Axis& x, const Axis& y) {
    cairo_set_line_width(cairo_, 1.4);
    SetColor(kFront);
    SetDashes(true);
    const PlotPoint* previous = nullptr;
    for (const PlotPoint& point : panel.front) {
      if (!IsShown(panel, point)) continue;
      if (previous == nullptr) {
        cairo_move_to(cairo_, x.At(point.x), y.At(point.y));
      } else {
        cairo_line_to(cairo_, x.At(point.x), y.At(previous->y));
        cairo_line_to(cairo_, x.At(point.x), y.At(point.y));
      }
      previous = &point;
    }
    // What the last one reaches holds for any longer time.
    if (previous != nullptr) cairo_line_to(cairo_, x.end, y.At(previous->y));
    cairo_stroke(cairo_);
    SetDashes(false);
  }

  void DrawSeries(const PlotPanel& panel, const PlotSeries& series, const Axis& x, const Axis& y) {
    const size_t style = styles_.at(series.name);
    if (series.line) {
      cairo_set_line_width(cairo_, 1.8);
      SetColor(kColors[style % kColors.size()]);
      bool begun = false;
      for (const PlotPoint& point : series.points) {
        if (!IsShown(panel, point)) continue;
        (begun ? cairo_line_to : cairo_move_to)(cairo_, x.At(point.x), y.At(point.y));
        begun = true;
      }
      cairo_stroke(cairo_);
    }
    for (const PlotPoint& point : series.points) {
      if (!IsShown(panel, point)) continue;
      if (series.markers) Marker(style, x.At(point.x), y.At(point.y));
      if (point.label.empty()) continue;
      // To the right of the point, or to its left where there is no room.
      const bool fits = x.At(point.x) + 6 + TextWidth(point.label, kTickSize) < x.end + kRight;
      Text(point.label,
           x.At(point.x) + (fits ? 6 : -6),
           y.At(point.y) - 5,
           kTickSize,
           fits ? Align::kLeft : Align::kRight);
    }
  }

  void DrawPanel(const PlotPanel& panel, double left) {
    std::vector<double> xs, ys;
    const auto gather = [&](const std::vector<PlotPoint>& points) {
      for (const PlotPoint& point : points) {
        if (!IsShown(panel, point)) continue;
        xs.push_back(point.x);
        ys.push_back(point.y);
      }
    };
    for (const PlotSeries& series : panel.series) gather(series.points);
    gather(panel.front);
    const Axis x = MakeAxis(xs, panel.log_x, left + kLeft, left + kLeft + kPanelWidth);
    const Axis y = MakeAxis(ys, false, kTop + kPanelHeight, kTop);
    DrawFrame(panel, x, y);
    DrawFront(panel, x, y);
    for (const PlotSeries& series : panel.series) DrawSeries(panel, series, x, y);
    if (xs.empty()) {
      Text("no data", (x.begin + x.end) / 2, (y.begin + y.end) / 2, kLabelSize, Align::kCenter);
    }
  }

  void DrawLegend(double width) {
    constexpr double kSample = 26, kGap = 18;
    double x = kLeft, y = kTop + kPanelHeight + kBelowAxis + kLegendLine / 2;
    const auto begin_entry = [&](const std::string& name) {
      const double needed = kSample + TextWidth(name, kLabelSize);
      if (x > kLeft && x + needed > width - kRight) {
        x = kLeft;
        y += kLegendLine;
      }
      Text(name, x + kSample, y + 4, kLabelSize, Align::kLeft);
      return needed + kGap;
    };
    std::vector<std::pair<size_t, const PlotSeries*>> entries;
    for (const PlotPanel& panel : plot_.panels) {
      for (const PlotSeries& series : panel.series) {
        const size_t style = styles_.at(series.name);
        const bool known = std::any_of(
            entries.begin(), entries.end(), [&](const auto& e) { return e.first == style; });
        if (!known && !series.name.empty()) entries.emplace_back(style, &series);
      }
    }
    for (const auto& [style, series] : entries) {
      const double advance = begin_entry(series->name);
      if (series->line) {
        cairo_set_line_width(cairo_, 1.8);
        SetColor(kColors[style % kColors.size()]);
        Line(x, y, x + 20, y);
      }
      if (series->markers) Marker(style, x + 10, y);
      x += advance;
    }
    const bool has_front = std::any_of(plot_.panels.begin(),
                                       plot_.panels.end(),
                                       [](const PlotPanel& panel) { return !panel.front.empty(); });
    if (has_front) {
      begin_entry(plot_.front_name);
      cairo_set_line_width(cairo_, 1.4);
      SetColor(kFront);
      SetDashes(true);
      Line(x, y, x + 20, y);
      SetDashes(false);
    }
  }

  cairo_t* cairo_;
  const Plot& plot_;
  std::map<std::string, size_t> styles_;  // number of colour and marker, by series
};

void DrawOn(cairo_surface_t* surface, const Plot& plot, double scale) {
  const DrawingContext cairo = BeginDrawing(surface, scale);
  Drawing(cairo.get(), plot).Draw();
  CHECK_EQ(cairo_status(cairo.get()), CAIRO_STATUS_SUCCESS);
}

std::string Svg(const Plot& plot) {
  const auto [width, height] = Drawing::Size(plot);
  std::string text;
  const DrawingSurface surface(
      cairo_svg_surface_create_for_stream(AppendBytes, &text, width, height),
      cairo_surface_destroy);
  DrawOn(surface.get(), plot, 1);
  cairo_surface_finish(surface.get());
  CHECK_EQ(cairo_surface_status(surface.get()), CAIRO_STATUS_SUCCESS);
  // Cairo numbers the surfaces of a process.
  const std::string id = "id=\"surface";
  for (size_t at = text.find(id); at != std::string::npos; at = text.find(id, at + 1)) {
    const size_t digits = at + id.size();
    const size_t end = text.find_first_not_of("0123456789", digits);
    if (end == std::string::npos || end == digits || text[end] != '"') continue;
    text.replace(at, end - at, "id=\"plot");
  }
  return text;
}

std::string Png(const Plot& plot) {
  const auto [width, height] = Drawing::Size(plot);
  const DrawingSurface surface(
      cairo_image_surface_create(CAIRO_FORMAT_RGB24,
                                 static_cast<int>(std::ceil(kPngScale * width)),
                                 static_cast<int>(std::ceil(kPngScale * height))),
      cairo_surface_destroy);
  DrawOn(surface.get(), plot, kPngScale);
  return EncodePng(surface.get());
}

std::vector<double> LinearTicks(double low, double high, int most) {
  const double power = std::pow(10.0, std::floor(std::log10((high - low) / most)));
  std::vector<double> ticks;
  for (const double step : {1.0, 2.0, 5.0, 10.0, 20.0}) {
    ticks.clear();
    // Whole multiples, so that 0.3 is 3 * 0.1 and not a sum of rounding errors.
    for (double k = std::ceil(low / (step * power)); k * step * power <= high; ++k) {
      ticks.push_back(k * step * power);
      if (static_cast<int>(ticks.size()) > most) break;
    }
    if (static_cast<int>(ticks.size()) <= most) break;
  }
  return ticks;
}

}  // namespace

std::vector<double> PlotTicks(double low, double high, int most, bool log) {
  CHECK_LT(low, high);
  if (!log) return LinearTicks(low, high, most);
  CHECK_GT(low, 0);
  std::vector<double> all, powers;
  for (double power = std::floor(std::log10(low)); power <= std::log10(high); ++power) {
    for (const double digit : {1.0, 2.0, 5.0}) {
      const double tick = digit * std::pow(10.0, power);
      if (tick < low || tick > high) continue;
      all.push_back(tick);
      if (digit == 1) powers.push_back(tick);
    }
  }
  if (all.size() < 3) return LinearTicks(low, high, most);
  return static_cast<int>(all.size()) <= most ? all : powers;
}

void WritePlot(const std::filesystem::path& stem, const Plot& plot) {
  WriteTextFile(stem.string() + ".svg", Svg(plot));
  WriteTextFile(stem.string() + ".png", Png(plot));
}

}  // namespace semfoam
