// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/volume/vdb_grids.h"
#include "foam/util/error.h"
#include "foam/util/output_file.h"

#include <cstdio>
#include <cstring>
#include <fstream>
#include <mutex>
#include <string>
#include <vector>

#include <glog/logging.h>
#define XXH_INLINE_ALL
#include <nanovdb/util/IO.h>
#include <nanovdb/util/OpenToNanoVDB.h>
#include <xxhash.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

// An io::File that writes into a stream of ours: OpenVDB's own does not look whether its bytes
// reach the disk, and a volume with its end cut off crashes or stalls its readers.
class StreamArchive : public openvdb::io::Archive {
 public:
  void Write(std::ostream& out,
             const openvdb::GridPtrVec& grids,
             const openvdb::MetaMap& metadata) const {
    openvdb::io::Archive::write(out, grids, /*seekable=*/true, metadata);
  }
};

// Where a file's id stands: behind magic (8 bytes), file version, library version (4 + 2 * 4) and
// the flag for grid offsets (1).
constexpr std::streamoff kIdAt = 21;
constexpr size_t kIdLength = 36;

// OpenVDB gives every file a random id. This one is drawn from the file's other bytes, so that the
// same grids make the same file.
bool ReplaceRandomId(const fs::path& path) {
  std::fstream file(path, std::ios::binary | std::ios::in | std::ios::out);
  const std::string blank(kIdLength, '0');
  file.seekp(kIdAt);
  file.write(blank.data(), kIdLength);
  file.seekg(0);
  XXH3_state_t state;
  XXH3_128bits_reset(&state);
  std::vector<char> chunk(1 << 20);
  while (file.read(chunk.data(), static_cast<std::streamsize>(chunk.size())), file.gcount() > 0) {
    XXH3_128bits_update(&state, chunk.data(), static_cast<size_t>(file.gcount()));
  }
  const XXH128_hash_t hash = XXH3_128bits_digest(&state);
  // As RFC 9562 has it: version 8 (made by a rule of its own), variant 10.
  const uint64_t high = (hash.high64 & ~uint64_t{0xf000}) | 0x8000;
  const uint64_t low = (hash.low64 & ~(uint64_t{3} << 62)) | uint64_t{1} << 63;
  char id[kIdLength + 1];
  std::snprintf(id,
                sizeof(id),
                "%08x-%04x-%04x-%04x-%012llx",
                static_cast<unsigned>(high >> 32),
                static_cast<unsigned>(high >> 16 & 0xffff),
                static_cast<unsigned>(high & 0xffff),
                static_cast<unsigned>(low >> 48),
                static_cast<unsigned long long>(low & 0xffffffffffff));
  file.clear();
  file.seekp(kIdAt);
  file.write(id, kIdLength);
  file.close();
  return !file.fail();
}

[[noreturn]] void FailIncomplete(const fs::path& path) {
  throw UserError(path.string(), ": cannot be written completely; is the disk full?");
}

// NanoVDB leaves the bytes between its nodes as the heap has them.
struct ZeroedBuffer : nanovdb::HostBuffer {
  static ZeroedBuffer create(uint64_t size, const ZeroedBuffer* /*pool*/ = nullptr) {
    ZeroedBuffer buffer;
    static_cast<nanovdb::HostBuffer&>(buffer) = nanovdb::HostBuffer::create(size);
    std::memset(buffer.data(), 0, size);
    return buffer;
  }
};

// Converts the types of grids that volumes have; the general conversion would compile those of all.
nanovdb::GridHandle<ZeroedBuffer> ToNanoVdb(const openvdb::GridBase::Ptr& base) {
  if (const auto grid = openvdb::GridBase::grid<openvdb::FloatGrid>(base)) {
    return nanovdb::openToNanoVDB<ZeroedBuffer>(*grid);
  }
  if (const auto grid = openvdb::GridBase::grid<openvdb::Vec3SGrid>(base)) {
    return nanovdb::openToNanoVDB<ZeroedBuffer>(*grid);
  }
  const auto grid = openvdb::GridBase::grid<openvdb::Int32Grid>(base);
  CHECK(grid != nullptr) << base->type();
  return nanovdb::openToNanoVDB<ZeroedBuffer>(*grid);
}

}  // namespace

void InitializeOpenVdb() {
  static std::once_flag once;
  std::call_once(once, [] { openvdb::initialize(); });
}

void WriteVdb(const fs::path& path,
              const openvdb::GridPtrVec& grids,
              const openvdb::MetaMap& metadata) {
  OutputFile output(path);
  {
    std::ofstream out(output.temporary_path(), std::ios::binary);
    StreamArchive archive;
    archive.setCompression(openvdb::io::COMPRESS_BLOSC | openvdb::io::COMPRESS_ACTIVE_MASK);
    archive.Write(out, grids, metadata);
    out.close();
    if (out.fail() || !ReplaceRandomId(output.temporary_path())) FailIncomplete(path);
  }
  output.Commit();
}

void WriteNanoVdb(const fs::path& path, const openvdb::GridPtrVec& grids) {
  OutputFile output(path);
  std::vector<nanovdb::GridHandle<ZeroedBuffer>> handles;
  handles.reserve(grids.size());
  for (const openvdb::GridBase::Ptr& grid : grids) handles.push_back(ToNanoVdb(grid));
  std::ofstream out(output.temporary_path(), std::ios::binary);
  try {
    nanovdb::io::writeGrids<ZeroedBuffer, std::vector>(out, handles);
  } catch (const std::runtime_error&) {
    FailIncomplete(path);
  }
  out.close();
  if (out.fail()) FailIncomplete(path);
  output.Commit();
}

}  // namespace semfoam
