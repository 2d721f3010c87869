// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/train/trainer.h"

#include <cstdint>
#include <string>

namespace semfoam {

// What a training holds in memory when it holds the most: with all its sites, while they are
// triangulated anew. In bytes, rounded up where the scene decides; the sizes behind it were
// measured on runs of up to a million sites (foam/README.md).
struct MemoryPlan {
  int64_t sites = 0;          // at the most
  int64_t parameters = 0;     // of all cells, with Adam's two moments
  int64_t planes = 0;         // of all faces, for the walk
  int64_t triangulation = 0;  // CGAL's and ours, and what hangs on the topology
  int64_t batch = 0;          // rays of an iteration and the records of their gradients
  int64_t photos = 0;         // and masks, or what is kept of them
  int64_t program = 0;        // the rest of the process

  int64_t OfSites() const { return parameters + planes + triangulation; }
  int64_t Total() const;

  // "up to 100000 sites of 2300 bytes (0.23 GB), ..., 0.35 GB in all".
  std::string Report() const;
};

// How many classes a run with masks is taken to have before their ids are known; few have more.
inline constexpr int kUsualClasses = 256;

// `num_classes`: 0 without masks. `num_seeds`: SfM points to start from. `photo_bytes`: what photos
// and masks take. Options must have passed their Check.
MemoryPlan PlanMemory(const TrainingOptions& options,
                      int num_classes,
                      int64_t num_seeds,
                      int64_t photo_bytes);

// What a run keeps of photos and masks that do not fit into memory (foam/data/pixel_cache.h), at
// the most: the pixels that it draws, and those that it looks at again and again.
int64_t DrawnPixelBytes(const TrainingOptions& options);

// Throws UserError with one sentence that says how much is needed, how much there is, and what
// would fit, when the plan for these arguments exceeds `available` bytes. To be called before
// anything is loaded or written.
void RequireMemory(const TrainingOptions& options,
                   int num_classes,
                   int64_t num_seeds,
                   int64_t photo_bytes,
                   int64_t available);

// "2.31 GB", "34 MB".
std::string FormatBytes(int64_t bytes);

}  // namespace semfoam
