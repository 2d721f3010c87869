// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <map>
#include <ostream>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>

namespace semfoam {

// Displays the cases as Google Benchmark does (--benchmark_format), and keeps the data of the final
// table.
class Report : public benchmark::BenchmarkReporter {
 public:
  // Must be called after benchmark::Initialize, which reads the format.
  Report();

  bool ReportContext(const Context& context) override;
  void ReportRuns(const std::vector<Run>& runs) override;
  void Finalize() override;

  // Prints a row for each subject and size that was run: rates on 1 and on 2 threads, the factor in
  // time for ten times the sites, memory, and the share of the bound, a stream copy, which is
  // measured here. With --benchmark_repetitions these are medians. Prints nothing where nothing was
  // run. Prints to stdout, or to stderr where stdout has a machine-readable format.
  void PrintTable() const;

  // Returns whether a case ended in an error.
  bool Failed() const { return failed_; }

 private:
  // The measurements of one case on one number of threads.
  struct Measurement {
    // Wall-clock seconds of an iteration.
    std::vector<double> seconds;
    std::map<std::string, std::vector<double>> counters;
  };

  // Returns the median of a counter; NaN without measurements.
  double Median(const std::string& name, int num_threads, const std::string& counter) const;
  double MedianSeconds(const std::string& name) const;
  void PrintTo(std::ostream& out) const;

  // Owned by the library, never freed.
  benchmark::BenchmarkReporter* const display_;
  // Names without "/threads:", in the order of the runs.
  std::vector<std::string> names_;
  std::map<std::string, std::map<int, Measurement>> measurements_;
  // CPU time over wall-clock time, on 1 thread.
  std::vector<double> core_shares_;
  bool failed_ = false;
};

}  // namespace semfoam
