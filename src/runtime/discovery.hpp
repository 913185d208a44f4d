#pragma once

#include <atomic>
#include <chrono>
#include <string>

#include "tfdude/base/result.hpp"

#include "runtime/deadline.hpp"
#include "runtime/structure.hpp"
#include "transport/port.hpp"

namespace tfdude {

/// Whether a new participant has met all who are there, so that what it does not know does not exist; and who waits for that.
/// @par Thread safety  All functions, by callers that do not hold the structure's lock.
class Discovery {
 public:
  using Clock = Deadline::Clock;

  /// @param look_round  how long somebody is looked for where nobody is met
  /// @param timeout  of calls; those who were met, and are slow to tell what they own, are waited for three times as long
  Discovery(Structure& structure, const Transport& transport, Milliseconds look_round,
            Milliseconds timeout);

  /// Whether all that was there at the start is known, and all that owners have told of since.
  [[nodiscard]] bool complete();

  /// What an owner has told of did not come in time: what is not known here may be there until it has. By callers that
  /// hold the structure's lock.
  void fell_behind() { complete_.store(false, std::memory_order_relaxed); }

  /// Until when somebody is looked for where nobody is met.
  [[nodiscard]] Clock::time_point met_by() const { return met_by_; }

  /// When a call that begins now must be over: after the time-out; while others may still be met, the rest of that time
  /// later.
  [[nodiscard]] Deadline call_deadline() const;

  /// Whether what an error says to be missing may be met yet.
  [[nodiscard]] static bool may_appear(Errc code);

  /// Waits until it is complete. @return kTimeout, naming what was missing.
  [[nodiscard]] Result<void> await(const Deadline& deadline);

  /// Runs an operation that may fail for what is not known yet; repeats it until it is known for sure.
  /// @return also kTimeout, where it was not known by then
  template <class Operation>
  auto retry_until_known(const Deadline& deadline, Operation operation) -> decltype(operation()) {
    while (true) {
      const bool certain = complete();
      auto result = operation();
      if (result || !may_appear(result.error().code)) return result;
      if (certain) return tl::unexpected(explained(std::move(result.error())));
      if (deadline.over()) return tl::unexpected(undecided(result.error().message, deadline));
      wait_for_change(deadline);
    }
  }

  /// What is to be said of an operation that has failed, and is not repeated any more.
  [[nodiscard]] Error last_word(Error error, const Deadline& deadline);

  /// Until something has changed, or for a moment.
  void wait_for_change(const Deadline& deadline = Deadline(Milliseconds::max()));

 private:
  /// Of what seems not to be there, as others know more.
  [[nodiscard]] Error explained(Error error);
  /// Why it is not known yet: kTimeout.
  [[nodiscard]] Error undecided(const std::string& what, const Deadline& deadline);

  Structure& structure_;
  const Transport& transport_;
  const Milliseconds timeout_;
  const Clock::time_point met_by_;
  const Clock::time_point told_by_;  // who has not told by then what it owns is not waited for
  std::atomic<bool> complete_{false};
};

}  // namespace tfdude
