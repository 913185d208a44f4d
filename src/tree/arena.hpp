#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <new>
#include <type_traits>
#include <unordered_map>
#include <utility>
#include <vector>

namespace tfdude {

/// Where readers of a forest begin. In memory that other processes map, it is at its beginning.
struct SharedRoots {
  static constexpr std::uint64_t kMagic = 0x31474553'44465400;  // "TFD", "SEG1"
  static constexpr std::size_t kMostHeads = 22;

  std::uint64_t magic = kMagic;
  std::uint64_t layout = 0;  ///< layout_hash() of the owner
  std::uint64_t base = 0;    ///< the owner's address of this object
  std::uint64_t size = 0;    ///< of the memory
  /// The number of the newest commit.
  alignas(64) std::atomic<std::uint64_t> committed{0};
  /// What commits up to this one have superseded may be overwritten; see Arena.
  alignas(64) std::atomic<std::uint64_t> horizon{0};
  alignas(64) std::array<std::atomic<void*>, kMostHeads> heads{};  ///< see SlotArray
  std::atomic<void*> names{nullptr};                               ///< see IdTable
};

/// The memory of all that readers of a forest follow: of the heap, or given by the caller, who may
/// let other processes map it for reading. Pointers in it are addresses of the owner.
///
/// Readers in other processes write nothing, so an owner does not know them and never waits. Such a
/// reader takes the number C of the newest commit, reads what is visible at C, and then loads the
/// horizon. All that it may have read was superseded by later commits, if at all. Before the owner
/// overwrites what commits up to h have superseded, it stores h as the horizon, and then issues a
/// release fence. So a horizon of at most C says that nothing was overwritten that the reader has
/// read; it issues an acquire fence before it loads the horizon. The algorithm is that of a seqlock
/// whose writer need not know what is read (H.-J. Boehm, "Can seqlocks get along with programming
/// language memory models?", MSPC 2012, figure 6), but one number is for all objects.
///
/// @par Thread safety  One writer at a time.
class Arena {
 public:
  /// Of the heap.
  Arena();
  /// @param memory  of zeros, aligned to 64, which outlives the arena. What does not fit is taken
  ///   from the heap: readers in other processes recognize that by its address.
  Arena(void* memory, std::size_t size);
  Arena(const Arena&) = delete;
  Arena& operator=(const Arena&) = delete;
  ~Arena() = default;

  [[nodiscard]] SharedRoots& roots() { return *roots_; }
  /// Whether other processes may read.
  [[nodiscard]] bool shared() const { return size_ > 0; }
  /// Bytes of the given memory that were ever allocated.
  [[nodiscard]] std::size_t used() const { return used_; }

  /// A block that was released is used again if no reader here can see it any more (epoch.hpp), as
  /// the caller must have checked, and after the horizon tells the others.
  /// @param align  at most 64
  [[nodiscard]] void* allocate(std::size_t bytes, std::size_t align = alignof(std::max_align_t));
  /// As it was allocated.
  void release(void* block, std::size_t bytes, std::size_t align = alignof(std::max_align_t));

  /// Call before anything is overwritten that commits up to this one have superseded.
  void overwrite(std::uint64_t superseded_by) {
    if (!shared() || roots_->horizon.load(std::memory_order_relaxed) >= superseded_by) return;
    roots_->horizon.store(superseded_by, std::memory_order_relaxed);
    std::atomic_thread_fence(std::memory_order_release);
  }
  [[nodiscard]] std::uint64_t committed() const {
    return roots_->committed.load(std::memory_order_relaxed);
  }

 private:
  struct Released {
    void* block;
    std::uint64_t commit;  // readers of it may still have found the block
  };
  // Those of one size; the oldest first.
  class Queue {
   public:
    [[nodiscard]] bool empty() const { return first_ == all_.size(); }
    void push(const Released& one) { all_.push_back(one); }
    [[nodiscard]] Released pop();

   private:
    std::vector<Released> all_;
    std::size_t first_ = 0;
  };
  static constexpr std::size_t kLine = 64;
  static constexpr std::size_t kSmall = 64;  // lines

  [[nodiscard]] Queue& released(std::size_t lines) {
    return lines < kSmall ? small_[lines] : large_[lines];
  }

  std::unique_ptr<SharedRoots> own_roots_;  // null: they are in the given memory
  SharedRoots* roots_ = nullptr;
  char* memory_ = nullptr;
  std::size_t size_ = 0;
  std::size_t used_ = 0;
  std::array<Queue, kSmall> small_;
  std::unordered_map<std::size_t, Queue> large_;  // by lines
};

/// Gives an object back to its arena, which it knows.
struct LeaveArena {
  template <class T>
  void operator()(const T* object) const {
    Arena& arena = object->arena();
    object->~T();
    arena.release(const_cast<T*>(object), sizeof(T), alignof(T));  // NOLINT(*-const-cast): it ends
  }
};
/// An object in an arena, which readers may follow. It has a function arena().
template <class T>
using InArena = std::unique_ptr<T, LeaveArena>;

template <class T, class... Args>
[[nodiscard]] InArena<T> make_in(Arena& arena, Args&&... args) {
  void* block = arena.allocate(sizeof(T), alignof(T));
  return InArena<T>(new (block) T(arena, std::forward<Args>(args)...));
}

/// A pointer to memory of this process alone, in memory that others can read. They learn whether it
/// is null, and nothing about addresses.
template <class T>
class Veiled {
 public:
  Veiled() = default;
  Veiled(T* object) : bits_(veiled(object)) {}  // NOLINT(google-explicit-constructor): it is one

  [[nodiscard]] bool empty() const { return bits_ == 0; }
  [[nodiscard]] T* get() const { return veiled_pointer(bits_); }
  operator T*() const { return get(); }  // NOLINT(google-explicit-constructor): it is one
  T* operator->() const { return get(); }
  T& operator*() const { return *get(); }

  [[nodiscard]] static std::uintptr_t veiled(const T* object);
  [[nodiscard]] static T* veiled_pointer(std::uintptr_t bits);

 private:
  std::uintptr_t bits_ = 0;
};

/// A random number of this process.
struct Veil {
  std::uintptr_t bits;
};
extern const Veil kVeil;

template <class T>
std::uintptr_t Veiled<T>::veiled(const T* object) {
  // NOLINTNEXTLINE(*-reinterpret-cast): it is not followed as long as it is a number
  return object == nullptr ? 0 : reinterpret_cast<std::uintptr_t>(object) ^ kVeil.bits;
}
template <class T>
T* Veiled<T>::veiled_pointer(std::uintptr_t bits) {
  // NOLINTNEXTLINE(*-reinterpret-cast,performance-no-int-to-ptr): see veiled()
  return bits == 0 ? nullptr : reinterpret_cast<T*>(bits ^ kVeil.bits);
}

/// As std::unique_ptr, veiled.
template <class T>
class VeiledOwner {
 public:
  VeiledOwner() = default;
  ~VeiledOwner() { delete get(); }
  VeiledOwner(const VeiledOwner&) = delete;
  VeiledOwner& operator=(const VeiledOwner&) = delete;

  [[nodiscard]] T* get() const { return object_.get(); }
  void reset(T* object) {
    delete get();
    object_ = object;
  }

 private:
  Veiled<T> object_;
};

}  // namespace tfdude
