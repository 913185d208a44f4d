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

/// The owner's side of watched paths: answers watch requests, and pushes to watchers, including
/// this process.
/// @par Thread safety  All functions are thread-safe.
class Pushing {
 public:
  /// @param max_groups  of watchers
  Pushing(Structure& structure, Transport& transport, MemberRunner& member, Watcher& watcher,
          std::size_t max_groups)
      : structure_(structure),
        transport_(transport),
        member_(member),
        watcher_(watcher),
        max_groups_(max_groups) {}

  /// Ends pushing; later watch requests are refused.
  void stop();

  /// The reply to a WatchRequest.
  [[nodiscard]] Reply answer(const Request& request);

  /// How many groups of watchers were rejected.
  [[nodiscard]] std::uint64_t refused();

  /// A watcher of the group has only now been matched.
  void on_watcher(std::uint64_t group);

 private:
  /// @return null while this participant leaves
  [[nodiscard]] Pusher* pusher();

  Structure& structure_;
  Transport& transport_;
  MemberRunner& member_;
  Watcher& watcher_;
  const std::size_t max_groups_;
  Mutex mutex_{LockRank::kParts};  // guards the following members
  bool stopped_ TFDUDE_GUARDED_BY(mutex_) = false;
  std::unique_ptr<Pusher> pusher_ TFDUDE_GUARDED_BY(mutex_);  // once there is a watcher
};

}  // namespace tfdude
