// SPDX-License-Identifier: GPL-3.0-or-later
//
// Bad JSON: trajectories, the manifest of a film.
#include "tools/commands/commands.h"
#include "tools/views/trajectory.h"

#include "tests/bad_input/bad_input.h"

namespace semfoam {
namespace {

namespace fs = std::filesystem;

const std::string kNested = std::string(100'000, '[') + std::string(100'000, ']');

TEST(Trajectories, Trajectories) {
  const std::string key = R"({"position": [0, 0, 1], "look_at": [0, 0, 0], "up": [0, 1, 0]})";
  const auto put = [](const std::string& text) { return Put("path.json", text); };
  // With one more key beside the good ones.
  const auto with = [&](const std::string& more) {
    return put(R"({"version": 1, "keyframes": [)" + key + "], " + more + "}");
  };
  const std::string sized = R"("width": 64, "height": 48, "fov": 60)";
  const auto keyframe = [&](const std::string& text) {
    return put(R"({"version": 1, "keyframes": [)" + text + "], " + sized + "}");
  };
  const std::vector<BadInput> cases = {
      {"missing", Remove("path.json"), {"IN/path.json", {}, "no such file"}},
      {"a pipe", MakePipe("path.json"), {"IN/path.json", {}, "is a pipe"}},
      {"a list", put("[1]"), {"IN/path.json", {}, "is no trajectory"}},
      {"deep",
       put("{\"version\": 1, \"keyframes\": [{\"position\": " + kNested + "}]}"),
       {"IN/path.json", {}, "nested deeper"}},
      {"no version",
       put("{\"keyframes\": [" + key + "]}"),
       {"IN/path.json", {}, "has no \"version\""}},
      {"version as a text",
       put("{\"version\": \"1\", \"keyframes\": [" + key + "]}"),
       {"IN/path.json", {}, "has no \"version\""}},
      {"version 2",
       put("{\"version\": 2, \"keyframes\": [" + key + "]}"),
       {"IN/path.json", {}, "has no \"version\""}},
      {"no keyframes", put("{\"version\": 1}"), {"IN/path.json", {}, "has no keyframes"}},
      {"keyframes are an object",
       put("{\"version\": 1, \"keyframes\": {}}"),
       {"IN/path.json", {}, "has no keyframes"}},
      {"not one keyframe",
       put("{\"version\": 1, \"keyframes\": []}"),
       {"IN/path.json", {}, "has no keyframes"}},
      {"unknown key", with("\"speed\": 3"), {"IN/path.json", {"'speed'"}, "where only"}},
      {"no camera", with("\"width\": 64"), {"IN/path.json", {"width", "height", "fov"}, "lacks"}},
      {"width 0",
       with("\"width\": 0, \"height\": 48, \"fov\": 60"),
       {"IN/path.json", {"width", "0"}, "from 1 to 16384"}},
      {"width with a fraction",
       with("\"width\": 64.5, \"height\": 48, \"fov\": 60"),
       {"IN/path.json", {"width", "64.5"}, "from 1 to 16384"}},
      {"width beyond all",
       with("\"width\": 1e9, \"height\": 48, \"fov\": 60"),
       {"IN/path.json", {"width", "1000000000.0"}, "from 1 to 16384"}},
      {"negative height",
       with("\"width\": 64, \"height\": -48, \"fov\": 60"),
       {"IN/path.json", {"height", "-48"}, "from 1 to 16384"}},
      {"fov 180",
       with("\"width\": 64, \"height\": 48, \"fov\": 180"),
       {"IN/path.json", {"fov", "180"}, "from 1 to 170"}},
      {"fov as a text",
       with("\"width\": 64, \"height\": 48, \"fov\": \"wide\""),
       {"IN/path.json", {"fov", "\"wide\""}, "from 1 to 170"}},
      {"fps 0", with(sized + ", \"fps\": 0"), {"IN/path.json", {"fps", "0"}, "from 1 to 100"}},
      {"frames 0",
       with(sized + ", \"frames\": 0"),
       {"IN/path.json", {"frames", "0"}, "from 1 to 100000"}},
      {"frames with a fraction",
       with(sized + ", \"frames\": 2.5"),
       {"IN/path.json", {"frames", "2.5"}, "from 1 to 100000"}},
      {"too many frames",
       with(sized + ", \"frames\": 4294967297"),
       {"IN/path.json", {"frames", "4294967297"}, "from 1 to 100000"}},
      {"closed 1",
       with(sized + ", \"closed\": 1"),
       {"IN/path.json", {"closed", "1"}, "true or false"}},
      {"keyframe is a number",
       keyframe("3"),
       {"IN/path.json", {"keyframe 0", "position", "look_at"}, "lacks"}},
      {"keyframe without look_at",
       keyframe(R"({"position": [0, 0, 1]})"),
       {"IN/path.json", {"keyframe 0", "position", "look_at"}, "lacks"}},
      {"unknown key of a keyframe",
       keyframe(R"({"position": [0, 0, 1], "look_at": [0, 0, 0], "roll": 3})"),
       {"IN/path.json", {"'roll'"}, "where only"}},
      {"two coordinates",
       keyframe(R"({"position": [0, 1], "look_at": [0, 0, 0]})"),
       {"IN/path.json", {"keyframe 0", "position", "[0,1]"}, "[x, y, z]"}},
      {"coordinates are texts",
       keyframe(R"({"position": ["0", 1, 2], "look_at": [0, 0, 0]})"),
       {"IN/path.json", {"keyframe 0", "position", "[\"0\",1,2]"}, "[x, y, z]"}},
      {"coordinate null",
       keyframe(R"({"position": [null, 1, 2], "look_at": [0, 0, 0]})"),
       {"IN/path.json", {"keyframe 0", "position", "[null,1,2]"}, "[x, y, z]"}},
      {"position is a text",
       keyframe("{\"position\": \"" + std::string(500, 'x') + "\", \"look_at\": [0, 0, 0]}"),
       {"IN/path.json",
        {"keyframe 0",
         "position",
         "\"xxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx..."},
        "[x, y, z]"}},
      {"looks at where it is",
       keyframe(R"({"position": [1, 0, 0], "look_at": [1, 0, 0], "up": [0, 0, 1]})"),
       {"IN/path.json", {"keyframe 0"}, "looks at where it is"}},
      {"no up",
       keyframe(R"({"position": [1, 0, 0], "look_at": [0, 0, 0]})"),
       {"IN/path.json", {"keyframe 0"}, "has no up"}},
      {"up of no length",
       keyframe(R"({"position": [1, 0, 0], "look_at": [0, 0, 0], "up": [0, 0, 0]})"),
       {"IN/path.json", {"keyframe 0"}, "looks at where it is"}},
      {"beyond all distances",
       keyframe(R"({"position": [1e308, 0, 0], "look_at": [-1e308, 0, 0], "up": [0, 0, 1]})"),
       {"IN/path.json", {"frame 0"}, "too far away"}},
  };
  ExpectMistakesIn("path.json",
                   R"({"version": 1, "keyframes": [)" + key + "], " + sized + "}",
                   cases,
                   [](const fs::path& f) { ReadTrajectory(f / "path.json", Model(), {}); });
}

TEST(Trajectories, Manifests) {
  const auto put = [](const std::string& text) { return Put("manifest.json", text); };
  const auto frames = [&](const std::string& text) {
    return put("{\"version\": 1, \"frames\": [" + text + "]}");
  };
  const std::vector<BadInput> cases = {
      {"missing", Remove("manifest.json"), {"IN/manifest.json", {}, "no such file"}},
      {"a list", put("[]"), {"IN/manifest.json", {}, "is no manifest"}},
      {"no version", put("{\"frames\": []}"), {"IN/manifest.json", {}, "is no manifest"}},
      {"version as a text",
       put("{\"version\": \"1\", \"frames\": []}"),
       {"IN/manifest.json", {}, "is no manifest"}},
      {"no frames", put("{\"version\": 1}"), {"IN/manifest.json", {}, "is no manifest"}},
      {"frames are a number",
       put("{\"version\": 1, \"frames\": 3}"),
       {"IN/manifest.json", {}, "is no manifest"}},
      {"frame is a number", frames("3"), {"IN/manifest.json", {}, "frame without its file"}},
      {"frame without file",
       frames("{\"photo\": \"a.jpg\"}"),
       {"IN/manifest.json", {}, "frame without its file"}},
      {"file is a number",
       frames("{\"file\": 3}"),
       {"IN/manifest.json", {}, "frame without its file"}},
      {"photo is a number",
       frames("{\"file\": \"0.png\", \"photo\": 3}"),
       {"IN/manifest.json", {"photo"}, "no text"}},
      {"photo that leaves",
       frames("{\"file\": \"0.png\", \"photo\": \"../a.jpg\"}"),
       {"IN/manifest.json", {"../a.jpg"}, "outside of its folder"}},
      {"absolute photo",
       frames("{\"file\": \"0.png\", \"photo\": \"/a.jpg\"}"),
       {"IN/manifest.json", {"/a.jpg"}, "outside of its folder"}},
      {"file that leaves",
       frames("{\"file\": \"../0.png\", \"photo\": \"a.jpg\"}"),
       {"IN/manifest.json", {"../0.png"}, "outside of its folder"}},
      {"no mask",
       frames("{\"file\": \"1.png\", \"photo\": \"a.jpg\"}"),
       {"IN/tracked", {"IN/tracked/1.png"}, "has no mask"}},
  };
  const auto prepare = [](const fs::path& folder) {
    WriteFile(folder / "manifest.json",
              R"({"version": 1, "frames": [{"file": "0.png", "photo": "a.jpg"}]})");
    WriteFile(folder / "tracked/0.png", "a mask");
  };
  ExpectMistakes(cases, prepare, [](const fs::path& f) {
    const std::string manifest = (f / "manifest.json").string();
    const std::string tracked = (f / "tracked").string();
    const std::string out = (f / "out").string();
    const char* arguments[] = {"view_interpolator",
                               "--manifest_path",
                               manifest.c_str(),
                               "--mask_path",
                               tracked.c_str(),
                               "--output_path",
                               out.c_str()};
    RunViewInterpolator(7, const_cast<char**>(arguments));
    EXPECT_FALSE(fs::exists(f / "out"));
  });
}

}  // namespace
}  // namespace semfoam
