#pragma once

#include <algorithm>
#include <chrono>
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
    events_.push_back({std::max(when, now_), order_.engine()(), ++count_, touch, std::move(what)});
    std::push_heap(events_.begin(), events_.end());
  }
  void after(Instant wait, Touch touch, std::function<void()> what) {
    at(now_ + wait, touch, std::move(what));
  }

  /// The next event, if it is due by then. @return whether there was one
  bool step(Instant until) {
    if (events_.empty() || events_.front().when > until) {
      now_ = until;
      return false;
    }
    std::pop_heap(events_.begin(), events_.end());
    const Event next = std::move(events_.back());
    events_.pop_back();
    now_ = next.when;
    if (before_) before_(next.touch);
    next.what();
    if (after_) after_(next.touch);
    return true;
  }

 private:
  struct Event {
    Instant when;
    std::uint64_t order;
    std::uint64_t number;
    Touch touch;
    std::function<void()> what;
    bool operator<(const Event& other) const {
      return std::tie(when, order, number) > std::tie(other.when, other.order, other.number);
    }
  };

  testing::Random order_;
  Instant now_{0};
  std::uint64_t count_ = 0;
  std::vector<Event> events_;  // a heap, the next one first
  Watcher before_;
  Watcher after_;
};

}  // namespace tfdude::simulation
