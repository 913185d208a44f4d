#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "base/mutex.hpp"
#include "transport/port.hpp"

namespace tfdude {

/// Receives the values of groups of watchers: of each as long as one of its users needs it.
/// Thread-safe.
class GroupReaders {
 public:
  explicit GroupReaders(Transport& transport) : transport_(transport) {}

  /// @return as Transport::watch(); on an error nothing is to be closed
  [[nodiscard]] Result<void> open(const std::string& owner, std::uint64_t group) {
    {
      const Lock lock(mutex_);
      if (users_[group]++ > 0) return {};
    }
    auto opened = transport_.watch(owner, group);
    if (!opened) {
      const Lock lock(mutex_);
      if (--users_[group] == 0) users_.erase(group);
    }
    return opened;
  }

  void close(std::uint64_t group) {
    {
      const Lock lock(mutex_);
      const auto users = users_.find(group);
      if (users == users_.end() || --users->second > 0) return;
      users_.erase(users);
    }
    transport_.unwatch(group);
  }

 private:
  Transport& transport_;
  Mutex mutex_;
  std::map<std::uint64_t, int> users_ TFDUDE_GUARDED_BY(mutex_);
};

}  // namespace tfdude
