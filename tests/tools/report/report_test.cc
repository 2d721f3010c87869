// SPDX-License-Identifier: GPL-3.0-or-later
//
// The report's page in a real browser: what its shader draws and picks against the renderer, what
// its controls do, and that it stays whole whatever names are in it.
#include "foam/edit/model_sites.h"
#include "foam/geometry/guard_sites.h"
#include "foam/image/metrics.h"
#include "foam/model/model.h"
#include "foam/view/view_renderer.h"
#include "plugin/colmap/camera_models.h"
#include "plugin/colmap/camera_rays.h"
#include "plugin/colmap/colmap_model.h"
#include "tools/images/view_images.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "tests/tools/program.h"
#include "tests/tools/report/browser.h"
#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;

constexpr int kWidth = 64, kHeight = 48;

// Base64 of the page's bytes, decoded.
std::vector<uint8_t> Decoded(const std::string& text) {
  std::vector<uint8_t> bytes;
  uint32_t bits = 0;
  int count = 0;
  for (const char c : text) {
    if (c == '=') break;
    const char* const kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    bits = bits << 6 | static_cast<uint32_t>(std::string_view(kDigits).find(c));
    count += 6;
    if (count >= 8) bytes.push_back(static_cast<uint8_t>(bits >> (count -= 8)));
  }
  return bytes;
}

// What the page draws of a photo's view, at kWidth x kHeight with one ray a pixel: colours, and
// classes + 1.
struct Drawn {
  Image8 colors;
  std::vector<int> labels;
};

Drawn Draw(Browser* browser, size_t camera) {
  const json drawn = browser->Evaluate(
      "(() => { const v = semfoam.viewer, c = semfoam.report.cameras[" + std::to_string(camera) +
      "]; const x = 64 / c.width, y = 48 / c.height;"
      "const lens = {fx: c.fx * x, fy: c.fy * y, cx: c.cx * x, cy: c.cy * y};"
      "const r = v.renderer.render(v.poseOf(c), lens, 64, 48, 0, 1);"
      "return {colors: btoa(String.fromCharCode(...r.colors)), labels: [...r.labels]}; })()");
  Drawn result;
  result.labels = drawn.at("labels").get<std::vector<int>>();
  result.colors = {kWidth, kHeight, {}};
  const std::vector<uint8_t> bytes = Decoded(drawn.at("colors"));
  for (size_t i = 0; i + 3 < bytes.size(); i += 4) {
    result.colors.data.insert(result.colors.data.end(), &bytes[i], &bytes[i] + 3);
  }
  EXPECT_EQ(result.colors.data.size(), size_t{3} * kWidth * kHeight);
  return result;
}

RenderedView Rendered(const Model& model, const ViewRenderer& renderer, const PhotoRecord& photo) {
  Camera camera = RescaledCamera(WithoutDistortion(CameraOf(photo, "a model")), kWidth, kHeight);
  return RenderCamera(renderer, camera, PoseOf(photo), model.world_from_normalized, 1);
}

// Expects that the page draws views of these cameras as the renderer does.
void ExpectSamePictures(const Model& model, const std::vector<size_t>& cameras, Browser* browser) {
  const ViewRenderer renderer(model.foam);
  for (const size_t camera : cameras) {
    const RenderedView rendered = Rendered(model, renderer, model.photos[camera]);
    const Drawn drawn = Draw(browser, camera);
    EXPECT_GE(Psnr(drawn.colors, ColorImage(rendered)), 45) << camera;
    size_t equal = 0;
    for (size_t i = 0; i < drawn.labels.size(); ++i) {
      equal += drawn.labels[i] - 1 == Value(rendered.class_index[i]);
    }
    EXPECT_GE(static_cast<double>(equal) / static_cast<double>(drawn.labels.size()), 0.995)
        << camera;
  }
}

// The same of three cameras.
void ExpectSamePictures(const Model& model, Browser* browser) {
  ExpectSamePictures(model, {0, model.photos.size() / 2, model.photos.size() - 1}, browser);
}

Model WithoutSemantics(Model model) {
  model.foam.num_classes = 0;
  model.foam.identity.clear();
  model.foam.classifier_weight.clear();
  model.foam.classifier_bias.clear();
  model.labels.clear();
  return model;
}

class ReportTest : public testing::Test {
 protected:
  // Trains a small foam once for all tests.
  static void SetUpTestSuite() {
    folder_ = new TempFolder;
    const Outcome outcome = RunSemfoam(
        TinyTraining(TrainerOn(kTabletop, Trained().parent_path(), {"--test_every", "8"})));
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  }
  static void TearDownTestSuite() {
    delete folder_;
    folder_ = nullptr;
  }

  static fs::path Trained() { return *folder_ / "trained/scene.foam"; }

  // Writes the report of a foam, with these options besides.
  static fs::path Report(const fs::path& foam, const std::vector<std::string>& more = {}) {
    const fs::path path = foam.parent_path() / "report.html";
    std::vector<std::string> arguments = {"report_writer",
                                          "--foam_path",
                                          foam.string(),
                                          "--image_path",
                                          (kTabletop / "images").string(),
                                          "--output_path",
                                          path.parent_path().string(),
                                          "--max_views",
                                          "2",
                                          "--supersample",
                                          "1"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const Outcome outcome = RunSemfoam(arguments);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_THAT(outcome.err, HasSubstr("report.html"));
    return path;
  }

  // Writes the model into a folder of its own, and its report.
  static fs::path Report(const char* name, const Model& model) {
    const fs::path foam = *folder_ / name / "scene.foam";
    fs::create_directories(foam.parent_path());
    WriteModel(foam, model);
    return Report(foam);
  }

  // Opens a report and waits for its first picture, and then draws nothing that a test does not ask
  // for: on the CPU, fine pictures take seconds.
  static void Open(Browser* browser, const fs::path& report) {
    browser->Open(report, "window.semfoam && (semfoam.firstPicture || semfoam.error)");
    EXPECT_EQ(browser->Evaluate("semfoam.error"), json());
    browser->Evaluate("semfoam.viewer.tick = () => {}");
  }

  // Opens a report and waits until everything is drawn, small pictures of the objects too.
  static void OpenWhole(Browser* browser, const fs::path& report) {
    browser->Open(report, "window.semfoam && semfoam.ready");
    EXPECT_EQ(browser->Evaluate("semfoam.error"), json());
  }

  static void ExpectQuiet(const Browser& browser) {
    EXPECT_THAT(browser.messages(), IsEmpty());
    EXPECT_THAT(browser.requests(), IsEmpty());
  }

  static inline TempFolder* folder_ = nullptr;
};

class ReportPageTest : public ReportTest {
 protected:
  void SetUp() override {
    if (!Browser::IsInstalled()) {
      GTEST_SKIP() << "there is no Chromium; tools/install_packages --browser installs it";
    }
  }
};

TEST_F(ReportTest, SameBytesOnAnyThreads) {
  const std::string once = ReadFile(Report(Trained(), {"--num_threads", "1"}));
  EXPECT_TRUE(once == ReadFile(Report(Trained(), {"--num_threads", "5"})));
  // The only address in it is the name of a language. (Base64 has no colon.)
  EXPECT_EQ(once.find("https:"), std::string::npos);
  for (size_t at = once.find("http:"); at != std::string::npos; at = once.find("http:", at + 1)) {
    EXPECT_EQ(once.substr(at, 26), "http://www.w3.org/2000/svg");
  }
}

TEST_F(ReportTest, RefusesWhatIsWrong) {
  const TempFolder output;
  WriteFile(output / "mine.html", "<p>mine</p>\n");
  const std::vector<std::string> command = {
      "report_writer", "--image_path", (kTabletop / "images").string()};
  const auto refuse = [&](std::vector<std::string> more, const Mistake& mistake) {
    std::vector<std::string> arguments = command;
    arguments.insert(arguments.end(), more.begin(), more.end());
    ExpectRefused(RunSemfoam(arguments), mistake);
    EXPECT_THAT(FilesBelow(output.path()), testing::ElementsAre("mine.html"));
    EXPECT_EQ(ReadFile(output / "mine.html"), "<p>mine</p>\n");
  };
  const std::string foam = Trained().string();
  refuse({"--foam_path", foam, "--output_path", (output / "mine.html").string()},
         {"mine.html", {}, "would be lost"});
  refuse({"--foam_path", foam, "--output_path", (output / "new").string(), "--max_views", "0"},
         {"", {"max_views", "0"}, "from 1 to 1000"});
  refuse({"--foam_path", (output / "mine.html").string(), "--output_path", (output / "r").string()},
         {"mine.html", {}, "is not a foam model"});
}

TEST_F(ReportTest, ThinsLargeFoams) {
  const fs::path report = Report(Trained(), {"--max_cells", "1500"});
  const std::string page = ReadFile(report);
  EXPECT_THAT(page, HasSubstr("\"num_sites\":1500"));
}

TEST_F(ReportPageTest, DrawsWhatTheRendererDraws) {
  Browser browser;
  OpenWhole(&browser, Report(Trained()));
  ExpectSamePictures(ReadModel(Trained()), &browser);
  ExpectQuiet(browser);
}

TEST_F(ReportPageTest, PicksWhatTheRendererSees) {
  const Model model = ReadModel(Trained());
  const ViewRenderer renderer(model.foam);
  const PhotoRecord& photo = model.photos.front();
  const RenderedView rendered = Rendered(model, renderer, photo);
  Browser browser;
  Open(&browser, Report(Trained()));
  const json picked = browser.Evaluate(
      "(() => { const v = semfoam.viewer, c = semfoam.report.cameras[0];"
      "const x = 64 / c.width, y = 48 / c.height, all = [];"
      "const lens = {fx: c.fx * x, fy: c.fy * y, cx: c.cx * x, cy: c.cy * y};"
      "for (let i = 0; i < 50; ++i) { const p = v.renderer.pick(v.poseOf(c), lens,"
      " (i * 13) % 64 + 0.5, (i * 7) % 48 + 0.5);"
      " all.push([p.label, p.distance, p.opacity]); } return all; })()");
  int agreeing = 0;
  for (int i = 0; i < 50; ++i) {
    const size_t pixel = size_t(i * 7 % 48) * kWidth + i * 13 % 64;
    agreeing += picked[i][0] == Value(rendered.class_index[pixel]);
    EXPECT_NEAR(picked[i][2], rendered.opacity[pixel], 0.02) << i;
    if (rendered.distance[pixel] > 0) {
      EXPECT_NEAR(picked[i][1], rendered.distance[pixel], 0.02 * rendered.distance[pixel]) << i;
    }
  }
  EXPECT_GE(agreeing, 49);
}

TEST_F(ReportPageTest, HidesAndIsolates) {
  Browser browser;
  Open(&browser, Report(Trained()));
  const auto labels_in_view = [&] { return Draw(&browser, 0).labels; };
  const std::vector<int> all = labels_in_view();
  // The object that most pixels show.
  const int label = browser.Evaluate("semfoam.report.objects[0].label");
  const auto count = [](const std::vector<int>& labels, int wanted) {
    return std::count(labels.begin(), labels.end(), wanted + 1);
  };
  ASSERT_GT(count(all, label), 20);
  const std::string text = std::to_string(label);
  browser.Evaluate("semfoam.viewer.setShow(" + text + ", 2)");
  const std::vector<int> hidden = labels_in_view();
  EXPECT_EQ(count(hidden, label), 0);
  browser.Evaluate("semfoam.viewer.showAll()");
  EXPECT_EQ(labels_in_view(), all);
  browser.Evaluate("semfoam.viewer.isolate(" + text + ")");
  const std::vector<int> alone = labels_in_view();
  EXPECT_GT(count(alone, label), count(all, label) / 2);
  for (size_t i = 0; i < alone.size(); ++i) {
    EXPECT_TRUE(alone[i] == 0 || alone[i] == label + 1 || all[i] != 0) << i;
  }
  EXPECT_EQ(std::count_if(
                alone.begin(), alone.end(), [&](int one) { return one > 0 && one != label + 1; }),
            0);
  // The link restores all of it.
  const std::string link = browser.Evaluate("semfoam.viewer.link()");
  EXPECT_THAT(link, HasSubstr("only=" + text));
  browser.Evaluate("semfoam.viewer.showAll(), semfoam.viewer.follow(" + json(link).dump() + ")");
  EXPECT_EQ(labels_in_view(), alone);
}

TEST_F(ReportPageTest, MeasuresItsSpeedBesideAScalarWalk) {
  Browser browser;
  browser.Open(
      Report(Trained()), "window.semfoam && (semfoam.benchmark || semfoam.error)", "benchmark");
  const json measured = browser.Evaluate("semfoam.benchmark");
  EXPECT_EQ(
      json::parse(
          browser.Evaluate("document.getElementById('benchmark').textContent").get<std::string>()),
      measured);
  EXPECT_GT(measured.at("frames_per_second"), 0);
  EXPECT_GT(measured.at("scalar_frames_per_second"), 0);
  // As many cells as the renderer's rays meet, and the faces of a Voronoi cell.
  EXPECT_GT(measured.at("cells_per_ray"), 3);
  const double faces =
      measured.at("faces_per_ray").get<double>() / measured.at("cells_per_ray").get<double>();
  EXPECT_GT(faces, 10);
  EXPECT_LT(faces, 25);
}

TEST_F(ReportPageTest, MovesObjectsApart) {
  Browser browser;
  Open(&browser, Report(Trained()));
  const Drawn together = Draw(&browser, 0);
  // Each object on its own, in its place: all but soft borders looks the same.
  browser.Evaluate("semfoam.viewer.setExplosion(1e-6)");
  EXPECT_GE(Psnr(Draw(&browser, 0).colors, together.colors), 22);
  browser.Evaluate("semfoam.viewer.setExplosion(0.8)");
  EXPECT_LT(Psnr(Draw(&browser, 0).colors, together.colors), 20);
  browser.Evaluate("semfoam.viewer.setExplosion(0)");
  EXPECT_EQ(Draw(&browser, 0).colors.data, together.colors.data);
}

TEST_F(ReportPageTest, ShowsSurfacesWhereTheFoamShowsObjects) {
  Browser browser;
  Open(&browser, Report(Trained()));
  browser.WaitUntil("!document.getElementById('overlays')");
  const auto labels_with = [&](const std::string& meshes) {
    return browser
        .Evaluate(
            "(() => { const v = semfoam.viewer, c = semfoam.report.cameras[0];"
            "const x = 64 / c.width, y = 48 / c.height;"
            "const lens = {fx: c.fx * x, fy: c.fy * y, cx: c.cx * x, cy: c.cy * y};"
            "return [...v.renderer.render(v.poseOf(c), lens, 64, 48, 0, 1, [1, 2],"
            "{meshes: " +
            meshes + ", points: false, scale: 1}).labels]; })()")
        .get<std::vector<int>>();
  };
  const std::vector<int> foam = labels_with("0"), surfaces = labels_with("2");
  // Over the foam the nearer of both is seen.
  const std::vector<int> over = labels_with("1");
  for (size_t i = 0; i < over.size(); ++i) {
    EXPECT_TRUE(over[i] == foam[i] || over[i] == surfaces[i]) << i;
  }
  EXPECT_NE(over, foam);
  // Where both show an object, it is the same one; a short training leaves the surfaces some holes.
  int both = 0, same = 0;
  for (size_t i = 0; i < foam.size(); ++i) {
    both += foam[i] > 0 && surfaces[i] > 0;
    same += foam[i] > 0 && surfaces[i] == foam[i];
  }
  EXPECT_GT(both, kWidth * kHeight / 2);
  EXPECT_GT(same, 0.75 * both);
}

TEST_F(ReportPageTest, ShowsThePointsOfTheModel) {
  Browser browser;
  const fs::path sparse = kTabletop / "sparse/0";
  Open(&browser, Report(Trained(), {"--input_path", sparse.string()}));
  browser.WaitUntil("!document.getElementById('overlays')");
  const std::vector<Point3D> points = ReadReconstruction(sparse).points;
  const auto good = std::count_if(
      points.begin(), points.end(), [](const Point3D& point) { return point.track.size() >= 3; });
  EXPECT_EQ(browser.Evaluate("semfoam.report.overlays.points.points"), good);
  // Some are seen; none that the foam hides; and each is picked where it is seen.
  const json seen = browser.Evaluate(
      "(() => { const v = semfoam.viewer, c = semfoam.report.cameras[0], pose = v.poseOf(c);"
      "const over = {meshes: 0, points: true, scale: 1}, base = 0x20000000;"
      "const { labels } = v.renderer.render(pose, c, c.width, c.height, 0, 1, [1, 2], over);"
      "let count = 0, same = 0; labels.forEach((id, i) => { if (id < base || count === 20) return;"
      "++count; const p = v.renderer.pick(pose, c, i % c.width + 0.5,"
      "Math.floor(i / c.width) + 0.5, over); same += p.sfmPoint >= 0 && p.label < 0; });"
      "return [count, same]; })()");
  EXPECT_EQ(seen[0], 20);
  EXPECT_GE(seen[1], 18);
  ExpectQuiet(browser);
}

TEST_F(ReportPageTest, FliesToTheCameraThatIsClicked) {
  Browser browser;
  Open(&browser, Report(Trained()));
  browser.WaitUntil("semfoam.viewer.renderer.pictures");
  // Straight at the picture of camera 5 from before it, nearer than all else.
  const json picked = browser.Evaluate(
      "(() => { const v = semfoam.viewer, c = semfoam.report.cameras[5], q = v.corners(c);"
      "const m = [0, 1, 2].map((k) => (q[0][k] + q[2][k]) / 2);"
      "const eye = c.center.map((e, k) => e - (m[k] - e) * 0.5);"
      "v.setShowsCameras(true); v.renderer.setStates(v.states(-1).map(() => ({object: 0, loose: "
      "0})));"
      "v.pose = {eye, camFromWorld: c.cam_from_world}; v.focal = 1;"
      "const h = v.canvas.clientHeight, w = v.canvas.clientWidth;"
      "return v.pick(w / 2, h / 2).camera; })()");
  EXPECT_EQ(picked, 5);
  browser.Evaluate("v = semfoam.viewer, v.flyToCamera(5), v.advance(performance.now() + 1e4)");
  EXPECT_EQ(browser.Evaluate("semfoam.viewer.camera"), 5);
  // The photo comes up over the render.
  browser.WaitUntil("Number(document.getElementById('photo').style.opacity) === 1");
  ExpectQuiet(browser);
}

TEST_F(ReportPageTest, SavesEditsAsLabelEditorReadsThem) {
  Browser browser;
  Open(&browser, Report(Trained()));
  // Merged in the table, hidden, renamed; and an outline around most of a photo, and a point.
  const json labels = browser.Evaluate("semfoam.report.objects.map((one) => one.label)");
  ASSERT_GE(labels.size(), 5u);
  browser.Evaluate(
      "document.querySelectorAll('#objects tbody tr')[1].querySelectorAll('button')[3].click();"
      "document.querySelectorAll('#objects tbody tr')[0].click();"
      "semfoam.viewer.setShow(" +
      labels[2].dump() + ", 2); semfoam.edits.rename(" + labels[0].dump() +
      ", 'all of it');"
      "semfoam.edits.mark({label: 'mine', camera: 0, points: [[9, 9], [300, 9], [300, 200]]});"
      "semfoam.edits.mark({label: 'all of it', camera: 0, points: [[160.5, 120.5]]})");
  EXPECT_EQ(browser.Evaluate("document.querySelectorAll('#edits li').length"), 5);
  // Both look like one object.
  EXPECT_EQ(browser.Evaluate("semfoam.viewer.roots[" + labels[1].dump() + "]"), labels[0]);
  const std::vector<int> drawn = Draw(&browser, 0).labels;
  EXPECT_EQ(std::count(drawn.begin(), drawn.end(), labels[1].get<int>() + 1), 0);
  EXPECT_EQ(browser.Evaluate("document.querySelectorAll('#objects tbody tr')[1].hidden"), true);
  const TempFolder output;
  WriteFile(output / "edits.json", browser.Evaluate("semfoam.edits.file()"));
  const Outcome outcome = RunSemfoam({"label_editor",
                                      "--foam_path",
                                      Trained().string(),
                                      "--edits_path",
                                      (output / "edits.json").string(),
                                      "--output_path",
                                      (output / "edited").string()});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  std::vector<std::string> names;
  for (const Label& label : ReadModel(output / "edited/scene.foam").labels) {
    names.push_back(label.name);
  }
  EXPECT_THAT(names, testing::IsSupersetOf({"all of it", "mine"}));
  const Model before = ReadModel(Trained());
  for (const int gone : {1, 2}) {
    EXPECT_THAT(names,
                testing::Not(testing::Contains(before.labels[labels[gone].get<int>()].name)));
  }
  // Taken back, nothing is left to save.
  for (int k = 0; k < 5; ++k)
    browser.Evaluate("document.querySelector('#edits li button').click()");
  EXPECT_EQ(browser.Evaluate("document.getElementById('edits').hidden"), true);
  ExpectQuiet(browser);
}

TEST_F(ReportPageTest, MarksLabelAFoamWithoutLabels) {
  Browser browser;
  const TempFolder output;
  fs::create_directories(output / "plain");
  WriteModel(output / "plain/scene.foam", WithoutSemantics(ReadModel(Trained())));
  Open(&browser, Report(output / "plain/scene.foam"));
  EXPECT_EQ(browser.Evaluate("document.getElementById('edits').hidden"), true);
  // An outline whose middle row is in two parts, and points on two photos; 0 is held out.
  browser.Evaluate(
      "document.getElementById('viewer').dispatchEvent(new KeyboardEvent('keydown', {key: 'n'}));"
      "semfoam.edits.mark({label: 'far', camera: 1, points: "
      "[[20, 5], [300, 5], [300, 60], [200, 60], [200, 20], [60, 20], [60, 60], [20, 60]]});"
      "semfoam.edits.mark({label: 'near, by', camera: 1, points: [[160.5, 200.5]]});"
      "semfoam.edits.mark({label: 'near, by', camera: 2, points: [[160.5, 200.5]]})");
  EXPECT_EQ(browser.Evaluate("document.getElementById('marking').hidden"), false);
  EXPECT_EQ(browser.Evaluate("[...document.querySelectorAll('#edits button')]"
                             ".filter((b) => !b.hidden && b.textContent.startsWith('Save'))"
                             ".map((b) => b.textContent)"),
            json::array({"Save marks.json"}));
  const json marks = json::parse(browser.Evaluate("semfoam.edits.marksFile()").get<std::string>());
  ASSERT_EQ(marks.size(), 2u);
  // The point in the outline is in the wider part.
  const json inside = marks[0]["shapes"][1]["points"][0];
  EXPECT_NEAR(inside[0].get<double>(), 250, 0.1);
  WriteFile(output / "marks.json", marks.dump());
  const Outcome outcome = RunSemfoam({"foam_labeler",
                                      "--foam_path",
                                      (output / "plain/scene.foam").string(),
                                      "--workspace_path",
                                      kTabletop.string(),
                                      "--mask_path",
                                      (output / "marks.json").string(),
                                      "--output_path",
                                      (output / "labelled").string()});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  std::vector<std::string> names;
  for (const Label& label : ReadModel(output / "labelled/scene.foam").labels) {
    names.push_back(label.name);
  }
  EXPECT_THAT(names, testing::UnorderedElementsAre("far", "near, by"));
  ExpectQuiet(browser);
}

TEST_F(ReportPageTest, MeasuresInTheUnitsOfTheModel) {
  Browser browser;
  Open(&browser, Report(Trained()));
  browser.Evaluate(
      "document.getElementById('viewer').dispatchEvent(new KeyboardEvent('keydown', {key: 'm'}))");
  const json box = browser.Evaluate(
      "(() => { const b = document.getElementById('canvas').getBoundingClientRect();"
      "return [b.left, b.top, b.width, b.height]; })()");
  const double left = box[0], top = box[1], width = box[2], height = box[3];
  const auto point_at = [&](double x, double y) {
    const json point = browser.Evaluate("semfoam.viewer.pick(" + std::to_string(x) + ", " +
                                        std::to_string(y) + ").point");
    return Eigen::Vector3d(point[0], point[1], point[2]);
  };
  const double x[2] = {std::round(0.4 * width), std::round(0.6 * width)};
  const double y = std::round(0.6 * height);
  const double distance = (point_at(x[0], y) - point_at(x[1], y)).norm() *
                          ReadModel(Trained()).world_from_normalized.scale;
  for (int k = 0; k < 2; ++k) {
    browser.Click(left + x[k], top + y);
    browser.WaitUntil("semfoam.viewer.measured.length === " + std::to_string(k + 1));
  }
  const std::string text = browser.Evaluate("document.getElementById('measure').textContent");
  ASSERT_THAT(text, StartsWith("Distance: "));
  EXPECT_NEAR(std::stod(text.substr(10)), distance, 1e-3 * distance) << text;
}

TEST_F(ReportPageTest, SavesNamesAsTheCommandsReadThem) {
  Browser browser;
  Open(&browser, Report(Trained()));
  // What would be saved as a file.
  browser.Evaluate(
      "URL.createObjectURL = (blob) => { blob.text().then((text) => { window.saved = text; });"
      " return 'blob:none'; }; HTMLAnchorElement.prototype.click = () => {};"
      "const name = document.querySelector('#objects .name'); name.value = 'my floor';"
      "name.dispatchEvent(new Event('change'));"
      "document.querySelector('#objects .actions button').click();");
  browser.WaitUntil("window.saved");
  const TempFolder output;
  WriteFile(output / "labels.json", browser.Evaluate("window.saved"));
  const Outcome outcome = RunSemfoam({"mesh_exporter",
                                      "--foam_path",
                                      Trained().string(),
                                      "--output_path",
                                      (output / "meshes").string(),
                                      "--labels_path",
                                      (output / "labels.json").string(),
                                      "--labels",
                                      "my floor",
                                      "--formats",
                                      "ply"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(FilesBelow(output / "meshes"), testing::Contains(HasSubstr("my_floor.ply")));
}

TEST_F(ReportPageTest, CutsTheFoamOpen) {
  Browser browser;
  Open(&browser, Report(Trained()));
  // Everything is on one side of a cut at the end of the foam, nothing behind one beyond it.
  browser.Evaluate("semfoam.viewer.renderer.keep = [0, 0, 1, 1000]");
  const Drawn nothing = Draw(&browser, 0);
  EXPECT_TRUE(std::all_of(
      nothing.colors.data.begin(), nothing.colors.data.end(), [](int c) { return c == 255; }));
  browser.Evaluate("semfoam.viewer.renderer.keep = [0, 0, 1, -1000]");
  const Drawn all = Draw(&browser, 0);
  browser.Evaluate("semfoam.viewer.renderer.keep = [0, 0, 0, -1]");
  EXPECT_EQ(all.colors.data, Draw(&browser, 0).colors.data);
}

TEST_F(ReportPageTest, ClickingChoosesTheObjectUnderThePointer) {
  Browser browser;
  Open(&browser, Report(Trained()));
  const json place = browser.Evaluate(
      "(() => { const b = document.getElementById('canvas').getBoundingClientRect();"
      "return [b.left + b.width / 2, b.top + b.height / 2, b.width / 2, b.height / 2]; })()");
  const json expected = browser.Evaluate("semfoam.viewer.pick(" + place[2].dump() + ", " +
                                         place[3].dump() + ").label");
  ASSERT_GE(expected, 0);
  browser.Click(place[0], place[1]);
  browser.WaitUntil("semfoam.viewer.chosen === " + expected.dump());
  browser.Move(place[0].get<double>() + 1, place[1]);
  browser.WaitUntil("!document.getElementById('hover').hidden");
  ExpectQuiet(browser);
}

TEST_F(ReportPageTest, StandsHostileNames) {
  Model model = ReadModel(Trained());
  const std::string hostile =
      "a\"'<b>&amp;</script><script>window.bad=1</script>\xF0\x9F\x8D\xB5`${1}";
  for (Label& label : model.labels) label.name = hostile + std::to_string(Value(label.id));
  Browser browser;
  Open(&browser, Report("hostile", model));
  EXPECT_EQ(browser.Evaluate("window.bad"), json());
  EXPECT_THAT(browser.Evaluate("document.querySelector('#objects .name').value").get<std::string>(),
              HasSubstr(hostile));
  EXPECT_EQ(browser.Evaluate("document.querySelectorAll('#objects tbody b').length"), 0);
  ExpectQuiet(browser);
}

TEST_F(ReportPageTest, ShowsFoamsOfEveryKind) {
  const Model trained = ReadModel(Trained());
  {
    const Model plain = WithoutSemantics(trained);
    Browser browser;
    Open(&browser, Report("plain", plain));
    ExpectSamePictures(plain, &browser);
    EXPECT_EQ(browser.Evaluate("document.getElementById('objects').hidden"), true);
    ExpectQuiet(browser);
  }
  for (const int degree : {0, 3}) {
    Model model = trained;
    Foam& foam = model.foam;
    const int before = foam.ShStride();
    foam.sh_degree = degree;
    LargePageVector<float> sh(foam.NumSites() * foam.ShStride(), 0.f);
    for (size_t i = 0; i < foam.NumSites(); ++i) {
      for (int k = 0; k < foam.ShStride(); ++k) {
        // Where there is nothing to take over, something that the picture shows.
        sh[i * foam.ShStride() + k] = k < before
                                          ? trained.foam.sh[i * before + k]
                                          : 0.05f * static_cast<float>(std::sin(k + 0.1 * i));
      }
    }
    foam.sh = std::move(sh);
    Browser browser;
    Open(&browser, Report(degree == 0 ? "degree 0" : "degree 3", model));
    ExpectSamePictures(model, &browser);
    ExpectQuiet(browser);
  }
  {
    Model one = trained;
    one.foam.num_classes = 1;
    one.foam.classifier_weight.resize(kIdentityDim);
    one.foam.classifier_bias.resize(1);
    one.labels.resize(1);
    Browser browser;
    Open(&browser, Report("one", one));
    ExpectSamePictures(one, &browser);
    EXPECT_EQ(browser.Evaluate("document.querySelectorAll('#objects tbody tr').length"), 1);
    ExpectQuiet(browser);
  }
  {
    // 300 classes: the trained ones again and again, less likely each time.
    Model many = trained;
    Foam& foam = many.foam;
    for (int k = foam.num_classes; k < 300; ++k) {
      const int of = k % trained.foam.num_classes;
      foam.classifier_weight.insert(
          foam.classifier_weight.end(),
          &trained.foam.classifier_weight[of * kIdentityDim],
          &trained.foam.classifier_weight[of * kIdentityDim] + kIdentityDim);
      foam.classifier_bias.push_back(trained.foam.classifier_bias[of] - 0.1f * k);
      many.labels.push_back({LabelId{1000 + k}, MaskId(1000 + k), ""});
    }
    foam.num_classes = 300;
    Browser browser;
    Open(&browser, Report("many", many));
    ExpectSamePictures(many, &browser);
    ExpectQuiet(browser);
  }
}

// The most cells that a page shows unless told otherwise.
TEST_F(ReportPageTest, LoadsHalfAMillionCells) {
  constexpr size_t kNumCells = 500'000;
  const Model model = WithoutSemantics(ReadModel(Trained()));
  const size_t before = model.foam.NumSites();
  std::vector<uint32_t> origin(kNumCells);
  for (size_t i = 0; i < kNumCells; ++i) origin[i] = static_cast<uint32_t>(i % before);
  Model large = WithSites(model, origin);
  std::mt19937 random(0);
  std::uniform_real_distribution<float> offset(-0.03f, 0.03f);
  for (size_t i = before; i < kNumCells; ++i) {
    large.foam.positions[i] += Eigen::Vector3f(offset(random), offset(random), offset(random));
  }
  Browser browser;
  const fs::path report = Report("large", large);
  EXPECT_THAT(ReadFile(report), HasSubstr("\"num_sites\":500000"));
  Open(&browser, report);
  ExpectSamePictures(large, {large.photos.size() / 2}, &browser);
  ExpectQuiet(browser);
}

TEST_F(ReportPageTest, SaysSoWithoutWebGl) {
  Browser browser({"--disable-3d-apis"});
  browser.Open(Report(Trained()), "window.semfoam && semfoam.ready");
  EXPECT_THAT(
      browser.Evaluate("document.getElementById('progress').textContent").get<std::string>(),
      HasSubstr("no WebGL2"));
  EXPECT_GT(browser.Evaluate("document.querySelectorAll('#objects tbody tr').length"), 2);
  EXPECT_EQ(browser.Evaluate("document.querySelectorAll('#views figure').length"), 2);
}

}  // namespace
}  // namespace semfoam
