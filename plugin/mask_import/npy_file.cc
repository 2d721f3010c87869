// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask_import/npy_file.h"

#include "foam/util/error.h"
#include "foam/util/input_file.h"
#include "plugin/mask_import/zip_file.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <set>
#include <utility>

#include <glog/logging.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kNpyMagic("\x93NUMPY", 6);
constexpr std::string_view kZipMagic("PK\x03\x04", 4);
constexpr size_t kMostDimensions = 8;
constexpr int64_t kMostElements = int64_t{1} << 40;

const char* TextOf(NpyElements elements) {
  return elements == NpyElements::kWholeNumbers ? "whole numbers" : "real numbers";
}

// Reads the dictionary of a header: {'descr': '<u2', 'fortran_order': False, 'shape': (2, 3), }.
class HeaderParser {
 public:
  HeaderParser(const fs::path& path, std::string_view text, NpyElements elements)
      : path_(path), text_(text), elements_(elements) {}

  NpyArray Parse() {
    NpyArray array;
    std::set<std::string> keys;
    Expect('{');
    while (!Accept('}')) {
      const std::string key(Quoted());
      Expect(':');
      if (!keys.insert(key).second) Fail("has " + Shortened(key) + " twice");
      if (key == "descr") {
        SetType(Quoted(), &array);
      } else if (key == "fortran_order") {
        array.fortran_order = Boolean();
      } else if (key == "shape") {
        array.shape = Shape();
      } else {
        Fail("has the key " + Shortened(key));
      }
      if (!Accept(',')) {
        Expect('}');
        break;
      }
    }
    SkipBlanks();
    if (!text_.empty() || keys.size() != 3) Fail("is not complete");
    return array;
  }

 private:
  template <typename... Parts>
  [[noreturn]] void Fail(const Parts&... what) const {
    throw UserError(path_.string(),
                    ": its NumPy header ",
                    what...,
                    ", where descr, fortran_order and shape of an array of ",
                    TextOf(elements_),
                    " would be right.");
  }

  void SkipBlanks() {
    while (!text_.empty() && (text_[0] == ' ' || text_[0] == '\n')) text_.remove_prefix(1);
  }

  bool Accept(char c) {
    SkipBlanks();
    if (text_.empty() || text_[0] != c) return false;
    text_.remove_prefix(1);
    return true;
  }

  void Expect(char c) {
    if (!Accept(c)) Fail("has no ", c, " where one belongs");
  }

  std::string_view Quoted() {
    Expect('\'');
    const size_t end = text_.find('\'');
    if (end == std::string_view::npos) Fail("has a text without an end");
    const std::string_view text = text_.substr(0, end);
    text_.remove_prefix(end + 1);
    return text;
  }

  bool Boolean() {
    SkipBlanks();
    for (const auto& [word, value] : {std::pair("True", true), std::pair("False", false)}) {
      if (!text_.starts_with(word)) continue;
      text_.remove_prefix(std::strlen(word));
      return value;
    }
    Fail("has a fortran_order that is neither True nor False");
  }

  std::vector<int64_t> Shape() {
    std::vector<int64_t> shape;
    int64_t product = 1;
    Expect('(');
    while (!Accept(')')) {
      SkipBlanks();
      int64_t side = 0;
      const auto [end, error] = std::from_chars(text_.data(), text_.data() + text_.size(), side);
      if (error != std::errc() || side < 0 || side > kMostElements) {
        Fail("has a shape with a side that is no number of elements");
      }
      text_.remove_prefix(static_cast<size_t>(end - text_.data()));
      shape.push_back(side);
      if (shape.size() > kMostDimensions || (side > 0 && product > kMostElements / side)) {
        Fail("has a shape of more elements than any file");
      }
      product *= side;
      if (!Accept(',')) {
        Expect(')');
        break;
      }
    }
    return shape;
  }

  void SetType(std::string_view descr, NpyArray* array) const {
    const bool are_whole = elements_ == NpyElements::kWholeNumbers;
    const std::string_view kinds = are_whole ? "biu" : "f", sizes = are_whole ? "1248" : "248";
    const bool is_known = descr.size() == 3 &&
                          (descr[0] == '<' || descr[0] == '>' || descr[0] == '|') &&
                          kinds.find(descr[1]) != std::string_view::npos &&
                          sizes.find(descr[2]) != std::string_view::npos;
    if (!is_known || (descr[0] == '|') != (descr[2] == '1') ||
        (descr[1] == 'b' && descr[2] != '1')) {
      Fail("says elements of type " + Shortened(descr));
    }
    array->big_endian = descr[0] == '>';
    array->kind = descr[1];
    array->bytes = descr[2] - '0';
  }

  const fs::path& path_;
  std::string_view text_;
  const NpyElements elements_;
};

template <typename T>
T ElementAt(const std::string& data, int64_t index, bool big_endian) {
  std::array<char, sizeof(T)> bytes;
  std::memcpy(bytes.data(), data.data() + index * static_cast<int64_t>(sizeof(T)), sizeof(T));
  if (big_endian) std::reverse(bytes.begin(), bytes.end());
  return std::bit_cast<T>(bytes);
}

// IEEE 754's half precision: 1 bit of sign, 5 of exponent, 10 of mantissa.
double FromHalf(uint16_t bits) {
  const int exponent = bits >> 10 & 31, mantissa = bits & 1023;
  double value = std::ldexp(mantissa, -24);
  if (exponent == 31) {
    value = mantissa == 0 ? std::numeric_limits<double>::infinity()
                          : std::numeric_limits<double>::quiet_NaN();
  } else if (exponent > 0) {
    value = std::ldexp(1024 + mantissa, exponent - 25);
  }
  return (bits & 0x8000) != 0 ? -value : value;
}

uint32_t LittleEndian(std::string_view bytes) {
  uint32_t value = 0;
  for (size_t i = bytes.size(); i-- > 0;) value = value << 8 | static_cast<uint8_t>(bytes[i]);
  return value;
}

}  // namespace

int64_t NpyArray::NumElements() const {
  int64_t count = 1;
  for (const int64_t side : shape) count *= side;
  return count;
}

int64_t NpyArray::operator[](int64_t index) const {
  const bool is_signed = kind == 'i';
  switch (bytes) {
    case 1:
      return is_signed ? ElementAt<int8_t>(data, index, false)
                       : int64_t{ElementAt<uint8_t>(data, index, false)};
    case 2:
      return is_signed ? ElementAt<int16_t>(data, index, big_endian)
                       : int64_t{ElementAt<uint16_t>(data, index, big_endian)};
    case 4:
      return is_signed ? ElementAt<int32_t>(data, index, big_endian)
                       : int64_t{ElementAt<uint32_t>(data, index, big_endian)};
    default:
      // Ids beyond the range become negative, which no reader takes for an id.
      return ElementAt<int64_t>(data, index, big_endian);
  }
}

double NpyArray::RealAt(int64_t index) const {
  CHECK_EQ(kind, 'f');
  switch (bytes) {
    case 2:
      return FromHalf(ElementAt<uint16_t>(data, index, big_endian));
    case 4:
      return ElementAt<float>(data, index, big_endian);
    default:
      return ElementAt<double>(data, index, big_endian);
  }
}

NpyArray ParseNpy(const fs::path& path, std::string bytes, NpyElements elements) {
  const auto fail = [&](const char* what) {
    throw UserError(path.string(), ": ", what, "; is the copy complete?");
  };
  if (!std::string_view(bytes).starts_with(kNpyMagic)) {
    throw UserError(path.string(),
                    ": is no .npy file of NumPy, where an array of ",
                    TextOf(elements),
                    " would be right.");
  }
  if (bytes.size() < 10) fail("ends within the header of its array");
  const int version = bytes[6];
  if (version < 1 || version > 3 || bytes[7] != 0) {
    throw UserError(path.string(),
                    ": is of version ",
                    version,
                    " of NumPy's format, where 1 to 3 would be right.");
  }
  const size_t begin = version == 1 ? 10 : 12;
  if (bytes.size() < begin) fail("ends within the header of its array");
  const size_t length = LittleEndian(std::string_view(bytes).substr(8, begin - 8));
  if (length > bytes.size() - begin) fail("ends within the header of its array");
  NpyArray array =
      HeaderParser(path, std::string_view(bytes).substr(begin, length), elements).Parse();
  bytes.erase(0, begin + length);
  const int64_t needed = array.NumElements() * array.bytes;
  if (static_cast<int64_t>(bytes.size()) != needed) {
    throw UserError(path.string(),
                    ": has ",
                    bytes.size(),
                    " bytes of elements, where its header promises ",
                    needed,
                    "; is the copy complete?");
  }
  array.data = std::move(bytes);
  return array;
}

NpyArray ReadNpyFile(const fs::path& path) {
  std::string bytes = ReadFileBytes(path, "a NumPy array");
  if (!std::string_view(bytes).starts_with(kZipMagic)) return ParseNpy(path, std::move(bytes));
  const std::vector<ZipMember> members = ListZip(path, bytes);
  std::vector<const ZipMember*> arrays;
  for (const ZipMember& member : members) {
    if (member.name.ends_with(".npy")) arrays.push_back(&member);
  }
  if (arrays.size() > 1) {
    for (const char* name : {"mask.npy", "masks.npy", "labels.npy", "arr_0.npy"}) {
      for (const ZipMember* member : arrays) {
        if (member->name == name) return ParseNpy(path, ExtractZip(path, bytes, *member));
      }
    }
  }
  if (arrays.size() != 1) {
    throw UserError(path.string(),
                    ": holds ",
                    arrays.size(),
                    " arrays, where one, or one named mask, would be right.");
  }
  return ParseNpy(path, ExtractZip(path, bytes, *arrays[0]));
}

bool IsNpyFile(const fs::path& path) {
  InputFile file(path, "a mask");
  char bytes[6];
  const std::string_view begin(bytes, file.Read(bytes, sizeof(bytes)));
  return begin.starts_with(kNpyMagic) || begin.starts_with(kZipMagic);
}

}  // namespace semfoam
