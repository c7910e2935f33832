// SPDX-License-Identifier: GPL-3.0-or-later
//
// Operators new and delete of a module for macOS. Those of the C++ library that it is linked with would be seen from
// outside, where the system takes the first that it finds for all: memory of one would come back to another.

#include <cstddef>
#include <cstdlib>
#include <new>

namespace {

void* taken(std::size_t size, std::size_t alignment = alignof(std::max_align_t)) {
  for (;;) {
    void* place = nullptr;
    if (alignment <= alignof(std::max_align_t)) {
      place = std::malloc(size ? size : 1);
    } else if (posix_memalign(&place, alignment, size ? size : 1)) {
      place = nullptr;
    }
    if (place) return place;
    const std::new_handler handler = std::get_new_handler();
    if (!handler) throw std::bad_alloc();
    handler();
  }
}

void* taken_or_null(std::size_t size, std::size_t alignment = alignof(std::max_align_t)) noexcept {
  try {
    return taken(size, alignment);
  } catch (...) {
    return nullptr;
  }
}

std::size_t number(std::align_val_t alignment) { return static_cast<std::size_t>(alignment); }

}  // namespace

void* operator new(std::size_t size) { return taken(size); }
void* operator new[](std::size_t size) { return taken(size); }
void* operator new(std::size_t size, std::align_val_t at) { return taken(size, number(at)); }
void* operator new[](std::size_t size, std::align_val_t at) { return taken(size, number(at)); }

void* operator new(std::size_t size, const std::nothrow_t&) noexcept { return taken_or_null(size); }
void* operator new[](std::size_t size, const std::nothrow_t&) noexcept {
  return taken_or_null(size);
}
void* operator new(std::size_t size, std::align_val_t at, const std::nothrow_t&) noexcept {
  return taken_or_null(size, number(at));
}
void* operator new[](std::size_t size, std::align_val_t at, const std::nothrow_t&) noexcept {
  return taken_or_null(size, number(at));
}

void operator delete(void* place) noexcept { std::free(place); }
void operator delete[](void* place) noexcept { std::free(place); }
void operator delete(void* place, std::size_t) noexcept { std::free(place); }
void operator delete[](void* place, std::size_t) noexcept { std::free(place); }
void operator delete(void* place, std::align_val_t) noexcept { std::free(place); }
void operator delete[](void* place, std::align_val_t) noexcept { std::free(place); }
void operator delete(void* place, std::size_t, std::align_val_t) noexcept { std::free(place); }
void operator delete[](void* place, std::size_t, std::align_val_t) noexcept { std::free(place); }
void operator delete(void* place, const std::nothrow_t&) noexcept { std::free(place); }
void operator delete[](void* place, const std::nothrow_t&) noexcept { std::free(place); }
void operator delete(void* place, std::align_val_t, const std::nothrow_t&) noexcept {
  std::free(place);
}
void operator delete[](void* place, std::align_val_t, const std::nothrow_t&) noexcept {
  std::free(place);
}
