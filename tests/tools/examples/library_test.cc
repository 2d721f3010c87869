// SPDX-License-Identifier: GPL-3.0-or-later
//
// The libraries as another project meets them: installed below a prefix, found by find_package, and
// enough to train and to export with.
#include "tests/tools/program.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::IsSupersetOf;

TEST(Library, IsFoundByOtherProjectsAndTrainsAndExports) {
  const TempFolder folder;
  const std::string prefix = (folder / "prefix").string();
  const std::string build = (folder / "build").string();
  const auto run = [](const std::string& program, const std::vector<std::string>& arguments) {
    const Outcome outcome = RunProgram(program, arguments);
    EXPECT_EQ(outcome.exit_code, 0) << program << "\n" << outcome.out << outcome.err;
    return outcome;
  };
  run("cmake", {"--install", SEMFOAM_BUILD, "--prefix", prefix});
  EXPECT_THAT(run(prefix + "/bin/semfoam", {"version"}).out, HasSubstr("semfoam "));
  // Nothing of the build or the source is needed: only what was installed.
  run("cmake",
      {"-S",
       SEMFOAM_TEST_SOURCE "/../tools/examples",
       "-B",
       build,
       "-G",
       "Ninja",
       "-DCMAKE_PREFIX_PATH=" + prefix,
       "-DCMAKE_BUILD_TYPE=Release",
       "-DCMAKE_CXX_FLAGS=" SEMFOAM_EXAMPLE_FLAGS});
  for (const std::string& file : FilesBelow(prefix)) {
    if (fs::path(file).extension() != ".cmake") continue;
    const std::string text = ReadFile(fs::path(prefix) / file);
    EXPECT_EQ(text.find(SEMFOAM_BUILD), std::string::npos) << file;
    EXPECT_EQ(text.find(fs::path(SEMFOAM_TEST_SOURCE).parent_path().string() + "/"),
              std::string::npos)
        << file;
  }
  run("cmake", {"--build", build});

  const std::string output = (folder / "out").string();
  fs::create_directories(output);
  const std::string program = build + "/object_from_photos";
  EXPECT_THAT(run(program, {kTabletop.string(), output, "table"}).out, HasSubstr("_table.ply: "));
  EXPECT_THAT(FilesBelow(output),
              IsSupersetOf({"scene.foam",
                            "scene.vdb",
                            "objects/5_table.vdb",
                            "objects/5_table.om",
                            "objects/5_table.glb"}));
  const Outcome wrong = RunProgram(program, {kTabletop.string(), output, "spoon"});
  EXPECT_EQ(wrong.exit_code, 1);
  EXPECT_THAT(wrong.err, HasSubstr("ERROR: The labels name 'spoon'"));
}

}  // namespace
}  // namespace semfoam
