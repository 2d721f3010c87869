// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "tests/mistake.h"
#include "tests/plugin/test_util.h"
#include <gtest/gtest.h>
#include <sys/stat.h>

// Tables of bad inputs: what is done to a good input, and the mistake that the user is told. The
// folder of the test stands as "IN" in the message.
namespace semfoam {

using ForFolder = std::function<void(const std::filesystem::path& folder)>;

struct BadInput {
  std::string name;
  ForFolder spoil;
  Mistake mistake;
};

inline std::string Replaced(std::string text, const std::string& from, const std::string& to) {
  for (size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size()) {
    text.replace(at, from.size(), to);
  }
  return text;
}

// The sentence of the UserError that `read` throws, called on a folder that `prepare` filled and
// `spoil` spoilt.
inline std::string SentenceFor(const ForFolder& spoil,
                               const ForFolder& prepare,
                               const ForFolder& read) {
  const TempFolder temp;
  prepare(temp.path());
  spoil(temp.path());
  return Replaced(UserErrorOf([&] { read(temp.path()); }), temp.path().string(), "IN");
}

// Expects one sentence about the mistake of each case.
inline void ExpectMistakes(const std::vector<BadInput>& cases,
                           const ForFolder& prepare,
                           const ForFolder& read) {
  for (const BadInput& bad : cases) {
    EXPECT_THAT(SentenceFor(bad.spoil, prepare, read), TellsOf(bad.mistake)) << bad.name;
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
inline void ExpectMistakesIn(const std::string& file,
                             const std::string& good,
                             const std::vector<BadInput>& cases,
                             const ForFolder& read) {
  const TempFolder temp;
  WriteFile(temp / "f" / file, good);
  EXPECT_EQ(UserErrorOf([&] { read(temp / "f"); }), "");
  ExpectMistakes(cases, Put(file, good), read);
}

}  // namespace semfoam
