#pragma once

#include <thread>

namespace tfdude {

namespace detail {
inline thread_local std::thread::id acts_for{};
}  // namespace detail

/// The thread for which this one acts: itself, unless it does what that one waits for.
[[nodiscard]] inline std::thread::id acting_thread() {
  return detail::acts_for == std::thread::id() ? std::this_thread::get_id() : detail::acts_for;
}

/// From now on this thread acts for another one.
inline void act_for(std::thread::id other) { detail::acts_for = other; }

}  // namespace tfdude
