// SPDX-License-Identifier: GPL-3.0-or-later
//
// Holds the includes of the whole source against the order of its folders, include_order.txt.
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "tests/temp_folder.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::IsEmpty;

constexpr char kOrderFile[] = "tests/include_order.txt";

struct Folder {
  std::string block;
  int place = 0;  // from the lowest of all
};

struct Order {
  std::map<std::string, Folder> folders;
  // By block: the blocks and folders below which its sources may include everything.
  std::map<std::string, std::vector<std::string>> permitted;
};

// Blocks begin with "block: permitted permitted", and their folders follow, one a line, indented.
Order ReadOrder(const fs::path& path) {
  Order order;
  std::ifstream file(path);
  EXPECT_TRUE(file.good()) << path;
  std::string block;
  for (std::string line; std::getline(file, line);) {
    line.erase(std::find(line.begin(), line.end(), '#'), line.end());
    std::istringstream words(line);
    std::string word;
    if (!(words >> word)) continue;
    if (word.ends_with(':')) {
      block = word.substr(0, word.size() - 1);
      std::vector<std::string>& permitted = order.permitted[block];
      while (words >> word) permitted.push_back(word);
    } else {
      EXPECT_NE(block, "") << word << " stands in no block";
      const int place = static_cast<int>(order.folders.size());
      EXPECT_TRUE(order.folders.insert({word, {block, place}}).second) << word << " stands twice";
    }
  }
  return order;
}

bool IsBelow(const std::string& folder, const std::string& top) {
  return folder == top || folder.starts_with(top + "/");
}

std::string FolderOf(const std::string& source) {
  return fs::path(source).parent_path().generic_string();
}

// What `line` includes with quotes.
std::optional<std::string> IncludeOf(const std::string& line) {
  std::istringstream rest(line);
  char hash = 0;
  std::string word;
  if (!(rest >> hash >> word) || hash != '#') return std::nullopt;
  if (const size_t quote = word.find('"'); quote != std::string::npos) {
    word.resize(quote);  // #include"a.h"
  }
  const size_t begin = line.find('"'), end = line.rfind('"');
  if (word != "include" || begin == end) return std::nullopt;
  return line.substr(begin + 1, end - begin - 1);
}

// Why a source in `from` must not include one in `to`; empty where it may.
std::string WhyNot(const Order& order, const std::string& from, const std::string& to) {
  if (from == to) return "";
  const Folder& own = order.folders.at(from);
  const auto other = order.folders.find(to);
  if (other != order.folders.end() && other->second.block == own.block) {
    if (other->second.place < own.place) return "";
    return to + " stands after " + from + " in " + kOrderFile;
  }
  const std::vector<std::string>& permitted = order.permitted.at(own.block);
  if (std::any_of(permitted.begin(), permitted.end(), [&](const std::string& top) {
        return IsBelow(to, top);
      })) {
    return "";
  }
  return own.block + " may not include from " + to + ", by " + kOrderFile;
}

// One sentence for each source of the blocks below `root` in a folder that the order does not name,
// each include that goes the wrong way, and each folder of the order without a source; sorted.
std::vector<std::string> Violations(const fs::path& root) {
  const Order order = ReadOrder(root / kOrderFile);
  std::vector<std::string> violations;
  std::map<std::string, int> num_sources;
  for (const auto& [block, permitted] : order.permitted) {
    for (const std::string& name : FilesBelow(root / block)) {
      const std::string source = block + "/" + name, folder = FolderOf(source);
      const std::string extension = fs::path(source).extension().string();
      if (extension != ".h" && extension != ".cc" && extension != ".cu") continue;
      ++num_sources[folder];
      if (!order.folders.contains(folder)) {
        violations.push_back(source + ": " + kOrderFile + " does not name its folder");
        continue;
      }
      std::ifstream file(root / source);
      int number = 0;
      for (std::string line; std::getline(file, line);) {
        ++number;
        const std::optional<std::string> include = IncludeOf(line);
        if (!include) continue;
        // As the compiler looks for it; what is found in neither place is another project's.
        std::string target = (fs::path(folder) / *include).lexically_normal().generic_string();
        if (!fs::exists(root / target)) target = *include;
        if (!fs::exists(root / target)) continue;
        const std::string why = WhyNot(order, folder, FolderOf(target));
        if (why.empty()) continue;
        violations.push_back(source + ":" + std::to_string(number) + ": includes \"" + *include +
                             "\", but " + why);
      }
    }
  }
  for (const auto& [folder, of_block] : order.folders) {
    if (num_sources[folder] == 0) {
      violations.push_back(folder + ": is named in " + kOrderFile + " and holds no source");
    }
  }
  std::sort(violations.begin(), violations.end());
  return violations;
}

void WriteText(const fs::path& path, const std::string& text) {
  fs::create_directories(path.parent_path());
  std::ofstream(path) << text;
}

TEST(IncludeOrder, FoldersIncludeFromLowerOnesAlone) {
  EXPECT_THAT(Violations(fs::path(SEMFOAM_TEST_SOURCE).parent_path()), IsEmpty());
}

TEST(IncludeOrder, WrongIncludesAndUnknownFoldersAreFound) {
  const TempFolder root;
  WriteText(root / kOrderFile,
            "# a comment\n"
            "low:\n"
            "  low/a\n"
            "  low/a/inner  # another\n"
            "  low/b\n"
            "middle: low\n"
            "  middle/a\n"
            "other: low\n"
            "  other/a\n"
            "high: low middle tests/cases\n"
            "  high\n"
            "  high/empty\n");
  WriteText(root / "low/a/a.h", "#pragma once\n#include <vector>\n#include \"low/a/more.h\"\n");
  WriteText(root / "low/a/more.h", "");
  WriteText(root / "low/a/inner/inner.h", "#include \"low/a/a.h\"\n");
  WriteText(root / "low/b/b.cc", "#include \"low/a/a.h\"\n#include \"low/a/inner/inner.h\"\n");
  WriteText(root / "low/b/b.h", "");
  WriteText(root / "middle/a/a.cu", "#include \"low/b/b.h\"\n");
  WriteText(root / "other/a/a.h", "");
  WriteText(root / "tests/cases/case.h", "#include \"high/high.h\"\n");
  WriteText(root / "high/high.h", "#include \"tests/cases/case.h\"\n#include \"gtest/gtest.h\"\n");
  const std::string empty = "high/empty: is named in tests/include_order.txt and holds no source";
  EXPECT_THAT(Violations(root.path()), ElementsAre(empty));

  WriteText(root / "low/a/wrong.cc",
            "#include \"low/a/a.h\"\n\n  #  include \"low/b/b.h\"  // x\n");
  WriteText(root / "low/a/inner/wrong.cc", "#include \"../../b/b.h\"\n");
  WriteText(root / "middle/a/wrong.h", "#include \"other/a/a.h\"\n");
  WriteText(root / "low/b/wrong.cu", "#include\"high/high.h\"\n#include \"tests/cases/case.h\"\n");
  WriteText(root / "low/new/new.h", "");
  WriteText(root / "low/notes.txt", "#include \"low/b/b.h\"\n");
  EXPECT_THAT(
      Violations(root.path()),
      ElementsAre(
          empty,
          "low/a/inner/wrong.cc:1: includes \"../../b/b.h\", but low/b stands after low/a/inner in "
          "tests/include_order.txt",
          "low/a/wrong.cc:3: includes \"low/b/b.h\", but low/b stands after low/a in "
          "tests/include_order.txt",
          "low/b/wrong.cu:1: includes \"high/high.h\", but low may not include from high, by "
          "tests/include_order.txt",
          "low/b/wrong.cu:2: includes \"tests/cases/case.h\", but low may not include from "
          "tests/cases, by tests/include_order.txt",
          "low/new/new.h: tests/include_order.txt does not name its folder",
          "middle/a/wrong.h:1: includes \"other/a/a.h\", but middle may not include from other/a, "
          "by tests/include_order.txt"));
}

}  // namespace
}  // namespace semfoam
