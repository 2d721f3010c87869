// SPDX-License-Identifier: GPL-3.0-or-later
//
// Bad options of training, renders, conversions and edits; bad .ini files.
#include "tools/support/output_lock.h"

#include "tests/bad_input/bad_options.h"

namespace semfoam {
namespace {

// Of all commands that cast rays.
TEST(Options, Devices) {
  const std::string invalid =
      "for option '--device' is invalid; it takes auto, cpu or cuda:N, the GPU of that "
      "number from 0 on.";
  std::vector<BadOptions> cases = {
      {"train", "--device|", "Failed to parse options - the argument ('') " + invalid},
      {"train",
       "--device|cuda:-1",
       "Failed to parse options - the argument ('cuda:-1') " + invalid},
      {"meshes", "--device|cpu", "Failed to parse options - unrecognised option '--device'."}};
  for (const char* command :
       {"segment", "train", "render", "film", "extract", "remove", "insert", "evaluate"}) {
    cases.push_back(
        {command, "--device|gpu", "Failed to parse options - the argument ('gpu') " + invalid});
  }
  ExpectRefused(cases);
}

TEST(Options, Options) {
  ExpectRefused({
      // Training
      {"train",
       "--quality|best",
       "Failed to parse options - the argument ('best') for option '--quality' is invalid; it "
       "takes {low, medium, high, extreme}."},
      {"train",
       "--test_every|-8",
       "test_every -8: 0 (train on all photos) or more would be right."},
      {"train",
       "--test_every|1",
       "test_every 1: holds out all of the 64 photos and leaves none to train on; 0 would train "
       "on all."},
      {"train",
       "--FoamTraining.num_rays|0",
       "Failed to parse options - --FoamTraining.num_rays is 0; it must be greater than 0."},
      {"train",
       "--FoamTraining.num_rays|9223372036854775808",
       "Failed to parse options - the argument ('9223372036854775808') for option "
       "'--FoamTraining.num_rays' is invalid; it takes an integer."},
      {"train",
       "--FoamTraining.rays_per_iteration|0",
       "Failed to parse options - --FoamTraining.rays_per_iteration is 0; it must be from 1 to "
       "16777216."},
      {"train",
       "--FoamTraining.final_sites|3",
       "Failed to parse options - --FoamTraining.final_sites is 3; it must be from 64 to "
       "268435456."},
      {"train",
       "--FoamTraining.final_sites|99999999999",
       "Failed to parse options - the argument ('99999999999') for option "
       "'--FoamTraining.final_sites' is invalid; it takes an integer."},
      {"train",
       "--FoamTraining.sh_degree|4",
       "Failed to parse options - --FoamTraining.sh_degree is 4; it must be from 0 to 3."},
      {"train",
       "--FoamTraining.transmittance_cutoff|1",
       "Failed to parse options - --FoamTraining.transmittance_cutoff is 1; it must be greater "
       "than 0 and less than 1."},
      {"train",
       "--FoamTraining.transmittance_cutoff|nan",
       "Failed to parse options - the argument ('nan') for option "
       "'--FoamTraining.transmittance_cutoff' is invalid; it takes a number."},
      {"train",
       "--FoamTraining.tv_weight|-1",
       "Failed to parse options - --FoamTraining.tv_weight is -1; it must be from 0 to 1000000."},
      {"train",
       "--FoamTraining.position_rate|-0.1",
       "Failed to parse options - --FoamTraining.position_rate is -0.1; it must be from 0 to "
       "1000000."},
      {"train",
       "--FoamTraining.freeze_positions|2",
       "Failed to parse options - --FoamTraining.freeze_positions is 2; it must be from 0 to 1."},
      {"train",
       "--FoamTraining.time_budget|-1",
       "Failed to parse options - --FoamTraining.time_budget is -1; it must be a number of "
       "seconds, or 0 for none."},
      {"train",
       "--FoamTraining.time_budget|inf",
       "Failed to parse options - the argument ('inf') for option '--FoamTraining.time_budget' is "
       "invalid; it takes a number."},
      {"train",
       "--FoamTraining.max_image_size|-7",
       "Failed to parse options - --FoamTraining.max_image_size is -7; it must be a number of "
       "pixels from 1 on, or -1 for photos as they are."},
      {"train",
       "--FoamTraining.label_zero|perhaps",
       "Failed to parse options - the argument ('perhaps') for option '--FoamTraining.label_zero' "
       "is invalid; it takes {auto, ignore, class}."},
      {"train",
       "--Masks.consistency|much",
       "Failed to parse options - the argument ('much') for option '--Masks.consistency' is "
       "invalid; it takes {auto, off, tracks, independent}."},
      {"train",
       "--Effects.exposure|1",
       "Failed to parse options - the argument ('1') for option '--Effects.exposure' is invalid; "
       "it takes {auto, on, off}."},
      {"train",
       "--Effects.sh_degree|7",
       "Failed to parse options - the argument ('7') for option '--Effects.sh_degree' is invalid; "
       "it takes {auto, on}."},
      {"train",
       "--image_path|IN/a file",
       "IN/a file: there is no such folder; it should hold the photos of the model."},
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
       "--mask_path|IN/a file",
       "IN/a file: there is no such folder; it should hold a PNG mask for each photo."},
      {"train",
       "--labels_path|IN/none",
       "IN/none: there is no such file; {\"labels\": {\"7\": \"mug\"}} should be in it."},
      {"segment",
       "--workspace_path|IN/a file",
       "IN/a file: there is no such folder; --workspace_path takes the folder that holds images/ "
       "and sparse/."},
      {"segment",
       "--formats|vdb,fbx",
       "Failed to parse options - the argument ('vdb,fbx') for option '--formats' is invalid; it "
       "takes any of vdb,om,ply,obj,glb,usda, apart by commas."},
      {"segment",
       "--formats|om|--VolumeExport.nvdb|1",
       "Failed to parse options - --VolumeExport.nvdb has no effect without vdb among the "
       "--formats; add it, or leave this out."},
      {"segment",
       "--formats|vdb|--MeshExport.method|smooth",
       "Failed to parse options - --MeshExport.method has no effect without a mesh's format among "
       "the --formats; add it, or leave this out."},
      {"analyze",
       "--mask_path|TABLETOP/segmentation_labels/masks/mug|--Masks.consistency|tracks",
       "Failed to parse options - --Masks.consistency has no effect without the COLMAP model; give "
       "--input_path too, or leave it out."},
      {"label",
       "--mask_path|IN/none",
       "IN/none: there is no such folder; it should hold a PNG mask for each photo."},
      // Renders, films, conversions
      {"render",
       "--views|IN/none|--input_path|TABLETOP/sparse",
       "IN/none: there is no such file, where what --views takes (all, train, test or a file with "
       "one name a line) should be."},
      {"render",
       "--trajectory|orbit",
       "IN/a.foam: has no photos, so nothing says from where to look; a trajectory from a JSON "
       "file "
       "would be right."},
      {"render",
       "--trajectory|zigzag",
       "zigzag: there is no such file, where a trajectory (orbit, spiral or a JSON file) should "
       "be."},
      {"render",
       "--trajectory|orbit|--frames|-1",
       "Failed to parse options - --frames 0 to 100000 and --width 0 to 16384 would be right."},
      {"render",
       "--trajectory|orbit|--width|-1",
       "Failed to parse options - --frames 0 to 100000 and --width 0 to 16384 would be right."},
      {"render",
       "--input_path|TABLETOP/sparse|--frames|24",
       "Failed to parse options - --frames has no effect without --trajectory; give both, or "
       "neither."},
      {"render",
       "--input_path|TABLETOP/sparse|--width|64",
       "Failed to parse options - --width has no effect without --trajectory; give both, or "
       "neither."},
      {"render",
       "--trajectory|orbit|--views|test",
       "Failed to parse options - --views has no effect with --trajectory; give one of the two."},
      {"render",
       "--object|nobody|--trajectory|orbit",
       "The labels name 'nobody', which is no object; the scene has 7 (mug), 8 "
       "(label_8)."},
      {"render",
       "--preview|1|--input_path|TABLETOP/sparse",
       "Failed to parse options - --preview 1 needs the photos' folder, --image_path, and views, "
       "no trajectory."},
      {"film",
       "--between|101",
       "Failed to parse options - --between 101: 0 to 100 would be right."},
      {"film",
       "--order|best",
       "Failed to parse options - the argument ('best') for option '--order' is invalid; it takes "
       "{auto, name, path}."},
      {"film",
       "--manifest_path|IN/a file",
       "Failed to parse options - give --foam_path to make a film, or --manifest_path and "
       "--mask_path to bring a tracker's masks back."},
      {"film",
       "--foam_path||--manifest_path|IN/a file|--mask_path|IN|--order|name",
       "Failed to parse options - --order has no effect on a film that is made; give it with "
       "--foam_path, or leave it out."},
      {"film",
       "--foam_path||--manifest_path|IN/a file|--mask_path|IN|--image_path|IN",
       "Failed to parse options - --image_path has no effect on a film that is made; give it with "
       "--foam_path, or leave it out."},
      {"film", "", "IN/a.foam: has no photos, so there is nothing to make a film of."},
      {"convert",
       "--output_type|stl",
       "Failed to parse options - the argument ('stl') for option '--output_type' is invalid; it "
       "takes {auto, foam, radiant_foam, splats, points, text}."},
      {"convert",
       "--splat_scale|0",
       "Failed to parse options - --splat_scale 0: 0.1 to 10 would be right."},
      {"convert",
       "--splat_scale|2",
       "Failed to parse options - --splat_scale has no effect on text; leave it out, or write "
       "splats."},
      {"convert",
       "--labels|mug",
       "Failed to parse options - --labels chooses splats and points; text takes the whole foam."},
      {"convert",
       "--labels|nobody|--output_type|splats",
       "The labels name 'nobody', which is no object; the scene has 7 (mug), 8 "
       "(label_8)."},
      {"convert",
       "--input_path|IN/none.foam",
       "IN/none.foam: there is no such file, where a foam model such as foam_trainer's scene.foam "
       "should be."},
      {"convert",
       "--output_path|IN/b.xyz",
       "IN/b.xyz: its name does not say what to write; --output_type radiant_foam, splats or "
       "points for a .ply, or a name that ends in .foam or .txt."},
      {"evaluate",
       "--image_path|IN/none",
       "IN/a.foam: no photo was held out of this training, so there is nothing to score it on; "
       "train with --test_every 8."},
      // Objects
      {"extract",
       "",
       "Failed to parse options - no object is named; give either --labels (as mug,7) or --pick "
       "(IMAGE,x,y)."},
      {"extract",
       "--labels|nobody",
       "The labels name 'nobody', which is no object; the scene has 7 (mug), 8 "
       "(label_8)."},
      {"extract",
       "--labels|,",
       "The labels name '', which is no object; the scene has 7 (mug), 8 (label_8)."},
      {"extract",
       "--labels|4294967297",
       "The labels name '4294967297', which is no object; the scene has 7 (mug), 8 "
       "(label_8)."},
      {"extract",
       "--pick|a.jpg",
       "Failed to parse options - the argument ('a.jpg') for option '--pick' is invalid; it takes "
       "a photo's name and a pixel, IMAGE,x,y."},
      {"extract", "--pick|a.jpg,1,2", "IN/a.foam: has no photo a.jpg; it has none at all."},
      {"extract",
       "--labels|1|--pick|a.jpg,1,2",
       "Failed to parse options - both --labels and --pick; give either --labels (as mug,7) or "
       "--pick (IMAGE,x,y)."},
      {"remove",
       "--labels|-1",
       "The labels name '-1', which is no object; the scene has 7 (mug), 8 (label_8)."},
      {"insert",
       "--labels|nobody",
       "The labels name 'nobody', which is no object; the scene has 7 (mug), 8 "
       "(label_8)."},
      {"insert",
       "--scale|0",
       "Failed to parse options - --scale is 0; it must be from 1e-6 to 1e6."},
      {"insert",
       "--scale|inf",
       "Failed to parse options - the argument ('inf') for option '--scale' is invalid; it takes a "
       "number."},
      {"insert",
       "--translation|1,2",
       "Failed to parse options - the argument ('1,2') for option '--translation' is invalid; it "
       "takes three numbers, x,y,z."},
      {"insert",
       "--translation|1,2,nan",
       "Failed to parse options - the argument ('1,2,nan') for option '--translation' is invalid; "
       "it takes three numbers, x,y,z."},
      {"insert",
       "--rotation|a,b,c",
       "Failed to parse options - the argument ('a,b,c') for option '--rotation' is invalid; it "
       "takes three numbers, x,y,z."},
      {"insert",
       "--align_to|a.jpg",
       "Failed to parse options - the argument ('a.jpg') for option '--align_to' is invalid; it "
       "takes a photo's name and a pixel, IMAGE,x,y."},
      {"insert",
       "--object_path|IN/none.foam",
       "IN/none.foam: there is no such file, where a foam model such as foam_trainer's scene.foam "
       "should be."},
  });
}

// Every command that writes into a folder, while another one writes there.
TEST(Options, ASecondWriter) {
  const TempFolder temp;
  WriteModel(temp / "a.foam", TouchingBalls(300));
  const std::string folder = temp.path().string();
  const OutputLock first(temp / "out");
  for (const auto& [command, options] : std::map<std::string, std::string>{
           {"segment", ""},
           {"train", ""},
           {"effects", ""},
           {"profile", ""},
           {"plot", ""},
           {"volumes", ""},
           {"meshes", ""},
           {"render", "--input_path|TABLETOP/sparse"},
           {"extract", "--labels|mug"},
           {"remove", "--labels|mug"},
           {"insert", ""},
           {"film", ""},
           {"evaluate", "--maps_path|IN/out"},
           {"label", ""},
           {"analyze", "--workspace_path|TABLETOP"},
       }) {
    EXPECT_EQ(SentenceOf({command, options, ""}, folder),
              "IN/out: another process is writing into this folder; wait for its end, or choose "
              "another.")
        << command;
  }
  EXPECT_TRUE(std::filesystem::is_empty(temp / "out"));
}

// .ini files, as --project_path takes them.
TEST(Options, ProjectFiles) {
  const auto put = [](const std::string& text) { return Put("a.ini", text); };
  const std::vector<BadInput> cases = {
      {"a pipe",
       MakePipe("a.ini"),
       "IN/a.ini: is a pipe, where an .ini file for --project_path should be."},
      {"a device",
       MakeDevice("a.ini"),
       "IN/a.ini: is a device, where an .ini file for --project_path should be."},
      {"a stray word",
       put("foam_path=a\njust words\n"),
       "IN/a.ini: line 2 is neither 'option = value' nor '[Group]' nor a comment that begins with "
       "'#' or ';'."},
      {"an open group",
       put("[VolumeExport\n"),
       "IN/a.ini: line 1 is neither 'option = value' nor '[Group]' nor a comment that begins with "
       "'#' or ';'."},
      {"unknown option",
       put("nosuch=1\n"),
       "IN/a.ini: holds the option 'nosuch', which the command volume_exporter does not have; "
       "`semfoam volume_exporter -h` lists those it has."},
      {"unknown group",
       put("[Volume]\nvoxel_size=1\n"),
       "IN/a.ini: holds the option 'Volume.voxel_size', which the command volume_exporter does not "
       "have; `semfoam volume_exporter -h` lists those it has."},
      {"same option twice",
       put("voxel_size=1\nvoxel_size=1\n"),
       "IN/a.ini: gives the option 'voxel_size' more than once; give it once."},
      {"same option twice, by two names",
       put("voxel_size=1\n[VolumeExport]\nvoxel_size=1\n"),
       "IN/a.ini: gives the option 'VolumeExport.voxel_size' more than once; give it once."},
      {"no value",
       put("foam_path=a\noutput_path=b\n[VolumeExport]\nvoxel_size=\n"),
       "IN/a.ini: the argument ('') for option '--VolumeExport.voxel_size' is invalid; it takes a "
       "number."},
      {"no number",
       put("foam_path=a\noutput_path=b\n[VolumeExport]\nvoxel_size=small\n"),
       "IN/a.ini: the argument ('small') for option '--VolumeExport.voxel_size' is invalid; it "
       "takes a number."},
      {"nan",
       put("foam_path=a\noutput_path=b\n[VolumeExport]\nvoxel_size=nan\n"),
       "IN/a.ini: the argument ('nan') for option '--VolumeExport.voxel_size' is invalid; it takes "
       "a number."},
      {"beyond 32 bits",
       put("num_threads=4294967297\n"),
       "IN/a.ini: the argument ('4294967297') for option '--num_threads' is invalid; it takes an "
       "integer."},
      {"required and empty",
       put("foam_path=\noutput_path=b\n"),
       "IN/a.ini: the argument ('') for option '--foam_path' is invalid; it takes what is not "
       "empty."},
      {"required and missing",
       put("\xEF\xBB\xBF# nothing\r\n"),
       "Failed to parse options - the option '--foam_path' is required but missing."},
      {"another project",
       put("project_path=b.ini\n"),
       "IN/a.ini: holds the option 'project_path', which the command volume_exporter does not "
       "have; `semfoam volume_exporter -h` lists those it has."},
      {"a NUL in a value",
       put("foam_path=a\noutput_path=b\n[VolumeExport]\nvoxel_size=1" + std::string(1, '\0') +
           "\n"),
       "IN/a.ini: the argument ('1\\x00') for option '--VolumeExport.voxel_size' is invalid; it "
       "takes a number."},
      {"no option before =",
       put("= 3\n"),
       "IN/a.ini: holds the option '', which the command volume_exporter does not have; `semfoam "
       "volume_exporter -h` lists those it has."},
      {"very long value",
       put("foam_path=a\noutput_path=b\n[VolumeExport]\nvoxel_size=" + std::string(100'000, '9') +
           "\n"),
       "IN/a.ini: the argument ('999999999999999999999999999999999999999999999999999999999999...') "
       "for option '--VolumeExport.voxel_size' is invalid; it takes a number."},
      {"very long line",
       put(std::string(100'000, 'x') + "\n"),
       "IN/a.ini: line 1 is neither 'option = value' nor '[Group]' nor a comment that begins with "
       "'#' or ';'."},
      {"control characters",
       put("\x1b[2Jvoxel_size=1\n"),
       "IN/a.ini: holds the option '\\x1b[2Jvoxel_size', which the command volume_exporter does "
       "not have; `semfoam volume_exporter -h` lists those it has."},
  };
  ExpectSentences(cases, Put("a.ini", ""), [](const std::filesystem::path& f) {
    std::string project = (f / "a.ini").string();
    std::string words[] = {"volume_exporter", "--project_path", project};
    char* argv[] = {words[0].data(), words[1].data(), words[2].data()};
    RunVolumeExporter(3, argv);
  });
}

}  // namespace
}  // namespace semfoam
