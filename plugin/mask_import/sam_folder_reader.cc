// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask_import/sam_folder_reader.h"

#include "foam/util/error.h"
#include "foam/util/input_file.h"
#include "plugin/mask_import/one_object_png.h"

#include <charconv>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kHeader = "id,area,bbox_x0,";

// The ids of a metadata.csv, its first column, ascending.
std::set<int> ReadIds(const fs::path& table) {
  const std::string text = ReadFileBytes(table, "a table of SAM's masks");
  std::set<int> ids;
  size_t line = 1;
  for (size_t at = text.find('\n'); at != std::string::npos && at + 1 < text.size(); ++line) {
    const size_t begin = at + 1;
    at = text.find('\n', begin);
    const std::string_view row = std::string_view(text).substr(begin, at - begin);
    const std::string_view cell = row.substr(0, row.find(','));
    int id = -1;
    const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), id);
    if (error != std::errc() || end != cell.data() + cell.size() || id < 0 ||
        !ids.insert(id).second) {
      throw UserError(table.string(),
                      ": line ",
                      line + 1,
                      " begins with ",
                      Shortened(cell),
                      ", where the number of another mask would be right.");
    }
  }
  return ids;
}

std::optional<PictureContents> ReadFolder(const fs::path& folder, const fs::path& table) {
  const fs::path of_photo = table.parent_path();
  PictureContents contents;
  contents.name = of_photo.lexically_relative(folder).generic_string();
  if (contents.name == ".") contents.name = fs::absolute(of_photo).lexically_normal().filename();
  const auto runs = std::make_shared<std::vector<PixelRuns>>();
  for (const int id : ReadIds(table)) {
    const fs::path file = of_photo / (std::to_string(id) + ".png");
    OneObject object = ReadOneObject(file);
    if (contents.size == PhotoSize{}) contents.size = object.size;
    if (object.size != contents.size) {
      throw UserError(file.string(),
                      ": has ",
                      object.size.width,
                      " x ",
                      object.size.height,
                      " pixels, where the masks before it have ",
                      contents.size.width,
                      " x ",
                      contents.size.height,
                      "; the same size would be right.");
    }
    contents.regions.emplace_back();
    runs->push_back(std::move(object.runs));
  }
  contents.draw = [runs](const PhotoSize&) { return *runs; };
  return contents;
}

}  // namespace

ImportedMasks ReadSamFolders(const fs::path& folder, const std::vector<fs::path>& tables) {
  return ReadPictures("SAM's folders of masks", tables, [folder](const fs::path& table) {
    return ReadFolder(folder, table);
  });
}

bool IsSamTable(const fs::path& file) {
  InputFile table(file, "a table of masks");
  char bytes[kHeader.size()];
  return std::string_view(bytes, table.Read(bytes, sizeof(bytes))) == kHeader;
}

}  // namespace semfoam
