#pragma once

#include <cstdint>
#include <string>
#include <unordered_map>
#include <vector>

#include "tree/forest.hpp"

namespace tfdude {

/// A partition has removed or dropped a frame that it owned: what its tombstone says.
struct FrameRemoval {
  Owner owner = kHeldHere;
  std::uint64_t lamport_time = 0;
  std::uint32_t page = 0;  ///< the owner's page that contains the tombstone
  /// By request: frames that were below it before are removed, too, and a former owner that returns
  /// gives it up. Otherwise it was only dropped, so that others may have it.
  bool by_request = false;
};

/// The removals of frames that the tombstones of all partitions tell of. Not thread-safe.
class FrameRemovals {
 public:
  /// @return whether it was not known
  bool put(const std::string& id, const FrameRemoval& removal);
  void erase(const std::string& id, Owner owner, std::uint32_t page);
  [[nodiscard]] bool any(const std::string& id) const { return all_.count(id) != 0; }

  /// The latest removal that is later than such a claim, by another partition, and meets the
  /// condition; null: none.
  template <class Condition>
  [[nodiscard]] const FrameRemoval* find(const std::string& id, Owner owner,
                                         std::uint64_t lamport_time, Condition condition) const {
    const auto known = all_.find(id);
    if (known == all_.end()) return nullptr;
    const FrameRemoval* latest = nullptr;
    for (const FrameRemoval& one : known->second) {
      if (one.owner == owner || one.lamport_time <= lamport_time || !condition(one)) continue;
      if (latest == nullptr || latest->lamport_time < one.lamport_time) latest = &one;
    }
    return latest;
  }

 private:
  std::unordered_map<std::string, std::vector<FrameRemoval>> all_;  // one of each owner and page
};

}  // namespace tfdude
