// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/support/progress.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iostream>

#include <nlohmann/json.hpp>
#include <sys/ioctl.h>
#include <unistd.h>

namespace semfoam {
namespace {

using nlohmann::ordered_json;

constexpr double kSecondsBetweenObjects = 1;
constexpr double kSecondsBetweenRedraws = 0.1;

ProgressStyle style_of_process = ProgressStyle::kAuto;

int TerminalColumns() {
  constexpr int kUsual = 80;
  winsize size = {};
  if (::ioctl(STDERR_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_col == 0) return kUsual;
  return size.ws_col;
}

template <typename... Args>
std::string Print(const char* format, Args... args) {
  char text[128];
  std::snprintf(text, sizeof(text), format, args...);
  return text;
}

std::string FormatRate(double per_second) {
  if (per_second >= 1e6) return Print("%.2f M", per_second / 1e6);
  if (per_second >= 1e3) return Print("%.0f k", per_second / 1e3);
  return Print("%.0f ", per_second);
}

// Returns a bar as wide as `columns`, brackets included: "[####------]".
std::string Bar(double share, int columns) {
  std::string bar(columns, '-');
  const auto full = std::lround(std::clamp(share, 0.0, 1.0) * (columns - 2));
  std::fill_n(bar.begin() + 1, full, '#');
  bar.front() = '[';
  bar.back() = ']';
  return bar;
}

double ShareOf(const TrainingProgress& progress) {
  return progress.num_iterations > 0 ? static_cast<double>(progress.iteration) /
                                           static_cast<double>(progress.num_iterations)
                                     : 0;
}

// Rounded, so that the lines stay readable.
double Rounded(double value, double unit) { return std::round(value / unit) * unit; }

std::string ToJson(const TrainingProgress& progress) {
  ordered_json json = {{"task", "training"},
                       {"share", Rounded(ShareOf(progress), 1e-4)},
                       {"seconds", Rounded(progress.seconds, 0.01)}};
  if (std::isfinite(progress.seconds_left)) {
    json["seconds_left"] = Rounded(progress.seconds_left, 0.01);
  }
  json["iteration"] = progress.iteration;
  json["num_iterations"] = progress.num_iterations;
  json["rays"] = progress.rays;
  json["sites"] = progress.sites;
  if (!std::isnan(progress.held_out_psnr)) json["held_out_psnr"] = progress.held_out_psnr;
  if (!std::isnan(progress.held_out_miou)) json["held_out_miou"] = progress.held_out_miou;
  return json.dump();
}

// Returns NaN where it is not known.
double SecondsLeft(const WorkProgress& progress) {
  if (!(progress.share > 0)) return NAN;
  return progress.seconds * (1 - progress.share) / progress.share;
}

std::string ToJson(const WorkProgress& progress) {
  ordered_json json = {{"task", progress.what},
                       {"share", Rounded(progress.share, 1e-4)},
                       {"seconds", Rounded(progress.seconds, 0.01)}};
  const double left = SecondsLeft(progress);
  if (std::isfinite(left)) json["seconds_left"] = Rounded(left, 0.01);
  // Names of files may be no UTF-8.
  return json.dump(-1, ' ', false, ordered_json::error_handler_t::replace);
}

}  // namespace

void SetProgressStyle(ProgressStyle style) { style_of_process = style; }

ProgressStyle CurrentProgressStyle() {
  if (style_of_process != ProgressStyle::kAuto) return style_of_process;
  return ::isatty(STDERR_FILENO) != 0 ? ProgressStyle::kBar : ProgressStyle::kLines;
}

WorkProgress CountProgress(const std::string& what, int done, int total, double seconds) {
  WorkProgress progress{what, total > 0 ? static_cast<double>(done) / total : 0, seconds, ""};
  progress.line = what + " " + std::to_string(done) + "/" + std::to_string(total);
  if (done > 0 && done < total) {
    progress.line += ", " + FormatDuration(SecondsLeft(progress)) + " left";
  }
  return progress;
}

std::string FormatDuration(double seconds) {
  const int64_t whole = std::llround(std::max(0.0, seconds));
  const int hours = static_cast<int>(whole / 3600);
  const int minutes = static_cast<int>(whole / 60 % 60);
  const int rest = static_cast<int>(whole % 60);
  if (hours > 0) return Print("%d:%02d:%02d", hours, minutes, rest);
  return Print("%d:%02d", minutes, rest);
}

std::string FormatProgress(const TrainingProgress& progress, double rays_per_second) {
  std::string text = "iteration " + std::to_string(progress.iteration) + "/" +
                     std::to_string(progress.num_iterations) + ", " +
                     std::to_string(progress.sites) + " sites";
  if (std::isfinite(rays_per_second)) text += ", " + FormatRate(rays_per_second) + " rays/s";
  if (!std::isnan(progress.held_out_psnr)) {
    text += Print(", held-out %.2f dB", progress.held_out_psnr);
  }
  if (std::isfinite(progress.seconds_left) && progress.iteration < progress.num_iterations) {
    text += ", " + FormatDuration(progress.seconds_left) + " left";
  }
  return text;
}

ProgressLine::ProgressLine()
    : ProgressLine(std::cerr, CurrentProgressStyle(), 10, TerminalColumns()) {}

ProgressLine::ProgressLine(std::ostream& out,
                           ProgressStyle style,
                           double seconds_between_lines,
                           int columns)
    : out_(out), style_(style), seconds_between_lines_(seconds_between_lines), columns_(columns) {}

ProgressLine::~ProgressLine() {
  if (line_is_open_) out_ << std::endl;
}

bool ProgressLine::IsDue(double seconds) const {
  const double between =
      style_ == ProgressStyle::kJson ? kSecondsBetweenObjects : seconds_between_lines_;
  return seconds - seconds_at_last_line_ >= between;
}

void ProgressLine::Update(const TrainingProgress& progress) {
  if (style_ == ProgressStyle::kNone) return;
  const bool is_last = progress.iteration >= progress.num_iterations;
  if (style_ == ProgressStyle::kBar) {
    std::string text = std::to_string(progress.sites) + " sites";
    if (!std::isnan(progress.held_out_psnr)) {
      text = Print("held-out %.2f dB, ", progress.held_out_psnr) + text;
    }
    Redraw(ShareOf(progress), is_last ? 0 : progress.seconds_left, text);
    return;
  }
  if (!is_last && !IsDue(progress.seconds)) return;
  seconds_at_last_line_ = progress.seconds;
  if (style_ == ProgressStyle::kJson) {
    out_ << ToJson(progress) << std::endl;
    return;
  }
  const double seconds = progress.seconds - previous_.seconds;
  // Reports can come faster than the clock ticks; the mean of the run is the better guess then.
  const double rays_per_second =
      seconds > 0.05 ? static_cast<double>(progress.rays - previous_.rays) / seconds
                     : static_cast<double>(progress.rays) / std::max(progress.seconds, 1e-3);
  out_ << FormatProgress(progress, rays_per_second) << std::endl;
  previous_ = progress;
}

void ProgressLine::Show(const WorkProgress& progress) {
  if (style_ == ProgressStyle::kNone) return;
  if (style_ == ProgressStyle::kBar) {
    if (progress.seconds - seconds_at_last_line_ < kSecondsBetweenRedraws) return;
    seconds_at_last_line_ = progress.seconds;
    Redraw(progress.share, SecondsLeft(progress), progress.what);
    return;
  }
  if (!IsDue(progress.seconds)) return;
  seconds_at_last_line_ = progress.seconds;
  out_ << (style_ == ProgressStyle::kJson ? ToJson(progress) : progress.line) << std::endl;
}

void ProgressLine::Clear() {
  if (line_is_open_) out_ << "\r\x1b[K" << std::flush;
  line_is_open_ = false;
}

void ProgressLine::Redraw(double share, double seconds_left, const std::string& text) {
  // A line that fills the terminal would wrap, and could not be redrawn.
  const auto most = static_cast<size_t>(std::max(columns_ - 1, 1));
  std::string line = Bar(share, std::clamp(columns_ - 50, 12, 32)) +
                     Print(" %3d %%", static_cast<int>(100 * std::clamp(share, 0.0, 1.0)));
  if (std::isfinite(seconds_left)) line += ", " + FormatDuration(seconds_left) + " left";
  line += ", " + text;
  if (line.size() > most) line.resize(most);
  out_ << '\r' << line << "\x1b[K" << std::flush;
  line_is_open_ = true;
}

}  // namespace semfoam
