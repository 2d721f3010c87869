// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/device/device.h"
#include "foam/util/elapsed_time.h"
#include "foam/util/error.h"
#include "tools/cli/option_manager.h"
#include "tools/commands/commands.h"
#include "tools/options/json_option.h"

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <string>
#include <utility>
#include <vector>

#include "tests/hard_cases/hard_case.h"
#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

using nlohmann::ordered_json;
using Clock = std::chrono::steady_clock;

struct Row {
  size_t cases = 0;
  size_t passed = 0;
  double seconds = 0;
  HardCaseResult result;
  // Cases that were printed, with "failures".
  ordered_json printed = ordered_json::array();
};

// Prints cases that fail, or all of them; with `json`, keeps them in the row instead.
Row RunFamily(const HardCaseFamily& family, const Device& device, bool print_cases, bool json) {
  Row row;
  const Clock::time_point begin = Clock::now();
  for (const HardCase& hard_case : family.cases) {
    const Clock::time_point case_begin = Clock::now();
    const HardCaseResult result = hard_case.run({nullptr, device});
    const bool passed = result.failures.empty();
    ++row.cases;
    row.passed += passed;
    row.result.Add(result);
    if (!print_cases && passed) continue;
    if (json) {
      row.printed.push_back({{"case", hard_case.name},
                             {"expected", hard_case.expected},
                             {"seconds", SecondsSince(case_begin)},
                             {"failures", result.failures}});
    } else {
      std::printf("%s %s/%s (%.2f s): %s\n",
                  passed ? "passed" : "FAILED",
                  family.name.c_str(),
                  hard_case.name.c_str(),
                  SecondsSince(case_begin),
                  hard_case.expected.c_str());
      for (const std::string& failure : result.failures) std::printf("  %s\n", failure.c_str());
      std::fflush(stdout);
    }
  }
  row.seconds = SecondsSince(begin);
  return row;
}

void Print(const std::string& name, const Row& row) {
  std::printf("%-8s %6zu %7zu %8lld %10lld %8.1f\n",
              name.c_str(),
              row.cases,
              row.passed,
              static_cast<long long>(row.result.rays),
              static_cast<long long>(row.result.steps),
              row.seconds);
}

ordered_json ToJson(const std::string& name, const Row& row) {
  ordered_json json = {{"family", name},
                       {"cases", row.cases},
                       {"passed", row.passed},
                       {"rays", row.result.rays},
                       {"steps", row.result.steps},
                       {"zero_length_steps", row.result.zero_length_steps},
                       {"step_limit_hits", row.result.step_limit_hits},
                       {"seconds", row.seconds}};
  for (const auto& [variant, largest] : row.result.deviations) {
    json["largest_deviations"][variant] = {{"walk", largest.walk}, {"weights", largest.weights}};
    if (largest.gradient > 0) json["largest_deviations"][variant]["gradient"] = largest.gradient;
  }
  if (!row.printed.empty()) json["printed_cases"] = row.printed;
  return json;
}

void PrintDeviations(const HardCaseResult& result) {
  std::printf("\n%-20s %9s %9s %9s\n", "largest deviation", "walk", "weights", "gradient");
  for (const auto& [variant, largest] : result.deviations) {
    std::printf("%-20s %9.1e %9.1e", variant.c_str(), largest.walk, largest.weights);
    // The reference has nothing to be compared with here; the tests have ceres::Jet.
    if (largest.gradient > 0) {
      std::printf(" %9.1e\n", largest.gradient);
    } else {
      std::printf(" %9s\n", "-");
    }
  }
  std::printf(
      "walk: how much farther than the nearest site a cell's own is, of the scene's size\n"
      "weights: their sum against 1 - transmittance\n"
      "gradient: against the backward pass in double, of the terms that make it up\n\n"
      "%lld steps of %lld had no length, %lld rays hit the step limit.\n",
      static_cast<long long>(result.zero_length_steps),
      static_cast<long long>(result.steps),
      static_cast<long long>(result.step_limit_hits));
}

}  // namespace

void RunSelfTest(int argc, char** argv) {
  bool print_cases = false;
  bool json = false;
  OptionManager options("self_test",
                        "Runs the numerically hard cases on this machine: sites, frames, rays and "
                        "values on which a ray tracer may loop, cancel or overflow.");
  options.AddDefaultOption(
      "print_cases", &print_cases, "a line for every case, with the outcome that it must have");
  AddJsonOption(&options, &json);
  options.AddDeviceOption();
  if (!options.Parse(argc, argv)) return;

  Row total;
  std::vector<std::pair<std::string, Row>> rows;
  for (const HardCaseFamily& family : HardCaseFamilies()) {
    rows.emplace_back(family.name, RunFamily(family, options.device(), print_cases, json));
    const Row& row = rows.back().second;
    total.cases += row.cases;
    total.passed += row.passed;
    total.seconds += row.seconds;
    total.result.Add(row.result);
  }
  if (json) {
    ordered_json document = {{"version", 1}, {"all", ToJson("all", total)}};
    for (const auto& [name, row] : rows) document["families"].push_back(ToJson(name, row));
    PrintJson(document);
  } else {
    std::printf(
        "%-8s %6s %7s %8s %10s %8s\n", "family", "cases", "passed", "rays", "steps", "seconds");
    for (const auto& [name, row] : rows) Print(name, row);
    Print("all", total);
    PrintDeviations(total.result);
  }
  if (total.passed < total.cases) {
    throw UserError(total.cases - total.passed,
                    " of ",
                    total.cases,
                    " hard cases failed on this machine; please report what is printed above.");
  }
}

}  // namespace semfoam
