#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "tfdude/transport/transport.hpp"

namespace tfdude::testing {

/// A transport that loses those requests that a test wants lost.
class LossyRequests final : public Transport {
 public:
  /// Called one after the other. @return whether this sending is lost
  using Loses = std::function<bool(const Request& request)>;

  LossyRequests(std::unique_ptr<Transport> real, Loses loses)
      : real_(std::move(real)), loses_(std::move(loses)) {}

  Result<void> start(TransportHandler& handler) override { return real_->start(handler); }
  void stop() override { real_->stop(); }
  Result<void> serve(const std::string& partition) override { return real_->serve(partition); }
  void announce(const Presence& presence) override { real_->announce(presence); }
  void publish(const Page& page) override { real_->publish(page); }
  void prepare(const std::string& partition) override { real_->prepare(partition); }
  Result<void> send(const std::string& partition, const Request& request,
                    Deadline deadline) override {
    {
      const std::lock_guard lock(mutex_);
      if (loses_(request)) return {};
    }
    return real_->send(partition, request, deadline);
  }
  Result<void> send(const std::string& partition, const Update& update,
                    Deadline deadline) override {
    return real_->send(partition, update, deadline);
  }
  Result<void> send(const std::string& partition, const JointUpdate& update,
                    Deadline deadline) override {
    return real_->send(partition, update, deadline);
  }
  Result<void> flush(Deadline deadline) override { return real_->flush(deadline); }
  void reply(const PeerId& to, const Reply& reply) override { real_->reply(to, reply); }
  Result<void> watch(std::uint64_t group) override { return real_->watch(group); }
  void unwatch(std::uint64_t group) override { real_->unwatch(group); }
  void push(const State& state) override { real_->push(state); }
  void end_pushing(std::uint64_t group) override { real_->end_pushing(group); }
  bool settled() const override { return real_->settled(); }
  bool awaits_presence() const override { return real_->awaits_presence(); }
  Milliseconds settle_time() const override { return real_->settle_time(); }

 private:
  const std::unique_ptr<Transport> real_;
  std::mutex mutex_;
  const Loses loses_;
};

}  // namespace tfdude::testing
