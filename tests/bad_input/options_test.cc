// SPDX-License-Identifier: GPL-3.0-or-later
//
// Bad options of training, renders, conversions and edits; bad .ini files.
#include "tools/support/output_lock.h"

#include "tests/bad_input/bad_options.h"

namespace semfoam {
namespace {

// Of all commands that cast rays.
TEST(Options, Devices) {
  std::vector<BadOptions> cases = {
      {"train", "--device|", {"", {"device", "''", "cuda:N"}, "from 0 on"}},
      {"train", "--device|cuda:-1", {"", {"device", "'cuda:-1'", "cuda:N"}, "from 0 on"}},
      {"meshes", "--device|cpu", {"", {"device"}, "unrecognised"}}};
  for (const char* command :
       {"segment", "train", "render", "film", "extract", "remove", "insert", "evaluate"}) {
    cases.push_back({command, "--device|gpu", {"", {"device", "'gpu'", "cuda:N"}, "from 0 on"}});
  }
  ExpectRefused(cases);
}

#ifndef SEMFOAM_HAS_MPI
TEST(Options, RanksWithoutMpi) {
  ExpectRefused({{"train", "--mpi|1", {"", {"mpi", "-DSEMFOAM_MPI=ON"}, "built without MPI"}}});
}
#endif

TEST(Options, Options) {
  ExpectRefused({
      // Training
      {"train", "--quality|best", {"", {"quality", "'best'"}, "is invalid"}},
      {"train", "--test_every|-8", {"", {"test_every", "-8"}, "or more"}},
      {"train", "--test_every|1", {"", {"test_every", "64 photos"}, "holds out all"}},
      {"train", "--FoamTraining.num_rays|0", {"", {"num_rays", "0"}, "must be greater than 0"}},
      {"train",
       "--FoamTraining.num_rays|9223372036854775808",
       {"", {"FoamTraining.num_rays", "'9223372036854775808'"}, "is invalid"}},
      {"train",
       "--FoamTraining.rays_per_iteration|0",
       {"", {"rays_per_iteration", "0"}, "must be from 1 to 16777216"}},
      {"train",
       "--FoamTraining.final_sites|3",
       {"", {"final_sites", "3"}, "must be from 64 to 268435456"}},
      {"train",
       "--FoamTraining.final_sites|99999999999",
       {"", {"FoamTraining.final_sites", "'99999999999'"}, "is invalid"}},
      {"train", "--FoamTraining.sh_degree|4", {"", {"sh_degree", "4"}, "must be from 0 to 3"}},
      {"train",
       "--FoamTraining.transmittance_cutoff|1",
       {"", {"transmittance_cutoff", "1"}, "must be greater than 0 and less than 1"}},
      {"train",
       "--FoamTraining.transmittance_cutoff|nan",
       {"", {"FoamTraining.transmittance_cutoff", "'nan'"}, "is invalid"}},
      {"train",
       "--FoamTraining.tv_weight|-1",
       {"", {"tv_weight", "-1"}, "must be from 0 to 1000000"}},
      {"train",
       "--FoamTraining.color_tv_weight|inf",
       {"", {"FoamTraining.color_tv_weight", "'inf'"}, "is invalid"}},
      {"train",
       "--FoamTraining.position_rate|-0.1",
       {"", {"position_rate", "-0.1"}, "must be from 0 to 1000000"}},
      {"train",
       "--FoamTraining.freeze_positions|2",
       {"", {"freeze_positions", "2"}, "must be from 0 to 1"}},
      {"train",
       "--FoamTraining.time_budget|-1",
       {"", {"time_budget", "-1"}, "must be a number of seconds"}},
      {"train",
       "--FoamTraining.time_budget|inf",
       {"", {"FoamTraining.time_budget", "'inf'"}, "is invalid"}},
      {"train",
       "--FoamTraining.max_image_size|-7",
       {"", {"max_image_size", "-7"}, "must be a number of pixels from 1 on"}},
      {"train",
       "--FoamTraining.label_zero|perhaps",
       {"", {"FoamTraining.label_zero", "'perhaps'"}, "is invalid"}},
      {"train", "--Masks.consistency|much", {"", {"Masks.consistency", "'much'"}, "is invalid"}},
      {"train", "--Effects.exposure|1", {"", {"Effects.exposure", "'1'"}, "is invalid"}},
      {"train", "--Effects.sh_degree|7", {"", {"Effects.sh_degree", "'7'"}, "is invalid"}},
      {"train", "--image_path|IN/a file", {"IN/a file", {"photos"}, "no such folder"}},
      {"train", "--image_path|IN/none", {"IN/none", {"photos"}, "no such folder"}},
      {"train", "--input_path|IN", {"IN", {}, "holds no COLMAP model"}},
      {"train", "--mask_path|IN/none", {"IN/none", {"mask"}, "no such folder"}},
      {"train", "--mask_path|IN/a file", {"IN/a file", {"mask"}, "no such folder"}},
      {"train", "--labels_path|IN/none", {"IN/none", {"\"labels\""}, "no such file"}},
      {"segment",
       "--workspace_path|IN/a file",
       {"IN/a file", {"images/", "sparse/"}, "no such folder"}},
      {"segment", "--formats|vdb,fbx", {"", {"formats", "'vdb,fbx'"}, "is invalid"}},
      {"segment", "--formats|om|--VolumeExport.nvdb|1", {"", {"nvdb", "formats"}, "no effect"}},
      {"segment",
       "--formats|vdb|--MeshExport.method|cells",
       {"", {"method", "formats"}, "no effect"}},
      {"analyze",
       "--mask_path|TABLETOP/segmentation_labels/masks/mug|--Masks.consistency|tracks",
       {"", {"consistency", "input_path"}, "no effect"}},
      {"label", "--mask_path|IN/none", {"IN/none", {"mask"}, "no such folder"}},
      // Renders, films, conversions
      {"render",
       "--views|IN/none|--input_path|TABLETOP/sparse",
       {"IN/none", {"views"}, "no such file"}},
      {"render", "--trajectory|orbit", {"IN/a.foam", {"trajectory"}, "has no photos"}},
      {"render", "--trajectory|zigzag", {"zigzag", {}, "no such file"}},
      {"render",
       "--trajectory|orbit|--frames|-1",
       {"", {"frames", "width", "0 to 16384"}, "0 to 100000"}},
      {"render",
       "--trajectory|orbit|--width|-1",
       {"", {"frames", "width", "0 to 16384"}, "0 to 100000"}},
      {"render",
       "--input_path|TABLETOP/sparse|--frames|24",
       {"", {"frames", "trajectory"}, "no effect"}},
      {"render",
       "--input_path|TABLETOP/sparse|--width|64",
       {"", {"width", "trajectory"}, "no effect"}},
      {"render", "--trajectory|orbit|--views|test", {"", {"views", "trajectory"}, "no effect"}},
      {"render",
       "--object|nobody|--trajectory|orbit",
       {"", {"'nobody'", "7 (mug)"}, "is no object"}},
      {"render",
       "--preview|1|--input_path|TABLETOP/sparse",
       {"", {"preview", "image_path"}, "needs the photos"}},
      {"film", "--between|101", {"", {"between", "101"}, "0 to 100"}},
      {"film", "--order|best", {"", {"order", "'best'"}, "is invalid"}},
      {"film",
       "--manifest_path|IN/a file",
       {"", {"foam_path", "manifest_path", "mask_path"}, "to make a film"}},
      {"film",
       "--foam_path||--manifest_path|IN/a file|--mask_path|IN|--order|name",
       {"", {"order", "foam_path"}, "no effect"}},
      {"film",
       "--foam_path||--manifest_path|IN/a file|--mask_path|IN|--image_path|IN",
       {"", {"image_path", "foam_path"}, "no effect"}},
      {"film", "", {"IN/a.foam", {"film"}, "has no photos"}},
      {"convert", "--output_type|stl", {"", {"output_type", "'stl'"}, "is invalid"}},
      {"convert", "--splat_scale|0", {"", {"splat_scale", "0"}, "0.1 to 10"}},
      {"convert", "--splat_scale|2", {"", {"splat_scale", "text"}, "no effect"}},
      {"convert", "--labels|mug", {"", {"labels", "text"}, "whole foam"}},
      {"convert",
       "--labels|nobody|--output_type|splats",
       {"", {"'nobody'", "7 (mug)"}, "is no object"}},
      {"convert", "--input_path|IN/none.foam", {"IN/none.foam", {}, "no such file"}},
      {"convert",
       "--output_path|IN/b.xyz",
       {"IN/b.xyz", {"output_type"}, "does not say what to write"}},
      {"evaluate", "--image_path|IN/none", {"IN/a.foam", {"test_every"}, "held out"}},
      // Objects
      {"extract", "", {"", {"labels", "pick"}, "no object is named"}},
      {"extract", "--labels|nobody", {"", {"'nobody'", "7 (mug)"}, "is no object"}},
      {"extract", "--labels|,", {"", {"''", "7 (mug)"}, "is no object"}},
      {"extract", "--labels|4294967297", {"", {"'4294967297'", "7 (mug)"}, "is no object"}},
      {"extract", "--pick|a.jpg", {"", {"pick", "'a.jpg'"}, "is invalid"}},
      {"extract", "--pick|a.jpg,1,2", {"IN/a.foam", {"a.jpg"}, "has no photo"}},
      {"extract", "--labels|1|--pick|a.jpg,1,2", {"", {"labels", "pick"}, "both"}},
      {"remove", "--labels|-1", {"", {"'-1'", "7 (mug)"}, "is no object"}},
      {"insert", "--labels|nobody", {"", {"'nobody'", "7 (mug)"}, "is no object"}},
      {"insert", "--scale|0", {"", {"scale", "0"}, "must be from 1e-6 to 1e6"}},
      {"insert", "--scale|inf", {"", {"scale", "'inf'"}, "is invalid"}},
      {"insert", "--translation|1,2", {"", {"translation", "'1,2'"}, "is invalid"}},
      {"insert", "--translation|1,2,nan", {"", {"translation", "'1,2,nan'"}, "is invalid"}},
      {"insert", "--rotation|a,b,c", {"", {"rotation", "'a,b,c'"}, "is invalid"}},
      {"insert", "--align_to|a.jpg", {"", {"align_to", "'a.jpg'"}, "is invalid"}},
      {"insert", "--object_path|IN/none.foam", {"IN/none.foam", {}, "no such file"}},
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
    EXPECT_THAT(SentenceOf({command, options, {}}, folder),
                NamesMistake("IN/out", {}, "another process is writing"))
        << command;
  }
  EXPECT_TRUE(std::filesystem::is_empty(temp / "out"));
}

// .ini files, as --project_path takes them.
TEST(Options, ProjectFiles) {
  const auto put = [](const std::string& text) { return Put("a.ini", text); };
  const std::vector<BadInput> cases = {
      {"a pipe", MakePipe("a.ini"), {"IN/a.ini", {}, "is a pipe"}},
      {"a device", MakeDevice("a.ini"), {"IN/a.ini", {}, "is a device"}},
      {"a stray word", put("foam_path=a\njust words\n"), {"IN/a.ini", {"line 2"}, "is neither"}},
      {"an open group", put("[VolumeExport\n"), {"IN/a.ini", {"line 1"}, "is neither"}},
      {"unknown option",
       put("nosuch=1\n"),
       {"IN/a.ini", {"'nosuch'", "volume_exporter"}, "does not have"}},
      {"unknown group",
       put("[Volume]\nvoxel_size=1\n"),
       {"IN/a.ini", {"'Volume.voxel_size'", "volume_exporter"}, "does not have"}},
      {"same option twice",
       put("voxel_size=1\nvoxel_size=1\n"),
       {"IN/a.ini", {"voxel_size"}, "more than once"}},
      {"same option twice, by two names",
       put("voxel_size=1\n[VolumeExport]\nvoxel_size=1\n"),
       {"IN/a.ini", {"VolumeExport.voxel_size"}, "more than once"}},
      {"no value",
       put("foam_path=a\noutput_path=b\n[VolumeExport]\nvoxel_size=\n"),
       {"IN/a.ini", {"VolumeExport.voxel_size", "''"}, "is invalid"}},
      {"no number",
       put("foam_path=a\noutput_path=b\n[VolumeExport]\nvoxel_size=small\n"),
       {"IN/a.ini", {"VolumeExport.voxel_size", "'small'"}, "is invalid"}},
      {"nan",
       put("foam_path=a\noutput_path=b\n[VolumeExport]\nvoxel_size=nan\n"),
       {"IN/a.ini", {"VolumeExport.voxel_size", "'nan'"}, "is invalid"}},
      {"beyond 32 bits",
       put("num_threads=4294967297\n"),
       {"IN/a.ini", {"num_threads", "'4294967297'"}, "is invalid"}},
      {"required and empty",
       put("foam_path=\noutput_path=b\n"),
       {"IN/a.ini", {"foam_path", "''"}, "is invalid"}},
      {"required and missing",
       put("\xEF\xBB\xBF# nothing\r\n"),
       {"", {"foam_path"}, "required but missing"}},
      {"another project",
       put("project_path=b.ini\n"),
       {"IN/a.ini", {"'project_path'", "volume_exporter"}, "does not have"}},
      {"a NUL in a value",
       put("foam_path=a\noutput_path=b\n[VolumeExport]\nvoxel_size=1" + std::string(1, '\0') +
           "\n"),
       {"IN/a.ini", {"VolumeExport.voxel_size", "'1\\x00'"}, "is invalid"}},
      {"no option before =",
       put("= 3\n"),
       {"IN/a.ini", {"''", "volume_exporter"}, "does not have"}},
      {"very long value",
       put("foam_path=a\noutput_path=b\n[VolumeExport]\nvoxel_size=" + std::string(100'000, '9') +
           "\n"),
       {"IN/a.ini",
        {"VolumeExport.voxel_size",
         "'999999999999999999999999999999999999999999999999999999999999...'"},
        "is invalid"}},
      {"very long line",
       put(std::string(100'000, 'x') + "\n"),
       {"IN/a.ini", {"line 1"}, "is neither"}},
      {"control characters",
       put("\x1b[2Jvoxel_size=1\n"),
       {"IN/a.ini", {"'\\x1b[2Jvoxel_size'", "volume_exporter"}, "does not have"}},
  };
  ExpectMistakes(cases, Put("a.ini", ""), [](const std::filesystem::path& f) {
    std::string project = (f / "a.ini").string();
    std::string words[] = {"volume_exporter", "--project_path", project};
    char* argv[] = {words[0].data(), words[1].data(), words[2].data()};
    RunVolumeExporter(3, argv);
  });
}

}  // namespace
}  // namespace semfoam
