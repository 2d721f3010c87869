// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "tests/plugin/test_util.h"
#include <gtest/gtest.h>
#include <sys/stat.h>

// Tables of bad inputs: what is done to a good input, and the very sentence that the user gets. The
// folder of the test stands as "IN" in it.
namespace semfoam {

struct BadInput {
  std::string name;
  std::function<void(const std::filesystem::path& folder)> spoil;
  std::string sentence;
};

// Expects that `read`, called on a folder that `prepare` filled and the case spoilt, throws
// UserError with the sentence of each case.
inline void ExpectSentences(const std::vector<BadInput>& cases,
                            const std::function<void(const std::filesystem::path&)>& prepare,
                            const std::function<void(const std::filesystem::path&)>& read) {
  for (const BadInput& bad : cases) {
    const TempFolder temp;
    prepare(temp.path());
    bad.spoil(temp.path());
    std::string sentence = UserErrorOf([&] { read(temp.path()); });
    const std::string folder = temp.path().string();
    for (size_t at; (at = sentence.find(folder)) != std::string::npos;) {
      sentence.replace(at, folder.size(), "IN");
    }
    EXPECT_EQ(sentence, bad.sentence) << bad.name;
    EXPECT_FALSE(bad.sentence.empty()) << bad.name;
    EXPECT_EQ(sentence.find('\n'), std::string::npos) << bad.name;
  }
  testing::Test::RecordProperty("cases", static_cast<int>(cases.size()));
}

// A spoiler: puts these bytes in the place of a file.
inline auto Put(const std::string& file, const std::string& bytes) {
  return [=](const std::filesystem::path& folder) { WriteFile(folder / file, bytes); };
}

// A spoiler: the first `size` bytes of a file stay.
inline auto CutTo(const std::string& file, uintmax_t size) {
  return [=](const std::filesystem::path& folder) {
    std::filesystem::resize_file(folder / file, size);
  };
}

// A spoiler: these bytes follow the last ones of a file.
inline auto Append(const std::string& file, const std::string& bytes) {
  return [=](const std::filesystem::path& folder) {
    WriteFile(folder / file, ReadFile(folder / file) + bytes);
  };
}

// A spoiler: `from`, which must be in the file, becomes `to`.
inline auto Replace(const std::string& file, const std::string& from, const std::string& to) {
  return [=](const std::filesystem::path& folder) {
    std::string bytes = ReadFile(folder / file);
    const size_t at = bytes.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    WriteFile(folder / file, bytes.replace(at, from.size(), to));
  };
}

// Spoilers: something else in the place of a file.
inline auto Remove(const std::string& file) {
  return [=](const std::filesystem::path& folder) { std::filesystem::remove(folder / file); };
}
inline auto MakeFolder(const std::string& file) {
  return [=](const std::filesystem::path& folder) {
    std::filesystem::remove(folder / file);
    std::filesystem::create_directories(folder / file);
  };
}
inline auto MakePipe(const std::string& file) {
  return [=](const std::filesystem::path& folder) {
    std::filesystem::remove(folder / file);
    ASSERT_EQ(::mkfifo((folder / file).c_str(), 0600), 0);
  };
}
inline auto MakeDevice(const std::string& file) {
  return [=](const std::filesystem::path& folder) {
    std::filesystem::remove(folder / file);
    std::filesystem::create_symlink("/dev/zero", folder / file);
  };
}

// The same for one file, which is good as long as it holds `good`.
inline void ExpectSentencesOf(const std::vector<BadInput>& cases,
                              const std::string& file,
                              const std::string& good,
                              const std::function<void(const std::filesystem::path&)>& read) {
  const TempFolder temp;
  WriteFile(temp / "f" / file, good);
  EXPECT_EQ(UserErrorOf([&] { read(temp / "f"); }), "");
  ExpectSentences(
      cases, [&](const std::filesystem::path& folder) { WriteFile(folder / file, good); }, read);
}

}  // namespace semfoam
