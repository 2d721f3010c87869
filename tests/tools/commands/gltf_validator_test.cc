// SPDX-License-Identifier: GPL-3.0-or-later
//
// Khronos' own validator finds nothing wrong with our glTF, where it is installed.
#include "export/io/surface_export.h"

#include "tests/export/test_foams.h"
#include "tests/tools/program.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

constexpr int kNotInstalled = 77;

Outcome Validate(const std::vector<std::string>& files) {
  std::vector<std::string> arguments = {SEMFOAM_TEST_SOURCE "/tools/commands/validate_gltf.cjs"};
  arguments.insert(arguments.end(), files.begin(), files.end());
  return RunProgram("node", arguments);
}

TEST(GltfValidator, FindsNoErrors) {
  const TempFolder folder;
  std::vector<std::string> files;
  const auto export_to =
      [&](const std::string& name, Model model, const ExportTransformOptions& frame = {}) {
        ExportableSceneOptions options;
        options.transform = ParseExportTransform(frame);
        const ExportableScene scene = MakeExportableScene(model, options);
        for (const WrittenFile& file : ExportSurfaces(scene, folder / name)) {
          if (file.format == "glb") files.push_back((folder / name / file.path).string());
        }
      };
  Model named = TouchingBalls(1500);
  named.labels[0].name = "M\xC3\xBCtze \"blue\"\n\xFF";
  export_to("near", named);
  named.world_from_normalized = {50, {5e5, 4.5e6, 250}};
  ExportTransformOptions frame;
  frame.up_axis = UpAxis::kY;
  frame.units = LengthUnit::kMillimeter;
  export_to("far", named, frame);
  // Vertices that coincide, faces without area.
  export_to("cospherical", MakeModel(GridSites(8, 0.25f, 0, 0), 1, [](const Eigen::Vector3f& p) {
              return p.cwiseAbs().maxCoeff() < 0.5f ? 0 : kAir;
            }));
  ASSERT_EQ(files.size(), 3 + 3 + 2u);

  const Outcome outcome = Validate(files);
  if (outcome.exit_code == 127) GTEST_SKIP() << "node is not installed";
  if (outcome.exit_code == kNotInstalled) GTEST_SKIP() << outcome.out;
  EXPECT_EQ(outcome.exit_code, 0) << outcome.out << outcome.err;

  // The test can fail: a file whose box is wrong is found out.
  std::string bytes = ReadFile(files.front());
  const size_t at = bytes.find("\"max\":[");
  ASSERT_NE(at, std::string::npos);
  bytes[at + 7] = bytes[at + 7] == '9' ? '8' : '9';
  WriteFile(folder / "broken.glb", bytes);
  const Outcome broken = Validate({(folder / "broken.glb").string()});
  EXPECT_EQ(broken.exit_code, 1) << broken.out;
}

}  // namespace
}  // namespace semfoam
