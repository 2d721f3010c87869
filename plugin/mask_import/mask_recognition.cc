// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask_import/mask_recognition.h"

#include "foam/util/error.h"
#include "foam/util/input_file.h"
#include "foam/util/json_file.h"
#include "plugin/mask_import/coco_reader.h"
#include "plugin/mask_import/cvat_reader.h"
#include "plugin/mask_import/id_png_reader.h"
#include "plugin/mask_import/label_studio_reader.h"
#include "plugin/mask_import/labelme_reader.h"
#include "plugin/mask_import/npy_file.h"
#include "plugin/mask_import/npy_reader.h"
#include "plugin/mask_import/object_png_reader.h"
#include "plugin/mask_import/photo_matching.h"
#include "plugin/mask_import/region_features.h"
#include "plugin/mask_import/region_list_reader.h"
#include "plugin/mask_import/sam_folder_reader.h"
#include "plugin/mask_import/yolo_reader.h"
#include "plugin/util/files.h"
#include "plugin/util/plural.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

using Json = nlohmann::json;

std::string ExtensionOf(const fs::path& file) {
  std::string extension = file.extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return extension;
}

// Collects the keys of a JSON's root, or of the first element where the root is a list, without
// keeping its values.
class RootKeys : public nlohmann::json_sax<Json> {
 public:
  bool null() override { return true; }
  bool boolean(bool) override { return true; }
  bool number_integer(number_integer_t) override { return true; }
  bool number_unsigned(number_unsigned_t) override { return true; }
  bool number_float(number_float_t, const string_t&) override { return true; }
  bool string(string_t&) override { return true; }
  bool binary(binary_t&) override { return true; }
  bool start_object(size_t) override {
    ++depth_;
    return true;
  }
  bool key(string_t& name) override {
    if (depth_ == (is_list_ ? 2 : 1)) keys_.insert(name);
    return true;
  }
  bool end_object() override { return End(); }
  bool start_array(size_t) override {
    if (depth_++ == 0) is_list_ = true;
    return true;
  }
  bool end_array() override { return End(); }
  bool parse_error(size_t, const std::string&, const nlohmann::detail::exception&) override {
    return false;
  }

  bool Has(const char* key) const { return keys_.contains(key); }
  bool is_list() const { return is_list_; }

 private:
  // Returns false, which ends it, after the first element of a list.
  bool End() { return --depth_ > (is_list_ ? 1 : 0); }

  std::set<std::string> keys_;
  int depth_ = 0;
  bool is_list_ = false;
};

// The format of a JSON file; nothing for other JSON. What is damaged after its first keys is
// recognised, and its reader says where.
std::optional<MaskFormat> FormatOfJson(const fs::path& file) {
  const std::string text = ReadFileBytes(file, "a JSON file");
  RootKeys keys;
  Json::sax_parse(text, &keys);
  if (keys.is_list()) {
    if (keys.Has("segmentation")) return MaskFormat::kRegionLists;
    if (keys.Has("shapes")) return MaskFormat::kLabelMe;
    if (keys.Has("data") && keys.Has("annotations")) return MaskFormat::kLabelStudio;
    return std::nullopt;
  }
  if (keys.Has("shapes")) return MaskFormat::kLabelMe;
  if (keys.Has("image_path") && keys.Has("annotations")) return MaskFormat::kRegionLists;
  if (keys.Has("categories") || (keys.Has("images") && keys.Has("annotations"))) {
    return MaskFormat::kCoco;
  }
  return std::nullopt;
}

// The files that may be masks, by their extension in lower case.
struct Candidates {
  std::map<std::string, std::vector<fs::path>> by_extension;

  const std::vector<fs::path>& With(const std::string& extension) const {
    static const std::vector<fs::path> kNone;
    const auto found = by_extension.find(extension);
    return found == by_extension.end() ? kNone : found->second;
  }
};

Candidates FilesOf(const fs::path& path) {
  Candidates files;
  if (!fs::is_directory(path)) {
    files.by_extension[ExtensionOf(path)].push_back(path);
    return files;
  }
  // What tells of masks is none.
  std::set<fs::path> features;
  if (const fs::path file = FindRegionFeatures(path); !file.empty()) {
    features.insert(file.lexically_normal());
    for (const auto& [name, mask] : ReadRegionFeatures(file)) {
      features.insert((path / mask.embeddings).lexically_normal());
    }
  }
  for (const fs::path& file : ListFiles(path)) {
    if (features.contains(file.lexically_normal())) continue;
    files.by_extension[ExtensionOf(file)].push_back(file);
  }
  return files;
}

// The folder of an export of CVAT: `folder`, or the only one in it.
fs::path FindCvat(const fs::path& folder) {
  std::vector<fs::path> places = {folder};
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, error)) {
    if (entry.is_directory()) places.push_back(entry.path());
  }
  std::sort(places.begin() + 1, places.end());
  for (const fs::path& place : places) {
    if (fs::is_directory(place / "SegmentationObject") ||
        fs::is_directory(place / "SegmentationClass")) {
      return place;
    }
  }
  return {};
}

std::vector<fs::path> Filtered(const std::vector<fs::path>& files,
                               bool (*is_one)(const fs::path&)) {
  std::vector<fs::path> filtered;
  std::copy_if(files.begin(), files.end(), std::back_inserter(filtered), is_one);
  return filtered;
}

// `is_folder`: whether the whole folder is meant, or one file in it.
std::optional<RecognizedMasks> Recognize(const fs::path& folder,
                                         bool is_folder,
                                         const Candidates& files,
                                         const std::vector<std::string>& photo_names) {
  if (const fs::path cvat = is_folder ? FindCvat(folder) : fs::path(); !cvat.empty()) {
    return RecognizedMasks{MaskFormat::kCvat, cvat, {}, {}};
  }
  if (const std::vector<fs::path> tables = Filtered(files.With(".csv"), IsSamTable);
      !tables.empty()) {
    return RecognizedMasks{MaskFormat::kSamFolders, folder, tables, {}};
  }
  std::vector<fs::path> arrays = files.With(".npy");
  arrays.insert(arrays.end(), files.With(".npz").begin(), files.With(".npz").end());
  if (!arrays.empty()) {
    std::sort(arrays.begin(), arrays.end());
    return RecognizedMasks{MaskFormat::kNumpy, folder, arrays, {}};
  }
  const std::vector<fs::path>& jsons = files.With(".json");
  for (const fs::path& json : jsons) {
    const std::optional<MaskFormat> format = FormatOfJson(json);
    if (!format) continue;
    std::vector<fs::path> of_format;
    for (const fs::path& file : jsons) {
      // The files of one photo each are many, and their reader leaves out what is of another form.
      const bool is_many = *format == MaskFormat::kRegionLists || *format == MaskFormat::kLabelMe;
      if (file == json || is_many || FormatOfJson(file) == format) of_format.push_back(file);
    }
    return RecognizedMasks{*format, folder, of_format, {}};
  }
  const std::vector<fs::path>& texts = files.With(".txt");
  if (std::any_of(texts.begin(), texts.end(), IsYolo)) {
    return RecognizedMasks{MaskFormat::kYolo, folder, texts, {}};
  }
  const std::vector<fs::path>& pngs = files.With(".png");
  if (pngs.empty()) return std::nullopt;
  std::vector<std::string> names;
  for (const fs::path& png : pngs) names.push_back(png.lexically_relative(folder).generic_string());
  const bool are_photos = NamesPhotosWithFolders(names, photo_names);
  const bool are_objects = !are_photos && AreObjectPngs(folder, pngs);
  return RecognizedMasks{
      are_objects ? MaskFormat::kObjectPngs : MaskFormat::kIdPngs, folder, pngs, {}};
}

}  // namespace

std::optional<RecognizedMasks> FindMasks(const fs::path& path,
                                         const std::vector<std::string>& photo_names) {
  if (!fs::exists(path)) return std::nullopt;
  if (!fs::is_directory(path)) RequireRegularFile(path, "a file of masks");
  const fs::path folder = fs::is_directory(path) ? path : ParentFolder(path);
  const Candidates files = FilesOf(path);
  std::optional<RecognizedMasks> masks =
      Recognize(folder, fs::is_directory(path), files, photo_names);
  if (!masks) return std::nullopt;
  const std::set<fs::path> taken(masks->files.begin(), masks->files.end());
  constexpr std::array kMaskExtensions = {".json", ".npy", ".npz", ".png", ".txt"};
  for (const std::string extension : kMaskExtensions) {
    // What is read beside the files that are listed.
    const bool is_read_too = masks->format == MaskFormat::kCvat ||
                             (masks->format == MaskFormat::kSamFolders && extension == ".png") ||
                             (masks->format == MaskFormat::kNumpy && extension == ".json") ||
                             (masks->format == MaskFormat::kIdPngs && extension == ".json");
    const std::vector<fs::path>& all = files.With(extension);
    const auto others = std::count_if(
        all.begin(), all.end(), [&](const fs::path& file) { return !taken.contains(file); });
    if (others > 0 && !is_read_too) {
      masks->left_out.push_back(Plural(others, (extension + " file").c_str()));
    }
  }
  return masks;
}

RecognizedMasks RecognizeMasks(const fs::path& path, const std::vector<std::string>& photo_names) {
  std::optional<RecognizedMasks> masks = FindMasks(path, photo_names);
  if (masks) return std::move(*masks);
  if (!fs::exists(path)) {
    throw UserError(path.string(),
                    ": there is no such file or folder; it should hold masks of the photos.");
  }
  // What is wrong with a single JSON, or with the only one, is worth telling.
  const std::vector<fs::path> jsons = FilesOf(path).With(".json");
  if (jsons.size() == 1) ReadJsonFile(jsons[0]);
  throw UserError(path.string(),
                  ": is of no known mask format; PNGs of ids or objects, COCO, LabelMe, Label "
                  "Studio, YOLO, CVAT, SAM or NumPy masks would be right.");
}

ImportedMasks ReadMasks(const RecognizedMasks& masks) {
  ImportedMasks read;
  switch (masks.format) {
    case MaskFormat::kIdPngs:
      read = ReadIdPngs(masks.folder, masks.files);
      break;
    case MaskFormat::kObjectPngs:
      read = ReadObjectPngs(masks.folder, masks.files);
      break;
    case MaskFormat::kSamFolders:
      read = ReadSamFolders(masks.folder, masks.files);
      break;
    case MaskFormat::kCvat:
      read = ReadCvat(masks.folder);
      break;
    case MaskFormat::kCoco:
      read = ReadCoco(masks.files);
      break;
    case MaskFormat::kRegionLists:
      read = ReadPictures("lists of regions by SAM", masks.files, ReadRegionList);
      break;
    case MaskFormat::kLabelMe:
      read = ReadPictureLists("LabelMe's shapes", masks.files, ReadLabelMe);
      break;
    case MaskFormat::kLabelStudio:
      read = ReadLabelStudio(masks.files);
      break;
    case MaskFormat::kYolo:
      read = ReadYolo(masks.folder, masks.files);
      break;
    case MaskFormat::kNumpy:
      read = ReadPictures("NumPy arrays", masks.files, ReadNpyMask);
      break;
  }
  read.left_out.insert(read.left_out.end(), masks.left_out.begin(), masks.left_out.end());
  return read;
}

}  // namespace semfoam
