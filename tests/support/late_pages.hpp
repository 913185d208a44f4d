#pragma once

#include <condition_variable>
#include <deque>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "tfdude/transport/transport.hpp"

namespace tfdude::testing {

/// A transport that can hold back what one partition says of its structure, as a starved process or a bad link does.
class LatePages final : public Transport, private TransportHandler {
 public:
  explicit LatePages(std::unique_ptr<Transport> real) : real_(std::move(real)) {}

  /// From now on the pages of this partition wait.
  void hold(const std::string& partition) {
    const std::lock_guard lock(mutex_);
    held_ = partition;
  }
  /// Lets the oldest of them through, once there is one.
  void let_one_through() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return !waiting_.empty(); });
    const Page page = std::move(waiting_.front());
    waiting_.pop_front();
    handler_->on_page(page);
  }
  /// Lets all through, as they come.
  void let_through() {
    const std::lock_guard lock(mutex_);
    held_.clear();
    for (const Page& page : std::exchange(waiting_, {})) handler_->on_page(page);
  }
  /// Waits until the partition was asked how far its structure is.
  [[nodiscard]] bool wait_until_asked(Milliseconds longest) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, longest, [this] { return asked_; });
  }

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
    const auto* remove = std::get_if<RemoveRequest>(&request.body);
    if (remove != nullptr && remove->tops.empty()) {
      const std::lock_guard lock(mutex_);
      asked_ = asked_ || partition == held_;
      changed_.notify_all();
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
  void reply(const PeerId& to, const Reply& reply) override { real_->reply(to, reply); }
  Result<void> watch(std::uint64_t group) override { return real_->watch(group); }
  void unwatch(std::uint64_t group) override { real_->unwatch(group); }
  void push(const State& state) override { real_->push(state); }
  void end_pushing(std::uint64_t group) override { real_->end_pushing(group); }
  bool settled() const override { return real_->settled(); }
  bool awaits_presence() const override { return real_->awaits_presence(); }
  Milliseconds settle_time() const override { return real_->settle_time(); }

 private:
  void on_request(const PeerId& from, const Request& request) override {
    handler_->on_request(from, request);
  }
  void on_reply(const Reply& reply) override { handler_->on_reply(reply); }
  void on_update(const Update& update) override { handler_->on_update(update); }
  void on_joints(const JointUpdate& update) override { handler_->on_joints(update); }
  void on_state(const State& state) override { handler_->on_state(state); }
  void on_page(const Page& page) override {
    const std::lock_guard lock(mutex_);
    if (page.partition != held_) return handler_->on_page(page);
    waiting_.push_back(page);
    changed_.notify_all();
  }
  void on_presence(const Presence& presence) override { handler_->on_presence(presence); }
  void on_lost(const std::string& partition, std::uint64_t incarnation) override {
    handler_->on_lost(partition, incarnation);
  }
  bool owns(std::string_view id) const override { return handler_->owns(id); }
  bool owns_joint(std::string_view name) const override { return handler_->owns_joint(name); }

  const std::unique_ptr<Transport> real_;
  TransportHandler* handler_ = nullptr;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::string held_;  // empty: none
  std::deque<Page> waiting_;
  bool asked_ = false;
};

}  // namespace tfdude::testing
