// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask_import/zip_file.h"

#include "foam/util/error.h"
#include "plugin/photo/photo.h"

#include <algorithm>

#include <zlib.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

constexpr uint32_t kLocalHeader = 0x04034b50;
constexpr uint32_t kCentralHeader = 0x02014b50;
constexpr uint32_t kEndOfDirectory = 0x06054b50;
constexpr size_t kLocalHeaderSize = 30;
constexpr size_t kCentralHeaderSize = 46;
constexpr size_t kEndSize = 22;
constexpr size_t kLongestComment = 65535;

[[noreturn]] void Fail(const fs::path& path, const std::string& what) {
  throw UserError(path.string(), ": its zip archive ", what, "; is the copy complete?");
}

uint64_t NumberAt(const fs::path& path, std::string_view bytes, uint64_t at, int size) {
  if (at > bytes.size() || bytes.size() - at < static_cast<size_t>(size)) Fail(path, "is cut");
  uint64_t value = 0;
  for (int i = size; i-- > 0;) value = value << 8 | static_cast<uint8_t>(bytes[at + i]);
  return value;
}

// The place of the record at the end, which a comment may follow.
uint64_t FindEnd(const fs::path& path, std::string_view archive) {
  if (archive.size() >= kEndSize) {
    const uint64_t last = archive.size() - kEndSize;
    const uint64_t first = last > kLongestComment ? last - kLongestComment : 0;
    for (uint64_t at = last + 1; at-- > first;) {
      if (NumberAt(path, archive, at, 4) == kEndOfDirectory) return at;
    }
  }
  Fail(path, "has no directory at its end");
}

}  // namespace

std::vector<ZipMember> ListZip(const fs::path& path, std::string_view archive) {
  const uint64_t end = FindEnd(path, archive);
  const uint64_t count = NumberAt(path, archive, end + 10, 2);
  uint64_t at = NumberAt(path, archive, end + 16, 4);
  std::vector<ZipMember> members;
  for (uint64_t i = 0; i < count; ++i) {
    if (NumberAt(path, archive, at, 4) != kCentralHeader) Fail(path, "has a damaged directory");
    ZipMember member;
    member.method = static_cast<int>(NumberAt(path, archive, at + 10, 2));
    member.checksum = static_cast<uint32_t>(NumberAt(path, archive, at + 16, 4));
    member.packed_size = NumberAt(path, archive, at + 20, 4);
    member.size = NumberAt(path, archive, at + 24, 4);
    const uint64_t name_size = NumberAt(path, archive, at + 28, 2);
    const uint64_t extra_size = NumberAt(path, archive, at + 30, 2);
    const uint64_t comment_size = NumberAt(path, archive, at + 32, 2);
    member.offset = NumberAt(path, archive, at + 42, 4);
    at += kCentralHeaderSize;
    if (name_size > archive.size() - std::min<uint64_t>(at, archive.size())) Fail(path, "is cut");
    member.name = archive.substr(at, name_size);
    at += name_size + extra_size + comment_size;
    members.push_back(std::move(member));
  }
  return members;
}

std::string ExtractZip(const fs::path& path, std::string_view archive, const ZipMember& member) {
  if (NumberAt(path, archive, member.offset, 4) != kLocalHeader) {
    Fail(path, "has no member where its directory says");
  }
  const uint64_t begin = member.offset + kLocalHeaderSize +
                         NumberAt(path, archive, member.offset + 26, 2) +
                         NumberAt(path, archive, member.offset + 28, 2);
  if (begin > archive.size() || archive.size() - begin < member.packed_size) Fail(path, "is cut");
  const std::string_view packed = archive.substr(begin, member.packed_size);
  // Deflate packs no better than this.
  if (member.size / kMostPngExpansion > packed.size()) {
    Fail(path, "promises " + std::to_string(member.size) + " bytes, more than it can hold");
  }
  std::string bytes;
  if (member.method == 0) {
    bytes = packed;
  } else if (member.method == 8) {
    bytes.resize(member.size);
    z_stream stream = {};
    if (inflateInit2(&stream, -MAX_WBITS) != Z_OK) Fail(path, "cannot be unpacked");
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed.data()));
    stream.avail_in = static_cast<uInt>(packed.size());
    stream.next_out = reinterpret_cast<Bytef*>(bytes.data());
    stream.avail_out = static_cast<uInt>(bytes.size());
    const int result = inflate(&stream, Z_FINISH);
    const uint64_t written = stream.total_out;
    inflateEnd(&stream);
    if (result != Z_STREAM_END || written != member.size) Fail(path, "has damaged data");
  } else {
    throw UserError(path.string(),
                    ": its zip archive is packed by method ",
                    member.method,
                    ", where stored or deflated members, as NumPy writes them, would be right.");
  }
  uLong checksum = crc32(0, nullptr, 0);
  checksum = crc32_z(checksum, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size());
  if (bytes.size() != member.size || checksum != member.checksum) Fail(path, "has damaged data");
  return bytes;
}

}  // namespace semfoam
