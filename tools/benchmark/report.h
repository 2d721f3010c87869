// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <map>
#include <ostream>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>

namespace semfoam {

// Shows the cases as Google Benchmark would (--benchmark_format), and keeps what the closing table
// is made of.
class Report : public benchmark::BenchmarkReporter {
 public:
  // After benchmark::Initialize, which reads the format.
  Report();

  bool ReportContext(const Context& context) override;
  void ReportRuns(const std::vector<Run>& runs) override;
  void Finalize() override;

  // A row for each subject and size that was run: rates on 1 and on 2 threads, what ten times the
  // sites cost, memory, and the share that each has of the bound, a stream copy, which is measured
  // here. With --benchmark_repetitions the medians. Prints nothing where nothing was run. Goes to
  // stdout, or to stderr where stdout is for a machine to read.
  void PrintTable() const;

  // Whether a case ended in an error.
  bool Failed() const { return failed_; }

 private:
  // The measurements of one case on one number of threads.
  struct Measurement {
    std::vector<double> seconds;  // of the wall clock, for an iteration
    std::map<std::string, std::vector<double>> counters;
  };

  // NaN where there is none.
  double Median(const std::string& name, int num_threads, const std::string& counter) const;
  double MedianSeconds(const std::string& name) const;
  void PrintTo(std::ostream& out) const;

  benchmark::BenchmarkReporter* const display_;  // the library's, never freed
  std::vector<std::string> names_;               // without "/threads:", as they came
  std::map<std::string, std::map<int, Measurement>> measurements_;
  std::vector<double> core_shares_;  // time of the CPU over that of the wall, on 1 thread
  bool failed_ = false;
};

}  // namespace semfoam
