// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/train/trainer.h"

#include <cstdint>
#include <string>

namespace semfoam {

// The peak memory of a training, which occurs with all its sites, during a triangulation. In bytes,
// rounded up where it depends on the scene; the sizes per site were measured on runs of up to a
// million sites (foam/README.md).
struct MemoryPlan {
  // Maximum number of sites.
  int64_t sites = 0;
  // Parameters of all cells, with Adam's two moments.
  int64_t parameters = 0;
  // Planes of all faces, for the walk.
  int64_t planes = 0;
  // CGAL's triangulation, our copy of it, and arrays derived from it.
  int64_t triangulation = 0;
  // Rays of an iteration and the records of their gradients.
  int64_t batch = 0;
  // Photos and masks, or their kept pixels.
  int64_t photos = 0;
  // The rest of the process.
  int64_t program = 0;

  int64_t OfSites() const { return parameters + planes + triangulation; }
  int64_t Total() const;

  // Returns "up to 100000 sites of 2300 bytes (0.23 GB), ..., 0.35 GB in all".
  std::string Report() const;
};

// Number of classes assumed for a run with masks before their ids are known; few runs have more.
inline constexpr int kUsualClasses = 256;

// Plans the memory of a training. `num_classes` is 0 without masks; `num_seeds` is the number of
// SfM points to start from (sites at points of a dense cloud are never more than the final ones);
// `photo_bytes` is the memory of photos and masks. `options` must have passed their Check.
MemoryPlan PlanMemory(const TrainingOptions& options,
                      int num_classes,
                      int64_t num_seeds,
                      int64_t photo_bytes);

// Returns the memory that one of `num_ranks` processes takes besides this for what they exchange
// (foam/render/block_exchange.h), in bytes; 0 for one.
int64_t ExchangeBytes(const TrainingOptions& options, int num_classes, int num_ranks);

// Returns the maximum memory for the pixels that a run keeps of photos and masks that do not fit
// into memory (foam/data/pixel_cache.h): those that it draws, and those that it reads throughout
// the run.
int64_t DrawnPixelBytes(const TrainingOptions& options);

// Throws UserError when the plan for these arguments exceeds `available` bytes: one sentence with
// the memory that is needed, the memory that is available, and what would fit. Must be called
// before anything is loaded or written.
void RequireMemory(const TrainingOptions& options,
                   int num_classes,
                   int64_t num_seeds,
                   int64_t photo_bytes,
                   int64_t available);

// Returns a text such as "2.31 GB" or "34 MB".
std::string FormatBytes(int64_t bytes);

}  // namespace semfoam
