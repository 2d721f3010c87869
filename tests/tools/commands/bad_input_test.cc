// SPDX-License-Identifier: GPL-3.0-or-later
//
// What a user can get wrong: one sentence that names the file, exit code 1, and nothing left
// behind.
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "tests/tools/peak_memory.h"
#include "tests/tools/program.h"
#include <OpenImageIO/imageio.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

void Cut(const fs::path& path, double share) {
  fs::resize_file(path, static_cast<uintmax_t>(share * static_cast<double>(fs::file_size(path))));
}

// Lets the file claim 2^40 records.
void Overcount(const fs::path& path) {
  std::string bytes = ReadFile(path);
  bytes.replace(0, 8, std::string("\0\0\0\0\0\1\0\0", 8));
  WriteFile(path, bytes);
}

void WriteGrey(const fs::path& path, int width, int height) {
  const std::unique_ptr<OIIO::ImageOutput> output = OIIO::ImageOutput::create(path.string());
  ASSERT_NE(output, nullptr);
  const OIIO::ImageSpec spec(width, height, 1, OIIO::TypeDesc::UINT8);
  const std::vector<uint8_t> pixels(static_cast<size_t>(width) * height, 3);
  ASSERT_TRUE(output->open(path.string(), spec));
  ASSERT_TRUE(output->write_image(spec.format, pixels.data()));
  ASSERT_TRUE(output->close());
}

struct BadWorkspace {
  std::string name;
  std::function<void(const fs::path& workspace)> spoil;
  std::string named;  // what the sentence must name
};

class BadInputWorkspaceTest : public testing::TestWithParam<BadWorkspace> {};

TEST_P(BadInputWorkspaceTest, GivesOneSentenceAndLeavesNothing) {
  const TempFolder folder;
  const fs::path workspace = folder / "workspace";
  CopyTabletop(workspace);
  GetParam().spoil(workspace);
  for (const std::string command : {"automatic_segmenter", "foam_trainer"}) {
    std::vector<std::string> arguments = {command, "--output_path", (folder / "out").string()};
    if (command == "automatic_segmenter") {
      arguments.insert(arguments.end(), {"--workspace_path", workspace.string()});
    } else {
      arguments.insert(arguments.end(),
                       {"--image_path",
                        (workspace / "images").string(),
                        "--input_path",
                        (workspace / "sparse" / "0").string(),
                        "--mask_path",
                        (workspace / "object_mask").string()});
    }
    const Outcome outcome = RunSemfoam(TinyTraining(arguments));
    EXPECT_EQ(outcome.exit_code, 1) << command << "\n" << outcome.err;
    ASSERT_THAT(outcome.Errors(), SizeIs(1)) << command << "\n" << outcome.err;
    EXPECT_THAT(outcome.Errors().front(), HasSubstr(GetParam().named)) << command;
    EXPECT_THAT(FilesBelow(folder / "out"), IsEmpty()) << command;
  }
}

INSTANTIATE_TEST_SUITE_P(
    All,
    BadInputWorkspaceTest,
    testing::Values(
        BadWorkspace{"NoModel", [](auto& w) { fs::remove_all(w / "sparse"); }, "sparse"},
        BadWorkspace{"NoPhotos", [](auto& w) { fs::remove_all(w / "images"); }, "images"},
        BadWorkspace{
            "MissingPhoto", [](auto& w) { fs::remove(w / "images/0007.jpg"); }, "0007.jpg"},
        BadWorkspace{
            "CutCameras", [](auto& w) { Cut(w / "sparse/0/cameras.bin", 0.5); }, "cameras.bin"},
        BadWorkspace{
            "CutImages", [](auto& w) { Cut(w / "sparse/0/images.bin", 0.7); }, "images.bin"},
        BadWorkspace{
            "CutPoints", [](auto& w) { Cut(w / "sparse/0/points3D.bin", 0.999); }, "points3D.bin"},
        BadWorkspace{"OvercountedCameras",
                     [](auto& w) { Overcount(w / "sparse/0/cameras.bin"); },
                     "cameras.bin"},
        BadWorkspace{"OvercountedImages",
                     [](auto& w) { Overcount(w / "sparse/0/images.bin"); },
                     "images.bin"},
        BadWorkspace{"OvercountedPoints",
                     [](auto& w) { Overcount(w / "sparse/0/points3D.bin"); },
                     "points3D.bin"},
        BadWorkspace{"EmptyModelFile",
                     [](auto& w) { fs::resize_file(w / "sparse/0/images.bin", 0); },
                     "images.bin"},
        BadWorkspace{"MaskOfAnotherAspect",
                     [](auto& w) { WriteGrey(w / "object_mask/0011.png", 320, 200); },
                     "0011.png"},
        BadWorkspace{"CutMask", [](auto& w) { Cut(w / "object_mask/0011.png", 0.6); }, "0011.png"},
        BadWorkspace{"MaskIsNoImage",
                     [](auto& w) { WriteFile(w / "object_mask/0011.png", "no image at all"); },
                     "0011.png"},
        BadWorkspace{"CutPhoto", [](auto& w) { Cut(w / "images/0005.jpg", 0.5); }, "0005.jpg"},
        BadWorkspace{
            "PhotoCutAtItsEnd", [](auto& w) { Cut(w / "images/0005.jpg", 0.97); }, "0005.jpg"},
        BadWorkspace{"PhotoIsNoImage",
                     [](auto& w) { WriteFile(w / "images/0005.jpg", "no image at all"); },
                     "0005.jpg"},
        BadWorkspace{"LabelsAreNoJson",
                     [](auto& w) { WriteFile(w / "labels.json", "{\"labels\": {"); },
                     "labels.json"}),
    [](const auto& info) { return info.param.name; });

struct BadCommand {
  std::string name;
  std::vector<std::string> arguments;  // OUT: an output folder that can be written
  Mistake mistake;
};

class BadInputCommandTest : public testing::TestWithParam<BadCommand> {};

TEST_P(BadInputCommandTest, GivesOneSentenceAndLeavesNothing) {
  const TempFolder folder;
  std::vector<std::string> arguments = GetParam().arguments;
  WriteFile(folder / "a file", "in the way");
  WriteFile(folder / "bad.foam", "SEMFOAM\nand then nothing that is right");
  for (std::string& argument : arguments) {
    if (argument == "OUT") argument = (folder / "out").string();
    if (argument == "BELOW_A_FILE") argument = (folder / "a file" / "out").string();
    if (argument == "BAD_FOAM") argument = (folder / "bad.foam").string();
    if (argument == "TABLETOP") argument = kTabletop.string();
    if (argument == "SPARSE") argument = (kTabletop / "sparse/0").string();
  }
  ExpectRefused(RunSemfoam(arguments), GetParam().mistake);
  EXPECT_THAT(FilesBelow(folder / "out"), IsEmpty());
}

INSTANTIATE_TEST_SUITE_P(
    All,
    BadInputCommandTest,
    testing::Values(
        BadCommand{"UnknownCommand", {"nosuch"}, {"", {"nosuch"}, "not recognized"}},
        BadCommand{"NothingGiven",
                   {"automatic_segmenter"},
                   {"", {"workspace_path"}, "required but missing"}},
        BadCommand{"UnknownOption",
                   {"automatic_segmenter", "--nosuch", "1"},
                   {"", {"nosuch"}, "unrecognised"}},
        BadCommand{"BadQuality",
                   {"automatic_segmenter",
                    "--workspace_path",
                    "TABLETOP",
                    "--output_path",
                    "OUT",
                    "--quality",
                    "best"},
                   {"", {"quality", "'best'"}, "is invalid"}},
        BadCommand{"NoRays",
                   {"automatic_segmenter",
                    "--workspace_path",
                    "TABLETOP",
                    "--output_path",
                    "OUT",
                    "--FoamTraining.num_rays",
                    "0"},
                   {"", {"num_rays"}, "must be greater than 0"}},
        BadCommand{"NegativeTestEvery",
                   {"automatic_segmenter",
                    "--workspace_path",
                    "TABLETOP",
                    "--output_path",
                    "OUT",
                    "--test_every",
                    "-8"},
                   {"", {"test_every", "-8"}, "or more"}},
        BadCommand{"NegativeVoxels",
                   {"automatic_segmenter",
                    "--workspace_path",
                    "TABLETOP",
                    "--output_path",
                    "OUT",
                    "--VolumeExport.voxel_size",
                    "-1"},
                   {"", {"voxel_size"}, "must be a length"}},
        BadCommand{"UnknownFormat",
                   {"mesh_exporter",
                    "--foam_path",
                    "BAD_FOAM",
                    "--output_path",
                    "OUT",
                    "--formats",
                    "ply,stl"},
                   {"", {"formats", "'ply,stl'", "om,ply,obj,glb,usda"}, "is invalid"}},
        BadCommand{
            "NoFormat",
            {"mesh_exporter", "--foam_path", "BAD_FOAM", "--output_path", "OUT", "--formats", ""},
            {"", {"formats", "''"}, "is invalid"}},
        BadCommand{"EmptyFormat",
                   {"mesh_exporter",
                    "--foam_path",
                    "BAD_FOAM",
                    "--output_path",
                    "OUT",
                    "--formats",
                    "ply,,om"},
                   {"", {"formats", "'ply,,om'"}, "is invalid"}},
        BadCommand{
            "UnknownMethod",
            {"mesh_exporter", "--foam_path", "BAD_FOAM", "--output_path", "OUT", "--method", "mc"},
            {"", {"method", "{cells, smooth}"}, "is invalid"}},
        BadCommand{"TooFewFaces",
                   {"mesh_exporter",
                    "--foam_path",
                    "BAD_FOAM",
                    "--output_path",
                    "OUT",
                    "--method",
                    "smooth",
                    "--target_faces",
                    "3"},
                   {"", {"target_faces"}, "must be at least 4"}},
        BadCommand{"FacesAreNoNumber",
                   {"mesh_exporter",
                    "--foam_path",
                    "BAD_FOAM",
                    "--output_path",
                    "OUT",
                    "--MeshExport.target_faces",
                    "few"},
                   {"", {"target_faces", "'few'"}, "is invalid"}},
        BadCommand{"FewerFacesOfCells",
                   {"mesh_exporter",
                    "--foam_path",
                    "BAD_FOAM",
                    "--output_path",
                    "OUT",
                    "--method",
                    "cells",
                    "--target_faces",
                    "500"},
                   {"", {"target_faces", "smooth"}, "needs the method"}},
        BadCommand{"VolumesAreNoMeshes",
                   {"mesh_exporter",
                    "--foam_path",
                    "BAD_FOAM",
                    "--output_path",
                    "OUT",
                    "--formats",
                    "vdb"},
                   {"", {"formats", "'vdb'"}, "is invalid"}},
        BadCommand{"UnknownFormatForAll",
                   {"automatic_segmenter",
                    "--workspace_path",
                    "TABLETOP",
                    "--output_path",
                    "OUT",
                    "--formats",
                    "vdb,fbx"},
                   {"", {"formats", "'vdb,fbx'", "vdb,om,ply,obj,glb,usda"}, "is invalid"}},
        BadCommand{
            "NoUpAxis",
            {"mesh_exporter", "--foam_path", "BAD_FOAM", "--output_path", "OUT", "--up_axis", "x"},
            {"", {"up_axis", "{colmap, y, z}"}, "is invalid"}},
        BadCommand{
            "NoScale",
            {"volume_exporter", "--foam_path", "BAD_FOAM", "--output_path", "OUT", "--scale", "0"},
            {"", {"scale", "0"}, "from 1e-9 to 1e9"}},
        BadCommand{
            "NegativeScale",
            {"mesh_exporter", "--foam_path", "BAD_FOAM", "--output_path", "OUT", "--scale", "-1"},
            {"", {"scale", "-1"}, "from 1e-9 to 1e9"}},
        BadCommand{
            "ScaleIsNoNumber",
            {"mesh_exporter", "--foam_path", "BAD_FOAM", "--output_path", "OUT", "--scale", "big"},
            {"", {"scale", "'big'"}, "is invalid"}},
        BadCommand{"NoSimilarity",
                   {"volume_exporter",
                    "--foam_path",
                    "BAD_FOAM",
                    "--output_path",
                    "OUT",
                    "--transform",
                    "1 0 0 0 0 2 0 0 0 0 1 0"},
                   {"", {"transform"}, "the 12 or 16 numbers"}},
        BadCommand{"NoSimilarityForAll",
                   {"automatic_segmenter",
                    "--workspace_path",
                    "TABLETOP",
                    "--output_path",
                    "OUT",
                    "--transform",
                    "-1 0 0"},
                   {"", {"transform", "'-1 0 0'"}, "the 12 or 16 numbers"}},
        BadCommand{
            "NoUnit",
            {"mesh_exporter", "--foam_path", "BAD_FOAM", "--output_path", "OUT", "--units", "yard"},
            {"", {"units", "'yard'"}, "is invalid"}},
        BadCommand{"NoWorkspace",
                   {"automatic_segmenter", "--workspace_path", "no/such", "--output_path", "OUT"},
                   {"no/such", {"workspace_path"}, "no such folder"}},
        BadCommand{"OutputBelowAFile",
                   {"automatic_segmenter",
                    "--workspace_path",
                    "TABLETOP",
                    "--output_path",
                    "BELOW_A_FILE"},
                   {"a file/out", {"Not a directory"}, "cannot be made"}},
        BadCommand{"OutputWhereNobodyMayWrite",
                   {"automatic_segmenter",
                    "--workspace_path",
                    "TABLETOP",
                    "--output_path",
                    "/proc/semfoam"},
                   {"/proc/semfoam", {}, "cannot be made"}},
        BadCommand{"NoFoam",
                   {"foam_analyzer", "--foam_path", "no/such.foam"},
                   {"no/such.foam", {}, "no such file"}},
        BadCommand{"BadFoam",
                   {"foam_analyzer", "--foam_path", "BAD_FOAM"},
                   {"bad.foam", {"versions 1 to 2"}, "format version"}},
        BadCommand{"BadFoamForVolumes",
                   {"volume_exporter", "--foam_path", "BAD_FOAM", "--output_path", "OUT"},
                   {"bad.foam", {"versions 1 to 2"}, "format version"}},
        BadCommand{"BadFoamForMeshes",
                   {"mesh_exporter", "--foam_path", "BAD_FOAM", "--output_path", "OUT"},
                   {"bad.foam", {"versions 1 to 2"}, "format version"}},
        BadCommand{"BadFoamForRenders",
                   {"foam_renderer",
                    "--foam_path",
                    "BAD_FOAM",
                    "--input_path",
                    "SPARSE",
                    "--output_path",
                    "OUT"},
                   {"bad.foam", {"versions 1 to 2"}, "format version"}},
        BadCommand{"NoProjectFile",
                   {"foam_analyzer", "--project_path", "no/such.ini"},
                   {"no/such.ini", {}, "no such file"}}),
    [](const auto& info) { return info.param.name; });

TEST(BadInput, ARunThatDoesNotFitIntoMemorySaysSoBeforeItStarts) {
  const TempFolder folder;
  const fs::path out = folder / "out";
  constexpr int64_t kLimitKb = 3'000'000 + kReservedBySanitizer / 1024;
  const Outcome outcome = RunProgram("/bin/sh",
                                     {"-c",
                                      "ulimit -v " + std::to_string(kLimitKb) + "; exec \"$@\"",
                                      "sh",
                                      SEMFOAM_PROGRAM,
                                      "foam_trainer",
                                      "--image_path",
                                      (kTabletop / "images").string(),
                                      "--input_path",
                                      (kTabletop / "sparse").string(),
                                      "--output_path",
                                      out.string(),
                                      "--FoamTraining.final_sites",
                                      "4000000"});
  EXPECT_EQ(outcome.exit_code, 1);
  ASSERT_THAT(outcome.Errors(), SizeIs(1)) << outcome.err;
  EXPECT_THAT(outcome.Errors()[0], HasSubstr("would fit"));
  EXPECT_THAT(outcome.err, HasSubstr("4000000 sites"));
  EXPECT_THAT(FilesBelow(out), IsEmpty());
}

}  // namespace
}  // namespace semfoam
