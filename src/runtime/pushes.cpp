#include "runtime/pushes.hpp"

#include <algorithm>
#include <iterator>
#include <string>
#include <utility>

#include "base/mutex.hpp"

namespace tfdude {
namespace {

// How long a push of many values may take to arrive, if some of it must be repeated.
constexpr Milliseconds kArrival{1000};

}  // namespace

void Pushes::stop() {
  const Lock lock(mutex_);
  stopped_ = true;
  forest_.on_commit(nullptr);
}

Result<void> Pushes::check_room(const WatchRequest& request, const std::optional<PeerId>& watcher) {
  if (groups_.size() >= max_groups_) {
    return fail(Errc::kTooMuch, "there are " + std::to_string(groups_.size()) +
                                    " groups of watchers with different paths, the limit");
  }
  if (edges_ + request.segments.size() > kMostEdges) {
    return fail(Errc::kTooMuch, "the watched paths have " + std::to_string(edges_) +
                                    " edges, of at most " + std::to_string(kMostEdges));
  }
  if (!watcher) return {};
  const auto now = sink_.now();
  forget_idle_watchers(now);
  Watcher& one = watchers_[*watcher];
  one.last = now;
  const std::size_t share = std::max<std::size_t>(max_groups_ / 2, 1);
  if (one.groups >= share && max_groups_ > 1) {
    return fail(Errc::kTooMuch, "this participant watches " + std::to_string(one.groups) +
                                    " different paths, its share of the limit");
  }
  if (one.begins.take(now)) return {};
  return fail(Errc::kTooMuch, "this participant begins to watch more than " +
                                  std::to_string(static_cast<int>(kNewPerSecond)) +
                                  " different paths per second");
}

// Their tokens are all there again by then.
void Pushes::forget_idle_watchers(Clock::time_point now) {
  constexpr std::chrono::seconds kIdle{static_cast<int>(kNewAtOnce / kNewPerSecond) + 1};
  constexpr std::size_t kFew = 64;
  if (watchers_.size() < kFew) return;
  for (auto one = watchers_.begin(); one != watchers_.end();) {
    const bool idle = one->second.groups == 0 && now - one->second.last > kIdle;
    one = idle ? watchers_.erase(one) : std::next(one);
  }
}

Result<PushedValues> Pushes::watch(std::uint64_t group, const WatchRequest& request,
                                   const std::optional<PeerId>& watcher) {
  if (auto ok = check_watch(request); !ok) return tl::unexpected(ok.error());
  Result<PushedValues> snapshot;
  {
    const Lock lock(mutex_);
    const bool first = groups_.empty();
    auto known = groups_.find(group);
    const bool begins = known == groups_.end();
    if (begins) {
      if (auto room = check_room(request, watcher); !room) {
        ++refused_;
        return tl::unexpected(std::move(room.error()));
      }
      Group begun{WatchedGroup(group, request), {}, sink_.now(), false, watcher};
      known = groups_.emplace(group, std::move(begun)).first;
      edges_ += request.segments.size();
      if (watcher) ++watchers_[*watcher].groups;
    }
    if (known->second.arrives && sink_.now() >= *known->second.arrives) {
      known->second.watched.arrived();
      known->second.arrives.reset();
    }
    snapshot = known->second.watched.snapshot(forest_, request.from, true);
    if (!snapshot) {
      end(known);
    } else {
      if (begins) known->second.watched.begin(*snapshot);
      known->second.lease = sink_.now() + kWatchLease;
    }
    if (first && !groups_.empty() && !stopped_) forest_.on_commit([this] { sink_.wake(); });
  }
  sink_.wake();
  return snapshot;
}

void Pushes::await_arrival(Group& group) {
  if (group.watched.has_rewritten() && !group.arrives) group.arrives = sink_.now() + kArrival;
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

void Pushes::keep_pending() {
  const Lock lock(mutex_);
  for (auto& [id, group] : groups_) {
    const bool all = group.watched.request().period == Milliseconds(0);
    if (!all || pending_.size() >= kMostPending) continue;
    PushedValues pushed = group.watched.next_push(forest_);
    if (!pushed.entries.empty()) pending_.push_back(std::move(pushed));
  }
}

// The thread reports the end, as it may still be pushing to the group.
void Pushes::end(std::map<std::uint64_t, Group>::iterator& group) {
  ended_.push_back(group->first);
  edges_ -= group->second.watched.request().segments.size();
  if (const auto& by = group->second.begun_by) --watchers_[*by].groups;
  group = groups_.erase(group);
}

std::vector<PushedValues> Pushes::take_due(Clock::time_point now, std::vector<std::uint64_t>& ended,
                                           Clock::time_point& next) {
  const Lock lock(mutex_);
  std::vector<PushedValues> due = std::exchange(pending_, {});
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
    const std::uint64_t group = pushed.group;
    for (const PushedValues& piece : pieces_of(std::move(pushed))) sink_.push(piece);
    const Lock lock(mutex_);
    const auto known = groups_.find(group);
    if (known != groups_.end()) await_arrival(known->second);
  }
  for (const std::uint64_t group : ended) sink_.end(group);
  return next;
}

}  // namespace tfdude
