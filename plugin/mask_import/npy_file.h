// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/mask_import/pixel_runs.h"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace semfoam {

// Reads arrays as NumPy saves them: .npy, and .npz (a zip of these, stored or deflated).

// What the elements of an array are to be.
enum class NpyElements {
  // bool, or integers of 1 to 8 bytes with or without a sign.
  kWholeNumbers,
  // float16, float32 or float64.
  kRealNumbers
};

// The bytes of an array, and what its header says of them.
struct NpyArray {
  // 'b' (bool), 'i' or 'u'; 'f' of kRealNumbers.
  char kind = 'u';
  // Bytes of an element: 1, 2, 4 or 8.
  int bytes = 1;
  bool big_endian = false;
  // Whether the first index runs fastest.
  bool fortran_order = false;
  std::vector<int64_t> shape;
  // The elements.
  std::string data;

  int64_t NumElements() const;
  // The element at a place of `data`, counted in elements, of kWholeNumbers.
  int64_t operator[](int64_t index) const;
  // The same of kRealNumbers; may be infinite or NaN.
  double RealAt(int64_t index) const;
};

// Reads the array of whole numbers of a .npy, or the only one of a .npz; of several, the one named
// mask, masks, labels or arr_0. Throws UserError, one sentence naming the file, for a file that is
// neither, that is cut or damaged, has arrays of other types (real numbers, objects), or a shape
// that its bytes do not fill.
NpyArray ReadNpyFile(const std::filesystem::path& path);

// Reads the bytes of a .npy; `path` is for messages. Throws UserError as ReadNpyFile does, also
// where its elements are others than `elements`.
NpyArray ParseNpy(const std::filesystem::path& path,
                  std::string bytes,
                  NpyElements elements = NpyElements::kWholeNumbers);

// Whether a file begins as a .npy or .npz does.
bool IsNpyFile(const std::filesystem::path& path);

}  // namespace semfoam
