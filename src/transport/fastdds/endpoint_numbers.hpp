#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>

#include "base/mutex.hpp"
#include "transport/fastdds/endpoint_sets.hpp"

namespace tfdude::fastdds {

/// Keeps the discovery of a participant's endpoints fast, however many it has created and deleted.
///
/// DDS numbers the announcements of endpoints, and a new participant requests those of the existing
/// ones, 256 numbers at a time (RTPS 2.2, 8.3.5.5). If none of the 256 is in use, Fast DDS says so,
/// and the new participant requests the next ones only after the next heartbeat, up to a second
/// later. So few numbers may be unused between those of the oldest and of the newest endpoint. If
/// there are more, the oldest is announced again, which gives it a new number.
/// @par Thread safety  All functions are thread-safe.
class EndpointNumbers {
 public:
  using Id = std::uint64_t;

  /// Of no endpoint.
  static constexpr Id kNone = 0;

  static constexpr std::uint64_t kMostUnused = 128;

  /// An endpoint was created, and thereby announced.
  /// @param announce  announces it again
  [[nodiscard]] Id created(std::function<void()> announce);

  /// An endpoint is going to be deleted, which is announced, too; nothing for kNone. Waits while it
  /// is being announced again: do not call this with a lock that a callback of Fast DDS takes.
  void deleted(Id endpoint);

  /// Announces the oldest endpoints again, until at most kMostUnused numbers are unused. Only one
  /// thread may call this. O(announced again * log endpoints).
  void tidy();

  /// The numbers between those of the oldest and of the newest endpoint that are not in use.
  [[nodiscard]] std::uint64_t unused() const;

 private:
  struct Endpoint {
    Id id = 0;
    std::function<void()> announce;
  };

  [[nodiscard]] std::uint64_t count_unused() const TFDUDE_REQUIRES(mutex_);

  mutable Mutex mutex_;
  Condition announced_;
  std::uint64_t next_ TFDUDE_GUARDED_BY(mutex_) = 1;
  Id last_id_ TFDUDE_GUARDED_BY(mutex_) = 0;
  Id announcing_ TFDUDE_GUARDED_BY(mutex_) = kNone;
  std::map<std::uint64_t, Endpoint> endpoints_ TFDUDE_GUARDED_BY(mutex_);  // by number
  std::map<Id, std::uint64_t> numbers_ TFDUDE_GUARDED_BY(mutex_);
};

/// The endpoints of a participant. DDS numbers writers and readers apart.
struct Announced {
  EndpointNumbers writers;
  EndpointNumbers readers;
  std::shared_ptr<EndpointSets> all = std::make_shared<EndpointSets>();
};

}  // namespace tfdude::fastdds
