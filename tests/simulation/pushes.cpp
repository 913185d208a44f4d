#include "simulation/pushes.hpp"

#include <utility>

namespace tfdude::simulation {

Result<PushedValues> Pushes::watch(std::uint64_t group, const WatchRequest& request, Instant now) {
  if (auto ok = check_watch(request); !ok) return tl::unexpected(ok.error());
  if (groups_.empty()) forest_.on_commit(later_);
  const auto known = groups_.try_emplace(group, Group{WatchedGroup(group, request)}).first;
  auto snapshot = known->second.watched.snapshot(forest_, request.from);
  if (snapshot) {
    known->second.lease = now + kWatchLease;
  } else {
    groups_.erase(known);
  }
  return snapshot;
}

void Pushes::tell_all(std::uint64_t group) {
  const auto known = groups_.find(group);
  if (known == groups_.end()) return;
  if (auto pushed = known->second.watched.snapshot(forest_, {})) push(*std::move(pushed));
}

void Pushes::push_due(Instant now) {
  for (auto group = groups_.begin(); group != groups_.end();) {
    if (now >= group->second.lease) {
      group = groups_.erase(group);
      continue;
    }
    PushedValues pushed = group->second.watched.next_push(forest_);
    if (!pushed.entries.empty()) push(std::move(pushed));
    ++group;
  }
}

void Pushes::push(PushedValues&& pushed) {
  for (const PushedValues& piece : pieces_of(std::move(pushed))) push_(piece);
}

}  // namespace tfdude::simulation
