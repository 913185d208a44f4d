#pragma once

#include <map>
#include <string>
#include <vector>

#include "base/mutex.hpp"
#include "transport/fastdds/compat.hpp"

namespace tfdude::fastdds {

/// In which DDS partition each discovered writer stands. What an owner says of itself is believed
/// only if it comes through the partition of its name, because there DDS Security lets only the
/// owner write.
/// @par Thread safety  All functions are thread-safe.
class WriterPartitions {
 public:
  /// A writer was discovered, before any of its data. Only its first partition counts: DDS lets it
  /// change them later. One with several, or with a pattern, has none here.
  void found(const ertps::GUID_t& writer, const std::vector<std::string>& partitions) {
    const bool one =
        partitions.size() == 1 && partitions.front().find_first_of("*?[") == std::string::npos;
    const Lock lock(mutex_);
    partitions_.emplace(writer, one ? partitions.front() : std::string());
  }

  void lost(const ertps::GUID_t& writer) {
    const Lock lock(mutex_);
    partitions_.erase(writer);
  }

  /// @return empty: none, or the writer is unknown
  [[nodiscard]] std::string of(const ertps::GUID_t& writer) const {
    const Lock lock(mutex_);
    const auto known = partitions_.find(writer);
    return known != partitions_.end() ? known->second : std::string();
  }

 private:
  mutable Mutex mutex_;
  std::map<ertps::GUID_t, std::string> partitions_ TFDUDE_GUARDED_BY(mutex_);
};

}  // namespace tfdude::fastdds
