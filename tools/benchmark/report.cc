// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/benchmark/report.h"

#include "tools/benchmark/case.h"
#include "tools/benchmark/stream_copy.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <iomanip>
#include <iostream>
#include <sstream>
#include <string>
#include <vector>

namespace semfoam {
namespace {

// How the table speaks of a subject: the counter of its rate, what that counts, and the floor of
// its memory traffic, which is the counter "touched_per_<unit>".
struct Subject {
  const char* name;
  const char* rate;
  const char* unit;
};
constexpr Subject kSubjects[] = {
    {"delaunay", "sites_per_second", "site"},
    {"walk/scalar", "steps_per_second", "step"},
    {"walk/simd", "steps_per_second", "step"},
    {"walk/interleaved", "steps_per_second", "step"},
    {"render/forward", "rays_per_second", "ray"},
    {"render/backward", "rays_per_second", "ray"},
    {"render/backward_plain", "rays_per_second", "ray"},
    {"update", "updates_per_second", "update"},
    {"voxelize", "voxels_per_second", "voxel"},
};

double MedianOf(std::vector<double> values) {
  if (values.empty()) return NAN;
  std::sort(values.begin(), values.end());
  const size_t half = values.size() / 2;
  return values.size() % 2 == 1 ? values[half] : 0.5 * (values[half - 1] + values[half]);
}

// Returns a number with `decimals` decimals and a suffix, or "-" if it is not known.
std::string Text(double value, int decimals, const std::string& behind = "") {
  if (!std::isfinite(value)) return "-";
  std::ostringstream text;
  text << std::fixed << std::setprecision(decimals) << value << behind;
  return text.str();
}

std::string RateText(const Subject& subject, double rate) {
  if (std::string(subject.unit) == "update") return Text(1e3 / rate, 2, " ms");
  return Text(rate / 1e6, rate < 10e6 ? 3 : 1, std::string(" M ") + subject.unit + "s/s");
}

// Returns bytes as text with about three digits.
std::string BytesText(double bytes, const std::string& behind = "") {
  if (bytes < 1e4) return Text(bytes, 0, " B" + behind);
  return bytes < 1e6 ? Text(bytes / 1e3, 1, " kB" + behind) : Text(bytes / 1e6, 1, " MB" + behind);
}

constexpr char kThreadsMark[] = "/threads:";

// A thread that computes has its core for itself, or other programs spoil the measurement.
constexpr double kQuietPercent = 95;

void PrintRow(const std::vector<std::string>& columns, std::ostream& out) {
  constexpr int kWidths[] = {16, 9, 18, 18, 9, 9, 9, 10, 17, 10, 11};
  for (size_t k = 0; k < columns.size(); ++k) {
    out << (k == 0 ? std::left : std::right) << std::setw(kWidths[k]) << columns[k];
  }
  out << "\n";
}

// The two lines above the rows.
void PrintTitles(std::ostream& out) {
  PrintRow({"", "", "", "", "2 to 1", "time at", "bytes", "peak", "touched", "of the", "bound on"},
           out);
  PrintRow({"case",
            "sites",
            "1 thread",
            "2 threads",
            "threads",
            "10 x",
            "a site",
            "memory",
            "at least",
            "1 thread",
            "2 threads"},
           out);
}

// What the columns and subjects mean.
void PrintNotes(std::ostream& out) {
  out << "\ntime at 10 x: how many times as long the same job takes on ten times the sites, on 1 "
         "thread. The job: all sites (delaunay),\n  a picture (walk, render/forward), a batch of "
         "rays (render/backward, update).\n"
         "render/backward_plain: render/backward without view-dependent colour and identity.\n"
         "of the bound: the rate times the bytes that it touches at least, as a share of the "
         "stream "
         "copy; above 100 %, caches serve it.\n";
}

// Google Benchmark 1.8 put `skipped` in the place of `error_occurred`.
template <typename Run>
bool HasFailed(const Run& run) {
  if constexpr (requires { run.error_occurred; }) {
    return run.error_occurred;
  } else {
    return run.skipped != 0;
  }
}

}  // namespace

Report::Report() : display_(benchmark::CreateDefaultDisplayReporter()) {}

bool Report::ReportContext(const Context& context) { return display_->ReportContext(context); }

void Report::Finalize() { display_->Finalize(); }

void Report::ReportRuns(const std::vector<Run>& runs) {
  display_->ReportRuns(runs);
  for (const Run& run : runs) {
    const bool has_failed = HasFailed(run);
    failed_ |= has_failed;
    if (has_failed) continue;
    const std::string full_name = run.run_name.str();
    const size_t mark = full_name.find(kThreadsMark);
    const std::string name = full_name.substr(0, mark);
    const int num_threads =
        mark == std::string::npos
            ? 1
            : std::atoi(full_name.c_str() + mark + std::char_traits<char>::length(kThreadsMark));
    const bool is_median = run.run_type == Run::RT_Aggregate && run.aggregate_name == "median";
    if (run.run_type == Run::RT_Aggregate && !is_median) continue;
    if (!measurements_.contains(name)) names_.push_back(name);
    if (num_threads == 1 && run.real_accumulated_time > 0) {
      core_shares_.push_back(run.cpu_accumulated_time / run.real_accumulated_time);
    }
    Measurement& measurement = measurements_[name][num_threads];
    // The library's median stands alone where the runs that it is made of are not shown.
    if (is_median) measurement = {};
    measurement.seconds.push_back(run.GetAdjustedRealTime() /
                                  benchmark::GetTimeUnitMultiplier(run.time_unit));
    for (const auto& [counter, value] : run.counters) {
      measurement.counters[counter].push_back(value);
    }
  }
}

double Report::Median(const std::string& name, int num_threads, const std::string& counter) const {
  const auto by_threads = measurements_.find(name);
  if (by_threads == measurements_.end()) return NAN;
  const auto measurement = by_threads->second.find(num_threads);
  if (measurement == by_threads->second.end()) return NAN;
  const auto values = measurement->second.counters.find(counter);
  return values == measurement->second.counters.end() ? NAN : MedianOf(values->second);
}

double Report::MedianSeconds(const std::string& name) const {
  const auto by_threads = measurements_.find(name);
  if (by_threads == measurements_.end() || !by_threads->second.contains(1)) return NAN;
  return MedianOf(by_threads->second.at(1).seconds);
}

void Report::PrintTable() const {
  if (names_.empty()) return;
  const bool for_people = dynamic_cast<benchmark::ConsoleReporter*>(display_) != nullptr;
  PrintTo(for_people ? std::cout : std::cerr);
}

void Report::PrintTo(std::ostream& out) const {
  const double copy1 = StreamCopyBytesPerSecond(1), copy2 = StreamCopyBytesPerSecond(2);
  out << "\nThe bound, a stream copy (read and written bytes): " << Text(copy1 / 1e9, 1)
      << " GB/s on 1 thread, " << Text(copy2 / 1e9, 1) << " GB/s on 2.\n\n";
  PrintTitles(out);
  // By subject and size, and the trained foam last.
  std::vector<std::string> names = names_;
  std::stable_partition(names.begin(), names.end(), [](const std::string& name) {
    return std::isdigit(static_cast<unsigned char>(name.back())) != 0;
  });
  for (const Subject& subject : kSubjects) {
    for (const std::string& name : names) {
      const size_t slash = name.rfind('/');
      if (name.substr(0, slash) != subject.name) continue;
      const double rate1 = Median(name, 1, subject.rate), rate2 = Median(name, 2, subject.rate);
      const auto of_any = [&](const std::string& counter) {
        const double value = Median(name, 1, counter);
        return std::isfinite(value) ? value : Median(name, 2, counter);
      };
      const double touched = of_any(std::string("touched_per_") + subject.unit);
      PrintRow({subject.name,
                name.substr(slash + 1),
                RateText(subject, rate1),
                RateText(subject, rate2),
                Text(rate2 / rate1, 2, "x"),
                Text(MedianSeconds(name + "0") / MedianSeconds(name), 2, "x"),
                Text(of_any("bytes_per_site"), 0),
                BytesText(of_any("peak_bytes")),
                BytesText(touched, std::string("/") + subject.unit),
                Text(100 * rate1 * touched / copy1, 1, " %"),
                Text(100 * rate2 * touched / copy2, 1, " %")},
               out);
    }
  }
  PrintNotes(out);
  if (const double share = 100 * MedianOf(core_shares_); share < kQuietPercent) {
    out << "The machine was busy: a thread had " << Text(share, 0)
        << " % of a core (median), so the rates are too low, and those of 2 threads more so.\n";
  }
  out << std::flush;
}

}  // namespace semfoam
