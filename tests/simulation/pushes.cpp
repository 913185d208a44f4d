#include "simulation/pushes.hpp"

#include <utility>

namespace tfdude::simulation {

Result<State> Pushes::watch(std::uint64_t group, const WatchRequest& request, Instant now) {
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
  if (auto state = known->second.watched.snapshot(forest_, {})) push(*std::move(state));
}

void Pushes::push_due(Instant now) {
  for (auto group = groups_.begin(); group != groups_.end();) {
    if (now >= group->second.lease) {
      group = groups_.erase(group);
      continue;
    }
    State state = group->second.watched.news(forest_);
    if (!state.entries.empty()) push(std::move(state));
    ++group;
  }
}

void Pushes::push(State&& state) {
  for (const State& piece : pieces_of(std::move(state))) push_(piece);
}

}  // namespace tfdude::simulation
