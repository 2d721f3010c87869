// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/model/model.h"
#include "foam/util/error.h"
#include "foam/util/random.h"

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <utility>

#include "tests/foam/random_cells.h"
#include <gtest/gtest.h>
#include <unistd.h>

#define XXH_INLINE_ALL
#include <xxhash.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

class ModelFile : public testing::Test {
 protected:
  ModelFile() {
    folder_ =
        fs::temp_directory_path() /
        ("semfoam_" + std::string(testing::UnitTest::GetInstance()->current_test_info()->name()) +
         std::to_string(::getpid()));
    fs::create_directories(folder_);
    path_ = folder_ / "scene.foam";
  }
  ~ModelFile() override { fs::remove_all(folder_); }

  static Model SmallModel(bool semantics) {
    Model model;
    Foam& foam = model.foam;
    foam.sh_degree = 1;
    foam.num_classes = semantics ? 2 : 0;
    foam.positions = RandomSites(5, 1);
    CounterRandom random(1, 0x91, 0);
    const auto fill = [&](size_t n, auto* out) {
      for (size_t i = 0; i < n; ++i) out->push_back(static_cast<float>(random.Normal()));
    };
    fill(5, &foam.raw_density);
    fill(5 * foam.ShStride(), &foam.sh);
    if (semantics) {
      foam.assumed_density = {0, 2.5f, 0, 1e4f, 0};
      fill(5 * kColorGradientDim, &foam.color_gradient);
      fill(5 * kIdentityDim, &foam.identity);
      fill(2 * kIdentityDim, &foam.classifier_weight);
      fill(2, &foam.classifier_bias);
      model.labels = {{LabelId{1}, MaskId{1}, "mug"},
                      {LabelId{2}, MaskId{70000}, "caf\u00e9 \"quoted\""}};
    }
    fill(5, &model.statistics.contribution);
    model.statistics.mean_color.assign(5, Eigen::Vector3f(0.25f, 0.5f, 0.75f));
    fill(5, &model.statistics.passed);
    fill(5, &model.statistics.stopped);
    model.world_from_normalized = {3.25, {5e5 + 0.001, 4.5e6 - 1.0 / 3, 300}};
    PhotoRecord photo;
    photo.name = "a/b c.jpg";
    photo.camera_model = "SIMPLE_RADIAL";
    photo.width = 640;
    photo.height = 480;
    photo.camera_params = {512.25, 320, 240, 0.1 / 3};
    photo.cam_from_world_rotation = Eigen::Quaterniond(0.5, 0.5, -0.5, 0.5);
    photo.cam_from_world_translation = {1.0 / 3, 2, -3};
    photo.held_out = true;
    model.photos = {photo};
    model.options = {{"num_rays", "100"}};
    return model;
  }

  std::string Bytes() const {
    std::ifstream in(path_, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  void SetBytes(const std::string& bytes) const { std::ofstream(path_, std::ios::binary) << bytes; }
  // Puts a right checksum under changed bytes, so that the checks behind it are reached.
  void SetBytesWithChecksum(std::string bytes) const {
    bytes.resize(bytes.size() - 8);
    const uint64_t hash = XXH64(bytes.data(), bytes.size(), 0);
    bytes.append(reinterpret_cast<const char*>(&hash), 8);
    SetBytes(bytes);
  }

  fs::path folder_, path_;
};

TEST_F(ModelFile, ANegativeAssumedDensityIsAnError) {
  Model model = SmallModel(/*semantics=*/true);
  model.foam.assumed_density[1] = -1;
  WriteModel(path_, model);
  EXPECT_THROW(ReadModel(path_), UserError);
}

TEST_F(ModelFile, ComesBackAsItWas) {
  for (const bool semantics : {true, false}) {
    const Model model = SmallModel(semantics);
    WriteModel(path_, model);
    const Model back = ReadModel(path_);
    EXPECT_EQ(back.foam.sh_degree, model.foam.sh_degree);
    EXPECT_EQ(back.foam.num_classes, model.foam.num_classes);
    EXPECT_EQ(back.foam.positions, model.foam.positions);
    EXPECT_EQ(back.foam.raw_density, model.foam.raw_density);
    EXPECT_EQ(back.foam.assumed_density, model.foam.assumed_density);
    EXPECT_EQ(back.foam.sh, model.foam.sh);
    EXPECT_EQ(back.foam.color_gradient, model.foam.color_gradient);
    EXPECT_EQ(back.foam.identity, model.foam.identity);
    EXPECT_EQ(back.foam.classifier_weight, model.foam.classifier_weight);
    EXPECT_EQ(back.foam.classifier_bias, model.foam.classifier_bias);
    EXPECT_EQ(back.statistics.contribution, model.statistics.contribution);
    EXPECT_EQ(back.statistics.mean_color, model.statistics.mean_color);
    EXPECT_EQ(back.statistics.passed, model.statistics.passed);
    EXPECT_EQ(back.statistics.stopped, model.statistics.stopped);
    EXPECT_EQ(back.world_from_normalized.scale, model.world_from_normalized.scale);
    EXPECT_EQ(back.world_from_normalized.translation, model.world_from_normalized.translation);
    ASSERT_EQ(back.labels.size(), model.labels.size());
    for (size_t k = 0; k < back.labels.size(); ++k) {
      EXPECT_EQ(back.labels[k].id, model.labels[k].id);
      EXPECT_EQ(back.labels[k].source_id, model.labels[k].source_id);
      EXPECT_EQ(back.labels[k].name, model.labels[k].name);
    }
    ASSERT_EQ(back.photos.size(), 1u);
    EXPECT_EQ(back.photos[0].name, model.photos[0].name);
    EXPECT_EQ(back.photos[0].camera_model, model.photos[0].camera_model);
    EXPECT_EQ(back.photos[0].camera_params, model.photos[0].camera_params);
    EXPECT_EQ(back.photos[0].cam_from_world_rotation.coeffs(),
              model.photos[0].cam_from_world_rotation.coeffs());
    EXPECT_EQ(back.photos[0].cam_from_world_translation,
              model.photos[0].cam_from_world_translation);
    EXPECT_TRUE(back.photos[0].held_out);
    EXPECT_EQ(back.options, model.options);
  }
}

TEST_F(ModelFile, KeepsWhatIsKnownOfLabels) {
  Model model = SmallModel(true);
  WriteModel(path_, model);
  const size_t without = Bytes().size();
  model.labels[0].features = {"mug", 1.0 / 3, {0.6f, -0.8f, 0}};
  model.labels[1].features = {"", 0.25, {}};
  WriteModel(path_, model);
  EXPECT_GT(Bytes().size(), without);
  for (size_t k = 0; k < 2; ++k) {
    EXPECT_EQ(ReadModel(path_).labels[k].features, model.labels[k].features);
  }
  model.labels[1].features.embedding = {0, 0, 1};
  WriteModel(path_, model);
  for (size_t k = 0; k < 2; ++k) {
    EXPECT_EQ(ReadModel(path_).labels[k].features, model.labels[k].features);
  }
  model.labels[1].features.embedding = {0, 1};
  EXPECT_DEATH(WriteModel(path_, model), "different lengths");
}

TEST_F(ModelFile, WithDamagedFeaturesIsRefused) {
  Model model = SmallModel(true);
  model.labels[0].features = {"mug", 0.5, {0.6f, -0.8f}};
  WriteModel(path_, model);
  const std::string whole = Bytes();
  // Same-length edits of the JSON header.
  const std::pair<std::string, std::string> edits[] = {
      {"\"embedding_dimension\": 2", "\"embedding_dimension\": 9"},
      {"\"embedding_dimension\": 2", "\"embedding_dimension\": 0"},
      {"\"embedding_dimension\"", "\"embedding-dimension\""},
      {"\"has_embedding\": true", "\"has_embeddinx\": true"},
      {"\"has_embedding\": true", "\"has_embedding\": 1234"},
      {"\"score\": 0.5", "\"score\": -35"},
      {"\"class\": \"mug\"", "\"class\": 12345"}};
  for (const auto& [from, to] : edits) {
    std::string damaged = whole;
    const size_t at = damaged.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    damaged.replace(at, from.size(), to);
    SetBytesWithChecksum(damaged);
    EXPECT_THROW(ReadModel(path_), UserError) << to;
  }
}

// Version 1 is version 2 without colour gradients.
TEST_F(ModelFile, OfVersionOneIsRead) {
  const Model model = SmallModel(false);
  WriteModel(path_, model);
  std::string bytes = Bytes();
  ASSERT_EQ(bytes[8], 2);
  bytes[8] = 1;
  SetBytesWithChecksum(bytes);
  const Model back = ReadModel(path_);
  EXPECT_EQ(back.foam.sh, model.foam.sh);
  EXPECT_FALSE(back.foam.HasColorGradients());
  for (const char unknown : {0, 3}) {
    bytes[8] = unknown;
    SetBytesWithChecksum(bytes);
    EXPECT_THROW(ReadModel(path_), UserError) << int{unknown};
  }
}

TEST_F(ModelFile, IsTheSameBytesForTheSameModel) {
  WriteModel(path_, SmallModel(true));
  const std::string first = Bytes();
  WriteModel(path_, ReadModel(path_));
  EXPECT_EQ(Bytes(), first);
}

TEST_F(ModelFile, CutAnywhereIsRefusedInOneSentence) {
  WriteModel(path_, SmallModel(true));
  const std::string whole = Bytes();
  for (size_t length = 0; length < whole.size(); length += 7) {
    SetBytes(whole.substr(0, length));
    EXPECT_THROW(ReadModel(path_), UserError) << length;
  }
}

TEST_F(ModelFile, AFlippedBitIsRefused) {
  WriteModel(path_, SmallModel(true));
  const std::string whole = Bytes();
  for (size_t at = 0; at < whole.size(); at += 13) {
    std::string damaged = whole;
    damaged[at] ^= 0x10;
    SetBytes(damaged);
    EXPECT_THROW(ReadModel(path_), UserError) << at;
  }
}

TEST_F(ModelFile, ALyingHeaderIsRefusedEvenWithARightChecksum) {
  WriteModel(path_, SmallModel(true));
  const std::string whole = Bytes();
  // Same-length edits of the JSON header.
  const std::pair<std::string, std::string> edits[] = {{"\"sites\": 5", "\"sites\": 9"},
                                                       {"\"classes\": 2", "\"classes\": 7"},
                                                       {"\"sh_degree\": 1", "\"sh_degree\": 9"},
                                                       {"\"float32\"", "\"float64\""},
                                                       {"\"scale\": 3.25", "\"scale\": -9.9"},
                                                       {"\"photos\"", "\"potato\""}};
  for (const auto& [from, to] : edits) {
    std::string damaged = whole;
    const size_t at = damaged.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    damaged.replace(at, from.size(), to.substr(0, from.size()));
    SetBytesWithChecksum(damaged);
    EXPECT_THROW(ReadModel(path_), UserError) << from;
  }
  std::string longer = whole;
  for (int i = 16; i < 24; ++i) longer[i] = '\x7f';  // header length
  SetBytesWithChecksum(longer);
  EXPECT_THROW(ReadModel(path_), UserError);
}

TEST_F(ModelFile, SaysWhatIsMissing) {
  try {
    ReadModel(folder_ / "nowhere.foam");
    FAIL();
  } catch (const UserError& error) {
    EXPECT_NE(std::string(error.what()).find("nowhere.foam"), std::string::npos);
  }
  EXPECT_THROW(ReadModel(folder_), UserError);
}

TEST_F(ModelFile, LeavesTheOldFileWhereItCannotWrite) {
  WriteModel(path_, SmallModel(true));
  Model model = SmallModel(true);
  model.photos[0].name = "not utf-8: \xff";
  const std::string before = Bytes();
  EXPECT_THROW(WriteModel(path_, model), UserError);
  EXPECT_EQ(Bytes(), before);
  EXPECT_THROW(WriteModel(path_ / "below_a_file.foam", SmallModel(true)), UserError);
  size_t files = 0;
  for ([[maybe_unused]] const auto& entry : fs::directory_iterator(folder_)) ++files;
  EXPECT_EQ(files, 1u) << "a temporary file stayed";
}

}  // namespace
}  // namespace semfoam
