#pragma once

#include <functional>
#include <vector>

#include "partition/routing.hpp"
#include "runtime/calls.hpp"
#include "runtime/deadline.hpp"

namespace tfdude {

/// Requests in progress to the owners of several parts: each is repeated until its reply has come.
/// Belongs to one thread, which may wait for the replies or be notified of them.
class Asking {
 public:
  using Clock = Calls::Clock;
  /// An error ends the wait for this partition's reply, except kNotYet: it cannot be reached yet.
  using Send = std::function<Result<void>(const std::string& partition, const Request& request)>;

  /// @param parts  get sequence numbers; must outlive this. Parts held here are not sent.
  /// @param arrived  called once all replies have come, from another thread; must not block
  Asking(Calls& calls, std::vector<Part>& parts, std::function<void()> arrived = {});

  /// Sends the requests without a reply that are due. @return due()
  Clock::time_point send_due(Clock::time_point now, const Send& send);

  /// When the next one is due.
  [[nodiscard]] Clock::time_point due() const { return due_; }

  /// Tries again to send the requests that could not be sent yet. @return whether any is left
  bool send_unsent(const Send& send);

  /// Whether all replies have come.
  [[nodiscard]] bool complete() { return call_.wait_until(Clock::time_point::min()); }
  /// Waits until complete(); false at the deadline.
  [[nodiscard]] bool wait_until(Clock::time_point deadline) { return call_.wait_until(deadline); }

  /// Stops waiting for missing replies at the deadline: kTimeout.
  void give_up(const Deadline& deadline);

  /// Answers the parts that are held here. @return the first error, otherwise null
  const Error* answer(const std::function<Reply(const Request& request)>& here);

  /// A reply for each part, in order. Call when complete and answered.
  [[nodiscard]] std::vector<Reply> take_replies();

 private:
  struct Outgoing {
    const Request* request;
    bool unsent = false;  // it was due, but could not be sent
  };
  void send(std::size_t i, const Send& send);

  std::vector<Part>& parts_;
  std::vector<Outgoing> requests_;
  std::vector<Reply> replies_;  // one per part
  Calls::Call call_;
  int sent_ = 0;
  Milliseconds pause_;
  Clock::time_point due_ = Clock::time_point::min();
};

}  // namespace tfdude
