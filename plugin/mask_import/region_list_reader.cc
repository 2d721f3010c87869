// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask_import/region_list_reader.h"

#include "foam/util/json_file.h"
#include "plugin/mask_import/json_field.h"
#include "plugin/mask_import/segmentation.h"

#include <memory>
#include <string>
#include <vector>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

// The "score" of a region: a number, or a list of one, as some versions of Grounded-SAM-2 save it.
std::optional<double> ScoreOf(const JsonField& region) {
  if (!region.Has("score")) return std::nullopt;
  const JsonField field = region["score"];
  const double score =
      field.IsList() && field.Size() == 1 ? field[size_t{0}].Number() : field.Number();
  if (!(score >= 0)) field.Fail("a number from 0 on");
  return score;
}

}  // namespace

std::optional<PictureContents> ReadRegionList(const fs::path& file) {
  const nlohmann::json json = ReadJsonFile(file);
  const JsonField root(file, json);
  const bool is_list = root.IsList();
  if (!is_list && !(root.Has("annotations") && root.Has("image_path"))) return std::nullopt;
  const JsonField list = is_list ? root : root["annotations"];
  PictureContents contents;
  contents.name = is_list ? file.stem().string() : root["image_path"].Text();
  if (!is_list && root.Has("img_width")) {
    contents.size.width = static_cast<int>(root["img_width"].Integer(1, kLargestSide));
    contents.size.height = static_cast<int>(root["img_height"].Integer(1, kLargestSide));
  }
  const auto shapes = std::make_shared<std::vector<Segmentation>>();
  for (size_t i = 0; i < list.Size(); ++i) {
    const JsonField region = list[i];
    const std::string place = "region " + std::to_string(i + 1);
    shapes->push_back(ReadSegmentation(region["segmentation"], place));
    if (contents.size == PhotoSize{}) contents.size = shapes->back().size;
    if (shapes->back().IsEmpty()) {
      ++contents.left_out["region without pixels"];
      shapes->pop_back();
      continue;
    }
    contents.regions.push_back(
        {region.Has("class_name") ? region["class_name"].Text() : "", -1, ScoreOf(region)});
  }
  contents.draw = [file, shapes](const PhotoSize& size) {
    std::vector<PixelRuns> runs;
    for (const Segmentation& shape : *shapes) runs.push_back(shape.Draw(file, size));
    return runs;
  };
  return contents;
}

}  // namespace semfoam
