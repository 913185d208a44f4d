#include "tree/arena.hpp"

#include <functional>
#include <new>
#include <random>

namespace tfdude {
namespace {

std::uintptr_t random_number() {
  std::random_device device;
  const std::uint64_t high = device();
  return static_cast<std::uintptr_t>(high << 32U | device());
}

}  // namespace

// Before the objects of other files, which may contain forests.
[[gnu::init_priority(101)]] const Veil kVeil{random_number()};

Arena::Arena() : own_roots_(std::make_unique<SharedRoots>()), roots_(own_roots_.get()) {}

Arena::Arena(void* memory, std::size_t size)
    : roots_(new (memory) SharedRoots), memory_(static_cast<char*>(memory)), size_(size) {
  // NOLINTNEXTLINE(*-reinterpret-cast): readers subtract it
  roots_->base = reinterpret_cast<std::uint64_t>(memory);
  roots_->size = size;
  used_ = (sizeof(SharedRoots) + kLine - 1) / kLine * kLine;
}

void* Arena::allocate(std::size_t bytes, std::size_t align) {
  if (shared()) {
    const std::size_t lines = (bytes + kLine - 1) / kLine;
    if (Queue& same = released(lines); !same.empty()) {
      const Released oldest = same.pop();
      overwrite(oldest.commit);
      return oldest.block;
    }
    if (lines <= (size_ - used_) / kLine) {
      void* block = memory_ + used_;
      used_ += lines * kLine;
      return block;
    }
  }
  if (align <= alignof(std::max_align_t)) return ::operator new(bytes);
  return ::operator new(bytes, std::align_val_t(align));
}

void Arena::release(void* block, std::size_t bytes, std::size_t align) {
  const auto* at = static_cast<const char*>(block);
  const std::less<const char*> before;
  if (shared() && !before(at, memory_) && before(at, memory_ + size_)) {
    // A reader of the newest commit may have found it just before it was unlinked.
    released((bytes + kLine - 1) / kLine).push({block, committed() + 1});
  } else if (align <= alignof(std::max_align_t)) {
    ::operator delete(block);
  } else {
    ::operator delete(block, std::align_val_t(align));
  }
}

Arena::Released Arena::Queue::pop() {
  const Released oldest = all_[first_++];
  if (first_ == all_.size()) {
    all_.clear();
    first_ = 0;
  } else if (2 * first_ > all_.size()) {
    all_.erase(all_.begin(), all_.begin() + static_cast<std::ptrdiff_t>(first_));
    first_ = 0;
  }
  return oldest;
}

}  // namespace tfdude
