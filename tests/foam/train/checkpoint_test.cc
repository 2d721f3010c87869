// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/train/checkpoint.h"

#include "foam/train/checkpoint_state.h"
#include "foam/util/error.h"

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <string>
#include <vector>

#include "tests/mistake.h"
#include "tests/process_state.h"
#include <gtest/gtest.h>
#include <unistd.h>

#define XXH_INLINE_ALL
#include <xxhash.h>

namespace semfoam {
namespace {

class CheckpointTest : public testing::Test {
 protected:
  CheckpointTest() {
    folder_ = std::filesystem::temp_directory_path() /
              ("semfoam_checkpoint_test" + std::to_string(::getpid()));
    std::filesystem::create_directories(folder_);
    path_ = folder_ / "12.ckpt";
    contents_.texts = {{"options", {{"seed", "7"}, {"name", "Täßchen \"7\""}}}, {"empty", {}}};
    contents_.arrays = {{"floats", std::as_bytes(std::span(floats_))},
                        {"nothing", {}},
                        {"bytes", std::as_bytes(std::span(bytes_))}};
    WriteCheckpoint(path_, contents_);
    std::ifstream in(path_, std::ios::binary);
    file_ = {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  }
  ~CheckpointTest() override { std::filesystem::remove_all(folder_); }

  void Overwrite(const std::string& bytes) const {
    std::ofstream(path_, std::ios::binary) << bytes;
  }

  // What reading these bytes as a checkpoint is refused with; empty where it is not.
  std::string Refusal(const std::string& bytes) const {
    Overwrite(bytes);
    return Refusal();
  }
  std::string Refusal() const {
    try {
      const Checkpoint checkpoint(path_);
    } catch (const DamagedCheckpoint& error) {
      return error.what();
    } catch (const UserError& error) {
      return std::string("not damaged: ") + error.what();
    }
    return "";
  }

  // The file with a header of this text, its checksum being right.
  std::string WithHeader(const std::string& header) const {
    std::string bytes = file_.substr(0, 16);
    const uint64_t length = header.size();
    bytes.append(reinterpret_cast<const char*>(&length), 8);
    bytes += header;
    const uint64_t hash = XXH64(bytes.data(), bytes.size(), 0);
    bytes.append(reinterpret_cast<const char*>(&hash), 8);
    return bytes + file_.substr(24 + HeaderBytes() + 8);
  }
  uint64_t HeaderBytes() const {
    uint64_t length = 0;
    std::memcpy(&length, file_.data() + 16, 8);
    return length;
  }
  std::string Header() const { return file_.substr(24, HeaderBytes()); }

  std::vector<float> floats_ = {1, -0.f, 3.25f};
  std::string bytes_ = std::string("a\0b\n", 4);
  CheckpointContents contents_;
  std::filesystem::path folder_, path_;
  std::string file_;
};

TEST_F(CheckpointTest, ReadsWhatItWrote) {
  const Checkpoint checkpoint(path_);
  EXPECT_EQ(checkpoint.Texts("options"), contents_.texts.at("options"));
  EXPECT_TRUE(checkpoint.Texts("none of this name").empty());
  const auto floats = checkpoint.Array("floats");
  ASSERT_EQ(floats.size(), 12u);
  EXPECT_EQ(std::memcmp(floats.data(), floats_.data(), 12), 0);
  EXPECT_EQ(checkpoint.Array("nothing").size(), 0u);
  EXPECT_EQ(std::memcmp(checkpoint.Array("bytes").data(), bytes_.data(), 4), 0);
  EXPECT_TRUE(checkpoint.HasArray("bytes"));
  EXPECT_FALSE(checkpoint.HasArray("byte"));
  EXPECT_THROW(checkpoint.Array("byte"), UserError);
  // Nothing else stays in the folder.
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder_), {}), 1);
  WriteCheckpoint(folder_ / "13.ckpt", contents_);
  std::ifstream again(folder_ / "13.ckpt", std::ios::binary);
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(again), {}), file_) << "other bytes";
}

// Arrays of several pieces, too, are verified where they are not kept.
TEST_F(CheckpointTest, KeepsTheArraysThatAreWanted) {
  const std::vector<char> large(3'000'000, 'x');
  contents_.arrays.push_back({"large", std::as_bytes(std::span(large))});
  WriteCheckpoint(path_, contents_);
  const auto wants_bytes = [](const std::string& name) { return name == "bytes"; };
  const Checkpoint checkpoint(path_, wants_bytes);
  EXPECT_EQ(checkpoint.Texts("options"), contents_.texts.at("options"));
  EXPECT_EQ(std::memcmp(checkpoint.Array("bytes").data(), bytes_.data(), 4), 0);
  for (const char* name : {"floats", "nothing", "large"}) EXPECT_FALSE(checkpoint.HasArray(name));
  std::ifstream in(path_, std::ios::binary);
  std::string bytes = {std::istreambuf_iterator<char>(in), {}};
  bytes[bytes.size() - 1'500'000] = 'y';
  Overwrite(bytes);
  EXPECT_THROW(Checkpoint(path_, wants_bytes), DamagedCheckpoint);
}

// A disk that is full after every byte that there is: the older file stays, and nothing else.
TEST_F(CheckpointTest, WriteThatFailsAtAnyByteKeepsTheOlderFile) {
  std::string others = "z9yx";
  CheckpointContents other = contents_;
  other.arrays[2].bytes = std::as_bytes(std::span(others));
  for (size_t limit = 0; limit <= file_.size(); ++limit) {
    std::string refusal;
    try {
      const FileSizeLimit smaller(limit);
      WriteCheckpoint(path_, other);
    } catch (const UserError& error) {
      refusal = error.what();
    }
    if (limit == file_.size()) {
      EXPECT_EQ(refusal, "");
      break;
    }
    ASSERT_NE(refusal.find("12.ckpt: cannot be written"), std::string::npos) << limit << refusal;
    std::ifstream in(path_, std::ios::binary);
    ASSERT_EQ(std::string(std::istreambuf_iterator<char>(in), {}), file_) << limit;
    ASSERT_EQ(std::distance(std::filesystem::directory_iterator(folder_), {}), 1) << limit;
  }
  const Checkpoint written(path_);
  EXPECT_EQ(std::memcmp(written.Array("bytes").data(), "z9yx", 4), 0);
}

TEST_F(CheckpointTest, RefusesEveryCut) {
  for (size_t length = 0; length < file_.size(); ++length) {
    const std::string text = Refusal(file_.substr(0, length));
    ASSERT_NE(text.find("12.ckpt: this "), std::string::npos) << length << ": " << text;
    ASSERT_EQ(text.find("not damaged"), std::string::npos) << length << ": " << text;
  }
  EXPECT_NE(Refusal(file_ + '\0').find("longer than its arrays"), std::string::npos);
  EXPECT_EQ(Refusal(file_), "");
}

TEST_F(CheckpointTest, RefusesEveryChangedByte) {
  for (size_t i = 0; i < file_.size(); ++i) {
    std::string bytes = file_;
    bytes[i] ^= 0x10;
    const std::string text = Refusal(bytes);
    ASSERT_NE(text, "") << "byte " << i;
    // A version is believed: what is of another one may be whole.
    const bool is_version = i >= 8 && i < 12;
    ASSERT_EQ(text.find("not damaged") != std::string::npos, is_version) << i << ": " << text;
  }
}

// Of another version nothing but the number is known: neither where its checksums lie nor how long
// its header is.
TEST_F(CheckpointTest, AnotherVersionIsNotDamaged) {
  for (const uint32_t version : {0u, kCheckpointVersion + 1, 0xffffffffu}) {
    std::string bytes = file_;
    std::memcpy(&bytes[8], &version, sizeof(version));
    const auto names_version = NamesMistake(
        "not damaged: " + path_.string(),
        {"version " + std::to_string(version), "version " + std::to_string(kCheckpointVersion)},
        "format version");
    EXPECT_THAT(Refusal(bytes), names_version);
    EXPECT_THAT(Refusal(bytes.substr(0, 12)), names_version);
    EXPECT_THAT(Refusal(bytes.substr(0, 12) + std::string(1000, '\xff')), names_version);
  }
}

// A file that cannot be read may be whole, too.
TEST_F(CheckpointTest, AFailedReadIsNoDamage) {
  std::filesystem::remove(path_);
  EXPECT_NE(Refusal().find("not damaged: " + path_.string() + ": there is no such file"),
            std::string::npos);
  // Nothing lies at its beginning, where the kernel gives EIO, as for a block that a disk has lost.
  std::filesystem::create_symlink("/proc/self/mem", path_);
  EXPECT_NE(
      Refusal().find("not damaged: " + path_.string() + ": cannot be read (Input/output error)"),
      std::string::npos)
      << Refusal();
  std::filesystem::remove(path_);
  std::filesystem::create_directory(path_);
  EXPECT_NE(Refusal().find("not damaged: " + path_.string() + ": is a folder"), std::string::npos);
}

TEST_F(CheckpointTest, SaysWhatIsWrong) {
  const auto changed = [&](size_t at, char to) {
    std::string bytes = file_;
    bytes[at] = to;
    return Refusal(bytes);
  };
  const auto expect = [](const std::string& text, const std::string& part) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  };
  expect(changed(0, 'X'), "no checkpoint");
  expect(changed(8, 1),
         "format version 1, and this program reads version " + std::to_string(kCheckpointVersion));
  expect(changed(23, 127), "its header is longer than the file");
  expect(changed(30, '!'), "its header has another checksum");
  const size_t arrays = 24 + HeaderBytes() + 8;
  expect(changed(arrays, 1), "its array 'floats' has another checksum");
  expect(changed(arrays + 12, 1), "its array 'floats' has another checksum");
  expect(changed(arrays + 12 + 8, 1), "its array 'nothing' has another checksum");
  expect(changed(arrays + 12 + 8 + 8, 1), "its array 'bytes' has another checksum");
  expect(changed(file_.size() - 16, 'X'), "its end is not there");
  expect(changed(file_.size() - 8, 'X'), "its end is not there");
  expect(Refusal(""), "no checkpoint");
  std::filesystem::remove(path_);
  EXPECT_THROW(Checkpoint{path_}, UserError);
  std::filesystem::create_directory(path_);
  EXPECT_THROW(Checkpoint{path_}, UserError);
}

// The header's checksum is right, and still nothing in it is believed.
TEST_F(CheckpointTest, BelievesNoHeader) {
  EXPECT_EQ(Refusal(WithHeader(Header())), "");
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string header = Header();
    const size_t at = header.find(from);
    EXPECT_NE(at, std::string::npos) << from << " in " << header;
    header.replace(at, from.size(), to);
    return Refusal(WithHeader(header));
  };
  for (const char* count : {"13", "1000000", "4611686018427387904", "18446744073709551615"}) {
    const std::string text = with("\"bytes\": 12", std::string("\"bytes\": ") + count);
    EXPECT_NE(text.find("this checkpoint is cut or damaged"), std::string::npos) << text;
  }
  for (const char* count : {"-1", "\"12\"", "null", "1e300"}) {
    EXPECT_NE(with("\"bytes\": 12", std::string("\"bytes\": ") + count), "") << count;
  }
  EXPECT_NE(with("\"nothing\"", "\"floats\"").find("two arrays 'floats'"), std::string::npos);
  for (const char* header : {"",
                             "{}",
                             "[]",
                             "nonsense",
                             R"({"texts": {}, "arrays": {}})",
                             R"({"texts": {"a": 1}, "arrays": []})"}) {
    EXPECT_NE(Refusal(WithHeader(header)), "") << header;
  }
  EXPECT_NE(Refusal(WithHeader(std::string(100'000, '['))), "");
}

TEST_F(CheckpointTest, RefusesTextThatIsNotUtf8) {
  contents_.texts["options"]["name"] = "\xff";
  EXPECT_THROW(WriteCheckpoint(path_, contents_), UserError);
}

TEST_F(CheckpointTest, NumbersComeBackBitForBit) {
  double sum = 0.1 + 0.2, infinite = -std::numeric_limits<double>::infinity(), nan = NAN,
         zero = -0.0, tiny = std::numeric_limits<double>::denorm_min();
  int64_t large = std::numeric_limits<int64_t>::min();
  uint64_t seed = std::numeric_limits<uint64_t>::max();
  bool yes = true;
  const auto serialize = [&](auto* archive) {
    archive->Number("sum", &sum);
    archive->Number("infinite", &infinite);
    archive->Number("nan", &nan);
    archive->Number("zero", &zero);
    archive->Number("tiny", &tiny);
    archive->Number("large", &large);
    archive->Number("seed", &seed);
    archive->Number("yes", &yes);
  };
  CheckpointContents contents;
  StateWriter writer("state", &contents);
  serialize(&writer);
  WriteCheckpoint(path_, contents);
  sum = infinite = nan = zero = tiny = 1;
  large = 0, seed = 0, yes = false;
  const Checkpoint checkpoint(path_);
  StateReader reader("state", checkpoint);
  serialize(&reader);
  EXPECT_EQ(sum, 0.1 + 0.2);
  EXPECT_EQ(infinite, -std::numeric_limits<double>::infinity());
  EXPECT_TRUE(std::isnan(nan));
  EXPECT_TRUE(zero == 0 && std::signbit(zero));
  EXPECT_EQ(tiny, std::numeric_limits<double>::denorm_min());
  EXPECT_EQ(large, std::numeric_limits<int64_t>::min());
  EXPECT_EQ(seed, std::numeric_limits<uint64_t>::max());
  EXPECT_TRUE(yes);
  int number = 0;
  EXPECT_THROW(reader.Number("large", &number), UserError) << "out of range";
  EXPECT_THROW(reader.Number("missing", &number), UserError);
}

}  // namespace
}  // namespace semfoam
