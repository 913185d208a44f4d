#include "partition/frame_removals.hpp"

#include <algorithm>

namespace tfdude {

bool FrameRemovals::put(const std::string& id, const FrameRemoval& removal) {
  auto& all = all_[id];
  const auto known = std::find_if(all.begin(), all.end(), [&](const FrameRemoval& one) {
    return one.owner == removal.owner && one.page == removal.page;
  });
  if (known == all.end()) {
    all.push_back(removal);
    return true;
  }
  const bool is_new =
      known->lamport_time != removal.lamport_time || known->by_request != removal.by_request;
  *known = removal;
  return is_new;
}

void FrameRemovals::erase(const std::string& id, Owner owner, std::uint32_t page) {
  const auto known = all_.find(id);
  if (known == all_.end()) return;
  auto& all = known->second;
  all.erase(std::remove_if(
                all.begin(), all.end(),
                [&](const FrameRemoval& one) { return one.owner == owner && one.page == page; }),
            all.end());
  if (all.empty()) all_.erase(known);
}

}  // namespace tfdude
