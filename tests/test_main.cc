// SPDX-License-Identifier: GPL-3.0-or-later
#include <cstdio>
#include <string>

#include <gtest/gtest.h>

// The main function of the test programs, one a folder:
//   foam_render_tests [FILE] [GoogleTest's options]
// FILE, for instance walk_test, runs all tests of walk_test.cc and no others; ctest names each test
// so. Without it all tests of the folder run, or those that --gtest_filter chooses.

namespace {

// The tests that stand in `file`.cc, as a filter for --gtest_filter; empty where there are none.
// GoogleTest knows the file of each test, so none can be left out.
std::string FilterOfFile(const std::string& file) {
  const std::string ending = "/" + file + ".cc";
  std::string filter;
  const testing::UnitTest& all = *testing::UnitTest::GetInstance();
  for (int i = 0; i < all.total_test_suite_count(); ++i) {
    const testing::TestSuite& suite = *all.GetTestSuite(i);
    for (int j = 0; j < suite.total_test_count(); ++j) {
      const testing::TestInfo& test = *suite.GetTestInfo(j);
      if (!std::string(test.file()).ends_with(ending)) continue;
      filter += suite.name();
      filter += ".";
      filter += test.name();
      filter += ":";
    }
  }
  return filter;
}

}  // namespace

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  if (argc > 2) {
    std::fprintf(stderr, "ERROR: %s: takes one file, for instance walk_test.\n", argv[0]);
    return 1;
  }
  if (argc == 2) {
    const std::string filter = FilterOfFile(argv[1]);
    if (filter.empty()) {
      std::fprintf(stderr, "ERROR: %s: holds no tests of %s.cc.\n", argv[0], argv[1]);
      return 1;
    }
    GTEST_FLAG_SET(filter, filter);
  }
  return RUN_ALL_TESTS();
}
