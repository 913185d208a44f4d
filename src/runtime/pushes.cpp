#include "runtime/pushes.hpp"

#include <algorithm>
#include <utility>

#include "base/mutex.hpp"

namespace tfdude {

void Pushes::stop() {
  const Lock lock(mutex_);
  stopped_ = true;
  forest_.on_commit(nullptr);
}

Result<PushedValues> Pushes::watch(std::uint64_t group, const WatchRequest& request) {
  if (auto ok = check_watch(request); !ok) return tl::unexpected(ok.error());
  Result<PushedValues> snapshot;
  {
    const Lock lock(mutex_);
    const bool first = groups_.empty();
    auto known = groups_.find(group);
    if (known == groups_.end()) {
      if (groups_.size() >= max_groups_) {
        ++refused_;
        return fail(Errc::kTooMuch, "there are " + std::to_string(groups_.size()) +
                                        " groups of watchers with different paths, the limit");
      }
      known =
          groups_.emplace(group, Group{WatchedGroup(group, request), {}, sink_.now(), false}).first;
    }
    snapshot = known->second.watched.snapshot(forest_, request.from);
    if (!snapshot) {
      end(known);
    } else {
      known->second.lease = sink_.now() + kWatchLease;
    }
    if (first && !groups_.empty() && !stopped_) forest_.on_commit([this] { sink_.wake(); });
  }
  sink_.wake();
  return snapshot;
}

void Pushes::tell_all(std::uint64_t group) {
  {
    const Lock lock(mutex_);
    const auto known = groups_.find(group);
    if (known == groups_.end()) return;
    known->second.all = true;
  }
  sink_.wake();
}

// The thread reports the end, as it may still be pushing to the group.
void Pushes::end(std::map<std::uint64_t, Group>::iterator& group) {
  ended_.push_back(group->first);
  group = groups_.erase(group);
}

std::vector<PushedValues> Pushes::take_due(Clock::time_point now, std::vector<std::uint64_t>& ended,
                                           Clock::time_point& next) {
  std::vector<PushedValues> due;
  const Lock lock(mutex_);
  for (auto group = groups_.begin(); group != groups_.end();) {
    if (now >= group->second.lease) {
      end(group);
      continue;
    }
    Group& one = group->second;
    const auto period = one.watched.request().period;
    if (now >= one.due) {
      PushedValues pushed = one.watched.next_push(forest_);
      if (!pushed.entries.empty()) {
        due.push_back(std::move(pushed));
        // Keeps the period, as far as possible.
        one.due = std::max(one.due + period, now - period);
      }
    } else {
      next = std::min(next, one.due);
    }
    if (std::exchange(one.all, false)) {
      if (auto pushed = one.watched.snapshot(forest_, {})) due.push_back(*std::move(pushed));
    }
    ++group;
  }
  // A group that is watched again continues.
  for (const std::uint64_t group : std::exchange(ended_, {})) {
    if (groups_.count(group) == 0) ended.push_back(group);
  }
  if (groups_.empty()) {
    forest_.on_commit(nullptr);
  } else {
    // To end groups that are not renewed.
    next = std::min<Clock::time_point>(next, now + std::chrono::seconds(1));
  }
  return due;
}

Pushes::Clock::time_point Pushes::run() {
  auto next = kNever;
  std::vector<std::uint64_t> ended;
  for (PushedValues& pushed : take_due(sink_.now(), ended, next)) {
    for (const PushedValues& piece : pieces_of(std::move(pushed))) sink_.push(piece);
  }
  for (const std::uint64_t group : ended) sink_.end(group);
  return next;
}

}  // namespace tfdude
