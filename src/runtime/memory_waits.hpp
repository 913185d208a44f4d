#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <thread>

#include "base/loop.hpp"
#include "base/mutex.hpp"
#include "memory/port.hpp"
#include "partition/directory.hpp"
#include "tree/remote_forest.hpp"

namespace tfdude {

/// Waits for commits of owners in their memory, on a thread of its own, without messages. The
/// thread begins with the first owner.
/// @par Thread safety  All functions are thread-safe.
class MemoryWaits {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr Clock::time_point kNever = Clock::time_point::max();
  /// That can be waited for.
  static constexpr std::size_t kMostOwners = 127;

  /// @param on_commits  called by the thread, soon after any of them has committed. @return when to
  ///   call it again, unless there are commits before
  explicit MemoryWaits(Loop::Job::Run on_commits) : on_commits_(std::move(on_commits)) {}
  ~MemoryWaits() { stop(); }
  MemoryWaits(const MemoryWaits&) = delete;
  MemoryWaits& operator=(const MemoryWaits&) = delete;

  /// After it has returned, nothing is called.
  void stop();

  /// Waits for these owners, and for no others. Those whose memory is another one now replace the
  /// earlier ones.
  struct Waited {
    std::shared_ptr<const RemoteForest> forest;
    MappedMemory memory;
  };
  using Owners = std::map<Owner, Waited>;
  void wait_for(Owners owners);

 private:
  void run();
  void begin() TFDUDE_REQUIRES(mutex_);
  void note_change() TFDUDE_REQUIRES(mutex_);

  const Loop::Job::Run on_commits_;
  std::atomic<std::uint64_t> changes_{0};  // of what is waited for
  Mutex mutex_{LockRank::kParts};
  std::shared_ptr<const Owners> owners_ TFDUDE_GUARDED_BY(mutex_) =
      std::make_shared<const Owners>();
  bool stopping_ TFDUDE_GUARDED_BY(mutex_) = false;
  std::thread thread_ TFDUDE_GUARDED_BY(mutex_);
};

}  // namespace tfdude
