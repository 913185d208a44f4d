#include "transport/fastdds/gate.hpp"

#include <algorithm>

#include "base/mutex.hpp"

namespace tfdude::fastdds {
namespace {

// The gate through which this thread has let in the datagram at hand, if any.
// NOLINTNEXTLINE(*-avoid-non-const-global-variables): of this thread alone
thread_local const Gate* entered = nullptr;

}  // namespace

// enter() counts itself before it reads whether the gate is shut; shut() does these in the opposite
// order. So at least one of the two sees the other (all accesses are sequentially consistent).
bool Gate::enter() {
  while (true) {
    inside_.fetch_add(1);
    if (!shut_.load()) break;
    leave();
    Lock lock(mutex_);
    changed_.wait(lock, [this]() TFDUDE_REQUIRES(mutex_) { return closed_ || pauses_ == 0; });
    if (closed_) return false;
  }
  entered = this;
  return true;
}

void Gate::leave() {
  entered = nullptr;
  inside_.fetch_sub(1);
  if (!shut_.load()) return;
  // The lock prevents a notification between the other thread's check and its sleep.
  { const Lock lock(mutex_); }
  changed_.notify_all();
}

// @return kPlaces: no place is free, and this datagram is not watched
std::size_t Gate::begin(Clock::time_point now) {
  const Clock::rep ticks = now.time_since_epoch().count();
  for (std::size_t place = 0; place < kPlaces; ++place) {
    Clock::rep none = 0;
    if (began_[place].load(std::memory_order_relaxed) == 0 &&
        began_[place].compare_exchange_strong(none, ticks, std::memory_order_relaxed)) {
      return place;
    }
  }
  return kPlaces;
}

void Gate::end(std::size_t place) {
  if (place < kPlaces) began_[place].store(0, std::memory_order_relaxed);
}

Gate::Clock::duration Gate::busy_for(Clock::time_point now) const {
  Clock::duration longest{0};
  for (const auto& began : began_) {
    const Clock::rep ticks = began.load(std::memory_order_relaxed);
    if (ticks == 0) continue;
    longest = std::max(longest, now - Clock::time_point(Clock::duration(ticks)));
  }
  return longest;
}

void Gate::shut() {
  Lock lock(mutex_);
  ++pauses_;
  shut_.store(true);
  wait_until_empty(lock);
}

void Gate::open() {
  {
    const Lock lock(mutex_);
    --pauses_;
    shut_.store(closed_ || pauses_ > 0);
  }
  changed_.notify_all();
}

void Gate::close() {
  Lock lock(mutex_);
  closed_ = true;
  shut_.store(true);
  changed_.notify_all();
  wait_until_empty(lock);
}

void Gate::wait_until_empty(Lock& lock) {
  const int own = entered == this ? 1 : 0;
  changed_.wait(lock, [this, own] { return inside_.load() <= own; });
}

}  // namespace tfdude::fastdds
