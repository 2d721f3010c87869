// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace semfoam {

// Reads zip archives in memory (PKWARE's APPNOTE 4.3), as far as NumPy writes them: members that
// are stored or deflated, below 4 GB. `path` is for messages. All functions throw UserError, one
// sentence naming the file, where the archive is cut, damaged or of another kind.

struct ZipMember {
  std::string name;
  // 0 = stored, 8 = deflated.
  int method = 0;
  uint32_t checksum = 0;
  uint64_t packed_size = 0;
  uint64_t size = 0;
  // Place of its local header.
  uint64_t offset = 0;
};

// Returns the members in the order of the central directory.
std::vector<ZipMember> ListZip(const std::filesystem::path& path, std::string_view archive);

// Returns the bytes of a member, and checks their number and checksum.
std::string ExtractZip(const std::filesystem::path& path,
                       std::string_view archive,
                       const ZipMember& member);

}  // namespace semfoam
