// SPDX-License-Identifier: GPL-3.0-or-later
//
// segment_scene WORKSPACE OUTPUT: trains a foam on a COLMAP workspace with masks and writes every
// object as volume and surface: the bytes of
//   semfoam automatic_segmenter --workspace_path WORKSPACE --output_path OUTPUT --quality low
//     --test_every 8 --FoamTraining.num_rays 300000
#include "foam/util/error.h"
#include "foam/util/interruption.h"
#include "tools/controllers/scene_segmenter.h"

#include <iostream>

int main(int argc, char** argv) try {
  if (argc != 3) throw semfoam::UserError("segment_scene WORKSPACE OUTPUT");
  semfoam::HandleInterruptions();  // Ctrl-C leaves a checkpoint
  semfoam::SceneSegmenterOptions options;
  semfoam::CompleteFromWorkspace(argv[1], &options.run);
  options.output_path = argv[2];
  options.run.scene.test_every = 8;
  options.run.quality = semfoam::Quality::kLow;
  options.run.training = semfoam::OptionsForQuality(options.run.quality);
  options.run.training.num_rays = 300'000;  // a quick look; low has 20 million
  semfoam::SegmentScene(options);
  return 0;
} catch (const semfoam::Interruption& interruption) {
  return interruption.ExitCode();
} catch (const semfoam::UserError& error) {
  std::cerr << "ERROR: " << error.what() << "\n";
  return 1;
}
