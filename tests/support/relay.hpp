#pragma once

#include <memory>
#include <string>
#include <utility>

#include "transport/port.hpp"

namespace tfdude::testing {

/// A transport that passes everything to and from another one; subclasses override what shall
/// differ.
class Relay : public Transport, protected TransportHandler {
 public:
  explicit Relay(TransportPtr real) : real_(std::move(real)) {}

  Result<void> start(TransportHandler& handler) override {
    handler_ = &handler;
    return real_->start(*this);
  }
  void stop() override { real_->stop(); }
  Result<void> serve(const std::string& partition) override { return real_->serve(partition); }
  void announce(const Presence& presence) override { real_->announce(presence); }
  void publish(const Page& page) override { real_->publish(page); }
  void prepare(const std::string& partition) override { real_->prepare(partition); }
  Result<void> send(const std::string& partition, const Request& request,
                    Deadline deadline) override {
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
  std::unique_ptr<Channel<Update>> update_channel(const std::string& partition) override {
    return real_->update_channel(partition);
  }
  std::unique_ptr<Channel<JointUpdate>> joint_channel(const std::string& partition) override {
    return real_->joint_channel(partition);
  }
  Result<void> flush(Transport::Deadline deadline) override { return real_->flush(deadline); }
  void reply(const PeerId& to, const Reply& reply) override { real_->reply(to, reply); }
  Result<void> watch(const std::string& owner, std::uint64_t group) override {
    return real_->watch(owner, group);
  }
  void unwatch(std::uint64_t group) override { real_->unwatch(group); }
  void push(const PushedValues& pushed) override { real_->push(pushed); }
  void end_pushing(std::uint64_t group) override { real_->end_pushing(group); }
  Result<void> publish_clock(Time now) override { return real_->publish_clock(now); }
  bool discovered() const override { return real_->discovered(); }
  bool awaits_presence() const override { return real_->awaits_presence(); }
  Milliseconds discovery_time() const override { return real_->discovery_time(); }

 protected:
  void on_request(const PeerId& from, const Request& request) override {
    handler_->on_request(from, request);
  }
  void on_reply(const std::string& from, const Reply& reply) override {
    handler_->on_reply(from, reply);
  }
  void on_update(const Update& update) override { handler_->on_update(update); }
  void on_joints(const JointUpdate& update) override { handler_->on_joints(update); }
  void on_pushed(const PushedValues& pushed) override { handler_->on_pushed(pushed); }
  void on_watcher(std::uint64_t group) override { handler_->on_watcher(group); }
  void on_page(const Page& page) override { handler_->on_page(page); }
  bool wants_pages() const override { return handler_->wants_pages(); }
  void on_presence(const Presence& presence) override { handler_->on_presence(presence); }
  bool wants_clock() const override { return handler_->wants_clock(); }
  void on_clock(Time now) override { handler_->on_clock(now); }
  void on_lost(const std::string& partition, std::uint64_t incarnation,
               std::chrono::nanoseconds early) override {
    handler_->on_lost(partition, incarnation, early);
  }
  bool owns(std::string_view id) const override { return handler_->owns(id); }
  bool owns_joint(std::string_view name) const override { return handler_->owns_joint(name); }

  TransportHandler& handler() { return *handler_; }
  Transport& real() { return *real_; }

 private:
  const TransportPtr real_;
  TransportHandler* handler_ = nullptr;
};

}  // namespace tfdude::testing
