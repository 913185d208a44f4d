#include "support/allocation_guard.hpp"

#include <malloc.h>

#include <cstdlib>
#include <new>

namespace {

// Plain numbers: they are there before and after all other objects of the thread.
thread_local std::uint64_t allocations = 0;
thread_local std::int64_t live_bytes = 0;

void* counted(void* memory) {
  if (memory == nullptr) throw std::bad_alloc();
  ++allocations;
  live_bytes += static_cast<std::int64_t>(malloc_usable_size(memory));
  return memory;
}

void release(void* memory) {
  if (memory == nullptr) return;
  live_bytes -= static_cast<std::int64_t>(malloc_usable_size(memory));
  std::free(memory);
}

}  // namespace

// The other forms (arrays, sized, nothrow) call these by default.
void* operator new(std::size_t size) { return counted(std::malloc(size == 0 ? 1 : size)); }
void* operator new(std::size_t size, std::align_val_t alignment) {
  const auto align = static_cast<std::size_t>(alignment);
  return counted(std::aligned_alloc(align, (size + align - 1) / align * align));
}
void operator delete(void* memory) noexcept { release(memory); }
void operator delete(void* memory, std::size_t) noexcept { release(memory); }
void operator delete(void* memory, std::align_val_t) noexcept { release(memory); }
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { release(memory); }

namespace tfdude::testing {

AllocationGuard::AllocationGuard()
    : allocations_at_start_(::allocations), live_bytes_at_start_(::live_bytes) {}

std::uint64_t AllocationGuard::allocations() const { return ::allocations - allocations_at_start_; }

std::int64_t AllocationGuard::live_bytes() const { return ::live_bytes - live_bytes_at_start_; }

}  // namespace tfdude::testing
