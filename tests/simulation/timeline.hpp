#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <tuple>
#include <utility>
#include <vector>

#include "support/random.hpp"

namespace tfdude::simulation {

using Instant = std::chrono::nanoseconds;  ///< since the simulation began
using std::chrono::milliseconds;

/// What an event is, and the process that it concerns.
struct Touch {
  const char* kind = "";  ///< a literal
  std::uint64_t who = 0;  ///< 0: none, or several
};

/// The future events. Of two events at the same instant, chance decides which comes first.
class Timeline {
 public:
  using Watcher = std::function<void(const Touch&)>;

  explicit Timeline(std::uint64_t seed) : order_(seed) {}

  /// Sees each event, before and after it.
  void watch(Watcher before, Watcher after) {
    before_ = std::move(before);
    after_ = std::move(after);
  }

  [[nodiscard]] Instant now() const { return now_; }
  [[nodiscard]] std::chrono::steady_clock::time_point steady() const {
    // Not zero, which means "never" in some places.
    return std::chrono::steady_clock::time_point(std::chrono::hours(1) + now_);
  }

  void at(Instant when, Touch touch, std::function<void()> what) {
    if (free_.empty()) {
      free_.push_back(events_.size());
      events_.emplace_back();
    }
    const std::size_t place = free_.back();
    free_.pop_back();
    events_[place] = {touch, std::move(what)};
    due_.push_back({std::max(when, now_), order_.engine()(), place});
    std::push_heap(due_.begin(), due_.end());
  }
  void after(Instant wait, Touch touch, std::function<void()> what) {
    at(now_ + wait, touch, std::move(what));
  }

  /// The next event, if it is due by then. @return whether there was one
  bool step(Instant until) {
    if (due_.empty() || due_.front().when > until) {
      now_ = until;
      return false;
    }
    std::pop_heap(due_.begin(), due_.end());
    now_ = due_.back().when;
    const Event next = std::exchange(events_[due_.back().place], {});
    free_.push_back(due_.back().place);
    due_.pop_back();
    if (before_) before_(next.touch);
    next.what();
    if (after_) after_(next.touch);
    return true;
  }

 private:
  struct Event {
    Touch touch;
    std::function<void()> what;
  };
  // Small, because a heap moves its elements around.
  struct Due {
    Instant when;
    std::uint64_t order;
    std::size_t place;  // of the event
    bool operator<(const Due& other) const {
      return std::tie(when, order) > std::tie(other.when, other.order);
    }
  };

  testing::Random order_;
  Instant now_{0};
  std::vector<Due> due_;  // a heap, the next one first
  std::vector<Event> events_;
  std::vector<std::size_t> free_;  // places without an event
  Watcher before_;
  Watcher after_;
};

}  // namespace tfdude::simulation
