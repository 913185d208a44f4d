#pragma once

#include <condition_variable>
#include <mutex>
#include <utility>

// Annotations of what a lock guards, which clang checks (-Wthread-safety,
// https://clang.llvm.org/docs/ThreadSafetyAnalysis.html). The standard library's types have no
// annotations, so these classes wrap them.
#if defined(__clang__)
#define TFDUDE_LOCKS(attribute) __attribute__((attribute))
#else
#define TFDUDE_LOCKS(attribute)
#endif
/// Read and write only with that mutex held.
#define TFDUDE_GUARDED_BY(mutex) TFDUDE_LOCKS(guarded_by(mutex))
/// Call only with that mutex held.
#define TFDUDE_REQUIRES(mutex) TFDUDE_LOCKS(requires_capability(mutex))
/// Write the reason beside it.
#define TFDUDE_UNCHECKED_LOCKS TFDUDE_LOCKS(no_thread_safety_analysis)

namespace tfdude {

class TFDUDE_LOCKS(capability("mutex")) Mutex {
 public:
  void lock() TFDUDE_LOCKS(acquire_capability()) { mutex_.lock(); }
  bool try_lock() TFDUDE_LOCKS(try_acquire_capability(true)) { return mutex_.try_lock(); }
  void unlock() TFDUDE_LOCKS(release_capability()) { mutex_.unlock(); }

 private:
  friend class Lock;
  std::mutex mutex_;
};

/// Holds a mutex; may release and take it again in between.
class TFDUDE_LOCKS(scoped_lockable) Lock {
 public:
  explicit Lock(Mutex& mutex) TFDUDE_LOCKS(acquire_capability(mutex)) : lock_(mutex.mutex_) {}
  /// For a mutex that is already held.
  Lock(Mutex& mutex, std::adopt_lock_t adopt) TFDUDE_REQUIRES(mutex) : lock_(mutex.mutex_, adopt) {}
  ~Lock() TFDUDE_LOCKS(release_capability()) {}  // NOLINT(modernize-use-equals-default): annotated
  Lock(const Lock&) = delete;
  Lock& operator=(const Lock&) = delete;

  void lock() TFDUDE_LOCKS(acquire_capability()) { lock_.lock(); }
  void unlock() TFDUDE_LOCKS(release_capability()) { lock_.unlock(); }

 private:
  friend class Condition;
  std::unique_lock<std::mutex> lock_;
};

/// A std::condition_variable for a Lock. Predicates run with the lock held. They carry annotations
/// for the members that they read, since clang cannot follow the lock through here.
class Condition {
 public:
  void wait(Lock& lock) { changed_.wait(lock.lock_); }
  template <class Predicate>
  void wait(Lock& lock, Predicate holds) TFDUDE_UNCHECKED_LOCKS {
    changed_.wait(lock.lock_, std::move(holds));
  }
  template <class Time>
  void wait_until(Lock& lock, const Time& until) {
    (void)changed_.wait_until(lock.lock_, until);
  }
  template <class Time, class Predicate>
  bool wait_until(Lock& lock, const Time& until, Predicate holds) TFDUDE_UNCHECKED_LOCKS {
    return changed_.wait_until(lock.lock_, until, std::move(holds));
  }
  template <class Duration, class Predicate>
  bool wait_for(Lock& lock, const Duration& time, Predicate holds) TFDUDE_UNCHECKED_LOCKS {
    return changed_.wait_for(lock.lock_, time, std::move(holds));
  }
  void notify_one() { changed_.notify_one(); }
  void notify_all() { changed_.notify_all(); }

 private:
  std::condition_variable changed_;
};

}  // namespace tfdude
