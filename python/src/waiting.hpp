#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <string>
#include <thread>
#include <utility>

#include "session.hpp"

namespace tfdude::python {

/// @throws ValueError for a duration below zero, where that is no wait which is over already
template <class Duration>
[[nodiscard]] Duration not_negative(Duration duration, const char* what) {
  if (duration >= Duration::zero()) return duration;
  throw py::value_error(std::string(what) + " must not be negative");
}

/// A lookup that waits for its data, without the GIL. Unlike Client::lookup() it also ends when the
/// process gets a signal, so that Ctrl-C works, and when the interpreter ends.
[[nodiscard]] Result<StampedTransform> wait_for_lookup(const Session& session, const std::string& a,
                                                       const std::string& b, const Query& query,
                                                       Milliseconds wait);

/// Ends a wait without the GIL that looks for these once in a while.
/// @throws what a signal raises; SystemExit if the interpreter ends; RuntimeError if this thread's
///   call was ended
void check_interrupted();

/// A call for asyncio, on a thread of its own, whose waits another thread can end.
class EndableCall {
 public:
  [[nodiscard]] py::object run(const py::function& call) const;
  /// From now on check_interrupted() throws within the call.
  void end() { ended_ = true; }

 private:
  std::atomic<bool> ended_{false};
};

/// The error of the last slice of a wait, which names the time of the whole.
[[nodiscard]] Error of_whole_wait(Error error, Milliseconds slice, Milliseconds wait);
/// Whether an owner, a frame or data that is missing may still come.
[[nodiscard]] bool may_return(Errc code);
/// The same of what a lookup lacks.
[[nodiscard]] bool is_worth_waiting(Errc code, const Query& query);
/// How often a wait looks.
inline constexpr Milliseconds kLook{50};

/// The value of a call that waits, and that a signal ends, too: it is repeated while its error is
/// one that waiting may help.
/// @param call  takes a client and how long to wait; returns a Result
/// @param may_help  takes an error
template <class Call, class MayHelp>
auto value_after_wait(const Session& session, Milliseconds wait, Call call, MayHelp may_help) {
  using Clock = std::chrono::steady_clock;
  const auto end = Clock::now() + std::min(wait, Milliseconds(1 << 30));
  while (true) {
    const auto left = std::chrono::ceil<Milliseconds>(end - Clock::now());
    const auto slice = std::max(std::min(left, kLook), Milliseconds(0));
    auto result = session.call([&](Client& client) { return call(client, slice); });
    if (result || !may_help(result.error())) return result;
    if (left <= Milliseconds(0)) {
      result.error() = of_whole_wait(std::move(result.error()), slice, wait);
      return result;
    }
    check_interrupted();
  }
}

/// A call of several requests, before which it is waited until lookups can be answered. If an owner
/// leaves in between, it is waited for again, as Client's own calls do.
/// @param ready  takes how long to wait. @return why nothing can be called
/// @param call  takes a client; does not wait
template <class Ready, class Call>
auto call_when_ready(const Session& session, Milliseconds wait, Ready ready, Call call)
    -> decltype(session.call(call)) {
  using Clock = std::chrono::steady_clock;
  const auto end = Clock::now() + std::min(wait, Milliseconds(1 << 30));
  auto pause = std::chrono::milliseconds(1);
  for (Milliseconds left = wait;; check_interrupted()) {
    if (left > Milliseconds(0)) {
      auto there = ready(left);
      if (!there) return tl::unexpected(std::move(there.error()));
    }
    auto result = session.call(call);
    left = std::chrono::ceil<Milliseconds>(end - Clock::now());
    if (result || left <= Milliseconds(0) || !may_return(result.error().code)) return result;
    // What is waited for may be there all the time.
    without_gil([&] { std::this_thread::sleep_for(std::min(pause, left)); });
    pause = std::min(2 * pause, kLook);
  }
}

/// The value of a call that waits for a frame or a partition.
template <class Call>
auto after_wait(const Session& session, py::handle timeout, Call call) {
  return value_of(
      value_after_wait(session, to_milliseconds(timeout, "timeout"), call, [](const Error& error) {
        return is_unknown(error.code) || error.code == Errc::kUnreachable;
      }));
}

}  // namespace tfdude::python
