#pragma once

#include <condition_variable>
#include <mutex>
#include <utility>

// Annotations of what a lock guards, which clang checks (-Wthread-safety,
// https://clang.llvm.org/docs/ThreadSafetyAnalysis.html). The standard library's types have no
// annotations, so these classes wrap them.
#if defined(__clang__)
#define TFDUDE_LOCKS(attribute) __attribute__((attribute))  // NOLINT(*-macro-usage)
#else
#define TFDUDE_LOCKS(attribute)
#endif
/// Read and write only with that mutex held.
#define TFDUDE_GUARDED_BY(mutex) TFDUDE_LOCKS(guarded_by(mutex))  // NOLINT(*-macro-usage)
/// Call only with that mutex held.
#define TFDUDE_REQUIRES(mutex) TFDUDE_LOCKS(requires_capability(mutex))  // NOLINT(*-macro-usage)
/// Write the reason beside it.
#define TFDUDE_UNCHECKED_LOCKS TFDUDE_LOCKS(no_thread_safety_analysis)

namespace tfdude {

#ifdef NDEBUG
inline constexpr bool kCheckLockOrder = false;
#else
inline constexpr bool kCheckLockOrder = true;
#endif

/// The order of all locks: a thread that holds one waits only for locks of a later rank. So no two
/// threads can wait for each other. Builds without NDEBUG check it, as those with sanitizers.
enum class LockRank : unsigned char {
  kPlanning,    ///< of a stream: finding the owners
  kSending,     ///< of a stream
  kAnnouncing,  ///< what a transport has announced
  kChannels,    ///< a transport's readers and writers
  kEndpoints,   ///< creating and deleting them; then come the locks of Fast DDS
  kReceiving,   ///< one sample after the other; handlers are called with it
  kReporting,   ///< presences and losses, in order; handlers are called with it
  kStructure,   ///< Structure::mutex
  kJoints,      ///< the joints of an owner
  kParts,       ///< what a part of a participant runs: watches, groups
  kWatchedPath,
  kForest,  ///< the writer of a forest; its listeners are called with it
  kLeaf,    ///< any other lock: nothing is waited for with it
};

/// The ranks of the locks that the calling thread holds.
class HeldLocks {
 public:
  /// Ends the process, with a message, if a lock of this rank may not be waited for now.
  static void wait_for(LockRank rank);
  static void add(LockRank rank);
  static void remove(LockRank rank);
};

class TFDUDE_LOCKS(capability("mutex")) Mutex {
 public:
  explicit Mutex(LockRank rank = LockRank::kLeaf) : rank_(rank) {}

  void lock() TFDUDE_LOCKS(acquire_capability()) {
    if constexpr (kCheckLockOrder) HeldLocks::wait_for(rank_);
    mutex_.lock();
    if constexpr (kCheckLockOrder) HeldLocks::add(rank_);
  }
  bool try_lock() TFDUDE_LOCKS(try_acquire_capability(true)) {
    if (!mutex_.try_lock()) return false;
    if constexpr (kCheckLockOrder) HeldLocks::add(rank_);
    return true;
  }
  void unlock() TFDUDE_LOCKS(release_capability()) {
    if constexpr (kCheckLockOrder) HeldLocks::remove(rank_);
    mutex_.unlock();
  }

 private:
  friend class Condition;
  const LockRank rank_;
  std::mutex mutex_;
};

/// Holds a mutex; may release and take it again in between.
class TFDUDE_LOCKS(scoped_lockable) Lock {
 public:
  explicit Lock(Mutex& mutex) TFDUDE_LOCKS(acquire_capability(mutex)) : mutex_(mutex) {
    mutex_.lock();
  }
  /// For a mutex that is already held.
  Lock(Mutex& mutex, std::adopt_lock_t) TFDUDE_REQUIRES(mutex) : mutex_(mutex) {}
  ~Lock() TFDUDE_LOCKS(release_capability()) {
    if (held_) mutex_.unlock();
  }
  Lock(const Lock&) = delete;
  Lock& operator=(const Lock&) = delete;

  // Clang does not know that mutex_ is the mutex of the constructor.
  void lock() TFDUDE_LOCKS(acquire_capability()) TFDUDE_UNCHECKED_LOCKS {
    mutex_.lock();
    held_ = true;
  }
  void unlock() TFDUDE_LOCKS(release_capability()) TFDUDE_UNCHECKED_LOCKS {
    held_ = false;
    mutex_.unlock();
  }

 private:
  friend class Condition;
  Mutex& mutex_;
  bool held_ = true;
};

/// A std::condition_variable for a Lock. Predicates run with the lock held. They carry annotations
/// for the members that they read, since clang cannot follow the lock through here.
class Condition {
 public:
  void wait(Lock& lock) {
    Borrowed borrowed(lock);
    changed_.wait(borrowed.lock);
  }
  template <class Predicate>
  void wait(Lock& lock, Predicate holds) TFDUDE_UNCHECKED_LOCKS {
    Borrowed borrowed(lock);
    changed_.wait(borrowed.lock, std::move(holds));
  }
  template <class Time>
  void wait_until(Lock& lock, const Time& until) {
    Borrowed borrowed(lock);
    (void)changed_.wait_until(borrowed.lock, until);
  }
  template <class Time, class Predicate>
  bool wait_until(Lock& lock, const Time& until, Predicate holds) TFDUDE_UNCHECKED_LOCKS {
    Borrowed borrowed(lock);
    return changed_.wait_until(borrowed.lock, until, std::move(holds));
  }
  template <class Duration, class Predicate>
  bool wait_for(Lock& lock, const Duration& time, Predicate holds) TFDUDE_UNCHECKED_LOCKS {
    Borrowed borrowed(lock);
    return changed_.wait_for(borrowed.lock, time, std::move(holds));
  }
  void notify_one() { changed_.notify_one(); }
  void notify_all() { changed_.notify_all(); }

 private:
  // The lock for the time of a wait; still held afterwards.
  struct Borrowed {
    explicit Borrowed(Lock& held) : lock(held.mutex_.mutex_, std::adopt_lock) {}
    ~Borrowed() { (void)lock.release(); }
    Borrowed(const Borrowed&) = delete;
    Borrowed& operator=(const Borrowed&) = delete;
    std::unique_lock<std::mutex> lock;
  };

  std::condition_variable changed_;
};

}  // namespace tfdude
