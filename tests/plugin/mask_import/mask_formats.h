// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "tests/plugin/mask_import/mask_files.h"

// Every format that is imported, generated from exact masks.
namespace semfoam {

struct FormatSample {
  std::string name;
  // Writes the files into a folder.
  std::function<void(const ExactScene& scene, const std::filesystem::path& folder)> write;
  // What ImportedMasks::format says.
  std::string format;
  // Whether it has the names of the objects.
  bool has_names = true;
  // Whether objects overlap in it, so that it matters which is painted on top.
  bool is_independent = false;
};

inline void WriteIds(const std::filesystem::path& path, const LabelImage& mask, int color_type) {
  std::vector<uint8_t> samples;
  for (const int32_t id : mask.data) samples.push_back(static_cast<uint8_t>(id));
  WritePng(path, mask.width, mask.height, 8, color_type, samples);
}

inline nlohmann::json RegionListOf(const ExactScene& scene, size_t photo, bool has_names) {
  nlohmann::json list = nlohmann::json::array();
  for (const auto& [id, name] : scene.names) {
    const PixelRuns runs = RunsOf(scene.masks[photo], id);
    nlohmann::json region = {{"segmentation", SegmentationOf(runs, Shape::kCompressedRuns)},
                             {"area", AreaOf(runs)},
                             {"predicted_iou", 0.97}};
    if (has_names) region["class_name"] = name;
    list.push_back(std::move(region));
  }
  return list;
}

inline std::vector<FormatSample> AllFormats() {
  namespace fs = std::filesystem;
  using Json = nlohmann::json;
  const auto per_photo = [](auto write) {
    return [write](const ExactScene& scene, const fs::path& folder) {
      for (size_t i = 0; i < scene.photos.size(); ++i) write(scene, i, folder);
    };
  };
  std::vector<FormatSample> samples;
  const auto coco = [&](const std::string& name, Shape shape) {
    samples.push_back({name,
                       [shape](const ExactScene& scene, const fs::path& folder) {
                         WriteFile(folder / "annotations/instances_default.json",
                                   CocoText(scene, shape));
                       },
                       "COCO annotations"});
  };
  coco("coco_polygons", Shape::kPolygons);
  coco("coco_raw_runs", Shape::kRawRuns);
  coco("coco_compressed_runs", Shape::kCompressedRuns);
  samples.push_back({"roboflow",
                     [](const ExactScene& scene, const fs::path& folder) {
                       const Json json = CocoOf(scene, Shape::kPolygons, [&](size_t i) {
                         return scene.StemOf(i) + "_png.rf.0a1b2c3d4e5f.jpg";
                       });
                       WriteFile(folder / "train/_annotations.coco.json", json.dump());
                     },
                     "COCO annotations"});
  samples.push_back({"label_studio_coco",
                     [](const ExactScene& scene, const fs::path& folder) {
                       const Json json = CocoOf(scene, Shape::kPolygons, [&](size_t i) {
                         return "images/0123abcd-" + scene.StemOf(i) + ".png";
                       });
                       WriteFile(folder / "result.json", json.dump());
                     },
                     "COCO annotations"});
  samples.push_back({"coco_windows_paths",
                     [](const ExactScene& scene, const fs::path& folder) {
                       const Json json = CocoOf(scene, Shape::kPolygons, [&](size_t i) {
                         return "C:\\photos\\cam\\" + scene.StemOf(i) + ".png";
                       });
                       WriteFile(folder / "a.json", json.dump());
                     },
                     "COCO annotations"});
  samples.push_back({"sam_lists",
                     per_photo([](const ExactScene& scene, size_t i, const fs::path& folder) {
                       WriteFile(folder / (scene.StemOf(i) + ".json"),
                                 RegionListOf(scene, i, false).dump());
                     }),
                     "lists of regions by SAM",
                     false,
                     true});
  samples.push_back({"grounded_sam",
                     per_photo([](const ExactScene& scene, size_t i, const fs::path& folder) {
                       const Json json = {{"image_path", "notebooks/images/" + scene.photos[i]},
                                          {"annotations", RegionListOf(scene, i, true)},
                                          {"box_format", "xyxy"},
                                          {"img_width", ExactScene::kSize.width},
                                          {"img_height", ExactScene::kSize.height}};
                       WriteFile(folder / (std::to_string(i) + "_results.json"), json.dump());
                     }),
                     "lists of regions by SAM"});
  samples.push_back(
      {"label_studio",
       [](const ExactScene& scene, const fs::path& folder) {
         Json tasks = Json::array();
         for (size_t i = 0; i < scene.photos.size(); ++i) {
           Json results = Json::array();
           for (const auto& [id, name] : scene.names) {
             const PixelRuns runs = RunsOf(scene.masks[i], id);
             Json result = {{"original_width", ExactScene::kSize.width},
                            {"original_height", ExactScene::kSize.height}};
             if (id == 3) {
               result["type"] = "brushlabels";
               result["value"] = {{"format", "rle"},
                                  {"rle", BrushOf(BinaryOf(scene.masks[i], id, 255))},
                                  {"brushlabels", {name}}};
             } else {
               result["type"] = "polygonlabels";
               result["value"] = {{"points",
                                   Points(OutlineOf(runs),
                                          100. / ExactScene::kSize.width,
                                          100. / ExactScene::kSize.height)},
                                  {"polygonlabels", {name}}};
             }
             results.push_back(std::move(result));
           }
           tasks.push_back(
               {{"id", i},
                {"data", {{"image", "/data/upload/1/89abcdef-" + scene.StemOf(i) + ".png"}}},
                {"annotations", {{{"result", results}, {"was_cancelled", false}}}}});
         }
         WriteFile(folder / "project.json", tasks.dump());
       },
       "Label Studio's JSON"});
  samples.push_back(
      {"labelme",
       per_photo([](const ExactScene& scene, size_t i, const fs::path& folder) {
         Json shapes = Json::array();
         for (const auto& [id, name] : scene.names) {
           const PixelRuns runs = RunsOf(scene.masks[i], id);
           if (id == 2) {
             // A mask of the whole picture.
             const fs::path png = folder.parent_path() / "shape.png";
             WritePng(png,
                      ExactScene::kSize.width,
                      ExactScene::kSize.height,
                      8,
                      PNG_COLOR_TYPE_GRAY,
                      BinaryOf(scene.masks[i], id, 1));
             shapes.push_back({{"label", name},
                               {"shape_type", "mask"},
                               {"points", {{0, 0}, {23, 17}}},
                               {"mask", Base64(ReadFile(png))}});
             fs::remove(png);
             continue;
           }
           for (const Polygon& polygon : RectanglesOf(runs)) {
             shapes.push_back(
                 {{"label", name},
                  {"shape_type", id == 1 ? "rectangle" : "polygon"},
                  {"group_id", 5},
                  {"points", id == 1 ? Points({polygon[0], polygon[2]}) : Points(polygon)}});
           }
         }
         const Json json = {{"version", "5.4.1"},
                            {"flags", Json::object()},
                            {"shapes", shapes},
                            {"imagePath", "..\\photos\\" + scene.StemOf(i) + ".png"},
                            {"imageData", nullptr},
                            {"imageHeight", ExactScene::kSize.height},
                            {"imageWidth", ExactScene::kSize.width}};
         WriteFile(folder / (scene.StemOf(i) + ".json"), json.dump());
       }),
       "LabelMe's shapes"});
  samples.push_back({"yolo",
                     [](const ExactScene& scene, const fs::path& folder) {
                       WriteFile(folder / "data.yaml",
                                 "train: images\nnc: 3\nnames:\n  0: mug\n  1: 'ball'\n"
                                 "  2: plant\nroboflow:\n  version: 1\n");
                       for (size_t i = 0; i < scene.photos.size(); ++i) {
                         std::string text;
                         for (const auto& [id, name] : scene.names) {
                           text += std::to_string(id - 1);
                           for (const PolygonPoint& point : OutlineOf(RunsOf(scene.masks[i], id))) {
                             text += " " + std::to_string(point.x / ExactScene::kSize.width) + " " +
                                     std::to_string(point.y / ExactScene::kSize.height);
                           }
                           text += "\n";
                         }
                         WriteFile(folder / "labels" / (scene.StemOf(i) + ".txt"), text);
                       }
                     },
                     "YOLO segments"});
  const auto numpy = [&](const std::string& name, const std::string& descr, bool fortran_order) {
    samples.push_back(
        {name,
         per_photo([=](const ExactScene& scene, size_t i, const fs::path& folder) {
           const std::string stem = "mask_" + scene.StemOf(i);
           WriteFile(folder / "mask_data" / (stem + ".npy"),
                     NpyOf(scene.masks[i], descr, fortran_order));
           Json json = {{"mask_name", stem + ".npy"}, {"labels", Json::object()}};
           for (const auto& [id, its_name] : scene.names) {
             json["labels"][std::to_string(id)] = {{"instance_id", id}, {"class_name", its_name}};
           }
           WriteFile(folder / "json_data" / (stem + ".json"), json.dump());
         }),
         "NumPy arrays"});
  };
  numpy("grounded_sam_2", "<u2", false);
  numpy("npy_u1", "|u1", false);
  numpy("npy_i8_fortran", "<i8", true);
  numpy("npy_big_endian_i4", ">i4", false);
  for (const bool deflated : {false, true}) {
    samples.push_back({deflated ? "npz_deflated" : "npz_stored",
                       per_photo([=](const ExactScene& scene, size_t i, const fs::path& folder) {
                         WriteFile(
                             folder / (scene.StemOf(i) + ".npz"),
                             ZipOf("arr_0.npy", NpyOf(scene.masks[i], "<u2", false), deflated));
                       }),
                       "NumPy arrays",
                       false});
  }
  samples.push_back({"sam_2_objects",
                     per_photo([](const ExactScene& scene, size_t i, const fs::path& folder) {
                       for (const auto& [id, name] : scene.names) {
                         WritePng(folder / "video" / ("00" + std::to_string(id)) /
                                      ("0000" + std::to_string(i) + ".png"),
                                  ExactScene::kSize.width,
                                  ExactScene::kSize.height,
                                  8,
                                  PNG_COLOR_TYPE_GRAY,
                                  BinaryOf(scene.masks[i], id, 1));
                       }
                     }),
                     "PNGs of single objects",
                     false});
  samples.push_back({"named_objects",
                     per_photo([](const ExactScene& scene, size_t i, const fs::path& folder) {
                       for (const auto& [id, name] : scene.names) {
                         WritePng(folder / name / (scene.StemOf(i) + ".png"),
                                  ExactScene::kSize.width,
                                  ExactScene::kSize.height,
                                  8,
                                  PNG_COLOR_TYPE_GRAY,
                                  BinaryOf(scene.masks[i], id, 255));
                       }
                     }),
                     "PNGs of single objects"});
  samples.push_back({"sam_folders",
                     per_photo([](const ExactScene& scene, size_t i, const fs::path& folder) {
                       std::string table =
                           "id,area,bbox_x0,bbox_y0,bbox_w,bbox_h,point_input_x,point_input_y,"
                           "predicted_iou,stability_score,crop_box_x0,crop_box_y0,crop_box_w,"
                           "crop_box_h\n";
                       for (int k = 0; k < 3; ++k) {
                         WritePng(folder / scene.StemOf(i) / (std::to_string(k) + ".png"),
                                  ExactScene::kSize.width,
                                  ExactScene::kSize.height,
                                  8,
                                  PNG_COLOR_TYPE_GRAY,
                                  BinaryOf(scene.masks[i], k + 1, 255));
                         table += std::to_string(k) + ",9,0,0,9,9,1,1,0.9,0.9,0,0,9,9\n";
                       }
                       WriteFile(folder / scene.StemOf(i) / "metadata.csv", table);
                     }),
                     "SAM's folders of masks",
                     false,
                     true});
  samples.push_back(
      {"cvat",
       [](const ExactScene& scene, const fs::path& folder) {
         WriteFile(folder / "labelmap.txt",
                   "# label:color_rgb:parts:actions\nbackground:0,0,0::\nmug:250,50,83::\n"
                   "ball:50,183,250::\nplant:115,51,128::\n");
         WriteFile(folder / "ImageSets/Segmentation/default.txt", "cam/0001\n");
         const std::vector<std::vector<uint8_t>> class_colors = {
             {0, 0, 0}, {250, 50, 83}, {50, 183, 250}, {115, 51, 128}};
         const std::vector<std::vector<uint8_t>> object_colors = {
             {0, 0, 0}, {128, 0, 0}, {0, 128, 0}, {128, 128, 0}};
         for (size_t i = 0; i < scene.photos.size(); ++i) {
           for (const bool is_class : {true, false}) {
             std::vector<uint8_t> samples;
             for (const int32_t id : scene.masks[i].data) {
               const std::vector<uint8_t>& color = (is_class ? class_colors : object_colors)[id];
               samples.insert(samples.end(), color.begin(), color.end());
             }
             WritePng(folder / (is_class ? "SegmentationClass" : "SegmentationObject") /
                          (scene.PathOf(i) + ".png"),
                      ExactScene::kSize.width,
                      ExactScene::kSize.height,
                      8,
                      PNG_COLOR_TYPE_RGB,
                      samples);
           }
         }
       },
       "CVAT's segmentation masks"});
  samples.push_back({"davis_frames",
                     per_photo([](const ExactScene& scene, size_t i, const fs::path& folder) {
                       WriteIds(folder / "480p/kitchen" / ("0000" + std::to_string(i) + ".png"),
                                scene.masks[i],
                                PNG_COLOR_TYPE_PALETTE);
                     }),
                     "PNGs of ids",
                     false});
  samples.push_back({"youtube_vos",
                     [](const ExactScene& scene, const fs::path& folder) {
                       Json objects;
                       for (const auto& [id, name] : scene.names) {
                         objects[std::to_string(id)] = {{"category", name}, {"frames", {"00001"}}};
                       }
                       WriteFile(folder / "meta.json",
                                 Json({{"videos", {{"a1b2c3", {{"objects", objects}}}}}}).dump());
                       for (size_t i = 0; i < scene.photos.size(); ++i) {
                         WriteIds(folder / "Annotations/a1b2c3" /
                                      ("0000" + std::to_string(i + 1) + ".png"),
                                  scene.masks[i],
                                  PNG_COLOR_TYPE_PALETTE);
                       }
                     },
                     "PNGs of ids"});
  samples.push_back(
      {"deva",
       per_photo([](const ExactScene& scene, size_t i, const fs::path& folder) {
         WriteIds(folder / (scene.PathOf(i) + ".png"), scene.masks[i], PNG_COLOR_TYPE_GRAY);
         WriteFile(folder / "labels.json",
                   R"({"labels": {"1": "mug", "2": "ball", "3": "plant"}})");
       }),
       "PNGs of ids"});
  return samples;
}

}  // namespace semfoam
