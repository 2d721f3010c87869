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
using testing::Contains;
using testing::HasSubstr;
using testing::IsSupersetOf;
using testing::Not;

TEST(Library, IsFoundByOtherProjectsAndMakesTheBytesOfTheProgram) {
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

  // All that a public header includes is there, and nothing that only the libraries need.
  const std::string include = prefix + "/include/SemanticFoam";
  const std::vector<std::string> headers = FilesBelow(include);
  EXPECT_THAT(headers, IsSupersetOf({"foam/model/model.h", "tools/controllers/scene_segmenter.h"}));
  EXPECT_THAT(headers, Not(Contains(HasSubstr("simd"))));
  EXPECT_THAT(headers, Not(Contains(HasSubstr("_internal"))));
  std::string all;
  for (const std::string& header : headers) all += "#include \"" + header + "\"\n";
  WriteFile(folder / "all.cc", all);
  run("c++",
      {"-std=c++20",
       "-fsyntax-only",
       "-I" + include,
       "-isystem",
       "/usr/include/eigen3",
       (folder / "all.cc").string()});

  // The same bytes as the command's, in every file but those that tell how long it took and those
  // that the program alone draws.
  const std::string program = build + "/segment_scene";
  run(program, {kTabletop.string(), (folder / "library").string()});
  ASSERT_EQ(RunSemfoam({"automatic_segmenter",
                        "--workspace_path",
                        kTabletop.string(),
                        "--output_path",
                        (folder / "command").string(),
                        "--quality",
                        "low",
                        "--test_every",
                        "8",
                        "--FoamTraining.num_rays",
                        "300000"})
                .exit_code,
            0);
  std::vector<std::string> of_command = FilesBelow(folder / "command");
  std::erase_if(of_command, [](const std::string& file) {
    return file.starts_with("training_plot.") || file == "report.html";
  });
  EXPECT_EQ(FilesBelow(folder / "library"), of_command);
  EXPECT_THAT(of_command, IsSupersetOf({"scene.foam", "scene.vdb", "objects/5_table.glb"}));
  for (const std::string& file : of_command) {
    if (file == "training_log.csv") continue;
    EXPECT_TRUE(ReadFile(folder / "library" / file) == ReadFile(folder / "command" / file)) << file;
  }
  const Outcome wrong = RunProgram(program, {(folder / "spoon").string(), "out"});
  EXPECT_EQ(wrong.exit_code, 1);
  EXPECT_THAT(wrong.err, HasSubstr("spoon: there is no such folder"));
}

}  // namespace
}  // namespace semfoam
