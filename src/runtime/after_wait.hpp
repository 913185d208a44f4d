#pragma once

#include <utility>

#include "calls/waiting_lookup.hpp"
#include "runtime/deadline.hpp"

namespace tfdude {

/// A call of several requests, before which it is waited until lookups can be answered. If an owner
/// leaves in between, it and its data are waited for again, as by one lookup that waits.
/// @param wait  zero: only the call
/// @param ready  takes how long to wait. @return why nothing can be called
/// @param call  has a deadline of its own
template <class Ready, class Call>
[[nodiscard]] auto after_wait(Milliseconds wait, Ready ready, Call call) -> decltype(call()) {
  const Deadline until(wait);
  while (true) {
    if (!until.over()) {
      auto there = ready(until.left());
      if (!there) return tl::unexpected(std::move(there.error()));
    }
    auto result = call();
    if (result || until.over() || !may_return(result.error().code)) return result;
  }
}

}  // namespace tfdude
