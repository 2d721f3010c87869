// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/support/progress.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace semfoam {
namespace {

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

}  // namespace

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

ProgressLine::ProgressLine(std::ostream& out, bool is_terminal, double seconds_between_lines)
    : out_(out), is_terminal_(is_terminal), seconds_between_lines_(seconds_between_lines) {}

ProgressLine::~ProgressLine() {
  if (line_is_open_) out_ << std::endl;
}

void ProgressLine::Update(const TrainingProgress& progress) {
  const double seconds = progress.seconds - previous_.seconds;
  // Reports can come faster than the clock ticks; the mean of the run is the better guess then.
  const double rays_per_second =
      seconds > 0.05 ? static_cast<double>(progress.rays - previous_.rays) / seconds
                     : static_cast<double>(progress.rays) / std::max(progress.seconds, 1e-3);
  const bool is_last = progress.iteration >= progress.num_iterations;
  if (is_terminal_) {
    Redraw(FormatProgress(progress, rays_per_second));
    previous_ = progress;
    return;
  }
  if (!is_last && progress.seconds - seconds_at_last_line_ < seconds_between_lines_) return;
  out_ << FormatProgress(progress, rays_per_second) << std::endl;
  seconds_at_last_line_ = progress.seconds;
  previous_ = progress;
}

void ProgressLine::Show(const std::string& text, double seconds) {
  constexpr double kSecondsBetweenRedraws = 0.1;
  if (seconds - seconds_at_last_line_ <
      (is_terminal_ ? kSecondsBetweenRedraws : seconds_between_lines_)) {
    return;
  }
  seconds_at_last_line_ = seconds;
  if (is_terminal_) {
    Redraw(text);
  } else {
    out_ << text << std::endl;
  }
}

void ProgressLine::Clear() {
  if (line_is_open_) out_ << "\r\x1b[K" << std::flush;
  line_is_open_ = false;
}

void ProgressLine::Redraw(const std::string& text) {
  out_ << '\r' << text << "\x1b[K" << std::flush;
  line_is_open_ = true;
}

}  // namespace semfoam
