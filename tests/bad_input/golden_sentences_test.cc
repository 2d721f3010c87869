// SPDX-License-Identifier: GPL-3.0-or-later
//
// The messages of frequent mistakes, whole, so that their style is under test: the file first, then
// what is wrong, then what would be right. All other tests assert what a message tells, not how
// (tests/mistake.h).
#include "plugin/colmap/colmap_model_formats.h"
#include "plugin/mask/mask_png.h"
#include "plugin/mask/mask_tables.h"
#include "plugin/mask/masked_photos.h"
#include "plugin/photo/photo.h"
#include "tools/evaluation/mesh_distance.h"
#include "tools/support/output_lock.h"

#include "tests/bad_input/bad_options.h"
#include "tests/plugin/colmap/small_model.h"

namespace semfoam {
namespace {

namespace fs = std::filesystem;

struct GoldenRefusal {
  std::string command;
  std::string options;  // as in BadOptions
  std::string sentence;
};

TEST(GoldenSentences, OfCommands) {
  const std::vector<GoldenRefusal> cases = {
      {"segment",
       "--workspace_path|IN/none",
       "IN/none: there is no such folder; --workspace_path takes the folder that holds images/ and "
       "sparse/."},
      {"train",
       "--image_path|IN/none",
       "IN/none: there is no such folder; it should hold the photos of the model."},
      {"train",
       "--input_path|IN",
       "IN: holds no COLMAP model; cameras, images and points3D, all as .bin or all as .txt, "
       "should be there."},
      {"train",
       "--mask_path|IN/none",
       "IN/none: there is no such folder; it should hold a PNG mask for each photo."},
      {"train",
       "--quality|best",
       "Failed to parse options - the argument ('best') for option '--quality' is invalid; it "
       "takes {low, medium, high, extreme}."},
      {"train",
       "--FoamTraining.num_rays|0",
       "Failed to parse options - --FoamTraining.num_rays is 0; it must be greater than 0."},
      {"train",
       "--output_path|IN/trained",
       "IN/trained/scene.foam: holds a trained foam; --overwrite 1 to replace it and its "
       "exports, or another --output_path, would be right."},
      {"volumes", "--nosuch|1", "Failed to parse options - unrecognised option '--nosuch'."},
      {"volumes",
       "stray",
       "Failed to parse options - 'stray' stands where an option was expected; options are written "
       "'--name value'."},
      {"volumes",
       "--voxel_size",
       "Failed to parse options - the required argument for option '--voxel_size' is missing."},
      {"volumes",
       "--voxel_size|small",
       "Failed to parse options - the argument ('small') for option '--VolumeExport.voxel_size' is "
       "invalid; it takes a number."},
      {"volumes",
       "--voxel_size|0.1|--voxel_size|0.1",
       "Failed to parse options - the option '--voxel_size' is given more than once; give it "
       "once."},
      {"volumes",
       "--voxel_size|0.1|--max_resolution|64",
       "Failed to parse options - --VolumeExport.max_resolution has no effect with "
       "--VolumeExport.voxel_size; give one of the two."},
      {"volumes",
       "--foam_path|IN/none.foam",
       "IN/none.foam: there is no such file, where a foam model such as foam_trainer's scene.foam "
       "should be."},
      {"volumes",
       "--foam_path|IN/a file",
       "IN/a file: this is not a foam model; foam_trainer writes one named scene.foam."},
      {"volumes",
       "--foam_path|IN/cut.foam",
       "IN/cut.foam: it is damaged or cut (its checksum does not match); copy it again."},
      {"volumes",
       "--output_path|IN/a file/out",
       "IN/a file/out: this folder cannot be made (Not a directory); choose an output path that "
       "you may write to."},
      {"volumes",
       "--output_path|IN/locked",
       "IN/locked: another process is writing into this folder; wait for its end, or choose "
       "another."},
      {"meshes",
       "--formats|stl",
       "Failed to parse options - the argument ('stl') for option '--formats' is invalid; it takes "
       "any of om,ply,obj,glb,usda, apart by commas."},
      {"extract",
       "--labels|nobody",
       "The labels name 'nobody', which is no object; the scene has 7 (mug), 8 (label_8)."},
  };
  const TempFolder temp;
  const std::string folder = temp.path().string();
  const Model model = TouchingBalls(300);
  WriteModel(temp / "a.foam", model);
  WriteModel(temp / "cut.foam", model);
  CutTo("cut.foam", 1000)(temp.path());
  fs::create_directory(temp / "trained");
  WriteModel(temp / "trained" / "scene.foam", model);
  WriteFile(temp / "a file", "in the way, and no foam, though it is as long as one could be\n");
  const OutputLock lock(temp / "locked");
  for (const GoldenRefusal& golden : cases) {
    const std::string sentence = SentenceOf({golden.command, golden.options, {}}, folder);
    EXPECT_EQ(sentence, golden.sentence);
    EXPECT_THAT(sentence, IsOneSentence());
  }
}

struct GoldenInput {
  ForFolder spoil;
  ForFolder read;
  std::string sentence;
};

TEST(GoldenSentences, OfFiles) {
  const ForFolder model = [](const fs::path& f) { ReadReconstruction(f); };
  const ForFolder photo = [](const fs::path& f) { ReadPhoto(f / "a.png"); };
  const ForFolder jpeg = [](const fs::path& f) { ReadPhoto(f / "a.jpg"); };
  const ForFolder mask = [](const fs::path& f) { ReadMaskPng(f / "a.png"); };
  const ForFolder labels = [](const fs::path& f) { ReadLabelNames(f / "labels.json"); };
  const std::vector<GoldenInput> cases = {
      {Remove("points3D.bin"),
       model,
       "IN/points3D.bin: is missing, while cameras.bin is there; is the copy of the COLMAP model "
       "complete?"},
      {CutTo("cameras.bin", 31),
       model,
       "IN/cameras.bin: ends at byte 31, camera 1 of 2 needs 1 more bytes; is the copy complete?"},
      {Remove("a.png"), photo, "IN/a.png: there is no such file, where a photo should be."},
      {Put("a.png", "no picture at all\n"),
       photo,
       "IN/a.png: is no readable image (Not a PNG file); a photo, such as a JPEG or PNG, would be "
       "right."},
      {CutTo("a.jpg", 5000),
       jpeg,
       "IN/a.jpg: cannot be decoded completely (JPEG error: Premature end of JPEG file "
       "(\"IN/a.jpg\")); is the copy complete?"},
      {Put("a.png", "no picture at all\n"),
       mask,
       "IN/a.png: is no PNG file, where a mask of object ids should be."},
      {CutTo("a.png", 50),
       photo,
       "IN/a.png: cannot be decoded completely (the PNG ends within a chunk); is the copy "
       "complete?"},
      {Put("masks/other.png", "a mask"),
       [](const fs::path& f) { PairMasks(f / "masks", {"a.jpg"}); },
       "IN/masks: none of the 1 masks has the name of a photo; a.png would be right for a.jpg."},
      {Put("labels.json", "labels: 7 = mug"),
       labels,
       "IN/labels.json: is no valid JSON from byte 1 of 15 on; a complete JSON file would be "
       "right."},
      {Put("labels.json", "{\"labels\": {\"mug\": \"7\"}}"),
       labels,
       "IN/labels.json: the label \"mug\" is not as in {\"labels\": {\"7\": \"mug\"}}, an id with "
       "a "
       "name."},
      {Put("a.obj", "no mesh\n"),
       [](const fs::path& f) { ReadTriangleMesh(f / "a.obj"); },
       "IN/a.obj: cannot be read as a mesh; .obj, .ply, .off, .stl and .om files can, where they "
       "are complete."},
  };
  const ForFolder prepare = [](const fs::path& folder) {
    WriteReconstruction(folder, SmallModel(true), ModelFormat::kBinary);
    WritePng(folder / "a.png", 8, 6, 8, PNG_COLOR_TYPE_GRAY, std::vector<uint8_t>(48, 1));
    fs::copy_file(SEMFOAM_TEST_DATA "/tabletop/images/0000.jpg", folder / "a.jpg");
  };
  for (const GoldenInput& golden : cases) {
    const std::string sentence = SentenceFor(golden.spoil, prepare, golden.read);
    EXPECT_EQ(sentence, golden.sentence);
    EXPECT_THAT(sentence, IsOneSentence());
  }
}

}  // namespace
}  // namespace semfoam
