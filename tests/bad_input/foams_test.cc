// SPDX-License-Identifier: GPL-3.0-or-later
//
// Bad scene.foam.
#include "export/io/byte_writer.h"
#include "foam/model/model.h"

#include <cstring>
#include <limits>

#include "tests/bad_input/bad_input.h"
#include "tests/small_files.h"

#define XXH_INLINE_ALL
#include <xxhash.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

// A spoiler: the file is changed and gets the checksum of what it is then.
auto Resealed(const std::function<void(std::string&)>& change) {
  return [=](const fs::path& folder) {
    std::string bytes = ReadFile(folder / "scene.foam");
    bytes.resize(bytes.size() - 8);
    change(bytes);
    AppendBinary(uint64_t{XXH64(bytes.data(), bytes.size(), 0)}, &bytes);
    WriteFile(folder / "scene.foam", bytes);
  };
}

// A spoiler: a text in the header becomes another, and its length is told anew.
auto Header(const std::string& from, const std::string& to) {
  return Resealed([=](std::string& bytes) {
    const size_t at = bytes.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    bytes.replace(at, from.size(), to);
    uint64_t length = 0;
    std::memcpy(&length, &bytes[16], 8);
    length += to.size() - from.size();
    std::memcpy(&bytes[16], &length, 8);
  });
}

TEST(Foams, SceneFoam) {
  const std::string huge = "1152921504606846976";
  const std::vector<BadInput> cases = {
      {"missing", Remove("scene.foam"), {"IN/scene.foam", {}, "no such file"}},
      {"a folder", MakeFolder("scene.foam"), {"IN/scene.foam", {}, "is a folder"}},
      {"a pipe", MakePipe("scene.foam"), {"IN/scene.foam", {}, "is a pipe"}},
      {"a device", MakeDevice("scene.foam"), {"IN/scene.foam", {}, "is a device"}},
      {"empty", CutTo("scene.foam", 0), {"IN/scene.foam", {}, "not a foam model"}},
      {"cut preamble", CutTo("scene.foam", 20), {"IN/scene.foam", {}, "not a foam model"}},
      {"cut", CutTo("scene.foam", 1000), {"IN/scene.foam", {}, "checksum does not match"}},
      {"text",
       Put("scene.foam", "this is no foam but long enough to be one, or is it\n"),
       {"IN/scene.foam", {}, "not a foam model"}},
      {"one byte more",
       Append("scene.foam", "x"),
       {"IN/scene.foam", {}, "checksum does not match"}},
      {"another magic",
       Resealed([](auto& b) { b[0] = 's'; }),
       {"IN/scene.foam", {}, "not a foam model"}},
      {"a later version",
       Resealed([](auto& b) { b[8] = 9; }),
       {"IN/scene.foam", {"version 9"}, "reads versions 1 to 2"}},
      {"a turned bit",
       Replace("scene.foam", "mug", "mud"),
       {"IN/scene.foam", {}, "checksum does not match"}},
      {"header length 2^60",
       Resealed([](auto& b) { b[23] = 16; }),
       {"IN/scene.foam", {"header"}, "longer than the file"}},
      {"header is cut",
       Resealed([](auto& b) { b[17] = 0; }),
       {"IN/scene.foam", {"header"}, "not as it was written"}},
      {"header is no JSON",
       Header("\"sites\"", "sites"),
       {"IN/scene.foam", {"header"}, "not as it was written"}},
      {"header nested 1e5 deep",
       Header("\"sites\": 3", "\"sites\": " + std::string(100'000, '[')),
       {"IN/scene.foam", {"header"}, "not as it was written"}},
      {"a key twice",
       Header("\"sites\": 3", "\"sites\": 3, \"sites\": 4"),
       {"IN/scene.foam", {"header"}, "not as it was written"}},
      {"no sites", Header("\"sites\"", "\"cells\""), {"IN/scene.foam", {"sites"}, "not found"}},
      {"2^60 sites",
       Header("\"sites\": 3", "\"sites\": " + huge),
       {"IN/scene.foam", {"sites"}, "is not 0 to 210"}},
      {"4 sites",
       Header("\"sites\": 3", "\"sites\": 4"),
       {"IN/scene.foam", {"positions"}, "another size"}},
      {"1e300 sites",
       Header("\"sites\": 3", "\"sites\": 1e300"),
       {"IN/scene.foam", {"sites"}, "is not 0 to 209"}},
      {"-1 sites",
       Header("\"sites\": 3", "\"sites\": -1"),
       {"IN/scene.foam", {"sites"}, "is not 0 to 208"}},
      {"sites are a text",
       Header("\"sites\": 3", "\"sites\": \"3\""),
       {"IN/scene.foam", {"sites"}, "is not 0 to 208"}},
      {"SH degree 4",
       Header("\"sh_degree\": 0", "\"sh_degree\": 4"),
       {"IN/scene.foam", {"sh_degree"}, "is not 0 to 3"}},
      {"SH degree 2^32",
       Header("\"sh_degree\": 0", "\"sh_degree\": 4294967296"),
       {"IN/scene.foam", {"sh_degree"}, "is not 0 to 3"}},
      {"3 classes",
       Header("\"classes\": 2", "\"classes\": 3"),
       {"IN/scene.foam", {"label table"}, "another length"}},
      {"70000 classes",
       Header("\"classes\": 2", "\"classes\": 70000"),
       {"IN/scene.foam", {"classes"}, "is not 0 to 65536"}},
      {"identity of 8",
       Header("\"identity_dimension\": 16", "\"identity_dimension\": 8"),
       {"IN/scene.foam", {"identity_dimension"}, "is not 16 to 16"}},
      {"scale 0",
       Header("\"scale\": 1.0", "\"scale\": 0"),
       {"IN/scene.foam", {"scale"}, "not positive"}},
      {"scale 1e400",
       Header("\"scale\": 1.0", "\"scale\": 1e400"),
       {"IN/scene.foam", {"header"}, "not as it was written"}},
      {"label id -1",
       Header("\"id\": 7", "\"id\": -1"),
       {"IN/scene.foam", {"id"}, "is not 0 to 65535"}},
      {"label id 2^32 + 7",
       Header("\"id\": 7", "\"id\": 4294967303"),
       {"IN/scene.foam", {"id"}, "is not 0 to 65535"}},
      {"label twice", Header("\"id\": 7", "\"id\": 0"), {"IN/scene.foam", {"id 0"}, "two labels"}},
      {"label without name",
       Header("\"name\": \"mug\"", "\"nom\": \"mug\""),
       {"IN/scene.foam", {"name"}, "not found"}},
      {"photo of no width",
       Header("\"width\": 64", "\"width\": 0"),
       {"IN/scene.foam", {"width"}, "is not 1 to 1000000"}},
      {"photo of 1e99 pixels",
       Header("\"width\": 64", "\"width\": 1e99"),
       {"IN/scene.foam", {"width"}, "is not 1 to 1000000"}},
      {"rotation of length 2",
       Header("1.0,\n    0.0,\n    0.0,\n    0.0", "2,0,0,0"),
       {"IN/scene.foam", {"rotation", "a/b.jpg"}, "another length"}},
      {"offset beyond the end",
       Header("\"offset\": 0", "\"offset\": " + huge),
       {"IN/scene.foam", {"offset"}, "is not 0 to 2522"}},
      {"offset -64",
       Header("\"offset\": 0", "\"offset\": -64"),
       {"IN/scene.foam", {"offset"}, "is not 0 to 2506"}},
      {"offset in the last array",
       Header("\"offset\": 0", "\"offset\": 1200"),
       {"IN/scene.foam", {"positions"}, "beyond the end"}},
      {"another type",
       Header("\"float32\"", "\"float64\""),
       {"IN/scene.foam", {"classifier_bias"}, "another size"}},
      {"no positions",
       Header("\"positions\"", "\"position\""),
       {"IN/scene.foam", {"positions"}, "not found"}},
      {"a number that is none",
       Resealed([](auto& b) {
         const float nan = std::numeric_limits<float>::quiet_NaN();
         std::memcpy(&b[b.size() - 64], &nan, 4);  // the last array
       }),
       {"IN/scene.foam", {"stopped"}, "not finite"}},
  };
  ExpectMistakes(
      cases,
      [](const fs::path& f) { WriteModel(f / "scene.foam", SmallFoam(0)); },
      [](const fs::path& f) { ReadModel(f / "scene.foam"); });
}

}  // namespace
}  // namespace semfoam
