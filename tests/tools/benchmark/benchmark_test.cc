// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/model/model.h"
#include "foam/util/random.h"

#include <cmath>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "tests/tools/program.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

using ::testing::ContainsRegex;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::SizeIs;
using ::testing::UnorderedElementsAreArray;

Outcome RunBenchmark(const std::vector<std::string>& arguments) {
  return RunProgram(SEMFOAM_BENCHMARK, arguments);
}

// The subjects and the counters that each must give.
const std::map<std::string, std::set<std::string>> kSubjects = {
    {"delaunay", {"sites_per_second", "bytes_per_site"}},
    {"walk/scalar", {"steps_per_second", "rays_per_second", "bytes_per_site"}},
    {"walk/simd", {"steps_per_second", "rays_per_second", "bytes_per_site"}},
    {"walk/interleaved", {"steps_per_second", "rays_per_second", "bytes_per_site"}},
    {"render/forward", {"steps_per_second", "rays_per_second", "bytes_per_site"}},
    {"render/backward", {"steps_per_second", "rays_per_second", "bytes_per_site"}},
    {"render/backward_plain", {"steps_per_second", "rays_per_second", "bytes_per_site"}},
    {"update", {"sites_per_second", "rays_per_second", "bytes_per_site"}},
    {"voxelize", {"voxels_per_second", "voxels", "bytes_per_site"}},
};

// The case's name for 1 thread, and for 2.
std::vector<std::string> Names(const std::string& subject, const std::string& size) {
  const std::string name = subject + "/" + size;
  return {name, name + "/threads:2"};
}

// Runs cases for as short a time as there is, and checks that these and no others ran, and that
// each gave its counters.
Outcome ExpectCases(const std::vector<std::string>& subjects,
                    const std::string& size,
                    std::vector<std::string> arguments) {
  arguments.insert(arguments.end(), {"--benchmark_min_time=0.01", "--benchmark_format=json"});
  const Outcome outcome = RunBenchmark(arguments);
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  const auto json = nlohmann::json::parse(outcome.out, nullptr, /*allow_exceptions=*/false);
  EXPECT_FALSE(json.is_discarded()) << outcome.out;
  if (json.is_discarded()) return outcome;
  std::vector<std::string> expected, names;
  for (const std::string& subject : subjects) {
    for (const std::string& name : Names(subject, size)) expected.push_back(name);
  }
  std::vector<double> steps_per_ray;  // of all walks on 1 thread: they must take the same steps
  for (const auto& run : json.at("benchmarks")) {
    const std::string name = run.at("name");
    names.push_back(name);
    EXPECT_FALSE(run.contains("error_occurred")) << name;
    if (name.starts_with("walk/") && !name.ends_with("/threads:2")) {
      steps_per_ray.push_back(run.value("steps_per_second", 0.0) /
                              run.value("rays_per_second", 0.0));
      EXPECT_NEAR(steps_per_ray.back(), steps_per_ray.front(), 1e-9) << name;
    }
    for (const auto& [subject, counters] : kSubjects) {
      if (!name.starts_with(subject)) continue;
      for (const std::string& counter : counters) {
        const double value = run.value(counter, 0.0);
        EXPECT_TRUE(std::isfinite(value) && value > 0) << name << " " << counter << " " << value;
      }
    }
  }
  EXPECT_THAT(names, UnorderedElementsAreArray(expected));
  for (const std::string& subject : subjects) {
    // A row with both rates and their ratio, on stderr: stdout is JSON.
    EXPECT_THAT(outcome.err, ContainsRegex("\n" + subject + " +" + size + " [^-]*[0-9.]+x"));
  }
  EXPECT_THAT(outcome.err, ContainsRegex("stream copy .*: [0-9.]+ GB/s on 1 thread"));
  return outcome;
}

TEST(Benchmark, EveryCaseOfTenThousandSitesRuns) {
  std::vector<std::string> subjects;
  for (const auto& [subject, counters] : kSubjects) subjects.push_back(subject);
  ExpectCases(subjects, "10000", {"--benchmark_filter=/10000(/|$)"});
}

TEST(Benchmark, KnowsThreeSizesAndTriangulatesThePapers) {
  const Outcome outcome = RunBenchmark({"--benchmark_list_tests"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  std::vector<std::string> expected, names;
  for (const auto& [subject, counters] : kSubjects) {
    for (const char* size : {"10000", "100000", "1000000"}) {
      for (const std::string& name : Names(subject, size)) expected.push_back(name);
    }
  }
  for (const char* size : {"2000000", "4000000"}) {
    for (const std::string& name : Names("delaunay", size)) expected.push_back(name);
  }
  std::istringstream lines(outcome.out);
  for (std::string line; std::getline(lines, line);) names.push_back(line);
  EXPECT_THAT(names, UnorderedElementsAreArray(expected));
}

// A foam of random cells, seen by one photo, and another one that is held out.
Model SmallModel() {
  Model model;
  Foam& foam = model.foam;
  CounterRandom random(/*seed=*/0, /*purpose=*/0, /*index=*/0);
  for (int i = 0; i < 300; ++i) {
    const double x = random.Uniform(), y = random.Uniform(), z = random.Uniform();
    foam.positions.push_back(Eigen::Vector3d(x, y, z).cast<float>());
    foam.raw_density.push_back(0.1f);
  }
  foam.sh.assign(3 * foam.NumSites(), 0.1f);
  model.statistics.contribution.assign(foam.NumSites(), 1.f);
  model.statistics.mean_color.assign(foam.NumSites(), Eigen::Vector3f::Ones());
  for (const bool held_out : {false, true}) {
    PhotoRecord photo;
    photo.name = held_out ? "b.jpg" : "a.jpg";
    photo.camera_model = "PINHOLE";
    photo.width = 64;
    photo.height = 48;
    photo.camera_params = {60, 60, 32, 24};
    photo.cam_from_world_translation = Eigen::Vector3d(-0.5, -0.5, 2);
    photo.held_out = held_out;
    model.photos.push_back(photo);
  }
  return model;
}

TEST(Benchmark, CastsTheRaysOfATrainedFoam) {
  const TempFolder folder;
  const std::string path = (folder / "scene.foam").string();
  WriteModel(path, SmallModel());
  for (const std::vector<std::string>& spelling :
       {std::vector<std::string>{"--foam", path}, {"--foam=" + path}}) {
    std::vector<std::string> arguments = {"--benchmark_filter=/foam"};
    arguments.insert(arguments.end(), spelling.begin(), spelling.end());
    ExpectCases({"render/forward", "render/backward", "render/backward_plain", "voxelize"},
                "foam",
                arguments);
  }
}

TEST(Benchmark, SaysWhatIsWrongInOneSentence) {
  const TempFolder folder;
  const std::string no_photo = (folder / "no photo.foam").string();
  Model model = SmallModel();
  model.photos.erase(model.photos.begin());
  WriteModel(no_photo, model);
  const struct {
    std::vector<std::string> arguments;
    const char* says;
  } kBad[] = {
      {{"--fast"}, "--fast"},
      {{"walk"}, "walk"},
      {{"--foam"}, "--foam"},
      {{"--foam="}, "--foam"},
      {{"--simd"}, "--simd"},
      {{"--simd", "MMX"}, "MMX"},
      {{"--benchmark_format=xml"}, "--benchmark_format"},
      {{"--foam", "no such file"}, "no such file"},
      {{"--foam", no_photo}, "no photo.foam"},
  };
  for (const auto& [arguments, says] : kBad) {
    const Outcome outcome = RunBenchmark(arguments);
    EXPECT_EQ(outcome.exit_code, 1) << says;
    EXPECT_THAT(outcome.Errors(), SizeIs(1)) << outcome.err;
    EXPECT_THAT(outcome.err, HasSubstr(says));
    EXPECT_EQ(outcome.out, "") << says;
  }
}

TEST(Benchmark, FailsWhereTheFilterLeavesNothing) {
  const Outcome outcome = RunBenchmark({"--benchmark_filter=nothing"});
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_THAT(outcome.err, HasSubstr("nothing"));
  EXPECT_THAT(outcome.err, Not(HasSubstr("stream copy")));
}

TEST(Benchmark, Helps) {
  for (const char* option : {"-h", "--help"}) {
    const Outcome outcome = RunBenchmark({option});
    EXPECT_EQ(outcome.exit_code, 0);
    EXPECT_THAT(outcome.out, HasSubstr("--foam FILE"));
    EXPECT_THAT(outcome.out, HasSubstr("--benchmark_filter"));
  }
}

}  // namespace
}  // namespace semfoam
