#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "support/relay.hpp"

namespace tfdude::testing {

/// A transport that loses the requests that a test selects.
class LossyRequests final : public Relay {
 public:
  /// Never called concurrently. @return whether this sending is lost
  using Loses = std::function<bool(const Request& request)>;

  LossyRequests(TransportPtr real, Loses loses)
      : Relay(std::move(real)), loses_(std::move(loses)) {}

  using Relay::send;
  Result<void> send(const std::string& partition, const Request& request,
                    Deadline deadline) override {
    {
      const std::lock_guard lock(mutex_);
      if (loses_(request)) return {};
    }
    return Relay::send(partition, request, deadline);
  }

 private:
  std::mutex mutex_;
  const Loses loses_;
};

}  // namespace tfdude::testing
