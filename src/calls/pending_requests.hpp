#pragma once

#include <vector>

#include "calls/reply_table.hpp"
#include "calls/time_limit.hpp"
#include "partition/routing.hpp"

namespace tfdude {

/// How requests leave.
class RequestLink {
 public:
  virtual ~RequestLink() = default;

  /// Sends a request once.
  /// @param until  how long it may be waited until the partition can be reached
  /// @return kTimeout if it cannot be reached yet; any other error is final
  [[nodiscard]] virtual Result<void> send(const std::string& partition, const Request& request,
                                          TimeLimit::Clock::time_point until) = 0;

  /// The reply of this process itself.
  [[nodiscard]] virtual Reply answer(const Request& request) = 0;
};

/// Requests in progress to the owners of several parts: each is repeated until its reply has come.
/// Belongs to one thread, which may wait for the replies or be notified of them.
class PendingRequests {
 public:
  using Clock = TimeLimit::Clock;

  /// Of several owners that are still being discovered, the first is waited for at most so long
  /// before all are tried again.
  static constexpr Milliseconds kTurn{2};

  /// @param parts  get sequence numbers; must outlive this. Parts held here are not sent.
  /// @param listener  as ReplyTable::Call
  PendingRequests(ReplyTable& table, std::vector<Part>& parts, const TimeLimit& limit,
                  ReplyListener* listener = nullptr);

  [[nodiscard]] const std::vector<Part>& parts() const { return parts_; }

  /// For a thread that waits for the replies: answers what is held here, sends what is due, and
  /// gives up at the time limit. @return when to go on, unless complete() before
  Clock::time_point step(Clock::time_point now, RequestLink& link);

  /// Sends the requests without a reply that are due. @return when the next one is due
  Clock::time_point send_due(Clock::time_point now, RequestLink& link);

  /// Whether all replies have come.
  [[nodiscard]] bool complete() { return call_.wait_until(Clock::time_point::min()); }
  /// Waits until complete(); false at the deadline.
  [[nodiscard]] bool wait_until(Clock::time_point deadline) { return call_.wait_until(deadline); }

  /// Stops waiting for missing replies: kTimeout.
  void give_up();

  /// Answers the parts that are held here, once. @return the first error, otherwise null
  const Error* answer(RequestLink& link);

  /// A reply for each part, in order. Call when complete and answered.
  [[nodiscard]] std::vector<Reply> take_replies();

 private:
  struct Outgoing {
    const Request* request = nullptr;
    bool unsent = false;  // it was due, but could not be sent
  };
  [[nodiscard]] bool has_unsent() const;
  [[nodiscard]] bool send_unsent(Clock::time_point now, RequestLink& link);
  void send(std::size_t i, Clock::time_point now, Clock::time_point until, RequestLink& link);

  std::vector<Part>& parts_;
  const TimeLimit limit_;
  std::vector<Outgoing> requests_;
  std::vector<Reply> replies_;  // one per part
  ReplyTable::Call call_;
  bool answered_ = false;
  int sent_ = 0;
  Milliseconds pause_;
  Clock::time_point due_ = Clock::time_point::min();
};

}  // namespace tfdude
