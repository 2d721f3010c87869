// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/support/memory_task.h"

#include <exception>

namespace semfoam {
namespace {

struct Task {
  const char* what_is_done = nullptr;
  const char* advice = nullptr;
};

// The innermost active task of the thread, or the one that an exception has left.
thread_local Task current;

}  // namespace

MemoryTask::MemoryTask(const char* what_is_done, const char* advice)
    : outer_what_(current.what_is_done),
      outer_advice_(current.advice),
      exceptions_at_begin_(std::uncaught_exceptions()) {
  current = {what_is_done, advice};
}

MemoryTask::~MemoryTask() {
  if (std::uncaught_exceptions() == exceptions_at_begin_) current = {outer_what_, outer_advice_};
}

std::string MemoryUsedUp() {
  if (current.what_is_done == nullptr) {
    return "the memory is used up; smaller input or a smaller num_threads would be right.";
  }
  return std::string("the memory is used up while ") + current.what_is_done + "; " +
         current.advice + " would be right.";
}

}  // namespace semfoam
