// SPDX-License-Identifier: GPL-3.0-or-later
//
// --device: the same training on the machine's cores and on a graphics card, if there is one.
#include "tests/tools/program.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

using testing::AnyOf;
using testing::HasSubstr;

struct Quality {
  double psnr, miou;
};

// Trains the table on a device and scores it on the held-out photos, on the same device.
Outcome TrainAndScore(const TempFolder& folder, const std::string& device, Quality* quality) {
  const std::string output = folder / device;
  const Outcome trained = RunSemfoam(TinyTraining({"foam_trainer",
                                                   "--image_path",
                                                   (kTabletop / "images").string(),
                                                   "--input_path",
                                                   (kTabletop / "sparse" / "0").string(),
                                                   "--output_path",
                                                   output,
                                                   "--device",
                                                   device,
                                                   "--test_every",
                                                   "4",
                                                   "--FoamTraining.num_rays",
                                                   "2000000"}));
  if (trained.exit_code != 0) return trained;
  const std::string scores = folder / (device + ".json");
  const Outcome scored = RunSemfoam({"foam_evaluator",
                                     "--foam_path",
                                     output + "/scene.foam",
                                     "--image_path",
                                     (kTabletop / "images").string(),
                                     "--device",
                                     device,
                                     "--json_path",
                                     scores});
  if (scored.exit_code != 0) return scored;
  const auto json = nlohmann::json::parse(ReadFile(scores));
  *quality = {json.at("psnr"), json.at("prompt").at("mIoU")};
  return scored;
}

TEST(Device, TrainsAsWellOnACardAsOnTheCores) {
  const TempFolder folder;
  Quality card{}, cores{};
  const Outcome on_card = TrainAndScore(folder, "cuda:0", &card);
  if (on_card.exit_code != 0) {
    ASSERT_EQ(on_card.exit_code, 1);
    ASSERT_THAT(on_card.err,
                AnyOf(HasSubstr("built without CUDA"), HasSubstr("no graphics card here")));
    EXPECT_FALSE(std::filesystem::exists(folder / "cuda:0" / "scene.foam"));
    GTEST_SKIP() << on_card.err;
  }
  const Outcome on_cores = TrainAndScore(folder, "cpu", &cores);
  ASSERT_EQ(on_cores.exit_code, 0) << on_cores.err;
  EXPECT_NEAR(card.psnr, cores.psnr, 0.1);
  EXPECT_NEAR(card.miou, cores.miou, 0.02);
}

}  // namespace
}  // namespace semfoam
