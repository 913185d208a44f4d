#include "runtime/discovery.hpp"

#include <algorithm>
#include <utility>

#include "tfdude/base/id.hpp"
#include "tfdude/base/time.hpp"

#include "base/mutex.hpp"
#include "calls/call.hpp"

namespace tfdude {
namespace {

// How often a new participant checks whether it has discovered everybody.
constexpr Milliseconds kPollEvery{2};

// If nobody answers, this is often the cause.
constexpr const char* kHint = "domains, profiles or discovery servers may differ";

}  // namespace

Discovery::Discovery(Structure& structure, const Transport& transport, Milliseconds search_time,
                     Milliseconds timeout)
    : structure_(structure),
      transport_(transport),
      timeout_(timeout),
      met_by_(Deadline(search_time).at()),
      told_by_(Deadline::sum(met_by_, Deadline::sum(timeout, Deadline::sum(timeout, timeout)))) {}

bool Discovery::complete() {
  if (complete_.load(std::memory_order_relaxed) || ended_) return true;
  const auto now = Clock::now();
  const bool told = now >= told_by_;
  const bool met_all = told || transport_.discovered();
  const bool met_none = now >= met_by_ && !transport_.awaits_presence();
  const Lock lock(structure_.mutex);
  if (structure_.directory.behind() != nullptr) return false;
  const bool known = met_all ? told || structure_.directory.complete()
                             : met_none && structure_.directory.reachable_owners().empty();
  if (known) complete_.store(true, std::memory_order_relaxed);
  return known;
}

Deadline Discovery::call_deadline() const {
  const auto now = Clock::now();
  const auto meeting = complete_.load(std::memory_order_relaxed)
                           ? Milliseconds(0)
                           : std::chrono::ceil<Milliseconds>(met_by_ - now);
  return Deadline(Deadline::sum(timeout_, std::max(meeting, Milliseconds(0))), now);
}

Result<void> Discovery::await(const Deadline& deadline) {
  {
    // A partition that announced a change, and was lost before that came, may be reachable again.
    const Lock lock(structure_.mutex);
    if (structure_.directory.behind() != nullptr) fell_behind();
  }
  while (!complete()) {
    if (deadline.over())
      return tl::unexpected(undecided({Errc::kTimeout, "not all frames are known"}, deadline));
    wait_for_change(deadline);
  }
  return nobody_but_excluded();
}

// @param over  the deadline has passed
bool Discovery::lacks_frames_only(Clock::time_point now, bool over) {
  const bool met_all = now >= told_by_ || transport_.discovered();
  const Lock lock(structure_.mutex);
  const Directory& directory = structure_.directory;
  const std::uint64_t progress = directory.progress();
  if (std::exchange(progress_, progress) != progress) progress_at_ = now;
  const bool silent = over || now - progress_at_ >= kSilentFor;
  return silent && met_all && directory.behind() == nullptr && directory.incomplete() != nullptr;
}

Result<void> Discovery::await_known(const Deadline& deadline) {
  {
    const Lock lock(structure_.mutex);
    if (structure_.directory.behind() != nullptr) fell_behind();
  }
  while (!complete()) {
    const bool over = deadline.over();
    if (lacks_frames_only(Clock::now(), over)) break;
    if (over)
      return tl::unexpected(undecided({Errc::kTimeout, "not all frames are known"}, deadline));
    wait_for_change(deadline);
  }
  return nobody_but_excluded();
}

Error Discovery::ended_error(const Error& error) const {
  return {Errc::kTransport, "the client was closed: " + error.message, error.frame};
}

Result<void> Discovery::nobody_but_excluded() const {
  if (ended_unaware()) {
    return tl::unexpected(ended_error({Errc::kTimeout, "not all frames are known"}));
  }
  const auto excluded = transport_.excluded();
  if (excluded.empty()) return {};
  const Lock lock(structure_.mutex);
  if (!structure_.directory.partitions().empty()) return {};
  return fail(Errc::kNotPermitted, "no partition answers: " + excluded.front());
}

void Discovery::wait_for_partition(const std::string& name, const Deadline& deadline) {
  // A partition that hangs for a moment is reachable again without a change of the structure.
  constexpr Milliseconds kLook{50};
  Lock lock(structure_.mutex);
  while (!deadline.over() && !ended_) {
    const auto owner = structure_.directory.owner(name);
    if (owner && (*owner == kHeldHere || structure_.directory.reachable(*owner))) return;
    (void)structure_.changed.wait_until(lock, deadline.within(kLook).at());
  }
}

Error Discovery::last_word(Error error, const TimeLimit& limit) {
  if (!may_appear(error.code)) return error;
  return complete() ? explained(std::move(error)) : undecided(error, limit);
}

void Discovery::wait_for_change(const Deadline& deadline) {
  Lock lock(structure_.mutex);
  structure_.changed.wait_until(lock, deadline.within(kPollEvery).at());
}

Error Discovery::explained(Error error) {
  if (ended_unaware()) return ended_error(error);
  // Before the lock is taken: the transport has a lock of its own.
  if (const auto strangers = transport_.incompatible(); !strangers.empty()) {
    return {Errc::kIncompatible,
            error.message + ", as far as is known: " + strangers.front().text(), error.frame};
  }
  const auto excluded = transport_.excluded();
  const std::string about_keys = excluded.empty() ? "" : "; " + excluded.front();
  const Lock lock(structure_.mutex);
  if (structure_.directory.partitions().empty()) {
    if (!excluded.empty()) return {Errc::kNotPermitted, error.message + about_keys, error.frame};
    error.message += std::string("; no partition answers: ") + kHint;
    return error;
  }
  error.message += about_keys;
  const auto missed = structure_.directory.only_heard_of();
  if (!missed || error.code == Errc::kUnknownPartition) return error;
  const bool between = error.code == Errc::kNotConnected;
  return {Errc::kUnreachable,
          error.message + (between ? "; what connects them" : "; it") +
              " may belong to partition " + quote(missed->name) +
              ", which has not been reachable since " + to_string(missed->since) +
              ", and not all of its frames are known here: it " + why_absent(*missed),
          error.frame, missed->name};
}

Error Discovery::undecided(const Error& error, const TimeLimit& limit) {
  std::string missing = std::string("no participant was discovered yet; ") + kHint;
  // Before the lock is taken: the transport reports presences under a lock of its own.
  const bool awaits_presence = transport_.awaits_presence();
  if (const auto strangers = transport_.incompatible(); !strangers.empty()) {
    missing = strangers.front().text();
  } else if (const auto excluded = transport_.excluded(); !excluded.empty()) {
    missing = excluded.front();
  }
  {
    const Lock lock(structure_.mutex);
    if (const std::string* partition = structure_.directory.incomplete()) {
      missing = "partition " + quote(*partition) +
                (structure_.directory.is_cut(*partition)
                     ? " has more frames than are kept here of others (Options::others)"
                     : " has not sent all of its frames yet");
    } else if (const std::string* late = structure_.directory.behind()) {
      missing = "partition " + quote(*late) + " has made a change that has not arrived here yet";
    } else if (awaits_presence) {
      missing = "a discovered participant has not announced yet what it owns";
    } else if (!structure_.directory.reachable_owners().empty()) {
      missing = "more participants may be discovered";
    }
  }
  return {Errc::kTimeout,
          error.message + ", as far as is known after " + limit.text() + ": " + missing,
          error.frame, error.partition};
}

}  // namespace tfdude
