// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask_import/coco_reader.h"

#include "foam/util/json_file.h"
#include "plugin/mask_import/json_field.h"
#include "plugin/mask_import/segmentation.h"
#include "plugin/util/plural.h"

#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <string>
#include <utility>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

using Json = nlohmann::json;

constexpr int64_t kLargestId = std::numeric_limits<int64_t>::max();

struct Annotation {
  int64_t image_id = 0;
  int64_t category_id = 0;
  int64_t track = -1;
  Segmentation segmentation;
};

Annotation ReadAnnotation(const JsonField& field, const std::string& place) {
  Annotation annotation;
  annotation.image_id = field["image_id"].Integer(0, kLargestId);
  annotation.category_id = field["category_id"].Integer(0, kLargestId);
  if (field.Has("track_id")) {
    annotation.track = field["track_id"].Integer(0, kLargestId);
  } else if (field.Has("attributes") && field["attributes"].Has("track_id")) {
    annotation.track = field["attributes"]["track_id"].Integer(0, kLargestId);
  }
  if (field.Has("segmentation")) {
    annotation.segmentation = ReadSegmentation(field["segmentation"], place);
  }
  return annotation;
}

// Adds the pictures and names of one file.
class FileReader {
 public:
  FileReader(const fs::path& file, ImportedMasks* masks) : file_(file), masks_(masks) {}

  // Returns the number of annotations without pixels.
  int64_t Read() {
    const Json json = ReadJsonFile(file_, "annotations", [&](const Json& element, size_t index) {
      const std::string place = "annotations[" + std::to_string(index) + "]";
      annotations_.push_back(ReadAnnotation(JsonField(file_, element, place), place));
    });
    const JsonField root(file_, json);
    if (root["annotations"].Size() > 0) root["annotations"][size_t{0}].Fail("an object");
    ReadCategories(root["categories"]);
    ReadImages(root["images"]);
    return AddAnnotations();
  }

 private:
  void ReadCategories(const JsonField& categories) {
    NameTable names(&masks_->names);
    for (size_t i = 0; i < categories.Size(); ++i) {
      const JsonField field = categories[i]["id"];
      const int64_t id = field.Integer(0, kLargestId);
      const std::string name = categories[i]["name"].Text();
      if (name.empty()) categories[i]["name"].Fail("a name");
      const int32_t index = names.IndexOf(name);
      if (masks_->name_ids.size() < masks_->names.size()) masks_->name_ids.push_back(id);
      if (!name_of_category_.emplace(id, index).second) {
        field.FailBecause("is the id of another category, too; one id for each would be right");
      }
    }
  }

  void ReadImages(const JsonField& images) {
    for (size_t i = 0; i < images.Size(); ++i) {
      const JsonField image = images[i];
      const JsonField id = image["id"];
      ImportedPicture picture;
      picture.file = file_;
      picture.name = image["file_name"].Text();
      picture.size.width = static_cast<int>(image["width"].Integer(1, kLargestSide));
      picture.size.height = static_cast<int>(image["height"].Integer(1, kLargestSide));
      // Roboflow keeps the name of the picture that was uploaded.
      if (image.Has("extra") && image["extra"].Has("name")) {
        picture.name = image["extra"]["name"].Text();
      }
      if (!picture_of_image_.emplace(id.Integer(0, kLargestId), masks_->pictures.size()).second) {
        id.FailBecause("is the id of another image, too; one id for each would be right");
      }
      masks_->pictures.push_back(std::move(picture));
    }
  }

  int64_t AddAnnotations() {
    int64_t without_pixels = 0;
    std::map<size_t, std::shared_ptr<std::vector<Segmentation>>> shapes;
    for (size_t i = 0; i < annotations_.size(); ++i) {
      Annotation& annotation = annotations_[i];
      const auto picture = picture_of_image_.find(annotation.image_id);
      if (picture == picture_of_image_.end()) Missing(i, "image_id", annotation.image_id, "images");
      const auto name = name_of_category_.find(annotation.category_id);
      if (name == name_of_category_.end()) {
        Missing(i, "category_id", annotation.category_id, "categories");
      }
      if (annotation.segmentation.IsEmpty()) {
        ++without_pixels;
        continue;
      }
      masks_->pictures[picture->second].regions.push_back({name->second, annotation.track});
      std::shared_ptr<std::vector<Segmentation>>& of_picture = shapes[picture->second];
      if (of_picture == nullptr) of_picture = std::make_shared<std::vector<Segmentation>>();
      of_picture->push_back(std::move(annotation.segmentation));
    }
    for (const auto& [index, of_picture] : shapes) {
      masks_->pictures[index].draw = [file = file_, of_picture](const PhotoSize& size) {
        std::vector<PixelRuns> runs;
        for (const Segmentation& shape : *of_picture) runs.push_back(shape.Draw(file, size));
        return runs;
      };
    }
    return without_pixels;
  }

  [[noreturn]] void Missing(size_t annotation,
                            const char* key,
                            int64_t id,
                            const char* list) const {
    throw UserError(file_.string(),
                    ": annotations[",
                    annotation,
                    "].",
                    key,
                    " is ",
                    id,
                    ", an id that none of the ",
                    list,
                    " has; is the file complete?");
  }

  const fs::path file_;
  ImportedMasks* const masks_;
  std::vector<Annotation> annotations_;
  std::map<int64_t, int32_t> name_of_category_;
  std::map<int64_t, size_t> picture_of_image_;
};

}  // namespace

ImportedMasks ReadCoco(const std::vector<fs::path>& files) {
  ImportedMasks masks;
  masks.format = "COCO annotations";
  int64_t without_pixels = 0;
  for (const fs::path& file : files) without_pixels += FileReader(file, &masks).Read();
  if (without_pixels > 0) {
    masks.left_out.push_back(Plural(without_pixels, "annotation") + " without pixels");
  }
  return masks;
}

}  // namespace semfoam
