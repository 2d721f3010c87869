// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/render/ray_tracer.h"
#include "foam/util/error.h"
#include "tools/benchmark/cases.h"
#include "tools/benchmark/report.h"
#include "tools/benchmark/scenes.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <new>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>

namespace semfoam {
namespace {

constexpr int64_t kSizes[] = {10'000, 100'000, 1'000'000};
// The papers' scenes: only a GPU trains so many, but it is the machine that triangulates.
constexpr int64_t kTriangulatedSizes[] = {2'000'000, 4'000'000};

bool help_wanted = false;

// The library calls this for --help, and, before it exits with 0, also for a value of its own
// options that it does not know.
void PrintHelp() {
  if (!help_wanted) {
    std::fprintf(stderr, "ERROR: --benchmark_format is console, json or csv.\n");
    std::exit(EXIT_FAILURE);  // NOLINT(concurrency-mt-unsafe): no thread has begun
  }
  std::printf(
      "semfoam_benchmark: how fast triangulation, ray walk, rendering, update and "
      "voxelization are on this\nmachine, on one and two threads, for scenes of 10000 to 1000000 "
      "sites (triangulation: to 4000000); and how near that is to what its memory\ncan do.\n\n"
      "Usage:\n"
      "  semfoam_benchmark [--foam FILE] [--simd NAME] [--benchmark_...]\n\n"
      "  --foam FILE   also render/.../foam and voxelize/foam, on this scene.foam and from its "
      "own photos' cameras\n"
      "  --simd NAME   use these vector instructions instead of the best that the machine has: "
      "AVX-512, AVX2, SSE4\n\n"
      "  --benchmark_filter=REGEX, such as walk/.*/100000, takes some of the cases, "
      "--benchmark_repetitions=N the median of N runs,\n  --benchmark_format=json and "
      "--benchmark_out=FILE give numbers to a program:\n\n");
  benchmark::PrintDefaultHelp();
}

// Takes `option` VALUE or `option`=VALUE out of the arguments; "" where there is none. What is left
// is Google Benchmark's.
std::string TakeOption(const std::string& option,
                       const std::string& wants,
                       int* argc,
                       char** argv) {
  std::string value;
  int kept = 1;
  for (int i = 1; i < *argc; ++i) {
    const std::string argument = argv[i];
    if (argument == option && i + 1 < *argc) {
      value = argv[++i];
    } else if (argument.starts_with(option + "=")) {
      value = argument.substr(option.size() + 1);
    } else {
      argv[kept++] = argv[i];
      continue;
    }
    if (value.empty()) throw UserError(option, " needs ", wants, ".");
  }
  *argc = kept;
  return value;
}

std::string Joined(const std::vector<std::string>& names) {
  std::string joined;
  for (const std::string& name : names) joined += (joined.empty() ? "" : ", ") + name;
  return joined;
}

int Main(int argc, char** argv) {
  const std::string foam_file =
      TakeOption("--foam", "the path of a model, scene.foam", &argc, argv);
  const std::vector<std::string> targets = SimdTargets();
  const std::string target = TakeOption("--simd", "one of " + Joined(targets), &argc, argv);
  for (int i = 1; i < argc; ++i) {
    help_wanted |= std::string(argv[i]) == "--help" || std::string(argv[i]) == "-h";
  }
  if (help_wanted) {
    PrintHelp();
    return EXIT_SUCCESS;
  }
  benchmark::Initialize(&argc, argv, PrintHelp);
  if (argc > 1) {
    throw UserError("`",
                    argv[1],
                    "` is not an option, or lacks its value; semfoam_benchmark --help lists them.");
  }
  if (!target.empty() && std::find(targets.begin(), targets.end(), target) == targets.end()) {
    throw UserError("--simd is ", target, "; this machine has ", Joined(targets), ".");
  }
  UseSimdTarget(target);
  benchmark::AddCustomContext("simd", target.empty() ? targets.front() : target);
  if (!foam_file.empty()) {
    // Made now, so that a bad file is spoken of before minutes of work; the cases come first, while
    // it is kept.
    TrainedScene(foam_file);
    RegisterRenderCases(std::filesystem::path(foam_file));
    RegisterVoxelizeCases(std::filesystem::path(foam_file));
  }
  for (const int64_t num_sites : kSizes) {
    // Triangulation first, while no scene is in memory.
    RegisterDelaunayCases(num_sites);
    RegisterWalkCases(num_sites);
    RegisterRenderCases(num_sites);
    RegisterUpdateCases(num_sites);
    RegisterVoxelizeCases(num_sites);
  }
  for (const int64_t num_sites : kTriangulatedSizes) RegisterDelaunayCases(num_sites);

  Report report;
  // It says so itself when no case has a name that --benchmark_filter matches.
  if (benchmark::RunSpecifiedBenchmarks(&report) == 0) return EXIT_FAILURE;
  report.PrintTable();
  return report.Failed() ? EXIT_FAILURE : EXIT_SUCCESS;
}

int Guarded(int argc, char** argv) {
  const auto fail = [](const std::string& sentence) {
    std::fprintf(stderr, "ERROR: %s\n", sentence.c_str());
    return EXIT_FAILURE;
  };
  try {
    return Main(argc, argv);
  } catch (const UserError& error) {
    return fail(error.what());
  } catch (const std::bad_alloc&) {
    return fail("the memory is used up; take fewer sites with --benchmark_filter.");
  } catch (const std::exception& error) {
    return fail(std::string("something unexpected went wrong (") + error.what() + ").");
  }
}

}  // namespace
}  // namespace semfoam

int main(int argc, char** argv) { return semfoam::Guarded(argc, argv); }
