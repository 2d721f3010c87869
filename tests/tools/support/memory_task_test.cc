// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/support/memory_task.h"

#include <new>

#include "tests/mistake.h"
#include <gtest/gtest.h>

namespace semfoam {
namespace {

TEST(MemoryTask, TheInnermostTaskAtWorkIsNamed) {
  EXPECT_THAT(MemoryUsedUp(), NamesMistake("", {"num_threads"}, "memory is used up"));
  const MemoryTask outer("views are rendered", "smaller photos");
  const auto of_views =
      NamesMistake("", {"views are rendered", "smaller photos"}, "memory is used up");
  EXPECT_THAT(MemoryUsedUp(), of_views);
  { const MemoryTask done("meshes are made", "fewer objects"); }
  EXPECT_THAT(MemoryUsedUp(), of_views);
  try {
    const MemoryTask inner("volumes are made", "larger voxels");
    const MemoryTask inmost("volumes are written", "fewer volumes");
    throw std::bad_alloc();
  } catch (const std::bad_alloc&) {
    EXPECT_THAT(MemoryUsedUp(),
                NamesMistake("", {"volumes are written", "fewer volumes"}, "memory is used up"));
  }
}

}  // namespace
}  // namespace semfoam
