// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask_import/id_png_reader.h"

#include "foam/util/json_file.h"
#include "plugin/mask/mask_classes.h"
#include "plugin/mask/mask_png.h"
#include "plugin/mask/mask_tables.h"
#include "plugin/mask_import/json_field.h"
#include "plugin/util/files.h"

#include <charconv>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

// All values of a mask, without its pixels.
MaskContents ContentsOf(const fs::path& file) {
  MaskContents contents;
  std::set<uint32_t> known;
  ReadMaskRows(file, [&](const MaskHeader& header, int, std::span<const uint32_t> values) {
    contents.is_rgb = header.is_rgb;
    contents.size = header.size;
    uint32_t last = values[0] + 1;
    for (const uint32_t value : values) {
      if (value == 0) ++contents.num_zero;
      if (value != last && known.insert(value).second) contents.ids.push_back(value);
      last = value;
    }
  });
  return contents;
}

// The categories of YouTube-VOS: {"videos": {"<video>": {"objects": {"1": {"category": "cup"}}}}}.
std::map<MaskId, std::string> ReadVideoNames(const fs::path& file) {
  std::map<MaskId, std::string> names;
  const nlohmann::json json = ReadJsonFile(file);
  const JsonField videos = JsonField(file, json)["videos"];
  if (!videos.IsObject()) videos.Fail("an object with the videos");
  for (const auto& [video, unused] : videos.value().items()) {
    const JsonField objects = videos[video.c_str()]["objects"];
    if (!objects.IsObject()) objects.Fail("an object with the video's objects");
    for (const auto& [key, also_unused] : objects.value().items()) {
      uint32_t id = 0;
      const auto [end, error] = std::from_chars(key.data(), key.data() + key.size(), id);
      if (error != std::errc() || end != key.data() + key.size()) {
        objects.FailBecause("has a key that is no id");
      }
      names.emplace(MaskId{id}, objects[key.c_str()]["category"].Text());
    }
  }
  return names;
}

std::map<MaskId, std::string> FindNames(const fs::path& folder) {
  std::map<MaskId, std::string> names;
  if (const fs::path file = FindLabelsFile({}, folder); !file.empty()) {
    for (const LabelName& name : ReadLabelNames(file)) names.emplace(name.source_id, name.name);
    return names;
  }
  fs::path at = fs::absolute(folder).lexically_normal();
  for (int i = 0; i < 3; ++i) {
    if (fs::is_regular_file(at / "meta.json")) return ReadVideoNames(at / "meta.json");
    at = ParentFolder(at);
  }
  return names;
}

}  // namespace

ImportedMasks ReadIdPngs(const fs::path& folder, const std::vector<fs::path>& files) {
  std::vector<MaskContents> contents(files.size());
  ForEachFile(static_cast<int64_t>(files.size()),
              [&](int64_t i) { contents[i] = ContentsOf(files[i]); });
  const auto classes = std::make_shared<const MaskClasses>(
      NumberMasks(contents, {files, {}}, folder, LabelZero::kIgnore));
  const std::map<MaskId, std::string> names = FindNames(folder);
  ImportedMasks masks;
  masks.format = "PNGs of ids";
  NameTable table(&masks.names);
  for (size_t i = 0; i < files.size(); ++i) {
    ImportedPicture picture{files[i],
                            files[i].lexically_relative(folder).generic_string(),
                            contents[i].size,
                            {},
                            {},
                            nullptr};
    // The values of the regions, in their order.
    auto values = std::make_shared<std::vector<uint32_t>>();
    const std::vector<ClassIndex> of_ids = classes->Of(contents[i]);
    for (size_t k = 0; k < of_ids.size(); ++k) {
      if (of_ids[k] == kUnlabelled) continue;
      const MaskId id = classes->labels[Value(of_ids[k])].source_id;
      const auto name = names.find(id);
      picture.regions.push_back(
          {name == names.end() ? -1 : table.IndexOf(name->second), int64_t{Value(id)}});
      values->push_back(contents[i].ids[k]);
    }
    picture.draw = [file = files[i], values](const PhotoSize&) {
      std::map<uint32_t, PixelRuns> by_value = RunsByValue([&](const RowReceiver& on_row) {
        ReadMaskRows(
            file, [&](const MaskHeader&, int y, std::span<const uint32_t> row) { on_row(y, row); });
      });
      std::vector<PixelRuns> runs;
      for (const uint32_t value : *values) runs.push_back(std::move(by_value[value]));
      return runs;
    };
    masks.pictures.push_back(std::move(picture));
  }
  return masks;
}

}  // namespace semfoam
