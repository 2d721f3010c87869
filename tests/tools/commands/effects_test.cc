// SPDX-License-Identifier: GPL-3.0-or-later
//
// The probe as users meet it, and that what is off costs nothing.
#include "foam/image/srgb.h"
#include "foam/model/model.h"
#include "plugin/photo/photo.h"

#include <filesystem>
#include <utility>

#include "tests/tools/program.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::HasSubstr;

std::vector<std::string> Arguments(const std::string& command,
                                   const fs::path& output,
                                   const std::vector<std::string>& more) {
  std::vector<std::string> arguments = TrainerOn(kTabletop,
                                                 output,
                                                 {"--test_every",
                                                  "8",
                                                  "--FoamTraining.num_rays",
                                                  "20000",
                                                  "--FoamTraining.final_sites",
                                                  "2000"});
  arguments[0] = command;
  arguments.insert(arguments.end(), more.begin(), more.end());
  return TinyTraining(arguments);
}

struct Trained {
  Model model;
  uint64_t bytes = 0;
  json effects;
};

Trained Train(const std::vector<std::string>& more) {
  const TempFolder folder;
  const Outcome outcome = RunSemfoam(Arguments("foam_trainer", folder / "out", more));
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  Trained trained;
  trained.model = ReadModel(folder / "out/scene.foam");
  trained.bytes = fs::file_size(folder / "out/scene.foam");
  trained.effects = json::parse(ReadFile(folder / "out/effects.json"));
  return trained;
}

// Position, density, colour, contribution and mean colour, identity.
uint64_t BytesPerSite(int sh_degree, bool color_gradients, bool semantics) {
  return 12 + 4 + 12 * (sh_degree + 1) * (sh_degree + 1) + (color_gradients ? 36 : 0) + 4 + 12 +
         (semantics ? 64 : 0);
}

TEST(Effects, AnalyzerPrintsTheTableAndWritesTheFile) {
  const TempFolder folder;
  const Outcome outcome = RunSemfoam(Arguments("scene_analyzer", folder / "out", {}));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  for (const char* part : {"effect",
                           "evidence",
                           "what it costs",
                           "exposure       off",
                           "white_balance  off",
                           "vignetting     off",
                           "sh_degree      2",
                           "blur           off",
                           "distortion     off",
                           "semantics      on",
                           "background     off",
                           "64 of 64 photos have a mask"}) {
    EXPECT_THAT(outcome.out, HasSubstr(part));
  }
  EXPECT_EQ(FilesBelow(folder / "out"), std::vector<std::string>{"effects.json"});
  const json effects = json::parse(ReadFile(folder / "out/effects.json"));
  EXPECT_EQ(effects["version"], 1);
  EXPECT_EQ(effects["effects"].size(), 8u);
  EXPECT_EQ(effects["effects"][0]["effect"], "exposure");
  EXPECT_EQ(effects["effects"][0]["decided_by"], "probe");
  EXPECT_LT(effects["effects"][0]["measures"]["bic_gain"], 0);
  EXPECT_EQ(effects["sh_degree"], 2);
  EXPECT_FALSE(effects.contains("photos"));
}

TEST(Effects, WhatIsOffTakesNoBytes) {
  const Trained most = Train(
      {"--FoamTraining.sh_degree", "3", "--Effects.sh_degree", "on", "--Effects.exposure", "on"});
  const Trained least = Train({"--FoamTraining.sh_degree",
                               "0",
                               "--FoamTraining.color_gradient_rate",
                               "0",
                               "--Effects.semantics",
                               "off"});
  EXPECT_EQ(most.model.foam.sh_degree, 3);
  EXPECT_TRUE(most.model.foam.HasSemantics());
  EXPECT_EQ(most.model.options.at("exposure"), "1");
  EXPECT_EQ(most.effects["photos"].size(), 64u);
  EXPECT_EQ(most.effects["effects"][0]["decided_by"], "option");

  const Foam& foam = least.model.foam;
  EXPECT_EQ(foam.sh_degree, 0);
  EXPECT_EQ(least.model.options.at("sh_degree"), "0");
  EXPECT_FALSE(least.model.options.contains("exposure"));
  EXPECT_FALSE(least.model.options.contains("vignetting"));
  EXPECT_FALSE(least.effects.contains("photos"));
  EXPECT_TRUE(foam.identity.empty());
  EXPECT_TRUE(foam.classifier_weight.empty());
  EXPECT_EQ(foam.sh.size(), 3 * foam.NumSites());
  EXPECT_TRUE(foam.color_gradient.empty());
  EXPECT_TRUE(most.model.foam.HasColorGradients());

  // To the last byte a site; beside the sites lie the head, the classifier and the photos.
  constexpr uint64_t kBeside = 64'000;
  const uint64_t most_bytes = most.model.foam.NumSites() * BytesPerSite(3, true, true);
  const uint64_t least_bytes = foam.NumSites() * BytesPerSite(0, false, false);
  EXPECT_GE(most.bytes, most_bytes);
  EXPECT_LT(most.bytes, most_bytes + kBeside);
  EXPECT_GE(least.bytes, least_bytes);
  EXPECT_LT(least.bytes, least_bytes + kBeside);
}

// A decision of the probe's is as good as the user's: not a byte of it remains.
TEST(Effects, OffByTheProbeIsOffByOption) {
  const TempFolder folder;
  const auto foam_of = [&](const std::string& name, const std::vector<std::string>& more) {
    const Outcome outcome = RunSemfoam(Arguments("foam_trainer", folder / name, more));
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return ReadFile(folder / (name + "/scene.foam"));
  };
  const std::string by_probe = foam_of("probe", {});
  const std::string by_option = foam_of("option",
                                        {"--Effects.exposure",
                                         "off",
                                         "--Effects.shading",
                                         "off",
                                         "--Effects.transients",
                                         "off",
                                         "--Effects.sky",
                                         "off",
                                         "--Effects.blur",
                                         "off",
                                         "--Effects.poses",
                                         "off",
                                         "--Effects.vignetting",
                                         "off",
                                         "--Effects.distortion",
                                         "off",
                                         "--FoamTraining.sh_degree",
                                         "2"});
  EXPECT_FALSE(by_probe.empty());
  EXPECT_TRUE(by_probe == by_option);
}

// Mean linear light of a picture.
double MeanLight(const fs::path& path) {
  const Image8 picture = ReadPhoto(path);
  double sum = 0;
  for (const uint8_t value : picture.data) sum += LinearFromDisplay(value / 255.0);
  return sum / static_cast<double>(picture.data.size());
}

TEST(Effects, ViewsAreRenderedInTheLightOfTheirPhotos) {
  const TempFolder folder;
  Outcome outcome =
      RunSemfoam(Arguments("foam_trainer", folder / "out", {"--Effects.exposure", "on"}));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  // All photos darkened but one, and what is said of a held-out one is not believed.
  const fs::path effects_path = folder / "out/effects.json";
  json effects = json::parse(ReadFile(effects_path));
  ASSERT_EQ(effects["photos"].size(), 64u);
  std::string held_out, bright;
  for (auto& [name, photo] : effects["photos"].items()) {
    photo["gain"] = {0.8, 0.8, 0.8};
    (photo["held_out"] ? held_out : bright) = name;
  }
  effects["photos"][held_out]["gain"] = {2, 2, 2};
  effects["photos"][bright]["gain"] = {1.2, 1.2, 1.2};
  WriteFile(effects_path, effects.dump());
  WriteFile(folder / "views.txt", held_out + "\n" + bright + "\n");

  const auto render = [&](const std::string& target, const std::vector<std::string>& more) {
    std::vector<std::string> arguments = {"foam_renderer",
                                          "--foam_path",
                                          (folder / "out/scene.foam").string(),
                                          "--input_path",
                                          (kTabletop / "sparse/0").string(),
                                          "--output_path",
                                          (folder / target).string(),
                                          "--views",
                                          (folder / "views.txt").string()};
    arguments.insert(arguments.end(), more.begin(), more.end());
    outcome = RunSemfoam(arguments);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    const auto light_of = [&](const std::string& name) {
      return MeanLight(folder / target / "rgb" / fs::path(name).replace_extension(".png"));
    };
    return std::pair(light_of(held_out), light_of(bright));
  };
  const auto lit = render("lit", {});
  const auto reference = render("reference", {"--light", "reference"});
  // Neighbours that are bright may add to it; white stays white.
  EXPECT_GT(lit.first / reference.first, 0.78);
  EXPECT_LT(lit.first / reference.first, 0.95);
  EXPECT_GT(lit.second / reference.second, 1.1);
  EXPECT_LE(lit.second / reference.second, 1.21);

  WriteFile(effects_path, R"({"photos": 3})");
  outcome = RunSemfoam({"foam_renderer",
                        "--foam_path",
                        (folder / "out/scene.foam").string(),
                        "--input_path",
                        (kTabletop / "sparse/0").string(),
                        "--output_path",
                        (folder / "damaged").string()});
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_THAT(outcome.err, HasSubstr("its photos are no table by name"));
  EXPECT_FALSE(fs::exists(folder / "damaged/rgb"));

  fs::remove(effects_path);
  EXPECT_EQ(render("without", {}), reference);
  EXPECT_THAT(outcome.err, HasSubstr("effects.json: there is no light of photos"));
}

TEST(Effects, ContradictionsAreRefused) {
  const TempFolder folder;
  Outcome outcome =
      RunSemfoam(Arguments("scene_analyzer",
                           folder / "out",
                           {"--Effects.exposure", "off", "--Effects.white_balance", "on"}));
  EXPECT_EQ(outcome.exit_code, 1);
  ASSERT_EQ(outcome.Errors().size(), 1u);
  EXPECT_THAT(outcome.Errors()[0], HasSubstr("--Effects.white_balance on needs exposure"));
  outcome = RunSemfoam(Arguments("scene_analyzer", folder / "out", {"--Effects.semantics", "on"}));
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_THAT(outcome.err, HasSubstr("'--Effects.semantics' is invalid; it takes {auto, off}"));
  EXPECT_TRUE(FilesBelow(folder / "out").empty());
}

}  // namespace
}  // namespace semfoam
