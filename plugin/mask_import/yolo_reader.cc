// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask_import/yolo_reader.h"

#include "foam/util/error.h"
#include "foam/util/input_file.h"
#include "plugin/util/files.h"

#include <charconv>
#include <memory>
#include <optional>
#include <string_view>
#include <utility>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

constexpr int kMostClasses = 65535;
constexpr size_t kNumbersOfBox = 4;
constexpr size_t kLeastNumbers = 6;  // three points
// Beginning of the name of a class that has none.
const std::string kUnnamed = "class_";
// Coordinates of segments that were cut off at the photo's border may be a little outside.
constexpr double kMargin = 0.01;

std::string_view Trimmed(std::string_view text) {
  constexpr std::string_view kBlanks = " \t\r\n";
  const size_t begin = text.find_first_not_of(kBlanks);
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(kBlanks) - begin + 1);
}

std::vector<std::string_view> LinesOf(std::string_view text) {
  std::vector<std::string_view> lines;
  while (!text.empty()) {
    const size_t end = text.find('\n');
    lines.push_back(text.substr(0, end));
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
  }
  return lines;
}

std::vector<std::string_view> WordsOf(std::string_view line) {
  std::vector<std::string_view> words;
  for (line = Trimmed(line); !line.empty(); line = Trimmed(line)) {
    const size_t end = line.find_first_of(" \t");
    words.push_back(line.substr(0, end));
    line.remove_prefix(words.back().size());
  }
  return words;
}

template <typename T>
std::optional<T> NumberOf(std::string_view text) {
  T value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

std::string_view Unquoted(std::string_view text) {
  text = Trimmed(text);
  if (text.size() >= 2 && (text[0] == '"' || text[0] == '\'') && text.back() == text[0]) {
    return text.substr(1, text.size() - 2);
  }
  return text;
}

std::map<int, std::string> ReadClassList(const fs::path& file) {
  const std::string text = ReadFileBytes(file, "a list of classes");
  std::map<int, std::string> names;
  for (const std::string_view line : LinesOf(WithoutByteOrderMark(text))) {
    const std::string_view name = Trimmed(line);
    if (!name.empty()) names.emplace(static_cast<int>(names.size()), name);
  }
  return names;
}

// The names beside the labels, or up to two folders above; none where there is no such file.
std::map<int, std::string> FindNames(const fs::path& folder) {
  fs::path at = fs::absolute(folder).lexically_normal();
  for (int i = 0; i < 3; ++i) {
    for (const char* name : {"data.yaml", "dataset.yaml"}) {
      if (fs::is_regular_file(at / name)) return ReadYoloNames(at / name);
    }
    for (const char* name : {"classes.txt", "obj.names"}) {
      if (fs::is_regular_file(at / name)) return ReadClassList(at / name);
    }
    at = ParentFolder(at);
  }
  return {};
}

std::string NameOf(int k, const std::map<int, std::string>& names) {
  const auto found = names.find(k);
  return found == names.end() ? kUnnamed + std::to_string(k) : found->second;
}

std::optional<PictureContents> ReadLabels(const fs::path& file,
                                          const std::map<int, std::string>& names) {
  const std::string text = ReadFileBytes(file, "YOLO's labels");
  PictureContents contents;
  contents.name = file.stem().string();
  const auto polygons = std::make_shared<std::vector<Polygon>>();
  const std::vector<std::string_view> lines = LinesOf(WithoutByteOrderMark(text));
  for (size_t i = 0; i < lines.size(); ++i) {
    const std::vector<std::string_view> words = WordsOf(lines[i]);
    if (words.empty()) continue;
    const auto fail = [&](const auto&... what) {
      throw UserError(file.string(), ": line ", i + 1, " ", what..., ".");
    };
    const std::optional<int> k = NumberOf<int>(words[0]);
    if (!k && polygons->empty() && contents.left_out.empty()) return std::nullopt;
    if (!k || *k < 0 || *k > kMostClasses) {
      fail("begins with ",
           Shortened(words[0]),
           ", where the number of a class from 0 to ",
           kMostClasses,
           " would be right");
    }
    Polygon polygon;
    std::vector<double> numbers;
    for (size_t w = 1; w < words.size(); ++w) {
      const std::optional<double> number = NumberOf<double>(words[w]);
      if (!number || !(*number >= -kMargin && *number <= 1 + kMargin)) {
        fail(
            "has ", Shortened(words[w]), ", where a share of the photo from 0 to 1 would be right");
      }
      numbers.push_back(*number);
    }
    if (numbers.size() == kNumbersOfBox) {
      ++contents.left_out["box"];
      continue;
    }
    if (numbers.size() < kLeastNumbers || numbers.size() % 2 != 0) {
      fail("has ",
           numbers.size(),
           " numbers after the class, where x and y of three points or more would be right");
    }
    for (size_t n = 0; n < numbers.size(); n += 2) polygon.push_back({numbers[n], numbers[n + 1]});
    contents.regions.push_back({NameOf(*k, names), -1});
    polygons->push_back(std::move(polygon));
  }
  contents.draw = [polygons](const PhotoSize& size) {
    std::vector<PixelRuns> runs;
    for (Polygon polygon : *polygons) {
      for (PolygonPoint& point : polygon) {
        point.x *= size.width;
        point.y *= size.height;
      }
      runs.push_back(FillPolygons({polygon}, size));
    }
    return runs;
  };
  return contents;
}

}  // namespace

std::map<int, std::string> ReadYoloNames(const fs::path& file) {
  const std::string text = ReadFileBytes(file, "YOLO's data.yaml");
  const std::vector<std::string_view> lines = LinesOf(WithoutByteOrderMark(text));
  std::map<int, std::string> names;
  const auto add = [&](std::string_view entry) {
    std::optional<int> k = static_cast<int>(names.size());
    const size_t colon = entry.find(':');
    if (colon != std::string_view::npos) {
      k = NumberOf<int>(Trimmed(entry.substr(0, colon)));
      entry.remove_prefix(colon + 1);
    }
    const std::string_view name = Unquoted(entry);
    if (!k || *k < 0 || *k > kMostClasses || name.empty() || !names.emplace(*k, name).second) {
      throw UserError(
          file.string(),
          ": its names are not a list as [mug, ball], nor a table as {0: mug, 1: ball}, "
          "which would be right.");
    }
  };
  for (size_t i = 0; i < lines.size(); ++i) {
    if (!lines[i].starts_with("names:")) continue;
    std::string_view list = Trimmed(lines[i].substr(6));
    if (!list.empty()) {
      if (list.size() < 2 || (list[0] != '[' && list[0] != '{')) add("?:");
      list = Trimmed(list.substr(1, list.size() - 2));
      while (!list.empty()) {
        const size_t comma = list.find(',');
        add(list.substr(0, comma));
        list.remove_prefix(comma == std::string_view::npos ? list.size() : comma + 1);
      }
    }
    for (++i; list.empty() && i < lines.size(); ++i) {
      std::string_view line = Trimmed(lines[i]);
      if (line.empty() || line[0] == '#') continue;
      if (line[0] != '-' && lines[i][0] != ' ' && lines[i][0] != '\t') break;
      if (line[0] == '-') line.remove_prefix(1);
      add(line);
    }
    break;
  }
  return names;
}

bool IsYolo(const fs::path& file) {
  const std::string text = ReadFileBytes(file, "a text");
  for (const std::string_view line : LinesOf(WithoutByteOrderMark(text))) {
    const std::vector<std::string_view> words = WordsOf(line);
    if (words.empty()) continue;
    if (words.size() <= kNumbersOfBox || !NumberOf<int>(words[0])) return false;
    for (size_t i = 1; i <= kNumbersOfBox; ++i) {
      if (!NumberOf<double>(words[i])) return false;
    }
    return true;
  }
  return false;
}

ImportedMasks ReadYolo(const fs::path& folder, const std::vector<fs::path>& files) {
  const std::map<int, std::string> names = FindNames(folder);
  ImportedMasks masks = ReadPictures(
      "YOLO segments", files, [names](const fs::path& file) { return ReadLabels(file, names); });
  // Class 0 becomes label 1, as id 0 of a mask is no object.
  std::map<std::string, int> class_of_name;
  for (const auto& [k, name] : names) class_of_name.emplace(name, k);
  for (const std::string& name : masks.names) {
    const auto found = class_of_name.find(name);
    const int k = found != class_of_name.end()
                      ? found->second
                      : NumberOf<int>(std::string_view(name).substr(kUnnamed.size())).value();
    masks.name_ids.push_back(int64_t{k} + 1);
  }
  return masks;
}

}  // namespace semfoam
