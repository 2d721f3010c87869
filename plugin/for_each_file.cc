// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/for_each_file.h"

#include "foam/error.h"
#include "foam/parallel.h"

#include <exception>
#include <vector>

namespace semfoam {

void ForEachFile(int64_t count, const std::function<void(int64_t index)>& body) {
  std::vector<std::exception_ptr> errors(count);
  ParallelForBlocks(count, 1, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) {
      try {
        body(i);
      } catch (const UserError&) {
        errors[i] = std::current_exception();
      }
    }
  });
  for (const std::exception_ptr& error : errors) {
    if (error) std::rethrow_exception(error);
  }
}

}  // namespace semfoam
