// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdlib>

#ifdef __GLIBC__
#include <malloc.h>
#endif

namespace selenite {

/// Hands freed memory back to the system. glibc keeps what a thread has freed for that thread, so the memory
/// of pictures that the threads of a render have made is of no use to others.
inline void return_unused_memory() {
#ifdef __GLIBC__
  malloc_trim(0);
#endif
}

}  // namespace selenite
