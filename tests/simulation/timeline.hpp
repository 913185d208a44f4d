#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <functional>
#include <queue>
#include <tuple>
#include <utility>
#include <vector>

#include "support/random.hpp"

namespace tfdude::simulation {

using Instant = std::chrono::nanoseconds;  ///< since the simulation began
using std::chrono::milliseconds;

/// The future events. Of two events at the same instant, chance decides which comes first.
class Timeline {
 public:
  explicit Timeline(std::uint64_t seed) : order_(seed) {}

  [[nodiscard]] Instant now() const { return now_; }
  [[nodiscard]] std::chrono::steady_clock::time_point steady() const {
    // Not zero, which means "never" in some places.
    return std::chrono::steady_clock::time_point(std::chrono::hours(1) + now_);
  }

  void at(Instant when, std::function<void()> what) {
    events_.push({std::max(when, now_), order_.engine()(), ++count_, std::move(what)});
  }
  void after(Instant wait, std::function<void()> what) { at(now_ + wait, std::move(what)); }

  /// The next event, if it is due by then. @return whether there was one
  bool step(Instant until) {
    if (events_.empty() || events_.top().when > until) {
      now_ = until;
      return false;
    }
    const auto what = events_.top().what;
    now_ = events_.top().when;
    events_.pop();
    what();
    return true;
  }

 private:
  struct Event {
    Instant when;
    std::uint64_t order;
    std::uint64_t number;
    std::function<void()> what;
    bool operator<(const Event& other) const {
      return std::tie(when, order, number) > std::tie(other.when, other.order, other.number);
    }
  };

  testing::Random order_;
  Instant now_{0};
  std::uint64_t count_ = 0;
  std::priority_queue<Event> events_;
};

}  // namespace tfdude::simulation
