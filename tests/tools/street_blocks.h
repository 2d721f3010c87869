// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/edit/model_sites.h"
#include "foam/model/model.h"
#include "foam/train/checkpoint.h"
#include "foam/train/space_blocks.h"
#include "foam/util/number_text.h"
#include "tools/controllers/training_log.h"

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <span>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

// A folder of trained blocks, as scene_splitter and foam_trainer leave it, of any foam and without
// a training.
namespace semfoam {

// The array of a checkpoint with the rows of these sites.
template <typename T>
std::vector<T> RowsOf(const T* values, size_t stride, const std::vector<uint32_t>& sites) {
  std::vector<T> rows;
  rows.reserve(stride * sites.size());
  for (const uint32_t site : sites) {
    rows.insert(rows.end(), values + site * stride, values + (site + 1) * stride);
  }
  return rows;
}

// Writes the result of a block with these sites: what an export reads, and the moments of training,
// which are most of a real one's bytes.
inline void WriteBlockResult(const std::filesystem::path& path,
                             const Foam& foam,
                             const std::vector<uint32_t>& sites,
                             const std::string& split,
                             const std::string& name) {
  CheckpointContents contents;
  contents.texts["block"] = {{"split", split}, {"name", name}};
  contents.texts["state"] = {{"sites", FormatNumber(sites.size())},
                             {"classes", FormatNumber(foam.num_classes)},
                             {"sh_degree", FormatNumber(foam.sh_degree)},
                             {"iteration", "2"}};
  const auto positions = RowsOf(foam.positions.data(), 1, sites);
  const auto density = RowsOf(foam.raw_density.data(), 1, sites);
  const auto sh = RowsOf(foam.sh.data(), foam.ShStride(), sites);
  const auto identity = RowsOf(foam.identity.data(), kIdentityDim, sites);
  const std::vector<float> moments(sites.size() * (3 + 1 + foam.ShStride() + kIdentityDim));
  const auto add = [&](const char* array, const auto& values) {
    contents.arrays.push_back({array, std::as_bytes(std::span(values))});
  };
  add("positions", positions);
  add("raw_density", density);
  add("sh", sh);
  add("identity", identity);
  add("ancestor", sites);
  add("first_moments", moments);
  add("second_moments", moments);
  WriteCheckpoint(path, contents);
}

// Writes the polished sites of a block, and its log.
inline void WritePolishedBlock(const std::filesystem::path& folder,
                               const Model& model,
                               const std::vector<uint32_t>& sites,
                               const std::string& split,
                               const std::string& name) {
  Model polished = WithSites(model, sites);
  polished.options["split"] = split;
  polished.options["block"] = name;
  WriteModel(folder / "polished.foam", polished);
  TrainingProgress coarse, end;
  coarse.iteration = 1;
  coarse.rays = 1000;
  coarse.seconds = 1;
  coarse.sites = static_cast<int64_t>(model.foam.NumSites());
  end.iteration = 3;
  end.rays = 1500;
  end.seconds = 3;
  end.sites = static_cast<int64_t>(sites.size());
  std::ofstream(folder / "training_log.csv") << FormatTrainingLog({coarse, end});
}

// Cuts a model into columns x rows blocks, all trained and, if asked for, polished, in the folder
// `blocks_path`.
inline void WriteTrainedBlocks(const std::filesystem::path& blocks_path,
                               const Model& model,
                               int columns,
                               int rows,
                               float halo,
                               bool are_polished = false) {
  const Foam& foam = model.foam;
  const std::string split = "of a test";
  const std::vector<BlockBox> boxes =
      SplitSpace(foam.positions, std::vector<double>(foam.NumSites(), 1.0), columns, rows);
  nlohmann::json blocks = nlohmann::json::array();
  for (const BlockBox& box : boxes) {
    char name[16];
    std::snprintf(name, sizeof(name), "%02zu", blocks.size());
    std::vector<uint32_t> sites;
    for (uint32_t i = 0; i < foam.NumSites(); ++i) {
      if (box.Contains(foam.positions[i])) sites.push_back(i);
    }
    std::filesystem::create_directories(blocks_path / name);
    WriteBlockResult(blocks_path / name / "block.ckpt", foam, sites, split, name);
    if (are_polished) WritePolishedBlock(blocks_path / name, model, sites, split, name);
    const auto corner = [](const Eigen::Vector3f& x) {
      nlohmann::json json = nlohmann::json::array();
      for (const float value : x) {
        json.push_back(std::isfinite(value) ? nlohmann::json(value) : nlohmann::json());
      }
      return json;
    };
    blocks.push_back({{"name", name},
                      {"low", corner(box.low)},
                      {"high", corner(box.high)},
                      {"own_sites", sites.size()},
                      {"sites", sites.size()},
                      {"ray_share", 1.0},
                      {"memory_bytes", 0},
                      {"seconds", 0.0},
                      {"photos", nlohmann::json::array()}});
  }
  Model run = model;
  run.foam = {};
  run.foam.sh_degree = foam.sh_degree;
  run.foam.num_classes = foam.num_classes;
  run.foam.classifier_weight = foam.classifier_weight;
  run.foam.classifier_bias = foam.classifier_bias;
  run.options["split"] = split;
  WriteModel(blocks_path / "run.foam", run);
  std::ofstream(blocks_path / "effects.json") << nlohmann::json({{"version", 1}, {"effects", {}}});
  std::ofstream(blocks_path / "blocks.json") << nlohmann::json({{"version", 2},
                                                                {"split", split},
                                                                {"split_iteration", 1},
                                                                {"merge_iteration", 2},
                                                                {"num_iterations", 3},
                                                                {"halo", halo},
                                                                {"polishes_blocks", are_polished},
                                                                {"blocks", blocks}});
}

}  // namespace semfoam
