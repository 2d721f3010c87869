// SPDX-License-Identifier: GPL-3.0-or-later
//
// Damaged masks of every format are refused with one sentence, and leave nothing.
#include "plugin/mask_import/mask_import.h"

#include <array>

#include "tests/bad_input/bad_input.h"
#include "tests/plugin/mask_import/mask_formats.h"

namespace semfoam {
namespace {

namespace fs = std::filesystem;

using Json = nlohmann::json;

int num_cases = 0;

void Import(const fs::path& folder) {
  fs::create_directories(folder / "out");
  const std::vector<std::string> names = PhotoNames(folder / "photos");
  ImportMasks(RecognizeMasks(folder / "masks", names),
              folder / "photos",
              names,
              SameName::kObjects,
              folder / "out");
}

const FormatSample& SampleOf(const std::string& name) {
  static const std::vector<FormatSample> samples = AllFormats();
  for (const FormatSample& sample : samples) {
    if (sample.name == name) return sample;
  }
  throw std::runtime_error("no such format: " + name);
}

// Expects that each case is refused as it says, and that no mask was written.
void ExpectRefused(const std::string& format, const std::vector<BadInput>& cases) {
  for (const BadInput& bad : cases) {
    ++num_cases;
    const TempFolder temp;
    const ExactScene scene;
    scene.WritePhotos(temp / "photos");
    SampleOf(format).write(scene, temp / "masks");
    bad.spoil(temp.path());
    const std::string sentence =
        Replaced(UserErrorOf([&] { Import(temp.path()); }), temp.path().string(), "IN");
    EXPECT_THAT(sentence, TellsOf(bad.mistake)) << format << ": " << bad.name;
    EXPECT_TRUE(FilesBelow(temp / "out").empty()) << format << ": " << bad.name;
  }
}

// A spoiler: changes the JSON of a file.
auto Change(const std::string& file, const std::function<void(Json& json)>& change) {
  return [=](const fs::path& folder) {
    Json json = Json::parse(ReadFile(folder / file));
    change(json);
    WriteFile(folder / file, json.dump());
  };
}

// A spoiler: the value at a JSON pointer becomes another.
auto Set(const std::string& file, const std::string& pointer, const Json& value) {
  return Change(file, [=](Json& json) { json[Json::json_pointer(pointer)] = value; });
}

// A spoiler: the member at a JSON pointer is taken out of its object.
auto Erase(const std::string& file, const std::string& pointer) {
  return Change(file, [=](Json& json) {
    const Json::json_pointer at(pointer);
    json[at.parent_pointer()].erase(at.back());
  });
}

TEST(BadMasks, Coco) {
  const std::string coco = "masks/annotations/instances_default.json";
  const std::string in = "IN/" + coco;
  const std::string first = "/annotations/0/";
  const std::string runs = first + "segmentation/";
  ExpectRefused(
      "coco_compressed_runs",
      {{"cut", CutTo(coco, 700), {in, {"700"}, "before its JSON does"}},
       {"cut runs", Set(coco, runs + "counts", "X"), {in, {"annotations[0]", "run 1"}, "is cut"}},
       {"another character",
        Set(coco, runs + "counts", "4 4"),
        {in, {"annotations[0]", "character 2"}, "is none of a compressed run"}},
       {"a negative run", Set(coco, runs + "counts", "O"), {in, {"run 1"}, "is negative"}},
       {"an endless run",
        Set(coco, runs + "counts", "ooooooooooo"),
        {in, {"run 1"}, "has more than 9 characters"}},
       {"a long run",
        Set(coco, runs + "counts", "oooooooo?"),
        {in, {"run 1"}, "is longer than any picture"}},
       {"too few pixels", Set(coco, runs + "counts", "414"), {in, {"24 x 18"}, "do not add up"}},
       {"no runs", Set(coco, runs + "counts", ""), {in, {"annotations[0]"}, "do not add up"}},
       {"counts of another type",
        Set(coco, runs + "counts", 7),
        {in, {"annotations[0].segmentation.counts", "7"}, "a list of numbers"}},
       {"no counts", Erase(coco, runs + "counts"), {in, {"counts"}, "has no"}},
       {"no size", Erase(coco, runs + "size"), {in, {"size"}, "has no"}},
       {"a size of three", Set(coco, runs + "size", {1, 2, 3}), {in, {"size"}, "two numbers"}},
       {"a size as text", Set(coco, runs + "size", "24x18"), {in, {"size"}, "a list"}},
       {"a size of nothing",
        Set(coco, runs + "size", {0, 24}),
        {in, {"size[0]"}, "from 1 to 65535"}},
       {"a huge size", Set(coco, runs + "size", {18, 1e12}), {in, {"size[1]"}, "from 1 to 65535"}},
       {"another size",
        Set(coco, runs + "size", {24, 18}),
        {in, {"18 x 24", "24 x 18"}, "the same size"}}});
  ExpectRefused(
      "coco_raw_runs",
      {{"a negative run",
        Set(coco, runs + "counts/0", -1),
        {in, {"counts[0]", "-1"}, "from 0 to 432"}},
       {"half a run",
        Set(coco, runs + "counts/0", 1.5),
        {in, {"counts[0]", "1.5"}, "whole number"}},
       {"a huge run",
        Set(coco, runs + "counts/1", 433),
        {in, {"counts[1]", "433"}, "from 0 to 432"}},
       {"a longer run", Set(coco, runs + "counts/0", 400), {in, {"24 x 18"}, "do not add up"}},
       {"a run as text", Set(coco, runs + "counts/1", "7"), {in, {"counts[1]"}, "whole number"}}});
  ExpectRefused(
      "coco_polygons",
      {{"an odd number",
        Set(coco, runs + "0", {1, 2, 3, 4, 5}),
        {in, {"annotations[0].segmentation[0]", "5 numbers"}, "an even number"}},
       {"a text", Set(coco, runs + "0/0", "1"), {in, {"segmentation[0][0]"}, "a number"}},
       {"null", Set(coco, runs + "0/3", nullptr), {in, {"null"}, "a number"}},
       {"flat", Set(coco, first + "segmentation", {1, 2, 3, 4, 5, 6}), {in, {"1"}, "a list"}},
       {"a text for all",
        Set(coco, first + "segmentation", "414"),
        {in, {"414"}, "a list of polygons"}},
       {"a huge number",
        Replace(coco, "\"segmentation\":[[", "\"segmentation\":[[1e999,"),
        {in, {}, "which a double does not hold"}},
       {"not a number",
        Replace(coco, "\"segmentation\":[[", "\"segmentation\":[[NaN,"),
        {in, {}, "no valid JSON"}},
       {"an unknown image",
        Set(coco, first + "image_id", 99),
        {in, {"image_id", "99"}, "none of the images"}},
       {"an unknown category",
        Set(coco, first + "category_id", 99),
        {in, {"category_id", "99"}, "none of the categories"}},
       {"an image as text", Set(coco, first + "image_id", "7"), {in, {"image_id"}, "whole number"}},
       {"a negative category",
        Set(coco, first + "category_id", -1),
        {in, {"category_id"}, "whole number"}},
       {"no image", Erase(coco, first + "image_id"), {in, {"image_id"}, "has no"}},
       {"no category", Erase(coco, first + "category_id"), {in, {"category_id"}, "has no"}},
       {"a negative track", Set(coco, first + "track_id", -4), {in, {"track_id"}, "whole number"}},
       {"a track as text",
        Set(coco, first + "attributes", {{"track_id", "a"}}),
        {in, {"attributes.track_id"}, "whole number"}},
       {"an annotation that is none", Set(coco, "/annotations/1", 7), {in, {"7"}, "an object"}},
       {"annotations that are none", Set(coco, "/annotations", 7), {in, {"annotations"}, "a list"}},
       {"no annotations", Erase(coco, "/annotations"), {in, {"annotations"}, "has no"}},
       {"no images", Erase(coco, "/images"), {in, {"images"}, "has no"}},
       {"no categories", Erase(coco, "/categories"), {in, {"categories"}, "has no"}},
       {"two images of an id",
        Set(coco, "/images/1/id", 7),
        {in, {"images[1].id"}, "another image"}},
       {"two categories of an id",
        Set(coco, "/categories/1/id", 1),
        {in, {"categories[1].id"}, "another category"}},
       {"a category without a name",
        Set(coco, "/categories/1/name", ""),
        {in, {"categories[1].name"}, "a name"}},
       {"a category named by a number",
        Set(coco, "/categories/1/name", 3),
        {in, {"name"}, "a text"}},
       {"an image without a name",
        Erase(coco, "/images/0/file_name"),
        {in, {"file_name"}, "has no"}},
       {"an image without width", Erase(coco, "/images/0/width"), {in, {"width"}, "has no"}},
       {"an image of nothing",
        Set(coco, "/images/0/height", 0),
        {in, {"height"}, "from 1 to 65535"}},
       {"another shape",
        Set(coco, "/images/0/height", 24),
        {in, {"24 x 24", "24 x 18"}, "the same shape"}},
       {"a huge image",
        Change(coco,
               [](Json& json) {
                 json["images"][0]["width"] = 24 * 17;
                 json["images"][0]["height"] = 18 * 17;
               }),
        {in, {"408 x 306"}, "times those of the photo"}},
       {"names of no photo",
        Change(coco,
               [](Json& json) {
                 for (Json& image : json["images"]) image["file_name"] = "x.jpg";
               }),
        {in, {"x.jpg"}, "none of the 3 masks"}},
       {"two of a photo",
        Set(coco, "/images/1/file_name", "cam/0001.png"),
        {in, {"cam/0001.png"}, "are both of"}},
       {"a key twice",
        Replace(coco, "{\"annotations\"", "{\"images\":[],\"annotations\""),
        {in, {"\"images\""}, "twice"}},
       {"nested deeply",
        Replace(coco,
                "\"segmentation\":",
                "\"x\":" + std::string(99, '[') + std::string(99, ']') + ",\"segmentation\":"),
        {in, {}, "nested deeper"}},
       {"empty", CutTo(coco, 0), {in, {}, "ends after 0 bytes"}},
       {"text", Put(coco, "no JSON\n"), {in, {}, "no valid JSON"}},
       {"a number alone", Put(coco, "7"), {"IN/masks", {}, "no known mask format"}},
       {"an empty object", Put(coco, "{}"), {"IN/masks", {}, "no known mask format"}},
       {"an empty list", Put(coco, "[]"), {"IN/masks", {}, "no known mask format"}},
       {"a pipe", MakePipe(coco), {"IN/masks", {}, "no known mask format"}}});
}

TEST(BadMasks, RegionLists) {
  const std::string list = "masks/0001.json";
  const std::string in = "IN/" + list;
  ExpectRefused(
      "sam_lists",
      {{"cut", CutTo(list, 200), {in, {"200"}, "before its JSON does"}},
       {"no segmentation", Erase(list, "/1/segmentation"), {in, {"[1]", "segmentation"}, "has no"}},
       {"a region that is none", Set(list, "/1", 7), {in, {"[1]", "7"}, "an object"}},
       {"other run lengths",
        Set(list, "/1/segmentation/counts", "414"),
        {in, {"region 2", "24 x 18"}, "do not add up"}},
       {"damaged run lengths",
        Set(list, "/0/segmentation/counts", "~"),
        {in, {"region 1"}, "damaged"}},
       {"another size",
        Set(list, "/1/segmentation/size", {9, 12}),
        {in, {"region 2", "12 x 9"}, "the same size"}},
       {"all of another shape",
        Change(list,
               [](Json& json) {
                 for (Json& region : json) {
                   region["segmentation"] = {{"size", {9, 9}}, {"counts", {81}}};
                 }
               }),
        {in, {"9 x 9", "24 x 18"}, "the same shape"}}});
  const std::string grounded = "masks/0_results.json";
  const std::string in_grounded = "IN/" + grounded;
  ExpectRefused(
      "grounded_sam",
      {{"cut", CutTo(grounded, 300), {in_grounded, {"300"}, "before its JSON does"}},
       {"a class that is none",
        Set(grounded, "/annotations/0/class_name", 3),
        {in_grounded, {"annotations[0].class_name"}, "a text"}},
       {"a score that is none",
        Set(grounded, "/annotations/1/score", "0.9"),
        {in_grounded, {"annotations[1].score"}, "a number"}},
       {"a negative score",
        Set(grounded, "/annotations/1/score", -0.5),
        {in_grounded, {"annotations[1].score"}, "from 0 on"}},
       {"no segmentation",
        Erase(grounded, "/annotations/0/segmentation"),
        {in_grounded, {"segmentation"}, "has no"}},
       {"annotations that are none",
        Set(grounded, "/annotations", 4),
        {in_grounded, {"annotations"}, "a list"}},
       {"an image that is none",
        Set(grounded, "/image_path", 4),
        {in_grounded, {"image_path"}, "a text"}},
       {"no height", Erase(grounded, "/img_height"), {in_grounded, {"img_height"}, "has no"}},
       {"another width",
        Set(grounded, "/img_width", 20),
        {in_grounded, {"20 x 18", "24 x 18"}, "the same shape"}},
       {"a width of nothing",
        Set(grounded, "/img_width", 0),
        {in_grounded, {"img_width"}, "from 1 to 65535"}}});
}

TEST(BadMasks, LabelStudio) {
  const std::string project = "masks/project.json";
  const std::string in = "IN/" + project;
  const std::string result = "/0/annotations/0/result/";
  ExpectRefused(
      "label_studio",
      {{"cut", CutTo(project, 2000), {in, {"2000"}, "before its JSON does"}},
       {"no data", Erase(project, "/0/data"), {"IN/masks", {}, "no known mask format"}},
       {"no data later", Erase(project, "/1/data"), {in, {"task 2", "data"}, "has no"}},
       {"no image", Set(project, "/0/data", {{"a", 1}}), {in, {"task 1.data"}, "has no"}},
       {"an image that is none",
        Set(project, "/0/data/image", 3),
        {in, {"task 1.data.image"}, "a text"}},
       {"annotations that are none",
        Set(project, "/1/annotations", 3),
        {in, {"task 2.annotations"}, "a list"}},
       {"a task that is none", Set(project, "/1", 3), {in, {"3"}, "a task"}},
       {"no width",
        Erase(project, result + "0/original_width"),
        {in, {"original_width"}, "has no"}},
       {"two widths",
        Set(project, result + "1/original_width", 48),
        {in, {"original_width"}, "differs"}},
       {"no value", Erase(project, result + "0/value"), {in, {"value"}, "has no"}},
       {"no label",
        Set(project, result + "0/value/polygonlabels", Json::array()),
        {in, {"polygonlabels"}, "is empty"}},
       {"no labels",
        Erase(project, result + "0/value/polygonlabels"),
        {in, {"polygonlabels"}, "has no"}},
       {"no points", Erase(project, result + "0/value/points"), {in, {"points"}, "has no"}},
       {"a point of three",
        Set(project, result + "0/value/points/1", {1, 2, 3}),
        {in, {"points[1]"}, "two numbers"}},
       {"a point of texts",
        Set(project, result + "0/value/points/1", {"1", 2}),
        {in, {"points[1][0]"}, "a number"}},
       {"no brush", Set(project, result + "2/value/rle", Json::array()), {in, {"rle"}, "is empty"}},
       {"a large byte",
        Set(project, result + "2/value/rle/3", 256),
        {in, {"rle[3]", "256"}, "from 0 to 255"}},
       {"a cut brush",
        Change(project,
               [=](Json& json) { json[Json::json_pointer(result + "2/value/rle")].erase(9); }),
        {in, {"24 x 18"}, "does not decode"}},
       {"a short brush",
        Set(project, result + "2/value/rle", {0, 0, 6, 192}),
        {in, {"24 x 18"}, "does not decode"}},
       {"another shape",
        Change(project,
               [](Json& json) {
                 for (Json& one : json[0]["annotations"][0]["result"]) one["original_width"] = 30;
               }),
        {in, {"30 x 18", "24 x 18"}, "the same shape"}}});
}

TEST(BadMasks, LabelMe) {
  const std::string file = "masks/0002.json";
  const std::string in = "IN/" + file;
  // Shapes: rectangles of the mug, then the mask of the ball.
  const auto of_mask = [&](const std::function<void(Json & shape)>& change) {
    return Change(file, [=](Json& json) {
      for (Json& shape : json["shapes"]) {
        if (shape["shape_type"] == "mask") change(shape);
      }
    });
  };
  ExpectRefused(
      "labelme",
      {{"cut", CutTo(file, 200), {in, {"200"}, "before its JSON does"}},
       {"no width", Erase(file, "/imageWidth"), {in, {"imageWidth"}, "has no"}},
       {"a width as text", Set(file, "/imageWidth", "24"), {in, {"imageWidth"}, "whole number"}},
       {"another width",
        Set(file, "/imageWidth", 48),
        {in, {"48 x 18", "24 x 18"}, "the same shape"}},
       {"shapes that are none", Set(file, "/shapes", 3), {in, {"shapes"}, "a list"}},
       {"a shape that is none", Set(file, "/shapes/0", 3), {in, {"shapes[0]"}, "an object"}},
       {"no label", Erase(file, "/shapes/0/label"), {in, {"label"}, "has no"}},
       {"an empty label", Set(file, "/shapes/0/label", ""), {in, {"shapes[0].label"}, "a name"}},
       {"no points", Erase(file, "/shapes/0/points"), {in, {"points"}, "has no"}},
       {"flat points", Set(file, "/shapes/0/points", {1, 2, 3, 4}), {in, {"points[0]"}, "a list"}},
       {"a point of one", Set(file, "/shapes/0/points/0", {1}), {in, {"points[0]"}, "two numbers"}},
       {"a point of texts",
        Set(file, "/shapes/0/points/0", {"a", "b"}),
        {in, {"points[0][0]"}, "a number"}},
       {"a type that is none",
        Set(file, "/shapes/0/shape_type", 3),
        {in, {"shape_type"}, "a text"}},
       {"a group that is none",
        Set(file, "/shapes/0/group_id", "a"),
        {in, {"group_id"}, "whole number"}},
       {"a circle of three points",
        Change(file,
               [](Json& json) {
                 json["shapes"][0]["shape_type"] = "circle";
                 json["shapes"][0]["points"] = {{1, 2}, {3, 4}, {5, 6}};
               }),
        {in, {"points"}, "two points"}},
       {"no mask", of_mask([](Json& shape) { shape.erase("mask"); }), {in, {"mask"}, "has no"}},
       {"no base64",
        of_mask([](Json& shape) { shape["mask"] = "!!"; }),
        {in, {"mask"}, "no base64"}},
       {"no PNG", of_mask([](Json& shape) { shape["mask"] = "aGFsbG8="; }), {in, {}, "no PNG"}},
       {"an empty PNG", of_mask([](Json& shape) { shape["mask"] = ""; }), {in, {}, "it is empty"}},
       {"a cut PNG",
        of_mask(
            [](Json& shape) { shape["mask"] = shape["mask"].get<std::string>().substr(0, 80); }),
        {in, {}, "cannot be decoded"}},
       {"a mask outside",
        of_mask([](Json& shape) { shape["points"][0][0] = 3; }),
        {in, {"24 x 18"}, "outside"}},
       {"a mask far outside",
        of_mask([](Json& shape) { shape["points"][0][1] = -3; }),
        {in, {}, "outside"}},
       {"a corner missing",
        of_mask([](Json& shape) { shape["points"].erase(1); }),
        {in, {}, "two points"}},
       {"of another photo",
        Set(file, "/imagePath", "0001.png"),
        {"IN/masks", {"0001.png"}, "are both of"}}});
}

TEST(BadMasks, Yolo) {
  const std::string file = "masks/labels/0001.txt";
  const std::string in = "IN/" + file;
  const std::string good = "0 0.1 0.1 0.5 0.1 0.5 0.5\n";
  ExpectRefused(
      "yolo",
      {{"pixels", Put(file, good + "1 12 4 30 4 30 60\n"), {in, {"line 2", "12"}, "from 0 to 1"}},
       {"negative",
        Put(file, good + "1 -0.2 0 1 0 1 1\n"),
        {in, {"line 2", "-0.2"}, "from 0 to 1"}},
       {"not a number",
        Put(file, good + "1 nan 0 1 0 1 1\n"),
        {in, {"line 2", "nan"}, "from 0 to 1"}},
       {"a word", Put(file, good + "1 0 0 1 x 1 1\n"), {in, {"line 2", "x"}, "from 0 to 1"}},
       {"odd", Put(file, good + "\n1 0 0 1 0 1 1 0.5\n"), {in, {"line 3", "7 numbers"}, "x and y"}},
       {"two points",
        Put(file, good + "1 0 0 1 0 0\n"),
        {in, {"line 2", "5 numbers"}, "three points"}},
       {"a class alone", Put(file, good + "1\n"), {in, {"line 2", "0 numbers"}, "three points"}},
       {"half a class",
        Put(file, good + "1.5 0 0 1 0 1 1\n"),
        {in, {"line 2", "1.5"}, "number of a class"}},
       {"a negative class",
        Put(file, good + "-1 0 0 1 0 1 1\n"),
        {in, {"line 2", "-1"}, "number of a class"}},
       {"a huge class",
        Put(file, good + "70000 0 0 1 0 1 1\n"),
        {in, {"line 2", "70000"}, "number of a class"}},
       {"a class as word",
        Put(file, good + "mug 0 0 1 0 1 1\n"),
        {in, {"line 2", "mug"}, "number of a class"}},
       {"names that are none",
        Put("masks/data.yaml", "names: mug\n"),
        {"IN/masks/data.yaml", {}, "names"}},
       {"a name missing",
        Put("masks/data.yaml", "names: [mug, , plant]\n"),
        {"IN/masks/data.yaml", {}, "names"}},
       {"a name twice",
        Put("masks/data.yaml", "names:\n  0: mug\n  0: ball\n"),
        {"IN/masks/data.yaml", {}, "names"}},
       {"a key that is none",
        Put("masks/data.yaml", "names:\n  a: mug\n"),
        {"IN/masks/data.yaml", {}, "names"}}});
}

TEST(BadMasks, Numpy) {
  const std::string file = "masks/mask_data/mask_0001.npy";
  const std::string in = "IN/" + file;
  const std::string names = "masks/json_data/mask_0001.json";
  const auto header = [&](const std::string& text) {
    return [=](const fs::path& folder) {
      std::string padded = text;
      padded.resize(118, ' ');
      WriteFile(folder / file,
                std::string("\x93NUMPY\x01\x00\x76\x00", 10) + padded + std::string(864, '\1'));
    };
  };
  const std::string rest = "'fortran_order': False, 'shape': (18, 24), }";
  ExpectRefused(
      "grounded_sam_2",
      {{"empty", CutTo(file, 0), {in, {}, "no .npy file"}},
       {"magic alone", CutTo(file, 6), {in, {}, "within the header"}},
       {"cut header", CutTo(file, 50), {in, {}, "within the header"}},
       {"cut elements", CutTo(file, 600), {in, {"864"}, "its header promises"}},
       {"more elements", Append(file, "xx"), {in, {"866", "864"}, "its header promises"}},
       {"text", Put(file, "hello"), {in, {}, "no .npy file"}},
       {"another version", Replace(file, "NUMPY\x01", "NUMPY\x04"), {in, {"version 4"}, "1 to 3"}},
       {"real numbers", header("{'descr': '<f4', " + rest), {in, {"<f4"}, "whole numbers"}},
       {"complex numbers", header("{'descr': '<c8', " + rest), {in, {"<c8"}, "whole numbers"}},
       {"objects", header("{'descr': '|O', " + rest), {in, {"|O"}, "whole numbers"}},
       {"words of 16", header("{'descr': '<u16', " + rest), {in, {"<u16"}, "whole numbers"}},
       {"a record", header("{'descr': [('a', '<u2')], " + rest), {in, {}, "NumPy header"}},
       {"no type", header("{" + rest), {in, {}, "is not complete"}},
       {"a key twice",
        header("{'descr': '<u2', 'descr': '<u2', " + rest),
        {in, {"descr"}, "twice"}},
       {"another key", header("{'descr': '<u2', 'x': 1, " + rest), {in, {"x"}, "has the key"}},
       {"no end",
        header("{'descr': '<u2', 'fortran_order': False, 'shape': (18, 24"),
        {in, {}, "NumPy header"}},
       {"an order that is none",
        header("{'descr': '<u2', 'fortran_order': Perhaps, 'shape': (18, 24), }"),
        {in, {}, "neither True nor False"}},
       {"one side",
        header("{'descr': '<u2', 'fortran_order': False, 'shape': (432,), }"),
        {in, {"432"}, "height x width"}},
       {"no side",
        header("{'descr': '<u2', 'fortran_order': False, 'shape': (), }"),
        {in, {"864", "2"}, "promises"}},
       {"three layers",
        header("{'descr': '<u2', 'fortran_order': False, 'shape': (3, 18, 8), }"),
        {in, {"3 x 18 x 8"}, "height x width"}},
       {"a negative side",
        header("{'descr': '<u2', 'fortran_order': False, 'shape': (-18, 24), }"),
        {in, {}, "no number of elements"}},
       {"sides that overflow",
        header(
            "{'descr': '<u2', 'fortran_order': False, 'shape': (1099511627776, 1099511627776), }"),
        {in, {}, "more elements than any file"}},
       {"a huge side",
        header("{'descr': '<u2', 'fortran_order': False, 'shape': (9223372036854775807, 2), }"),
        {in, {}, "no number of elements"}},
       {"another shape",
        header("{'descr': '<u2', 'fortran_order': False, 'shape': (24, 18), }"),
        {in, {"18 x 24", "24 x 18"}, "the same shape"}},
       {"negative ids",
        [=](const fs::path& folder) {
          LabelImage mask{24, 18, std::vector<int32_t>(24 * 18)};
          mask.data[5] = -3;
          WriteFile(folder / file, NpyOf(mask, "<i2", false));
        },
        {in, {"-3"}, "ids from 0"}},
       {"names cut", CutTo(names, 60), {"IN/" + names, {"60"}, "before its JSON does"}},
       {"no names", Erase(names, "/labels"), {"IN/" + names, {"labels"}, "has no"}},
       {"names that are none", Set(names, "/labels", 3), {"IN/" + names, {"labels"}, "an object"}},
       {"an id that is none",
        Set(names, "/labels/a", {{"class_name", "x"}}),
        {"IN/" + names, {"labels"}, "an id"}},
       {"no class",
        Erase(names, "/labels/2/class_name"),
        {"IN/" + names, {"class_name"}, "has no"}},
       {"a class that is none",
        Set(names, "/labels/2/class_name", 4),
        {"IN/" + names, {"labels.2.class_name"}, "a text"}}});
  const std::string zip = "masks/0001.npz";
  const std::string in_zip = "IN/" + zip;
  const auto flip = [&](int64_t from_end) {
    return [=](const fs::path& folder) {
      std::string bytes = ReadFile(folder / zip);
      char& byte = bytes[from_end < 0 ? bytes.size() + from_end : from_end];
      byte = static_cast<char>(~byte);
      WriteFile(folder / zip, bytes);
    };
  };
  for (const char* format : {"npz_deflated", "npz_stored"}) {
    ExpectRefused(format,
                  {{"cut", CutTo(zip, 80), {in_zip, {}, "no directory at its end"}},
                   {"empty", CutTo(zip, 0), {in_zip, {}, "no .npy file"}},
                   {"damaged data", flip(60), {in_zip, {}, "damaged data"}},
                   {"no directory",
                    Replace(zip, "PK\x01\x02", "PK\x01\x03"),
                    {in_zip, {}, "damaged directory"}},
                   {"another name",
                    [=](const fs::path& folder) {
                      std::string bytes = ReadFile(folder / zip);
                      bytes.replace(bytes.rfind("arr_0.npy"), 9, "arr_0.txt");
                      WriteFile(folder / zip, bytes);
                    },
                    {in_zip, {"0 arrays"}, "one named mask"}},
                   {"another method",
                    [=](const fs::path& folder) {
                      std::string bytes = ReadFile(folder / zip);
                      bytes[bytes.rfind("PK\x01\x02") + 10] = 12;
                      WriteFile(folder / zip, bytes);
                    },
                    {in_zip, {"method 12"}, "stored or deflated"}},
                   {"a huge member",
                    [=](const fs::path& folder) {
                      std::string bytes = ReadFile(folder / zip);
                      bytes.replace(bytes.rfind("PK\x01\x02") + 24, 4, "\xff\xff\xff\x7f");
                      WriteFile(folder / zip, bytes);
                    },
                    {in_zip, {"2147483647"}, "more than it can hold"}}});
  }
}

TEST(BadMasks, Pngs) {
  const std::string object = "masks/mug/0001.png";
  const auto grey = [](const std::string& file, int width, int height, uint8_t value) {
    return [=](const fs::path& folder) {
      std::vector<uint8_t> samples(static_cast<size_t>(width) * height, value);
      samples[0] = 255;
      WritePng(folder / file, width, height, 8, PNG_COLOR_TYPE_GRAY, samples);
    };
  };
  const std::string ball = "masks/ball/0002.png";
  ExpectRefused(
      "named_objects",
      {{"cut", CutTo(ball, 60), {"IN/" + ball, {}, "PNG ends within a chunk"}},
       {"empty", CutTo(ball, 0), {"IN/" + ball, {}, "no PNG file"}},
       {"three values", grey(ball, 24, 18, 7), {"IN/" + ball, {"255", "7"}, "one other value"}},
       {"another size",
        grey("masks/mug/0002.png", 48, 36, 0),
        {"IN/masks/mug/0002.png", {"48 x 36", "24 x 18"}, "same size"}},
       {"another shape",
        [&](const fs::path& folder) {
          for (const char* name : {"mug", "ball", "plant"}) {
            grey(std::string("masks/") + name + "/0001.png", 24, 24, 0)(folder);
          }
        },
        {"IN/masks/ball/0001.png", {"24 x 24", "24 x 18"}, "the same shape"}}});
  const std::string one = "masks/0002/1.png";
  const std::string table = "masks/0002/metadata.csv";
  ExpectRefused(
      "sam_folders",
      {{"a mask missing", Remove(one), {"IN/" + one, {}, "no such file"}},
       {"a mask cut", CutTo(one, 50), {"IN/" + one, {}, "PNG ends within a chunk"}},
       {"three values", grey(one, 24, 18, 3), {"IN/" + one, {"3"}, "one other value"}},
       {"another size", grey(one, 12, 9, 0), {"IN/" + one, {"12 x 9", "24 x 18"}, "same size"}},
       {"a row without number",
        Append(table, "x,1,2\n"),
        {"IN/" + table, {"line 5", "x"}, "number of another mask"}},
       {"a row twice",
        Append(table, "1,1,2\n"),
        {"IN/" + table, {"line 5", "1"}, "number of another mask"}},
       {"a negative row",
        Append(table, "-1,1,2\n"),
        {"IN/" + table, {"line 5", "-1"}, "number of another mask"}},
       {"a row too many", Append(table, "3,1,2\n"), {"IN/masks/0002/3.png", {}, "no such file"}}});
  const std::string of_class = "masks/SegmentationClass/cam/0001.png";
  const std::string of_object = "masks/SegmentationObject/cam/0001.png";
  const std::string map = "masks/labelmap.txt";
  ExpectRefused(
      "cvat",
      {{"no map", Remove(map), {"IN/" + map, {}, "no such file"}},
       {"a line without colour",
        Put(map, "mug\n"),
        {"IN/" + map, {"line 1", "mug"}, "a name with a colour"}},
       {"a colour of two",
        Put(map, "mug:1,2::\n"),
        {"IN/" + map, {"line 1"}, "a name with a colour"}},
       {"a large colour",
        Put(map, "mug:1,2,256::\n"),
        {"IN/" + map, {"line 1"}, "a name with a colour"}},
       {"a colour twice",
        Append(map, "cup:250,50,83::\n"),
        {"IN/" + map, {"line 6"}, "a name with a colour of its own"}},
       {"no name", Put(map, ":1,2,3::\n"), {"IN/" + map, {"line 1"}, "a name with a colour"}},
       {"a colour missing",
        Replace(map, "ball:50,183,250::\n", ""),
        {"IN/" + of_class, {"50,183,250"}, "does not name"}},
       {"no object", Remove(of_object), {"IN/" + of_object, {}, "no such file"}},
       {"no classes",
        [](const fs::path& folder) { fs::remove_all(folder / "masks/SegmentationClass"); },
        {"IN/masks/SegmentationClass", {}, "no such folder"}},
       {"classes cut", CutTo(of_class, 99), {"IN/" + of_class, {}, "PNG ends within a chunk"}},
       {"objects cut", CutTo(of_object, 99), {"IN/" + of_object, {}, "PNG ends within a chunk"}},
       {"another size", grey(of_object, 12, 9, 0), {"IN/" + of_object, {}, "another size"}}});
  const std::string frame = "masks/480p/kitchen/00001.png";
  ExpectRefused("davis_frames",
                {{"cut", CutTo(frame, 70), {"IN/" + frame, {}, "PNG ends within a chunk"}},
                 {"another shape",
                  grey(frame, 20, 20, 1),
                  {"IN/" + frame, {"20 x 20", "24 x 18"}, "the same shape"}},
                 {"numbers that differ",
                  [=](const fs::path& folder) {
                    fs::rename(folder / frame, folder / "masks/480p/kitchen/00077.png");
                    fs::remove(folder / "masks/480p/kitchen/00002.png");
                  },
                  {"IN/masks", {"0001"}, "none of the 2 masks"}}});
  ExpectRefused(
      "youtube_vos",
      {{"names cut",
        CutTo("masks/meta.json", 40),
        {"IN/masks/meta.json", {"40"}, "before its JSON does"}},
       {"no videos", Put("masks/meta.json", "{}"), {"IN/masks/meta.json", {"videos"}, "has no"}},
       {"no objects",
        Put("masks/meta.json", R"({"videos": {"a": {}}})"),
        {"IN/masks/meta.json", {"objects"}, "has no"}},
       {"no category",
        Put("masks/meta.json", R"({"videos": {"a": {"objects": {"1": {}}}}})"),
        {"IN/masks/meta.json", {"category"}, "has no"}},
       {"no id",
        Put("masks/meta.json", R"({"videos": {"a": {"objects": {"x": {"category": "a"}}}}})"),
        {"IN/masks/meta.json", {"objects"}, "no id"}}});
  ExpectRefused("deva",
                {{"names that are none",
                  Put("masks/labels.json", "{}"),
                  {"IN/masks/labels.json", {"\"labels\""}, "has no"}},
                 {"colours that are no ids",
                  [](const fs::path& folder) {
                    WriteFile(folder / "masks/pred.json", R"({"annotations": []})");
                    const std::vector<uint8_t> rgb(size_t{3} * 24 * 18, 9);
                    std::vector<uint8_t> colors = rgb;
                    colors[1] = 77;
                    WritePng(folder / "masks/cam/0001.png", 24, 18, 8, PNG_COLOR_TYPE_RGB, colors);
                  },
                  {"IN/masks/cam/0001.png", {"pred.json"}, "are no ids"}}});
}

TEST(BadMasks, Folders) {
  const auto empty = [](const fs::path& folder) {
    fs::remove_all(folder / "masks");
    fs::create_directories(folder / "masks");
  };
  ExpectRefused("deva",
                {{"no masks",
                  [](const fs::path& folder) { fs::remove_all(folder / "masks"); },
                  {"IN/masks", {}, "no such file or folder"}},
                 {"an empty folder", empty, {"IN/masks", {}, "no known mask format"}},
                 {"photos alone",
                  [=](const fs::path& folder) {
                    empty(folder);
                    WriteFile(folder / "masks/a.jpg", "x");
                  },
                  {"IN/masks", {}, "no known mask format"}},
                 {"no photos",
                  [](const fs::path& folder) { fs::remove_all(folder / "photos/cam"); },
                  {"IN/photos", {}, "no photos"}},
                 {"no folder of photos",
                  [](const fs::path& folder) { fs::remove_all(folder / "photos"); },
                  {"IN/photos", {}, "no such folder"}},
                 {"a damaged photo",
                  CutTo("photos/cam/0001.png", 20),
                  {"IN/photos/cam/0001.png", {}, "no readable image"}}});
}

// The last test of the file.
TEST(BadMasks, AreMany) { EXPECT_GE(num_cases, 150); }

}  // namespace
}  // namespace semfoam
