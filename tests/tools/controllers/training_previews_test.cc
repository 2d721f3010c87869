// SPDX-License-Identifier: GPL-3.0-or-later
//
// Trainings that are looked at while they run.
#include "tools/controllers/training_previews.h"

#include "tools/controllers/training_run.h"

#include <cstdlib>
#include <filesystem>
#include <functional>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "tests/tools/program.h"
#include <OpenImageIO/imageio.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

class PreviewsTest : public testing::Test {
 protected:
  // Trains for 30 iterations with a preview after each, or without. `looks`: called between the
  // iterations.
  static void Train(const fs::path& output,
                    bool previews,
                    const std::function<void(int64_t)>& looks = {},
                    const CheckpointOptions& more = {}) {
    TrainingRun run;
    run.training.num_rays = 30 * 2048;
    run.training.rays_per_iteration = 2048;
    run.training.initial_sites = 800;
    run.training.final_sites = 1500;
    run.sweep_photos = 0;
    run.scene.test_every = 8;
    CompleteFromWorkspace(kTabletop, &run);
    CompleteTrainingRun(&run);
    run.between_iterations = [&](int64_t iteration, const auto&) {
      if (looks) looks(iteration);
    };
    CheckpointOptions checkpoints = more;
    checkpoints.every = 1e-6;
    checkpoints.preview_every = previews ? 1e-6 : 0;
    TrainingFolder folder(output, checkpoints, "");
    TrainAndWrite(&folder, &run);
    folder.Finish();
  }

  static std::set<std::string> FilesOf(const fs::path& folder) {
    std::set<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder)) {
      names.insert(entry.path().filename().string());
    }
    return names;
  }

  const TempFolder folder_;
};

TEST_F(PreviewsTest, AreWrittenWithAPageThatReloadsItselfUntilTheEnd) {
  const fs::path previews = folder_ / "out/previews";
  Train(folder_ / "out", true, [&](int64_t iteration) {
    if (iteration != 12) return;
    EXPECT_THAT(ReadFile(previews / "index.html"),
                AllOf(HasSubstr("http-equiv=\"refresh\" content=\"1\""),
                      HasSubstr("src=\"000012.png\""),
                      HasSubstr("href=\"000011.png\""),
                      HasSubstr("iteration 12")));
  });
  EXPECT_THAT(ReadFile(previews / "index.html"),
              AllOf(Not(HasSubstr("refresh")),
                    HasSubstr("src=\"000030.png\""),
                    HasSubstr("Trained: iteration 30/30")));
  const std::set<std::string> files = FilesOf(previews);
  EXPECT_EQ(files.size(), 31u);
  EXPECT_EQ(*files.begin(), "000001.png");

  // The photo, the foam and its labels, side by side.
  const auto picture = OIIO::ImageInput::open((previews / "000030.png").string());
  ASSERT_NE(picture, nullptr) << OIIO::geterror();
  const int width = picture->spec().width / 3, height = picture->spec().height;
  EXPECT_EQ(std::pair(width, height), std::pair(320, 240));
  EXPECT_EQ(picture->spec().width % 3, 0);
  std::vector<uint8_t> data(9 * size_t{1} * width * height);
  ASSERT_TRUE(picture->read_image(0, 0, 0, 3, OIIO::TypeDesc::UINT8, data.data()));
  const auto photo = OIIO::ImageInput::open((kTabletop / "images/0000.jpg").string());
  ASSERT_NE(photo, nullptr) << OIIO::geterror();
  std::vector<uint8_t> photo_data(3 * size_t{1} * width * height);
  ASSERT_TRUE(photo->read_image(0, 0, 0, 3, OIIO::TypeDesc::UINT8, photo_data.data()));
  double error = 0, error_of_white = 0;
  for (int y = 0; y < height; ++y) {
    for (int i = 0; i < 3 * width; ++i) {
      const int truth = photo_data[y * 3 * width + i];
      ASSERT_EQ(data[y * 9 * width + i], truth);
      error += std::abs(data[y * 9 * width + 3 * width + i] - truth);
      error_of_white += 255 - truth;
    }
  }
  // So short a training shows something.
  EXPECT_LT(error, 0.6 * error_of_white);
}

TEST_F(PreviewsTest, ChangeNothing) {
  Train(folder_ / "with", true);
  Train(folder_ / "without", false);
  EXPECT_TRUE(ReadFile(folder_ / "with/scene.foam") == ReadFile(folder_ / "without/scene.foam"));
  EXPECT_FALSE(fs::exists(folder_ / "without/previews"));
}

TEST_F(PreviewsTest, OfAnEarlierTrainingAreReplacedAndOfAResumedOneKept) {
  const fs::path output = folder_ / "out", previews = output / "previews";
  const auto stop = [](int64_t iteration) {
    if (iteration == 20) throw std::runtime_error("stopped");
  };
  EXPECT_THROW(Train(output, true, stop), std::runtime_error);
  WriteFile(previews / "000099.png", ReadFile(previews / "000020.png"));
  WriteFile(previews / "mine.txt", "mine");
  Train(output, true, {}, {.resume = true});
  std::set<std::string> files = FilesOf(previews);
  EXPECT_EQ(files.count("000001.png"), 1u);
  EXPECT_EQ(files.count("000030.png"), 1u);
  EXPECT_EQ(files.count("000099.png"), 0u);
  WriteFile(previews / "000099.png", ReadFile(previews / "000020.png"));
  Train(output,
        true,
        [&](int64_t iteration) {
          if (iteration == 1) {
            EXPECT_THAT(FilesOf(previews),
                        testing::ElementsAre("000001.png", "index.html", "mine.txt"));
          }
        },
        {.overwrite = true});
}

TEST_F(PreviewsTest, DoNotReplaceAPageOfSomeoneElse) {
  const fs::path page = folder_ / "out/previews/index.html";
  fs::create_directories(page.parent_path());
  WriteFile(page, "<!DOCTYPE html>\n<title>Mine</title>\n");
  const Outcome outcome =
      RunSemfoam(TrainerOn(kTabletop, folder_ / "out", {"--preview_every", "1"}));
  ExpectRefused(outcome, {"previews/index.html", {"output_path"}, "was not written by a training"});
  EXPECT_EQ(ReadFile(page), "<!DOCTYPE html>\n<title>Mine</title>\n");
  EXPECT_FALSE(fs::exists(folder_ / "out/scene.foam"));
}

}  // namespace
}  // namespace semfoam
