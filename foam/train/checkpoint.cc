// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/train/checkpoint.h"

#include "foam/util/checksummed_file.h"

#include <algorithm>
#include <cstring>
#include <optional>
#include <utility>

#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

using Json = nlohmann::json;

constexpr ChecksummedFormat kFormat = {.magic = {'S', 'E', 'M', 'F', 'C', 'K', 'P', '\n'},
                                       .version = kCheckpointVersion};
constexpr char kEndMagic[8] = {'S', 'E', 'M', 'F', 'E', 'N', 'D', '\n'};
constexpr size_t kFooterBytes = 16;

}  // namespace

void WriteCheckpoint(const std::filesystem::path& path, const CheckpointContents& contents) {
  Json header;
  header["texts"] = contents.texts;
  header["arrays"] = Json::array();
  for (const CheckpointContents::Array& array : contents.arrays) {
    header["arrays"].push_back({{"name", array.name}, {"bytes", array.bytes.size()}});
  }
  ChecksummedWriter file(path, kFormat, HeaderText(path, header, "a label"));
  file.WriteChecksum();
  for (const CheckpointContents::Array& array : contents.arrays) {
    file.Write(array.bytes);
    file.WriteChecksum();
  }
  const uint64_t file_bytes = file.size() + kFooterBytes;
  file.Write(std::as_bytes(std::span(kEndMagic)));
  file.Write(std::as_bytes(std::span(&file_bytes, 1)));
  file.Commit();
}

Checkpoint::Checkpoint(const std::filesystem::path& path,
                       const std::function<bool(const std::string& name)>& keeps,
                       std::string remedy)
    : path_(path), remedy_(std::move(remedy)) {
  ChecksummedReader file(path, "a checkpoint", kFormat);
  if (!file.HasMagic()) ThrowNoCheckpoint();
  if (file.version() != kCheckpointVersion) {
    throw UserError(path.string(),
                    ": this checkpoint has format version ",
                    file.version(),
                    ", and this program reads version ",
                    kCheckpointVersion,
                    "; the program version that wrote it, or ",
                    Field{"resume"},
                    " 0 to train from the "
                    "beginning, would be right.");
  }
  if (file.size() <
      ChecksummedFormat::kPreambleBytes + ChecksummedFormat::kChecksumBytes + kFooterBytes) {
    ThrowNoCheckpoint();
  }
  for (const auto& [name, count] : ReadHeader(&file)) {
    ReadArray(name, count, !keeps || keeps(name), &file);
  }
  char end_magic[sizeof(kEndMagic)];
  uint64_t file_bytes = 0;
  if (!file.Read(end_magic, sizeof(end_magic)) || !file.Read(&file_bytes, sizeof(file_bytes)) ||
      std::memcmp(end_magic, kEndMagic, sizeof(kEndMagic)) != 0 || file_bytes != file.size()) {
    ThrowDamaged("its end is not there");
  }
}

Checkpoint::ArrayTable Checkpoint::ReadHeader(ChecksummedReader* file) {
  if (file->header_bytes() > file->left() - ChecksummedFormat::kChecksumBytes - kFooterBytes) {
    ThrowDamaged("its header is longer than the file");
  }
  std::string text(file->header_bytes(), '\0');
  if (!file->Read(text.data(), text.size())) ThrowDamaged("its header is cut");
  if (!file->ChecksumMatches()) ThrowDamaged("its header has another checksum");

  const char* const not_ours = "its header is not what this program writes";
  const std::optional<Json> header = ParseHeaderText(text);
  if (!header) ThrowDamaged(not_ours);
  ArrayTable table;
  try {
    texts_ = header->at("texts").get<CheckpointTexts>();
    for (const Json& array : header->at("arrays")) {
      table.emplace_back(array.at("name").get<std::string>(), array.at("bytes").get<uint64_t>());
    }
  } catch (const Json::exception&) {
    ThrowDamaged(not_ours);
  }
  // What the arrays and their checksums may take.
  uint64_t left = file->left() - kFooterBytes;
  for (const auto& [name, count] : table) {
    if (left < ChecksummedFormat::kChecksumBytes ||
        count > left - ChecksummedFormat::kChecksumBytes) {
      ThrowDamaged("the file ends within its array '" + name + "'");
    }
    left -= count + ChecksummedFormat::kChecksumBytes;
  }
  if (left != 0) ThrowDamaged("it is longer than its arrays");
  return table;
}

void Checkpoint::ReadArray(const std::string& name,
                           uint64_t count,
                           bool keeps,
                           ChecksummedReader* file) {
  const auto read = [&](std::byte* bytes, uint64_t size) {
    if (file->Read(bytes, size)) return;
    ThrowDamaged("the file ends within its array '" + name + "'");
  };
  if (keeps) {
    const auto [entry, is_new] = arrays_.emplace(name, Bytes{});
    if (!is_new) ThrowDamaged("it has two arrays '" + name + "'");
    Bytes& bytes = entry->second;
    bytes.data.reset(new std::byte[count]);
    bytes.size = count;
    read(bytes.data.get(), count);
  } else {
    constexpr uint64_t kPiece = 1 << 20;
    std::vector<std::byte> piece(std::min(count, kPiece));
    for (uint64_t left = count; left > 0; left -= std::min(left, kPiece)) {
      read(piece.data(), std::min(left, kPiece));
    }
  }
  if (!file->ChecksumMatches()) ThrowDamaged("its array '" + name + "' has another checksum");
}

const std::map<std::string, std::string>& Checkpoint::Texts(const std::string& group) const {
  static const std::map<std::string, std::string> none;
  const auto found = texts_.find(group);
  return found == texts_.end() ? none : found->second;
}

std::span<const std::byte> Checkpoint::Array(const std::string& name) const {
  const auto found = arrays_.find(name);
  if (found == arrays_.end()) ThrowDamaged("it has no array '" + name + "'");
  return {found->second.data.get(), found->second.size};
}

void Checkpoint::ThrowNoCheckpoint() const {
  throw DamagedCheckpoint(
      path_.string(),
      ": this is no checkpoint, or only the beginning of one; foam_trainer writes them into its "
      "output folder.");
}

CheckpointContents Checkpoint::Contents() const {
  CheckpointContents contents;
  contents.texts = texts_;
  for (const auto& [name, bytes] : arrays_) contents.arrays.push_back({name, Array(name)});
  return contents;
}

void Checkpoint::ThrowDamaged(const std::string& what) const {
  throw DamagedCheckpoint(path_.string(),
                          ": this checkpoint is cut or damaged (",
                          what,
                          "); ",
                          remedy_,
                          " would be right.");
}

}  // namespace semfoam
