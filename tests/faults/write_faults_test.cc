// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cerrno>
#include <cstring>
#include <optional>
#include <random>
#include <sstream>

#include "tests/faults/faulty_program.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

struct Command {
  const char* name;
  // OUT is the folder below which all is written, FOAM a foam, SCENE the workspace it was trained
  // on.
  std::vector<std::string> arguments;
};

const std::vector<Command>& Commands() {
  static const std::vector<Command> commands = {
      {"volume_exporter",
       {"volume_exporter",
        "--foam_path",
        "FOAM",
        "--output_path",
        "OUT",
        "--max_resolution",
        "12",
        "--VolumeExport.nvdb",
        "1",
        "--VolumeExport.points",
        "1",
        "--VolumeExport.label_grid_type",
        "both",
        "--labels",
        "plant"}},
      {"mesh_exporter", {"mesh_exporter", "--foam_path", "FOAM", "--output_path", "OUT"}},
      {"foam_renderer",
       {"foam_renderer",
        "--foam_path",
        "FOAM",
        "--output_path",
        "OUT",
        "--input_path",
        "SCENE/sparse/0",
        "--views",
        "OUT.views",
        "--preview",
        "1",
        "--image_path",
        "SCENE/images"}},
      {"trajectory",
       {"foam_renderer",
        "--foam_path",
        "FOAM",
        "--output_path",
        "OUT",
        "--trajectory",
        "orbit",
        "--frames",
        "3",
        "--width",
        "48"}},
      {"object_extractor",
       {"object_extractor", "--foam_path", "FOAM", "--labels", "plant", "--output_path", "OUT"}},
      {"splats",
       {"foam_converter",
        "--input_path",
        "FOAM",
        "--output_path",
        "OUT/s.ply",
        "--output_type",
        "splats"}},
      {"text", {"foam_converter", "--input_path", "FOAM", "--output_path", "OUT/foam.txt"}},
      {"point_labeler", {"point_labeler", "--workspace_path", "SCENE", "--output_path", "OUT"}},
      {"foam_trainer", {}},
  };
  return commands;
}

std::string OldBytes(const std::string& file, const std::string& good) {
  // What is read before it is replaced has to stay readable, images for the mark that they are
  // ours.
  for (const char* extension : {".json", ".png", ".exr"}) {
    if (file.ends_with(extension)) return good + " ";
  }
  return "an older " + file;
}

struct Reference {
  std::map<std::string, std::string> files;
  std::map<std::string, int64_t> counts;
};

class WriteFaults : public ::testing::TestWithParam<Command> {
 protected:
  static void SetUpTestSuite() {
    scene_ = new TempFolder;
    const Outcome outcome =
        RunProgram(SEMFOAM_PROGRAM, TinyTrainingCommand(FewPhotos(), *scene_ / "foam"));
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  }
  static void TearDownTestSuite() { delete scene_; }

  // What the command writes, and how often it does what, is found once for all tests of it.
  void SetUp() override {
    WriteFile(folder_ / "out.views", "0000.jpg\n");
    static std::map<std::string, Reference> references;
    const auto [entry, is_new] = references.try_emplace(GetParam().name);
    Reference& reference = entry->second;
    if (is_new) {
      const Outcome first = RunProgram(SEMFOAM_PROGRAM, Arguments());
      ASSERT_EQ(first.exit_code, 0) << first.err;
      reference.files = Snapshot(Out());
      // Counted where the folders are there already, as in the runs that are to fail.
      good_ = reference.files;
      MakeOld();
      const Outcome second = RunWithFault(Arguments(), Out(), "", folder_ / "report");
      ASSERT_EQ(second.exit_code, 0) << second.err;
      ASSERT_TRUE(AreGood(Snapshot(Out()), good_));
      reference.counts = ReadReport();
    }
    good_ = reference.files;
    counts_ = reference.counts;
    ASSERT_FALSE(good_.empty());
  }

  fs::path Out() const { return folder_ / "out"; }

  // What the last run with this report did, and how often.
  std::map<std::string, int64_t> ReadReport() const {
    std::map<std::string, int64_t> counts;
    std::istringstream report(ReadFile(folder_ / "report"));
    for (std::string operation; report >> operation;) report >> counts[operation];
    return counts;
  }

  std::vector<std::string> Arguments() const {
    if (std::string(GetParam().name) == "foam_trainer")
      return TinyTrainingCommand(FewPhotos(), Out());
    std::vector<std::string> arguments = GetParam().arguments;
    for (std::string& argument : arguments) {
      for (const auto& [word, path] : {std::pair<std::string, fs::path>("OUT", Out()),
                                       {"FOAM", *scene_ / "foam" / "scene.foam"},
                                       {"SCENE", FewPhotos()}}) {
        if (argument.starts_with(word)) argument.replace(0, word.size(), path.string());
      }
    }
    return arguments;
  }

  // Older files of the same names, as far as there were files.
  void MakeOld() const {
    fs::remove_all(Out());
    for (const auto& [file, bytes] : good_) {
      fs::create_directories((Out() / file).parent_path());
      WriteFile(Out() / file, OldBytes(file, bytes));
    }
  }

  // After a failure: one sentence, about one of the files or their folder.
  void ExpectSentence(const Outcome& outcome) const {
    EXPECT_EQ(outcome.exit_code, 1) << outcome.err;
    ASSERT_EQ(outcome.Errors().size(), 1u) << outcome.err;
    EXPECT_THAT(outcome.Errors()[0], HasSubstr("ERROR: " + Out().string())) << outcome.err;
  }

  // And every file below `folder` is an old one, where there was one, or a good one; returns how
  // many are no good ones.
  int NumOld(const fs::path& folder, bool had_old) const {
    EXPECT_THAT(HiddenBelow(folder), IsEmpty());
    const auto files = Results(folder);
    int num_good = 0;
    for (const auto& [file, bytes] : files) {
      const auto good = good_.find(file);
      if (good == good_.end()) {
        ADD_FAILURE() << file;
        continue;
      }
      const bool is_good = IsGood(file, bytes, good->second);
      num_good += is_good;
      EXPECT_TRUE(is_good || (had_old && bytes == OldBytes(file, good->second)))
          << file << " is neither old nor complete";
    }
    if (had_old) {
      EXPECT_EQ(files.size(), good_.size());
    }
    return static_cast<int>(good_.size()) - num_good;
  }

  void ExpectRefusal(const Outcome& outcome) const {
    ExpectSentence(outcome);
    EXPECT_GT(NumOld(Out(), true), 0);
  }

  // Runs the command where `mount`, shell text in which $1 is the output folder, has been mounted
  // for it alone; what is in the folder at the end is copied into $2. No outcome where that is not
  // allowed.
  std::optional<Outcome> RunMounted(const std::string& mount, const fs::path& after) const {
    const std::string unshare = "/usr/bin/unshare";
    if (RunProgram(unshare, {"-rm", "true"}).exit_code != 0) return std::nullopt;
    std::vector<std::string> line = {
        "-rm",
        "bash",
        "-c",
        mount + " || exit 99; \"${@:3}\"; code=$?; cp -a \"$1\" \"$2\" || exit 98; exit $code",
        "bash",
        Out().string(),
        after.string(),
        SEMFOAM_PROGRAM};
    const std::vector<std::string> arguments = Arguments();
    line.insert(line.end(), arguments.begin(), arguments.end());
    return RunProgram(unshare, line);
  }

  static TempFolder* scene_;
  TempFolder folder_;
  std::map<std::string, std::string> good_;
  std::map<std::string, int64_t> counts_;
};

TempFolder* WriteFaults::scene_ = nullptr;

INSTANTIATE_TEST_SUITE_P(Commands,
                         WriteFaults,
                         ::testing::ValuesIn(Commands()),
                         [](const auto& info) { return std::string(info.param.name); });

// Where one thing ends and the next begins in a scene.foam.
std::vector<int64_t> FoamBoundaries(const std::string& bytes) {
  uint64_t header = 0;
  std::memcpy(&header, &bytes[16], sizeof(header));
  const int64_t begin = 24 + static_cast<int64_t>(header);
  std::vector<int64_t> boundaries = {8, 24, begin, static_cast<int64_t>(bytes.size()) - 8};
  const auto json = nlohmann::json::parse(bytes.substr(24, header));
  for (const auto& array : json.at("arrays")) {
    boundaries.push_back(begin + array.at("offset").get<int64_t>());
  }
  return boundaries;
}

TEST_P(WriteFaults, LeaveOldOrCompleteFiles) {
  std::mt19937 random(1);
  const auto below = [&](int64_t bound) {
    return static_cast<int64_t>(random() % static_cast<uint64_t>(std::max<int64_t>(bound, 1)));
  };
  // What a training says of its seconds has another length in each run.
  const bool varies = GetParam().name == std::string("foam_trainer");
  const int64_t bytes = counts_["bytes"] - (varies ? 8000 : 0);
  counts_["write"] -= varies ? 2 : 0;
  std::vector<int64_t> places = {0, bytes - 1, below(bytes)};
  if (ManyFaults()) {
    for (int i = 0; i < 30; ++i) places.push_back(below(bytes));
    // Small files show their faults only when the last one of them is flushed.
    for (int i = 1; i < 10; ++i) places.push_back(bytes - 1 - i * i * i * i);
  }
  if (const auto foam = good_.find("scene.foam"); foam != good_.end() && ManyFaults()) {
    for (const int64_t at : FoamBoundaries(foam->second)) places.push_back(at);
  }
  struct Fault {
    std::string operation;
    int64_t at;
    int error;
  };
  std::vector<Fault> faults;
  for (const int64_t at : places) {
    if (at >= 0 && at < bytes) faults.push_back({"bytes", at, ENOSPC});
  }
  for (const auto& [operation, error] : {std::pair("write", EIO),
                                         std::pair("fsync", EIO),
                                         std::pair("rename", EACCES),
                                         std::pair("mkdir", ENOSPC),
                                         std::pair("open", EROFS)}) {
    // Not the last fsync, which is a folder's: by then the file is there.
    const int64_t count = counts_[operation] - (operation == std::string("fsync"));
    ASSERT_GT(count, 0) << operation;
    std::vector<int64_t> calls = {below(count)};
    if (ManyFaults()) {
      calls.insert(calls.end(), {0, count - 1});
      for (int i = 0; i < 5; ++i) calls.push_back(below(count));
    }
    for (const int64_t call : calls) faults.push_back({operation, call, error});
  }
  size_t num_unmet = 0;
  for (const auto& [operation, at, error] : faults) {
    const std::string place = operation + ":" + std::to_string(at);
    SCOPED_TRACE(place);
    MakeOld();
    const Outcome outcome =
        RunWithFault(Arguments(), Out(), place + ":" + std::to_string(error), folder_ / "report");
    if (varies && ReadReport()[operation] <= at && outcome.exit_code == 0) {
      // This run had less to say of its seconds than the one that was counted.
      EXPECT_EQ(NumOld(Out(), true), 0);
      ++num_unmet;
      continue;
    }
    ExpectRefusal(outcome);
  }
  EXPECT_LE(num_unmet, 1 + faults.size() / 10);
  RecordProperty("faults", static_cast<int>(faults.size() - num_unmet));
  std::printf("%zu faults\n", faults.size() - num_unmet);
}

TEST_P(WriteFaults, ShortAndInterruptedWritesChangeNothing) {
  fs::remove_all(Out());
  const Outcome outcome = RunWithFault(Arguments(), Out(), "short:0:0");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_TRUE(AreGood(Snapshot(Out()), good_));
}

// The kernel's own limit, which also reaches writers that the injection may not see.
TEST_P(WriteFaults, ALimitOfTheFileSizeIsAnError) {
  MakeOld();
  size_t largest = 0;
  for (const auto& [file, bytes] : good_) largest = std::max(largest, bytes.size());
  std::vector<std::string> line = {"--fsize=" + std::to_string(largest - 1), SEMFOAM_PROGRAM};
  const std::vector<std::string> arguments = Arguments();
  line.insert(line.end(), arguments.begin(), arguments.end());
  ExpectRefusal(RunProgram("/usr/bin/prlimit", line));
}

TEST_P(WriteFaults, AFullDiskIsAnError) {
  int64_t pages = 0;
  for (const auto& [file, bytes] : good_) pages += static_cast<int64_t>(bytes.size() + 4095) / 4096;
  fs::remove_all(Out());
  fs::create_directory(Out());
  const std::string size = std::to_string(4 * std::max<int64_t>(1, pages * 6 / 10)) + "k";
  const auto outcome =
      RunMounted("mount -t tmpfs -o size=" + size + " tmpfs \"$1\"", folder_ / "after");
  if (!outcome) GTEST_SKIP() << "nothing may be mounted here";
  ExpectSentence(*outcome);
  EXPECT_GT(NumOld(folder_ / "after", false), 0);
}

TEST_P(WriteFaults, AReadOnlyFolderIsAnError) {
  MakeOld();
  const auto outcome = RunMounted("mount --bind \"$1\" \"$1\" && mount -o remount,ro,bind \"$1\"",
                                  folder_ / "after");
  if (!outcome) GTEST_SKIP() << "nothing may be mounted here";
  ExpectSentence(*outcome);
  EXPECT_THAT(outcome->Errors()[0], HasSubstr("Read-only file system"));
  EXPECT_EQ(NumOld(Out(), true), static_cast<int>(good_.size()));
}

TEST_P(WriteFaults, AFolderInTheWayOfAFileIsNamed) {
  for (const auto& [file, bytes] : good_) {
    SCOPED_TRACE(file);
    MakeOld();
    fs::remove(Out() / file);
    fs::create_directories(Out() / file / "inner");
    const Outcome outcome = RunProgram(SEMFOAM_PROGRAM, Arguments());
    EXPECT_EQ(outcome.exit_code, 1) << outcome.err;
    ASSERT_EQ(outcome.Errors().size(), 1u) << outcome.err;
    EXPECT_THAT(outcome.Errors()[0], HasSubstr((Out() / file).string()));
    EXPECT_THAT(HiddenBelow(Out()), IsEmpty());
    EXPECT_TRUE(fs::is_directory(Out() / file / "inner"));
    if (!ManyFaults()) break;
  }
}

TEST_P(WriteFaults, AFileInTheWayOfTheFolderIsNamed) {
  fs::remove_all(Out());
  WriteFile(Out(), "a file");
  const Outcome outcome = RunProgram(SEMFOAM_PROGRAM, Arguments());
  EXPECT_EQ(outcome.exit_code, 1) << outcome.err;
  ASSERT_EQ(outcome.Errors().size(), 1u) << outcome.err;
  EXPECT_THAT(outcome.Errors()[0], HasSubstr(Out().string()));
  EXPECT_EQ(ReadFile(Out()), "a file");
}

}  // namespace
}  // namespace semfoam
