// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/tools/program.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

// The site of the documents: tools/site checks each link and anchor of what it has made, so a site
// that is made has none that leads nowhere.
namespace semfoam {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;
using testing::IsSupersetOf;
using testing::Not;

constexpr char kSite[] = SEMFOAM_TEST_SOURCE "/../tools/site";

TEST(Site, ShowsAllDocumentsAndEveryLinkLeadsSomewhere) {
  const TempFolder folder;
  const fs::path site = folder / "a site";
  const Outcome outcome = RunProgram(kSite, {site.string(), "--manual", SEMFOAM_MANUAL "/man1"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("all of which lead somewhere"));
  EXPECT_THAT(FilesBelow(site),
              IsSupersetOf({"index.html",
                            "CHANGELOG.html",
                            "foam/NOTES.html",
                            "tools/index.html",
                            "gallery.html",
                            "manual/semfoam.html",
                            "manual/semfoam-foam_trainer.html",
                            "api/annotated.html",
                            "tests/data/readme.png",
                            "tools/examples/segment_scene.cc.txt"}));
  EXPECT_THAT(ReadFile(site / "index.html"),
              AllOf(HasSubstr("<h2 id=\"what-accuracy-costs\">"),
                    HasSubstr("href=\"tools/index.html#foam_converter\""),
                    Not(HasSubstr("README.md\""))));
  EXPECT_THAT(ReadFile(site / "manual/semfoam-foam_trainer.html"),
              HasSubstr("--FoamTraining.num_rays"));
  EXPECT_THAT(ReadFile(site / "api/structsemfoam_1_1TrainingRun.html"),
              HasSubstr("Maximum number of photos that are swept"));
}

TEST(Site, NamesLinksThatLeadNowhere) {
  const TempFolder folder;
  WriteFile(folder / "a.html",
            "<h1 id='top'>A</h1><a href='b.html#there'>1</a><a href='b.html#gone'>2</a>"
            "<a href='c.html'>3</a><img src='d%20e.png'><a href='#top'>4</a>"
            "<a href='https://example.org/x'>5</a>");
  WriteFile(folder / "b.html", "<p id='there'>B</p>");
  const Outcome outcome = RunProgram(kSite, {"--check", folder.path().string()});
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_THAT(outcome.Errors(),
              testing::UnorderedElementsAre("ERROR: a.html: b.html#gone has no such anchor.",
                                            "ERROR: a.html: c.html is not there.",
                                            "ERROR: a.html: d%20e.png is not there."));
  WriteFile(folder / "c.html", "C");
  WriteFile(folder / "d e.png", "D");
  WriteFile(folder / "b.html", "<p id='there'>B</p><p id='gone'>B</p>");
  EXPECT_EQ(RunProgram(kSite, {"--check", folder.path().string()}).exit_code, 0);
}

TEST(Site, TakesNoFolderOfOtherFiles) {
  const TempFolder folder;
  WriteFile(folder / "mine.txt", "keep me");
  const Outcome outcome = RunProgram(kSite, {folder.path().string()});
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_THAT(outcome.Errors(),
              testing::ElementsAre(HasSubstr("holds other files than a site of tools/site")));
  EXPECT_EQ(ReadFile(folder / "mine.txt"), "keep me");
  EXPECT_EQ(RunProgram(kSite, {}).exit_code, 1);
}

}  // namespace
}  // namespace semfoam
