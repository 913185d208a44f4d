#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>

#include "calls/lookup_in_progress.hpp"
#include "calls/pending_requests.hpp"
#include "tree/forest.hpp"

namespace tfdude {

/// Whether an owner, a frame or data that is missing may still come.
[[nodiscard]] bool may_return(Errc code);

/// Whether data that a lookup lacks may still come.
[[nodiscard]] bool is_worth_waiting(const Error& error, const Query& query);

/// What lookups that wait need of their participant. None of these functions may wait, except as
/// stated.
class LookupHost {
 public:
  virtual ~LookupHost() = default;

  /// The owners to ask, according to the current structure. May wait shortly if asks_for_frames().
  /// @return as Client::lookup()
  [[nodiscard]] virtual Result<LookupInProgress> plan(const WantedLookup& wanted) = 0;
  /// Whether plan() asks others for frames: nothing here tells when missing ones appear.
  [[nodiscard]] virtual bool asks_for_frames() const { return false; }
  /// Whether frames that plan() does not find do not exist.
  [[nodiscard]] virtual bool knows_all() { return true; }
  /// Whether the values pushed here would suffice: then their owners have them, too.
  [[nodiscard]] virtual bool was_pushed(const WantedLookup& wanted) const = 0;
  /// The error to return at the time limit: that of the last attempt, or that the result is not
  /// certain.
  [[nodiscard]] virtual Error last_word(Error last, const TimeLimit& limit) = 0;
  /// The owners have answered these parts of a lookup.
  virtual void asked(const std::vector<Part>& parts) { (void)parts; }
  /// The clock of sources that stamp samples; nothing if its time is not known.
  [[nodiscard]] virtual std::optional<Time> clock() const = 0;
};

/// One lookup that waits for its data, in steps: it looks here first, then asks the owners of the
/// path; again when something has changed, and at growing intervals for data that owners lack.
class WaitingLookup {
 public:
  using Clock = TimeLimit::Clock;

  /// What the lookups of a participant share.
  struct Shared {
    Forest& forest;
    ReplyTable& replies;
    RequestLink& link;
    SharedHints& hints;
    LookupHost& host;
    ReplyListener* listener;  ///< told that attend() has to be called
    Milliseconds timeout;     ///< maximum wait for the owners, for each request
  };
  /// What has happened since the last step.
  struct News {
    std::uint64_t version = 0;  ///< of what plan() would find
    bool written = false;       ///< new data may have arrived
    std::size_t waiting = 1;    ///< number of lookups that wait, of which all are rarely asked for
  };

  /// @param last  why there was no answer so far
  WaitingLookup(WantedLookup wanted, const TimeLimit& limit, Error last, Clock::time_point now)
      : wanted_(std::move(wanted)),
        limit_(limit),
        last_(std::move(last)),
        began_(now),
        until_(limit) {}

  /// @return the answer, if it is finished
  [[nodiscard]] std::optional<Result<StampedTransform>> attend(const Shared& shared,
                                                               const News& news,
                                                               Clock::time_point now);
  /// When to attend at the latest.
  [[nodiscard]] Clock::time_point next() const { return std::min(next_, limit_.at()); }

  /// What another lookup of these frames waited for has come: if this one may lack the same, it
  /// asks again at `when`.
  /// @param stamp  the instant of that one's answer
  /// @return whether it does
  bool put_forward(std::optional<Time> stamp, Clock::time_point when);

  [[nodiscard]] const WantedLookup& wanted() const { return wanted_; }
  /// Why there is no answer so far.
  [[nodiscard]] const Error& last() const { return last_; }

 private:
  using Found = Result<StampedTransform>;
  using Answer = std::optional<Found>;

  [[nodiscard]] Answer attempt(const Shared& shared, const News& news, Clock::time_point now);
  /// @param again  for the instant that the first answers have determined
  [[nodiscard]] Answer ask(const Shared& shared, const News& news, bool again,
                           Clock::time_point now);
  [[nodiscard]] Answer go_on_asking(const Shared& shared, const News& news, Clock::time_point now);
  [[nodiscard]] Answer judge(const Shared& shared, const News& news, Found found, bool far,
                             Clock::time_point now);
  [[nodiscard]] bool is_worth_waiting(const Shared& shared, const Error& error) const;
  void hurry(const Shared& shared, Clock::time_point now);
  [[nodiscard]] Clock::time_point next_attempt(const Shared& shared, const News& news,
                                               Clock::time_point now) const;

  const WantedLookup wanted_;
  const TimeLimit limit_;
  Error last_;
  const Clock::time_point began_;
  Clock::time_point next_ = Clock::time_point::min();  // attempt, or check of requests in progress
  std::uint64_t version_ = 0;                          // at the last attempt
  bool far_ = false;                                   // others lacked data then
  bool hurried_ = false;                               // was asked again for pushed values
  // Because others were answered: an attempt after the request in progress, the next attempt, or
  // one that was in vain since the last one in turn.
  enum class Forward { kNo, kAfterThis, kNext, kInVain } forward_ = Forward::kNo;
  std::optional<LookupInProgress> plan_;  // in progress,
  TimeLimit until_;                       // until this time limit
  std::optional<PendingRequests> asking_;
};

}  // namespace tfdude
