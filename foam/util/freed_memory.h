// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#if defined(__GLIBC__)
#include <malloc.h>
#endif

namespace semfoam {

// Returns memory that this process has freed to the system, as far as whole pages are free. The
// allocator of glibc keeps what many small blocks have left for the next ones, but larger arrays
// may not find room there. Takes some ms for 100 MB.
inline void ReturnFreedMemory() {
#if defined(__GLIBC__)
  malloc_trim(0);
#endif
}

}  // namespace semfoam
