#pragma once

#include <algorithm>
#include <utility>

#include "calls/waiting_lookup.hpp"
#include "runtime/deadline.hpp"
#include "runtime/lookups.hpp"

namespace tfdude {

// Between two rounds of a call that waits, at least: at first, and at most.
inline constexpr Milliseconds kShortestPause{1};
inline constexpr Milliseconds kLongestPause{50};

/// A call of several requests, before which it is waited until lookups can be answered. If an owner
/// leaves in between, it and its data are waited for again, as by one lookup that waits.
/// @param lookups  of the participant; its end ends the pauses
/// @param wait  zero: only the call
/// @param ready  takes how long to wait. @return why nothing can be called
/// @param call  has a deadline of its own
/// @param passes  whether an error with this code may pass by itself
template <class Ready, class Call, class Passes = bool (*)(Errc)>
[[nodiscard]] auto after_wait(Lookups& lookups, Milliseconds wait, Ready ready, Call call,
                              Passes passes = may_return) -> decltype(call()) {
  const Deadline until(wait);
  for (auto pause = kShortestPause;; pause = std::min(2 * pause, kLongestPause)) {
    if (!until.over()) {
      auto there = ready(until.left());
      if (!there) return tl::unexpected(std::move(there.error()));
    }
    auto result = call();
    if (result || until.over() || !passes(result.error().code)) return result;
    // What is waited for may be there all the time.
    if (!lookups.pause(std::min(Deadline(pause).at(), until.at()))) return result;
  }
}

}  // namespace tfdude
