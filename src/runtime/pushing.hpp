#pragma once

#include <memory>
#include <string>

#include "base/mutex.hpp"
#include "runtime/member_runner.hpp"
#include "runtime/pusher.hpp"
#include "runtime/structure.hpp"
#include "runtime/watcher.hpp"
#include "transport/port.hpp"

namespace tfdude {

/// The owner's side of watched paths: answers who wants to watch, and pushes to them, this process among them.
/// @par Thread safety  All functions.
class Pushing {
 public:
  Pushing(Structure& structure, Transport& transport, MemberRunner& member, Watcher& watcher)
      : structure_(structure), transport_(transport), member_(member), watcher_(watcher) {}

  /// Nothing is pushed any more, and who asks to watch is refused.
  void stop();

  /// The reply to a WatchRequest.
  [[nodiscard]] Reply answer(const Request& request);

  /// Somebody listens to the group only now.
  void on_watcher(std::uint64_t group);

 private:
  /// @return null where this participant is leaving
  [[nodiscard]] Pusher* pusher();

  Structure& structure_;
  Transport& transport_;
  MemberRunner& member_;
  Watcher& watcher_;
  Mutex mutex_;  // of the rest
  bool stopped_ TFDUDE_GUARDED_BY(mutex_) = false;
  std::unique_ptr<Pusher> pusher_ TFDUDE_GUARDED_BY(mutex_);  // once somebody watches
};

}  // namespace tfdude
