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
      {"missing",
       Remove("scene.foam"),
       "IN/scene.foam: there is no such file, where a foam model such as foam_trainer's scene.foam "
       "should be."},
      {"a folder",
       MakeFolder("scene.foam"),
       "IN/scene.foam: is a folder, where a foam model such as foam_trainer's scene.foam should "
       "be."},
      {"a pipe",
       MakePipe("scene.foam"),
       "IN/scene.foam: is a pipe, where a foam model such as foam_trainer's scene.foam should be."},
      {"a device",
       MakeDevice("scene.foam"),
       "IN/scene.foam: is a device, where a foam model such as foam_trainer's scene.foam should "
       "be."},
      {"empty",
       CutTo("scene.foam", 0),
       "IN/scene.foam: this is not a foam model; foam_trainer writes one named scene.foam."},
      {"cut preamble",
       CutTo("scene.foam", 20),
       "IN/scene.foam: this is not a foam model; foam_trainer writes one named scene.foam."},
      {"cut",
       CutTo("scene.foam", 1000),
       "IN/scene.foam: it is damaged or cut (its checksum does not match); copy it again."},
      {"text",
       Put("scene.foam", "this is no foam but long enough to be one, or is it\n"),
       "IN/scene.foam: this is not a foam model; foam_trainer writes one named scene.foam."},
      {"one byte more",
       Append("scene.foam", "x"),
       "IN/scene.foam: it is damaged or cut (its checksum does not match); copy it again."},
      {"another magic",
       Resealed([](auto& b) { b[0] = 's'; }),
       "IN/scene.foam: this is not a foam model; foam_trainer writes one named scene.foam."},
      {"a later version",
       Resealed([](auto& b) { b[8] = 9; }),
       "IN/scene.foam: it has format version 9, and this program reads version 1; use the program "
       "version that wrote it."},
      {"a turned bit",
       Replace("scene.foam", "mug", "mud"),
       "IN/scene.foam: it is damaged or cut (its checksum does not match); copy it again."},
      {"header length 2^60",
       Resealed([](auto& b) { b[23] = 16; }),
       "IN/scene.foam: it is damaged (its header is longer than the file); train it again."},
      {"header is cut",
       Resealed([](auto& b) { b[17] = 0; }),
       "IN/scene.foam: it is damaged (its header is not as it was written); train it again."},
      {"header is no JSON",
       Header("\"sites\"", "sites"),
       "IN/scene.foam: it is damaged (its header is not as it was written); train it again."},
      {"header nested 1e5 deep",
       Header("\"sites\": 3", "\"sites\": " + std::string(100'000, '[')),
       "IN/scene.foam: it is damaged (its header is not as it was written); train it again."},
      {"a key twice",
       Header("\"sites\": 3", "\"sites\": 3, \"sites\": 4"),
       "IN/scene.foam: it is damaged (its header is not as it was written); train it again."},
      {"no sites",
       Header("\"sites\"", "\"cells\""),
       "IN/scene.foam: its header is damaged (key 'sites' not found); train it again."},
      {"2^60 sites",
       Header("\"sites\": 3", "\"sites\": " + huge),
       "IN/scene.foam: it is damaged (its 'sites' is not 0 to 210); train it again."},
      {"4 sites",
       Header("\"sites\": 3", "\"sites\": 4"),
       "IN/scene.foam: it is damaged (array 'positions' has another size than the header says); "
       "train it again."},
      {"1e300 sites",
       Header("\"sites\": 3", "\"sites\": 1e300"),
       "IN/scene.foam: it is damaged (its 'sites' is not 0 to 209); train it again."},
      {"-1 sites",
       Header("\"sites\": 3", "\"sites\": -1"),
       "IN/scene.foam: it is damaged (its 'sites' is not 0 to 208); train it again."},
      {"sites are a text",
       Header("\"sites\": 3", "\"sites\": \"3\""),
       "IN/scene.foam: it is damaged (its 'sites' is not 0 to 208); train it again."},
      {"SH degree 4",
       Header("\"sh_degree\": 0", "\"sh_degree\": 4"),
       "IN/scene.foam: it is damaged (its 'sh_degree' is not 0 to 3); train it again."},
      {"SH degree 2^32",
       Header("\"sh_degree\": 0", "\"sh_degree\": 4294967296"),
       "IN/scene.foam: it is damaged (its 'sh_degree' is not 0 to 3); train it again."},
      {"3 classes",
       Header("\"classes\": 2", "\"classes\": 3"),
       "IN/scene.foam: it is damaged (its label table has another length than its classifier); "
       "train it again."},
      {"70000 classes",
       Header("\"classes\": 2", "\"classes\": 70000"),
       "IN/scene.foam: it is damaged (its 'classes' is not 0 to 65536); train it again."},
      {"identity of 8",
       Header("\"identity_dimension\": 16", "\"identity_dimension\": 8"),
       "IN/scene.foam: it is damaged (its 'identity_dimension' is not 16 to 16); train it again."},
      {"scale 0",
       Header("\"scale\": 1.0", "\"scale\": 0"),
       "IN/scene.foam: it is damaged (its scale is not positive); train it again."},
      {"scale 1e400",
       Header("\"scale\": 1.0", "\"scale\": 1e400"),
       "IN/scene.foam: it is damaged (its header is not as it was written); train it again."},
      {"label id -1",
       Header("\"id\": 7", "\"id\": -1"),
       "IN/scene.foam: it is damaged (its 'id' is not 0 to 65535); train it again."},
      {"label id 2^32 + 7",
       Header("\"id\": 7", "\"id\": 4294967303"),
       "IN/scene.foam: it is damaged (its 'id' is not 0 to 65535); train it again."},
      {"label twice",
       Header("\"id\": 7", "\"id\": 0"),
       "IN/scene.foam: it is damaged (it has two labels of id 0); train it again."},
      {"label without name",
       Header("\"name\": \"mug\"", "\"nom\": \"mug\""),
       "IN/scene.foam: its header is damaged (key 'name' not found); train it again."},
      {"photo of no width",
       Header("\"width\": 64", "\"width\": 0"),
       "IN/scene.foam: it is damaged (its 'width' is not 1 to 1000000); train it again."},
      {"photo of 1e99 pixels",
       Header("\"width\": 64", "\"width\": 1e99"),
       "IN/scene.foam: it is damaged (its 'width' is not 1 to 1000000); train it again."},
      {"rotation of length 2",
       Header("1.0,\n    0.0,\n    0.0,\n    0.0", "2,0,0,0"),
       "IN/scene.foam: it is damaged (the rotation of photo 'a/b.jpg' has another length than 1); "
       "train it again."},
      {"offset beyond the end",
       Header("\"offset\": 0", "\"offset\": " + huge),
       "IN/scene.foam: it is damaged (its 'offset' is not 0 to 2522); train it again."},
      {"offset -64",
       Header("\"offset\": 0", "\"offset\": -64"),
       "IN/scene.foam: it is damaged (its 'offset' is not 0 to 2506); train it again."},
      {"offset in the last array",
       Header("\"offset\": 0", "\"offset\": 1200"),
       "IN/scene.foam: it is damaged (array 'positions' reaches beyond the end of the file); train "
       "it again."},
      {"another type",
       Header("\"float32\"", "\"float64\""),
       "IN/scene.foam: it is damaged (array 'classifier_bias' has another size than the header "
       "says); train it again."},
      {"no positions",
       Header("\"positions\"", "\"position\""),
       "IN/scene.foam: its header is damaged (key 'positions' not found); train it again."},
      {"a number that is none",
       Resealed([](auto& b) {
         const float nan = std::numeric_limits<float>::quiet_NaN();
         std::memcpy(&b[b.size() - 64], &nan, 4);  // the last array
       }),
       "IN/scene.foam: it is damaged (array 'stopped' holds a number that is not finite); "
       "train it again."},
  };
  ExpectSentences(
      cases,
      [](const fs::path& f) { WriteModel(f / "scene.foam", SmallFoam(0)); },
      [](const fs::path& f) { ReadModel(f / "scene.foam"); });
}

}  // namespace
}  // namespace semfoam
