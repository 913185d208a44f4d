#pragma once

#include <chrono>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "tfdude/types/query.hpp"

#include "partition/messages.hpp"
#include "partition/routing.hpp"
#include "runtime/callbacks.hpp"

namespace tfdude {

/// What is planned with.
struct KnownStructure {
  const Forest& forest;
  const Directory& directory;
  std::uint64_t own_incarnation = 0;  ///< of the partition of this process
};

/// @param rate  [Hz]; 0: every sample
[[nodiscard]] inline std::chrono::nanoseconds watch_period(double rate) {
  return std::chrono::nanoseconds(rate > 0 ? std::llround(1e9 / rate) : 0);
}

/// Whether an owner that has denied values so would deny them again, so that the next renewal is
/// soon enough.
[[nodiscard]] inline bool would_deny_again(Errc code) {
  return code == Errc::kNotPermitted || code == Errc::kTooMuch || code == Errc::kUnsupported;
}

/// Something that is watched at its owners: what differs between a path and a partition.
/// WatchRounds does what they have in common.
/// @par Thread safety  All functions are thread-safe; those of rounds are called by one thread.
class Watched {
 public:
  using Clock = std::chrono::steady_clock;

  /// Edges that one owner pushes together.
  struct Group {
    std::uint64_t id = 0;
    Part part;  ///< a WatchRequest
  };
  struct Plan {
    std::vector<Group> groups;  ///< none: nothing is pushed
    bool is_new = false;        ///< it differs from the one before
  };

  virtual ~Watched() = default;

  /// Applies pushed values, or a reply. @return whether values are missing, which must be requested
  virtual bool take(const PushedValues& pushed, Clock::time_point now) = 0;
  /// The client ends: nobody waits for values any more.
  virtual void end_waits() {}
  /// Nothing comes any more, as the client has ended.
  virtual void end() = 0;
  /// Where functions of the user are called, which are destroyed with this; null: it has none.
  [[nodiscard]] virtual std::shared_ptr<Callbacks::Line> calls_on() const { return nullptr; }
  /// Whether pushed values suffice for this lookup.
  [[nodiscard]] virtual bool can_answer(const std::string& /*a*/, const std::string& /*b*/,
                                        const Query& /*query*/) const {
    return false;
  }

  /// Tells what has been written to memory that it is read from. Without a lock of the caller.
  struct Looked {
    bool is_new = false;
    Clock::time_point again = Clock::time_point::max();  ///< when to look again
  };
  virtual Looked look(Clock::time_point /*now*/) { return {}; }
  /// The owners whose memory it is read from.
  [[nodiscard]] virtual std::set<Owner> owners_in_memory() const { return {}; }

  // --- rounds ---

  /// The frames that it concerns: a participant that does not keep all asks for them first.
  [[nodiscard]] virtual std::vector<std::string> frames() const { return {}; }
  /// Plans with the structure, whose lock is held.
  [[nodiscard]] virtual Result<void> plan(const KnownStructure& known) = 0;
  /// Adopts what was planned.
  [[nodiscard]] virtual Plan adopt(Clock::time_point now) = 0;
  /// There is no plan. @return whether to leave it so until something changes
  virtual bool on_no_plan(Error why, Clock::time_point now) = 0;
  /// Values cannot be received. @return whether to leave it so until the next renewal
  virtual bool on_deaf(Error why) = 0;
  /// An owner has not answered with values. @param why  null: with those of another group
  /// @return whether to leave it so until the next renewal
  virtual bool on_denied(const Part& part, const Error* why) = 0;
  /// All owners have answered, and nothing is missing.
  virtual void on_complete() {}

  /// Whether values of the plan are missing, or may be.
  [[nodiscard]] virtual bool lacks(Clock::time_point now) const = 0;
  /// The instant from which samples are requested.
  [[nodiscard]] virtual std::optional<Time> lacks_from() = 0;
  /// As lacks_from(), if the answers show that still earlier samples are needed.
  [[nodiscard]] virtual std::optional<Time> lacks_earlier() { return std::nullopt; }
  /// All owners have told all samples from this instant on.
  virtual void on_told_from(Time /*from*/, Clock::time_point /*now*/) {}
  /// The groups whose values are needed.
  [[nodiscard]] virtual std::set<std::uint64_t> groups(Clock::time_point now) = 0;
  /// After how many periods of renewal it is renewed.
  [[nodiscard]] virtual unsigned periods() const = 0;
};

}  // namespace tfdude
