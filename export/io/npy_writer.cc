// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/io/npy_writer.h"

#include "foam/util/output_file.h"

#include <bit>
#include <string>

#include <glog/logging.h>

namespace semfoam {

static_assert(std::endian::native == std::endian::little, "elements are written as they lie");

void NpyRows::Add(std::span<const float> row) {
  CHECK(!row.empty());
  CHECK_EQ(values.size(), static_cast<size_t>(rows) * row.size());
  values.insert(values.end(), row.begin(), row.end());
  ++rows;
}

void WriteNpy(const std::filesystem::path& path, const NpyRows& array) {
  // Magic, version, and two bytes for the length of the header; with it a multiple of kAlignment.
  constexpr size_t kPreamble = 10, kAlignment = 64;
  const auto rows = static_cast<size_t>(array.rows);
  const size_t columns = rows == 0 ? 0 : array.values.size() / rows;
  std::string header = "{'descr': '<f4', 'fortran_order': False, 'shape': (" +
                       std::to_string(rows) + ", " + std::to_string(columns) + "), }";
  header.resize((kPreamble + header.size() + kAlignment) / kAlignment * kAlignment - kPreamble,
                ' ');
  header.back() = '\n';
  std::string bytes("\x93NUMPY\x01\x00", 8);
  bytes += static_cast<char>(header.size() & 0xff);
  bytes += static_cast<char>(header.size() >> 8);
  bytes += header;
  bytes.append(reinterpret_cast<const char*>(array.values.data()),
               array.values.size() * sizeof(float));
  WriteTextFile(path, bytes);
}

}  // namespace semfoam
