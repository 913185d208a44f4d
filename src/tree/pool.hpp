#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <new>
#include <vector>

#include "tree/arena.hpp"

namespace tfdude {

/// Fetches the cache lines of an object that is written soon, for this processor alone.
template <class T>
void prefetch_for_writing(const T* object) {
  constexpr std::size_t kLine = 64;
  for (std::size_t at = 0; at < sizeof(T); at += kLine) {
    // NOLINTNEXTLINE(cppcoreguidelines-pro-type-reinterpret-cast): only its address
    const char* line = reinterpret_cast<const char*>(object) + at;
#ifdef __x86_64__
    // The builtin function means another instruction, which fetches them for reading, unless the
    // compiler may assume PREFETCHW.
    asm volatile("prefetchw %0" : : "m"(*line));
#else
    __builtin_prefetch(line, 1);
#endif
  }
}

/// Objects of one type, reused when no reader can see them any more (epoch.hpp). One writer at a
/// time.
template <class T>
class Pool {
 public:
  explicit Pool(Arena& arena) : arena_(arena) {}
  ~Pool() {
    for (T* block : blocks_) {
      for (std::size_t i = 0; i < kBlock; ++i) block[i].~T();
      arena_.release(block, kBlock * sizeof(T), alignof(T));
    }
  }
  Pool(const Pool&) = delete;
  Pool& operator=(const Pool&) = delete;

  [[nodiscard]] T* take() {
    if (free_.empty()) grow();
    T* taken = free_.back();
    free_.pop_back();
    return taken;
  }

  /// Fetches the memory of the object that the call after the next `ahead` ones of take() returns.
  /// Readers have it in the caches of other processors.
  void prefetch(std::size_t ahead) const {
    if (free_.size() > ahead) prefetch_for_writing(free_[free_.size() - 1 - ahead]);
  }

  /// Those that readers may see: those of the current commit are the last ones.
  [[nodiscard]] const std::vector<T*>& superseded() const { return superseded_; }

  /// Takes an object back that the current commit has superseded, or an earlier one.
  void supersede(T* object) { superseded_.push_back(object); }

  /// Call only between two commits. @param tag  from epoch::retire_tag()
  void collect(std::uint64_t tag, std::uint64_t safe_below) {
    if (retired_.empty() || retired_.back().end < superseded_.size()) {
      retired_.push_back({tag, superseded_.size(), arena_.committed()});
    }
    const std::size_t kept = arena_.shared() ? kKept : 0;
    const auto seen = std::find_if(retired_.begin(), retired_.end(), [&](const Retired& some) {
      return some.tag >= safe_below || superseded_.size() - some.end < kept;
    });
    if (seen == retired_.begin()) return;
    const std::size_t unseen = std::prev(seen)->end;
    arena_.overwrite(std::prev(seen)->commit);
    const auto end = superseded_.begin() + static_cast<std::ptrdiff_t>(unseen);
    free_.insert(free_.end(), superseded_.begin(), end);
    superseded_.erase(superseded_.begin(), end);
    retired_.erase(retired_.begin(), seen);
    for (Retired& some : retired_) some.end -= unseen;
  }

 private:
  // The superseded objects before this one have this tag, or an earlier one, and were superseded by
  // commits up to this one. Tags do not decrease.
  struct Retired {
    std::uint64_t tag;
    std::size_t end;
    std::uint64_t commit;
  };
  static constexpr std::size_t kBlock = 16;
  // How many of the objects that were superseded last are not reused yet, so that a reader in
  // another process has the time in which so many are written.
  static constexpr std::size_t kKept = 128;

  void grow() {
    T* block = static_cast<T*>(arena_.allocate(kBlock * sizeof(T), alignof(T)));
    blocks_.push_back(block);
    free_.reserve(blocks_.capacity() * kBlock);
    for (std::size_t i = 0; i < kBlock; ++i) free_.push_back(new (block + i) T());
  }

  Arena& arena_;
  std::vector<T*> blocks_;
  std::vector<T*> free_;
  std::vector<T*> superseded_;
  std::vector<Retired> retired_;
};

}  // namespace tfdude
