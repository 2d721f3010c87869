// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/util/checksummed_file.h"

#include "foam/util/error.h"
#include "foam/util/json_file.h"

#include <bit>
#include <cstdio>
#include <cstring>

#include <nlohmann/json.hpp>

#define XXH_INLINE_ALL
#include <xxhash.h>

namespace semfoam {
namespace {

static_assert(std::endian::native == std::endian::little, "the files are written as memory lies");

template <typename T>
void Append(std::string* bytes, const T& value) {
  bytes->append(reinterpret_cast<const char*>(&value), sizeof(value));
}

template <typename T>
T Value(const char* bytes) {
  T value;
  std::memcpy(&value, bytes, sizeof(value));
  return value;
}

}  // namespace

std::string HeaderText(const std::filesystem::path& path,
                       const nlohmann::json& header,
                       const std::string& name_owner) {
  try {
    return header.dump(1);
  } catch (const nlohmann::json::exception&) {
    throw UserError(path.string(),
                    ": cannot be written because ",
                    name_owner,
                    "'s name is not UTF-8; rename it.");
  }
}

std::optional<nlohmann::json> ParseHeaderText(std::string_view text) {
  try {
    return ParseJson("", text);
  } catch (const UserError&) {  // it speaks of a JSON file, which the caller's is not
    return std::nullopt;
  }
}

class RunningChecksum {
 public:
  RunningChecksum() { XXH64_reset(&state_, 0); }

  void Add(const void* bytes, size_t count) { XXH64_update(&state_, bytes, count); }

  // Returns the checksum of what was added since the last call.
  uint64_t Take() {
    const uint64_t checksum = XXH64_digest(&state_);
    XXH64_reset(&state_, 0);
    return checksum;
  }

 private:
  XXH64_state_t state_;
};

std::string ChecksumText(const std::vector<std::span<const std::byte>>& parts) {
  RunningChecksum checksum;
  for (const std::span<const std::byte> part : parts) checksum.Add(part.data(), part.size());
  char text[17];
  std::snprintf(text, sizeof(text), "%016llx", static_cast<unsigned long long>(checksum.Take()));
  return text;
}

ChecksummedWriter::ChecksummedWriter(const std::filesystem::path& path,
                                     const ChecksummedFormat& format,
                                     std::string_view header_text)
    : path_(path),
      format_(format),
      checksum_(std::make_unique<RunningChecksum>()),
      file_(path),
      out_(file_.temporary_path(), std::ios::binary) {
  std::string bytes(format.magic, sizeof(format.magic));
  Append(&bytes, format.version);
  Append(&bytes, uint32_t{0});
  const size_t header_end = format.Aligned(ChecksummedFormat::kPreambleBytes + header_text.size());
  Append(&bytes, uint64_t{header_end - ChecksummedFormat::kPreambleBytes});
  bytes += header_text;
  bytes.resize(header_end, ' ');
  Put(std::as_bytes(std::span(bytes)));
}

ChecksummedWriter::~ChecksummedWriter() = default;

void ChecksummedWriter::Put(std::span<const std::byte> bytes) {
  if (bytes.empty()) return;
  out_.write(reinterpret_cast<const char*>(bytes.data()),
             static_cast<std::streamsize>(bytes.size()));
  checksum_->Add(bytes.data(), bytes.size());
  size_ += bytes.size();
}

void ChecksummedWriter::Write(std::span<const std::byte> bytes) {
  Put(bytes);
  const std::string padding(format_.Aligned(size_) - size_, '\0');
  Put(std::as_bytes(std::span(padding)));
}

void ChecksummedWriter::WriteChecksum() {
  const uint64_t checksum = checksum_->Take();
  out_.write(reinterpret_cast<const char*>(&checksum), sizeof(checksum));
  size_ += sizeof(checksum);
}

void ChecksummedWriter::Commit() {
  out_.flush();
  if (!out_) throw UserError(path_.string(), ": cannot be written completely; is the disk full?");
  out_.close();
  file_.Commit();
}

ChecksummedReader::ChecksummedReader(const std::filesystem::path& path,
                                     const std::string& what,
                                     const ChecksummedFormat& format)
    : file_(path, what), checksum_(std::make_unique<RunningChecksum>()) {
  char preamble[ChecksummedFormat::kPreambleBytes] = {};
  position_ = file_.Read(preamble, sizeof(preamble));
  checksum_->Add(preamble, position_);
  constexpr size_t kVersionAt = sizeof(format.magic);
  has_magic_ = position_ >= kVersionAt + sizeof(version_) &&
               std::memcmp(preamble, format.magic, sizeof(format.magic)) == 0;
  version_ = Value<uint32_t>(preamble + kVersionAt);
  header_bytes_ = Value<uint64_t>(preamble + 16);
}

ChecksummedReader::~ChecksummedReader() = default;

bool ChecksummedReader::Read(void* bytes, size_t count) {
  const size_t got = file_.Read(bytes, count);
  checksum_->Add(bytes, got);
  position_ += got;
  return got == count;
}

bool ChecksummedReader::ChecksumMatches() {
  const uint64_t expected = checksum_->Take();
  uint64_t checksum = 0;
  const size_t got = file_.Read(&checksum, sizeof(checksum));
  position_ += got;
  return got == sizeof(checksum) && checksum == expected;
}

}  // namespace semfoam
