// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/support/memory_task.h"

#include <new>

#include <gtest/gtest.h>

namespace semfoam {
namespace {

TEST(MemoryTask, TheInnermostTaskAtWorkIsNamed) {
  EXPECT_EQ(MemoryUsedUp(),
            "the memory is used up; smaller input or a smaller num_threads would be right.");
  const MemoryTask outer("views are rendered", "smaller photos");
  EXPECT_EQ(MemoryUsedUp(),
            "the memory is used up while views are rendered; smaller photos would be right.");
  { const MemoryTask done("meshes are made", "fewer objects"); }
  EXPECT_EQ(MemoryUsedUp(),
            "the memory is used up while views are rendered; smaller photos would be right.");
  try {
    const MemoryTask inner("volumes are made", "larger voxels");
    const MemoryTask inmost("volumes are written", "fewer volumes");
    throw std::bad_alloc();
  } catch (const std::bad_alloc&) {
    EXPECT_EQ(MemoryUsedUp(),
              "the memory is used up while volumes are written; fewer volumes would be right.");
  }
}

}  // namespace
}  // namespace semfoam
