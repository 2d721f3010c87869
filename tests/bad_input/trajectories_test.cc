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
      {"missing",
       Remove("path.json"),
       "IN/path.json: there is no such file, where a trajectory (orbit, spiral or a JSON file) "
       "should be."},
      {"a pipe",
       MakePipe("path.json"),
       "IN/path.json: is a pipe, where a trajectory (orbit, spiral or a JSON file) should be."},
      {"a list",
       put("[1]"),
       "IN/path.json: is no trajectory; orbit, spiral or a JSON file with keyframes would be "
       "right."},
      {"deep",
       put("{\"version\": 1, \"keyframes\": [{\"position\": " + kNested + "}]}"),
       "IN/path.json: is nested deeper than 64 levels, where a few would be right; is it damaged?"},
      {"no version",
       put("{\"keyframes\": [" + key + "]}"),
       "IN/path.json: has no \"version\": 1, the only one there is."},
      {"version as a text",
       put("{\"version\": \"1\", \"keyframes\": [" + key + "]}"),
       "IN/path.json: has no \"version\": 1, the only one there is."},
      {"version 2",
       put("{\"version\": 2, \"keyframes\": [" + key + "]}"),
       "IN/path.json: has no \"version\": 1, the only one there is."},
      {"no keyframes",
       put("{\"version\": 1}"),
       "IN/path.json: has no keyframes; a list of {\"position\", \"look_at\"} would be right."},
      {"keyframes are an object",
       put("{\"version\": 1, \"keyframes\": {}}"),
       "IN/path.json: has no keyframes; a list of {\"position\", \"look_at\"} would be right."},
      {"not one keyframe",
       put("{\"version\": 1, \"keyframes\": []}"),
       "IN/path.json: has no keyframes; a list of {\"position\", \"look_at\"} would be right."},
      {"unknown key",
       with("\"speed\": 3"),
       "IN/path.json: has 'speed', where only closed, fov, fps, frames, height, keyframes, "
       "version, width would be right."},
      {"no camera",
       with("\"width\": 64"),
       "IN/path.json: lacks width, height or fov, which the foam has no photos to tell; all three "
       "would be right."},
      {"width 0",
       with("\"width\": 0, \"height\": 48, \"fov\": 60"),
       "IN/path.json: width is 0; a whole number from 1 to 16384 would be right."},
      {"width with a fraction",
       with("\"width\": 64.5, \"height\": 48, \"fov\": 60"),
       "IN/path.json: width is 64.5; a whole number from 1 to 16384 would be right."},
      {"width beyond all",
       with("\"width\": 1e9, \"height\": 48, \"fov\": 60"),
       "IN/path.json: width is 1000000000.0; a whole number from 1 to 16384 would be right."},
      {"negative height",
       with("\"width\": 64, \"height\": -48, \"fov\": 60"),
       "IN/path.json: height is -48; a whole number from 1 to 16384 would be right."},
      {"fov 180",
       with("\"width\": 64, \"height\": 48, \"fov\": 180"),
       "IN/path.json: fov is 180; a number from 1 to 170 would be right."},
      {"fov as a text",
       with("\"width\": 64, \"height\": 48, \"fov\": \"wide\""),
       "IN/path.json: fov is \"wide\"; a number from 1 to 170 would be right."},
      {"fps 0",
       with(sized + ", \"fps\": 0"),
       "IN/path.json: fps is 0; a number from 1 to 100 would be right."},
      {"frames 0",
       with(sized + ", \"frames\": 0"),
       "IN/path.json: frames is 0; a whole number from 1 to 100000 would be right."},
      {"frames with a fraction",
       with(sized + ", \"frames\": 2.5"),
       "IN/path.json: frames is 2.5; a whole number from 1 to 100000 would be right."},
      {"too many frames",
       with(sized + ", \"frames\": 4294967297"),
       "IN/path.json: frames is 4294967297; a whole number from 1 to 100000 would be right."},
      {"closed 1",
       with(sized + ", \"closed\": 1"),
       "IN/path.json: closed is 1; true or false would be right."},
      {"keyframe is a number",
       keyframe("3"),
       "IN/path.json: keyframe 0 lacks its position or look_at; both, as [x, y, z], would be "
       "right."},
      {"keyframe without look_at",
       keyframe(R"({"position": [0, 0, 1]})"),
       "IN/path.json: keyframe 0 lacks its position or look_at; both, as [x, y, z], would be "
       "right."},
      {"unknown key of a keyframe",
       keyframe(R"({"position": [0, 0, 1], "look_at": [0, 0, 0], "roll": 3})"),
       "IN/path.json: has 'roll', where only look_at, position, up would be right."},
      {"two coordinates",
       keyframe(R"({"position": [0, 1], "look_at": [0, 0, 0]})"),
       "IN/path.json: keyframe 0's position is [0,1]; [x, y, z] would be right."},
      {"coordinates are texts",
       keyframe(R"({"position": ["0", 1, 2], "look_at": [0, 0, 0]})"),
       "IN/path.json: keyframe 0's position is [\"0\",1,2]; [x, y, z] would be right."},
      {"coordinate null",
       keyframe(R"({"position": [null, 1, 2], "look_at": [0, 0, 0]})"),
       "IN/path.json: keyframe 0's position is [null,1,2]; [x, y, z] would be right."},
      {"position is a text",
       keyframe("{\"position\": \"" + std::string(500, 'x') + "\", \"look_at\": [0, 0, 0]}"),
       "IN/path.json: keyframe 0's position is "
       "\"xxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx...; [x, y, z] would be "
       "right."},
      {"looks at where it is",
       keyframe(R"({"position": [1, 0, 0], "look_at": [1, 0, 0], "up": [0, 0, 1]})"),
       "IN/path.json: keyframe 0 looks at where it is, or has an up of no length; other values "
       "would be right."},
      {"no up",
       keyframe(R"({"position": [1, 0, 0], "look_at": [0, 0, 0]})"),
       "IN/path.json: keyframe 0 has no up, which the foam has no photos to tell; \"up\": [x, y, "
       "z] would be right."},
      {"up of no length",
       keyframe(R"({"position": [1, 0, 0], "look_at": [0, 0, 0], "up": [0, 0, 0]})"),
       "IN/path.json: keyframe 0 looks at where it is, or has an up of no length; other values "
       "would be right."},
      {"beyond all distances",
       keyframe(R"({"position": [1e308, 0, 0], "look_at": [-1e308, 0, 0], "up": [0, 0, 1]})"),
       "IN/path.json: in frame 0 the camera would look at where it is, or be too far away; "
       "keyframes whose position and look_at stay apart would be right."},
  };
  ExpectSentencesOf(cases,
                    "path.json",
                    R"({"version": 1, "keyframes": [)" + key + "], " + sized + "}",
                    [](const fs::path& f) { ReadTrajectory(f / "path.json", Model(), {}); });
}

TEST(Trajectories, Manifests) {
  const auto put = [](const std::string& text) { return Put("manifest.json", text); };
  const auto frames = [&](const std::string& text) {
    return put("{\"version\": 1, \"frames\": [" + text + "]}");
  };
  const std::vector<BadInput> cases = {
      {"missing",
       Remove("manifest.json"),
       "IN/manifest.json: there is no such file, where a JSON file should be."},
      {"a list",
       put("[]"),
       "IN/manifest.json: is no manifest that view_interpolator wrote; the manifest.json beside "
       "its frames would be right."},
      {"no version",
       put("{\"frames\": []}"),
       "IN/manifest.json: is no manifest that view_interpolator wrote; the manifest.json beside "
       "its frames would be right."},
      {"version as a text",
       put("{\"version\": \"1\", \"frames\": []}"),
       "IN/manifest.json: is no manifest that view_interpolator wrote; the manifest.json beside "
       "its frames would be right."},
      {"no frames",
       put("{\"version\": 1}"),
       "IN/manifest.json: is no manifest that view_interpolator wrote; the manifest.json beside "
       "its frames would be right."},
      {"frames are a number",
       put("{\"version\": 1, \"frames\": 3}"),
       "IN/manifest.json: is no manifest that view_interpolator wrote; the manifest.json beside "
       "its frames would be right."},
      {"frame is a number",
       frames("3"),
       "IN/manifest.json: has a frame without its file, such as \"000000.png\"; is it damaged?"},
      {"frame without file",
       frames("{\"photo\": \"a.jpg\"}"),
       "IN/manifest.json: has a frame without its file, such as \"000000.png\"; is it damaged?"},
      {"file is a number",
       frames("{\"file\": 3}"),
       "IN/manifest.json: has a frame without its file, such as \"000000.png\"; is it damaged?"},
      {"photo is a number",
       frames("{\"file\": \"0.png\", \"photo\": 3}"),
       "IN/manifest.json: has a photo whose name is no text; is it damaged?"},
      {"photo that leaves",
       frames("{\"file\": \"0.png\", \"photo\": \"../a.jpg\"}"),
       "IN/manifest.json: names a file outside of its folder, ../a.jpg; a name as "
       "view_interpolator wrote it would be right."},
      {"absolute photo",
       frames("{\"file\": \"0.png\", \"photo\": \"/a.jpg\"}"),
       "IN/manifest.json: names a file outside of its folder, /a.jpg; a name as view_interpolator "
       "wrote it would be right."},
      {"file that leaves",
       frames("{\"file\": \"../0.png\", \"photo\": \"a.jpg\"}"),
       "IN/manifest.json: names a file outside of its folder, ../0.png; a name as "
       "view_interpolator wrote it would be right."},
      {"no mask",
       frames("{\"file\": \"1.png\", \"photo\": \"a.jpg\"}"),
       "IN/tracked: has no mask of a photo's frame, like IN/tracked/1.png."},
  };
  const auto prepare = [](const fs::path& folder) {
    WriteFile(folder / "manifest.json",
              R"({"version": 1, "frames": [{"file": "0.png", "photo": "a.jpg"}]})");
    WriteFile(folder / "tracked/0.png", "a mask");
  };
  ExpectSentences(cases, prepare, [](const fs::path& f) {
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
