// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

namespace semfoam {

// While one lives, the program does something that may take much memory. Where that is used up
// (std::bad_alloc), the error names the innermost task that was at work, and what of it would take
// less. For the main thread; both texts must outlive the task.
class MemoryTask {
 public:
  // "photos and masks are decoded", "a smaller num_threads".
  MemoryTask(const char* what_is_done, const char* advice);
  ~MemoryTask();
  MemoryTask(const MemoryTask&) = delete;
  MemoryTask& operator=(const MemoryTask&) = delete;

 private:
  const char* const outer_what_;
  const char* const outer_advice_;
  const int exceptions_at_begin_;
};

// One sentence, to be asked for where std::bad_alloc has left all tasks.
std::string MemoryUsedUp();

}  // namespace semfoam
