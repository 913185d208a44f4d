#include "runtime/open_groups.hpp"

#include <algorithm>

namespace tfdude {

std::vector<std::uint64_t> OpenGroups::take_unused(const std::set<std::uint64_t>& used,
                                                   Clock::time_point now) {
  std::vector<std::uint64_t> unused;
  for (auto& [group, last_used] : last_used_) {
    if (used.count(group) > 0) {
      last_used = now;
    } else {
      unused.push_back(group);
    }
  }
  std::sort(unused.begin(), unused.end(),
            [&](std::uint64_t a, std::uint64_t b) { return last_used_.at(a) > last_used_.at(b); });
  std::size_t kept = 0;
  while (kept < unused.size() && kept < kMostUnused && now - last_used_.at(unused[kept]) < kKept) {
    ++kept;
  }
  unused.erase(unused.begin(), unused.begin() + static_cast<std::ptrdiff_t>(kept));
  for (const std::uint64_t group : unused) last_used_.erase(group);
  return unused;
}

}  // namespace tfdude
