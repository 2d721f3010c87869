// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/io/ply_file.h"
#include "foam/model/model.h"

#include <algorithm>

#include "tests/export/test_foams.h"
#include "tests/tools/program.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::SizeIs;

Outcome Convert(const fs::path& input, const fs::path& output, std::vector<std::string> more = {}) {
  std::vector<std::string> arguments = {
      "foam_converter", "--input_path", input.string(), "--output_path", output.string()};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return RunSemfoam(arguments);
}

// A COLMAP model becomes a foam, the foam each other format, and Radiant Foam's a foam again.
TEST(FoamConverter, GoesThroughEveryFormat) {
  const TempFolder folder;
  const fs::path foam = folder / "seeds.foam";
  ASSERT_EQ(Convert(kTabletop / "sparse/0", foam).exit_code, 0);
  const size_t num_sites = ReadModel(foam).foam.NumSites();
  EXPECT_GT(num_sites, 5000);

  for (const std::string type : {"radiant_foam", "splats", "points"}) {
    const Outcome outcome = Convert(foam, folder / (type + ".ply"), {"--output_type", type});
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_EQ(PlyFile(folder / (type + ".ply")).HasElement("adjacency"), type == "radiant_foam");
  }
  EXPECT_EQ(PlyFile(folder / "radiant_foam.ply").Count("vertex"), num_sites);
  const uint64_t num_points = PlyFile(folder / "points.ply").Count("vertex");
  EXPECT_GT(num_points, 0);
  EXPECT_EQ(PlyFile(folder / "splats.ply").Count("vertex"), num_points);
  ASSERT_EQ(Convert(foam, folder / "foam.txt").exit_code, 0);
  EXPECT_THAT(ReadFile(folder / "foam.txt"), HasSubstr(std::to_string(num_sites) + " sites"));

  ASSERT_EQ(Convert(folder / "radiant_foam.ply", folder / "back.foam").exit_code, 0);
  EXPECT_EQ(ReadModel(folder / "back.foam").foam.NumSites(), num_sites);

  // Same input, same bytes.
  ASSERT_EQ(Convert(kTabletop / "sparse/0", folder / "again.foam").exit_code, 0);
  EXPECT_EQ(ReadFile(folder / "again.foam"), ReadFile(foam));
  ASSERT_EQ(Convert(foam, folder / "again.ply", {"--output_type", "splats"}).exit_code, 0);
  EXPECT_EQ(ReadFile(folder / "again.ply"), ReadFile(folder / "splats.ply"));
}

// The points of an object are the same, whether it is asked for or looked up among all.
TEST(FoamConverter, PointsSayWhichObjectTheyAreOf) {
  const TempFolder folder;
  const fs::path foam = folder / "a.foam";
  WriteModel(foam, TouchingBalls(1500));
  for (const std::string type : {"points", "splats"}) {
    const auto objects = [&](const std::vector<std::string>& options) {
      std::vector<std::string> arguments = {"--output_type", type};
      arguments.insert(arguments.end(), options.begin(), options.end());
      EXPECT_EQ(Convert(foam, folder / "p.ply", arguments).exit_code, 0);
      return PlyFile(folder / "p.ply").Values("vertex", "object");
    };
    const std::vector<double> all = objects({});
    const std::vector<double> mug = objects({"--labels", "mug"});
    const std::vector<double> others = objects({"--exclude_labels", "mug"});
    EXPECT_GT(mug.size(), 10u);
    EXPECT_THAT(mug, testing::Each(7));
    EXPECT_THAT(others, testing::Not(testing::Contains(7)));
    EXPECT_EQ(std::count(all.begin(), all.end(), 7), std::ssize(mug));
    EXPECT_EQ(all.size(), mug.size() + others.size());
  }
}

TEST(FoamConverter, SaysWhatIsWrong) {
  const TempFolder folder;
  const fs::path foam = folder / "seeds.foam";
  ASSERT_EQ(Convert(kTabletop / "sparse/0", foam).exit_code, 0);
  WriteFile(folder / "cut.ply", "ply\nformat binary_little_endian 1.0\nelement vertex 9\n");
  const struct {
    fs::path input;
    std::string output;
    std::vector<std::string> more;
    const char* sentence;
  } cases[] = {
      {foam, "x.ply", {}, "does not say what to write"},
      {foam, "x.ply", {"--output_type", "gif"}, "gif"},
      {foam, "x.ply", {"--output_type", "splats", "--splat_scale", "0"}, "0.1 to 10"},
      {foam,
       "x.ply",
       {"--output_type", "points", "--labels", "spoon"},
       "'spoon', which is no object"},
      {foam, "x.foam", {"--labels", "mug"}, "--labels chooses splats and points"},
      {foam, "x.foam", {"--exclude_labels", "mug"}, "--exclude_labels chooses splats and points"},
      {folder / "none.foam", "x.foam", {}, "none.foam"},
      {folder / "cut.ply", "x.foam", {}, "cut.ply: is no whole PLY file"},
      {kTabletop / "images", "x.foam", {}, "images"},
  };
  for (const auto& [input, output, more, sentence] : cases) {
    const Outcome outcome = Convert(input, folder / output, more);
    EXPECT_EQ(outcome.exit_code, 1) << sentence;
    ASSERT_THAT(outcome.Errors(), SizeIs(1)) << outcome.err;
    EXPECT_THAT(outcome.Errors().front(), HasSubstr(sentence));
    EXPECT_FALSE(fs::exists(folder / output)) << sentence;
  }
}

}  // namespace
}  // namespace semfoam
