// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/commands/commands.h"

#include <sstream>

#include "tests/tools/program.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

// What the Debian packages hold, made of this build. tests/packages installs them.
namespace semfoam {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::EndsWith;
using testing::HasSubstr;
using testing::IsSupersetOf;
using testing::Not;
using testing::StartsWith;

class Packages : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TempFolder();
    const Outcome cpack = RunProgram("cpack",
                                     {"--config",
                                      SEMFOAM_BUILD "/CPackConfig.cmake",
                                      "-G",
                                      "DEB",
                                      "-B",
                                      folder_->path().string()});
    ASSERT_EQ(cpack.exit_code, 0) << cpack.out << cpack.err;
  }
  static void TearDownTestSuite() {
    delete folder_;
    folder_ = nullptr;
  }

  static std::string Path(const std::string& name) {
    for (const auto& entry : std::filesystem::directory_iterator(folder_->path())) {
      const std::string file = entry.path().filename().string();
      if (file.starts_with(name + "_") && file.ends_with(".deb")) return entry.path().string();
    }
    ADD_FAILURE() << "no package " << name;
    return "";
  }

  static std::string Field(const std::string& name, const std::string& field) {
    return RunProgram("dpkg-deb", {"--field", Path(name), field}).out;
  }

  // The files of a package by their paths, folders apart; expects that root owns all and others may
  // read them.
  static std::vector<std::string> Files(const std::string& name) {
    const Outcome listed = RunProgram("dpkg-deb", {"--contents", Path(name)});
    EXPECT_EQ(listed.exit_code, 0);
    std::vector<std::string> files;
    std::istringstream lines(listed.out);
    for (std::string line; std::getline(lines, line);) {
      std::istringstream words(line);
      std::string mode, owner, size, date, time, path;
      words >> mode >> owner >> size >> date >> time >> path;
      EXPECT_EQ(owner, "root/root") << line;
      EXPECT_THAT(mode, testing::AnyOf("drwxr-xr-x", "-rw-r--r--", "-rwxr-xr-x")) << line;
      if (mode[0] == '-') files.push_back(path.substr(1));
    }
    return files;
  }

  static TempFolder* folder_;
};

TempFolder* Packages::folder_ = nullptr;

TEST_F(Packages, TheProgramComesWithItsManualAndCompletion) {
  const std::vector<std::string> files = Files("semfoam");
  std::vector<std::string> expected = {"/usr/bin/semfoam",
                                       "/usr/share/bash-completion/completions/semfoam",
                                       "/usr/share/doc/semfoam/changelog.gz",
                                       "/usr/share/doc/semfoam/copyright",
                                       "/usr/share/man/man1/semfoam.1.gz",
                                       "/usr/share/semfoam/semantic_foam_blender.zip"};
  for (const CommandEntry& command : Commands()) {
    expected.push_back("/usr/share/man/man1/semfoam-" + std::string(command.name) + ".1.gz");
  }
  EXPECT_THAT(files, IsSupersetOf(expected));
  EXPECT_THAT(files, Contains(EndsWith("/_semfoam")));
  EXPECT_EQ(files.size(), expected.size() + 1);
  // By dpkg-shlibdeps.
  EXPECT_THAT(Field("semfoam", "Depends"),
              AllOf(HasSubstr("libc6 (>= "), HasSubstr("libopenvdb"), HasSubstr("libtbb12")));
}

TEST_F(Packages, TheLibrariesComeWithHeadersAndTheirCMakePackage) {
  const std::vector<std::string> files = Files("libsemfoam-dev");
  for (const char* end : {"/libsemfoam_foam.a",
                          "/libsemfoam_controllers.a",
                          "/cmake/SemanticFoam/SemanticFoamConfig.cmake",
                          "/include/SemanticFoam/foam/model/model.h"}) {
    EXPECT_THAT(files, Contains(EndsWith(end)));
  }
  EXPECT_THAT(files, Not(Contains(HasSubstr("/bin/"))));
  EXPECT_THAT(Field("libsemfoam-dev", "Depends"), HasSubstr("libeigen3-dev"));
}

TEST_F(Packages, ThePythonModuleComesWithItsStubs) {
  if (!SEMFOAM_HAS_PYTHON) GTEST_SKIP() << "built without the Python module";
  const std::vector<std::string> files = Files("python3-semfoam");
  const std::string folder = "/usr/lib/python3/dist-packages/semfoam/";
  EXPECT_THAT(files,
              IsSupersetOf({folder + "__init__.py",
                            folder + "__init__.pyi",
                            folder + "py.typed",
                            std::string("/usr/share/doc/python3-semfoam/changelog.gz"),
                            std::string("/usr/share/doc/python3-semfoam/copyright")}));
  EXPECT_THAT(files, Contains(StartsWith(folder + "_semfoam.cpython-")));
  EXPECT_EQ(files.size(), 6);
  EXPECT_THAT(Field("python3-semfoam", "Depends"),
              AllOf(HasSubstr("python3 (>= 3."),
                    HasSubstr("python3-numpy"),
                    HasSubstr("libopenvdb"),
                    HasSubstr("libtbb12")));
}

// As far as lintian is installed.
TEST_F(Packages, LintianFindsNoError) {
  std::vector<std::string> names = {"semfoam", "libsemfoam-dev"};
  if (SEMFOAM_HAS_PYTHON) names.emplace_back("python3-semfoam");
  for (const std::string& name : names) {
    if (RunProgram("sh", {"-c", "command -v lintian"}).exit_code != 0) return;
    const Outcome lintian =
        RunProgram("lintian", {"--allow-root", "--fail-on", "error", Path(name)});
    EXPECT_EQ(lintian.exit_code, 0) << lintian.out;
  }
}

}  // namespace
}  // namespace semfoam
