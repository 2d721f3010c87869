// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

namespace semfoam {

// Marks a scope that may take much memory. If memory is used up (std::bad_alloc), the error names
// the innermost active task of the thread, and how it would take less. Both texts must outlive the
// task.
class MemoryTask {
 public:
  // `what_is_done` is a text such as "photos and masks are decoded", `advice` one such as "a
  // smaller num_threads".
  MemoryTask(const char* what_is_done, const char* advice);
  ~MemoryTask();
  MemoryTask(const MemoryTask&) = delete;
  MemoryTask& operator=(const MemoryTask&) = delete;

 private:
  const char* const outer_what_;
  const char* const outer_advice_;
  const int exceptions_at_begin_;
};

// Returns the sentence of the error. Must be called after std::bad_alloc has left all tasks of the
// thread.
std::string MemoryUsedUp();

}  // namespace semfoam
