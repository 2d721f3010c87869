// SPDX-License-Identifier: GPL-3.0-or-later
// Prints how near the textured and the vertex-coloured meshes of an export are to the held-out
// photos:
//
//   texture_score SCENE.foam IMAGES EXPORT [MASKS]
//
// MASKS holds the exact masks, <name>/<photo>.png, as segmentation_labels/masks of the test data;
// without, all pixels that a mesh covers count.
#include "tests/tools/commands/texture_score.h"

#include <algorithm>
#include <cstdio>

int main(int argc, char** argv) {
  using namespace semfoam;
  namespace fs = std::filesystem;
  if (argc < 4) {
    std::fprintf(stderr, "texture_score SCENE.foam IMAGES EXPORT [MASKS]\n");
    return 1;
  }
  const Model model = ReadModel(argv[1]);
  const std::vector<PhotoLight> lights =
      ReadLights(fs::path(argv[1]).parent_path() / "effects.json", model.photos).lights;
  std::vector<fs::path> files;
  for (const fs::path& folder : {fs::path(argv[3]), fs::path(argv[3]) / "objects"}) {
    if (!fs::is_directory(folder)) continue;
    for (const auto& entry : fs::directory_iterator(folder)) {
      if (entry.path().extension() == ".obj") files.push_back(entry.path());
    }
  }
  std::sort(files.begin(), files.end());
  std::printf("%-20s %10s %8s %8s %8s\n", "object", "pixels", "vertices", "texture", "gain");
  double sum = 0;
  int count = 0;
  for (const fs::path& file : files) {
    const std::string stem = file.stem().string();
    const std::string name = stem.substr(stem.find('_') + 1);
    fs::path masks;
    if (argc > 4) {
      masks = fs::path(argv[4]) / name;
      if (!fs::is_directory(masks)) continue;
    }
    const TextureScore score = ScoreTexture(ReadTexturedObj(file), model, argv[2], masks, lights);
    if (score.pixels == 0) continue;
    const double gain = score.TexturePsnr() - score.VertexPsnr();
    std::printf("%-20s %10lld %8.2f %8.2f %+8.2f\n",
                name.c_str(),
                static_cast<long long>(score.pixels),
                score.VertexPsnr(),
                score.TexturePsnr(),
                gain);
    sum += gain;
    ++count;
  }
  if (count > 0) std::printf("%-20s %10s %8s %8s %+8.2f\n", "mean", "", "", "", sum / count);
  return 0;
}
