// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask_import/npy_reader.h"

#include "foam/util/error.h"
#include "foam/util/input_file.h"
#include "foam/util/json_file.h"
#include "plugin/mask_import/json_field.h"
#include "plugin/mask_import/npy_file.h"
#include "plugin/util/files.h"

#include <charconv>
#include <limits>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

constexpr int64_t kLargestId = std::numeric_limits<uint32_t>::max();

// The JSON that belongs to an array; empty where there is none.
fs::path FindNames(const fs::path& file) {
  const std::string name = file.stem().string() + ".json";
  for (const fs::path& folder :
       {file.parent_path(), ParentFolder(fs::absolute(file.parent_path())) / "json_data"}) {
    if (fs::is_regular_file(folder / name)) return folder / name;
  }
  return {};
}

std::map<int64_t, std::string> ReadNames(const fs::path& file) {
  const nlohmann::json json = ReadJsonFile(file);
  const JsonField labels = JsonField(file, json)["labels"];
  if (!labels.IsObject()) labels.Fail("an object, {\"1\": {\"class_name\": \"mug\"}},");
  std::map<int64_t, std::string> names;
  for (const auto& [key, value] : labels.value().items()) {
    int64_t id = -1;
    const auto [end, error] = std::from_chars(key.data(), key.data() + key.size(), id);
    if (error != std::errc() || end != key.data() + key.size() || id < 0) {
      labels.FailBecause("has the key \"" + Shortened(key) + "\", where an id would be right");
    }
    names.emplace(id, labels[key.c_str()]["class_name"].Text());
  }
  return names;
}

// The value of a pixel of a layer.
int64_t ValueAt(const NpyArray& array, int64_t layer, int64_t y, int64_t x) {
  const size_t first = array.shape.size() - 2;
  const int64_t layers = first == 0 ? 1 : array.shape[0];
  const int64_t height = array.shape[first], width = array.shape[first + 1];
  return array.fortran_order ? array[layer + layers * (y + height * x)]
                             : array[(layer * height + y) * width + x];
}

// Runs of a layer by value. A bool has the value 1.
std::map<uint32_t, PixelRuns> RunsOf(const fs::path& file, const NpyArray& array, int64_t layer) {
  const size_t first = array.shape.size() - 2;
  const auto height = static_cast<int>(array.shape[first]);
  std::vector<uint32_t> row(static_cast<size_t>(array.shape[first + 1]));
  return RunsByValue([&](const RowReceiver& on_row) {
    for (int y = 0; y < height; ++y) {
      for (size_t x = 0; x < row.size(); ++x) {
        const int64_t value = ValueAt(array, layer, y, static_cast<int64_t>(x));
        if (value < 0 || value > kLargestId) {
          throw UserError(file.string(),
                          ": holds the id ",
                          value,
                          ", where ids from 0 to ",
                          kLargestId,
                          " would be right.");
        }
        row[x] = array.kind == 'b' ? (value != 0 ? 1 : 0) : static_cast<uint32_t>(value);
      }
      on_row(y, row);
    }
  });
}

std::string ShapeText(const std::vector<int64_t>& shape) {
  std::string text;
  for (const int64_t side : shape) text += (text.empty() ? "" : " x ") + std::to_string(side);
  return text.empty() ? "a single number" : text;
}

}  // namespace

std::optional<PictureContents> ReadNpyMask(const fs::path& file) {
  const NpyArray array = ReadNpyFile(file);
  const std::vector<int64_t>& shape = array.shape;
  const bool is_stack = shape.size() == 3 && array.kind == 'b' && shape[0] > 1;
  const bool has_shape = shape.size() == 2 || (shape.size() == 3 && (shape[0] == 1 || is_stack));
  if (!has_shape || shape.back() < 1 || shape[shape.size() - 2] < 1 ||
      shape.back() > kLargestSide || shape[shape.size() - 2] > kLargestSide) {
    throw UserError(file.string(),
                    ": its array is of ",
                    ShapeText(shape),
                    ", where height x width of a mask would be right.");
  }
  PictureContents contents;
  contents.name = file.stem().string();
  contents.size = {static_cast<int>(shape.back()), static_cast<int>(shape[shape.size() - 2])};
  const auto runs = std::make_shared<std::vector<PixelRuns>>();
  if (is_stack) {
    for (int64_t layer = 0; layer < shape[0]; ++layer) {
      contents.regions.emplace_back();
      runs->push_back(std::move(RunsOf(file, array, layer)[1]));
    }
  } else {
    const fs::path names_file = FindNames(file);
    const std::map<int64_t, std::string> names =
        names_file.empty() ? std::map<int64_t, std::string>() : ReadNames(names_file);
    for (auto& [id, of_id] : RunsOf(file, array, 0)) {
      const auto name = names.find(id);
      contents.regions.push_back({name == names.end() ? "" : name->second, int64_t{id}});
      runs->push_back(std::move(of_id));
    }
  }
  contents.draw = [runs](const PhotoSize&) { return *runs; };
  return contents;
}

}  // namespace semfoam
