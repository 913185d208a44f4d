#pragma once

#include <algorithm>
#include <chrono>
#include <map>
#include <string>

#include "base/mutex.hpp"
#include "transport/fastdds/compat.hpp"

namespace tfdude::fastdds {

/// Which owners' replies reach this participant: DDS drops those of a writer that it has not
/// matched yet. An owner creates that writer when it discovers who may ask it.
/// @par Thread safety  All functions are thread-safe.
class ReplyPaths {
 public:
  using Deadline = std::chrono::steady_clock::time_point;

  /// The writer of an owner's replies was matched.
  void opened(const ertps::GUID_t& writer, const std::string& owner) {
    {
      const Lock lock(mutex_);
      owners_.insert_or_assign(writer, owner);
    }
    changed_.notify_all();
  }

  void closed(const ertps::GUID_t& writer) {
    const Lock lock(mutex_);
    owners_.erase(writer);
  }

  /// The owner whose replies this writer sends; empty: none is known.
  [[nodiscard]] std::string owner(const ertps::GUID_t& writer) const {
    const Lock lock(mutex_);
    const auto known = owners_.find(writer);
    return known != owners_.end() ? known->second : std::string();
  }

  /// Waits until replies of the owner arrive; false at the deadline.
  [[nodiscard]] bool wait_until(const std::string& owner, Deadline deadline) const {
    Lock lock(mutex_);
    return changed_.wait_until(lock, deadline, [&]() TFDUDE_REQUIRES(mutex_) {
      return std::any_of(owners_.begin(), owners_.end(),
                         [&](const auto& known) { return known.second == owner; });
    });
  }

 private:
  mutable Mutex mutex_;
  mutable Condition changed_;
  std::map<ertps::GUID_t, std::string> owners_ TFDUDE_GUARDED_BY(mutex_);
};

}  // namespace tfdude::fastdds
