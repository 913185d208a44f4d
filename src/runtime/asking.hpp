#pragma once

#include <functional>
#include <vector>

#include "partition/routing.hpp"
#include "runtime/calls.hpp"
#include "runtime/deadline.hpp"

namespace tfdude {

/// Requests under way to the owners of several parts: each is sent again until its reply has come. Belongs to one thread,
/// which may wait for the replies or be told of them.
class Asking {
 public:
  using Clock = Calls::Clock;
  /// An error other than kNotYet ends the wait for this partition's reply.
  using Send = std::function<Result<void>(const std::string& partition, const Request& request)>;

  /// @param parts  get sequence numbers; must outlive this. Those held here are not asked.
  /// @param arrived  told once all replies have come, from another thread, which must not be kept waiting
  Asking(Calls& calls, std::vector<Part>& parts, std::function<void()> arrived = {});

  /// Sends those requests that lack a reply, where that is due. @return when it is due again
  Clock::time_point send_due(Clock::time_point now, const Send& send);

  /// Whether all replies have come.
  [[nodiscard]] bool complete() { return call_.wait_until(Clock::time_point::min()); }
  /// Waits for that; false at the deadline.
  [[nodiscard]] bool wait_until(Clock::time_point deadline) { return call_.wait_until(deadline); }

  /// Whoever has not replied by the deadline is not waited for any more: kTimeout.
  void give_up(const Deadline& deadline);

  /// Answers the parts that are held here. @return the first that is an error, else null
  const Error* answer(const std::function<Reply(const Request& request)>& here);

  /// A reply for each part, in order; once complete and answered.
  [[nodiscard]] std::vector<Reply> take_replies();

 private:
  std::vector<Part>& parts_;
  std::vector<const Request*> requests_;  // those that travel
  std::vector<Reply> replies_;            // one a part
  Calls::Call call_;
  int sent_ = 0;
  Milliseconds pause_;
  Clock::time_point due_ = Clock::time_point::min();
};

}  // namespace tfdude
