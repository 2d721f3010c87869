// SPDX-License-Identifier: GPL-3.0-or-later
//
// Writes the hand-made part of the corpora: small valid inputs that reach far into each reader, and
// the headers that promise 2^60 of what follows. fuzz_seeds FOLDER (tests/fuzz/corpus).
#include "foam/model/model.h"
#include "plugin/colmap/colmap_model_formats.h"

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "tests/plugin/colmap/small_model.h"
#include "tests/plugin/mask_import/mask_formats.h"
#include "tests/plugin/test_util.h"
#include "tests/small_files.h"

namespace semfoam {
namespace {

namespace fs = std::filesystem;

constexpr char kBetween[] = "--8<--\n";

std::string Together(const std::vector<std::string>& parts) {
  std::string input;
  for (const std::string& part : parts) input += (&part == &parts[0] ? "" : kBetween) + part;
  return input;
}

std::vector<std::string> Encoded(const Reconstruction& model, bool binary) {
  std::vector<std::string> parts = binary ? std::vector{CamerasToBinary(model.cameras),
                                                        ImagesToBinary(model.images),
                                                        PointsToBinary(model.points)}
                                          : std::vector{CamerasToText(model.cameras),
                                                        ImagesToText(model.images),
                                                        PointsToText(model.points)};
  if (model.rigs) parts.push_back(binary ? RigsToBinary(*model.rigs) : RigsToText(*model.rigs));
  if (model.frames) {
    parts.push_back(binary ? FramesToBinary(*model.frames) : FramesToText(*model.frames));
  }
  return parts;
}

void WriteModels(const fs::path& folder) {
  for (const bool rigs : {false, true}) {
    const std::string name = rigs ? "seed_rigs" : "seed";
    WriteFile(folder / "colmap_binary" / name, Together(Encoded(SmallModel(rigs), true)));
    WriteFile(folder / "colmap_text" / name, Together(Encoded(SmallModel(rigs), false)));
  }
  // A track that shorter files have no image for, and every number that is none.
  Reconstruction odd = SmallModel(false);
  odd.points[0].position = {std::nan(""), 0, INFINITY};
  odd.points[0].track = {{77, 4'000'000'000u}, {77, 0}, {77, 0}};
  odd.images[0].points[0] = {std::nan(""), -1e300, 12};
  WriteFile(folder / "colmap_binary" / "seed_odd", Together(Encoded(odd, true)));
  WriteFile(folder / "colmap_text" / "seed_odd", Together(Encoded(odd, false)));
  std::string count;
  AppendBinary(uint64_t{1} << 60, &count);
  for (size_t file = 0; file < 5; ++file) {
    std::vector<std::string> parts = Encoded(SmallModel(true), true);
    parts[file].replace(0, 8, count);
    WriteFile(folder / "colmap_binary" / ("huge_count_" + std::to_string(file)), Together(parts));
  }
  // The number of an image's features, and of a point's observations.
  Reconstruction one = SmallModel(false);
  one.images.resize(1);
  one.images[0].points.clear();
  one.points.clear();
  std::vector<std::string> parts = Encoded(one, true);
  parts[1].replace(parts[1].size() - 8, 8, count);
  WriteFile(folder / "colmap_binary" / "huge_features", Together(parts));
  one.points.resize(1);
  parts = Encoded(one, true);
  parts[2].replace(parts[2].size() - 8, 8, count);
  WriteFile(folder / "colmap_binary" / "huge_track", Together(parts));
  std::vector<std::string> text = Encoded(SmallModel(true), false);
  text[3] = "1 4000000000 CAMERA 3 CAMERA 4\n";
  WriteFile(folder / "colmap_text" / "huge_rig", Together(text));
  text = Encoded(SmallModel(true), false);
  text[4] = "1 12 1 0 0 0 0 0 0 4294967295 CAMERA 3 1\n";
  WriteFile(folder / "colmap_text" / "huge_frame", Together(text));
}

void WriteMasks(const fs::path& folder) {
  const fs::path file = folder / "as_is";
  const struct {
    const char* name;
    int bits;
    int color_type;
    size_t bytes;
    bool interlaced;
  } kinds[] = {{"grey8", 8, PNG_COLOR_TYPE_GRAY, 8 * 6, false},
               {"grey16", 16, PNG_COLOR_TYPE_GRAY, 16 * 6, false},
               {"grey1", 1, PNG_COLOR_TYPE_GRAY, 6, true},
               {"palette4", 4, PNG_COLOR_TYPE_PALETTE, 4 * 6, false},
               {"rgb", 8, PNG_COLOR_TYPE_RGB, 24 * 6, true},
               {"grey_alpha", 8, PNG_COLOR_TYPE_GRAY_ALPHA, 16 * 6, false},
               {"rgba", 8, PNG_COLOR_TYPE_RGBA, 32 * 6, false}};
  for (const auto& kind : kinds) {
    std::vector<uint8_t> samples(kind.bytes);
    for (size_t i = 0; i < samples.size(); ++i) samples[i] = static_cast<uint8_t>(i * i + 3);
    WritePng(file, 8, 6, kind.bits, kind.color_type, samples, kind.interlaced);
    const std::string png = ReadFile(file);
    WriteFile(folder / "mask_png" / kind.name, "r" + png);
    if (std::string(kind.name) != "grey8") continue;
    // Width and height in the header.
    std::string huge = png;
    huge.replace(16, 8, std::string("\x10\0\0\0\x10\0\0\0", 8));
    WriteFile(folder / "mask_png" / "huge_size", "r" + huge);
  }
  fs::remove(file);
  std::string rows("s\x08\x06\x03\x02\0", 6);
  rows += std::string(6 * 25, '\1');
  WriteFile(folder / "mask_png" / "packed_rgb", rows);
}

void WriteFoams(const fs::path& folder) {
  const fs::path file = folder / "model_file" / "seed";
  fs::create_directories(file.parent_path());
  WriteModel(file, SmallFoam(1));
  std::string bytes = ReadFile(file);
  bytes.resize(bytes.size() - 8);
  WriteFile(file, bytes);
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string changed = bytes;
    changed.replace(changed.find(from), from.size(), to);
    return changed;
  };
  const std::string huge = "1152921504606846976";
  WriteFile(folder / "model_file" / "huge_sites", with("\"sites\": 3", "\"sites\": " + huge));
  WriteFile(folder / "model_file" / "huge_float", with("\"sites\": 3", "\"sites\": 1e300"));
  WriteFile(folder / "model_file" / "huge_offset", with("\"offset\": 0", "\"offset\": " + huge));
  WriteFile(folder / "model_file" / "huge_width", with("\"width\": 64", "\"width\": 1e99"));
  std::string header = bytes;
  header.replace(16, 8, std::string("\0\0\0\0\0\0\0\x10", 8));
  WriteFile(folder / "model_file" / "huge_header", header);
}

void WriteTexts(const fs::path& folder) {
  WriteFile(folder / "radiant_foam_ply" / "seed", SmallRadiantFoam("3", 9));
  WriteFile(folder / "radiant_foam_ply" / "huge_count", SmallRadiantFoam("1152921504606846976", 9));
  WriteFile(folder / "radiant_foam_ply" / "huge_product",
            SmallRadiantFoam("18446744073709551615", 9));

  const std::string nested(100'000, '[');
  WriteFile(folder / "label_names" / "seed",
            R"({"version": 1, "labels": {"7": "mug", "16777215": "großer Ball"}, "objects": []})");
  WriteFile(folder / "label_names" / "source_ids",
            R"({"labels": {"1": "mug", "2": "ball"}, "source_ids": {"1": 70000, "2": 8421504}})");
  WriteFile(folder / "label_names" / "deep", R"({"labels": )" + nested);
  WriteFile(folder / "label_names" / "twice", R"({"labels": {"7": "mug", "07": "cup"}})");
  WriteFile(folder / "predicted_ids" / "seed",
            R"({"annotations": [{"file_name": "a.png", "segments_info": [{"id": 1}, {"id": 9,
                "score": 0.5}]}, {"segments_info": []}]})");
  WriteFile(folder / "predicted_ids" / "huge",
            R"({"annotations": [{"segments_info": [{"id": 1e300}]}]})");
  const std::string key = R"({"position": [0, 0, 1], "look_at": [0, 0, 0], "up": [0, 1, 0]})";
  WriteFile(folder / "trajectory" / "seed",
            R"(-{"version": 1, "keyframes": [)" + key +
                R"(, {"position": [1, 0, 1], "look_at": [0.5, 0, 0], "up": [0, 1, 0]}], "frames": 9,
                "fps": 12.5, "closed": true, "width": 64, "height": 48, "fov": 60})");
  WriteFile(folder / "trajectory" / "from_photo",
            R"(p{"version": 1, "keyframes": [{"position": [0, 0, 1], "look_at": [0, 0, 0]}]})");
  WriteFile(folder / "trajectory" / "deep",
            R"(p{"version": 1, "keyframes": [{"position": )" + nested);
  WriteFile(folder / "trajectory" / "far",
            R"(p{"version": 1, "keyframes": [{"position": [1e308, 0, 0], "look_at": [-1e308, 0, 0]},
                {"position": [-1e308, 0, 0], "look_at": [1e308, 0, 0]}]})");
  WriteFile(folder / "options" / "seed",
            "# a comment\npath = a folder\ntest_every=4\n[FoamTraining]\nnum_rays = 77\n[Export]\n"
            "voxel_size = 1e-3\n--8<--\n--quality\nlow\n--preview=1\n--share\n0.5\n--checksum\n"
            "18446744073709551615\n--num_threads\n1");
  WriteFile(folder / "options" / "help", "path=a\n--8<--\n-h");
}

// Of each format, the first of its files that the target reads.
void WriteImportedMasks(const fs::path& folder) {
  const ExactScene scene;
  const TempFolder temp;
  const struct {
    const char* format;
    const char* file;
    char kind;
  } files[] = {{"coco_polygons", "annotations/instances_default.json", 'c'},
               {"coco_raw_runs", "annotations/instances_default.json", 'c'},
               {"coco_compressed_runs", "annotations/instances_default.json", 'c'},
               {"sam_lists", "0001.json", 's'},
               {"grounded_sam", "0_results.json", 's'},
               {"label_studio", "project.json", 't'},
               {"labelme", "0001.json", 'm'},
               {"yolo", "labels/0001.txt", 'y'},
               {"npy_i8_fortran", "mask_data/mask_0001.npy", 'n'},
               {"npz_deflated", "0001.npz", 'n'},
               {"npz_stored", "0001.npz", 'n'}};
  const std::vector<FormatSample> samples = AllFormats();
  const fs::path out = folder / "mask_import";
  for (const auto& [format, file, kind] : files) {
    for (const FormatSample& sample : samples) {
      if (sample.name != format) continue;
      sample.write(scene, temp / format);
      WriteFile(out / format, kind + ReadFile(temp / format / file));
    }
  }
  const LabelImage& mask = scene.masks[0];
  WriteFile(out / "run_lengths",
            "r" + EncodeRunLengths(LengthsOfRuns({{3, 7}, {40, 44}, {107, 108}}, {12, 9})));
  const std::vector<uint8_t> brush = BrushOf(std::vector<uint8_t>(12 * 9, 255));
  WriteFile(out / "brush", "b" + std::string(brush.begin(), brush.end()));
  const std::string npy = NpyOf(mask, "<u2", false);
  std::string huge = npy;
  huge.replace(huge.find("(18, 24)"), 8, "(9999999,99999999)");
  WriteFile(out / "huge_npy", "n" + huge);
  WriteFile(out / "labelme_strokes",
            R"(m{"shapes": [{"label": "a", "shape_type": "point", "points": [[3, 4.5]]},
            {"label": "b", "shape_type": "linestrip", "points": [[1, 1], [9, 2], [-1e308, 1e308]]},
            {"label": "c", "shape_type": "rectangle", "points": [[2, 2], [8, 7]]},
            {"label": "a", "shape_type": "polygon", "points": [[0, 0], [3, 0], [0, 3]]}],
            "imagePath": "0001.png", "imageWidth": 12, "imageHeight": 9})");
  WriteFile(out / "labelme_list",
            R"(m[{"shapes": [{"label": "a", "shape_type": "point", "points": [[3, 4.5]]}],
            "imagePath": "0001.png", "imageWidth": 12, "imageHeight": 9},
            {"shapes": [{"label": "b", "shape_type": "polygon", "points": [[0, 0], [3, 0], [0, 3]]}],
            "imagePath": "0002.png", "imageWidth": 12, "imageHeight": 9}])");
  WriteFile(out / "huge_coco",
            R"(c{"categories": [{"id": 1, "name": "a"}], "images": [{"id": 1, "file_name": "a",
            "width": 65535, "height": 65535}], "annotations": [{"image_id": 1, "category_id": 1,
            "segmentation": {"size": [65535, 65535], "counts": [0, 4294836225]}}]})");
}

void WriteMeshes(const fs::path& folder) {
  WriteFile(folder / "mesh" / "obj",
            "ov 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1/1/1 -1 2\n");
  WriteFile(folder / "mesh" / "off", "fOFF\n4 2 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 1 2\n3 0 3 1\n");
  const std::string header =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty double x\nproperty double y\nproperty "
      "double z\n";
  const std::string faces = "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
  WriteFile(folder / "mesh" / "ply", "p" + header + faces + "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n");
  WriteFile(folder / "mesh" / "points", "P" + header + "end_header\n0 0 0\n1 0 0\n0 1 0\n");
  std::string binary =
      "pply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\n"
      "property float y\nproperty float z\n" +
      faces;
  for (const float x : {0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 1.f, 0.f}) AppendBinary(x, &binary);
  binary += '\3';
  for (const int32_t corner : {0, 1, 2}) AppendBinary(corner, &binary);
  WriteFile(folder / "mesh" / "ply_binary", binary);
  std::string stl = "s" + std::string(80, ' ');
  AppendBinary(uint32_t{1}, &stl);
  for (const float x : {0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 1.f, 0.f})
    AppendBinary(x, &stl);
  AppendBinary(uint16_t{0}, &stl);
  WriteFile(folder / "mesh" / "stl", stl);

  // What CGAL makes room for.
  constexpr uint32_t kHuge = 0xf0000000;
  for (const char* format : {"ascii", "binary_little_endian", "binary_big_endian"}) {
    WriteFile(folder / "mesh" / ("huge_list_" + std::string(format)),
              "p" + SmallPlyMesh(format, kHuge));
  }
  const std::string rest = "0 0 0\n1 0 0\n0 1 0\n";
  WriteFile(folder / "mesh" / "huge_off_vertices", "fOFF\n4000000000 1 0\n" + rest + "3 0 1 2\n");
  // CGAL's header computed with these as int.
  WriteFile(folder / "mesh" / "large_off_vertices", "fOFF\n2000000000 1 0\n" + rest + "3 0 1 2\n");
  WriteFile(folder / "mesh" / "large_off_edges", "fOFF\n3 1 2000000000\n" + rest + "3 0 1 2\n");
  WriteFile(folder / "mesh" / "negative_off_vertices",
            "fnOFF\n3 -2000000000 1 0\n" + rest + "3 0 1 2\n");
  WriteFile(folder / "mesh" / "large_off_binary",
            std::string("fOFF BINARY\n\x77\x35\x94\0\0\0\0\1\0\0\0\0", 24));
  WriteFile(folder / "mesh" / "huge_off_faces", "fOFF\n3 4000000000 0\n" + rest + "3 0 1 2\n");
  WriteFile(folder / "mesh" / "huge_off_corners", "fOFF\n3 1 0\n" + rest + "4000000000 0 1 2\n");
  WriteFile(folder / "mesh" / "om", "m" + SmallOmMesh());
  WriteFile(folder / "mesh" / "huge_om_vertices", "m" + SmallOmMesh(kHuge, 1, 3));
  WriteFile(folder / "mesh" / "huge_om_faces", "m" + SmallOmMesh(3, kHuge, 3));
  WriteFile(folder / "mesh" / "huge_om_edges", "m" + SmallOmMesh(3, 1, kHuge));
}

void WriteClouds(const fs::path& folder) {
  const std::string huge = "1152921504606846976";
  for (const char* format : {"ascii", "binary_little_endian", "binary_big_endian"}) {
    WriteFile(folder / "seed_cloud" / format, SmallCloud(format));
    WriteFile(folder / "seed_cloud" / ("huge_count_" + std::string(format)),
              SmallCloud(format, "double", huge));
  }
  std::string list = SmallCloud("ascii");
  list.replace(list.find("\n1.0"), 2, "\n4000000000");
  WriteFile(folder / "seed_cloud" / "huge_coordinate", list);
  std::string named = SmallCloud("ascii");
  for (const char* name : {"red", "green", "blue"}) {
    named.replace(named.find(name), 0, "diffuse_");
  }
  WriteFile(folder / "seed_cloud" / "diffuse", named);
}

}  // namespace
}  // namespace semfoam

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "ERROR: fuzz_seeds takes one folder, tests/fuzz/corpus.\n");
    return EXIT_FAILURE;
  }
  const std::filesystem::path folder = argv[1];
  semfoam::WriteModels(folder);
  semfoam::WriteMasks(folder);
  semfoam::WriteImportedMasks(folder);
  semfoam::WriteFoams(folder);
  semfoam::WriteTexts(folder);
  semfoam::WriteMeshes(folder);
  semfoam::WriteClouds(folder);
  return EXIT_SUCCESS;
}
