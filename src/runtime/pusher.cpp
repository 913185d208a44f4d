#include "runtime/pusher.hpp"

#include <algorithm>
#include <utility>

#include "base/mutex.hpp"

namespace tfdude {

Pusher::Pusher(Forest& forest, std::size_t max_groups, Push push, End end)
    : forest_(forest),
      max_groups_(max_groups),
      push_(std::move(push)),
      end_(std::move(end)),
      thread_([this] { run(); }) {}

void Pusher::stop() {
  forest_.on_commit(nullptr);
  {
    const Lock lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_one();
  if (thread_.joinable()) thread_.join();
}

Result<PushedValues> Pusher::watch(std::uint64_t group, const WatchRequest& request) {
  if (auto ok = check_watch(request); !ok) return tl::unexpected(ok.error());
  Result<PushedValues> snapshot;
  {
    const Lock lock(groups_mutex_);
    const bool first = groups_.empty();
    auto known = groups_.find(group);
    if (known == groups_.end()) {
      if (groups_.size() >= max_groups_) {
        ++refused_;
        return fail(Errc::kTooMuch, "there are " + std::to_string(groups_.size()) +
                                        " groups of watchers with different paths, the limit");
      }
      known = groups_.emplace(group, Group{WatchedGroup(group, request), {}, Clock::now(), false})
                  .first;
    }
    snapshot = known->second.watched.snapshot(forest_, request.from);
    if (!snapshot) {
      end(known);
    } else {
      known->second.lease = Clock::now() + kWatchLease;
    }
    if (first && !groups_.empty()) forest_.on_commit([this] { ask(); });
  }
  ask();
  return snapshot;
}

void Pusher::tell_all(std::uint64_t group) {
  {
    const Lock lock(groups_mutex_);
    const auto known = groups_.find(group);
    if (known == groups_.end()) return;
    known->second.all = true;
  }
  ask();
}

// The thread reports the end, as it may still be pushing to the group.
void Pusher::end(std::map<std::uint64_t, Group>::iterator& group) {
  ended_.push_back(group->first);
  group = groups_.erase(group);
}

void Pusher::ask() {
  if (asked_.exchange(true)) return;
  // The lock prevents a notification between the thread's check and its sleep.
  { const Lock lock(mutex_); }
  changed_.notify_one();
}

std::vector<PushedValues> Pusher::take_due(Clock::time_point now, std::vector<std::uint64_t>& ended,
                                           std::optional<Clock::time_point>& next) {
  std::vector<PushedValues> due;
  const Lock lock(groups_mutex_);
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
      next = next ? std::min(*next, one.due) : one.due;
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
    const auto look = now + std::chrono::seconds(1);
    next = next ? std::min(*next, look) : look;
  }
  return due;
}

void Pusher::run() {
  std::optional<Clock::time_point> next;
  Lock lock(mutex_);
  while (true) {
    const auto woken = [this]() TFDUDE_REQUIRES(mutex_) { return stopping_ || asked_.load(); };
    if (next) {
      changed_.wait_until(lock, *next, woken);
    } else {
      changed_.wait(lock, woken);
    }
    if (stopping_) return;
    lock.unlock();
    // Before the check, so that writes meanwhile are not missed.
    asked_.store(false);
    next.reset();
    std::vector<std::uint64_t> ended;
    for (PushedValues& pushed : take_due(Clock::now(), ended, next)) {
      for (const PushedValues& piece : pieces_of(std::move(pushed))) push_(piece);
    }
    for (const std::uint64_t group : ended) end_(group);
    lock.lock();
  }
}

}  // namespace tfdude
