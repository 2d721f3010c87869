// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstring>
#include <string_view>

#include <glog/logging.h>

namespace semfoam {

// Returns the value of a plain type that begins at byte `at`, little-endian like the machines that
// the project supports. CHECKs that `bytes` holds all of it.
template <typename T>
T ValueAt(std::string_view bytes, size_t at) {
  T value;
  CHECK_LE(at + sizeof(value), bytes.size());
  std::memcpy(&value, bytes.data() + at, sizeof(value));
  return value;
}

}  // namespace semfoam
