// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/colmap/colmap_model.h"

#include <filesystem>
#include <optional>
#include <string_view>

#include "tests/fuzz/fuzz_input.h"

namespace semfoam {

// A COLMAP model in memory: the parts of an input are cameras, images, points3D and, where there
// are so many, rigs and frames.
class ModelInput {
 public:
  explicit ModelInput(ModelFormat format);
  ~ModelInput();
  ModelInput(const ModelInput&) = delete;
  ModelInput& operator=(const ModelInput&) = delete;

  // The model where the reader takes it; what training asks of such a model has then been computed,
  // too.
  std::optional<Reconstruction> Read(std::string_view input) const;

 private:
  std::filesystem::path folder_;
  MemoryFile files_[5];
};

}  // namespace semfoam
