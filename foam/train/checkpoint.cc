// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/train/checkpoint.h"

#include "foam/util/input_file.h"
#include "foam/util/output_file.h"

#include <bit>
#include <cstring>
#include <fstream>
#include <utility>

#include <nlohmann/json.hpp>

#define XXH_INLINE_ALL
#include <xxhash.h>

namespace semfoam {
namespace {

static_assert(std::endian::native == std::endian::little, "the file is written as memory lies");

using Json = nlohmann::json;

constexpr char kMagic[8] = {'S', 'E', 'M', 'F', 'C', 'K', 'P', '\n'};
constexpr char kEndMagic[8] = {'S', 'E', 'M', 'F', 'E', 'N', 'D', '\n'};
constexpr size_t kVersionedBytes = 12;  // magic, version: the same in all versions
constexpr size_t kPreambleBytes = 24;   // and reserved, header length
constexpr size_t kHashBytes = 8;
constexpr size_t kFooterBytes = 16;

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

void Write(std::ofstream* out, std::span<const std::byte> bytes) {
  out->write(reinterpret_cast<const char*>(bytes.data()),
             static_cast<std::streamsize>(bytes.size()));
}

// The next bytes of the file; false where there are not so many.
bool Reads(InputFile* in, void* bytes, size_t count) { return in->Read(bytes, count) == count; }

}  // namespace

void WriteCheckpoint(const std::filesystem::path& path, const CheckpointContents& contents) {
  Json header;
  header["texts"] = contents.texts;
  header["arrays"] = Json::array();
  uint64_t file_bytes = kFooterBytes;
  for (const CheckpointContents::Array& array : contents.arrays) {
    header["arrays"].push_back({{"name", array.name}, {"bytes", array.bytes.size()}});
    file_bytes += array.bytes.size() + kHashBytes;
  }
  std::string text;
  try {
    text = header.dump(1);
  } catch (const Json::exception&) {
    throw UserError(path.string(),
                    ": cannot be written because a label's name is not UTF-8; rename it.");
  }
  std::string head(kMagic, sizeof(kMagic));
  Append(&head, kCheckpointVersion);
  Append(&head, uint32_t{0});
  Append(&head, static_cast<uint64_t>(text.size()));
  head += text;
  Append(&head, static_cast<uint64_t>(XXH64(head.data(), head.size(), 0)));
  file_bytes += head.size();

  OutputFile file(path);
  {
    std::ofstream out(file.temporary_path(), std::ios::binary);
    out << head;
    for (const CheckpointContents::Array& array : contents.arrays) {
      Write(&out, array.bytes);
      const uint64_t hash = XXH64(array.bytes.data(), array.bytes.size(), 0);
      Write(&out, std::as_bytes(std::span(&hash, 1)));
    }
    std::string footer(kEndMagic, sizeof(kEndMagic));
    Append(&footer, file_bytes);
    out << footer;
    out.flush();
    if (!out) {
      throw UserError(path.string(), ": cannot be written completely; is the disk full?");
    }
  }
  file.Commit();
}

Checkpoint::Checkpoint(const std::filesystem::path& path) : path_(path) {
  InputFile in(path, "a checkpoint");
  char preamble[kPreambleBytes];
  if (!Reads(&in, preamble, kVersionedBytes) ||
      std::memcmp(preamble, kMagic, sizeof(kMagic)) != 0) {
    ThrowNoCheckpoint();
  }
  if (const auto version = Value<uint32_t>(preamble + sizeof(kMagic));
      version != kCheckpointVersion) {
    throw UserError(path.string(),
                    ": this checkpoint has format version ",
                    version,
                    ", and this program reads version ",
                    kCheckpointVersion,
                    "; the program version that wrote it, or --resume 0 to train from the "
                    "beginning, would be right.");
  }
  if (in.size() < kPreambleBytes + kHashBytes + kFooterBytes ||
      !Reads(&in, preamble + kVersionedBytes, kPreambleBytes - kVersionedBytes)) {
    ThrowNoCheckpoint();
  }
  // What arrays and their checksums may take, once the header is known.
  uint64_t left = in.size() - kPreambleBytes - kHashBytes - kFooterBytes;
  const auto header_bytes = Value<uint64_t>(preamble + 16);
  if (header_bytes > left) ThrowDamaged("its header is longer than the file");
  left -= header_bytes;
  std::string header(header_bytes, '\0');
  uint64_t hash = 0;
  if (!Reads(&in, header.data(), header.size()) || !Reads(&in, &hash, sizeof(hash))) {
    ThrowDamaged("its header is cut");
  }
  XXH64_state_t state;
  XXH64_reset(&state, 0);
  XXH64_update(&state, preamble, sizeof(preamble));
  XXH64_update(&state, header.data(), header.size());
  if (XXH64_digest(&state) != hash) ThrowDamaged("its header has another checksum");

  std::vector<std::pair<std::string, uint64_t>> arrays;
  try {
    const Json json = Json::parse(header);
    texts_ = json.at("texts").get<CheckpointTexts>();
    for (const Json& array : json.at("arrays")) {
      arrays.emplace_back(array.at("name").get<std::string>(), array.at("bytes").get<uint64_t>());
    }
  } catch (const Json::exception&) {
    ThrowDamaged("its header is not what this program writes");
  }
  for (const auto& [name, bytes] : arrays) {
    if (left < kHashBytes || bytes > left - kHashBytes) {
      ThrowDamaged("the file ends within its array '" + name + "'");
    }
    left -= bytes + kHashBytes;
  }
  if (left != 0) ThrowDamaged("it is longer than its arrays");

  for (const auto& [name, count] : arrays) {
    const auto [entry, is_new] = arrays_.emplace(name, Bytes{});
    if (!is_new) ThrowDamaged("it has two arrays '" + name + "'");
    Bytes& bytes = entry->second;
    bytes.data.reset(new std::byte[count]);
    bytes.size = count;
    if (!Reads(&in, bytes.data.get(), count) || !Reads(&in, &hash, sizeof(hash))) {
      ThrowDamaged("the file ends within its array '" + name + "'");
    }
    if (XXH64(bytes.data.get(), count, 0) != hash) {
      ThrowDamaged("its array '" + name + "' has another checksum");
    }
  }
  char footer[kFooterBytes];
  if (!Reads(&in, footer, sizeof(footer)) ||
      std::memcmp(footer, kEndMagic, sizeof(kEndMagic)) != 0 ||
      Value<uint64_t>(footer + 8) != in.size()) {
    ThrowDamaged("its end is not there");
  }
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

void Checkpoint::ThrowDamaged(const std::string& what) const {
  throw DamagedCheckpoint(path_.string(),
                          ": this checkpoint is cut or damaged (",
                          what,
                          "); an older one, or training from the beginning, would be right.");
}

}  // namespace semfoam
